"""Whether a walk said to be a steepest ascent is one, and whether the response-surface design that follows lies on it.

Steepest ascent moves the factors in proportion to their effects. A walk whose coded levels are the same for every
factor is the diagonal of the box instead: an even grid through the screened ranges, on which "best" means "the k-th
step of the grid".

The centre of the design is held against the step called best, its levels −1 and +1 against the steps of the walk. Where
the text says which steps they are, that is a figure; where it does not, a level that is no step is a remark. Where the
walk lowers a factor, the later step is its level −1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from doe.audit.finding import Figure, Finding, Remark, unchecked
from doe.audit.printed import values_of
from doe.audit.study import Ascent, DesignSteps, Screening, SurfaceStudy

FloatArray = npt.NDArray[np.float64]

CLOSE = 0.01
"""Coded levels that differ by less are the same: half a percent of a range, the rounding of printed settings."""
LEVELS_ON_WALK = "levels of the design on the walk"


def check_walk(ascent: Ascent, screening: Screening) -> Iterator[Finding]:
    """A remark where the walk is a grid of the screened ranges or does not follow the effects."""
    ranges = {factor.name: (factor.low, factor.high) for factor in screening.factors}
    if not set(ascent.factors) <= ranges.keys():
        return
    coded = _coded(ascent, ranges)
    steps = len(ascent.steps)
    if _is_grid(coded):
        effects = _effects(ascent, screening)
        wanted = ", ".join(f"{name} {share:.2f}" for name, share in zip(ascent.factors, effects, strict=True))
        best = (
            f" The best step, {ascent.best}, is the grid's step {_position(ascent)} of {steps}." if ascent.best else ""
        )
        yield Remark(
            "direction of the ascent",
            ascent.where,
            f"The {steps} steps are an even grid from end to end of the ranges that {screening.where_runs}'s screening "
            f"used for {', '.join(ascent.factors)}, all factors at once; along the steepest ascent, shares of their "
            f"ranges would be {wanted}.{best}",
        )


def check_levels(study: SurfaceStudy, ascent: Ascent) -> Iterator[Finding]:
    """The stated steps, the centre against the best step, and levels that are no steps."""
    where = f"{ascent.where} and {study.where_runs}"
    still = [name for name, old in zip(study.factors, study.screened, strict=True) if old not in ascent.factors]
    if still:
        if study.steps is not None:
            yield unchecked(LEVELS_ON_WALK, where, "levels −1, 0 and +1", f"the walk does not move {', '.join(still)}")
        return
    walk = ascent.settings[:, [ascent.factors.index(name) for name in study.screened]]
    if study.steps is not None:
        yield from _stated(study, ascent, study.steps, walk, where)
    else:
        yield from _off_the_walk(study, walk, where)
    if ascent.best is not None:
        yield from _centre(study, ascent, walk, where)


def _coded(ascent: Ascent, ranges: dict[str, tuple[float, float]]) -> FloatArray:
    """Settings in the screening's coded units, shape (steps, factors)."""
    low, high = np.array([ranges[name] for name in ascent.factors]).T
    return (2 * ascent.settings - low - high) / (high - low)


def _is_grid(coded: FloatArray) -> bool:
    """Whether all factors go evenly from one end of their range to the other."""
    even = np.linspace(-1.0, 1.0, len(coded))
    return len(coded) > 2 and all(
        min(np.abs(column - even).max(), np.abs(column + even).max()) <= CLOSE for column in coded.T
    )


def _effects(ascent: Ascent, screening: Screening) -> FloatArray:
    """Sizes of the effects, √SS, as shares of the largest, shape (factors,)."""
    sums = dict(zip((factor.name for factor in screening.factors), values_of(screening.sums), strict=True))
    sizes = np.sqrt([sums[name] for name in ascent.factors])
    return np.asarray(sizes / sizes.max())


def _position(ascent: Ascent) -> int:
    return ascent.steps.index(str(ascent.best)) + 1


def _stated(study: SurfaceStudy, ascent: Ascent, steps: DesignSteps, walk: FloatArray, where: str) -> Iterator[Figure]:
    """Every level against the setting of the step that it is said to be."""
    low, centre, high = (walk[ascent.steps.index(label)] for label in (steps.low, steps.centre, steps.high))
    ends = f"steps {steps.low} and {steps.high}"
    for words, level, setting, step in (
        ("−1", study.low, np.minimum(low, high), f"the lower of {ends}"),
        ("0", _middle(study), centre, f"step {steps.centre}"),
        ("+1", study.high, np.maximum(low, high), f"the higher of {ends}"),
    ):
        off = ~_same(study, level, setting)
        apart = [
            f"{name} is {level[k]:g} in the design and {setting[k]:g} there"
            for k, name in enumerate(study.factors)
            if off[k]
        ]
        yield Figure(
            LEVELS_ON_WALK,
            where,
            f"level {words} of the design, {step}",
            "differs" if apart else "reproduced exactly",
            _listed(level),
            _listed(setting),
            0.0,
            "; ".join(apart) or f"settings of {step} in {ascent.where}",
        )


def _centre(study: SurfaceStudy, ascent: Ascent, walk: FloatArray, where: str) -> Iterator[Remark]:
    """A remark where the design is not centred on the step called best."""
    centre, best = _middle(study), walk[ascent.steps.index(str(ascent.best))]
    if _same(study, centre, best).all():
        return
    is_step = [step for step, setting in zip(ascent.steps, walk, strict=True) if _same(study, centre, setting).all()]
    halves = ", ".join(f"{x:+.2f}" for x in (best - centre) / _half(study))
    yield Remark(
        LEVELS_ON_WALK,
        where,
        f"The design's centre ({_listed(centre)}) is {f'step {is_step[0]}' if is_step else 'no step of the walk'} and "
        f"not the step called best, {ascent.best} ({_listed(best)}), which lies at ({halves}) of the design.",
    )


def _off_the_walk(study: SurfaceStudy, walk: FloatArray, where: str) -> Iterator[Remark]:
    """A remark on the factors of which a level −1 or +1 is no step."""
    lost = []
    for k, name in enumerate(study.factors):
        ends = (study.low[k], study.high[k])
        if not all((np.abs(walk[:, k] - end) <= CLOSE * _half(study)[k]).any() for end in ends):
            lost.append(f"{name} {ends[0]:g} and {ends[1]:g}, steps {_listed(walk[:, k])}")
    if lost:
        yield Remark(
            LEVELS_ON_WALK, where, f"Levels −1 and +1 of the design are no steps of the walk: {'; '.join(lost)}."
        )


def _middle(study: SurfaceStudy) -> FloatArray:
    return np.asarray(0.5 * (study.low + study.high))


def _half(study: SurfaceStudy) -> FloatArray:
    return np.asarray(0.5 * (study.high - study.low))


def _same(study: SurfaceStudy, level: FloatArray, setting: FloatArray) -> npt.NDArray[np.bool_]:
    """Per factor, up to the rounding of printed settings."""
    return np.asarray(np.abs(level - setting) <= CLOSE * _half(study))


def _listed(values: Sequence[float] | FloatArray) -> str:
    return ", ".join(f"{value:g}" for value in values)
