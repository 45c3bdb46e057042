"""Sheets to fill in: from the declaration that the reader uses, and read by it once they are filled in."""

import dataclasses
import math

import pytest

from doe.laboratory import TESTS, LaboratoryError, analyse, read_table
from doe.laboratory.analysis import template_of
from doe.laboratory.tables import NOTE, REPLICATE
from tests.doe.laboratory.readings import written

ALONE = {"sieve": ["seed,1,2.0,80,,", "seed,1,1.0,120,,", "seed,1,0,50.3,,"], "composition": ["seed,1,758,"]}
"""Rows of a sheet that one row alone does not make a reading of."""


def filled(tmp_path, test, rows=()):
    """The template with its own example row, or with ``rows``, below the names."""
    text = template_of(test)
    example = text.splitlines()[-2].removeprefix("# ")
    return written(tmp_path, text + "\n".join(rows or [example]) + "\n")


@pytest.mark.parametrize("test", TESTS)
def test_a_sheet_with_its_example_row_is_read_and_analysed(test, tmp_path):
    result = analyse(test, filled(tmp_path, test, ALONE.get(test, ())))
    assert result.derived
    assert all(math.isfinite(value) for one in result.derived for value in one.values)


@pytest.mark.parametrize("test", TESTS)
def test_a_sheet_has_every_column_that_is_declared_and_says_what_it_is(test):
    layout = TESTS[test].layout
    comments, names = template_of(test).rstrip("\n").rsplit("\n", 1)
    assert names.split(",") == [*layout.keys, REPLICATE, *(one.sheet_name for one in layout.columns), NOTE]
    assert all(line.startswith("#") for line in comments.splitlines())
    for column in layout.columns:
        assert column.sheet_name in column.names
        assert column.says
        assert f"{column.says}" in comments
        assert ("(optional) " + column.says in comments) != column.needed
    assert layout.replicates in comments
    assert layout.standard in comments
    assert layout.gives in comments


@pytest.mark.parametrize("test", TESTS)
def test_an_empty_sheet_has_no_readings(test, tmp_path):
    with pytest.raises(LaboratoryError, match="no readings below the names"):
        analyse(test, written(tmp_path, template_of(test)))


def test_an_optional_column_that_nobody_has_filled_in_is_none(tmp_path):
    head = "a,b,replicate,drop_height_mm,distance_mm,v_x_m_s,v_z_m_s\n"
    layout = TESTS["drop"].layout
    table = read_table(written(tmp_path, head + "s,w,1,200,232,,\ns,w,2,200,230,,\n"), layout)
    assert set(table.rows[0].values) == {"drop_height", "distance"}
    # In part it is a cell that was forgotten.
    with pytest.raises(LaboratoryError, match="row 2, column v_x_m_s: ''"):
        read_table(written(tmp_path, head + "s,w,1,200,232,,\ns,w,2,200,230,1.1,0\n"), layout)


def test_the_companion_of_a_column_has_its_units_and_no_sign(tmp_path):
    head = "a,b,replicate,angle_deg,angle_error_deg\n"
    layout = TESTS["inclined_plane"].layout
    (row,) = read_table(written(tmp_path, head + "s,w,1,30,0.5\n"), layout).rows
    assert row.values["angle_error"] == pytest.approx(math.radians(0.5))
    with pytest.raises(LaboratoryError, match="angle_error_deg: '-1'; allowed: a number above 0 deg"):
        read_table(written(tmp_path, head + "s,w,1,30,-1\n"), layout)
    with pytest.raises(LaboratoryError, match="angle_error_deg, angle_error_rad"):
        read_table(written(tmp_path, "a,b,replicate,angle_deg,angle_error\ns,w,1,30,1\n"), layout)
    bare = dataclasses.replace(layout, errors=False)
    with pytest.raises(LaboratoryError, match="'angle_error_deg'"):
        read_table(written(tmp_path, head + "s,w,1,30,0.5\n"), bare)
