"""A laboratory's files: units in the names of columns, and one clear line for every kind of bad file."""

import math

import pytest

from doe.laboratory import tables
from doe.laboratory.tables import DROP, FORCE_DISPLACEMENT, INCLINED_PLANE, LaboratoryError, read_table
from tests.doe.laboratory.readings import assert_one_line, written

PLANE = "a,b,replicate,angle_deg\n"


def test_units_of_the_names_are_turned_into_si(tmp_path):
    text = "component,replicate,thickness_cm,area_mm2,displacement_um,force_kN\nseed,1,0.5,20,30,0.01\n"
    (row,) = read_table(written(tmp_path, text), FORCE_DISPLACEMENT).rows
    assert row.values == pytest.approx({"thickness": 5e-3, "area": 20e-6, "displacement": 30e-6, "force": 10.0})
    assert (row.of, row.replicate, row.line) == (("seed",), "1", 2)
    (row,) = read_table(written(tmp_path, PLANE + "a,b,1,45\n"), INCLINED_PLANE).rows
    assert row.values["angle"] == pytest.approx(math.pi / 4)


@pytest.mark.parametrize(
    ("units", "same"),
    [
        (tables.LENGTH, {"m": 0.25, "cm": 25, "mm": 250, "um": 250_000}),
        (tables.AREA, {"m2": 0.002, "cm2": 20, "mm2": 2000}),
        (tables.VOLUME, {"m3": 0.003, "l": 3, "cm3": 3000, "ml": 3000}),
        (tables.MASS, {"kg": 0.5, "g": 500, "mg": 500_000}),
        (tables.DENSITY, {"kg_m3": 998, "g_cm3": 0.998}),
        (tables.FORCE, {"N": 40, "kN": 0.04, "mN": 40_000}),
        (tables.SPEED, {"m_s": 1.5, "cm_s": 150, "mm_s": 1500}),
        (tables.TIME, {"s": 90, "ms": 90_000, "min": 1.5}),
        (tables.ANGLE, {"rad": math.pi / 3, "deg": 60}),
        (tables.TURNING, {"rad_s": 2 * math.pi, "rpm": 60}),
    ],
)
def test_a_quantity_is_the_same_in_every_unit(units, same):
    """The first of each is SI."""
    assert units.keys() == same.keys()
    si, *_ = same.values()
    assert {name: number * units[name] for name, number in same.items()} == pytest.approx(dict.fromkeys(same, si))


def test_a_pair_is_the_same_in_either_order(tmp_path):
    table = read_table(written(tmp_path, PLANE + "x,y,1,30\ny,x,2,31\ny,y,1,20\n"), INCLINED_PLANE)
    assert {of: len(rows) for of, rows in table.groups().items()} == {("x", "y"): 2, ("y", "y"): 1}


def test_comments_notes_and_a_byte_order_mark_are_no_readings(tmp_path):
    text = (
        "\ufeff# by hand\na,b,replicate,angle_deg,note\n\nx,y,1,30,slid at once\n# x,y,2,80,\nx,y,3,32, # later\n,,,,\n"
    )
    rows = read_table(written(tmp_path, text), INCLINED_PLANE).rows
    assert [(row.line, row.replicate) for row in rows] == [(4, "1"), (6, "3")]


def test_an_optional_column_may_be_missing(tmp_path):
    text = "a,b,replicate,drop_height_mm,v_x_m_s,v_z_m_s\nx,y,1,200,1.2,-0.1\n"
    (row,) = read_table(written(tmp_path, text), DROP).rows
    assert set(row.values) == {"drop_height", "v_x", "v_z"}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["no rows", "a,b,replicate,angle_deg"]),
        ("# only a remark\n", ["no rows"]),
        (PLANE, ["no readings"]),
        (PLANE + "x,y,1,steep\n", ["row 2", "column angle_deg", "'steep'", "deg"]),
        ("# remark\n" + PLANE + "x,y,1,30\nx,y,2,\n", ["row 4", "column angle_deg", "''"]),
        (PLANE + "x,y,1,nan\n", ["row 2", "column angle_deg", "'nan'"]),
        (PLANE + "x,y,1,95\n", ["row 2", "column angle_deg", "below 90 deg"]),
        (PLANE + "x,y,1,30,31\n", ["row 2", "5 cells"]),
        (PLANE + "x,y,1,30\nx,y,1,31\n", ["row 3", "column replicate", "also in row 2"]),
        (PLANE + "x y,y,1,30\n", ["row 2", "column a", "letters"]),
        (PLANE + "x,,1,30\n", ["row 2", "column b", "letters"]),
        (PLANE + 'x,y,1,"30\n', ["row 2"]),
        ("a,b,replicate,angle_rpm\nx,y,1,30\n", ["row 1", "column 'angle_rpm'", "unit", "angle_deg, angle_rad"]),
        ("a,b,replicate,angle\nx,y,1,30\n", ["'angle'", "unit", "angle_deg"]),
        ("a,b,replicate,tilt_deg\nx,y,1,30\n", ["'tilt_deg'", "unknown"]),
        ("a,b,replicate,angle_deg,angle_rad\nx,y,1,30,1\n", ["angle_rad", "in two units"]),
        ("a,b,replicate,angle_deg,angle_deg\nx,y,1,30,1\n", ["angle_deg", "twice"]),
        ("a,replicate,angle_deg\nx,1,30\n", ["column b is missing"]),
        ("a,b,replicate\nx,y,1\n", ["angle_deg is missing"]),
        (b"PK\x03\x04\xff\xfe\x00", ["neither text nor a workbook"]),
    ],
)
def test_a_bad_file_gets_one_line(content, words, tmp_path):
    path = written(tmp_path, content)
    with pytest.raises(LaboratoryError) as caught:
        read_table(path, INCLINED_PLANE)
    assert_one_line(caught.value, path, words)


def test_a_missing_file_and_a_folder_are_named(tmp_path):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(LaboratoryError, match=str(path)):
            read_table(path, INCLINED_PLANE)
