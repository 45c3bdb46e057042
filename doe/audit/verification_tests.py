"""The t test that a study prints for its fresh runs, and what so few runs can show at all.

With the standard deviation of the measurement the printed p is recomputed, by Student's and by Welch's test. Without
it the test cannot be repeated, but the standard deviation that the printed p implies can be told.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from doe.audit.finding import Figure, Finding, Remark, unchecked
from doe.audit.printed import Printed
from doe.audit.rounding import values_of
from doe.audit.study import Target, Verified
from doe.errors import StatisticsError
from doe.t_tests import Sample, pooled_test, welch_test
from doe.verification import relative_error_percent, sd_from_pooled_p, sd_from_welch_p

CHECK = "two-sample t test"
TESTS = {"Student's": pooled_test, "Welch's": welch_test}


def check_verification_test(verified: Verified, target: Target) -> Iterator[Finding]:
    """The printed p of the two-sample test, and the standard error of the mean beside the relative error."""
    runs = values_of(verified.responses)
    if verified.p_two_sample is not None:
        yield _p(verified, verified.p_two_sample, target)
    sample = Sample.of(runs)
    if sample.n < 2:
        return
    error = 100 * sample.sd / math.sqrt(sample.n) / abs(target.mean.value)
    found = relative_error_percent(sample.mean, target.mean.value)
    if found < error:
        yield Remark(
            "what the runs can show",
            verified.where,
            f"The mean of {sample.n} runs has a standard error of {error:.1f} % (SD {sample.sd:.2f}); a relative error "
            f"of {found:.2f} % lies below it and is no evidence of agreement.",
        )


def _p(verified: Verified, p: Printed, target: Target) -> Figure:
    runs = values_of(verified.responses)
    if target.sd is None or target.n is None:
        missing = "standard deviation" if target.sd is None else "number"
        why = f"the {missing} of the measured values is not printed" + _implied(p, runs.tolist(), target)
        return unchecked(CHECK, verified.where, "p", why, p.text)
    sample = Sample.of(runs)
    found = {}
    for name, test in TESTS.items():
        ends = [
            test(sample, Sample(target.mean.value, target.sd.value + shift, target.n)).p for shift in _shifts(target.sd)
        ]
        found[name] = (ends[1], max(abs(ends[0] - ends[1]), abs(ends[2] - ends[1])))
    for name, (value, slack) in found.items():
        if p.agrees(value, slack):
            return Figure(CHECK, verified.where, "p", "reproduced", p.text, value, slack, f"{name} test")
    value, slack = found["Student's"]
    return Figure(CHECK, verified.where, "p", "differs", p.text, value, slack, _both(found))


def _both(found: dict[str, tuple[float, float]]) -> str:
    return "; ".join(f"{name} test gives {value:.3f}" for name, (value, _) in found.items())


def _shifts(sd: Printed) -> Sequence[float]:
    return (-min(sd.half, sd.value), 0.0, sd.half)


def _implied(p: Printed, runs: list[float], target: Target) -> str:
    """Words about the standard deviation that the printed p needs."""
    if target.n is None or not 0 < p.value < 1:
        return ""
    inverses: dict[str, Callable[[float, Sequence[float], float, int], float]] = {
        "Student's": sd_from_pooled_p,
        "Welch's": sd_from_welch_p,
    }
    words = []
    for name, inverse in inverses.items():
        try:
            words.append(f"{inverse(p.value, runs, target.mean.value, target.n):.2f} ({name} test)")
        except StatisticsError:
            words.append(f"none ({name} test)")
    return f"; p = {p.text} would need {' or '.join(words)} over {target.n} values"
