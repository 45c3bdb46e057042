"""Effects that join the declared model: their scenes, their ranges, and what is a candidate beside them."""

from dataclasses import replace

import pytest

from doe.declared.given import SPAN, with_given
from doe.declared.model import declare
from doe.declared.points import Point, directions_of, effect_points
from doe.declared.pours import ModelPours
from doe.diagnose.training_pours import unchanged_by_a_quarter_turn
from doe.errors import MeasurementError
from doe.measurement import load_measurement
from solver import EFFECTS, value
from solver.assets import measurement_folder


@pytest.fixture(scope="module")
def measurement():
    return load_measurement(measurement_folder("trefoil_1"))


def test_every_condition_has_the_effect_and_its_amplitude_is_calibrated(measurement):
    strongest = EFFECTS["rolling_resistance"].strongest
    size = 0.5 * strongest
    found = with_given(measurement, {"rolling_resistance": (1.15 * size,)})  # rounded to a power of √2 below that
    path = "effect.rolling_resistance.rolling_friction"
    assert [value(one.scene, path) for one in found.conditions] == [size] * len(measurement.conditions)
    last = found.parameters[-1]
    assert (last.path, last.low, last.high) == (path, *(pytest.approx(size * k) for k in (1 - SPAN, 1 + SPAN)))
    assert found.parameters[:-1] == measurement.parameters
    # Never beyond the literature.
    assert with_given(measurement, {"rolling_resistance": (strongest,)}).parameters[-1].high == strongest


def test_a_given_effect_is_no_candidate_and_is_given_once(measurement):
    found = with_given(measurement, {"density_error": (0.2,)})
    assert [one.name for one in declare(found, ("density_error", "air_drag")).effects] == ["air_drag"]
    with pytest.raises(MeasurementError, match=r"effect\.density_error\.excess is already one of its parameters"):
        with_given(found, {"density_error": (0.2,)})


def test_a_given_tilt_turns_with_the_bench_and_leaves_no_symmetry(measurement):
    """In a rig that is turned by 180° it acts the other way, in the condition itself and in every pour of it."""
    (first, *others) = measurement.conditions
    turned = replace(measurement, conditions=(first, replace(first, turned=True), *others))
    size = EFFECTS["plate_tilt"].strongest / 2.0
    along = (0.8 * size, -0.6 * size)
    found = with_given(turned, {"plate_tilt": along})

    def tilt(scene):
        return tuple(value(scene, f"effect.plate_tilt.{name}") for name in ("tilt_x", "tilt_y"))

    assert [tilt(one.scene) for one in found.conditions[:2]] == [
        pytest.approx(along),
        pytest.approx((-along[0], -along[1])),
    ]
    pours = ModelPours(found.conditions, [one.path for one in found.parameters], None, None)
    middle = [0.5 * (one.low + one.high) for one in measurement.parameters]
    point = Point("base", 0, (*middle, 1.5, -0.5))
    for place, sign in ((0, 1.0), (1, -1.0)):
        assert tilt(pours.scene(point, place)) == (sign * 1.5, sign * -0.5)
    assert unchanged_by_a_quarter_turn(first.scene)
    assert not unchanged_by_a_quarter_turn(found.conditions[0].scene)
    assert not unchanged_by_a_quarter_turn(with_given(measurement, {"funnel_offset": (0.005, 0.0)}).conditions[0].scene)


def test_what_the_rigs_cannot_have_is_neither_given_nor_asked_beside_it():
    """Scattered sizes of the extract are drawn in to 0.12 by its rig, of 0.3 that the literature supports."""
    measured = load_measurement(measurement_folder("sunflower_extract"))
    alone = next(one for one in declare(measured, ("size_dispersion",)).effects)
    found = with_given(measured, {"size_dispersion": (0.95 * alone.high[0],)})
    assert found.parameters[-1].high <= alone.high[0]
    declared = declare(found, ("shape_elongation",))
    pours = ModelPours(found.conditions, [one.path for one in found.parameters], None, None)
    points = [point for one in directions_of(declared.effects[0]) for point in effect_points(declared, one, 1.0, 8)]
    assert [pours.scene(point, 0) is not None for point in points] == [True] * len(points)


def test_next_to_nothing_cannot_be_given(measurement):
    for amplitude in ((0.0,), (1e-17,)):
        with pytest.raises(MeasurementError, match=r"density_error: an amplitude of .* is too small; allowed"):
            with_given(measurement, {"density_error": amplitude})
