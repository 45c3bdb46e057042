"""Files from a browser: what is kept, and that what is refused leaves nothing behind."""

import io
import stat
import zipfile

import numpy as np
import pytest
import trimesh

from doe.measurement.load import load_measurement
from explorer.errors import CommandError
from explorer.files.uploads import MOST_MEMBERS, label, unpacked_measurement
from solver.assets import measurement_folder

pytestmark = pytest.mark.usefixtures("own_cache")

DRUM = measurement_folder("granudrum_mcc")


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


def test_an_archive_damaged_within_is_refused_as_one(tmp_path):
    """Its list of members is whole, the packed bytes are not: one bit more of them at a time, to the end of a file."""
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("measurement.toml", "x" * 50 + "yz" * 40)
    content = bytearray(whole.getvalue())
    start = 30 + len("measurement.toml")
    for place in range(start, start + 8):
        damaged = content.copy()
        damaged[place] ^= 0xFF
        with pytest.raises(CommandError, match=r"cannot be unpacked as \.zip"):
            unpacked_measurement("a.zip", bytes(damaged), tmp_path)
    assert not list(tmp_path.iterdir())


def test_labels_are_parts_of_file_names():
    assert label("../../a b<c>") == "a_b_c"
    assert label("…") == "unnamed"
    assert len(label("x" * 500)) == 40
