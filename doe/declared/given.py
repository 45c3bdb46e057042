"""Effects that are known to be there: they join the declared model, and what else is missing can be asked.

Two effects do not add up in a pile, so that pours of a second one alone do not say what it does beside the first
(``docs/limit.md``, 10). With the first one in the declared model, every pour that teaches has it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from doe.declared.model import CandidateEffect, effect_values, widest
from doe.errors import MeasurementError
from doe.measurement.measurement import MeasuredParameter, Measurement
from solver import EFFECTS, Scene, parameters, with_values

SPAN = 0.6
"""Half width of a given amplitude's range over its size: what data tell of one is some 20 to 50 % wide, and rounding
moves it by up to 19 %."""

LEAST = 0.01
"""Share of the strongest below which there is nothing to be given."""

Given = Mapping[str, Sequence[float]]
"""Effect → amplitudes [natural units]."""


def with_given(measurement: Measurement, given: Given) -> Measurement:
    """``measurement`` with the effects ``given`` in the declared model of every condition.

    Each amplitude is calibrated with the other parameters, within ``SPAN`` of what is given and no farther than the
    literature and the conditions' rigs allow. Its size is rounded to a power of √2 below the strongest first, so that
    data sets of one model share their pours.

    Raises MeasurementError where an amplitude is a parameter of the data already, or is next to nothing.
    """
    for effect, amplitude in given.items():
        scenes = [one.scene for one in measurement.conditions]
        if math.hypot(*amplitude) < LEAST * EFFECTS[effect].strongest:
            least = LEAST * EFFECTS[effect].strongest
            raise MeasurementError(
                f"{effect}: an amplitude of {math.hypot(*amplitude):.3g} is too small; allowed: at least {least:.3g}"
            )
        known = {parameter.path for parameter in measurement.parameters}
        bounds = widest(effect, scenes)
        centre = _within(_rounded(effect, amplitude), bounds)
        ranges = _ranges(measurement.scene, effect, centre, bounds)
        for one in ranges:
            if one.path in known:
                raise MeasurementError(f"{measurement.folder}: {one.path} is already one of its parameters")
        measurement = replace(
            measurement,
            scene=with_values(measurement.scene, dict(effect_values(effect, centre))),
            parameters=(*measurement.parameters, *ranges),
            conditions=tuple(
                replace(one, scene=with_values(one.scene, dict(effect_values(effect, centre, one.turned))))
                for one in measurement.conditions
            ),
        )
    return measurement


def _rounded(effect: str, amplitude: Sequence[float]) -> tuple[float, ...]:
    size, strongest = math.hypot(*amplitude), EFFECTS[effect].strongest
    rounded = strongest * min(1.0, 2.0 ** (0.5 * round(2.0 * math.log2(size / strongest))))
    return tuple(one / size * rounded for one in amplitude)


def _within(amplitude: Sequence[float], bounds: CandidateEffect) -> tuple[float, ...]:
    """``amplitude``, shorter where it would leave what every condition can be set up with."""
    ends = (high if one > 0.0 else low for one, low, high in zip(amplitude, bounds.low, bounds.high, strict=True))
    share = min((end / one for one, end in zip(amplitude, ends, strict=True) if one != 0.0), default=1.0)
    return tuple(min(1.0, share) * one for one in amplitude)


def _ranges(scene: Scene, effect: str, centre: Sequence[float], bounds: CandidateEffect) -> list[MeasuredParameter]:
    half, found = SPAN * math.hypot(*centre), []
    for (path, best), low, high in zip(effect_values(effect, centre).items(), bounds.low, bounds.high, strict=True):
        unit = parameters(scene)[path].unit
        found.append(MeasuredParameter(path, max(best - half, low), min(best + half, high), None, None, unit))
    return found
