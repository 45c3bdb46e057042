"""What data can tell before anything is simulated: counting, resolution by hand, and effects without a telltale."""

from dataclasses import replace

import numpy as np
import pytest

from doe.measurement import load_measurement, reach_of
from doe.measurement.measurement import Observation
from doe.measurement.observations import _has_spread
from doe.measurement.reach import _resolution
from solver import EFFECTS, Telltale, all_names, named
from solver.assets import measurement_folder
from solver.effects.plate_tilt import PlateTilt
from tests.doe.measurement.folders import MEASUREMENT, changed, write

HEAD = "replicate,observable,x,value\n"
ANGLE = HEAD + "1,angle_of_repose_deg,,20\n2,angle_of_repose_deg,,22\n"


def reach(folder, table=ANGLE, measurement=MEASUREMENT):
    return reach_of(load_measurement(write(folder, {"slow.csv": table, "measurement.toml": measurement})))


def test_resolution_by_hand(tmp_path):
    (angle,) = reach(tmp_path).conditions[0].resolutions
    # 20 and 22: mean 21, s = √2, s/√2 = 1; Student's t at 97.5 % with one degree of freedom: 12.706.
    assert (angle.mean, angle.sd, angle.standard_error) == pytest.approx((21.0, np.sqrt(2.0), 1.0), rel=1e-12)
    assert angle.half_width == pytest.approx(12.706, rel=1e-4)


def test_a_single_reading_is_known_to_its_stated_uncertainty(tmp_path):
    text = MEASUREMENT + "\n[uncertainty]\nangle_of_repose_deg = 0.5\n"
    (angle,) = reach(tmp_path, HEAD + "1,angle_of_repose_deg,,20\n", text).conditions[0].resolutions
    assert (angle.replicates, angle.sd, angle.standard_error) == (1, 0.5, 0.5)
    assert angle.half_width == pytest.approx(1.96 * 0.5, rel=1e-4)


def test_where_nothing_was_read_a_stated_uncertainty_makes_no_number():
    nothing = Observation("angle_of_repose_deg", "deg", None, np.array([np.nan, np.nan]), 0.5)
    assert not _has_spread(nothing)
    assert _has_spread(replace(nothing, values=np.array([np.nan, 21.0])))
    assert not _has_spread(replace(nothing, values=np.array([np.nan, 21.0]), uncertainty=None))
    assert np.isnan(_resolution("angle_of_repose_deg", "deg", nothing.values, 0.5).standard_error)


def test_one_number_fits_exactly(tmp_path):
    found = reach(tmp_path)
    assert (found.equations, found.unknowns) == (1, 1)
    assert found.warnings[0].startswith("one number to fit")


def test_no_more_summaries_than_parameters_is_a_warning(tmp_path):
    table = ANGLE + "1,apex_height_m,,0.02\n2,apex_height_m,,0.021\n"
    text = changed(MEASUREMENT, "[parameters]", '[parameters]\n"pair.glass.glass.restitution" = {low=0.1, high=0.9}')
    nothing, little = "the model can fit what it lacks; nothing can show", "little is left to judge the fit by"
    assert reach(tmp_path / "two", table, text).warnings[0] == f"2 summaries against 2 free parameters: {nothing}"
    table += "1,footprint_r50_m,,0.03\n2,footprint_r50_m,,0.04\n"
    assert reach(tmp_path / "three", table, text).warnings[0] == f"3 summaries against 2 free parameters: {little}"


def test_a_summary_without_scatter_is_no_equation(tmp_path):
    found = reach(tmp_path, ANGLE + "1,residual_mass_kg,,0\n2,residual_mass_kg,,0\n")
    assert [r.summary for r in found.conditions[0].resolutions] == ["angle_of_repose_deg", "residual_mass_kg"]
    assert found.equations == 1


@pytest.mark.parametrize(
    ("observable", "seen", "unseen"),
    [
        ("angle_of_repose_deg", {"rolling_resistance", "adhesion_jkr"}, {"air_drag", "plate_tilt", "density_error"}),
        (
            "discharge_t50_s",
            {"air_drag", "density_error", "rolling_resistance", "adhesion_jkr", "twisting"},
            {"funnel_offset", "plate_tilt"},
        ),
        ("centroid_x_m", {"plate_tilt", "funnel_offset"}, {"rolling_resistance", "air_drag", "size_dispersion"}),
        ("stray_fraction", {"velocity_dependent_restitution"}, {"shape_elongation", "plate_tilt"}),
    ],
)
def test_effects_without_a_telltale_are_named(tmp_path, observable, seen, unseen):
    hidden = set(reach(tmp_path, HEAD + f"1,{observable},,0.1\n2,{observable},,0.2\n").hidden_effects)
    assert unseen <= hidden
    assert not seen & hidden


def test_what_is_only_held_out_reveals_nothing(tmp_path):
    measurement = load_measurement(
        write(tmp_path, {"slow.csv": ANGLE, "fast.csv": HEAD + "1,centroid_x_m,,0.1\n2,centroid_x_m,,0.2\n"})
    )
    assert "plate_tilt" in reach_of(measurement).hidden_effects


def test_shipped_pours_can_show_every_effect_and_the_drum_no_tilt():
    pour, drum = (reach_of(load_measurement(measurement_folder(name))) for name in ("trefoil_1", "granudrum_mcc"))
    assert (pour.hidden_effects, pour.warnings) == ((), ())
    assert (pour.has_discharge, pour.has_asymmetry, pour.has_holdout) == (True, True, True)
    assert set(drum.hidden_effects) == {"plate_tilt", "funnel_offset"}
    assert not drum.has_asymmetry
    assert any("one replicate" in warning for warning in drum.warnings)


class LeaningStand(PlateTilt):
    """An effect that nothing in this package has heard of."""

    name = "leaning_stand"


def test_a_new_effect_says_itself_what_reveals_it(tmp_path, monkeypatch):
    monkeypatch.setitem(EFFECTS.things, "leaning_stand", LeaningStand)
    assert "leaning_stand" in reach(tmp_path).hidden_effects
    table = HEAD + "1,centroid_x_m,,0.1\n2,centroid_x_m,,0.2\n"
    assert "leaning_stand" not in reach(tmp_path, table).hidden_effects


def test_every_observable_says_what_it_can_reveal():
    assert all(named(name).telltales for name in all_names())
    assert {telltale for name in all_names() for telltale in named(name).telltales} == set(Telltale)


def test_an_instrument_that_errs_equally_in_all_replicates_is_not_averaged_away():
    values = np.array([25.0, 25.1, 24.9])
    found = _resolution("angle_of_repose_deg", "deg", values, 2.0)
    assert found.standard_error == pytest.approx(np.hypot(0.1 / np.sqrt(3.0), 2.0))
    assert found.half_width == pytest.approx(np.hypot(4.3027 * 0.1 / np.sqrt(3.0), 1.95996 * 2.0), rel=1e-4)
    plain = _resolution("angle_of_repose_deg", "deg", values, float("nan"))
    assert plain.standard_error == pytest.approx(0.1 / np.sqrt(3.0))
