"""From settings to nodes: frames are drawn as the user wants them, and what has not changed is left alone."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt
import viser

from explorer.live.frames import Frame
from explorer.viewer.look.colour_by import ColourQuantity, Numbered, body_colours
from explorer.viewer.look.look import Look
from explorer.viewer.scene_nodes import BodyNodes
from explorer.viewer.view import light

GHOST = 0.22
"""Opacity of bodies while force chains are drawn through them."""


class DrawnNodes(Protocol):
    """Bodies and rig of a live pour or of a recording."""

    bodies: BodyNodes

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_] | None = None) -> None:
        """Move everything to its place in ``frame``."""

    def fade(self, opacity: float) -> None:
        """Set the opacity of the surfaces that one has to look through."""


class DrawnLook:
    """What is on the page at present. Call its methods inside ``server.atomic()``."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._moved_for: object = None
        self._painted_for: object = None
        self._faded_for: object = None
        self._shadows = True

    def move(self, nodes: DrawnNodes, frame: Frame, look: Look, seen: npt.NDArray[np.bool_]) -> bool:
        """Draw the bodies that are ``seen``, shape (n,), where ``frame`` has them; True if anything had to be done."""
        moved = (id(nodes), frame.number, look.cut_away, look.cut_at)
        if moved == self._moved_for:
            return False
        self._moved_for = moved
        nodes.show(frame, seen)
        return True

    def paint(
        self,
        nodes: DrawnNodes,
        frame: Frame,
        look: Look,
        quantity: ColourQuantity | None,
        details: Numbered | None,
        selected: int | None = None,
    ) -> None:
        """Set colours as in :func:`body_colours`, opacities and shadows."""
        values = details.number if details is not None and quantity is not None else 0
        colours = (look.colour_by, look.automatic, look.logarithmic, look.low, look.high)
        painted = (id(nodes), frame.generation, len(frame.component), colours, values, selected)
        if painted != self._painted_for:
            self._painted_for = painted
            plain = nodes.bodies.plain(frame)
            nodes.bodies.paint(frame, body_colours(plain, look, quantity, details, selected))
        faded = (id(nodes), look.chains, look.rig_opacity)
        if faded != self._faded_for:
            self._faded_for = faded
            nodes.bodies.fade(GHOST if look.chains else None)
            nodes.fade(look.rig_opacity)
        if look.shadows != self._shadows:
            self._shadows = look.shadows
            light(self._server, look.shadows)
