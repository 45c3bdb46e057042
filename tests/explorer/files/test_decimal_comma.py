"""Files that a German spreadsheet saved say the same as ours: readings, measured data, sheets, outlines, studies."""

import csv
import io
import re
import shutil

import pytest

from doe.audit import audit_study
from doe.laboratory import TESTS
from explorer.audit.read_study import read_study
from explorer.errors import CommandError
from explorer.files.measured_curves import measured_file
from solver.assets import asset_path, measurement_folder
from tests.explorer.command_line import explorer, refused

NUMBER = re.compile(r"[<>]?[-+−]?\d+\.\d+(e[-+]?\d+)?")


def german(text):
    """``text`` as saved there: ; between cells, decimal commas, quotes where needed, rows of one width, a BOM."""
    rows = [next(csv.reader([line]), []) for line in text.splitlines()]
    width = 1 + max(len(row) for row in rows)
    file = io.StringIO()
    writer = csv.writer(file, delimiter=";", lineterminator="\r\n")
    for row in rows:
        cells = [cell.replace(".", ",") if NUMBER.fullmatch(cell.strip()) else cell for cell in row]
        writer.writerow([*cells, *[""] * (width - len(cells))])
    return b"\xef\xbb\xbf" + file.getvalue().encode()


def saved(source, folder):
    """A German copy of the file ``source`` in ``folder``."""
    copy = folder / source.name
    copy.write_bytes(german(source.read_text(encoding="utf-8-sig")))
    return copy


def printed(folder, *arguments):
    """Standard output of a command, without the name of the folder that it read."""
    result = explorer(*arguments)
    assert result.exit_code == 0, result.output
    return result.stdout.replace(str(folder), "")


@pytest.mark.parametrize("test", TESTS)
def test_readings_of_a_laboratory(tmp_path, test):
    shipped = asset_path("laboratory", test)
    ours = printed(shipped.parent, "lab", test, shipped, "--json")
    assert printed(tmp_path, "lab", test, saved(shipped, tmp_path), "--json") == ours


@pytest.mark.parametrize("name", ["trefoil_1", "granudrum_mcc", "sunflower_extract"])
def test_a_measured_data_set(tmp_path, name):
    shipped = measurement_folder(name)
    folder = tmp_path / name
    shutil.copytree(shipped, folder)
    for table in shipped.glob("*.csv"):
        saved(table, folder)
    assert printed(folder, "measurements", "check", folder, "--json") == printed(
        shipped, "measurements", "check", shipped, "--json"
    )


def test_a_filled_sheet(tmp_path):
    shipped = asset_path("runs", "sunflower_extract")
    ours = printed(shipped.parent, "analyse", shipped, "--json")
    assert printed(tmp_path, "analyse", saved(shipped, tmp_path), "--json") == ours


def test_an_outline():
    text = "# traced by hand\nu_m,z_m\n0.02,0.0\n-0.02,0\n0.0,0.0125\n"
    ours, theirs = (measured_file("o.csv", content) for content in (text.encode(), german(text)))
    assert theirs.u.tolist() == ours.u.tolist() == [-0.02, 0.0, 0.02]
    assert theirs.z.tolist() == ours.z.tolist() == [0.0, 0.0125, 0.0]


def test_the_tables_of_a_published_study(tmp_path):
    shipped = asset_path("source_tables", "table1_physical").parent
    shutil.copytree(shipped, tmp_path / "study")
    for table in shipped.glob("*.csv"):
        saved(table, tmp_path / "study")
    assert str(audit_study(read_study(tmp_path / "study"))) == str(audit_study(read_study(shipped)))


def test_a_number_that_cannot_be_read_is_named_by_file_line_and_column(tmp_path):
    readings = tmp_path / "readings.csv"
    readings.write_bytes(german("a,b,replicate,angle_deg\nx,y,1,30.5\nx,y,2,30.O\n"))
    assert refused(explorer("lab", "inclined_plane", readings)).startswith(
        f"{readings}, row 3, column angle_deg: '30.O'; allowed: "
    )
    folder = tmp_path / "data"
    shutil.copytree(measurement_folder("sunflower_extract"), folder)
    (table,) = folder.glob("*.csv")
    lines = german(table.read_text()).decode("utf-8-sig").splitlines()
    assert "24,68" in lines[-1]
    table.write_text("\n".join([*lines[:-1], lines[-1].replace("24,68", "24,6,8")]), encoding="utf-8")
    assert refused(explorer("measurements", "check", folder)).startswith(
        f"{table}:{len(lines)}: value: '24,6,8'; allowed: a finite number in deg"
    )
    sheet = tmp_path / "runs.csv"
    sheet.write_bytes(german("# factor | a | 0 | 1\na,y\n0,1.5\n1,2.5\n0.5,2.O\n"))
    assert refused(explorer("analyse", sheet)).startswith(f"{sheet}, line 5, column y: '2.O' is not a number")
    with pytest.raises(CommandError, match=r"^o\.csv: line 3, column z_m: '0\.O'; allowed: a finite number in m$"):
        measured_file("o.csv", german("u_m,z_m\n0.0,0.5\n0.1,0.O\n"))
