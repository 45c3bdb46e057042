"""T3 and the restitution table: what comes out for the restitution that was put in.

T3 and the rows "fine step" are the law, without the error of the step. The rows "pour's step" are a grain of 5 mm at
1 m/s with the time step that a pour would take (`time_step.py`), 25 steps in a contact: there e out depends on where
between two steps the contact begins. Eight beginnings are run; their mean and the one furthest off are the rows.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solver.scenes.time_step import time_step
from solver.single_body.free_world import GRAIN, RADIUS, grain_on_plate
from solver.verification.chung_ooi import CAST_IRON, OXIDE
from solver.verification.impacts import Impact, rebounds
from solver.verification.row import Row, of_value

LIMIT = 0.5
TABLE = (0.20, 0.30, 0.40, 0.50, 0.60, 0.70, 0.80, 0.90, 0.95, 0.98)
BEGINNINGS = 8
"""Places between two steps at which the contact begins."""
SOURCE = "the restitution put in"


def t3() -> Iterator[Row]:
    """A sphere of r 2.5 mm meets the rigid plane at 3.9 m/s."""
    for material in (OXIDE, CAST_IRON):
        values = (0.2, 0.4, 0.6, 0.8, 1.0)
        impacts = [Impact(material, 2.5e-3, 3.9, restitution=e) for e in values]
        for e, out in zip(values, rebounds(impacts), strict=True):
            yield of_value("T3", f"e out, {material.name}", e, out.v_n / 3.9, LIMIT, SOURCE, at=f"e = {e:g}")


def table() -> Iterator[Row]:
    """e out over e in, with a fine step and with that of a pour."""
    grain = [Impact(GRAIN, RADIUS, 1.0, restitution=e) for e in TABLE]
    for e, out in zip(TABLE, rebounds(grain), strict=True):
        yield of_value("restitution", "e out, fine step", e, out.v_n, LIMIT, SOURCE, at=f"e = {e:g}")
    dt = time_step(grain_on_plate())
    starts = [k / BEGINNINGS * dt for k in range(BEGINNINGS)]
    begun = [Impact(GRAIN, RADIUS, 1.0, restitution=e, gap=gap) for e in TABLE for gap in starts]
    out_of = np.array([out.v_n for out in rebounds(begun, dt)]).reshape(len(TABLE), BEGINNINGS)
    for e, values in zip(TABLE, out_of, strict=True):
        furthest = values[np.argmax(np.abs(values - e))]
        yield of_value("restitution", "e out, pour's step, mean", e, values.mean(), LIMIT, SOURCE, at=f"e = {e:g}")
        yield of_value("restitution", "e out, pour's step, furthest", e, furthest, LIMIT, SOURCE, at=f"e = {e:g}")
