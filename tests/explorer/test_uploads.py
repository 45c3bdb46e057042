"""Files from a browser: what is kept, and that what is refused leaves nothing behind."""

import io
import stat
import zipfile

import numpy as np
import pytest
import trimesh

from doe.measurement.load import load_measurement
from explorer.errors import CommandError
from explorer.files.uploads import MOST_MEMBERS, label, shaped_source, unpacked_measurement
from explorer.scene.file import load_scene
from solver.assets import measurement_folder
from solver.scene import with_values
from solver.shape import mass_properties
from tests.explorer.beads import bead_scene

DRUM = measurement_folder("granudrum_mcc")


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path_factory.mktemp("clumps")))


def stl(size=(12.0, 10.0, 8.0), holes=0):
    """A box in millimetres, open where ``holes`` of its faces are missing."""
    box = trimesh.creation.box(size)
    box.update_faces(np.arange(len(box.faces)) >= holes)
    return box.export(file_type="stl")


def archive(files):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        for name, content in files.items():
            file.writestr(name, content)
    return packed.getvalue()


def drum_files(prefix=""):
    return {
        f"{prefix}{path.relative_to(DRUM)}": path.read_bytes() for path in sorted(DRUM.rglob("*")) if path.is_file()
    }


SCENE = with_values(bead_scene(), {"pair.bead.bead.static_friction": 0.123, "body.spheres": "coarse"})


def test_a_mesh_becomes_the_shape_of_a_body_and_a_material_that_every_command_takes(tmp_path):
    source = shaped_source(SCENE, "bead", "../my box.STL", stl(), None, tmp_path)
    body = source.scene.bodies[0]
    assert mass_properties(body.shape, 1000.0).volume == pytest.approx(12e-3 * 10e-3 * 8e-3, rel=1e-6)
    assert source.scene.pairs == SCENE.pairs
    assert source.scene.rig == SCENE.rig
    assert load_scene(*source.arguments) == source.scene
    assert {path.parent for path in tmp_path.rglob("*")} == {tmp_path}
    # Its spheres are fitted by now.
    assert body.clump.mass == pytest.approx(body.mass)


def test_the_unit_is_taken_as_told(tmp_path):
    source = shaped_source(SCENE, "bead", "box.stl", stl((1.2, 1.0, 0.8)), "cm", tmp_path)
    assert max(source.scene.bodies[0].extents) == pytest.approx(0.012, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "unit", "words"),
    [
        ("open.stl", stl(holes=2), None, "not watertight"),
        ("empty.stl", b"", None, "0 bytes"),
        ("noise.stl", bytes(range(256)) * 9, None, "noise.stl"),
        ("far.stl", stl(), "m", "is it in another unit"),
        ("huge.stl", stl((400.0, 400.0, 400.0)), None, r"huge.stl: rig\."),
        ("fine.stl", trimesh.creation.icosphere(5, 6.0).export(file_type="stl"), None, "20480 faces; the page draws"),
        ("evil.exe", stl(), None, "ending in .stl"),
        ("../../x<script>.stl", stl(holes=2), None, "not watertight"),
    ],
)
def test_a_bad_mesh_is_refused_in_one_line_and_leaves_nothing(name, content, unit, words, tmp_path):
    with pytest.raises(CommandError, match=words) as refused:
        shaped_source(SCENE, "bead", name, content, unit, tmp_path)
    assert "\n" not in str(refused.value)
    assert str(tmp_path) not in str(refused.value)
    assert list(tmp_path.iterdir()) == []


def test_a_body_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(CommandError, match="none of that name"):
        shaped_source(SCENE, "pebble", "box.stl", stl(), None, tmp_path)


@pytest.mark.parametrize("prefix", ["", "my drum/", "a/b/"])
def test_measured_data_are_unpacked_and_read(prefix, tmp_path):
    folder = unpacked_measurement("my drum.zip", archive(drum_files(prefix)), tmp_path)
    sent = load_measurement(folder)
    assert [c.scene for c in sent.conditions] == [c.scene for c in load_measurement(DRUM).conditions]
    # The same archive again is the same folder.
    assert unpacked_measurement("again.zip", archive(drum_files(prefix)), tmp_path).parent == folder.parent


def linked():
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        member = zipfile.ZipInfo("measurement.toml")
        member.external_attr = (stat.S_IFLNK | 0o777) << 16
        file.writestr(member, "/etc/passwd")
    return packed.getvalue()


def without(name):
    return {key: content for key, content in drum_files().items() if key != name}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "0 bytes"),
        (b"no archive at all", "cannot be unpacked"),
        (archive(drum_files())[:-40], "cannot be unpacked"),
        (archive({"readme.txt": b""}), "0 files measurement.toml"),
        (archive(drum_files("a/") | drum_files("b/")), "2 files measurement.toml"),
        (archive(drum_files() | {"../evil.toml": b""}), "plain files"),
        (archive(drum_files() | {"/etc/evil.toml": b""}), "plain files"),
        (archive(drum_files() | {"a\\evil": b""}), "plain files"),
        (linked(), "plain files"),
        (archive({f"{k}.csv": b"" for k in range(MOST_MEMBERS + 1)}), "files; allowed: up to"),
        (archive(without("drum_15rpm.csv")), "drum_15rpm.csv"),
        (archive(drum_files() | {"measurement.toml": b"format = 2"}), "format: 2"),
    ],
)
def test_a_bad_archive_is_refused_in_one_line_and_leaves_nothing(content, words, tmp_path):
    with pytest.raises(CommandError, match=words) as refused:
        unpacked_measurement("data.zip", content, tmp_path / "uploads")
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith("data.zip: ")
    assert str(tmp_path) not in str(refused.value)
    assert [path for path in tmp_path.rglob("*") if path.name != "uploads"] == []


def test_labels_are_parts_of_file_names():
    assert label("../../a b<c>") == "a_b_c"
    assert label("…") == "unnamed"
    assert len(label("x" * 500)) == 40
