"""Effects that are known to be there: they join the declared model, and what else is missing can be asked.

Two effects do not add up in a pile, so that pours of a second one alone do not say what it does beside the first
(``docs/limit.md``, 10). With the first one in the declared model, every pour that teaches has it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from doe.declared.model import effect_values
from doe.errors import MeasurementError
from doe.measurement.measurement import MeasuredParameter, Measurement
from solver import EFFECTS, Scene, parameters, with_values

SPAN = 0.6
"""Half width of a given amplitude's range over its size: what data tell of one is some 20 to 50 % wide, and rounding
moves it by up to 19 %."""

Given = Mapping[str, Sequence[float]]
"""Effect → amplitudes [natural units]."""


def with_given(measurement: Measurement, given: Given) -> Measurement:
    """``measurement`` with the effects ``given`` in the declared model of every condition.

    Each amplitude is calibrated with the other parameters, within ``SPAN`` of what is given and no farther than the
    literature supports. Its size is rounded to a power of √2 below the strongest first, so that data sets of one model
    share their pours.

    Raises MeasurementError where an amplitude is a parameter of the data already.
    """
    if not given:
        return measurement
    given = {effect: _rounded(effect, amplitude) for effect, amplitude in given.items()}
    known = {parameter.path for parameter in measurement.parameters}
    ranges = [one for effect, amplitude in given.items() for one in _ranges(measurement.scene, effect, amplitude)]
    for one in ranges:
        if one.path in known:
            raise MeasurementError(f"{measurement.folder}: {one.path} is one of its parameters already")
    return replace(
        measurement,
        scene=_with(measurement.scene, given),
        parameters=(*measurement.parameters, *ranges),
        conditions=tuple(replace(one, scene=_with(one.scene, given, one.turned)) for one in measurement.conditions),
    )


def _rounded(effect: str, amplitude: Sequence[float]) -> tuple[float, ...]:
    size, strongest = math.hypot(*amplitude), EFFECTS[effect].strongest
    rounded = strongest * min(1.0, 2.0 ** (0.5 * round(2.0 * math.log2(size / strongest))))
    return tuple(one / size * rounded for one in amplitude)


def _with(scene: Scene, given: Given, turned: bool = False) -> Scene:
    for effect, amplitude in given.items():
        scene = with_values(scene, dict(effect_values(effect, amplitude, turned)))
    return scene


def _ranges(scene: Scene, effect: str, amplitude: Sequence[float]) -> list[MeasuredParameter]:
    half, strongest, found = SPAN * math.hypot(*amplitude), EFFECTS[effect].strongest, []
    for path, best in effect_values(effect, amplitude).items():
        known = parameters(scene)[path]
        low, high = max(best - half, known.low, -strongest), min(best + half, known.high, strongest)
        found.append(MeasuredParameter(path, low, high, None, None, known.unit))
    return found
