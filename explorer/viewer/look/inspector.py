"""One body as text: what it is, where it is, what it touches and how hard."""

from __future__ import annotations

from html import escape

import numpy as np
import numpy.typing as npt

from explorer.live.details import Details
from explorer.live.frames import Frame
from solver.scenes.scene import Scene

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
    """The whole panel; ``body`` by its order of entry, None for nobody."""
    if body is None:
        return f"{STYLE}<div class='body dim'>{NOBODY}</div>"
    lines = "".join(
        f"<div class='line'><span class='dim'>{name}</span><span>{text}</span></div>"
        for name, text in readings(scene, frame, details, body)
    )
    table = "" if details is None else contacts_html(scene, frame, details, body)
    return f"{STYLE}<div class='body'>{lines}{table}</div>"


def readings(scene: Scene, frame: Frame, details: Details | None, body: int) -> list[tuple[str, str]]:
    """Names and texts of what is known of ``body``; texts are HTML."""
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
        ("Sum of its normal forces", f"{1e3 * details.load[body]:.3g} mN"),
        ("Coordination number", str(int(details.neighbours[body]))),
    ]


def contacts_html(scene: Scene, frame: Frame, details: Details, body: int) -> str:
    """Table of the contacts of ``body``, the strongest first."""
    mine = np.flatnonzero((details.body == body) | (details.partner == body))
    if len(mine) == 0:
        return "<div class='dim'>It touches nothing.</div>"
    order = mine[np.argsort(-np.abs(details.normal_force[mine]), kind="stable")]
    rows = "".join(
        f"<tr><td>{partner_name(scene, frame, details, contact, body)}</td>"
        f"<td>{1e3 * details.normal_force[contact]:.3g}</td><td>{1e3 * details.tangential_force[contact]:.3g}</td></tr>"
        for contact in order[:CONTACTS_SHOWN]
    )
    more = len(order) - CONTACTS_SHOWN
    rest = f"<div class='dim'>and {more} weaker ones</div>" if more > 0 else ""
    return f"<table><tr><th>Touches</th><th>normal [mN]</th><th>tangential [mN]</th></tr>{rows}</table>{rest}"


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
