"""Force chains: lines from centre to centre through the contacts with the largest forces, and their controls."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import viser

from explorer.live.details import Details
from explorer.live.frames import Frame
from explorer.units import checked
from explorer.viewer.actions import Post, add_keys
from explorer.viewer.look.colour_by import key_html, nice_top
from explorer.viewer.look.look import Look
from explorer.viewer.look.look_settings import LookSettings
from explorer.viewer.palette import CORE
from explorer.viewer.scene_nodes import Tubes

Array = npt.NDArray[np.float64]
Segments = npt.NDArray[np.float32]

MN = 1e3
"""Millinewtons per newton."""

THICKEST, THINNEST = 1.6e-3, 2e-4
"""Radius [m] of the line of a contact at the upper end of the key, and the smallest radius."""
LEAST_SHARE = 1e-9
"""Contacts without pressure do not belong to a chain, even with a threshold of 0 (share of the mean force)."""
CHAINS_KEY, FORCE_CHAINS = "K", "Force chains"
MOST_TIMES_MEAN = 5.0
"""Largest threshold that can be chosen, in mean forces."""


class ForceChains:
    """Tubes whose thickness shows the contact force."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._tubes = Tubes(server, "/forces", CORE)

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_], details: Details, threshold: float) -> None:
        """Draw the contacts of bodies in sight; call it inside ``server.atomic()``."""
        segments, force = chain_segments(frame, seen, details, threshold)
        self._tubes.show(segments, chain_radii(force, details, threshold))

    def hide(self) -> None:
        """Draw nothing."""
        self._tubes.hide()


def chain_segments(
    frame: Frame, seen: npt.NDArray[np.bool_], details: Details, threshold: float
) -> tuple[Segments, Array]:
    """Lines (k, 2, 3) [m] and their forces (k,) [N]: contacts with |F_n| ≥ ``threshold`` · mean, centre to point.

    Contacts of bodies that are not ``seen``, shape (n,), are left out; a contact with the rig has one line.
    """
    strength = np.abs(details.normal_force).astype(np.float64)
    n, between = len(frame.position), details.partner >= 0
    mine = (details.body < n) & (details.partner < n) & (strength >= weakest(details, threshold))
    mine &= seen[np.where(mine, details.body, 0)] & (~between | seen[np.where(mine & between, details.partner, 0)])
    both = mine & between
    ends = [
        np.stack([frame.position[details.body[mine]], details.point[mine]], axis=1),
        np.stack([details.point[both], frame.position[details.partner[both]]], axis=1),
    ]
    return np.concatenate(ends).astype(np.float32), np.concatenate([strength[mine], strength[both]])


def chain_radii(force: Array, details: Details, threshold: float) -> Array:
    """Radii [m] of lines of these forces [N]: proportional, up to the end of the key."""
    return np.clip(THICKEST * force / strongest_drawn(details, threshold), THINNEST, THICKEST)


def strongest_drawn(details: Details, threshold: float) -> float:
    """Upper end of the key [N]: a round number near the largest forces, and above the weakest drawn."""
    # A jammed body may press a hundred times as hard as the pile; percentiles do not follow it.
    top = nice_top(np.abs(details.normal_force).astype(np.float64))
    return max(top, nice_top(np.array([2.0 * weakest(details, threshold)])))


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
        f"Lines: normal force from {1e3 * low:.3g} mN on. {drawn} of {details.touching} contacts; "
        f"their mean is {1e3 * details.mean_force:.3g} mN."
    )


def chain_key(details: Details | None, look: Look) -> str:
    """What the thickness of the lines means: a wedge with its ends and its middle [mN]."""
    if not look.chains or details is None or details.touching == 0:
        return ""
    top = MN * strongest_drawn(details, look.threshold)
    wedge = (
        "<svg viewBox='0 0 100 8' preserveAspectRatio='none' style='width:100%; height:0.9em; display:block' "
        "role='img' aria-label='thin to thick'><polygon points='0,4 100,0 100,8' fill='currentColor'/></svg>"
    )
    return key_html(wedge, (0.0, 0.5 * top, top), "normal force [mN]: thickness of the lines")


class ForcePanel:
    """Changes ``settings`` and says what the lines mean."""

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
