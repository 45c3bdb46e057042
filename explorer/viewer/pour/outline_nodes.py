"""The lines of the flanks, and a measured curve, in 3-D: in the upright plane through the axis that the view shows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from explorer.files.measured_curves import MeasuredCurve
from explorer.viewer.palette import FLANK, MEASURED, Colour
from explorer.viewer.pour.outline_svg import corners_of
from solver.observables.repose import AZIMUTHS_DEG, Outline

Array = npt.NDArray[np.float64]

THICKNESS = 1.5e-3
"""Of the lines [m]."""
NOWHERE: Array = np.zeros((1, 2, 3))


class OutlineNodes:
    """Two nodes: the fitted lines and the measured curve."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._flanks = _node(server, "/fit/flanks", FLANK)
        self._measured = _node(server, "/fit/measured", MEASURED)

    def show(self, outline: Outline | None, measured: MeasuredCurve | None, wanted: bool) -> None:
        """Draw what there is, or nothing unless ``wanted``; call it inside ``server.atomic()``."""
        _draw(self._flanks, flank_segments(outline) if wanted else NOWHERE[:0])
        _draw(self._measured, measured_segments(measured) if wanted else NOWHERE[:0])


def flank_segments(outline: Outline | None) -> Array:
    """Ends of the fitted lines in the world [m], shape (n, 2, 3) with n = 0 … 2."""
    if outline is None:
        return NOWHERE[:0]
    ends = [in_world(np.array(line.u), np.array(line.z), outline.azimuth_deg) for line in outline.flanks if line]
    return np.array(ends).reshape(-1, 2, 3)


def measured_segments(measured: MeasuredCurve | None) -> Array:
    """The measured curve as segments [m], shape (n, 2, 3)."""
    if measured is None or len(measured.u) < 2:
        return NOWHERE[:0]
    points = in_world(*corners_of(measured.u, measured.z), AZIMUTHS_DEG[0])
    return np.stack([points[:-1], points[1:]], axis=1)


def in_world(u: Array, z: Array, azimuth_deg: float) -> Array:
    """Points of a view in the upright plane through the z axis [m], shape (n, 3)."""
    angle = math.radians(azimuth_deg)
    return np.column_stack([u * math.cos(angle), u * math.sin(angle), z])


def _node(server: viser.ViserServer, name: str, colour: Colour) -> Any:
    return server.scene.add_line_segments(name, NOWHERE, colour, thickness=THICKNESS, visible=False)


def _draw(node: Any, segments: Array) -> None:
    visible = len(segments) > 0
    if visible and (
        node.points.shape != segments.shape or not np.array_equal(node.points, segments.astype(np.float32))
    ):
        # The node keeps its one colour: colours per point, sent later, come out white.
        node.points = segments.astype(np.float32)
    if node.visible != visible:
        node.visible = visible
