"""Comparison of a calibration with an earlier one: verdicts, means, noise and parameters, each by an equivalence test.

"Same": shown to lie within a margin. "Moved": shown to differ by more than chance, and not shown to lie within the
margin. Otherwise the pours are too few to decide. Two runs with the same physics and seeds are equal in every bit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import astuple, dataclass
from typing import Literal

import numpy as np
from scipy import stats

from doe.analysis.pilot import Noise
from doe.analysis.t_tests import Sample, equivalence_test, welch_test
from doe.analysis.verification import Verdict
from doe.record import Record
from doe.studies.study_result import StudyResult

Answer = Literal["same", "moved", "cannot tell"]
Kind = Literal["verdict", "mean at the optimum", "SD between seeds", "parameter"]
PARAMETER_MARGIN = 0.1
"""Margin within which a parameter counts as the same, as a share of its declared range."""
NOISE_MARGIN = 1.5
"""Margin within which the ratio of two standard deviations counts as no change."""
ALPHA = 0.05
HALF_WIDTHS = float(stats.norm.ppf(0.975))
"""Half width of a 95 % interval, in standard errors."""


class BaselineError(ValueError):
    """The two results answer different questions; the message is one line that can be shown to a user."""


@dataclass(frozen=True)
class Compared(Record):
    """One quantity in both results, and the answer with its reason.

    ``name``: path of the parameter (values in SI) or name of the observable.
    """

    kind: Kind
    name: str
    before: float | str
    now: float | str
    answer: Answer
    why: str


def compare(before: StudyResult, now: StudyResult) -> tuple[Compared, ...]:
    """Compare two finished calibrations of the same targets.

    Raises:
        BaselineError: the targets differ.
    """
    if before.verification.targets != now.verification.targets:
        raise BaselineError(
            f"has other targets ({_targets(before)}) than this study ({_targets(now)}); allowed: the result.json of a "
            "study with the same targets"
        )
    return (*_verified(before, now), *_noise(before, now), *_parameters(before, now))


def moved(compared: tuple[Compared, ...]) -> tuple[Compared, ...]:
    """Return the quantities that have moved."""
    return tuple(one for one in compared if one.answer == "moved")


def _targets(result: StudyResult) -> str:
    return ", ".join(f"{t.observable} = {t.mean:g}" for t in result.verification.targets)


def _verified(before: StudyResult, now: StudyResult) -> Iterator[Compared]:
    """Per target: the verdict, and the mean of the fresh pours at the optimum (Welch, and TOST at the margin)."""
    for target, old, new in zip(
        now.verification.targets, before.verification.tests, now.verification.tests, strict=True
    ):
        answer, why = _means(old.simulated, new.simulated, target.margin)
        turned = _verdicts(old.verdict, new.verdict, answer)
        yield Compared("verdict", target.observable, old.verdict, new.verdict, turned, "")
        yield Compared("mean at the optimum", target.observable, old.simulated.mean, new.simulated.mean, answer, why)


def _verdicts(old: Verdict, new: Verdict, means: Answer) -> Answer:
    """Chance alone can change a verdict from or to "cannot tell"; the means then decide whether it has moved."""
    if old == new:
        return "same"
    return "moved" if means == "moved" or "cannot tell" not in (old, new) else "cannot tell"


def _means(old: Sample, new: Sample, margin: float) -> tuple[Answer, str]:
    if old == new:
        return "same", "equal"
    if old.n < 2 or new.n < 2:
        return "cannot tell", "fewer than two pours"
    difference = welch_test(new, old, 1.0 - ALPHA)
    if not difference.standard_error > 0.0:
        return ("same" if abs(difference.difference) < margin else "moved"), f"no spread; margin {margin:g}"
    within = equivalence_test(difference, margin, ALPHA)
    why = f"difference {within.low:.3g} … {within.high:.3g} (90 %), margin ± {margin:g}"
    return _answer(within.equivalent, difference.p < ALPHA), why


def _noise(before: StudyResult, now: StudyResult) -> Iterator[Compared]:
    """Per observable of the pilot: the standard deviation between seeds, by the F test of the variance ratio."""
    for name, new in now.pilot.noise.items():
        if (old := before.pilot.noise.get(name)) is not None:
            yield Compared("SD between seeds", name, old.sigma, new.sigma, *_spreads(old, new))


def _spreads(old: Noise, new: Noise) -> tuple[Answer, str]:
    if old == new:
        return "same", "equal"
    if min(old.runs, new.runs) < 2 or not min(old.sigma, new.sigma) > 0.0:
        return "cannot tell", "fewer than two pours, or no spread"
    law, ratio = stats.f(new.runs - 1, old.runs - 1), new.sigma / old.sigma
    low, high = (ratio / math.sqrt(law.ppf(one)) for one in (1.0 - ALPHA, ALPHA))
    wide = [ratio / math.sqrt(law.ppf(one)) for one in (1.0 - ALPHA / 2.0, ALPHA / 2.0)]
    why = f"ratio {low:.3g} … {high:.3g} (90 %), margin 1/{NOISE_MARGIN:g} … {NOISE_MARGIN:g}"
    return _answer(low > 1.0 / NOISE_MARGIN and high < NOISE_MARGIN, not wide[0] <= 1.0 <= wide[1]), why


def _parameters(before: StudyResult, now: StudyResult) -> Iterator[Compared]:
    """Per parameter: its values with 95 % intervals where the targets identify it, else the ranges that give them."""
    old, new = before.optimum.estimates, now.optimum.estimates
    declared = {
        factor.path: float(factor.high) - float(factor.low)
        for factor in (*before.optimum.factors, *now.optimum.factors)
    }
    for path in [*new, *(path for path in old if path not in new)]:
        if path not in old or path not in new:
            left, come = (("no factor" if path not in one else one[path].value) for one in (old, new))
            yield Compared("parameter", path, left, come, "moved", "screening chose other factors")
            continue
        a, b = old[path], new[path]
        answer: Answer
        # Ends are NaN where the target is out of reach.
        if np.array_equal(astuple(a), astuple(b), equal_nan=True):
            answer, why = "same", "equal"
        elif a.identified and b.identified:
            error = math.hypot(a.high - a.low, b.high - b.low) / (2.0 * HALF_WIDTHS)
            margin, shift = PARAMETER_MARGIN * declared[path], b.value - a.value
            half = float(stats.norm.ppf(1.0 - ALPHA)) * error
            answer = _answer(abs(shift) + half < margin, abs(shift) > HALF_WIDTHS * error)
            why = f"difference {shift - half:.3g} … {shift + half:.3g} (90 %), margin ± {margin:.3g}"
        else:
            apart = a.high < b.low or b.high < a.low
            answer = "moved" if apart else "cannot tell"
            why = f"the target leaves it open: {a.low:.3g} … {a.high:.3g}, now {b.low:.3g} … {b.high:.3g}"
        yield Compared("parameter", path, a.value, b.value, answer, why)


def _answer(within: bool, differs: bool) -> Answer:
    if within:
        return "same"
    return "moved" if differs else "cannot tell"
