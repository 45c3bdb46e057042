"""Meshes that a browser sent, as the shape of a body or as the funnel: tried, and kept with a material of the scene.

What cannot be poured is refused in one line before the present pour is given up, with nothing left behind.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

from explorer.errors import CommandError
from explorer.files.uploads import label, named, place
from explorer.files.whole_file import write_whole, write_whole_bytes
from explorer.scene.source import SceneSource, material_source
from explorer.scene.text import material_toml
from explorer.shape.mesh_solid import FIXED_UNIT, MOST_FACES_DRAWN, USUAL_UNIT, mesh_solid
from solver.rigs import MeshFunnel
from solver.scenes.scene import Scene, check, with_rig, with_values
from solver.shapes.mesh_file import SUFFIXES
from solver.shapes.solid import Solid, surface_mesh

KEPT = ("mass", "outlet_height", "domain_half_width")
"""Parameters of the rig of before that the funnel has as well."""
FEED_SHARE = 0.8
"""Radius of the feed over that of a mesh's opening, where the usual feed would be wider."""


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
        raise CommandError(f"body {body[:60]!r}: there is none of that name")

    def shaped(mesh: Path) -> Scene:
        solid = mesh_solid(mesh, unit, unit_input="unit")
        _check_faces(solid)
        bodies = [dataclasses.replace(one, shape=solid) if one.name == body else one for one in present.bodies]
        scene = dataclasses.replace(present, bodies=tuple(bodies))
        for one in scene.bodies:
            _ = one.clump
        return scene

    return _kept(name, content, folder, body, shaped)


def funnel_source(present: Scene, name: str, content: bytes, unit: str | None, folder: Path) -> SceneSource:
    """``present`` poured through the mesh ``content``; the rest is as in :func:`shaped_source`.

    Materials, bodies, mass, height of the outlet and the feed stay; it is drawn in where the mesh is narrower.
    """

    def poured(mesh: Path) -> Scene:
        given = unit or FIXED_UNIT.get(mesh.suffix.lower(), USUAL_UNIT)
        rig = MeshFunnel(mesh=str(mesh.absolute()), unit=given, wall=present.rig.wall)
        feed = min(present.insertion.region_radius, FEED_SHARE * rig.placed.inlet.nearest)
        own = {f"rig.{name}": getattr(present.rig, name) for name in KEPT if hasattr(present.rig, name)}
        placed = with_rig(present, rig.name)
        # What suited the rig of before may not suit a funnel.
        fed = present.insertion if present.insertion.protocol in rig.protocols else placed.insertion
        scene = dataclasses.replace(placed, insertion=dataclasses.replace(fed, region_radius=feed))
        return with_values(scene, own | {"rig.mesh": rig.mesh, "rig.unit": given})

    return _kept(name, content, folder, MeshFunnel.name, poured)


def _kept(name: str, content: bytes, folder: Path, what: str, make: Callable[[Path], Scene]) -> SceneSource:
    """The scene that ``make`` builds with the mesh, written beside it as a material."""
    mesh = place(name, content, folder, SUFFIXES)
    material = folder / f"{mesh.stem}-{label(what)}.toml"
    new = not mesh.exists()
    with named(name, mesh):
        try:
            write_whole_bytes(mesh, content)
            scene = make(mesh)
            check(scene)
        except ValueError:
            if new:
                mesh.unlink(missing_ok=True)
            raise
    write_whole(material, material_toml(scene, f"{scene.title}, with {mesh.name} as its {what}. SI."))
    return material_source(str(material))


def _check_faces(solid: Solid) -> None:
    faces = len(surface_mesh(solid).faces)
    if faces > MOST_FACES_DRAWN:
        raise CommandError(
            f"{faces} faces; the page draws up to {MOST_FACES_DRAWN}: reduce the mesh, or make a body file of it with "
            "`explorer shape`"
        )
