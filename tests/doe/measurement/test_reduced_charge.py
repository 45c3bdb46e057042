"""The example of a slot hopper: its table is what its script makes of the measured curve."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from doe.measurement import load_measurement
from doe.measurement.reach import reach_of

EXAMPLE = Path(__file__).parents[3] / "examples/slot_hopper"
SCRIPT = runpy.run_path(str(EXAMPLE / "reduced_charge.py"))


def test_a_steady_flow_that_ends_is_cut_where_the_charge_is_left():
    """2 kg at 0.5 kg/s from 0.3 s on, of which 0.2 kg stay: 0.6 kg are left after 3.1 s, and the rate goes on."""
    time = np.linspace(0.0, 6.0, 61)
    fraction = np.clip(0.5 * (time - 0.3), 0.0, 1.8) / 2.0
    rate, later, discharged = SCRIPT["reduced"](time, fraction, 2.0)
    assert rate == pytest.approx(0.5)
    assert discharged == pytest.approx(np.clip(0.5 * later, 0.0, 0.4))
    assert later[-1] == pytest.approx(6.0 - 3.1)


@pytest.mark.parametrize(("bodies", "given"), [("spheres", ("2.344",)), ("cylinders", ("2.495", "residual"))])
def test_the_table_is_made_of_the_curve(bodies, given, capsys):
    SCRIPT["main"](str(EXAMPLE / f"plastic_{bodies}.csv"), *given)
    assert capsys.readouterr().out == (EXAMPLE / f"{bodies}.csv").read_text()


def test_it_can_be_read():
    measurement = load_measurement(EXAMPLE)
    found = reach_of(measurement)
    assert (found.equations, found.unknowns, found.has_discharge, found.has_holdout) == (9, 2, True, True)
    # The held-out cylinders are those of the source: mass and inertia of a solid cylinder.
    (body,) = measurement.holdout[0].scene.bodies
    mass = 1128.0 * math.pi * 2e-3**2 * 8e-3
    assert body.clump.mass == pytest.approx(mass, rel=1e-3)
    across = mass * (3.0 * 2e-3**2 + 8e-3**2) / 12.0
    assert tuple(body.clump.inertia) == pytest.approx((across, across, 0.5 * mass * 2e-3**2), rel=2e-3)
    assert "rolling_resistance" not in found.hidden_effects
