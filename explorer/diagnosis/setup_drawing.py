"""The rig of a follow-up, cut open and to scale, with what is set otherwise in another colour."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from xml.sax.saxutils import escape

from explorer.units import number, parameter_label, parameter_value
from solver import Scene, parameters, pour_rig, value
from solver.rigs.surface import Revolved, SurfacePose

PROTOCOLS = {
    "pour_through": "the outlet open from the start",
    "fill_then_open": "filled with the outlet closed, left to settle, then opened",
}
DRAWN, EDGE, LEFT = 420.0, 40.0, 200.0
"""Height of the drawn rig, and the free margins around it and to its left [px]."""
INK, CHANGED = "#222222", "#c2410c"
THIN, DASHED = 'stroke-width="1"', 'stroke-width="1" stroke-dasharray="6 4"'
DIMENSIONS = {
    "outlet_height": "upright",
    "cylinder_height": "upright",
    "outlet_diameter": "outlet",
    "inlet_diameter": "top",
    "diameter": "top",
}
"""Dimensions of rigs that are drawn, and where: up from the plate, below the outlet, above the feed."""


def setup_svg(scene: Scene, changed: Mapping[str, float | str]) -> str:
    """Cross-section of the rig of ``scene`` to scale, the parameters ``changed`` in another colour.

    Empty for a rig without upright walls of revolution about its axis.
    """
    rig, fed, known = pour_rig(scene), scene.insertion, parameters(scene)
    shells: dict[bool, list[Revolved]] = {False: [], True: []}
    for name, one in zip(rig.surface_names, rig.surfaces(), strict=True):
        if isinstance(one, Revolved) and one.pose == SurfacePose():
            shells[name == "gate"].append(one)
    if not shells[False]:
        return ""
    size = {name: float(value(scene, f"rig.{name}")) for name in DIMENSIONS if f"rig.{name}" in known}
    reach = max(fed.region_radius, *(max(wall.r0, wall.r1) for wall in shells[False]))
    floor, ceiling = rig.feed().floor, rig.feed().floor + fed.region_height
    scale = DRAWN / ceiling
    middle, ground, side = LEFT + reach * scale, 2.0 * EDGE + DRAWN, reach + EDGE / scale
    width, height = 2.0 * middle, ground + 3.0 * EDGE

    def line(r0: float, z0: float, r1: float, z1: float, paint: str = INK, more: str = 'stroke-width="2"') -> str:
        x0, y0, x1, y1 = middle + r0 * scale, ground - z0 * scale, middle + r1 * scale, ground - z1 * scale
        return f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" stroke="{paint}" {more}/>'

    def text(r: float, z: float, down: float, words: str, path: str = "", anchor: str = "middle") -> str:
        """Text at radius and height [m], moved ``down`` by that many pixels."""
        x, y = middle + r * scale, ground - z * scale + down
        return f'<text x="{x:.1f}" y="{y:.1f}" fill="{paint(path)}" text-anchor="{anchor}">{escape(words)}</text>'

    def paint(path: str) -> str:
        return CHANGED if path in changed else INK

    def measure(name: str, r0: float, z0: float, r1: float, z1: float) -> str:
        """A dimension line with a tick at both ends."""
        colour, tick = paint(f"rig.{name}"), 5.0 / scale
        ends = [line(r - tick, z - tick, r + tick, z + tick, colour, THIN) for r, z in ((r0, z0), (r1, z1))]
        return line(r0, z0, r1, z1, colour, THIN) + "".join(ends)

    drawn = [line(-side, 0.0, side, 0.0), text(side + 10.0 / scale, 0.0, 4.0, "plate", anchor="start")]
    drawn += [line(s * wall.r0, wall.z0, s * wall.r1, wall.z1) for wall in shells[False] for s in (-1.0, 1.0)]
    if fed.protocol == "fill_then_open":
        closed = paint("insertion.protocol")
        drawn += [line(s * one.r0, one.z0, s * one.r1, one.z1, closed) for one in shells[True] for s in (-1.0, 1.0)]
    r, rim = fed.region_radius, shells[False][0].r0
    corners = [(-r, floor), (-r, ceiling), (r, ceiling), (r, floor), (-r, floor)]
    drawn += [line(*a, *b, more=DASHED) for a, b in pairwise(corners)]
    for down, path in ((-6.0, "insertion.rate"), (12.0, "insertion.drop_speed")):
        words = parameter_value(path, float(value(scene, path)))
        drawn.append(text(0.0, (floor + ceiling) / 2.0, down, f"feed {words}" if down < 0.0 else f"at {words}", path))
    for name, length in size.items():
        path, half = f"rig.{name}", length / 2.0
        words, colour = f"{parameter_label(path)} {millimetres(length)}", paint(path)
        match DIMENSIONS[name]:
            case "upright":
                drawn += [measure(name, -side, 0.0, -side, length), line(-side, length, -rim, length, colour, DASHED)]
                drawn += [text(-side - 10.0 / scale, half, 4.0, words, path, "end")]
            case "outlet":
                low = size["outlet_height"] - 14.0 / scale
                drawn += [
                    measure(name, -half, low, half, low),
                    text(half + 10.0 / scale, low, 4.0, words, path, "start"),
                ]
            case "top":
                high = ceiling + 14.0 / scale
                drawn += [measure(name, -half, high, half, high), text(0.0, high, -8.0, words, path)]
                drawn += [line(r, floor, r, high, colour, DASHED) for r in (-half, half)]
    if "rig.mass" in known:
        mass = parameter_value("rig.mass", float(value(scene, "rig.mass")))
        drawn.append(text(0.0, 0.0, EDGE, f"poured: {mass}", "rig.mass"))
    if (lift := "rig.lift_speed") in known:
        words = f"lifted at {parameter_value(lift, float(value(scene, lift)))}"
        drawn.append(text(side + 10.0 / scale, 0.0, 20.0, words, lift, anchor="start"))
    if (until := "numerics.duration") in changed:
        words = f"read at {parameter_value(until, scene.numerics.duration)}"
        drawn.append(text(side + 10.0 / scale, 0.0, 36.0, words, until, anchor="start"))
    drawn.append(text(0.0, 0.0, 1.6 * EDGE, PROTOCOLS[fed.protocol], "insertion.protocol"))
    if changed:
        drawn.append(text(0.0, 0.0, 2.3 * EDGE, "in this colour: what is set otherwise", next(iter(changed))))
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="sans-serif" font-size="13">'
    )
    return "\n".join([head, '<rect width="100%" height="100%" fill="#ffffff"/>', *drawn, "</svg>"]) + "\n"


def millimetres(length: float) -> str:
    """A length [m] in mm, with four digits."""
    return f"{number(1e3 * length, 4)} mm"
