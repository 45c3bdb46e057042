"""What is wrong with a data set: one line with file, key, value and what is allowed."""

import re

import numpy as np
import pytest

from doe.errors import MeasurementError
from doe.measurement import load_measurement
from tests.doe.measurement.folders import MATERIAL, MEASUREMENT, TABLE, changed, write, write_pile


def refusal(folder):
    with pytest.raises(MeasurementError) as error:
        load_measurement(folder)
    line = str(error.value)
    assert "\n" not in line
    return line


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("format = 1", "format = 2", ["format: 2", "allowed: 1"]),
        ('"material.toml"', '"gold.toml"', ["gold.toml", "neither a file"]),
        ("title =", "titel =", ["titel: unknown key", "title"]),
        ('role = "fit"', 'role = "train"', ["condition 'slow'", "role: 'train'", "fit, holdout"]),
        ('role = "fit"', 'role = "holdout"', ["condition.role", "at least one is needed"]),
        ('name = "fast"', 'name = "slow"', ["condition.name: 'slow' appears twice"]),
        ('rig = "funnel"', 'rig = "bucket"', ["condition 'slow'", "'bucket' is not one of funnel"]),
        ('rig = "funnel"', 'rig = "inclined_plane"', ["condition 'slow'", "bench test"]),
        ('role = "fit"', 'role = "fit"\nturned = 180', ["condition 'slow'", "turned: 180", "true or false"]),
        ('role = "fit"', 'role = "fit"\nmaterial = 3', ["condition 'slow'", "material: 3; allowed: a text"]),
        ('role = "fit"', 'role = "fit"\nmaterial = "gold.toml"', ["condition 'slow'", "gold.toml", "neither a file"]),
        ('data = "slow.csv"', 'data = "none.csv"', ["none.csv: no such file"]),
        (
            'data = "slow.csv"\n',
            "",
            ["condition 'slow'", "data: missing in slow; needed: the table"],
        ),
        ("mass = 0.014", "mass = 500", ["rig.mass", "1e-05 … 10 kg"]),
        ("mass = 0.014", "weight = 0.014", ["rig.weight: no such parameter", "rig.mass"]),
        ("region_z = [0.190", "region_z = [0.200", ["insertion.region_z", "0.2 m", "allowed: 0.19 m", "feed opening"]),
        ("velocity = [0.0, 0.0, -0.4]", "velocity = [0.1, 0.0, -0.4]", ["insertion.velocity", "straight down"]),
        ('orientation = "random"', 'orientation = "upright"', ["insertion.orientation", "'upright'", "random"]),
        ('region = "cylinder"', 'region = "sphere"', ["insertion.region", "'sphere'", "cylinder"]),
        ("duration = 2.6", "duration = -1", ["duration: -1 s", "more than 0 s"]),
        ("rate = 0.1", "speed = 0.1", ["insertion.speed: unknown key"]),
        ("half_width = 0.3", "radius = 0.3", ["domain.radius: unknown key", "half_width"]),
        ("pair.glass.glass.static", "pair.glass.glass.magic", ["parameters.pair.glass.glass.magic_friction: no such"]),
        ("pair.glass.glass.static_friction", "pair.gold.glass.restitution", ["pair.gold.glass: no such pair"]),
        ("{ mean = 0.3, sd = 0.05 }", "{ mean = 0.3 }", ["no range", "low and high, or mean and sd"]),
        ("{ mean = 0.3, sd = 0.05 }", "{ sd = 0.05, low = 0.1, high = 1 }", ["sd: 0.05", "together with a mean"]),
        ("{ mean = 0.3, sd = 0.05 }", "{ mean = 0.3, low = 0.4, high = 1 }", ["mean: 0.3 is outside 0.4 … 1"]),
        ("{ mean = 0.3, sd = 0.05 }", "{ low = 1.0, high = 0.5 }", ["range 1 … 0.5 is empty"]),
        ("{ mean = 0.3, sd = 0.05 }", '{ mean = "a lot", sd = 1 }', ["mean: 'a lot' is not a number"]),
        ("[parameters]", "[uncertainty]\ncolour = 1\n[parameters]", ["uncertainty.colour: no such observable"]),
        ("[parameters]", "[uncertainty]\napex_height_m = 0\n[parameters]", ["uncertainty.apex_height_m: 0"]),
        ("[parameters]", '[parameters]\n"rig.mass" = { low = 0.01, high = 0.02 }', ["rig_parameters.mass", "too"]),
    ],
)
def test_a_bad_measurement_file(tmp_path, old, new, words):
    line = refusal(write(tmp_path, {"measurement.toml": changed(MEASUREMENT, old, new)}))
    assert line.startswith(str(tmp_path)), line
    for word in words:
        assert word in line, line


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("replicate,observable,x,value", "replicate,observable,value", [":2: columns", "replicate,observable,x,value"]),
        ("1,angle_of_repose_deg,,20.0", "1,angle_of_repose_deg,20.0", [":3: 3 cells; allowed: 4"]),
        ("20.0", "steep", [":3: value: 'steep'", "a finite number in deg"]),
        ("20.0", "nan", [":3: value: 'nan'"]),
        ("1,angle_of_repose_deg,,", "1,angle_of_repose_deg,0.1,", [":3", "x is '0.1'", "empty x"]),
        ("discharged_mass_kg,0.5,0.001", "discharged_mass_kg,,0.001", ["a coordinate x in s (it is a curve)"]),
        ("1,angle_of_repose_deg,,20.0", "1,angle_of_repose_rad,,0.4", ["'angle_of_repose_rad'", "angle_of_repose_deg"]),
        ("1,angle_of_repose_deg,,20.0", "1,apex_height,,0.4", ["'apex_height'", "missing unit", "apex_height_m"]),
        (
            "1,angle_of_repose_deg,,20.0",
            "first,angle_of_repose_deg,,20",
            ["replicate: 'first'", "whole numbers from 1"],
        ),
        ("1,angle_of_repose_deg,,20.0", "0,angle_of_repose_deg,,20", ["replicate: '0'", "from 1 on"]),
        ("2,angle_of_repose_deg,,22.0", "4,angle_of_repose_deg,,22.0", ["replicate: 3 of 4 is missing"]),
        ("1,angle_of_repose_deg,,20.0", "2024011510123,angle_of_repose_deg,,20.0", ["3 of 2024011510123 is missing"]),
        ("20.0", "-94.1", [":3: value: '-94.1'", "allowed: above -90 deg and below 90 deg"]),
        ("1,angle_of_repose_deg,,20.0", "1,angle_of_repose_deg@45,,1e9", [":3: value: '1e9'", "below 90 deg"]),
        ("2,angle_of_repose_deg,,22.0", "1,angle_of_repose_deg,,22.0", [":4: angle_of_repose_deg", "appears twice"]),
        ("2,angle_of_repose_deg,,22.0", "2,apex_height_m,,0.02", ["one replicate has no scatter", "[uncertainty]"]),
    ],
)
def test_a_bad_table(tmp_path, old, new, words):
    line = refusal(write(tmp_path, {"slow.csv": changed(TABLE, old, new)}))
    assert line.startswith(str(tmp_path / "slow.csv")), line
    for word in words:
        assert word in line, line


def test_a_column_of_units_that_are_none(tmp_path):
    table = "replicate,observable,x,value,unit\n1,apex_height_m,,21,kg\n"
    assert re.search(
        r"slow\.csv:2: unit: unit 'kg' is not one of m, cm, mm", refusal(write(tmp_path, {"slow.csv": table}))
    )


def test_the_uncertainty_of_a_single_replicate_may_be_stated(tmp_path):
    text = changed(MEASUREMENT, "[parameters]", '[uncertainty]\napex_height_m = "1mm"\n[parameters]')
    table = changed(TABLE, "2,angle_of_repose_deg,,22.0", "2,angle_of_repose_deg,,22.0\n2,apex_height_m,,0.02")
    slow = load_measurement(write(tmp_path, {"measurement.toml": text, "slow.csv": table})).conditions[0]
    assert slow.offered["apex_height_m"].uncertainty == pytest.approx(1e-3, rel=1e-12)


def test_a_folder_or_file_that_is_not_there(tmp_path):
    assert refusal(tmp_path / "none") == f"{tmp_path / 'none'}: no such folder"
    assert refusal(write(tmp_path, {"measurement.toml": None})).endswith("measurement.toml: no such file")


def test_an_error_in_the_material_names_its_file(tmp_path):
    line = refusal(write(tmp_path, {"material.toml": changed(MATERIAL, "density = 2500.0", "density = -1")}))
    assert line.startswith(str(tmp_path / "material.toml"))


def test_a_measurement_without_conditions(tmp_path):
    assert "has the role fit; at least one" in refusal(
        write(tmp_path, {"measurement.toml": MEASUREMENT.partition("[[")[0]})
    )


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"radius": None}, "array 'radius' is missing; allowed: xyz, radius, body"),
        ({"radius": np.full(5, 6e-3)}, "shapes (6, 3), (5,), (6,)"),
        ({"xyz": np.full((6, 3), np.nan)}, "not finite"),
        ({"body": np.array([0, 0, 1, 2, 3, 4])}, "2 spheres in body 0; allowed: 1"),
    ],
)
def test_a_bad_scan(tmp_path, arrays, words):
    path = write_pile(write(tmp_path) / "piles/slow_1.npz", **arrays)
    line = refusal(tmp_path)
    assert line.startswith(str(path))
    assert words in line


def test_a_scan_that_is_no_archive(tmp_path):
    path = write_pile(write(tmp_path) / "piles/slow_1.npz")
    path.write_bytes(b"no archive")
    assert refusal(tmp_path).startswith(f"{path}: cannot be read")
