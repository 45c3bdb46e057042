"""Tap and shake the plate, or pull one body: what friction, restitution and stiffness do to a standing pile.

Each disturbance is an event of the pour, in SI, and the pour can be brought back to before it or into the middle of it.
"""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np

from explorer.errors import CommandError
from explorer.live.frames import Frame
from explorer.units import checked
from explorer.viewer.actions import button_group
from explorer.viewer.number_box import with_decimals
from explorer.viewer.panel import POUR, Now, PageContext, Panel
from explorer.viewer.view import small_html
from solver.pours.disturbance import PlateMotion, Pull, Shake, Tap

STANDARD_GRAVITY = 9.80665
"""[m/s²]"""
DIRECTIONS = {"up": (0, 0, 1), "along x": (1, 0, 0), "against x": (-1, 0, 0), "along y": (0, 1, 0), "down": (0, 0, -1)}
TOPMOST = 0
"""Number in the box that means the body on top of the pile."""
LARGEST_FORCE = 1000.0
"""[mN]"""
MM, MS, MN = 1e-3, 1e-3, 1e-3


class DisturbPanel(Panel):
    """Buttons, and the numbers behind them."""

    name, tab, title, folded = "disturb", POUR, "Tap, shake, pull", False

    def __init__(self, page: PageContext) -> None:
        gui, post, self._session = page.server.gui, page.post, page.session
        self._frame: Frame | None = None
        acts = {"Tap": self._tap, "Shake": self._shake}
        button_group(gui, "Plate", acts, post, hint="Moves the plate and everything on it; it ends where it began.")
        acts = {"Pull": self._pull, "Let go": lambda: self._session.pull(None)}
        button_group(gui, "Body", acts, post, hint="A constant force on one body's centre of mass until you let go.")
        self._text = gui.add_html("")
        with gui.add_folder("How far, how fast, how hard", expand_by_default=False):
            self._up = gui.add_number("Tap: up [mm]", 1.0, min=0.001, max=20.0, hint="u(t) = up · sin²(π t/time)")
            self._time = with_decimals(gui.add_number("Tap: time [ms]", 30.0, min=1.0, max=1000.0))
            self._to = gui.add_number("Shake: ± [mm]", 1.5, min=0.001, max=20.0, hint="u(t) = ± sin(2π f t), along x")
            self._hertz = with_decimals(gui.add_number("Shake: f [Hz]", 15.0, min=0.5, max=200.0))
            self._periods = gui.add_number("Shake: periods", 10, min=1, max=1000, step=1)
            self._body = gui.add_number(
                "Pull: body", TOPMOST, min=TOPMOST, step=1, hint="Number as in Look; 0: the one on top of the pile."
            )
            self._force = with_decimals(gui.add_number("Pull: force [mN]", 2.0, min=0.0, max=LARGEST_FORCE))
            self._direction = gui.add_dropdown("Pull: direction", tuple(DIRECTIONS))

    def show(self, now: Now) -> None:
        """Show what the buttons would do, and what is being done."""
        self._frame = now.frame
        try:
            planned = disturbance_html(self._planned_tap(), self._planned_shake(), now.status.disturbance)
        except ValueError as error:  # a number that the box accepts but the plate does not
            planned = small_html(escape(str(error)))
        if self._text.content != planned:
            self._text.content = planned

    def _tap(self) -> None:
        self._session.move_plate(self._planned_tap())

    def _shake(self) -> None:
        self._session.move_plate(self._planned_shake())

    def _pull(self) -> None:
        wanted = int(checked(self._body.value, TOPMOST, 1e6, "body"))
        body = topmost(self._frame) if wanted == TOPMOST else wanted - 1
        force = MN * checked(self._force.value, 0.0, LARGEST_FORCE, "force")
        direction = DIRECTIONS.get(str(self._direction.value), DIRECTIONS["up"])
        self._session.pull(Pull(body, tuple(force * axis for axis in direction)))  # type: ignore[arg-type]

    def _planned_tap(self) -> Tap:
        return Tap(MM * _number(self._up, "up"), MS * _number(self._time, "time"))

    def _planned_shake(self) -> Shake:
        amplitude, frequency = MM * _number(self._to, "shake"), _number(self._hertz, "frequency")
        return Shake(amplitude, frequency, int(_number(self._periods, "periods")))


def _number(box: Any, name: str) -> float:
    return checked(box.value, box.min, box.max, name)


def topmost(frame: Frame | None) -> int:
    """The body in the domain that lies highest within 0.1 m of the axis; raises CommandError if there is none."""
    if frame is not None:
        near = frame.inside & (np.hypot(frame.position[:, 0], frame.position[:, 1]) < 0.1)
        if near.any():
            return int(np.argmax(np.where(near, frame.position[:, 2], -np.inf)))
    raise CommandError("pull: no body has entered yet")


def disturbance_html(tap: Tap, shake: Shake, present: str) -> str:
    """The motions with their peaks, in SI, and what is being done."""
    now = f"<div><b>Now: {escape(present)}.</b></div>" if present else ""
    return small_html(f"<div>{motion_text('Tap', tap)}</div><div>{motion_text('Shake', shake)}</div>{now}")


def motion_text(name: str, motion: PlateMotion) -> str:
    """E.g. "Tap: up by 1 mm and back within 30 ms; up to 0.105 m/s and 2.24 × gravity"."""
    what = str(motion).partition(": ")[2]
    peak = f"{motion.largest_velocity:.3g} m/s and {motion.largest_acceleration / STANDARD_GRAVITY:.3g} × gravity"
    return f"{name}: {what}; up to {peak}."
