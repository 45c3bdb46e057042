"""The pour in 3-D: bodies as batched meshes (one node per component), and the rig's surfaces, gate and plate.

The bodies' nodes serve a live pour and a recording alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt
import trimesh
import viser
from PIL import Image, ImageDraw, ImageFont

from explorer.live.frames import Frame
from explorer.scene.meshes import GATE_NAME, PLATE_NAME, body_triangles, rig_poses, rig_triangles, rim_circles
from explorer.viewer.palette import GLASS, HALO, PLATE, RIM, RING, TEXT, Colour, component_colour, linear
from solver.scenes.scene import Scene, actual, body_counts

Array = npt.NDArray[np.float64]

FINE = 2000
"""Number of bodies of a component up to which each is drawn with all its faces, however far away it is."""
RING_SPACING = 0.05
"""Spacing of the circles on the plate, which serve as a scale [m]."""
PLATE_RADIUS = 0.2
"""Radius of the disc that represents the infinite plate [m]; it is larger if a body lies farther out."""
PLATE_MARGIN = 0.01
"""The plate extends at least this far beyond the centre of the farthest body [m]."""
TEXT_AT, BAR_AT = math.radians(-38.0), math.radians(-74.0)
"""Azimuths of the radii written at the circles, and of the scale bar: in front of a camera in its initial view."""
TEXT_HEIGHT, TEXT_PIXELS = 15e-3, 64
"""Text on the plate: height of a line [m], and its pixels."""
STRETCHED = 1.6
"""Factor by which letters are stretched, as on a road: they are mostly seen at a low angle."""
BAR_LENGTH, BAR_RADIUS, BAR_THICKNESS = 0.05, 0.14, 2e-3
"""The scale bar on the plate and its distance from the axis [m]."""
CORNERS = 72
"""Corners of a circle on the plate and of a rim."""
LINE = 8e-4
"""Thickness of lines [m]."""
TUBE_SIDES, RIM_WIDER = 8, 1.5
"""Sides of a tube, and the radius of its rim as a multiple of its own."""
CLEAR, OPACITY = 0.16, {GATE_NAME: 0.5}
"""Opacity of what one has to look through: all surfaces except the plate."""


class SceneNodes:
    """Nodes of one scene, below the node ``root``; :meth:`show` moves the bodies and the surfaces of the rig."""

    def __init__(self, server: viser.ViserServer, scene: Scene, root: str = "") -> None:
        poured = actual(scene)  # effects of the set-up change shapes, sizes and numbers
        self.meshes = [body_triangles(body) for body in poured.bodies]
        """Surface of a body of each component, in its own frame."""
        self.widest = math.inf
        """Largest radius of the plate [m], whatever lies farther out; set if another pile stands beside it."""
        numbers = body_counts(poured)
        self.bodies = BodyNodes(
            server,
            [
                DrawnComponent(mesh, component_colour(k), n)
                for k, (mesh, n) in enumerate(zip(self.meshes, numbers, strict=True))
            ],
            root,
        )
        self._rig = rig_nodes(server, scene, root)
        self._surface_names, self._at_first = scene.rig.surface_names, rig_poses(scene.rig)
        self._surfaces = self._at_first
        self._plate = DrawnPlate(server, self._rig[PLATE_NAME], root) if PLATE_NAME in self._rig else None

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_] | None = None) -> None:
        """Move bodies and surfaces to their places in ``frame``; call it inside ``server.atomic()``.

        ``seen`` says which bodies are drawn, shape (n,); by default all that are in the domain.
        """
        self._show_surfaces(frame.surfaces)
        if self._plate is not None:
            self._plate.reach(min(self.widest, plate_radius(frame)))
        self.bodies.show(frame, seen)

    def fade(self, opacity: float) -> None:
        """Opacity of the surfaces that one has to look through."""
        for name in filter(seen_through, self._surface_names):
            self._rig[name].opacity = opacity

    def clear(self) -> None:
        """Hide all bodies and leave surfaces where they are: a new pour has not begun to fall yet."""
        self._show_surfaces(self._at_first)
        if self._plate is not None:
            self._plate.reach(PLATE_RADIUS)
        self.bodies.clear()

    def _show_surfaces(self, poses: Array) -> None:
        """Move those surfaces whose pose has changed; ``poses`` as in ``rig_poses``, or empty if none are known."""
        if poses.shape != self._surfaces.shape:
            return
        for name, pose, before in zip(self._surface_names, poses, self._surfaces, strict=True):
            if not np.array_equal(pose, before):
                self._rig[name].position, self._rig[name].wxyz = pose[:3], pose[3:]
        self._surfaces = poses

    def show_gate(self, shut: bool) -> None:
        """Draw the gate or not, if the rig has one."""
        if GATE_NAME in self._rig:
            self._rig[GATE_NAME].visible = shut

    def remove(self) -> None:
        """Take all nodes off the page."""
        self.bodies.remove()
        if self._plate is not None:
            self._plate.remove()
        for node in self._rig.values():
            node.remove()


class DrawnPlate:
    """The disc that represents the infinite plate, its mesh in ``disc``; circles, their radii and a bar as a scale."""

    def __init__(self, server: viser.ViserServer, disc: Any, root: str = "") -> None:
        self._server, self._disc, self._root = server, disc, root
        self._radius = PLATE_RADIUS
        self._of_mesh = float(np.hypot(*disc.vertices[:, :2].T).max())
        self._rings = server.scene.add_line_segments(f"{root}/rig/scale", rings(PLATE_RADIUS), RING, thickness=LINE)
        along = 0.5 * BAR_LENGTH / BAR_RADIUS * np.array([-1.0, 1.0])
        ends = np.column_stack([BAR_RADIUS * np.cos(BAR_AT + along), BAR_RADIUS * np.sin(BAR_AT + along), [LINE, LINE]])
        self._bar = server.scene.add_line_segments(f"{root}/rig/bar", ends[None], TEXT, thickness=BAR_THICKNESS)
        self._bar_text = self._written(
            "bar text", f"{100.0 * BAR_LENGTH:.0f} cm", BAR_RADIUS + 0.7 * TEXT_HEIGHT, BAR_AT
        )
        self._labels: list[Any] = []
        self._size()

    def reach(self, radius: float) -> None:
        """Enlarge or shrink the plate to ``radius`` [m]; call it inside ``server.atomic()``."""
        if radius != self._radius:
            self._radius = radius
            self._rings.points = rings(radius).astype(np.float32)
            self._size()

    def remove(self) -> None:
        """Take the scale off the page; the disc belongs to the rig."""
        for node in (self._rings, self._bar, self._bar_text, *self._labels):
            node.remove()

    def _size(self) -> None:
        widened = self._radius / self._of_mesh
        self._disc.scale = (widened, widened, 1.0)
        for k in range(len(self._labels) + 1, ring_count(self._radius) + 1):
            radius = k * RING_SPACING
            text = f"r = {100.0 * radius:.0f} cm"
            self._labels.append(self._written(f"radius {k}", text, radius - 0.6 * TEXT_HEIGHT, TEXT_AT))
        for k, label in enumerate(self._labels, start=1):
            label.visible = k <= ring_count(self._radius)

    def _written(self, name: str, text: str, radius: float, azimuth: float) -> Any:
        """``text`` lying on the plate with its middle at ``radius`` [m], to be read from outside."""
        pixels = text_pixels(text)
        half = 0.5 * (azimuth + 0.5 * np.pi)
        return self._server.scene.add_image(
            f"{self._root}/rig/{name}",
            pixels,
            TEXT_HEIGHT * pixels.shape[1] / pixels.shape[0] / STRETCHED,
            TEXT_HEIGHT,
            format="png",
            cast_shadow=False,
            receive_shadow=False,
            # viser's images face downward, hence half a turn about their own x axis, then a turn about z.
            wxyz=(0.0, math.cos(half), math.sin(half), 0.0),
            position=(radius * math.cos(azimuth), radius * math.sin(azimuth), LINE),
        )


def text_pixels(text: str) -> npt.NDArray[np.uint8]:
    """``text`` in the colour of the scale on a transparent ground, as RGBA, shape (TEXT_PIXELS, width, 4)."""
    font = ImageFont.load_default(0.8 * TEXT_PIXELS)
    left, _, right, _ = font.getbbox(text)
    image = Image.new("RGBA", (math.ceil(right - left), TEXT_PIXELS), (*TEXT, 0))
    ImageDraw.Draw(image).text((-left, 0.5 * TEXT_PIXELS), text, (*TEXT, 255), font, anchor="lm")
    return np.asarray(image)


def plate_radius(frame: Frame) -> float:
    """Radius [m] of the plate under ``frame``: the circle beyond its farthest body, at least ``PLATE_RADIUS``."""
    reach = np.hypot(*frame.position[frame.inside, :2].T.astype(np.float64)).max(initial=0.0)
    return max(PLATE_RADIUS, RING_SPACING * ring_count(float(reach) + PLATE_MARGIN + RING_SPACING))


def ring_count(radius: float) -> int:
    """How many circles a plate of this radius [m] holds, one at its rim included."""
    return int(radius / RING_SPACING + 1e-9)


def rings(radius: float) -> Array:
    """The circles on a plate of this radius [m] as line segments, shape (n, 2, 3)."""
    # Above the plate by the lines' thickness, so that they do not vanish in it.
    return np.concatenate([circle(k * RING_SPACING, LINE) for k in range(1, ring_count(radius) + 1)])


class Tubes:
    """Lines in the scene with given thickness, each with a dark rim: visible against anything.

    The rim is a wider tube of which only the far inner side is drawn, so it shows on both sides of the line.
    """

    def __init__(self, server: viser.ViserServer, name: str, colour: Colour) -> None:
        self._server, self._name, self._colour = server, name, colour
        self._nodes: list[Any] = []
        self._room = 0

    def show(self, segments: npt.NDArray[np.floating[Any]], radius: npt.NDArray[np.floating[Any]]) -> None:
        """Draw ``segments``, shape (n, 2, 3), with the radii (n,) [m]; call it inside ``server.atomic()``."""
        n = len(segments)
        if n == 0:
            self.hide()
            return
        if n > self._room:
            self.remove()
            self._room = 1 << (n - 1).bit_length()
            self._nodes = [self._node("core", self._colour, "front"), self._node("rim", HALO, "back")]
        places = tube_places(segments, radius, self._room)
        for node, wider in zip(self._nodes, (1.0, RIM_WIDER), strict=True):
            node.batched_positions, node.batched_wxyzs = places.position, places.quaternion
            node.batched_scales = places.scale * np.array([wider, wider, 1.0], dtype=np.float32)
            node.visible = True

    def hide(self) -> None:
        """Draw nothing."""
        for node in self._nodes:
            if node.visible:
                node.visible = False

    def remove(self) -> None:
        """Take the nodes off the page."""
        for node in self._nodes:
            node.remove()
        self._nodes, self._room = [], 0

    def _node(self, part: str, colour: Colour, side: Literal["front", "back"]) -> Any:
        mesh, none = trimesh.creation.cylinder(1.0, 1.0, TUBE_SIDES), hidden_poses(self._room)
        return self._server.scene.add_batched_meshes_simple(
            f"{self._name}/{part}",
            mesh.vertices,
            mesh.faces,
            batched_wxyzs=none.quaternion,
            batched_positions=none.position,
            batched_scales=np.zeros((self._room, 3), dtype=np.float32),
            batched_colors=linear(colour),
            lod="off",
            side=side,
            cast_shadow=False,
            receive_shadow=False,
        )


def tube_places(
    segments: npt.NDArray[np.floating[Any]], radius: npt.NDArray[np.floating[Any]], room: int
) -> InstancePoses:
    """Poses and scales (room, 3) that lay a cylinder of radius 1 and height 1 about z along each of ``segments``."""
    poses, n = hidden_poses(room), len(segments)
    along = segments[:, 1] - segments[:, 0]
    length = np.linalg.norm(along, axis=1)
    x, y, z = (along / np.where(length > 0.0, length, 1.0)[:, None]).T
    # Half way from z to the direction; for a direction straight down, half a turn about x.
    turn = np.column_stack([1.0 + z, -y, x, np.zeros(n)])
    turn[1.0 + z < 1e-9] = (0.0, 1.0, 0.0, 0.0)
    poses.position[:n] = segments.mean(axis=1)
    poses.quaternion[:n] = turn / np.linalg.norm(turn, axis=1, keepdims=True)
    scale = np.zeros((room, 3), dtype=np.float32)
    scale[:n] = np.column_stack([radius, radius, length])
    return InstancePoses(poses.position, poses.quaternion, scale)


def another_set_up(one: Scene, other: Scene) -> bool:
    """Whether bodies or rig differ: they are then drawn by other nodes, and their piles are not compared."""
    # Asked at every look at the pour, nearly always of one scene twice.
    return one != other and (actual(one).bodies, one.rig) != (actual(other).bodies, other.rig)


class BodyNodes:
    """Nodes of all bodies, below the node ``root``; none for a component without bodies."""

    def __init__(self, server: viser.ViserServer, kinds: Sequence[DrawnComponent], root: str = "") -> None:
        self._kinds = tuple(kinds)
        self._colours = np.array([linear(kind.colour) for kind in kinds], dtype=np.uint8).reshape(-1, 3)
        self.nodes: list[Any] = [
            _batch(server, f"{root}/bodies/{k}", kind) if kind.most > 0 else None for k, kind in enumerate(kinds)
        ]

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_] | None = None) -> None:
        """Move the bodies to their places in ``frame``; ``seen`` as in :func:`component_poses`."""
        for k, node, kind in self._there():
            _place(node, component_poses(frame, k, kind.most, seen))

    def plain(self, frame: Frame) -> npt.NDArray[np.uint8]:
        """Colours by component of the bodies of ``frame``, in the form that :meth:`paint` takes, shape (n, 3)."""
        # The last frame of the previous scene may hold more components than this one.
        return self._colours[frame.component % len(self._colours)]

    def paint(self, frame: Frame, colours: npt.NDArray[np.uint8]) -> None:
        """Give the bodies of ``frame`` their ``colours`` (n, 3), those of batched meshes (``style.linear``)."""
        for k, node, kind in self._there():
            chosen = np.flatnonzero(frame.component == k)[: kind.most]
            painted = _plain(kind)
            painted[: len(chosen)] = colours[chosen]
            node.batched_colors = painted

    def fade(self, opacity: float | None) -> None:
        """Opacity of the bodies; None: opaque."""
        for _, node, _ in self._there():
            node.opacity = opacity

    def clear(self) -> None:
        """Hide all bodies."""
        for _, node, kind in self._there():
            _place(node, hidden_poses(kind.most))

    def remove(self) -> None:
        """Take all nodes off the page."""
        for _, node, _ in self._there():
            node.remove()

    def _there(self) -> list[tuple[int, Any, DrawnComponent]]:
        pairs = enumerate(zip(self.nodes, self._kinds, strict=True))
        return [(k, node, kind) for k, (node, kind) in pairs if node is not None]


@dataclass(frozen=True, eq=False)
class DrawnComponent:
    """One component: its mesh, its colour, and its largest number of bodies."""

    mesh: BodyMesh
    colour: Colour
    most: int


class BodyMesh(Protocol):
    """Surface of a body in its own frame."""

    @property
    def vertices(self) -> npt.NDArray[Any]:
        """[m], shape (v, 3)."""

    @property
    def faces(self) -> npt.NDArray[Any]:
        """Indices of vertices, shape (f, 3)."""


def _batch(server: viser.ViserServer, name: str, kind: DrawnComponent) -> Any:
    none = hidden_poses(kind.most)
    return server.scene.add_batched_meshes_simple(
        name,
        kind.mesh.vertices,
        kind.mesh.faces,
        batched_wxyzs=none.quaternion,
        batched_positions=none.position,
        batched_scales=none.scale,
        batched_colors=_plain(kind),
        lod="off" if kind.most <= FINE else "auto",
    )


def _plain(kind: DrawnComponent) -> npt.NDArray[np.uint8]:
    return np.tile(np.array(linear(kind.colour), dtype=np.uint8), (kind.most, 1))


def _place(node: Any, poses: InstancePoses) -> None:
    node.batched_positions = poses.position
    node.batched_wxyzs = poses.quaternion
    node.batched_scales = poses.scale


@dataclass(frozen=True)
class InstancePoses:
    """Instances of one component in viser's form; bodies that are not in the scene have scale 0."""

    position: npt.NDArray[np.float32]
    """[m], shape (n, 3)."""
    quaternion: npt.NDArray[np.float32]
    """wxyz, shape (n, 4)."""
    scale: npt.NDArray[np.float32]
    """Size of a body relative to its mesh, or 0, shape (n,); of a tube (n, 3)."""


def component_poses(frame: Frame, component: int, n: int, seen: npt.NDArray[np.bool_] | None = None) -> InstancePoses:
    """Poses of the bodies of one component, ``n`` of which will enter in all, in order of entry.

    Those that are not ``seen``, shape (bodies of the frame,), are hidden; by default those that have left the domain.
    """
    seen = frame.inside if seen is None else seen
    poses = hidden_poses(n)
    chosen = np.flatnonzero(frame.component == component)[:n]
    poses.position[: len(chosen)] = frame.position[chosen]
    poses.quaternion[: len(chosen)] = frame.quaternion[chosen]
    poses.scale[: len(chosen)] = np.where(seen[chosen], frame.scale[chosen], 0.0)
    return poses


def hidden_poses(n: int) -> InstancePoses:
    """``n`` hidden instances."""
    quaternion = np.zeros((n, 4), dtype=np.float32)
    quaternion[:, 0] = 1.0
    return InstancePoses(np.zeros((n, 3), dtype=np.float32), quaternion, np.zeros(n, dtype=np.float32))


def rig_nodes(server: viser.ViserServer, scene: Scene, root: str = "") -> dict[str, Any]:
    """Nodes of the rig's surfaces by name, with the rims of shells."""
    nodes: dict[str, Any] = {}
    poses, rims = rig_poses(scene.rig), rim_circles(scene.rig)
    for (name, mesh), pose in zip(rig_triangles(scene.rig).items(), poses, strict=True):
        clear = name != PLATE_NAME
        nodes[name] = server.scene.add_mesh_simple(
            f"{root}/rig/{name}",
            mesh.vertices,
            mesh.faces,
            color=GLASS if clear else PLATE,
            opacity=OPACITY.get(name, CLEAR) if clear else None,
            **drawn(name),
            visible=name != GATE_NAME,
            position=pose[:3],
            wxyz=pose[3:],
        )
        if name in rims:
            ends = np.concatenate([circle(radius, height) for radius, height in rims[name]])
            # Below the surface's node: it moves, and goes, with that.
            server.scene.add_line_segments(f"{root}/rig/{name}/rims", ends, RIM, thickness=LINE)
    return nodes


def drawn(name: str) -> dict[str, Any]:
    """How a surface of the rig is drawn.

    The plate fills much of the picture; without a graphics card it would take more time than all the rest. So only its
    upper side is drawn, evenly lit.
    """
    if name == PLATE_NAME:
        return {"side": "front", "material": "toon3", "cast_shadow": False, "receive_shadow": True}
    return {"side": "double", "cast_shadow": False, "receive_shadow": False}


def seen_through(name: str) -> bool:
    """Whether a surface of the rig fades as a person wants it: all but the plate, and those with their own opacity."""
    return name != PLATE_NAME and name not in OPACITY


def circle(radius: float, height: float) -> Array:
    """A horizontal circle about the z axis as line segments [m], shape (CORNERS, 2, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(CORNERS + 1, height)])
    return np.stack([points[:-1], points[1:]], axis=1)
