"""Files that a browser sent: checked, kept in a folder under a name of our own, or refused in one line.

A name from a browser is only ever a label; where a file is put is decided here, by its contents. A mesh is tried as the
shape of a body or as the funnel and kept with a material of that scene: what cannot be poured is refused before the
present pour is given up, with nothing left behind.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import re
import shutil
import stat
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from doe.measurement.load import FILE as MEASUREMENT_FILE
from doe.measurement.load import load_measurement, outside_files
from explorer.errors import CommandError
from explorer.files.output_file import write_whole, write_whole_bytes
from explorer.scene.source import SceneSource, material_source
from explorer.scene.text import material_toml
from explorer.shape import FIXED_UNIT, MOST_FACES_DRAWN, USUAL_UNIT, mesh_solid
from solver.npz import ZIP_DAMAGE
from solver.rigs import MeshFunnel
from solver.scenes.material_file import files_named_in
from solver.scenes.scene import Scene, check, with_rig, with_values
from solver.shapes.mesh_file import SUFFIXES
from solver.shapes.solid import Solid, surface_mesh
from solver.toml_file import read_toml

MOST_FILE_BYTES = 30_000_000
MOST_ZIP_BYTES, MOST_UNPACKED_BYTES, MOST_MEMBERS = 50_000_000, 200_000_000, 1000
LABEL = re.compile(r"[^A-Za-z0-9_-]+")
PART = re.compile(r"[A-Za-z0-9_. -]+")
"""What a part of a path in an archive may consist of."""
KEPT_IN_FUNNEL = ("mass", "outlet_height", "domain_half_width")
"""Parameters of the rig of before that the funnel has as well."""
FEED_SHARE = 0.8
"""Radius of the feed over that of a mesh funnel's opening, where the usual feed would be wider."""


def kept_file(name: str, content: bytes, folder: Path, suffixes: Sequence[str]) -> Path:
    """The file ``content`` as it came, kept in ``folder``; CommandError in one line for another kind or size."""
    path = place(name, content, folder, suffixes)
    write_whole_bytes(path, content)
    return path


@contextmanager
def read_once(name: str, content: bytes) -> Iterator[Path]:
    """The file ``content``, of any kind, for as long as it is read; CommandError names it as the person does."""
    if not 0 < len(content) <= MOST_FILE_BYTES:
        raise CommandError(f"{name[:80]}: {len(content)} bytes; allowed: up to {MOST_FILE_BYTES}")
    with tempfile.TemporaryDirectory() as apart:
        path = Path(apart) / ".".join(label(part) for part in Path(name).name[:80].split("."))
        path.write_bytes(content)
        with named(name, path):
            yield path


def unpacked_measurement(name: str, content: bytes, folder: Path) -> Path:
    """The measured data set in the archive ``content``, unpacked into a folder within ``folder`` and read once.

    It has to be whole by itself: a path in it would be one of this machine, and not of the browser's. Raises
    CommandError in one line, with nothing left behind.
    """

    def read(unpacked: Path) -> None:
        for key, path in outside_files(unpacked, read_toml(unpacked / MEASUREMENT_FILE)):
            raise CommandError(f"{key}: {path.name[:80]!r} is outside the archive; allowed are files in it")
        load_measurement(unpacked)

    return unpacked_folder(name, content, folder, MEASUREMENT_FILE, read)


def kept_measurements(folder: Path) -> dict[str, Path]:
    """Name → folder of every data set that :func:`unpacked_measurement` has kept in ``folder``."""
    return {file.parent.name: file.parent for file in sorted(folder.glob(f"[!.]*/{MEASUREMENT_FILE}"))}


def unpacked_folder(name: str, content: bytes, folder: Path, marker: str, read: Callable[[Path], object]) -> Path:
    """The folder that holds the file ``marker`` in an archive, unpacked within ``folder`` and tried by ``read``.

    Raises what ``read`` raises, as CommandError in one line, with nothing left behind.
    """
    if not 0 < len(content) <= MOST_ZIP_BYTES:
        raise CommandError(f"{name[:80]}: {len(content)} bytes; allowed: up to {MOST_ZIP_BYTES}")
    folder.mkdir(parents=True, exist_ok=True)
    kept = folder / f"{label(Path(name).stem)}-{_digest(content)}"
    if kept.is_dir():
        return kept
    apart = Path(tempfile.mkdtemp(prefix=".unpacking-", dir=folder))
    try:
        with named(name, apart):
            _unpack(content, apart, marker)
            read(apart)
        apart.replace(kept)
    finally:
        shutil.rmtree(apart, ignore_errors=True)
    return kept


def _unpack(content: bytes, folder: Path, marker: str) -> None:
    """All files of the archive below the folder that holds ``marker``."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = [member for member in archive.infolist() if not member.is_dir()]
            _check_members(members)
            top = _top(members, marker)
            for member in members:
                path = PurePosixPath(member.filename)
                if not path.is_relative_to(top):
                    continue
                target = folder / path.relative_to(top)
                target.parent.mkdir(parents=True, exist_ok=True)
                with archive.open(member) as packed, target.open("wb") as file:
                    shutil.copyfileobj(packed, file)
    except ZIP_DAMAGE as error:
        raise CommandError(f"cannot be unpacked as .zip: {' '.join(str(error).split())[:120]}") from None


def _check_members(members: list[zipfile.ZipInfo]) -> None:
    if len(members) > MOST_MEMBERS:
        raise CommandError(f"holds {len(members)} files; allowed: up to {MOST_MEMBERS}")
    size = sum(member.file_size for member in members)
    if size > MOST_UNPACKED_BYTES:
        raise CommandError(f"holds {size} bytes; allowed: up to {MOST_UNPACKED_BYTES}")
    for member in members:
        parts = PurePosixPath(member.filename).parts
        # A part of dots alone leads out of the folder; a link could as well.
        plain = all(PART.fullmatch(part) and part.strip(". ") for part in parts)
        if not parts or not plain or stat.S_ISLNK(member.external_attr >> 16):
            raise CommandError(f"{member.filename[:80]!r}: allowed are plain files in folders below the archive's top")


def _top(members: list[zipfile.ZipInfo], marker: str) -> PurePosixPath:
    """The folder with ``marker``: the archive's top, or one within it."""
    found = [path for member in members if (path := PurePosixPath(member.filename)).name == marker]
    if len(found) != 1:
        raise CommandError(f"holds {len(found)} files {marker}; allowed: one, beside the files that it names")
    return found[0].parent


def shaped_source(present: Scene, body: str, name: str, content: bytes, unit: str | None, folder: Path) -> SceneSource:
    """``present`` with the mesh ``content`` as the shape of its component ``body``.

    Args:
        present: the scene whose other components, set-up and parameters stay.
        body: name of the component.
        name: name of the file in the browser.
        content: the file.
        unit: unit of its coordinates; None: that of the format, or millimetres.
        folder: where mesh and material file are kept.

    The member spheres are fitted here, which takes seconds.
    """
    if body not in [one.name for one in present.bodies]:
        raise CommandError(f"body {body[:60]!r}: no such body")

    def shaped(mesh: Path) -> Scene:
        solid = mesh_solid(mesh, unit, unit_input="unit")
        _check_faces(solid)
        bodies = [dataclasses.replace(one, shape=solid) if one.name == body else one for one in present.bodies]
        scene = dataclasses.replace(present, bodies=tuple(bodies))
        for one in scene.bodies:
            _ = one.clump
        return scene

    return _kept(name, content, folder, body, shaped)


def _check_faces(solid: Solid) -> None:
    faces = len(surface_mesh(solid).faces)
    if faces > MOST_FACES_DRAWN:
        raise CommandError(
            f"{faces} faces; the page draws up to {MOST_FACES_DRAWN}: reduce the mesh, or make a body file of it with "
            "`explorer shape`"
        )


def funnel_source(present: Scene, name: str, content: bytes, unit: str | None, folder: Path) -> SceneSource:
    """``present`` poured through the mesh ``content``; the rest is as in :func:`shaped_source`.

    Materials, bodies, mass, height of the outlet and the feed stay; it is drawn in where the mesh is narrower.
    """

    def poured(mesh: Path) -> Scene:
        given = unit or FIXED_UNIT.get(mesh.suffix.lower(), USUAL_UNIT)
        rig = MeshFunnel(mesh=str(mesh.absolute()), unit=given, wall=present.rig.wall)
        feed = min(present.insertion.region_radius, FEED_SHARE * rig.placed.inlet.nearest)
        own = {f"rig.{name}": getattr(present.rig, name) for name in KEPT_IN_FUNNEL if hasattr(present.rig, name)}
        placed = with_rig(present, rig.name)
        # What suited the rig of before may not suit a funnel.
        fed = present.insertion if present.insertion.protocol in rig.protocols else placed.insertion
        scene = dataclasses.replace(placed, insertion=dataclasses.replace(fed, region_radius=feed))
        return with_values(scene, own | {"rig.mesh": rig.mesh, "rig.unit": given})

    return _kept(name, content, folder, MeshFunnel.name, poured)


def _kept(name: str, content: bytes, folder: Path, what: str, make: Callable[[Path], Scene]) -> SceneSource:
    """The scene that ``make`` builds with the mesh, written beside it as a material."""
    with _tried(name, content, folder, SUFFIXES) as mesh:
        scene = make(mesh)
        check(scene)
    material = folder / f"{mesh.stem}-{label(what)}.toml"
    write_whole(material, material_toml(scene, f"{scene.title}, with {mesh.name} as its {what}. SI."))
    return material_source(str(material))


def uploaded_material(name: str, content: bytes, folder: Path) -> SceneSource:
    """The material file ``content``, in the rig that it says itself, kept in ``folder``.

    It has to be whole by itself: a path in it would be one of this machine, and not of the browser's. Raises
    CommandError in one line, with nothing left behind.
    """
    with _tried(name, content, folder, (".toml",)) as file:
        for other in files_named_in(read_toml(file)):
            raise CommandError(
                f"names the file {str(other)[:80]!r}; allowed is a material that is whole by itself: upload its mesh "
                "under Shape or funnel from a mesh"
            )
        source = material_source(str(file))
        check(source.scene)
    return source


@contextmanager
def _tried(name: str, content: bytes, folder: Path, suffixes: Sequence[str]) -> Iterator[Path]:
    """The file ``content`` kept in ``folder``, unless what is done with it is refused; then it is taken away again."""
    path = place(name, content, folder, suffixes)
    new = not path.exists()
    with named(name, path):
        try:
            write_whole_bytes(path, content)
            yield path
        except ValueError:
            if new:
                path.unlink(missing_ok=True)
            raise


def place(name: str, content: bytes, folder: Path, suffixes: Sequence[str]) -> Path:
    """Where an upload is put in ``folder``, which is there afterwards; CommandError for another kind or size."""
    suffix = Path(name).suffix.lower()
    if suffix not in suffixes:
        raise CommandError(f"{label(name)}: allowed: files ending in {', '.join(suffixes)}")
    if not 0 < len(content) <= MOST_FILE_BYTES:
        raise CommandError(f"{name[:80]}: {len(content)} bytes; allowed: up to {MOST_FILE_BYTES}")
    folder.mkdir(parents=True, exist_ok=True)
    return folder / f"{label(Path(name).stem)}-{_digest(content)}{suffix}"


def label(text: str) -> str:
    """``text`` from outside as a part of a file's name."""
    return LABEL.sub("_", text)[:40].strip("_") or "unnamed"


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:12]


@contextmanager
def named(name: str, path: Path) -> Iterator[None]:
    """Errors with the name that the person knows in place of ``path``."""
    try:
        yield
    except ValueError as error:
        text = " ".join(str(error).split()).replace(f"{path}/", "").replace(str(path), "").lstrip(": ")
        raise CommandError(f"{name[:80]}: {text}") from None
