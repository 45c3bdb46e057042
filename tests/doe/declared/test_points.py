"""Which pours are asked for: the same ones every time, parameters moved evenly; and symmetries against real pours."""

import numpy as np
import pytest

from doe.declared.model import CalibratedParameter, CandidateEffect, Declared, DeclaredCondition
from doe.declared.points import AS_IT_IS, Direction, View, base_points, directions_of, effect_points, middle, moved
from doe.measurement.features import features_of_record
from doe.validation.laboratory import TREFOILS, read_laboratory
from solver import run_pour, with_values

PARAMETERS = (
    CalibratedParameter("friction", 0.4, 0.8, 0.5, 0.05),
    CalibratedParameter("restitution", 0.3, 0.9),
    CalibratedParameter("wall friction", 0.2, 0.9, 0.6, 0.02),
)
DECLARED = Declared(PARAMETERS, (), (DeclaredCondition("one", ("height",)),))
ROLLING = CandidateEffect("rolling_resistance", (0.0,), (0.2,))
DENSITY = CandidateEffect("density_error", (-0.3,), (0.5,))
TILT = CandidateEffect("plate_tilt", (-5.0, -4.0), (5.0, 4.0))


def test_more_points_continue_the_sequence():
    assert base_points(DECLARED, 40)[:24] == base_points(DECLARED, 24)
    (direction,) = directions_of(ROLLING)
    first = effect_points(DECLARED, direction, 0.5, 16)
    assert effect_points(DECLARED, direction, 0.5, 30)[:16] == first
    assert effect_points(DECLARED, direction, 0.5, 30, 16) == effect_points(DECLARED, direction, 0.5, 30)[16:]


def test_a_point_is_named_by_its_sequence_and_amplitude():
    up, down = directions_of(DENSITY)
    names = {
        (p.sequence, p.number)
        for direction in (up, down)
        for share in (0.5, 1.0)
        for p in effect_points(DECLARED, direction, share, 4)
    }
    assert len(names) == 16


def test_directions_are_up_and_down_or_to_four_sides_of_one_size():
    assert [one.name for one in directions_of(DENSITY)] == ["density_error +", "density_error -"]
    assert [one.full for one in directions_of(DENSITY)] == [(0.5,), (-0.3,)]
    assert [one.full for one in directions_of(TILT)] == [(4.0, 0.0), (0.0, 4.0), (-4.0, 0.0), (0.0, -4.0)]
    assert [one.angle for one in directions_of(TILT)] == pytest.approx([0.0, np.pi / 2, np.pi, 1.5 * np.pi])


def test_parameters_are_moved_evenly_and_apart():
    """Each by one deviation, at either side as often in every four, and no two together."""
    theta = np.array([DECLARED.theta(moved(DECLARED, k)) for k in range(16)])
    assert np.abs(theta) == pytest.approx(1.0)
    for first in range(0, 16, 4):
        four = theta[first : first + 4]
        assert four.sum(axis=0) == pytest.approx(0.0)
        assert four.T @ four == pytest.approx(4.0 * np.eye(3))


def test_a_parameter_stays_within_its_range():
    narrow = Declared((CalibratedParameter("friction", 0.49, 0.52, 0.5, 0.05),), (), ())
    assert [moved(narrow, k)[0] for k in range(2)] == pytest.approx([0.52, 0.49])
    assert middle(PARAMETERS) == (0.5, pytest.approx(0.6), 0.6)
    # One that nobody measured moves by the deviation of an even distribution.
    assert PARAMETERS[1].deviation == pytest.approx(0.6 / np.sqrt(12.0))


@pytest.fixture(scope="module")
def condition():
    found = read_laboratory(TREFOILS).declared.fit[0]
    scene = with_values(found.scene, {"rig.mass": 2.0e-3, "numerics.duration": 0.5})
    return type(found)(found.name, found.role, scene, found.replicates, found.observations)


def test_a_displaced_funnel_is_a_displaced_pile(taichi, condition):
    """Bit by bit the same pour, so the same numbers but for the rounding of the displacement."""
    offset = {"effect.funnel_offset.dx": 0.01, "effect.funnel_offset.dy": -0.004}
    poured = run_pour(with_values(condition.scene, offset), 5)
    seen = View(shift=(0.01, -0.004)).of(run_pour(condition.scene, 5))
    one, other = (features_of_record(condition, record) for record in (poured, seen))
    np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-12)


def test_a_quarter_turn_is_a_turned_pile(taichi, condition):
    record = run_pour(condition.scene, 5)
    names = dict(zip(_names(condition), features_of_record(condition, record), strict=True))
    turned = dict(zip(_names(condition), features_of_record(condition, View(turns=1).of(record)), strict=True))
    assert turned["centroid_x_m"] == pytest.approx(-names["centroid_y_m"])
    assert turned["centroid_y_m"] == pytest.approx(names["centroid_x_m"])
    for same in ("footprint_r50_m", "apex_height_m", "discharge_t90_s", "ring_height_2_m", "ring_volume_m3"):
        assert turned[same] == pytest.approx(names[same], rel=1e-6)
    once_round = View(turns=4).of(record)
    np.testing.assert_array_equal(once_round.pile.position, record.pile.position)
    assert AS_IT_IS.of(record) is record


def _names(condition):
    from doe.measurement.features import feature_set

    return feature_set(condition).names


def test_a_direction_is_a_share_of_its_ends():
    assert Direction("push", "push", (2.0,)).at(0.25) == (0.5,)
