"""Emulator: the summaries as polynomials of the parameters and of each effect's amplitude, by least squares.

    y(theta, a) = base(theta) + g_e(theta, a) + noise,   g_e(theta, 0) = 0

One regression per condition over all its runs: runs with an effect also teach the base. Which terms an effect (and the
base) gets is chosen by leave-one-out error of the simulated runs, never by the measured data. Parameters
and amplitudes are coded (runs.py). Prediction outside the sampled box is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulation.block import Block, Rows, fit_block
from doe.diagnose.emulation.fresh_pours import FreshPours, anchored
from doe.diagnose.emulation.predictor import Predictor
from doe.diagnose.emulation.terms import base_candidates, effect_candidates, monomials
from doe.diagnose.runs import BASE, Declared, Runs
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

RUNS_PER_TERM = 2.0
"""Own runs asked for per own term of the base or of an effect."""

TOLERATED = 1.2
"""Leave-one-out error, relative to the least, up to which the richer polynomial is taken: a term left out is a bias
that
the prediction's standard error does not know of."""


@dataclass(frozen=True)
class Emulator:
    """All conditions with the same terms. effect_exponents: per declared effect (terms, k + amplitudes), no rows where
    the effect was not simulated enough. low, high: per effect, the sampled range of its coded amplitudes, zero
    included. theta_low, theta_high: (k,) sampled range of the coded parameters. fresh: the newest
    pours at the best fit of each model that has some; they hold its predictions.
    """

    declared: Declared
    base_exponents: IntArray
    effect_exponents: tuple[IntArray, ...]
    blocks: tuple[Block, ...]
    theta_low: FloatArray
    theta_high: FloatArray
    low: tuple[FloatArray, ...]
    high: tuple[FloatArray, ...]
    fresh: tuple[FreshPours, ...] = ()

    @property
    def simulated_effects(self) -> tuple[int, ...]:
        """Return the indices of the effects that have terms."""
        return tuple(e for e, exponents in enumerate(self.effect_exponents) if len(exponents))

    def predictor(self, members: tuple[int, ...]) -> Predictor:
        """Return the model with these effects on: none (base), one, or two whose changes add up.

        Raises StatisticsError for an effect that was not simulated.
        """
        k = len(self.declared.parameters)
        names = [self.declared.effects[e].name for e in members]
        missing = [n for n, e in zip(names, members, strict=True) if not len(self.effect_exponents[e])]
        if missing:
            raise StatisticsError(f"effect {', '.join(missing)} has too few simulated runs to be predicted")
        sizes = [self.declared.effects[e].amplitudes for e in members]
        q = k + sum(sizes)
        starts = np.cumsum([len(self.base_exponents), *(len(e) for e in self.effect_exponents)])
        exponents = [_widened(self.base_exponents, np.arange(k), q)]
        columns = [np.arange(len(self.base_exponents))]
        first = k
        for e, size in zip(members, sizes, strict=True):
            places = np.concatenate([np.arange(k), np.arange(first, first + size)])
            exponents.append(_widened(self.effect_exponents[e], places, q))
            columns.append(np.arange(starts[e], starts[e + 1]))
            first += size
        chosen = np.concatenate(columns)
        predictor = Predictor(
            parameters=k,
            exponents=np.concatenate(exponents),
            coefficients=tuple(b.coefficients[chosen] for b in self.blocks),
            information_inverse=tuple(b.information_inverse[np.ix_(chosen, chosen)] for b in self.blocks),
            pour_covariance=tuple(b.noise.covariance for b in self.blocks),
            lack_of_fit=tuple(b.lack_of_fit for b in self.blocks),
            excess=tuple(b.excess[list(members)] for b in self.blocks),
            amplitudes=tuple(sizes),
            low=np.concatenate([self.theta_low, *(self.low[e] for e in members)]),
            high=np.concatenate([self.theta_high, *(self.high[e] for e in members)]),
            columns=chosen,
        )
        held = next((one for one in self.fresh if one.members == members), None)
        return predictor if held is None else anchored(predictor, held.coded(self.declared), held.blocks)

    def shared_shares(self, one: Predictor, x: FloatArray, other: Predictor, y: FloatArray) -> tuple[float, ...]:
        """Return per condition the covariance, in pours, of predictions of two models at x (q,) and y.

        It is terms(x)' (X'X)^-1 terms(y). What an anchor knows is not shared: pours about a fit are a model's own.
        """
        steps = one.step(x), other.step(y)
        return tuple(
            float(steps[0] @ block.information_inverse[np.ix_(one.columns, other.columns)] @ steps[1])
            for block in self.blocks
        )


def fit_emulator(declared: Declared, runs: Runs, floors: tuple[FloatArray, ...]) -> Emulator:
    """Fit every condition. floors: per condition (d_c,), least standard deviation of one pour per summary.

    Raises StatisticsError when the base runs cannot carry a linear model of the parameters.
    """
    theta = declared.coded(runs.theta)
    points = [np.concatenate([theta, runs.amplitude[:, : e.amplitudes] / e.scale], axis=1) for e in declared.effects]
    base = _choose_base(theta, runs)
    effects = tuple(_choose_effect(e, theta, points[e], base, runs, declared) for e in range(len(points)))
    design = _design(theta, points, base, effects, runs)
    own = [points[e][runs.effect == e][:, theta.shape[1] :] for e in range(len(points))]
    level = np.zeros(len(theta))
    for e, amplitude in enumerate(own):
        level[runs.effect == e] = (amplitude**2).sum(axis=1)
    zero = [np.zeros((1, e.amplitudes)) for e in declared.effects]
    used = np.any([runs.simulated(c) for c in range(len(runs.blocks))], axis=0)
    return Emulator(
        declared=declared,
        base_exponents=base,
        effect_exponents=effects,
        blocks=tuple(
            fit_block(_rows(design, level, runs, c), len(declared.effects), floors[c]) for c in range(len(runs.blocks))
        ),
        theta_low=np.maximum(-1.0, theta[used].min(axis=0)),
        theta_high=np.minimum(1.0, theta[used].max(axis=0)),
        low=tuple(np.concatenate([o, z]).min(axis=0) for o, z in zip(own, zero, strict=True)),
        high=tuple(np.concatenate([o, z]).max(axis=0) for o, z in zip(own, zero, strict=True)),
    )


def _rows(design: FloatArray, level_square: FloatArray, runs: Runs, condition: int) -> Rows:
    """Return the complete runs of a condition."""
    kept = runs.simulated(condition) & np.isfinite(design).all(axis=1)
    settings = np.column_stack([runs.theta, runs.effect, runs.amplitude])
    return Rows(design[kept], runs.effect[kept], level_square[kept], settings[kept], runs.blocks[condition][kept])


def _choose_base(theta: FloatArray, runs: Runs) -> IntArray:
    base = runs.effect == BASE
    found = _choose(
        [(exponents, monomials(theta, exponents)) for exponents in base_candidates(theta.shape[1])], base, base, runs
    )
    if found is None:
        raise StatisticsError(
            f"runs: {int(base.sum())} base runs cannot carry a linear model of {theta.shape[1]} parameters in every "
            f"condition; needed are {RUNS_PER_TERM:g} per term that vary every parameter"
        )
    return found


def _choose_effect(
    effect: int, theta: FloatArray, points: FloatArray, base: IntArray, runs: Runs, declared: Declared
) -> IntArray:
    """Return the terms of an effect by the leave-one-out error of its own runs, none where it has too few."""
    own = runs.effect == effect
    known = monomials(theta, base)
    k = theta.shape[1]
    candidates = []
    for exponents in effect_candidates(k, declared.effects[effect].amplitudes):
        terms = np.where(own[:, None], monomials(points, exponents), 0.0)
        candidates.append((exponents, np.concatenate([known, terms], axis=1)))
    found = _choose(candidates, own | (runs.effect == BASE), own, runs)
    return np.empty((0, points.shape[1]), dtype=np.int64) if found is None else found


def _choose(
    candidates: list[tuple[IntArray, FloatArray]], fitted: BoolArray, judged: BoolArray, runs: Runs
) -> IntArray | None:
    """Return the exponents of the richest candidate that is TOLERATED times the least leave-one-out error; None if
    none.

    The error is that of the judged rows, summed over summaries and conditions in units of each summary's own error
    with the richest candidate. A candidate needs RUNS_PER_TERM judged rows per own term and a design of full rank.
    """
    errors = [
        (exponents, _left_out_squares(design, fitted, judged, runs, len(exponents))) for exponents, design in candidates
    ]
    usable = sorted(
        ((exponents, error) for exponents, error in errors if error is not None), key=lambda one: len(one[0])
    )
    if not usable:
        return None
    unit = np.where(usable[-1][1] > 0, usable[-1][1], 1.0)
    totals = [float((error / unit).sum()) for _, error in usable]
    good = [exponents for (exponents, _), total in zip(usable, totals, strict=True) if total <= TOLERATED * min(totals)]
    return good[-1]


def _left_out_squares(
    design: FloatArray, fitted: BoolArray, judged: BoolArray, runs: Runs, own_terms: int
) -> FloatArray | None:
    """Return the summed squared leave-one-out errors of the judged rows, (D,); None where the runs cannot carry it."""
    squares = []
    for c, block in enumerate(runs.blocks):
        rows = fitted & runs.simulated(c)
        x, y, own = design[rows], block[rows], judged[rows]
        if own.sum() < RUNS_PER_TERM * own_terms or np.linalg.matrix_rank(x) < x.shape[1]:
            return None
        q, _ = np.linalg.qr(x)
        left = np.maximum(1 - (q**2).sum(axis=1), 1e-9)[:, None]
        squares.append(((((y - q @ (q.T @ y)) / left) ** 2)[own]).sum(axis=0))
    return np.concatenate(squares)


def _design(
    theta: FloatArray, points: list[FloatArray], base: IntArray, effects: tuple[IntArray, ...], runs: Runs
) -> FloatArray:
    """Return the terms of every run, (n, P); rows of an effect without terms are NaN and left out."""
    columns = [monomials(theta, base)]
    for e, exponents in enumerate(effects):
        own = runs.effect == e
        if len(exponents):
            columns.append(np.where(own[:, None], monomials(points[e], exponents), 0.0))
        else:
            columns[0] = np.where(own[:, None], np.nan, columns[0])
    return np.concatenate(columns, axis=1)


def _widened(exponents: IntArray, places: IntArray, width: int) -> IntArray:
    """Return the same terms in `width` variables, the old ones at `places`."""
    wide = np.zeros((len(exponents), width), dtype=np.int64)
    wide[:, places] = exponents
    return wide
