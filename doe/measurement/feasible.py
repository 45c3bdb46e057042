"""A parameter's range, narrowed to what the rigs of all conditions allow.

A declared range says what a number may be by itself; a drum of 111 mL, for one, can be filled to 55 mL only. The end of
a range that some condition's scene refuses is moved inward to the last value that it takes, by bisection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from doe.errors import MeasurementError
from doe.measurement.measurement import MeasuredParameter
from solver import ParameterError, Scene, parameters, value, with_values

BISECTIONS = 30
"""A billionth of the range."""


def narrowed(parameter: MeasuredParameter, scenes: Sequence[Scene]) -> MeasuredParameter:
    """``parameter`` with a range whose ends every one of ``scenes`` that has it takes."""
    ends = [parameter.low, parameter.high]
    for scene in scenes:
        if parameter.path not in parameters(scene):
            continue
        for k, end in enumerate(ends):
            if not _taken(scene, parameter.path, end):
                ends[k] = _last_taken(scene, parameter, end)
    if not ends[0] < ends[1]:
        raise MeasurementError(f"parameters.{parameter.path}: no value of its range suits all conditions")
    return replace(parameter, low=ends[0], high=ends[1])


def _last_taken(scene: Scene, parameter: MeasuredParameter, refused: float) -> float:
    taken = float(value(scene, parameter.path))
    for _ in range(BISECTIONS):
        middle = 0.5 * (taken + refused)
        if _taken(scene, parameter.path, middle):
            taken = middle
        else:
            refused = middle
    return taken


def _taken(scene: Scene, path: str, number: float) -> bool:
    try:
        with_values(scene, {path: number})
    except ParameterError:
        return False
    return True
