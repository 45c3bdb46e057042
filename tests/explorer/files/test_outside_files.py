"""A measured data set that reads a file elsewhere says so; one from a browser may not."""

import io
import zipfile

import pytest

from doe.errors import MeasurementError
from doe.measurement.load import load_measurement
from explorer.errors import CommandError
from explorer.files.uploads import unpacked_measurement
from tests.doe.measurement.folders import MATERIAL, MEASUREMENT, TABLE, changed, write


@pytest.fixture
def elsewhere(tmp_path):
    """A folder beside that of the data, with files that could be read as theirs."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "table.csv").write_text(TABLE, encoding="utf-8")
    (folder / "material.toml").write_text(MATERIAL, encoding="utf-8")
    return folder


def outside(measurement):
    return [note for note in measurement.notes if "outside the folder" in note]


def test_a_folder_that_is_whole_by_itself_has_nothing_to_say(tmp_path):
    folder = write(tmp_path / "set")
    (folder / "again.csv").symlink_to(folder / "slow.csv")
    table = changed(MEASUREMENT, '"slow.csv"', '"again.csv"')
    assert outside(load_measurement(write(folder, {"measurement.toml": table}))) == []


@pytest.mark.parametrize("path", ["../elsewhere/table.csv", "{elsewhere}/table.csv"])
def test_a_path_that_leads_outside_is_told(tmp_path, elsewhere, path):
    table = changed(MEASUREMENT, '"slow.csv"', f'"{path.format(elsewhere=elsewhere)}"')
    notes = outside(load_measurement(write(tmp_path / "set", {"measurement.toml": table})))
    assert notes == [f"condition.data: {elsewhere / 'table.csv'} is outside the folder"]


def test_a_link_that_leads_outside_is_told(tmp_path, elsewhere):
    folder = write(tmp_path / "set", {"slow.csv": None})
    (folder / "slow.csv").symlink_to(elsewhere / "table.csv")
    assert outside(load_measurement(folder)) == [f"condition.data: {elsewhere / 'table.csv'} is outside the folder"]


def test_a_material_elsewhere_and_what_it_names_are_told(tmp_path, elsewhere):
    table = changed(MEASUREMENT, '"material.toml"', '"../elsewhere/material.toml"')
    notes = outside(load_measurement(write(tmp_path / "set", {"measurement.toml": table})))
    assert notes == [f"material: {elsewhere / 'material.toml'} is outside the folder"]


def test_a_shipped_material_is_nothing_of_the_kind(tmp_path):
    table = changed(MEASUREMENT, '"material.toml"', '"glass_beads"')
    with pytest.raises(MeasurementError, match=r"pair\.glass"):  # it has no such pair, and is read
        load_measurement(write(tmp_path / "set", {"measurement.toml": table}))


PASSWORDS = "/etc/passwd"


@pytest.mark.parametrize(
    ("file", "old", "new", "key"),
    [
        ("measurement.toml", '"slow.csv"', f'"{PASSWORDS}"', "condition.data"),
        ("measurement.toml", '"slow.csv"', '"../../../../../etc/passwd"', "condition.data"),
        ("measurement.toml", 'role = "fit"', f'role = "fit"\nimages = ["{PASSWORDS}"]', "condition.images"),
        ("measurement.toml", 'role = "fit"', f'role = "fit"\nimages = [{{file = "{PASSWORDS}"}}]', "condition.images"),
        ("measurement.toml", '"material.toml"', f'"{PASSWORDS}"', "material"),
        ("measurement.toml", 'role = "fit"', f'role = "fit"\nmaterial = "{PASSWORDS}"', "condition.material"),
        ("material.toml", "{ sphere = 12e-3 }", f'{{ file = "{PASSWORDS}", unit = "mm" }}', "material"),
        ("material.toml", 'material = "glass"\n', f'material = "glass"\nfile = "{PASSWORDS}"\n', "material"),
        ("material.toml", 'material = "glass"\n', 'material = "glass"\nfile = "body.toml"\n', "material"),
        ("material.toml", "[[body]]", f'[rig]\nmesh = "{PASSWORDS}"\n[[body]]', "material"),
        ("material.toml", "[[body]]", '[rig]\nmesh = "~/../../../../../etc/passwd"\n[[body]]', "material"),
        (
            "measurement.toml",
            "mass = 0.014",
            f'mesh = "{PASSWORDS}"',
            "condition.rig_parameters.mesh",
        ),
    ],
)
def test_an_archive_from_a_browser_names_no_file_of_this_machine(tmp_path, file, old, new, key):
    texts = {"measurement.toml": MEASUREMENT, "material.toml": MATERIAL}
    folder = write(tmp_path / "set", {file: changed(texts[file], old, new)})
    body = f'format = 1\n[[body]]\nname = "bead"\nshape = {{ mesh = "{PASSWORDS}", unit = "mm" }}\n'
    (folder / "body.toml").write_text(body, encoding="utf-8")
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for path in folder.iterdir():
            archive.write(path, path.name)
    with pytest.raises(CommandError, match=rf"^set.zip: {key}: 'passwd' is outside the archive") as refused:
        unpacked_measurement("set.zip", packed.getvalue(), tmp_path / "kept")
    assert "root:" not in str(refused.value)
    assert list((tmp_path / "kept").iterdir()) == []


def test_links_in_a_circle_are_no_traceback(tmp_path):
    folder = write(tmp_path / "set")
    (folder / "scans").mkdir()
    (folder / "scans" / "a.npz").symlink_to("b.npz")
    (folder / "scans" / "b.npz").symlink_to("a.npz")
    assert outside(load_measurement(folder)) == []
