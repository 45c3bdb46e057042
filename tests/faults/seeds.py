"""Files that are shipped nowhere and read by the program, made once for a campaign: pictures, meshes, a recording."""

import json
import struct
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from tests.explorer.recordings.test_pour_log import poses
from tests.solver.photograph.drum_faces import Look, drawn, plane

_place = tempfile.TemporaryDirectory()
SIDES = (320, 240)


def _folder(name: str) -> Path:
    folder = Path(_place.name, name)
    folder.mkdir()
    return folder


def _pile() -> Image.Image:
    """A grey pile before a bright wall, as `measure` reads it."""
    x, y = np.meshgrid(np.arange(SIDES[0]), np.arange(SIDES[1]))
    pile = y > SIDES[1] - 20 - np.clip(90 - 0.6 * abs(x - SIDES[0] / 2), 0, None)
    return Image.fromarray(np.where(pile, 60, 200).astype(np.uint8))


@cache
def pictures() -> tuple[Path, ...]:
    """Every format that is read, in the modes that cameras, scanners and programs write."""
    folder, pile = _folder("pictures"), _pile()
    deep = Image.fromarray(np.asarray(pile).astype(np.uint16) * 257)
    frames = {"save_all": True, "append_images": [pile.convert("RGB")] * 3}
    kinds = (
        ("grey.png", pile, {}),
        ("colour.png", pile.convert("RGB"), {}),
        ("palette.png", pile.convert("P"), {}),
        ("alpha.png", pile.convert("RGBA"), {}),
        ("deep.png", deep, {}),
        ("animated.png", pile.convert("RGB"), frames),
        ("colour.jpg", pile.convert("RGB"), {}),
        ("progressive.jpg", pile.convert("RGB"), {"progressive": True}),
        ("cmyk.jpg", pile.convert("CMYK"), {}),
        ("grey.tif", pile, {}),
        ("deep.tif", deep, {}),
        ("packed.tif", pile.convert("RGB"), {"compression": "tiff_lzw"}),
        ("pages.tif", pile.convert("RGB"), frames),
        ("float.tif", pile.convert("F"), {}),
        ("animated.webp", pile.convert("RGB"), frames),
        ("colour.bmp", pile.convert("RGB"), {}),
    )
    for name, image, options in kinds:
        image.save(folder / name, **options)
    return tuple(sorted(folder.iterdir()))


@cache
def drum_faces() -> tuple[Path, ...]:
    """The face of a drum that turns, small."""
    folder = _folder("drum_faces")
    face = drawn(plane(30.0), Look(width=240, height=200, radius=80.0, at=(120.0, 100.0), grains=8.0))
    grey = Image.fromarray(face.grey.astype(np.uint8))
    for name in ("face.png", "face.jpg", "face.bmp"):
        grey.save(folder / name)
    return tuple(sorted(folder.iterdir()))


@cache
def meshes() -> tuple[Path, ...]:
    """A closed surface in every format, and one in a GLB that asks for files elsewhere."""
    folder, body = _folder("meshes"), trimesh.creation.icosphere(2, 5.0)
    for name in ("body.obj", "body.ply", "body.glb", "body.stl"):
        body.export(folder / name)
    (folder / "ascii.ply").write_bytes(body.export(file_type="ply", encoding="ascii"))
    (folder / "ascii.stl").write_text(body.export(file_type="stl_ascii"), encoding="ascii")
    (folder / "with_material.obj").write_text(
        "mtllib ../../etc/passwd\nmtllib /etc/passwd\n" + (folder / "body.obj").read_text(), encoding="utf-8"
    )
    (folder / "elsewhere.glb").write_bytes(glb_elsewhere((folder / "body.glb").read_bytes(), "../../../etc/passwd"))
    return tuple(sorted(folder.iterdir()))


def glb_elsewhere(glb: bytes, uri: str) -> bytes:
    """``glb`` with its numbers in the file ``uri`` in place of its own block."""
    (size,) = struct.unpack("<I", glb[12:16])
    head = json.loads(glb[20 : 20 + size])
    head["buffers"][0]["uri"] = uri
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text), len(text), 0x4E4F534A) + text


@cache
def recordings() -> tuple[Path, ...]:
    """A recording of a pour."""
    # Imported here: rerun takes a second to load.
    from explorer.recordings.pour_log import PourLog
    from explorer.scene.file import load_scene

    path = _folder("recordings") / "pour.rrd"
    with PourLog(path, load_scene("funnel"), seed=1) as log:
        log.event(0.0, "phase: fill")
        for k in range(4):
            log.frame(0.02 * k, poses(*[0] * (k + 1)), {"angle_of_repose_deg": 20.0 + k}, gate_shut=k < 2)
    return (path,)
