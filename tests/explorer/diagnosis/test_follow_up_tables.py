"""The tables of a follow-up, filled in cell by cell, by an archive, and on the page."""

import io
import re
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from doe.errors import MeasurementError
from doe.measurement.load import load_measurement
from explorer.diagnosis.follow_up_tables import (
    add_scan,
    packed,
    read_follow_up,
    take_filled,
    write_bodies,
    write_numbers,
)
from explorer.diagnosis.next_folder import read_next, write_next
from explorer.errors import CommandError
from explorer.files.uploads import kept_measurements
from explorer.viewer.tables.follow_up_page import (
    body_columns,
    body_rows,
    filled_bodies,
    filled_numbers,
    number_columns,
    number_rows,
)
from solver import ParameterError
from tests.explorer.diagnosis.test_next_folder import CHECK, SOURCE, TWICE, suggestion, values_of

BODIES = (("trefoil", "mass"), ("trefoil", "length"))
ANGLE, HEIGHT = "angle_of_repose_deg", "apex_height_m"


@pytest.fixture(scope="module")
def measured():
    return load_measurement(SOURCE)


@pytest.fixture
def asked(measured):
    """Twice the height, three pours, with two numbers of single bodies."""
    return replace(suggestion(TWICE, values_of(measured, TWICE), measured.fit[0].name), bodies=BODIES)


@pytest.fixture
def folder(tmp_path, measured, asked):
    write_next(tmp_path / "next", SOURCE, measured, asked)
    return tmp_path / "next"


def entered(tables, **values):
    """The numbers with other values of some observables: those of every pour."""
    return [replace(row, values=values.get(row.observable, row.values)) for row in tables.numbers]


def table(folder):
    return folder / f"{read_follow_up(folder).condition}.csv"


def contents(folder):
    return {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def test_an_empty_follow_up_has_a_row_for_each_quantity_and_place_and_a_cell_for_each_pour(folder, measured):
    tables = read_follow_up(folder)
    offered = [one for one in measured.fit[0].observations if one.origin != "profile"]
    places = {
        (one.observable, x) for one in offered for x in ([""] if one.x is None else [repr(float(x)) for x in one.x])
    }
    assert {(row.observable, row.x) for row in tables.numbers} == places
    assert (tables.pours, len(tables.scanned)) == (3, 0)
    assert set(tables.cells) == {""}
    assert [(row.body, row.quantity, row.unit) for row in tables.bodies] == [
        ("trefoil", "mass", "g"),
        ("trefoil", "length", "mm"),
    ]


def test_what_is_entered_is_what_the_measurement_holds(folder):
    tables = read_follow_up(folder)
    write_numbers(folder, entered(tables, **{ANGLE: ("24.5", "25,5", " 26"), HEIGHT: ("24.7mm", "0.025", "2.6 cm")}))
    write_bodies(folder, [replace(tables.bodies[0], mean="0,115", standard_error="0.001"), tables.bodies[1]])
    found = read_next(folder).measurement
    (condition,) = found.conditions
    assert condition.replicates == 3
    values = {one.observable: one.values for one in condition.observations}
    np.testing.assert_allclose(values[ANGLE], (24.5, 25.5, 26.0), rtol=1e-15)
    np.testing.assert_allclose(values[HEIGHT], (0.0247, 0.025, 0.026), rtol=1e-15)
    (mass,) = found.bodies
    assert (mass.quantity, mass.mean, mass.standard_error) == ("mass", pytest.approx(1.15e-4), pytest.approx(1e-6))


def test_what_is_taken_out_again_is_not_measured_and_writing_changes_nothing_else(folder):
    empty = contents(folder)
    tables = read_follow_up(folder)
    write_numbers(folder, entered(tables, **{ANGLE: ("24.5", "25.5", "26")}))
    assert read_follow_up(folder).cells.count("") == len(tables.cells) - 3
    write_numbers(folder, entered(tables, **{ANGLE: ("", "", "")}))
    assert contents(folder) == empty


def test_a_table_that_a_spreadsheet_has_saved_is_read_and_keeps_its_comments_and_other_rows(folder):
    path = table(folder)
    text = path.read_text().replace(",", ";").replace(".", ",")
    text = text.replace(f"# 2;{ANGLE};;", f"2;{ANGLE};;25,5") + '"# made on Monday";;;\n1;colour;;blue\n'
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    tables = read_follow_up(folder)
    angles = next(row for row in tables.numbers if row.observable == ANGLE)
    assert angles.values == ("", "25.5", "")
    write_numbers(folder, entered(tables, **{ANGLE: ("24", "25.5", "")}))
    lines = path.read_text().splitlines()
    assert {f"1,{ANGLE},,24.0", f"2,{ANGLE},,25.5", f"# 3,{ANGLE},,", "# made on Monday", "1,colour,,blue"} <= {*lines}


def test_a_unit_in_a_column_of_its_own_stays_that_of_its_value(folder):
    path = table(folder)
    lines = path.read_text().replace("replicate,observable,x,value", "replicate,observable,x,value,unit").splitlines()
    path.write_text("\n".join(re.sub(rf"^# (\d,{HEIGHT},,)$", r"\g<1>24.7,mm", line) for line in lines) + "\n")
    tables = read_follow_up(folder)
    assert next(row for row in tables.numbers if row.observable == HEIGHT).values == ("24.7mm",) * 3
    write_numbers(folder, tables.numbers)
    assert f"1,{HEIGHT},,0.0247" in path.read_text().splitlines()


@pytest.mark.parametrize(
    ("cell", "said"),
    [
        ("steep", f"pour 2, {ANGLE}: 'steep' is not a number"),
        ("25mm", f"pour 2, {ANGLE}: unit 'mm' is not one of"),
    ],
)
def test_a_value_that_is_none_of_its_quantity_is_refused_with_nothing_changed(folder, cell, said):
    before = contents(folder)
    with pytest.raises(ParameterError, match=said):
        write_numbers(folder, entered(read_follow_up(folder), **{ANGLE: ("24", cell, "26")}))
    assert contents(folder) == before


@pytest.mark.parametrize(("mean", "error", "missing"), [("0.1", "", "no standard error"), ("", "0.1", "no mean")])
def test_a_number_of_bodies_needs_mean_and_standard_error(folder, mean, error, missing):
    before = contents(folder)
    first, *others = read_follow_up(folder).bodies
    with pytest.raises(CommandError, match=f"trefoil, mass: has {missing}; allowed: both, or neither"):
        write_bodies(folder, [replace(first, mean=mean, standard_error=error), *others])
    assert contents(folder) == before


def test_scans_are_those_of_the_piles_that_have_none_yet(folder):
    (folder / "scans" / f"{table(folder).stem}_2.ply").write_bytes(b"ply")
    assert [add_scan(folder, f"monday {k}.STL", b"solid").name for k in range(2)] == [
        f"{table(folder).stem}_1.stl",
        f"{table(folder).stem}_3.stl",
    ]
    assert len(read_follow_up(folder).scanned) == 3
    with pytest.raises(CommandError, match=r"there is a scan of every pile \(3\)"):
        add_scan(folder, "one more.ply", b"ply")
    with pytest.raises(CommandError, match=r"notes\.docx: allowed: files ending in \.ply"):
        add_scan(folder, "notes.docx", b"")


def test_a_table_in_another_order_of_columns_names_itself(folder):
    path = table(folder)
    path.write_text("observable,value\n" + path.read_text())
    with pytest.raises(CommandError, match=rf"{path}: columns: observable,value; allowed here: replicate,observable,x"):
        read_follow_up(folder)


# As an archive


def archive_of(folder, **changes):
    """``folder`` as it is taken along, with other contents of some files."""
    content = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(packed(folder))) as taken, zipfile.ZipFile(content, "w") as archive:
        for name in taken.namelist():
            archive.writestr(f"filled in/{name}", changes.pop(name, None) or taken.read(name))
        for name, text in changes.items():
            archive.writestr(f"filled in/{name}", text)
    return content.getvalue()


def test_a_folder_that_was_taken_along_comes_back_filled_in(folder, asked, tmp_path):
    text = table(folder).read_text().replace(f"# 1,{ANGLE},,", f"1,{ANGLE},,24.5")
    name = table(folder).name
    settings = (folder / "measurement.toml").read_text()
    sent = archive_of(
        folder, **{name: text, "README.md": "no", "scans/x_1.ply": "ply", "measurement.toml": settings + "# checked\n"}
    )
    readme = (folder / "README.md").read_bytes()
    take_filled(folder, asked, "back.zip", sent, tmp_path / "uploads")
    assert read_follow_up(folder).cells.count("24.5") == 1
    assert (folder / "scans/x_1.ply").read_text() == "ply"
    assert (folder / "README.md").read_bytes() == readme
    assert (folder / "measurement.toml").read_text().endswith("# checked\n")


def test_an_archive_of_something_else_is_refused_with_nothing_changed(folder, asked, tmp_path):
    before = contents(folder)

    def refused(content, of=asked):
        with pytest.raises((CommandError, MeasurementError)) as error:
            take_filled(folder, of, "back.zip", content, tmp_path / "uploads")
        assert contents(folder) == before
        return str(error.value)

    other = replace(asked, rivals=("air_drag", "base"))
    assert f"follow_up.json: is that of another follow-up; allowed: of {TWICE}" in refused(packed(folder), other)
    assert "cannot be unpacked as .zip" in refused(b"PK no")
    elsewhere = tmp_path / "elsewhere.toml"
    elsewhere.write_bytes((folder / "material.toml").read_bytes())
    outside = (folder / "measurement.toml").read_text().replace('"material.toml"', f'"{elsewhere}"')
    assert "material: 'elsewhere.toml' is outside the archive" in refused(
        archive_of(folder, **{"measurement.toml": outside})
    )
    without = (folder / "measurement.toml").rename(tmp_path / "measurement.toml")
    sent = packed(folder)
    without.rename(folder / "measurement.toml")
    assert re.fullmatch(r"back\.zip: measurement\.toml: no such file.*", refused(sent))
    assert "columns: a,b" in refused(archive_of(folder, **{table(folder).name: "a,b\n1,2\n"}))


def test_an_archive_that_was_another_follow_up_s_is_refused_and_none_is_a_data_set(folder, asked, tmp_path):
    uploads, before = tmp_path / "uploads", contents(folder)
    take_filled(folder, asked, "back.zip", packed(folder), uploads)
    with pytest.raises(CommandError, match=r"^back\.zip: follow_up\.json: is that of another follow-up"):
        take_filled(folder, replace(asked, rivals=("air_drag", "base")), "back.zip", packed(folder), uploads)
    assert contents(folder) == before
    assert kept_measurements(uploads) == {}


def test_a_check_by_bodies_has_their_table_and_no_other(tmp_path, measured):
    folder = tmp_path / "next"
    write_next(folder, SOURCE, measured, CHECK)
    tables = read_follow_up(folder)
    assert (tables.condition, tables.numbers, tables.pours) == ("", (), 0)
    assert [one.quantity for one in tables.bodies] == ["mass", "length_spread"]
    with pytest.raises(CommandError, match="condition: is missing"):
        write_numbers(folder, ())
    write_bodies(folder, [replace(tables.bodies[0], mean="0.115", standard_error="0.001"), tables.bodies[1]])
    assert len(read_next(folder).measurement.bodies) == 1
    sent = packed(folder)
    write_bodies(folder, tables.bodies)
    take_filled(folder, CHECK, "back.zip", sent, tmp_path / "uploads")
    assert read_follow_up(folder).bodies[0].mean == "0.115"
    # The same numbers asked for once more, with those of the first time among the data.
    write_next(tmp_path / "again", SOURCE, measured, CHECK, before=[folder])
    with pytest.raises(CommandError, match=r"^back\.zip: follow_up\.json: is that of another follow-up"):
        take_filled(tmp_path / "again", CHECK, "back.zip", sent, tmp_path / "uploads")


# On the page


def test_the_page_s_rows_come_back_in_any_order(folder):
    tables = read_follow_up(folder)
    heads = [one["headerName"] for one in number_columns(tables)]
    assert heads[0] == "Quantity"
    assert heads[-3:] == ["Pour 1", "Pour 2", "Pour 3"]
    rows = number_rows(tables)
    place = next(k for k, one in enumerate(tables.numbers) if one.observable == ANGLE)
    assert rows[place]["quantity"] == "angle of repose, silhouette"
    assert rows[place]["unit"] == "deg"
    rows[place] |= {"pour_1": "24.5", "pour_3": None}
    found = filled_numbers(tables, rows[::-1])
    assert found[place].values == ("24.5", "", "")
    assert [one for k, one in enumerate(found) if k != place] == [
        one for k, one in enumerate(tables.numbers) if k != place
    ]
    with pytest.raises(CommandError, match="not the rows of the follow-up"):
        filled_numbers(tables, rows[1:])


def test_the_page_s_rows_of_bodies_say_how_they_are_measured(folder):
    tables = read_follow_up(folder)
    assert [one["headerName"] for one in body_columns()][-2:] == ["Mean", "Standard error"]
    rows = body_rows(tables)
    assert rows[0]["how"] == "count fifty, weigh them in five lots of ten"
    rows[1] |= {"mean": 11.0, "standard_error": "0.1"}
    assert filled_bodies(tables, rows)[1].mean == "11.0"
