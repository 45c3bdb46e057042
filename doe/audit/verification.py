"""What a study prints of its fresh runs: relative errors against the target, a t test, and what so few runs can show.

error = 100 |response − target|/target. Errors of several runs imply a target each: t = y/(1 ± error/100); where most
of them agree on one that is not the stated one, that is what they were computed against.

With the standard deviation of the measurement the printed p of the t test is recomputed, by Student's and by Welch's
test. Without it the test cannot be repeated, but the standard deviation that the printed p implies can be told.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from doe.analysis.t_tests import Sample, pooled_test, welch_test
from doe.analysis.verification import relative_error_percent, sd_from_pooled_p, sd_from_welch_p
from doe.audit.finding import Figure, Finding, Remark, Status, compared, like, unchecked
from doe.audit.printed import Printed, common_half, halves_of, most_agreed, rounding_slack, values_of
from doe.audit.study import Ascent, Target, Verified
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]

RELATIVE_ERROR = "relative error against the stated target"
NO_TARGET = "the study states no target"
T_TEST = "two-sample t test"
TESTS = {"Student's": pooled_test, "Welch's": welch_test}


def check_ascent_errors(ascent: Ascent, target: Target | None) -> Iterator[Finding]:
    """Every printed error of a walk, the target that they imply, and which step is nearest."""
    if target is None:
        if ascent.errors or ascent.best is not None:
            yield unchecked(RELATIVE_ERROR, ascent.where, "relative errors, nearest step", NO_TARGET)
        return
    stated = target.mean.value
    halves = common_half(ascent.responses)
    # Some print errors with a sign; their size is what is checked.
    errors = tuple(replace(error, value=abs(error.value)) for error in ascent.errors)
    other = implied_target(ascent.responses, errors, target.mean) if errors else None
    for step, response, half, error in zip(ascent.steps, ascent.responses, halves, errors, strict=False):
        value = relative_error_percent(response.value, stated)
        slack = 100 * float(half) / abs(stated)
        how = f"100 |{response.text} − {target.mean.text}|/{target.mean.text}"
        figure = compared(RELATIVE_ERROR, ascent.where, f"relative error [%], step {step}", error, value, how, slack)
        if figure.status == "differs" and other is not None:
            used = relative_error_percent(response.value, other.value)
            if error.agrees(used, slack):
                how = f"{how}; {other.text} instead of {target.mean.text} gives {like(used, error)}"
                figure = replace(figure, how=how)
        yield figure
    if other is not None:
        yield Remark(
            RELATIVE_ERROR,
            ascent.where,
            f"Of the {len(ascent.errors)} printed relative errors, most follow from a target of {other.text} and "
            f"not from the stated {target.mean.text}"
            + (": one digit is another." if _one_digit_off(other.text, target.mean.text) else "."),
        )
    if ascent.best is not None:
        yield _best(ascent, target)


def check_verification_error(verified: Verified, target: Target | None) -> Iterator[Finding]:
    """Mean and relative error of fresh runs; an error that does not fit is held against other denominators."""
    values = values_of(verified.responses)
    halves = common_half(verified.responses)
    slack = float(rounding_slack(lambda x: np.array([x.mean()]), values, halves)[0])
    mean = float(values.mean())
    if verified.mean is not None:
        how = f"mean of {values.size} runs"
        yield compared("mean of replicates", verified.where, "mean response", verified.mean, mean, how, slack)
    if verified.relative_error_percent is not None and target is None:
        yield unchecked(RELATIVE_ERROR, verified.where, "relative error [%]", NO_TARGET)
    elif verified.relative_error_percent is not None and target is not None:
        yield _verified_error(verified, verified.relative_error_percent, target, mean, slack)


def check_verification_test(verified: Verified, target: Target | None) -> Iterator[Finding]:
    """The printed p of the two-sample test, and the standard error of the mean beside the relative error."""
    if target is None:
        if verified.p_two_sample is not None:
            yield unchecked(T_TEST, verified.where, "p", NO_TARGET)
        return
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


def implied_target(responses: tuple[Printed, ...], errors: tuple[Printed, ...], stated: Printed) -> Printed | None:
    """The target that most of at least three errors were computed against, if it is not the stated one; else None."""
    halves = common_half(responses)
    intervals = [
        _targets(response.value, float(half), error)
        for response, half, error in zip(responses, halves, errors, strict=True)
    ]
    low, high, held = most_agreed(intervals, stated.value)
    with_stated = sum(any(a <= stated.value <= b for a, b in choices) for choices in intervals)
    if sum(held) < 3 or sum(held) * 2 <= len(held) or with_stated >= sum(held):
        return None
    middle = 0.5 * (low + high)
    for decimals in (stated.decimals, stated.decimals + 1):
        rounded = round(middle, decimals)
        if low <= rounded <= high:
            text = f"{rounded:.{decimals}f}"
            return Printed(text, rounded, 0.5 * 10.0**-decimals)
    return Printed(f"{middle:.6g}", middle, 0.5 * (high - low))


def _verified_error(verified: Verified, error: Printed, target: Target, mean: float, slack: float) -> Figure:
    stated, words = target.mean.value, "100 |mean − target|/target"
    value, quantity = relative_error_percent(mean, stated), "relative error [%]"
    figure = compared(RELATIVE_ERROR, verified.where, quantity, error, value, words, 100 * slack / abs(stated))
    if figure.status == "reproduced exactly":
        return figure
    means = [("the unrounded mean", mean)]
    if verified.mean is not None:
        means.append((f"the printed mean {verified.mean.text}", verified.mean.value))
    for name, middle in means:
        if error.agrees(relative_error_percent(middle, stated)):
            how = f"{words}, {name}"
            status: Status = "reproduced exactly"
            return Figure(RELATIVE_ERROR, verified.where, quantity, status, error.text, value, 0.0, how)
    if figure.status != "differs":
        return figure
    if verified.mean is not None:
        rounded = relative_error_percent(verified.mean.value, stated)
        words = f"{words} = {like(value, error)} ({like(rounded, error)} from the printed mean)"
    for name, middle in means:
        for divisor, other in (("the simulated value", middle), ("the mean of both", 0.5 * (middle + stated))):
            wrong = 100 * abs(middle - stated) / abs(other)
            if error.agrees(wrong):
                how = f"{words}; the print divides by {divisor} ({name}) and not by the target"
                return Figure(RELATIVE_ERROR, verified.where, quantity, "differs", error.text, value, slack, how)
    return figure


def _best(ascent: Ascent, target: Target) -> Figure:
    distances = np.abs(values_of(ascent.responses) - target.mean.value)
    nearest = ascent.steps[int(distances.argmin())]
    claimed = ascent.steps.index(str(ascent.best))
    slack = float(halves_of(ascent.responses).max())
    same = distances[claimed] <= distances.min() + slack
    order = np.sort(distances)
    how = f"|response − target| = {order[0]:.3g} there, {order[1]:.3g} at the next best step"
    return Figure(
        "nearest step",
        ascent.where,
        "step nearest to the target",
        "reproduced exactly" if same else "differs",
        str(ascent.best),
        nearest,
        0.0,
        how,
    )


def _targets(response: float, half: float, error: Printed) -> tuple[tuple[float, float], ...]:
    """Intervals of the target that give this error for this response: above it and below it."""
    least, most = max(0.0, error.value - error.half) / 100, (error.value + error.half) / 100
    below = (response - half) / (1 + most), (response + half) / (1 + least)
    if least >= 1:
        return (below,)  # a response of more than nothing is never so far below its target
    above = (response - half) / (1 - least), (response + half) / (1 - most) if most < 1 else np.inf
    return below, above


def _one_digit_off(one: str, other: str) -> bool:
    return len(one) == len(other) and sum(a != b for a, b in zip(one, other, strict=True)) == 1


def _p(verified: Verified, p: Printed, target: Target) -> Figure:
    runs = values_of(verified.responses)
    if target.sd is None or target.n is None:
        missing = "standard deviation" if target.sd is None else "number"
        why = f"the {missing} of the measured values is not printed" + _implied(p, runs.tolist(), target)
        return unchecked(T_TEST, verified.where, "p", why, p.text)
    sample = Sample.of(runs)
    found = {}
    for name, test in TESTS.items():
        ends = [
            test(sample, Sample(target.mean.value, target.sd.value + shift, target.n)).p for shift in _shifts(target.sd)
        ]
        found[name] = (ends[1], max(abs(ends[0] - ends[1]), abs(ends[2] - ends[1])))
    for name, (value, slack) in found.items():
        figure = compared(T_TEST, verified.where, "p", p, value, f"{name} test", slack)
        if figure.status != "differs":
            return figure
    value, slack = found["Student's"]
    return Figure(T_TEST, verified.where, "p", "differs", p.text, value, slack, _both(found))


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
