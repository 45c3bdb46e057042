"""Gates 5 and 6: do data that were not fitted agree with the name? They take names back, and never give one alone.

Every contender (the named models, and others that the fit leaves near them) predicts the held-out conditions by pours
of its own, which nothing else rests on. With r measured and m poured ones, S the covariance of a pour pooled over all
contenders, half shrunk to its diagonal:

    T^2 = (measured - poured)' Sigma^-1 (measured - poured),   Sigma = S (1/r + 1/m)
    D   = (f + d) ln(1 + T^2/f),   f = sum of m - 1 over the contenders,

-2 ln of a multivariate t density but for what is the same for all of them, which does not take a rare pour for a
refutation (Lange, Little and Taylor 1989, JASA 84:881). A name that stands alone keeps doing so if every rival stays
the gap of gate 3 behind in the criterion of the fit plus D; else they join it. Of several names those go that are
`Limits.held_out` or more behind the first of them in that sum, and by D alone as well: that the fitted data put them
behind cannot count against them twice, for gate 4 has found that it may be chance.

Where the held-out data contradict every name, nothing is named. The farthest summary of a model, over all held-out
conditions, is |t| = max |measured - poured|/(s sqrt(1/r + 1/m)), s the deviation of a pour pooled over data and
contenders with f degrees of freedom; Bonferroni's p = (number of summaries) P(|t_f| >= |t|) is below
`Limits.contradicted`. That is strict because the error of the fit is not in s, and summary by summary because an effect
that is none of those asked shows in what it acts on, not evenly over all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.diagnose.decision.gates import Gate
from doe.diagnose.decision.tables import listed
from doe.diagnose.decision.verdict import FittedModel, Verdict
from doe.diagnose.follow_up.closer import MODELS, near_best
from doe.diagnose.follow_up.confirm import confirm, fitted
from doe.diagnose.runs import CONSTANT_FLOOR, dust
from doe.diagnose.simulation.pours import ModelPours
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

SEQUENCE = "held out"
"""Name of the pours: others than those that the error is stated by."""
POURS = 8
"""Per contender and condition."""
LEAST = 6
"""Of them, readable, from which on a model has predicted anything."""


@dataclass(frozen=True)
class HeldOut(Record):
    """What a contender's fresh pours say of the held-out data: D (see above), and how far it is behind the best in the
    criterion of the fit plus D. farthest, p: |t| of its farthest summary, and Bonferroni's p of that.
    """

    label: str
    deviance: float
    behind: float
    farthest: float
    p: float


def contenders_for(verdict: Verdict) -> tuple[FittedModel, ...]:
    """The models that are named or that the fit leaves near the best of the race, in its order; none without a name."""
    if not verdict.names:
        return ()
    race = [model for model in verdict.models if model.members]
    near = near_best(race, MODELS)
    return tuple(model for model in race if model in near or model.label in verdict.names)


def predictions(
    verdict: Verdict, pours: ModelPours, widths: Sequence[int], where: Sequence[int] | None = None, number: int = POURS
) -> dict[str, tuple[FloatArray, ...]]:
    """Label -> fresh pours of every contender in the conditions of ``pours``, or ``where``, per condition (m, d_c)."""
    labels = [model.label for model in contenders_for(verdict)]
    poured = confirm([fitted(verdict, label) for label in labels], pours, number, widths, where, SEQUENCE)
    return {label: one.blocks for label, one in zip(labels, poured, strict=True)}


@dataclass(frozen=True)
class PourNoise:
    """Of one pour: standard deviation (d,), 0 where nothing differs; correlations (d, d); degrees of freedom."""

    spread: FloatArray
    correlation: FloatArray
    freedom: int


def pour_noise(measured: FloatArray, poured: Sequence[FloatArray]) -> PourNoise:
    """The noise pooled over ``poured`` [(m, d)], its correlations half shrunk.

    What no pour varies has the deviation of the data, or ``CONSTANT_FLOOR`` of its size where they are constant too.
    """
    rest = np.concatenate([block - block.mean(axis=0) for block in poured])
    freedom = sum(len(block) - 1 for block in poured)
    spread = np.sqrt((rest**2).sum(axis=0) / freedom)
    everything = np.concatenate([measured, *poured])
    floor = CONSTANT_FLOOR * np.abs(everything).max(axis=0)
    differs = np.ptp(everything, axis=0) > dust(everything)
    spread = np.where(spread > floor, spread, np.where(differs, np.maximum(measured.std(axis=0, ddof=1), floor), 0.0))
    z = rest / np.where(spread > 0.0, spread, 1.0)
    correlation = 0.5 * (z.T @ z) / freedom
    np.fill_diagonal(correlation, 1.0)
    return PourNoise(spread, correlation, freedom)


def deviance(measured: FloatArray, poured: FloatArray, noise: PourNoise) -> float:
    """Return D of one condition: measured (r, d), poured (m, d).

    Infinite where fewer than ``LEAST`` pours could be read: a model that breaks off where the laboratory measured.
    """
    if len(poured) < LEAST:
        return float("inf")
    known = noise.spread > 0.0
    off = distances(measured, poured, noise)
    t2 = float(off @ np.linalg.solve(noise.correlation[np.ix_(known, known)], off))
    return float((noise.freedom + known.sum()) * np.log1p(t2 / noise.freedom))


def distances(measured: FloatArray, poured: FloatArray, noise: PourNoise) -> FloatArray:
    """t of the summaries that vary: measured (r, d), poured (m, d). Infinite where fewer than ``LEAST`` were poured."""
    known = noise.spread > 0.0
    if len(poured) < LEAST:
        return np.full(known.sum(), np.inf)
    off = (measured[:, known].mean(axis=0) - poured[:, known].mean(axis=0)) / noise.spread[known]
    return np.asarray(off / np.sqrt(1.0 / len(measured) + 1.0 / len(poured)))


def compared(
    verdict: Verdict, measured: Sequence[FloatArray], poured: Mapping[str, Sequence[FloatArray]]
) -> tuple[HeldOut, ...]:
    """Contenders in order of the criterion of the fit plus D. poured: label -> per held-out condition (m, d_c).

    Nothing is compared where no contender's pours can be read.
    """
    found = dict.fromkeys(poured, 0.0)
    farthest, chance, asked = dict.fromkeys(poured, 0.0), dict.fromkeys(poured, 1.0), 0
    for c, data in enumerate(measured):
        blocks = {label: blocks[c] for label, blocks in poured.items()}
        readable = [block for block in blocks.values() if len(block) >= LEAST]
        if not readable:
            return ()
        noise = pour_noise(data, readable)
        found = {label: found[label] + deviance(data, block, noise) for label, block in blocks.items()}
        # The data scatter as well, and a summary that all contenders hold still may not be still in the laboratory.
        everyone = pour_noise(data, [*readable, data])
        asked += int((everyone.spread > 0.0).sum())
        for label, block in blocks.items():
            t = float(np.abs(distances(data, block, everyone)).max(initial=0.0))
            farthest[label] = max(farthest[label], t)
            chance[label] = min(chance[label], 2.0 * float(stats.t.sf(t, everyone.freedom)))
    criteria = {model.label: model.criterion for model in verdict.models}
    total = {label: criteria[label] + value for label, value in found.items()}
    best = min(total.values(), default=float("inf"))
    if not np.isfinite(best):
        return ()
    return tuple(
        HeldOut(label, found[label], total[label] - best, farthest[label], min(1.0, asked * chance[label]))
        for label in sorted(total, key=lambda label: total[label])
    )


def ruled_out(verdict: Verdict, rows: Sequence[HeldOut]) -> tuple[str, ...]:
    """Of several names those ``Limits.held_out`` or more behind the first of them, by the sum and by D alone.

    That is the distance at which a contender leaves the race: D knows nothing of the error of a fit, so a smaller one
    decides nothing.
    """
    named = [row for row in rows if row.label in verdict.names]
    if len(verdict.names) < 2 or not named:
        return ()
    first = min(named, key=lambda row: row.behind)
    return tuple(
        row.label
        for row in named
        if min(row.behind - first.behind, row.deviance - first.deviance) >= verdict.limits.held_out
    )


def upheld(verdict: Verdict, rows: Sequence[HeldOut]) -> Verdict:
    """The verdict with gates 5 and 6; as it is where nothing was compared."""
    if not rows:
        return verdict
    verdict = borne_out(verdict, rows)
    named = [row for row in rows if row.label in verdict.names]
    if not named:
        return verdict
    best, limit = max(named, key=lambda row: row.p), verdict.limits.contradicted
    words = f"the farthest summary of {best.label} is {best.farthest:.1f} standard errors off"
    gate = Gate("held out: agreement", best.farthest, best.p, limit, best.p >= limit, words)
    verdict = replace(verdict, gates=(*verdict.gates, gate))
    if gate.passed:
        return verdict
    statement = (
        f"The fitted data would name {listed(verdict.names)}, and the held-out data contradict it: {words}. "
        "None of the effects in the race explains both."
    )
    return replace(verdict, kind="unexplained", names=(), statement=statement)


def borne_out(verdict: Verdict, rows: Sequence[HeldOut]) -> Verdict:
    """The verdict with gate 5: a name that held-out data do not bear out becomes one among several.

    Where several are named they stay, and the gate says whom the held-out data favour.
    """
    gap, first = verdict.limits.gap, rows[0].label
    near = tuple(row.label for row in rows if row.behind < gap)
    behind = rows[1].behind if len(rows) > 1 else float("inf")
    stands = near == (verdict.names[0],)
    words = f"{rows[1].label} is {behind:.1f} behind {first}" if len(rows) > 1 else "no rival was near"
    gate = Gate("held out: gap with data that were not fitted", behind, None, gap, stands, words)
    gates = (*verdict.gates, gate)
    if stands or len(verdict.names) > 1:
        return replace(verdict, gates=gates)
    names = (verdict.names[0], *(name for name in near if name != verdict.names[0]))
    statement = f"{listed(names)}: the fitted data favour {verdict.names[0]}, the held-out data do not bear it out."
    if verdict.ruled_out:
        statement += f" They rule out {listed(verdict.ruled_out)}, which the fitted data left as well."
    return replace(verdict, kind=f"ambiguous:{','.join(names)}", names=names, statement=statement, gates=gates)
