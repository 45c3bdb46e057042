"""Measurements of single bodies with a balance, a caliper and a plate, in addition to the readings of their pours.

``measurement.toml`` names the table: ``bodies = "bodies.csv"``. Each row is one number for one component of the
material:

    body,quantity,unit,mean,standard_error
    seed,mass,g,0.0712,0.0006
    seed,length,mm,11.1,0.1
    seed,length_spread,1,0.08,0.01
    seed,restitution,1,0.47,0.02

``mass``: the mean mass of a body, from a counted number of bodies weighed together. ``length``: the mean of the longest
dimension. ``length_spread``: the standard deviation of the longest dimension between bodies, divided by its mean. The
other quantities are measured on a plate of the rig's material (``solver/single_body/plate_tests.py``): the force,
divided by the body's weight, that sets it in motion along the plate (``apparent_static_friction``) and that keeps it
sliding (``apparent_kinetic_friction``) while it is held so that it cannot turn; and the ``restitution`` in a fall of
20 cm after which the body does not rotate.
"""

from __future__ import annotations

import math
import re
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
BARE = re.compile(r"[-+0-9.eE]+")
"""A number without a unit."""
LEAST_ERROR = 1e-5
"""Smallest standard error of a quantity on its scale: no balance is better, and smaller ones give singular evidence."""


@dataclass(frozen=True)
class BodyQuantity:
    """A quantity that can be measured on single bodies: its unit, its description, and its value for a component.

    ``of`` computes the value from a declared component; it is None for quantities that the plate test of the same name
    simulates. ``relative``: its scale is logarithmic, so that factors add up. ``loads``: what two effects add to 1 is
    added, as the loads on a contact are; reductions are multiplied. ``written``: the unit in which the user is asked
    for the quantity. ``how``: how to measure it; ``usual``: the standard error of this on its scale.
    """

    unit: str
    words: str
    of: Callable[[Body], float] | None
    written: str
    how: str
    usual: float
    relative: bool = True
    loads: bool = False

    def on_scale(self, x: float) -> float:
        """Return ``x`` on the scale on which effects add up."""
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
        "measure thirty with a caliper; the same as for the mean length",
        0.02,
        relative=False,
    ),
    "apparent_static_friction": BodyQuantity(
        "1",
        "force that sets a body in motion along a plate of the rig's material, over its weight",
        None,
        "1",
        "lay ten on the plate one by one, held so that they do not turn (three glued under a card slide as well), and "
        "pull by a spring balance",
        0.05,
        loads=True,
    ),
    "apparent_kinetic_friction": BodyQuantity(
        "1",
        "force that keeps a body sliding on a plate of the rig's material, over its weight",
        None,
        "1",
        "pull ten over the plate at about 10 cm/s by a spring balance, held so that they do not turn",
        0.05,
        loads=True,
    ),
    "restitution": BodyQuantity(
        "1",
        "restitution of a body that falls on a plate of the rig's material",
        None,
        "1",
        "let ten fall from 20 cm and film how high they rise; those that turn do not count",
        0.02,
        relative=False,
    ),
}


@dataclass(frozen=True)
class MeasuredBody(Record):
    """One quantity of the component ``body``: its mean and the standard error of the mean, SI."""

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
        """The standard error on that scale."""
        return self.standard_error / self.mean if QUANTITIES[self.quantity].relative else self.standard_error


def bodies_of(scenes: Sequence[Scene], asked: Sequence[MeasuredBody]) -> Array:
    """Value of each quantity in ``asked`` in each of ``scenes``, with the effects of the scene; SI, shape (n, q)."""
    found, simulated = np.zeros((len(scenes), len(asked))), []
    for k, scene in enumerate(scenes):
        bodies = {body.name: body for body in actual(scene).bodies}
        for j, one in enumerate(asked):
            of = QUANTITIES[one.quantity].of
            if of is None:
                simulated.append((k, j))
            else:
                found[k, j] = of(bodies[one.body])
    if simulated:
        from solver import PlateTest, plate_tests  # imports Taichi, which reading a table does not need

        tests = [PlateTest(scenes[k], asked[j].body, asked[j].quantity) for k, j in simulated]
        for place, x in zip(simulated, plate_tests(tests), strict=True):
            found[place] = x
    return found


def body_numbers(scenes: Sequence[Scene], asked: Sequence[MeasuredBody]) -> Array:
    """The same as :func:`bodies_of`, on the scales on which effects add up, shape (n, q)."""
    found = bodies_of(scenes, asked)
    for j, one in enumerate(asked):
        scale = QUANTITIES[one.quantity].on_scale
        found[:, j] = [scale(x) for x in found[:, j]]
    return found


def read_bodies(path: Path, scene: Scene) -> tuple[MeasuredBody, ...]:
    """Read the table in ``path``, which describes the bodies of ``scene``; comment rows are skipped.

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
            row = _row([*cells[:3], *map(table.plain, cells[3:])], scene)
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
    if not suffix and kind.unit != "1" and BARE.fullmatch(mean):
        raise MeasurementError(
            f"unit: {unit!r} of {quantity}; allowed: {kind.unit}, {kind.written} or another unit of it"
        )
    numbers = {
        key: parse_quantity(f"{text}{suffix}", kind.unit, key)
        for key, text in (("mean", mean), ("standard_error", error))
    }
    if numbers["mean"] < 0.0 or (kind.relative and numbers["mean"] == 0.0):
        raise MeasurementError(f"mean: {mean}; allowed: {'more than 0' if kind.relative else '0 or more'}")
    row = MeasuredBody(body, quantity, **numbers)
    if row.deviation < LEAST_ERROR:
        least = f"{LEAST_ERROR:g}{' of the mean' if kind.relative else ''}"
        raise MeasurementError(f"standard_error: {error}; allowed: {least} or more")
    return row
