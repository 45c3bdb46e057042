"""Force chains: lines from centre to centre through the contacts that press hardest, and their controls."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from explorer.live.details import Details
from explorer.live.frames import Frame
from explorer.units import checked
from explorer.viewer.actions import Post, add_keys
from explorer.viewer.look.look import Look
from explorer.viewer.look.look_settings import LookSettings
from explorer.viewer.palette import CHAINS

Segments = npt.NDArray[np.float32]

STRONGER = (1.0, 2.0, 4.0)
"""Where the classes of force begin, as multiples of the threshold."""
THICKNESS = (6e-4, 1.2e-3, 2.4e-3)
"""Thickness of the lines of each class [m]."""
LEAST_SHARE = 1e-9
"""Contacts that do not press at all are no part of a chain, even with a threshold of 0 (share of the mean force)."""
CHAINS_KEY, FORCE_CHAINS = "K", "Force chains"
MOST_TIMES_MEAN = 5.0
"""Largest threshold that can be chosen, in mean forces."""


class ForceChains:
    """One node of lines per class of force."""

    def __init__(self, server: viser.ViserServer) -> None:
        nowhere = np.zeros((1, 2, 3), dtype=np.float32)
        self._nodes: list[Any] = [
            server.scene.add_line_segments(f"/forces/{k}", nowhere, colour, thickness=thickness, visible=False)
            for k, (colour, thickness) in enumerate(zip(CHAINS, THICKNESS, strict=True))
        ]

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_], details: Details, threshold: float) -> None:
        """Draw the contacts of bodies in sight; call it inside ``server.atomic()``."""
        for node, segments in zip(self._nodes, chain_segments(frame, seen, details, threshold), strict=True):
            if len(segments):
                node.points = segments
            node.visible = len(segments) > 0

    def hide(self) -> None:
        """Draw nothing."""
        for node in self._nodes:
            node.visible = False


def chain_segments(
    frame: Frame, seen: npt.NDArray[np.bool_], details: Details, threshold: float
) -> tuple[Segments, ...]:
    """Lines (k, 2, 3) [m] of each class: contacts with |F_n| ≥ ``threshold`` · mean, from the centres to the point.

    Contacts of bodies that are not ``seen``, shape (n,), are left out; a contact with the rig has one line.
    """
    strength = np.abs(details.normal_force)
    n, between = len(frame.position), details.partner >= 0
    there = (details.body < n) & (details.partner < n)
    there &= seen[np.where(there, details.body, 0)] & (~between | seen[np.where(there & between, details.partner, 0)])
    edges = [weakest(details, threshold) * factor for factor in STRONGER] + [np.inf]
    classes = []
    for low, high in pairwise(edges):
        mine = there & (strength >= low) & (strength < high)
        both = mine & between
        ends = [
            np.stack([frame.position[details.body[mine]], details.point[mine]], axis=1),
            np.stack([details.point[both], frame.position[details.partner[both]]], axis=1),
        ]
        classes.append(np.concatenate(ends).astype(np.float32))
    return tuple(classes)


def weakest(details: Details, threshold: float) -> float:
    """Normal force of the weakest contact that is drawn [N]."""
    return max(threshold, LEAST_SHARE) * details.mean_force


def chain_text(details: Details | None, look: Look) -> str:
    """What the lines mean, in a line of text."""
    if not look.chains:
        return ""
    if details is None or details.touching == 0:
        return "No contacts yet."
    low = weakest(details, look.threshold)
    drawn = int((np.abs(details.normal_force) >= low).sum())
    return (
        f"Lines: normal force from {1e3 * low:.3g} mN on; thicker from {2e3 * low:.3g} and {4e3 * low:.3g} mN. "
        f"{drawn} of {details.touching} contacts; their mean is {1e3 * details.mean_force:.3g} mN."
    )


class ForcePanel:
    """Changes ``settings``, and says what the lines mean."""

    def __init__(self, server: viser.ViserServer, settings: LookSettings, post: Post) -> None:
        self._settings, gui = settings, server.gui
        with gui.add_folder("Forces"):
            self._chains = gui.add_checkbox(
                FORCE_CHAINS, False, hint=f"Lines through the contacts that press hardest. Key {CHAINS_KEY}."
            )
            self._threshold = gui.add_slider(
                "From × mean force", 0.0, MOST_TIMES_MEAN, 0.1, 1.0, hint="Weakest contact that is drawn."
            )
            self._text = gui.add_markdown("")
        settings.bind(self._chains, lambda look: look.chains, lambda sent: {"chains": sent is True})
        settings.bind(
            self._threshold,
            lambda look: look.threshold,
            lambda sent: {"threshold": checked(sent, 0.0, MOST_TIMES_MEAN, "threshold")},
        )
        add_keys(
            gui,
            {FORCE_CHAINS: lambda: settings.change(chains=not settings.look.chains)},
            {FORCE_CHAINS: CHAINS_KEY},
            post,
        )

    def show(self, details: Details | None) -> None:
        """Say what the lines mean; call it inside ``server.atomic()``."""
        lines = chain_text(details, self._settings.look)
        if self._text.content != lines:
            self._text.content = lines
