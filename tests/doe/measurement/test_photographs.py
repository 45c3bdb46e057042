"""Photographs of a condition: read like scans, beside the table, with reasons for those that show no pile."""

import numpy as np
import pytest

from doe.errors import MeasurementError
from doe.measurement import load_measurement
from tests.doe.measurement.folders import MEASUREMENT, changed, write, write_pile
from tests.solver.photograph.rendered import Look, photograph, save, solid_cover

LOOK = Look(width=500)
TABLE = "replicate,observable,x,value\n1,angle_of_repose_deg@0,,20\n2,angle_of_repose_deg@0,,30\n"


def pictured(folder, images, table=TABLE):
    """A data set whose condition ``slow`` has ``images``, and two pictures beside it: 27.5° and 30.5°."""
    text = changed(MEASUREMENT, 'data = "slow.csv"', f'data = "slow.csv"\nimages = {images}')
    write(folder, {"measurement.toml": text, "slow.csv": table})
    for name, left, right in (("a", 25, 30), ("b", 29, 32)):
        save(folder / f"{name}.png", photograph(solid_cover(left, right, 90), LOOK))
    return folder


def test_a_picture_is_one_view_of_a_replicate(tmp_path):
    measurement = load_measurement(pictured(tmp_path, '["a.png", "b.png"]'))
    angle = measurement.conditions[0].offered["angle_of_repose_deg@0"]
    assert (angle.origin, angle.unit, angle.x) == ("photographs", "deg", None)
    np.testing.assert_allclose(angle.values, [27.5, 30.5], atol=0.5)
    # The table's values serve as a cross-check.
    (check,) = measurement.cross_check
    assert (check.observable, check.theirs) == ("angle_of_repose_deg@0", 25.0)
    assert measurement.ignored == ()


def test_tables_state_replicate_azimuth_and_scale(tmp_path):
    images = (
        '[{ file = "a.png", replicate = 3, azimuth = 90, pixel = "0.5mm" },'
        ' { file = "b.png", replicate = 1, azimuth = 90, pixel = "0.5mm" }]'
    )
    slow = load_measurement(pictured(tmp_path, images)).conditions[0]
    assert slow.replicates == 3
    np.testing.assert_allclose(slow.offered["angle_of_repose_deg@90"].values, [30.5, np.nan, 27.5], atol=0.5)
    np.testing.assert_allclose(slow.offered["apex_height_m"].values, [0.045, np.nan, 0.045], atol=0.001)
    assert slow.offered["angle_of_repose_deg@0"].origin == "table"


def test_where_one_picture_has_no_scatter_the_table_is_taken(tmp_path):
    measurement = load_measurement(pictured(tmp_path, '["a.png"]'))
    angle = measurement.conditions[0].offered["angle_of_repose_deg@0"]
    assert (angle.origin, angle.values.tolist()) == ("table", [20.0, 30.0])
    assert measurement.ignored == ("slow: angle_of_repose_deg@0 from photographs: one replicate and no [uncertainty]",)


def test_piles_too_flat_for_an_angle_are_said_to_give_none(tmp_path):
    folder = write(tmp_path)
    for replicate in (1, 2):
        write_pile(folder / f"piles/slow_{replicate}.npz", beads=1)
    measurement = load_measurement(folder)
    assert "slow: angle_of_repose_deg from piles: no replicate has a value" in measurement.ignored
    assert measurement.conditions[0].offered["angle_of_repose_deg"].origin == "table"


def test_a_gap_between_piles_is_named_whatever_pictures_there_are(tmp_path):
    folder = pictured(tmp_path, '[{ file = "a.png", replicate = 5 }]')
    write_pile(folder / "piles" / "slow_4.npz")
    with pytest.raises(MeasurementError, match=r"slow_4\.npz: replicate 3 of 4 is missing"):
        load_measurement(folder)


def test_a_picture_without_a_pile_is_listed_with_its_reason(tmp_path):
    folder = pictured(tmp_path, '["a.png", "b.png", "blank.png"]')
    save(folder / "blank.png", np.full((200, 300), 150, dtype=np.uint8))
    measurement = load_measurement(folder)
    (line,) = measurement.ignored
    assert line.startswith("condition slow: images: blank.png: no angle: blank: ")
    assert measurement.conditions[0].replicates == 3


@pytest.mark.parametrize(
    ("images", "words"),
    [
        ('"a.png"', ["images", "a list"]),
        ("[3]", ["images", "file name or a table"]),
        ('["missing.png"]', ["missing.png", "no such file"]),
        ('[{ name = "a.png" }]', ["images.name", "file"]),
        ('[{ file = "a.png", replicate = 0 }]', ["images.replicate", "0"]),
        ('[{ file = "a.png", pixel = "-1mm" }]', ["images.pixel", "more than 0"]),
        ('[{ file = "a.png", pixel = "1kg" }]', ["images.pixel", "mm"]),
        ('[{ file = "a.png", base_line = [1] }]', ["images.base_line", "2 numbers"]),
        (
            '[{ file = "a.png", replicate = 1 }, { file = "b.png", replicate = 1 }]',
            ["two photographs of replicate 1 at azimuth 0"],
        ),
        ('["slow.csv"]', ["slow.csv", "not a picture"]),
    ],
)
def test_bad_entries_are_one_line(tmp_path, images, words):
    with pytest.raises(MeasurementError) as error:
        load_measurement(pictured(tmp_path, images))
    text = str(error.value)
    assert "\n" not in text
    assert all(word in text for word in words), text
