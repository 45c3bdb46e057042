"""A data set in: scenes, parameters, values; the shipped ones load; names and free text carry no meaning."""

import csv

import numpy as np
import pytest

from doe.errors import MeasurementError
from doe.measurement import load_measurement, reach_of, summaries_of_data, summary_names
from doe.record import plain
from solver import value, with_values
from solver.assets import AssetNotFoundError, asset_path, measurement_folder
from solver.rigs import Funnel
from solver.scenes.insertion import Insertion
from tests.doe.measurement.folders import MATERIAL, MEASUREMENT, TABLE, changed, write, write_pile

FACTORS = "table4_plackett_burman_factors"
SHIPPED = ("granudrum_mcc", "trefoil_1", "trefoil_2")
"""Those with a condition held out; the other one is a single published mean."""


def test_a_condition_is_a_scene_to_simulate(tmp_path):
    slow, fast = load_measurement(write(tmp_path)).conditions
    assert slow.scene.rig == Funnel(outlet_height=0.060, mass=0.014, domain_half_width=0.3, wall="steel")
    feed = Insertion(rate=0.1, lead=0.02, drop_speed=0.4, region_radius=0.030, region_height=0.240 - 0.190)
    assert slow.scene.insertion == feed
    assert (slow.scene.numerics.duration, slow.scene.numerics.sample_interval) == (2.6, 0.02)
    assert (fast.scene.numerics.duration, fast.scene.rig) == (0.0, Funnel(wall="steel"))
    assert (slow.role, fast.role, slow.replicates) == ("fit", "holdout", 2)


def test_what_stays_with_the_bench_acts_the_other_way_in_a_turned_rig(tmp_path):
    tilted = MATERIAL + "[effect.plate_tilt]\ntilt_x = 2.0\n[effect.funnel_offset]\ndx = 0.004\n"
    files = {
        "measurement.toml": MEASUREMENT.replace('role = "fit"', 'role = "fit"\nturned = true', 1),
        "material.toml": tilted,
    }
    slow, fast = load_measurement(write(tmp_path, files)).conditions
    assert (slow.turned, fast.turned) == (True, False)
    paths = ("effect.plate_tilt.tilt_x", "effect.funnel_offset.dx")
    assert [value(slow.scene, path) for path in paths] == [-2.0, 0.004]
    assert [value(fast.scene, path) for path in paths] == [2.0, 0.004]


def test_a_condition_may_be_of_another_material(tmp_path):
    files = {
        "measurement.toml": MEASUREMENT.replace('role = "holdout"', 'role = "holdout"\nmaterial = "dense.toml"', 1),
        "dense.toml": MATERIAL.replace("density = 2500.0", "density = 5000.0", 1),
    }
    measurement = load_measurement(write(tmp_path, files))
    slow, fast = (float(value(one.scene, "material.glass.density")) for one in measurement.conditions)
    assert fast == 2.0 * slow == 2.0 * float(value(measurement.scene, "material.glass.density"))
    # What was measured is set in both.
    friction = "pair.glass.glass.static_friction"
    assert len({float(value(one.scene, friction)) for one in measurement.conditions}) == 1


def test_roles_are_kept_apart(tmp_path):
    measurement = load_measurement(write(tmp_path))
    assert [c.name for c in measurement.fit] == ["slow"]
    assert [c.name for c in measurement.holdout] == ["fast"]


def test_values_by_replicate_and_place_with_nan_for_missing(tmp_path):
    slow = load_measurement(write(tmp_path)).conditions[0]
    angle, mass = (slow.offered[name] for name in ("angle_of_repose_deg", "discharged_mass_kg"))
    assert (angle.x, angle.unit, angle.origin) == (None, "deg", "table")
    np.testing.assert_array_equal(angle.values, [20.0, 22.0])
    np.testing.assert_array_equal(mass.x, [0.5, 1.0])
    np.testing.assert_array_equal(mass.values, [[0.001, 0.003], [0.002, np.nan]])


def test_a_unit_column_converts(tmp_path):
    table = "replicate,observable,x,value,unit\n1,apex_height_m,,21,mm\n2,apex_height_m,,0.022,\n"
    slow = load_measurement(write(tmp_path, {"slow.csv": table})).conditions[0]
    np.testing.assert_allclose(slow.offered["apex_height_m"].values, [0.021, 0.022], rtol=1e-12)


def test_a_range_follows_from_mean_and_sd(tmp_path):
    (parameter,) = load_measurement(write(tmp_path)).parameters
    assert (parameter.mean, parameter.sd, parameter.unit) == (0.3, 0.05, "1")
    assert (parameter.low, parameter.high) == pytest.approx((0.15, 0.45), rel=1e-12)  # mean ± 3 sd


def test_a_range_is_clipped_to_what_the_parameter_may_be(tmp_path):
    text = changed(MEASUREMENT, '"pair.glass.glass.static_friction" = { mean = 0.3, sd = 0.05 }',
                   '"pair.steel.glass.restitution" = { low = 0.0, high = 1.0 }')  # fmt: skip
    measurement = load_measurement(write(tmp_path, {"measurement.toml": text}))
    (parameter,) = measurement.parameters
    assert (parameter.path, parameter.low, parameter.high) == ("pair.glass.steel.restitution", 0.05, 1.0)
    assert measurement.notes == ("pair.glass.steel.restitution: range 0 … 1 clipped to 0.05 … 1",)


def test_means_are_in_the_scene_of_every_condition_that_has_the_parameter(tmp_path):
    text = changed(MEASUREMENT, "[parameters]", '[parameters]\n"rig.inlet_diameter" = { mean = 0.12, sd = 0.001 }')
    measurement = load_measurement(write(tmp_path, {"measurement.toml": text}))
    assert [c.scene.rig.inlet_diameter for c in measurement.conditions] == [0.12, 0.12]


def test_unknown_observables_and_stray_piles_are_listed(tmp_path):
    folder = write(tmp_path, {"slow.csv": TABLE + "1,colour,,3\n"})
    write_pile(folder / "piles/other_1.npz")
    assert load_measurement(folder).ignored == (
        "piles/other_1.npz: of no condition",
        "slow.csv: colour: no such observable",
    )


def test_scanned_piles_come_before_the_table(tmp_path):
    folder = write(tmp_path)
    write_pile(folder / "piles/slow_1.npz")
    write_pile(folder / "piles/slow_3.npz", beads=5)
    write_pile(folder / "piles/slow_4.npz", beads=4)
    slow = load_measurement(folder).conditions[0]
    assert slow.replicates == 4
    centre = slow.offered["centroid_x_m"]
    assert centre.origin == "piles"
    # Beads in a row of 13 mm from the axis on: the middle of 6, 5, 4 of them; replicate 2 was not scanned.
    np.testing.assert_allclose(centre.values, [0.0325, np.nan, 0.026, 0.0195], rtol=1e-12)
    assert slow.offered["angle_of_repose_deg"].origin == "piles"


def test_a_gap_in_the_replicates_is_refused(tmp_path):
    folder = write(tmp_path)
    write_pile(folder / "piles/slow_4.npz")
    with pytest.raises(MeasurementError, match=r"slow_4\.npz: replicate 3 of 4 is missing"):
        load_measurement(folder)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_data_load_into_scenes_that_hold(name):
    measurement = load_measurement(measurement_folder(name))
    assert len(measurement.fit) == len(measurement.holdout) == 1
    assert measurement.ignored == ()
    for condition in measurement.conditions:
        for parameter in measurement.parameters:
            for level in (parameter.low, parameter.high):
                with_values(condition.scene, {parameter.path: level})
        assert 8 <= len(summary_names(condition)) <= 12


def test_an_unknown_data_set_lists_what_is_shipped():
    with pytest.raises(AssetNotFoundError, match="shipped: granudrum_mcc, sunflower_extract, trefoil_1, trefoil_2"):
        measurement_folder("trefoil_9")


def without_names(folder):
    """All that a data set says, without its names."""
    measurement = load_measurement(folder)
    conditions = [
        (c.role, c.scene.rig, c.scene.insertion, c.scene.numerics, c.scene.bodies, c.scene.pairs, c.scene.materials,
         c.replicates, plain(c.observations), summary_names(c), summaries_of_data(c).tobytes())
        for c in measurement.conditions
    ]  # fmt: skip
    reach = plain(reach_of(measurement))
    checks = plain(measurement.cross_check)
    for entry in (*reach["conditions"], *checks):
        del entry["condition"]
    return conditions, plain(measurement.parameters), measurement.notes, checks, reach


def test_no_meaning_is_read_into_names_and_free_text(tmp_path):
    """The shipped trefoils under another folder's name, other titles, sources and condition names: equal results."""
    source = measurement_folder("trefoil_1")
    other = tmp_path / "cohesive_powder_from_a_tilted_plate"
    (other / "piles").mkdir(parents=True)
    names = {"fit": "rolling", "holdout": "fit_of_density"}
    text = (source / "measurement.toml").read_text()
    for line in text.splitlines():
        if line.startswith(("title", "source")):
            text = text.replace(line, f'{line.split(" =")[0]} = "adhesion_jkr, wet, elongated"')
    for old, new in names.items():
        text = text.replace(f'name = "{old}"', f'name = "{new}"').replace(f'"{old}.csv"', f'"{new}.csv"')
        (other / f"{new}.csv").write_bytes((source / f"{old}.csv").read_bytes())
        for path in (source / "piles").glob(f"{old}_*.npz"):
            (other / "piles" / path.name.replace(old, new, 1)).write_bytes(path.read_bytes())
    (other / "measurement.toml").write_text(text)
    material = (source / "material.toml").read_text()
    (other / "material.toml").write_text(material.replace('name = "trefoil"', 'name = "tilt"', 1))
    assert without_names(other) == without_names(source)


def test_the_order_of_rows_does_not_matter(tmp_path):
    lines = TABLE.splitlines()
    shuffled = "\n".join([*lines[:2], *reversed(lines[2:])]) + "\n"
    folder = write(tmp_path / "one")
    other = write(tmp_path / "two", {"slow.csv": shuffled, "fast.csv": shuffled})
    assert without_names(folder) == without_names(other)


def test_a_range_is_narrowed_to_what_the_rig_takes():
    """A drum of 84 mm and 20 mm takes up to half of its 110.8 mL; 50 ± 3 · 2 mL would reach beyond."""
    measurement = load_measurement(measurement_folder("granudrum_mcc"))
    volume = next(p for p in measurement.parameters if p.path == "rig.filled_volume")
    # Bisected to a billionth of the range.
    assert volume.high == pytest.approx(0.5 * np.pi * 0.042**2 * 0.020, rel=1e-8)
    assert volume.low == pytest.approx(44e-6, rel=1e-12)
    assert any(note.startswith("rig.filled_volume: range 4.4e-05 … 5.6e-05 narrowed") for note in measurement.notes)


def test_without_a_mean_a_run_starts_within_the_range(tmp_path):
    """The declared friction, 0.3, where the range holds it; the middle where it does not."""
    for low, high, expected in ((0.1, 0.5, 0.3), (0.4, 0.8, 0.6)):
        text = changed(MEASUREMENT, "{ mean = 0.3, sd = 0.05 }", f"{{ low = {low}, high = {high} }}")
        slow = load_measurement(write(tmp_path, {"measurement.toml": text})).conditions[0]
        assert slow.scene.pair("glass", "glass").static_friction == pytest.approx(expected, rel=1e-12)


def test_a_published_mean_says_of_how_many_pours(tmp_path):
    folder = write(tmp_path, {"measurement.toml": changed(MEASUREMENT, 'role = "fit"', 'role = "fit"\nmean_of = 10')})
    slow, fast = load_measurement(folder).conditions
    assert (slow.mean_of, fast.mean_of) == (10, 1)


def test_means_of_no_pours_are_refused(tmp_path):
    folder = write(tmp_path, {"measurement.toml": changed(MEASUREMENT, 'role = "fit"', 'role = "fit"\nmean_of = 0')})
    with pytest.raises(MeasurementError, match="condition 'slow': mean_of: 0 is not a whole number of at least 1"):
        load_measurement(folder)


def test_the_article_s_one_angle_loads_with_its_parameters_as_published():
    """Tables 2 to 4 of the article: means, and ranges of ten values over 3.078 (Tippett 1925)."""
    measurement = load_measurement(measurement_folder("sunflower_extract"))
    (condition,) = measurement.conditions
    assert summary_names(condition) == ("angle_of_repose_deg",)
    assert summaries_of_data(condition).tolist() == [[24.68]]
    published = {row["factor"]: row for row in csv.DictReader(asset_path("source_tables", FACTORS).open())}
    for parameter, factor in zip(measurement.parameters, ("X4", "X7", "X16", "X13"), strict=True):
        low, high = (1e6 ** (factor == "X4") * float(published[factor][end]) for end in ("low", "high"))
        assert parameter.sd == pytest.approx((high - low) / 3.078, rel=5e-3)
        assert low < parameter.mean < high
    assert measurement.fit[0].mean_of == 10
