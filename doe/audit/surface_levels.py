"""Whether a response-surface design lies on the walk that it came from.

Its centre is held against the step called best, its levels −1 and +1 against the steps of the walk. Where the text says
which steps they are, that is a figure; where it does not, a level that is no step is a remark. Where the walk lowers a
factor, the later step is its level −1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from doe.audit.ascent_walk import CLOSE
from doe.audit.finding import Figure, Finding, Remark, unchecked
from doe.audit.study import Ascent, DesignSteps, SurfaceStudy

FloatArray = npt.NDArray[np.float64]
CHECK = "levels of the design on the walk"


def check_levels(study: SurfaceStudy, ascent: Ascent) -> Iterator[Finding]:
    """The stated steps, the centre against the best step, and levels that are no steps."""
    where = f"{ascent.where} and {study.where_runs}"
    still = [name for name, old in zip(study.factors, study.screened, strict=True) if old not in ascent.factors]
    if still:
        if study.steps is not None:
            yield unchecked(CHECK, where, "levels −1, 0 and +1", f"the walk does not move {', '.join(still)}")
        return
    walk = ascent.settings[:, [ascent.factors.index(name) for name in study.screened]]
    if study.steps is not None:
        yield from _stated(study, ascent, study.steps, walk, where)
    else:
        yield from _off_the_walk(study, walk, where)
    if ascent.best is not None:
        yield from _centre(study, ascent, walk, where)


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
            CHECK,
            where,
            f"level {words} of the design, {step}",
            "differs" if apart else "reproduced",
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
        CHECK,
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
        yield Remark(CHECK, where, f"Levels −1 and +1 of the design are no steps of the walk: {'; '.join(lost)}.")


def _middle(study: SurfaceStudy) -> FloatArray:
    return np.asarray(0.5 * (study.low + study.high))


def _half(study: SurfaceStudy) -> FloatArray:
    return np.asarray(0.5 * (study.high - study.low))


def _same(study: SurfaceStudy, level: FloatArray, setting: FloatArray) -> npt.NDArray[np.bool_]:
    """Per factor, up to the rounding of printed settings."""
    return np.asarray(np.abs(level - setting) <= CLOSE * _half(study))


def _listed(values: Sequence[float] | FloatArray) -> str:
    return ", ".join(f"{value:g}" for value in values)
