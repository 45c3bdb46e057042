"""What a draw-down box leaves behind: the slopes in the upper box and the flow through its slot.

The slopes on either side of the slot are read like the flanks of a pile (``repose.py``): silhouette along +y, then a
least-squares line through the tops of all columns between 20 % and 80 % of that side's height above the shelf.
Source of the test: Roessler et al. 2019, Powder Technology 343:803; the angle of the material that remains above an
outlet is also called the angle of drain.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, cast

import numpy as np
import numpy.typing as npt

from solver.effects.effect import Telltale
from solver.observables.observable import ANGLE, Value, mean_value, of_record
from solver.observables.repose import flank_angles_deg
from solver.observables.silhouette import PIXEL, largest_part, silhouette
from solver.rigs.draw_down_box import DrawDownBox
from solver.rigs.rig import DRAW_DOWN

if TYPE_CHECKING:
    from solver.pours.record import Record, Spheres


def draw_down_angle(record: Record) -> Value:
    """Slope of what stays in the upper box, mean of both sides of the slot; spread over the two."""
    return mean_value(_sides_deg(record), "deg")


def draw_down_angle_left(record: Record) -> Value:
    """Slope of what stays in the upper box on the side of -x."""
    return Value(_sides_deg(record)[0], "deg")


def draw_down_angle_right(record: Record) -> Value:
    """Slope of what stays in the upper box on the side of +x."""
    return Value(_sides_deg(record)[1], "deg")


def slopes_deg(spheres: Spheres, floor: float) -> tuple[float, float]:
    """Angles [°] at which ``spheres`` above ``floor`` [m] slope down towards x = 0, from -x and +x; NaN if none."""
    left = _part(spheres, spheres.centre[:, 0] < 0.0, floor)
    right = _part(spheres, spheres.centre[:, 0] > 0.0, floor)
    return (
        flank_angles_deg(largest_part(silhouette(left, 0.0)), PIXEL)[1],
        flank_angles_deg(largest_part(silhouette(right, 0.0)), PIXEL)[0],
    )


def _sides_deg(record: Record) -> tuple[float, float]:
    floor = cast(DrawDownBox, record.scene.rig).shelf_height
    position, inside = record.bodies.position, record.bodies.inside
    upper = np.flatnonzero(inside & (position[:, 2] > floor))
    spheres = record.spheres
    kept = np.isin(spheres.body, upper)
    return slopes_deg(_part(spheres, kept, 0.0), floor)


def _part(spheres: Spheres, chosen: npt.NDArray[np.bool_], floor: float) -> Spheres:
    """The chosen spheres, with heights from ``floor`` [m]."""
    centre = spheres.centre[chosen] - np.array([0.0, 0.0, floor])
    return dataclasses.replace(spheres, centre=centre, radius=spheres.radius[chosen], body=spheres.body[chosen])


SHAPE = Telltale.SHAPE
OBSERVABLES = (
    of_record("draw_down_angle_deg", "deg", draw_down_angle, SHAPE, group=DRAW_DOWN, possible=ANGLE),
    of_record("draw_down_angle_left_deg", "deg", draw_down_angle_left, SHAPE, group=DRAW_DOWN, possible=ANGLE),
    of_record("draw_down_angle_right_deg", "deg", draw_down_angle_right, SHAPE, group=DRAW_DOWN, possible=ANGLE),
)
