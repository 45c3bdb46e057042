"""A diagnosis as piles side by side: the surface that was measured, and the scenes of both models."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from doe.declared.model import effect_values
from doe.measurement.load import load_measurement
from explorer.diagnosis.piles import answer_piles, grid_surface, surface_of_revolution
from explorer.diagnosis.result import DiagnosisResult
from explorer.errors import CommandError
from solver.assets import measurement_folder
from solver.scenes.scene import value
from tests.explorer import diagnosed

pytestmark = pytest.mark.usefixtures("unprinted")


def volume_under(surface):
    """Volume [m³] between the triangles and the plate."""
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    area = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return abs((area * (a[:, 2] + b[:, 2] + c[:, 2]) / 3.0).sum())


def test_a_cone_s_profile_turned_about_the_axis_has_a_cone_s_volume():
    radius = np.linspace(0.0, 0.05, 26)[1:]
    surface = surface_of_revolution(radius, 0.03 * (1.0 - radius / 0.05))
    flat_top = np.pi * radius[0] ** 2 * 0.03 * (1.0 - radius[0] / 0.05)
    frustum = np.pi * 0.05**2 * 0.03 / 3.0 * (1.0 - (1.0 - (1.0 - radius[0] / 0.05)) ** 3) - (
        np.pi * radius[0] ** 2 * 0.03 * (1.0 - radius[0] / 0.05)
    )
    # A polygon of 72 corners has 0.13 % less area than its circle; the innermost disc is flat.
    assert volume_under(surface) == pytest.approx(frustum + flat_top, rel=0.01)


def test_a_scan_keeps_its_heights_and_leaves_the_bare_plate_out():
    at = np.linspace(-0.02, 0.02, 5)
    height = np.zeros((5, 5))
    height[1, 2] = 0.01
    surface = grid_surface(at, at, height)
    peak = surface.vertices[surface.vertices[:, 2].argmax()]
    np.testing.assert_allclose(peak, [at[1], at[2], 0.01])
    assert len(surface.faces) == 2 * 4  # the four cells about the peak
    assert volume_under(surface) == pytest.approx(0.01 * 0.01**2, rel=1e-9)  # six triangles of d²/2 with h/3 each


def test_both_models_stand_in_the_set_up_of_the_first_fitted_condition():
    folder = measurement_folder("trefoil_2")
    measurement = load_measurement(folder)
    result = diagnosed.typed(diagnosed.result_of_case("effect"))
    theta = tuple(float(one.mean if one.mean is not None else one.low) for one in measurement.parameters)
    effect = ("rolling_resistance", (0.1,))
    models = replace(
        result.confirmation,
        before=replace(result.confirmation.before, theta=theta, effects=()),
        after=replace(result.confirmation.after, theta=theta, effects=(effect,)),
    )
    piles = answer_piles(replace(result, data=replace(result.data, folder=str(folder)), confirmation=models))
    assert piles.condition.name == measurement.fit[0].name
    for one, wanted in zip(measurement.parameters, theta, strict=True):
        assert value(piles.before, one.path) == wanted
    (path, amplitude), *_ = effect_values(*effect).items()
    assert (value(piles.before, path), value(piles.after, path)) == (0.0, amplitude)
    angles = measurement.fit[0].offered["angle_of_repose_deg"].values
    assert piles.angle == (pytest.approx(angles.mean()), pytest.approx(angles.std(ddof=1)))
    with pytest.raises(CommandError, match="not there any more"):
        answer_piles(replace(result, data=replace(result.data, folder="/nowhere")))


def test_the_example_shows_its_piles_by_the_shipped_name_of_its_data():
    """`examples/trefoil_2` names no folder of the machine that made it."""
    example = Path(__file__).parents[3] / "examples" / "trefoil_2" / "diagnosis.json"
    result = DiagnosisResult.from_dict(json.loads(example.read_text()))
    assert (result.data.folder, result.verdict) == ("trefoil_2", "effect:rolling_resistance")
    piles = answer_piles(result)
    path = "effect.rolling_resistance.rolling_friction"
    assert value(piles.before, path) == 0.0 < value(piles.after, path)
    assert piles.measured is not None
    # One pour may say the opposite of what all of them do: those of the confirmation are told as well.
    (before, sd, pours), (after, *_) = piles.poured
    assert pours == next(one.pours for one in result.confirmation.before.conditions)
    assert sd > 0.0
    measured = piles.angle[0]
    row = next(one for one in result.error.fit if one.observable == "angle_of_repose_deg")
    assert abs(before - measured) == pytest.approx(row.before, abs=1e-6)
    assert abs(after - measured) == pytest.approx(row.after, abs=1e-6)
