"""Gate 5: do data that were not fitted agree with the name? They take names back, and never give a new one alone.

Every contender (the named models, and others that the fit leaves near them) predicts the held-out conditions by fresh
pours. With r measured and m poured means, S the covariance of the model's own pours, half shrunk to its diagonal:

    T^2 = (measured - poured)' Sigma^-1 (measured - poured),   Sigma = S/r + S/m
    D   = (m - 1 + d) ln(1 + T^2/(m - 1)) + ln|Sigma|,

-2 ln of a multivariate t density, which does not take a rare pour for a refutation (Lange, Little and Taylor 1989,
JASA 84:881). A name that stands alone keeps doing so if every rival stays the gap of gate 3 behind in the criterion of
the fit plus D; else they join it. Of several names those go that are WITHIN or more behind the first of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from doe.diagnose.decision.gates import Gate
from doe.diagnose.decision.tables import listed
from doe.diagnose.decision.verdict import FittedModel, Verdict
from doe.diagnose.follow_up.closer import MODELS, WITHIN, near_best
from doe.diagnose.follow_up.confirm import confirm, fitted
from doe.diagnose.simulation.pours import ModelPours
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

LEAST = 6
"""Pours of a model in a condition from which their scatter is known well enough."""


@dataclass(frozen=True)
class HeldOut(Record):
    """What a contender's fresh pours say of the held-out data: D (see above), and how far it is behind the best in the
    criterion of the fit plus D.
    """

    label: str
    deviance: float
    behind: float


def contenders_for(verdict: Verdict) -> tuple[FittedModel, ...]:
    """The models that are named or that the fit leaves near the best of the race, in its order; none without a name."""
    if not verdict.names:
        return ()
    race = [model for model in verdict.models if model.members]
    near = near_best(race, MODELS)
    return tuple(model for model in race if model in near or model.label in verdict.names)


def predictions(
    verdict: Verdict, pours: ModelPours, number: int, widths: Sequence[int], where: Sequence[int] | None = None
) -> dict[str, tuple[FloatArray, ...]]:
    """Label -> fresh pours of every contender in the conditions of ``pours``, or ``where``, per condition (m, d_c)."""
    return {
        model.label: confirm(fitted(verdict, model.label), pours, number, widths, where).blocks
        for model in contenders_for(verdict)
    }


def deviance(measured: FloatArray, poured: FloatArray) -> float:
    """Return D of one condition: measured (r, d), poured (m, d). Summaries that vary in neither are left out."""
    r, m = len(measured), len(poured)
    varies = np.ptp(np.concatenate([measured, poured]), axis=0) > 0.0
    spread = np.where(poured.std(axis=0, ddof=1) > 0.0, poured.std(axis=0, ddof=1), measured.std(axis=0, ddof=1))
    known = varies & (spread > 0.0)
    unit = spread[known]
    z = poured[:, known] / unit
    correlation = np.corrcoef(z, rowvar=False) if len(unit) > 1 else np.ones((1, 1))
    correlation = np.where(np.isfinite(correlation), correlation, 0.0)
    sigma = 0.5 * (correlation + np.eye(len(unit))) * (1.0 / r + 1.0 / m)
    np.fill_diagonal(sigma, 1.0 / r + 1.0 / m)
    off = (measured[:, known].mean(axis=0) - poured[:, known].mean(axis=0)) / unit
    t2, df, d = float(off @ np.linalg.solve(sigma, off)), m - 1, len(unit)
    determinant = float(np.linalg.slogdet(sigma)[1] + 2.0 * np.log(unit).sum())
    return (df + d) * float(np.log1p(t2 / df)) + determinant


def compared(
    verdict: Verdict, measured: Sequence[FloatArray], poured: Mapping[str, Sequence[FloatArray]]
) -> tuple[HeldOut, ...]:
    """Contenders in order of the criterion of the fit plus D. poured: label -> per held-out condition (m, d_c).

    A model of which fewer than ``LEAST`` pours could be read says nothing; without the named one nothing is compared.
    """
    found = {
        label: sum(deviance(data, block) for data, block in zip(measured, blocks, strict=True))
        for label, blocks in poured.items()
        if min(map(len, blocks)) >= LEAST
    }
    if not found or verdict.names[0] not in found:
        return ()
    criteria = {model.label: model.criterion for model in verdict.models}
    total = {label: criteria[label] + value for label, value in found.items()}
    best = min(total.values())
    return tuple(
        HeldOut(label, found[label], total[label] - best) for label in sorted(total, key=lambda label: total[label])
    )


def ruled_out(verdict: Verdict, rows: Sequence[HeldOut]) -> tuple[str, ...]:
    """Of several names those that held-out data put ``WITHIN`` or more behind the first of them.

    That is the distance at which a contender leaves the race: D knows nothing of the error of a fit, so a smaller one
    decides nothing.
    """
    if len(verdict.names) < 2:
        return ()
    behind = {row.label: row.behind for row in rows if row.label in verdict.names}
    return tuple(name for name in behind if behind[name] - min(behind.values()) >= WITHIN)


def upheld(verdict: Verdict, rows: Sequence[HeldOut]) -> Verdict:
    """The verdict with gate 5: a name that held-out data do not bear out becomes one among several.

    Where several are named they stay, and the gate says whom the held-out data favour.
    """
    if not rows:
        return verdict
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
    statement = f"{listed(names)}: the fitted data name {verdict.names[0]}, the held-out data do not bear it out."
    return replace(verdict, kind=f"ambiguous:{','.join(names)}", names=names, statement=statement, gates=gates)
