"""A few inputs of each parser of `make fuzz`, other ones than the last campaign's."""

import struct
import zlib

import pytest

from explorer.shape import mesh_solid
from solver.photograph import PhotographError, open_picture
from solver.shapes.solid import ShapeError
from tests.faults.fuzz import CAMPAIGNS, PARSERS, fault_of
from tests.faults.seeds import SIDES, glb_elsewhere, meshes, pictures

FEW = {"photograph": 1, "picture": 3, "sheet of runs": 3, "command line": 1, "messages to the page": 1}
"""Inputs of what takes long; of the others six."""


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_damaged_files_are_read_or_refused_in_one_line(name):
    faults = [CAMPAIGNS[name](f"{name} short {number}") for number in range(FEW.get(name, 6))]
    assert [fault for fault in faults if fault] == []


def test_a_parser_that_breaks_is_told():
    """The campaign sees what it looks for: an exception of another kind than the program's own."""

    def breaks(path):
        raise KeyError(path.name)

    fault = fault_of(type(PARSERS["factors"])(PARSERS["factors"].seeds, breaks), "x")
    assert "KeyError: 'sunflower_extract.toml'" in fault


def claiming(name):
    """A small picture of the campaign whose head says that it has 60 000 × 60 000 pixels."""
    content = next(path for path in pictures() if path.name == name).read_bytes()
    if name.endswith(".png"):
        head = content[12:16] + struct.pack(">II", 60_000, 60_000) + content[24:29]
        return content[:12] + head + struct.pack(">I", zlib.crc32(head)) + content[33:]
    if name.endswith(".jpg"):
        frame = max(content.find(b"\xff\xc0"), content.find(b"\xff\xc2"))
        return content[: frame + 5] + struct.pack(">HH", 60_000, 60_000) + content[frame + 9 :]
    if name.endswith(".bmp"):
        return content[:18] + struct.pack("<ii", 60_000, 60_000) + content[26:]
    (entries,) = struct.unpack("<I", content[4:8])
    found = bytearray(content)
    for k in range(struct.unpack("<H", content[entries : entries + 2])[0]):
        place = entries + 2 + 12 * k
        if struct.unpack("<H", content[place : place + 2])[0] in (256, 257):  # width and height
            found[place + 2 : place + 12] = struct.pack("<HII", 4, 1, 60_000)
    return bytes(found)


@pytest.mark.parametrize("name", ["grey.png", "deep.png", "colour.jpg", "progressive.jpg", "grey.tif", "colour.bmp"])
def test_a_picture_that_claims_to_be_huge_is_refused_before_it_is_unpacked(name, tmp_path):
    (tmp_path / name).write_bytes(claiming(name))
    with pytest.raises(PhotographError, match=r"up to 60 megapixels"):
        open_picture(tmp_path / name)


@pytest.mark.parametrize("path", pictures(), ids=lambda path: path.name)
def test_every_kind_of_picture_is_read(path):
    assert (open_picture(path).width, open_picture(path).height) == SIDES


@pytest.mark.parametrize("uri", ["../outside.bin", "{folder}/outside.bin", "file://{folder}/outside.bin"])
def test_a_mesh_reads_no_file_elsewhere(uri, tmp_path):
    glb = next(path for path in meshes() if path.name == "body.glb").read_bytes()
    (size,) = struct.unpack("<I", glb[12:16])
    (tmp_path / "outside.bin").write_bytes(glb[28 + size :])
    (tmp_path / "sent").mkdir()
    file = tmp_path / "sent" / "body.glb"
    file.write_bytes(glb)
    mesh_solid(file, "mm", "--unit")
    file.write_bytes(glb_elsewhere(glb, uri.format(folder=tmp_path)))
    with pytest.raises(ShapeError, match=r"cannot be read"):
        mesh_solid(file, "mm", "--unit")


def test_faces_of_corners_that_are_not_there_are_refused(tmp_path):
    text = next(path for path in meshes() if path.name == "ascii.ply").read_text(encoding="ascii")
    file = tmp_path / "body.ply"
    last = text.rstrip().splitlines()[-1]
    file.write_text(text.replace(last, "3 0 1 266"), encoding="ascii")
    with pytest.raises(ShapeError, match=r"faces of corners that it does not hold"):
        mesh_solid(file, "mm", "--unit")
