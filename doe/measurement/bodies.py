"""Measured bodies: what a balance and a caliper tell of single bodies, beside what is read off their pours.

``measurement.toml`` names the table, ``bodies = "bodies.csv"``. A row is one number of one component of the material:

    body,quantity,unit,mean,standard_error
    seed,mass,g,0.0712,0.0006
    seed,length,mm,11.1,0.1
    seed,length_spread,1,0.08,0.01

``mass``: the mean mass of a body, of a counted number weighed together. ``length``: the mean of the longest dimension.
``length_spread``: its standard deviation from body to body over its mean.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from doe.errors import MeasurementError
from doe.measurement.long_form import MOST_BYTES
from doe.record import Record
from doe.table_file import check_cells, read_table
from solver import Body, ParameterError, Scene, actual, parse_quantity

Array = npt.NDArray[np.float64]

COLUMNS = ("body", "quantity", "unit", "mean", "standard_error")


@dataclass(frozen=True)
class BodyQuantity:
    """A number that can be measured of bodies: unit, what it is, and what it is of a declared component.

    ``relative``: on its logarithm, so that factors add up. ``written``: unit in which it is asked for. ``how``: to
    measure it, and with which standard error on its scale ``usual``.
    """

    unit: str
    words: str
    of: Callable[[Body], float]
    written: str
    how: str
    usual: float
    relative: bool = True

    def on_scale(self, x: float) -> float:
        """``x`` on the scale on which effects add up."""
        return math.log(x) if self.relative else x


QUANTITIES: Mapping[str, BodyQuantity] = {
    "mass": BodyQuantity(
        "kg",
        "mean mass of one body",
        lambda body: body.mean_mass,
        "g",
        "count fifty, weigh them in five lots of ten",
        0.01,
    ),
    "length": BodyQuantity(
        "m",
        "mean longest dimension of a body",
        lambda body: max(body.extents),
        "mm",
        "measure thirty with a caliper",
        0.01,
    ),
    "length_spread": BodyQuantity(
        "1",
        "standard deviation of the longest dimension from body to body, over its mean",
        lambda body: body.sizes.spread if body.sizes.varies else 0.0,
        "1",
        "of the same thirty",
        0.02,
        relative=False,
    ),
}


@dataclass(frozen=True)
class MeasuredBody(Record):
    """One number of the component ``body``, SI: its mean and the standard error of that."""

    body: str
    quantity: str
    mean: float
    standard_error: float

    @property
    def value(self) -> float:
        """The mean on the scale on which effects add up."""
        return QUANTITIES[self.quantity].on_scale(self.mean)

    @property
    def deviation(self) -> float:
        """Its standard error there."""
        return self.standard_error / self.mean if QUANTITIES[self.quantity].relative else self.standard_error


def bodies_of(scene: Scene, asked: Sequence[MeasuredBody]) -> list[float]:
    """What ``scene``, with the effects in it, has in place of ``asked``, SI."""
    bodies = {body.name: body for body in actual(scene).bodies}
    return [QUANTITIES[one.quantity].of(bodies[one.body]) for one in asked]


def body_numbers(scene: Scene, asked: Sequence[MeasuredBody]) -> Array:
    """The same on the scales on which effects add up, (q,)."""
    found = zip(asked, bodies_of(scene, asked), strict=True)
    return np.array([QUANTITIES[one.quantity].on_scale(x) for one, x in found])


def read_bodies(path: Path, scene: Scene) -> tuple[MeasuredBody, ...]:
    """The table in ``path`` of the bodies of ``scene``; none of the rows that are comments.

    Raises
    ------
    MeasurementError
        One line naming file, line, value and what is allowed.
    """
    table = read_table(path, MOST_BYTES, MeasurementError, ":{}", comments=True)
    check_cells(table, lambda line, what: MeasurementError(f"{path}:{line}: {what}"))
    if not table.rows or tuple(table.rows[0][1]) != COLUMNS:
        found = ",".join(table.rows[0][1]) if table.rows else "nothing"
        raise MeasurementError(f"{path}: columns: {found}; allowed: {','.join(COLUMNS)}")
    rows: dict[tuple[str, str], MeasuredBody] = {}
    for line, cells in table.rows[1:]:
        try:
            row = _row(cells, scene)
            if (row.body, row.quantity) in rows:
                raise MeasurementError(f"{row.quantity} of {row.body}: appears twice; allowed: once")
        except (ParameterError, MeasurementError) as error:
            raise MeasurementError(f"{path}:{line}: {error}") from None
        rows[row.body, row.quantity] = row
    return tuple(rows.values())


def _row(cells: Sequence[str], scene: Scene) -> MeasuredBody:
    body, quantity, unit, mean, error = cells
    names = [one.name for one in scene.bodies]
    if body not in names:
        raise MeasurementError(f"body: {body!r}; allowed: {', '.join(names)}")
    if quantity not in QUANTITIES:
        raise MeasurementError(f"quantity: {quantity!r}; allowed: {', '.join(QUANTITIES)}")
    kind = QUANTITIES[quantity]
    suffix = "" if unit == "1" else unit
    numbers = {
        key: parse_quantity(f"{text}{suffix}", kind.unit, key)
        for key, text in (("mean", mean), ("standard_error", error))
    }
    if numbers["standard_error"] <= 0.0:
        raise MeasurementError(f"standard_error: {error}; allowed: more than 0")
    if numbers["mean"] < 0.0 or (kind.relative and numbers["mean"] == 0.0):
        raise MeasurementError(f"mean: {mean}; allowed: {'more than 0' if kind.relative else '0 or more'}")
    return MeasuredBody(body, quantity, **numbers)
