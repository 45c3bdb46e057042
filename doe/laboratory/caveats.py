"""What curves of force over displacement say against the modulus that was taken from them.

A curved contact below a straight part, an exponent that is not Hertz's, a long toe, noise, and what single readings or
a single curve cannot show. The modulus stays, and these lines go with it, into a part of a material too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy import stats

from doe.errors import StatisticsError
from doe.laboratory.hertz import HertzRange, hertz_range
from doe.laboratory.linear_range import FEWEST_POINTS, Array, LinearRange, relative_noise, way_up
from doe.laboratory.result import CurveFit

HERTZIAN = (
    "the curves follow F ∝ δ^1.5, a Hertzian contact: the formula gives no constant of the material, but a number that "
    "falls with the depth of pressing (--bias)"
)
NEEDS_RADIUS = "the columns radius_mm, poisson_ratio and contacts give E by Hertz, from the part before yield"
LEAST_SHARE = 0.1
"""Of the largest force, below which a bend at the beginning is a toe, whatever its exponent."""
LONG_TOE = 0.2
"""Of the displacement up to the end of the part that counts."""
NOISY = 0.02
"""Noise of a point over its force. It is found to a fifth of itself on 40 points: at 3 % it is seldom missed."""


def caveats(test: str, component: str, replicates: Sequence[str], curves: Sequence[CurveFit]) -> tuple[str, ...]:
    """One line for each; ``curves``: of those ``replicates`` of the component that are no single readings."""
    return (
        *_of_lines(test, component, [(one, one.fit) for one in curves if isinstance(one.fit, LinearRange)]),
        *_of_law(component, [(one, one.fit) for one in curves if isinstance(one.fit, HertzRange)]),
        *_of_toes(component, curves),
        *_of_noise(component, curves),
        *_of_numbers(component, replicates, curves),
    )


def _of_lines(test: str, component: str, curves: Sequence[tuple[CurveFit, LinearRange]]) -> list[str]:
    """Whether most show a curved contact, all the way or below the straight part."""
    if sum(fit.hertzian for _, fit in curves) > len(curves) / 2:
        return [f"{HERTZIAN}; {NEEDS_RADIUS}" if test == "compression" else HERTZIAN]
    below = [(one, part) for one, fit in curves if test == "compression" and (part := _hertz_below(one, fit))]
    if len(below) <= len(curves) / 2:
        return []
    n, force = _range([part.exponent for _, part in below], ".2f"), _range([part.last_force for _, part in below])
    return [
        f"{component}: below the straight part F ∝ δ^n with n = {n}, up to {force} N in "
        f"{_which(one for one, _ in below)}: a curved contact, whose slope after yield is no constant of the material; "
        f"{NEEDS_RADIUS}"
    ]


def _hertz_below(curve: CurveFit, fit: LinearRange) -> HertzRange | None:
    """The part below the straight one, if it follows Hertz's law up to ``LEAST_SHARE``, and a line would not do."""
    x, f = _way_up(curve)
    below = x < fit.first_displacement
    if below.sum() < FEWEST_POINTS:
        return None
    try:
        found = hertz_range(x[below], f[below])
    except StatisticsError:
        return None
    return found if found.hertzian and found.resolved and found.last_force >= LEAST_SHARE * f.max() else None


def _of_law(component: str, curves: Sequence[tuple[CurveFit, HertzRange]]) -> list[str]:
    """Whether the exponent before yield is Hertz's."""
    found = []
    for hertzian, said in (
        (True, "agrees with Hertz's 1.5"),
        (False, "is not Hertz's 1.5: the curve is not Hertzian, and its modulus no constant of the material"),
    ):
        those = [(one, fit) for one, fit in curves if fit.hertzian == hertzian]
        if those:
            low, high = min(fit.exponent_low for _, fit in those), max(fit.exponent_high for _, fit in those)
            n = f"n = {_range([fit.exponent for _, fit in those], '.2f')} (95 % {low:.2f} … {high:.2f})"
            found.append(f"{component}: F ∝ δ^n with {n} in {_which(one for one, _ in those)} {said}")
    vague = [one for one, fit in curves if fit.hertzian and not fit.resolved]
    if vague:
        found.append(f"{component}: n of {_which(vague)} is too uncertain to tell a curved contact from flat faces")
    return found


def _of_toes(component: str, curves: Sequence[CurveFit]) -> list[str]:
    long = [(one, toe) for one in curves if (toe := _toe(one)) > LONG_TOE]
    if not long:
        return []
    share = _range([100.0 * toe for _, toe in long])
    return [
        f"{component}: a long toe in {_which(one for one, _ in long)}, {share} % of the way to the end of the part "
        "that counts: it is taken off, but slack and a soft seat look alike"
    ]


def _toe(curve: CurveFit) -> float:
    """From the first point to where the fit has no force, over the way to the end of the part that counts."""
    start = curve.displacement[0]
    return (curve.fit.origin - start) / (curve.fit.last_displacement - start)


def _of_noise(component: str, curves: Sequence[CurveFit]) -> list[str]:
    noisy = [(one, noise) for one in curves if (noise := relative_noise(*_way_up(one))) > NOISY]
    if not noisy:
        return []
    percent = _range([100.0 * noise for _, noise in noisy])
    return [
        f"{component}: noise of {percent} % of the force in {_which(one for one, _ in noisy)}: where a part ends is "
        "uncertain by much; more points or replicates help"
    ]


def _of_numbers(component: str, replicates: Sequence[str], curves: Sequence[CurveFit]) -> list[str]:
    """What single readings and a single curve leave open."""
    found, single = [], len(replicates) - len(curves)
    if single:
        found.append(
            f"{component}: {single} of {len(replicates)} replicates are single readings: toe, yield and the form of "
            f"the curve cannot be seen; a curve has at least {FEWEST_POINTS} points"
        )
    if len(replicates) == 1 and curves:
        (curve,) = curves
        estimate = curve.fit.slope if isinstance(curve.fit, LinearRange) else curve.fit.stiffness
        half = float(stats.t.ppf(0.975, curve.fit.points - 2)) * curve.fit.standard_error / estimate
        low, high = (1e-6 * curve.modulus * (1.0 + sign * half) for sign in (-1.0, 1.0))
        fit = f"the 95 % interval of its fit, {low:.4g} … {high:.4g} MPa"
        found.append(f"{component}: one curve: {fit}, says nothing of other specimens")
    return found


def _way_up(curve: CurveFit) -> tuple[Array, Array]:
    return way_up(np.asarray(curve.displacement), np.asarray(curve.force))


def _which(curves: Iterable[CurveFit]) -> str:
    names = [one.replicate for one in curves]
    return f"replicate{'s' * (len(names) > 1)} {', '.join(names)}"


def _range(values: Sequence[float], digits: str = ".3g") -> str:
    """The smallest and the largest, once where they agree."""
    return " … ".join(dict.fromkeys(f"{value:{digits}}" for value in (min(values), max(values))))
