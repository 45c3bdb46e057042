"""One body under inspection: which one a click hits, what and where it is, what it touches and with which force.

viser can report which instance of a mesh was clicked, but it draws a hull of ten pixels around whatever the mouse is
over, which hides small bodies, and does not report clicks beside them. So the ray of the click is intersected here
with the surfaces as they are drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
import numpy.typing as npt

from explorer.live.details import Details
from explorer.live.frames import Frame
from explorer.scene.meshes import Triangles
from solver.scenes.insertion import rotation_matrix
from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]

NOBODY = "Click a body, or press N, to see what it is, where it goes and what it touches."
CONTACTS_SHOWN = 12

STYLE = """<style>
.body {padding: 0.2em 0.9em; font-size: 0.82em; line-height: 1.45; font-variant-numeric: tabular-nums;}
.body .line {display: flex; justify-content: space-between;}
.body .dim {opacity: 0.65;}
.body table {width: 100%; border-spacing: 0;} .body td + td, .body th + th {text-align: right;}
.body th {font-weight: 400; opacity: 0.65; text-align: left;}
</style>"""


def body_html(scene: Scene, frame: Frame, details: Details | None, body: int | None) -> str:
    """The whole panel; ``body`` by its order of entry, None for none."""
    if body is None:
        return f"{STYLE}<div class='body dim'>{NOBODY}</div>"
    lines = "".join(
        f"<div class='line'><span class='dim'>{name}</span><span>{text}</span></div>"
        for name, text in readings(scene, frame, details, body)
    )
    table = "" if details is None else contacts_html(scene, frame, details, body)
    return f"{STYLE}<div class='body'>{lines}{table}</div>"


def readings(scene: Scene, frame: Frame, details: Details | None, body: int) -> list[tuple[str, str]]:
    """Names and texts of what is known about ``body``; texts are HTML."""
    found = [
        ("Kind", f"{name_of(scene, frame, body)} of {len(frame.component)}"),
        ("Position", f"{vector(1e3 * frame.position[body], '.1f')} mm"),
    ]
    if details is None or body >= len(details.mass):
        return found
    velocity = details.velocity[body]
    return [
        found[0],
        ("Mass", f"{1e3 * details.mass[body]:.4g} g"),
        found[1],
        ("Velocity", f"{vector(velocity, '.3f')} m/s"),
        ("Speed", f"{np.linalg.norm(velocity):.3g} m/s"),
        ("Entered at", f"{details.entered[body]:.3f} s"),
        ("Sum of its normal forces", force(details.load[body])),
        ("Coordination number", str(int(details.neighbours[body]))),
    ]


def force(newtons: float) -> str:
    """A force in mN, from one newton in N."""
    return f"{newtons:.3g} N" if abs(newtons) >= 1.0 else f"{1e3 * newtons:.3g} mN"


def contacts_html(scene: Scene, frame: Frame, details: Details, body: int) -> str:
    """Table of the contacts of ``body``, the strongest first."""
    mine = np.flatnonzero((details.body == body) | (details.partner == body))
    if len(mine) == 0:
        return "<div class='dim'>It touches nothing.</div>"
    order = mine[np.argsort(-np.abs(details.normal_force[mine]), kind="stable")]
    rows = "".join(
        f"<tr><td>{partner_name(scene, frame, details, contact, body)}</td>"
        f"<td>{force(details.normal_force[contact])}</td><td>{force(details.tangential_force[contact])}</td></tr>"
        for contact in order[:CONTACTS_SHOWN]
    )
    more = len(order) - CONTACTS_SHOWN
    rest = f"<div class='dim'>and {more} weaker ones</div>" if more > 0 else ""
    return f"<table><tr><th>Touches</th><th>normal</th><th>tangential</th></tr>{rows}</table>{rest}"


def partner_name(scene: Scene, frame: Frame, details: Details, contact: int, body: int) -> str:
    """The other side of a contact of ``body``, as HTML."""
    one, other = int(details.body[contact]), int(details.partner[contact])
    partner = one if other == body else other
    if partner < 0:
        return escape(scene.rig.surface_names[-1 - partner].replace("_", " "))
    return name_of(scene, frame, partner)


def name_of(scene: Scene, frame: Frame, body: int) -> str:
    """A body's kind and its number in the order of entry, from 1, as HTML."""
    if body >= len(frame.component):
        return f"no. {body + 1}"
    return f"{escape(scene.bodies[int(frame.component[body])].name)} no. {body + 1}"


def vector(numbers: npt.NDArray[np.floating], form: str) -> str:
    """Three numbers in a row."""
    return ", ".join(f"{float(number):{form}}" for number in numbers)


def nearest_hit(
    meshes: Sequence[Triangles], frame: Frame, seen: npt.NDArray[np.bool_], origin: Array, direction: Array
) -> int | None:
    """Body of ``frame`` that a ray hits first, by its order of entry; None if it hits none in sight.

    Args:
        meshes: surface of a body of each component.
        frame: where the bodies are.
        seen: which of them are drawn, shape (n,).
        origin: origin of the ray [m], shape (3,).
        direction: its direction, of any length, shape (3,).
    """
    length = float(np.linalg.norm(direction))
    if not (np.isfinite(origin).all() and np.isfinite(length) and length > 0.0):
        return None
    direction = direction / length
    best, nearest = None, np.inf
    for b in _in_the_way(meshes, frame, seen, origin, direction):
        turn, size = rotation_matrix(frame.quaternion[b].astype(float)), float(frame.scale[b])
        # In the frame of the mesh, the distance along the ray is the same, because the direction is scaled too.
        start = (origin - frame.position[b]) @ turn / size
        mesh = meshes[int(frame.component[b])]
        distance = first_crossing(mesh.vertices[mesh.faces].astype(float), start, direction @ turn / size)
        if distance < nearest:
            best, nearest = int(b), distance
    return best


def _in_the_way(
    meshes: Sequence[Triangles], frame: Frame, seen: npt.NDArray[np.bool_], origin: Array, direction: Array
) -> npt.NDArray[np.int64]:
    """Bodies in sight whose bounding sphere the ray crosses."""
    radii = np.array([np.linalg.norm(mesh.vertices, axis=1).max() for mesh in meshes])
    reach = radii[frame.component] * frame.scale
    towards = frame.position - origin
    along = towards @ direction
    aside = np.linalg.norm(towards - along[:, None] * direction, axis=1)
    return np.flatnonzero(seen & (aside <= reach) & (along > -reach))


def first_crossing(triangles: Array, origin: Array, direction: Array) -> float:
    """Distance along a ray, in lengths of ``direction``, to the first of ``triangles`` (k, 3, 3); infinite if none.

    Möller & Trumbore 1997, Journal of Graphics Tools 2:21.
    """
    corner = triangles[:, 0]
    one, two = triangles[:, 1] - corner, triangles[:, 2] - corner
    across = np.cross(direction, two)
    determinant = np.einsum("ij,ij->i", one, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        from_corner = origin - corner
        u = np.einsum("ij,ij->i", from_corner, across) / determinant
        other = np.cross(from_corner, one)
        v = (other @ direction) / determinant
        t = np.einsum("ij,ij->i", two, other) / determinant
        hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
    return float(t[hit].min()) if hit.any() else np.inf
