"""The table of single bodies: what it reads, and what it refuses in one line."""

import math

import pytest

from doe.errors import MeasurementError
from doe.measurement import load_measurement
from doe.measurement.bodies import MeasuredBody, body_numbers
from solver import with_values
from tests.doe.measurement.folders import MATERIAL, MEASUREMENT, write

HEAD = "body,quantity,unit,mean,standard_error\n"
ROWS = HEAD + "bead,mass,g,2.2,0.02\nbead,length,mm,12.1,0.1\nbead,length_spread,1,0.05,0.01\n"


def folder(path, table, text=MEASUREMENT, **files):
    text = text.replace('material = "material.toml"', 'material = "material.toml"\nbodies = "bodies.csv"', 1)
    return write(path, {"measurement.toml": text, "bodies.csv": table, **files})


def test_numbers_are_read_in_si(tmp_path):
    mass, length, spread = load_measurement(folder(tmp_path, ROWS)).bodies
    assert (mass.body, mass.quantity, mass.mean, mass.standard_error) == ("bead", "mass", 2.2e-3, 2e-5)
    assert (length.mean, length.standard_error) == pytest.approx((12.1e-3, 1e-4))
    assert (spread.mean, spread.standard_error) == (0.05, 0.01)
    assert (mass.value, mass.deviation) == pytest.approx((math.log(2.2e-3), 0.02 / 2.2))
    assert (spread.value, spread.deviation) == (0.05, 0.01)


def test_a_decimal_comma_is_read(tmp_path):
    (mass,) = load_measurement(folder(tmp_path, HEAD.replace(",", ";") + "bead;mass;g;2,2;0,02\n")).bodies
    assert (mass.mean, mass.standard_error) == (2.2e-3, 2e-5)


def test_without_a_table_nothing_was_measured(tmp_path):
    assert load_measurement(write(tmp_path)).bodies == ()


def test_what_is_not_measured_yet_is_no_measurement(tmp_path):
    assert load_measurement(folder(tmp_path, HEAD + "# bead,mass,g,,\n")).bodies == ()


def test_the_numbers_of_a_declared_sphere(tmp_path):
    measurement = load_measurement(folder(tmp_path, ROWS))
    mass = 2500.0 * math.pi / 6.0 * 12e-3**3
    scattered = with_values(measurement.scene, {"effect.size_dispersion.spread": 0.1})
    still, moved = body_numbers([measurement.scene, scattered], measurement.bodies)
    assert still == pytest.approx([math.log(mass), math.log(12e-3), 0.0])
    # E[s³] of a log-normal s of mean 1 is (1 + σ²)³; it is cut off at three deviations here.
    assert moved[0] - math.log(mass) == pytest.approx(3.0 * math.log(1.01), rel=0.02)
    assert moved[2] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("row", "wanted"),
    [
        ("nut,mass,g,2.2,0.02", "body: 'nut'; allowed: bead"),
        ("bead,weight,g,2.2,0.02", "quantity: 'weight'; allowed: mass, length, length_spread, apparent_static"),
        ("bead,mass,mm,2.2,0.02", "mean: unit 'mm' is not one of"),
        ("bead,mass,g,,0.02", "mean: "),
        ("bead,mass,1,2.2,0.02", "unit: '1' of mass; allowed: kg, g or another unit of it"),
        ("bead,mass,,2.2,0.02", "unit: '' of mass; allowed: kg, g or another unit of it"),
        ("bead,mass,g,-2.2,0.02", "mean: -2.2; allowed: more than 0"),
        ("bead,mass,g,2.2,0", "standard_error: 0; allowed: 1e-05 of the mean or more"),
        ("bead,mass,g,2.2,2e-5", "standard_error: 2e-5; allowed: 1e-05 of the mean or more"),
        ("bead,restitution,1,0,1e-6", "standard_error: 1e-6; allowed: 1e-05 or more"),
        ("bead,length_spread,1,-0.1,0.02", "mean: -0.1; allowed: 0 or more"),
        ("bead,mass,g,2.2", "4 cells; allowed: 5"),
        ("bead,mass,g,2.2,0.02\nbead,mass,g,2.3,0.02", "mass of bead: appears twice; allowed: once"),
    ],
)
def test_a_row_that_cannot_be_is_refused(tmp_path, row, wanted):
    with pytest.raises(MeasurementError) as error:
        load_measurement(folder(tmp_path, HEAD + row + "\n"))
    assert "bodies.csv:" in str(error.value)
    assert wanted in str(error.value)
    assert "\n" not in str(error.value)


def test_another_table_is_refused(tmp_path):
    with pytest.raises(MeasurementError, match="columns: replicate,observable; allowed: body,quantity,unit,mean"):
        load_measurement(folder(tmp_path, "replicate,observable\n1,2\n"))
    (tmp_path / "bodies.csv").unlink()
    with pytest.raises(MeasurementError, match=r"bodies\.csv: no such file"):
        load_measurement(tmp_path)


def test_bodies_that_differ_between_fitted_conditions_cannot_have_been_measured_once(tmp_path):
    text = MEASUREMENT.replace('role = "holdout"', 'role = "fit"\nmaterial = "dense.toml"', 1)
    dense = MATERIAL.replace("density = 2500.0", "density = 5000.0", 1)
    with pytest.raises(MeasurementError, match="bodies: bead: differs between the fitted conditions"):
        load_measurement(folder(tmp_path, ROWS, text, **{"dense.toml": dense}))
    # Held out, it may be of another material.
    held_out = text.replace('role = "fit"\nmaterial', 'role = "holdout"\nmaterial', 1)
    assert load_measurement(folder(tmp_path, ROWS, held_out, **{"dense.toml": dense})).bodies


def test_a_table_elsewhere_is_told(tmp_path):
    (tmp_path / "there.csv").write_text(ROWS)
    inside = folder(tmp_path / "data", ROWS, MEASUREMENT)
    text = (inside / "measurement.toml").read_text().replace('"bodies.csv"', '"../there.csv"')
    (inside / "measurement.toml").write_text(text)
    assert any(note.startswith("bodies: ") and "outside" in note for note in load_measurement(inside).notes)


def test_a_relative_number_has_a_relative_error():
    assert MeasuredBody("bead", "length", 0.02, 0.001).deviation == 0.05
