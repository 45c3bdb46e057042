"""``[parameters]``: path → range and independently measured mean ± standard deviation.

"pair.grain.grain.static_friction" = { mean = 0.57, sd = 0.05, low = 0.47, high = 0.72 }

A missing low or high is taken from mean ± 3 sd. A range is clipped to the values that the parameter may have at all.

A declared range considers the parameter by itself; it is narrowed to what the rigs of all conditions allow. A drum of
111 mL, for example, can be filled to 55 mL only. If the scene of a condition refuses an end of the range, that end is
moved inward by bisection to the last value that the scene accepts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated

from doe.errors import MeasurementError
from doe.measurement.measurement import MeasuredParameter
from solver import (
    Parameter,
    ParameterError,
    Scalar,
    Scene,
    TomlTable,
    canonical,
    parameters,
    parse_quantity,
    value,
    with_values,
)

RANGE_SDS = 3.0
"""Half width, in standard deviations, of a range that is not stated."""


class ParameterTable(TomlTable):
    """``[parameters."path"]``: what calibration may move, by its range, its measured mean and standard deviation."""

    mean: Annotated[float | str, Scalar()] | None = None
    sd: Annotated[float | str, Scalar()] | None = None
    low: Annotated[float | str, Scalar()] | None = None
    high: Annotated[float | str, Scalar()] | None = None


def read_parameters(
    table: Mapping[str, ParameterTable], scenes: Sequence[Scene]
) -> tuple[tuple[MeasuredParameter, ...], tuple[str, ...]]:
    """Return the parameters of the table, each known in at least one of ``scenes``, and notes on clipped ranges."""
    found: dict[str, MeasuredParameter] = {}
    notes: list[str] = []
    for path, entry in table.items():
        parameter = _declared(path, scenes)
        if parameter.path in found:
            raise MeasurementError(f"parameters.{path}: appears twice; allowed: each parameter once")
        found[parameter.path] = _measured(parameter, entry, notes)
    return tuple(found.values()), tuple(notes)


def _declared(path: str, scenes: Sequence[Scene]) -> Parameter:
    refusal = None
    for scene in scenes:
        try:
            return parameters(scene)[canonical(scene, path)]
        except ParameterError as error:
            refusal = error
    raise MeasurementError(f"parameters.{refusal}")


def _measured(parameter: Parameter, entry: ParameterTable, notes: list[str]) -> MeasuredParameter:
    where = f"parameters.{parameter.path}"
    if not parameter.is_number:
        raise MeasurementError(f"{where}: has named values; allowed: parameters that are numbers")
    mean, sd, low, high = (
        None if given is None else parse_quantity(given, parameter.unit, f"{where}.{key}") for key, given in entry
    )
    if sd is not None and (mean is None or sd <= 0.0):
        raise MeasurementError(f"{where}.sd: {sd:g}; allowed: more than 0, together with a mean")
    if (low is None or high is None) and (mean is None or sd is None):
        raise MeasurementError(f"{where}: no range; allowed: low and high, or mean and sd")
    if mean is not None and sd is not None:
        low = mean - RANGE_SDS * sd if low is None else low
        high = mean + RANGE_SDS * sd if high is None else high
    assert low is not None
    assert high is not None
    kept = max(low, parameter.low), min(high, parameter.high)
    if kept != (low, high):
        notes.append(f"{parameter.path}: range {low:g} … {high:g} clipped to {kept[0]:g} … {kept[1]:g}")
    if not kept[0] < kept[1]:
        raise MeasurementError(
            f"{where}: range {low:g} … {high:g} is empty; allowed: low below high, within "
            f"{parameter.low:g} … {parameter.high:g}"
        )
    if mean is not None and not kept[0] <= mean <= kept[1]:
        raise MeasurementError(f"{where}.mean: {mean:g} is outside {kept[0]:g} … {kept[1]:g}")
    return MeasuredParameter(parameter.path, *kept, mean, sd, parameter.unit)


BISECTIONS = 30
"""Number of bisections, which locate an end to about a billionth of the range."""


def narrowed(parameter: MeasuredParameter, scenes: Sequence[Scene]) -> MeasuredParameter:
    """Return ``parameter`` with its range narrowed so that all ``scenes`` that have it accept both ends."""
    ends = [parameter.low, parameter.high]
    for scene in scenes:
        if parameter.path not in parameters(scene):
            continue
        for k, end in enumerate(ends):
            if not _taken(scene, parameter.path, end):
                ends[k] = _last_taken(scene, parameter, end)
    if not ends[0] < ends[1]:
        raise MeasurementError(f"parameters.{parameter.path}: no value of its range is allowed in all conditions")
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
