"""Relative errors against the stated target, and what an error that does not fit was computed with instead.

error = 100 |response − target|/target. Errors of several runs imply a target each: t = y/(1 ± error/100); where most
of them agree on one that is not the stated one, that is what they were computed against.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from doe.audit.finding import Figure, Finding, Remark, compared, like
from doe.audit.printed import Printed
from doe.audit.rounding import common_half, halves_of, most_agreed, rounding_slack, values_of
from doe.audit.study import Ascent, Target, Verified
from doe.verification import relative_error_percent

FloatArray = npt.NDArray[np.float64]
CHECK = "relative error against the stated target"


def check_ascent_errors(ascent: Ascent, target: Target) -> Iterator[Finding]:
    """Every printed error of a walk, the target that they imply, and which step is nearest."""
    stated = target.mean.value
    halves = common_half(ascent.responses)
    # Some print errors with a sign; their size is what is checked.
    errors = tuple(replace(error, value=abs(error.value)) for error in ascent.errors)
    other = implied_target(ascent.responses, errors, target.mean) if errors else None
    for step, response, half, error in zip(ascent.steps, ascent.responses, halves, errors, strict=False):
        value = relative_error_percent(response.value, stated)
        slack = 100 * float(half) / abs(stated)
        how = f"100 |{response.text} − {target.mean.text}|/{target.mean.text}"
        figure = compared(CHECK, ascent.where, f"relative error [%], step {step}", error, value, how, slack)
        if figure.status == "differs" and other is not None:
            used = relative_error_percent(response.value, other.value)
            if error.agrees(used, slack):
                how = f"{how}; {other.text} instead of {target.mean.text} gives {like(used, error)}"
                figure = replace(figure, how=how)
        yield figure
    if other is not None:
        yield Remark(
            CHECK,
            ascent.where,
            f"Of the {len(ascent.errors)} printed relative errors, most follow from a target of {other.text} and "
            f"not from the stated {target.mean.text}"
            + (": one digit is another." if _one_digit_off(other.text, target.mean.text) else "."),
        )
    if ascent.best is not None:
        yield _best(ascent, target)


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


def check_verification_error(verified: Verified, target: Target) -> Iterator[Finding]:
    """Mean and relative error of fresh runs; an error that does not fit is held against other denominators."""
    values = values_of(verified.responses)
    halves = common_half(verified.responses)
    slack = float(rounding_slack(lambda x: np.array([x.mean()]), values, halves)[0])
    mean = float(values.mean())
    if verified.mean is not None:
        how = f"mean of {values.size} runs"
        yield compared("mean of replicates", verified.where, "mean response", verified.mean, mean, how, slack)
    if verified.relative_error_percent is not None:
        yield _verified_error(verified, verified.relative_error_percent, target, mean, slack)


def _verified_error(verified: Verified, error: Printed, target: Target, mean: float, slack: float) -> Figure:
    stated, words = target.mean.value, "100 |mean − target|/target"
    value, quantity = relative_error_percent(mean, stated), "relative error [%]"
    figure = compared(CHECK, verified.where, quantity, error, value, words, 100 * slack / abs(stated))
    if figure.status == "reproduced" and error.agrees(value):
        return figure
    means = [("the unrounded mean", mean)]
    if verified.mean is not None:
        means.append((f"the printed mean {verified.mean.text}", verified.mean.value))
    for name, middle in means:
        if error.agrees(relative_error_percent(middle, stated)):
            return Figure(CHECK, verified.where, quantity, "reproduced", error.text, value, 0.0, f"{words}, {name}")
    if verified.mean is not None:
        rounded = relative_error_percent(verified.mean.value, stated)
        words = f"{words} = {like(value, error)} ({like(rounded, error)} from the printed mean)"
    for name, middle in means:
        for divisor, other in (("the simulated value", middle), ("the mean of both", 0.5 * (middle + stated))):
            wrong = 100 * abs(middle - stated) / abs(other)
            if error.agrees(wrong):
                how = f"{words}; the print divides by {divisor} ({name}) and not by the target"
                return Figure(CHECK, verified.where, quantity, "differs", error.text, value, slack, how)
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
        "reproduced" if same else "differs",
        str(ascent.best),
        nearest,
        0.0,
        how,
    )


def _targets(response: float, half: float, error: Printed) -> tuple[tuple[float, float], ...]:
    """Intervals of the target that give this error for this response: above it and below it."""
    least, most = max(0.0, error.value - error.half) / 100, (error.value + error.half) / 100
    above = (response - half) / (1 - least), (response + half) / (1 - most) if most < 1 else np.inf
    below = (response - half) / (1 + most), (response + half) / (1 + least)
    return below, above


def _one_digit_off(one: str, other: str) -> bool:
    return len(one) == len(other) and sum(a != b for a, b in zip(one, other, strict=True)) == 1
