"""A pile from the side: silhouette, lines of the flanks, and what was measured, as SVG in HTML and in the 3-D view.

In 3-D the lines of the flanks and the measured curve lie in the upright plane through the axis that the view shows.
"""

from __future__ import annotations

import math
from html import escape

import numpy as np
import numpy.typing as npt
import viser

from explorer.files.measured_curves import MeasuredCurve
from explorer.viewer.palette import CORE, FLANK, MEASURED, css
from explorer.viewer.scene_nodes import Tubes
from explorer.viewer.view import small_html
from solver.observables.repose import AZIMUTHS_DEG, FlankLine, Flanks, Outline

Array = npt.NDArray[np.float64]

MM = 1e3
MARGIN = 4.0
"""Margin around the drawing [mm]."""
LEAST_WIDTH, LEAST_HEIGHT = 60.0, 15.0
"""Least size of what is drawn [mm], so that a single body is not drawn large."""
SCALE_BAR = 20.0
"""Length of the scale bar [mm]."""
WAITING = "The silhouette is drawn once there is a pile below the outlet."
FLANK_RADIUS, MEASURED_RADIUS = 8e-4, 6e-4
"""Radii of the lines in 3-D [m]."""
NOWHERE: Array = np.zeros((0, 2, 3))


def outline_html(outline: Outline | None, measured: MeasuredCurve | None) -> str:
    """The drawing with its caption; in words if there is nothing to draw yet."""
    parts = [] if outline is None and measured is None else [outline_svg(outline, measured)]
    lines = [WAITING if outline is None else f"View along +y: {flank_words(outline.flanks)}."]
    if measured is not None:
        fitted = f": {flank_words(measured.flanks)}" if any(measured.flanks) else ""
        lines.append(f"<span style='color:{css(MEASURED)}'>Dashed: measured, {escape(measured.name)}{fitted}.</span>")
    return small_html(f"{''.join(parts)}<div>{'<br>'.join(lines)}</div>")


def flank_words(flanks: Flanks) -> str:
    """Angles of both flanks [°] in words."""
    left, right = ("no fit" if flank is None else f"{flank.angle_deg:.1f}°" for flank in flanks)
    return f"left {left}, right {right}"


def outline_svg(outline: Outline | None, measured: MeasuredCurve | None) -> str:
    """The drawing alone; one unit is a millimetre, and both axes have the same scale."""
    curves = [] if outline is None else [(outline.u, outline.top)]
    curves += [] if measured is None else [(measured.u, measured.z)]
    # Empty columns of pixels between the pile and a stray body take no room.
    covered = [(MM * u[z > 0], MM * z[z > 0]) for u, z in curves if (z > 0).any()]
    reach = max([LEAST_WIDTH / 2.0, *(float(np.abs(u).max()) for u, _ in covered)]) + MARGIN
    top = max([LEAST_HEIGHT, *(float(z.max()) for _, z in covered)]) + MARGIN
    drawn = [f"<line x1='{-reach:.1f}' y1='0' x2='{reach:.1f}' y2='0' stroke='currentColor' stroke-width='0.3'/>"]
    if outline is not None and len(outline.u):
        u, z = corners_of(outline.u, outline.top)
        # Closed along the plate.
        corners = _points(np.array([u[0], *u, u[-1]]), np.array([0.0, *z, 0.0]))
        drawn.append(f"<polygon points='{corners}' fill='currentColor' fill-opacity='0.22'/>")
    if measured is not None and len(measured.u):
        corners = _points(*corners_of(measured.u, measured.z))
        drawn.append(
            f"<polyline points='{corners}' fill='none' stroke='{css(MEASURED)}' stroke-width='0.6' "
            "stroke-dasharray='1.6 1'/>"
        )
    if outline is not None:
        drawn += [_flank(line) for line in outline.flanks if line is not None]
    drawn.append(_scale_bar(reach, top))
    return (
        f"<svg viewBox='{-reach:.1f} {-top:.1f} {2 * reach:.1f} {top + 2.0:.1f}' style='width:100%; display:block' "
        f"role='img' aria-label='Silhouette of the pile'>{''.join(drawn)}</svg>"
    )


def corners_of(u: Array, z: Array) -> tuple[Array, Array]:
    """The points at which a curve of columns turns, ends included: a tenth of them, and the same line."""
    if len(u) < 3:
        return u, z
    level = (z[1:-1] == z[:-2]) & (z[1:-1] == z[2:])
    kept = np.concatenate([[True], ~level, [True]])
    return u[kept], z[kept]


def _points(u: Array, z: Array) -> str:
    return " ".join(f"{MM * x:.2f},{-MM * y:.2f}" for x, y in zip(u, z, strict=True))


def _flank(line: FlankLine) -> str:
    (u0, u1), (z0, z1) = line.u, line.z
    return (
        f"<line x1='{MM * u0:.2f}' y1='{-MM * z0:.2f}' x2='{MM * u1:.2f}' y2='{-MM * z1:.2f}' stroke='{css(FLANK)}' "
        "stroke-width='0.9' stroke-linecap='round'/>"
    )


def _scale_bar(reach: float, top: float) -> str:
    left, height = -reach + 1.0, -top + 3.5
    return (
        f"<line x1='{left:.1f}' y1='{height:.1f}' x2='{left + SCALE_BAR:.1f}' y2='{height:.1f}' "
        f"stroke='currentColor' stroke-width='0.5'/><text x='{left:.1f}' y='{height - 0.8:.1f}' "
        f"font-size='3' fill='currentColor'>{SCALE_BAR:g} mm</text>"
    )


class OutlineNodes:
    """The fitted lines, white, and the measured curve, both with a dark rim."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._flanks = Tubes(server, "/fit/flanks", CORE)
        self._measured = Tubes(server, "/fit/measured", MEASURED)

    def show(self, outline: Outline | None, measured: MeasuredCurve | None, wanted: bool) -> None:
        """Draw what there is, or nothing unless ``wanted``; call it inside ``server.atomic()``."""
        flanks, curve = (flank_segments(outline), measured_segments(measured)) if wanted else (NOWHERE, NOWHERE)
        self._flanks.show(flanks, np.full(len(flanks), FLANK_RADIUS))
        self._measured.show(curve, np.full(len(curve), MEASURED_RADIUS))


def flank_segments(outline: Outline | None) -> Array:
    """Ends of the fitted lines in the world [m], shape (n, 2, 3) with n = 0 … 2."""
    if outline is None:
        return NOWHERE
    ends = [in_world(np.array(line.u), np.array(line.z), outline.azimuth_deg) for line in outline.flanks if line]
    return np.array(ends).reshape(-1, 2, 3)


def measured_segments(measured: MeasuredCurve | None) -> Array:
    """The measured curve as segments [m], shape (n, 2, 3)."""
    if measured is None or len(measured.u) < 2:
        return NOWHERE
    points = in_world(*corners_of(measured.u, measured.z), AZIMUTHS_DEG[0])
    return np.stack([points[:-1], points[1:]], axis=1)


def in_world(u: Array, z: Array, azimuth_deg: float) -> Array:
    """Points of a view in the upright plane through the z axis [m], shape (n, 3)."""
    angle = math.radians(azimuth_deg)
    return np.column_stack([u * math.cos(angle), u * math.sin(angle), z])
