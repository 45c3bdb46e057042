"""The gates: is there a residual, does a model fit, and is it the only one?

1 detect. T^2 of the calibrated base model against its parametric bootstrap with re-calibration, and the directed
  statistic max_k (drop of T^2 by effect k) against the same bootstrap. Passed if either p <= 0.005.
2 adequate. T^2 of the best model against its own bootstrap with re-calibration: p >= 0.05.
3 unambiguous. The runner-up is at least 4 behind in B = T^2 + ln|Sigma| - ln|Sigma_base| + m ln d, with m amplitudes
  and d summaries: between effects with one amplitude each this is the gap of T^2; a second amplitude pays ln d (BIC).

4 told apart. Every rival that the data cannot reject stays in the answer (rivals.py).

Every set is fitted with the full emulator within its bounds, not with a linearised one. p = (1 + #{T_b >= T})/(1 + B).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.emulation.predictor import Predictor
from doe.diagnose.fitting.calibrate import Evidence, Fit
from doe.diagnose.fitting.misfit import best_start, build_misfit, minimise
from doe.diagnose.fitting.pseudo_data import PseudoData, draw_pseudo_data
from doe.record import Record

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Limits(Record):
    """Limits of the gates. detect: level of each of the two tests. reach: least shift, in sigma, that an effect must be
    able to cause to enter the race. pair_gain: BIC by which a pair must beat the best single effect. chance: of
    specificity.py, for pairs. rival: of rivals.py. held_out: of held_out.py, where a contender leaves the
    race (closer.py). contradicted: of held_out.py, below which a name is contradicted.
    """

    detect: float = 0.005
    adequate: float = 0.05
    gap: float = 4.0
    pair_gain: float = 6.0
    reach: float = 3.0
    chance: float = 0.01
    rival: float = 0.05
    held_out: float = 12.0
    contradicted: float = 0.001


@dataclass(frozen=True)
class Gate(Record):
    """One test: statistic, p (None where it has none), limit of p or of the statistic, and whether it was passed."""

    name: str
    statistic: float
    p: float | None
    limit: float
    passed: bool
    statement: str


@dataclass(frozen=True)
class Detection:
    """Both tests of gate 1, and per effect the drop of T^2 under the base model's Sigma with its own bootstrap p."""

    overall: Gate
    directed: Gate
    drops: dict[int, float]
    drop_p: dict[int, float]

    @property
    def passed(self) -> bool:
        """Return whether either test sees a residual."""
        return self.overall.passed or self.directed.passed


@dataclass(frozen=True)
class Adequacy:
    """Gate 2, and the refits behind it: x (B, q), the sampling distribution of the fitted model's variables."""

    gate: Gate
    refits: FloatArray


def detect(
    emulator: Emulator,
    evidence: Evidence,
    base: Fit,
    singles: Mapping[int, Fit],
    limits: Limits,
    sets: int,
    seed: int,
) -> Detection:
    """Return gate 1. singles: effect -> its fit under the Sigma of the base fit, the same for all."""
    pseudo = draw_pseudo_data(emulator, evidence, base, sets, seed)
    k, size = base.predictor.parameters, sum(m.size for m in evidence.means)
    null = refit(base.predictor, pseudo, evidence, base.x)[1]
    p_overall = bootstrap_p(base.t2, null)
    overall = Gate(
        "detect: T2 of the base model",
        base.t2,
        p_overall,
        limits.detect,
        p_overall <= limits.detect,
        f"T2 = {base.t2:.1f} on {base.df} degrees of freedom, p = {p_overall:.4f}",
    )
    drops = {e: base.t2 - fit.t2 for e, fit in singles.items()}
    charge = {e: (emulator.declared.effects[e].amplitudes - 1) * math.log(size) for e in singles}
    null_drops = {e: null - refit(fit.predictor, pseudo, evidence, base.x[:k])[1] for e, fit in singles.items()}
    best = max(drops, key=lambda e: drops[e] - charge[e], default=None)
    if best is None:
        directed = Gate("detect: largest drop by an effect", 0.0, 1.0, limits.detect, False, "no effect to ask")
    else:
        highest = np.max([null_drops[e] - charge[e] for e in singles], axis=0)
        p = bootstrap_p(drops[best] - charge[best], highest)
        name = emulator.declared.effects[best].name
        directed = Gate(
            "detect: largest drop by an effect",
            drops[best],
            p,
            limits.detect,
            p <= limits.detect,
            f"{name} lowers T2 by {drops[best]:.1f}, p = {p:.4f} for the largest of {len(singles)} effects",
        )
    return Detection(overall, directed, drops, {e: bootstrap_p(drops[e], null_drops[e]) for e in singles})


def adequate(
    emulator: Emulator, evidence: Evidence, fit: Fit, label: str, limits: Limits, sets: int, seed: int
) -> Adequacy:
    """Return gate 2 for a fitted model."""
    pseudo = draw_pseudo_data(emulator, evidence, fit, sets, seed)
    refits, null = refit(fit.predictor, pseudo, evidence, fit.x)
    p = bootstrap_p(fit.t2, null)
    return Adequacy(
        Gate(
            f"adequate: {label}",
            fit.t2,
            p,
            limits.adequate,
            p >= limits.adequate,
            f"T2 = {fit.t2:.1f} on {fit.df} degrees of freedom, p = {p:.3f}",
        ),
        refits,
    )


def unambiguous(criteria: Mapping[str, float], limits: Limits) -> tuple[Gate, tuple[str, ...]]:
    """Return gate 3 and the names within the gap of the best, best first. criteria: name -> B, see above."""
    order = sorted(criteria, key=lambda name: criteria[name])
    near = tuple(name for name in order if criteria[name] - criteria[order[0]] < limits.gap)
    gap = criteria[order[1]] - criteria[order[0]] if len(order) > 1 else math.inf
    statement = f"{order[1]} is {gap:.1f} behind {order[0]}" if len(order) > 1 else f"{order[0]} stands alone"
    return Gate("unambiguous: gap to the runner-up", gap, None, limits.gap, len(near) == 1, statement), near


def criterion(fit: Fit, base: Fit, evidence: Evidence) -> float:
    """Return B of a fit: T^2 + ln|Sigma| - ln|Sigma_base| + m ln d."""
    amplitudes = len(fit.x) - fit.predictor.parameters
    return fit.deviance - base.log_determinant + amplitudes * math.log(sum(m.size for m in evidence.means))


def bootstrap_p(value: float, null: FloatArray) -> float:
    """Return (1 + number of null values >= value)/(1 + number), NaN values left out."""
    valid = null[np.isfinite(null)]
    return float((1 + (valid >= value).sum()) / (1 + valid.size))


def evidence_weights(criteria: Sequence[float]) -> FloatArray:
    """Return exp(-B/2) normalised to one over the models of the race (Burnham and Anderson 2002, ch. 2)."""
    values = np.asarray(criteria, dtype=np.float64)
    raw = np.exp(-(values - values.min()) / 2)
    return np.asarray(raw / raw.sum())


def refit(
    predictor: Predictor, pseudo: PseudoData, evidence: Evidence, start: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return x and T^2 of every pseudo-data set.

    A start with all variables is used as it is (the truth of the sets); with parameters only, amplitudes are looked
    for.
    """
    misfit = build_misfit(predictor, pseudo.means, pseudo.weights, pseudo.prior_mean, evidence.prior_weight)
    complete = len(start) == len(predictor.low)
    first = np.broadcast_to(start, (len(misfit.square), len(start))).copy() if complete else best_start(misfit, start)
    return minimise(misfit, first)
