"""Effects that are known to act: they join the declared model, so that a diagnosis can ask what else is missing.

The shifts of two effects in a pile do not add up, so pours of the second effect alone do not show what it does beside
the first (``docs/limit.md``, 10). With the first effect in the declared model, every teaching pour includes it.
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
"""Half width of a given amplitude's range, relative to its size: data determine an amplitude to some 20 to 50 %, and
rounding moves it by up to 19 %."""

LEAST = 0.01
"""Smallest amplitude that may be given, as a share of the effect's strongest."""

Given = Mapping[str, Sequence[float]]
"""Effect → amplitudes [natural units]."""


def with_given(measurement: Measurement, given: Given) -> Measurement:
    """``measurement`` with the effects ``given`` in the declared model of every condition.

    Each amplitude is calibrated with the other parameters, within ``SPAN`` of the given value and within the limits of
    the literature and of the conditions' rigs. First its size is rounded to the strongest amplitude divided by a power
    of √2, so that data sets of one model share their pours.

    Raises MeasurementError if an amplitude is already a parameter of the data, or is close to zero.
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
    """``amplitude``, shortened where needed to stay within the ``bounds`` that every condition can be set up with."""
    ends = (high if one > 0.0 else low for one, low, high in zip(amplitude, bounds.low, bounds.high, strict=True))
    share = min((end / one for one, end in zip(amplitude, ends, strict=True) if one != 0.0), default=1.0)
    return tuple(min(1.0, share) * one for one in amplitude)


def _ranges(scene: Scene, effect: str, centre: Sequence[float], bounds: CandidateEffect) -> list[MeasuredParameter]:
    half, found = SPAN * math.hypot(*centre), []
    for (path, best), low, high in zip(effect_values(effect, centre).items(), bounds.low, bounds.high, strict=True):
        unit = parameters(scene)[path].unit
        found.append(MeasuredParameter(path, max(best - half, low), min(best + half, high), None, None, unit))
    return found
