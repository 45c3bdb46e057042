"""What the pour is doing, in words and numbers: Status → HTML. Every text that came from outside is escaped."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from html import escape

from explorer.live.angle_reader import LEAST_SHARE_BELOW
from explorer.live.messages import Event, SessionState, Status
from explorer.outcomes import OUTCOME_WORDS, WARNINGS
from explorer.viewer.look.look import COMPONENT
from explorer.viewer.palette import component_colour, css
from explorer.viewer.panel import CONTROLS, Now, PageContext, Panel
from solver.pours.record import Outcome, Phase
from solver.scenes.scene import Scene

FORMED_FOR = 0.5
"""Simulated time [s] over which readings have to agree within their spread before an angle counts as that of a pile."""
READINGS_KEPT = 200
"""Readings of the angle kept, for a pour that is brought back a little."""
FORMING, VOID = "forming", "not of a valid pile"

PHASE_WORDS = {
    Phase.FILL: "filling",
    Phase.DISCHARGE: "discharging",
    Phase.PILE: "settling",
    Phase.RUN: "turning",
    Phase.AT_REST: "at rest",
}
SLOWER = "slow"
STATE_WORDS = {
    SessionState.STARTING: "starting",
    SessionState.RUNNING: "running",
    SessionState.PAUSED: "paused",
    SessionState.ENDED: "ended",
    SessionState.FAILED: "solver failed",
    SessionState.DIED: "solver gone",
    SessionState.CLOSED: "closed",
}
TROUBLE = (SessionState.FAILED, SessionState.DIED)

STYLE = """<style>
.pour {padding: 0.2em 1.1em 0.4em 0.75em; font-size: 0.82em; line-height: 1.45;}
.pour .state, .pour .condition {padding: 0.1em 0.7em; border-radius: 0.8em; background: rgba(128,150,170,0.22);}
.pour .trouble {background: #9a4400; color: white;}
.pour .big {font-size: 2.4em; font-weight: 600; line-height: 1.2; font-variant-numeric: tabular-nums;}
.pour .doubt {font-size: 1.2em; line-height: 2.4em; opacity: 0.65; font-variant-numeric: tabular-nums;}
.pour .former {font-size: 0.9rem; font-weight: 400; white-space: nowrap; line-height: 1;}
.pour .dim {opacity: 0.65; height: 2.9em; overflow: hidden;}
.pour .top {display: flex; justify-content: space-between; align-items: center;}
.pour .dot {display: inline-block; width: 0.7em; height: 0.7em; border-radius: 50%;
  margin: 0 0.3em 0 0.8em;}
</style>"""


class Readout(Panel):
    """The readout on the page."""

    name, tab = "readout", CONTROLS

    def __init__(self, page: PageContext) -> None:
        self._look, self._ghost, self._html = page.look, page.ghost, page.server.gui.add_html("")
        self._angle = AngleDoubt()

    def show(self, now: Now) -> None:
        """Show what the pour is doing."""
        by_component, doubt = self._look.look.colour_by == COMPONENT, self._angle.doubt(now.status)
        former = self._ghost.former
        html = readout_html(now.status, by_component, doubt, math.nan if former is None else former.angle)
        if self._html.content != html:
            self._html.content = html


class AngleDoubt:
    """Why the angle that is read off a pour is not yet that of a pile: ``FORMING``, ``VOID``, or "" if it is.

    It is that of a pile once the pour has come to a valid end. Before that, everything has to be below the outlet, and
    the angles read over ``FORMED_FOR`` must lie within the last one's spread of each other; this also holds in a drum
    that turns.
    """

    def __init__(self) -> None:
        self._generation = 0
        self._read: deque[tuple[float, float]] = deque(maxlen=READINGS_KEPT)

    def doubt(self, status: Status) -> str:
        """Take note of ``status`` and judge it."""
        read, found = self._read, status.observables.get("angle_of_repose_deg")
        if status.generation != self._generation:
            self._generation = status.generation
            read.clear()
        while read and read[-1][0] >= status.time:  # brought back, or the same moment
            read.pop()
        if found is None or not math.isfinite(found.value):
            read.clear()
            return FORMING
        read.append((status.time, found.value))
        if status.outcome != Outcome.RUNNING:
            return "" if status.outcome.valid else VOID
        begin = status.time - FORMED_FOR
        angles = [angle for time, angle in read if time >= begin]
        long_enough = read[0][0] <= begin + 1e-9  # within rounding of sums of steps
        agree = found.spread is not None and max(angles) - min(angles) <= found.spread
        return "" if status.phase in (Phase.PILE, Phase.RUN) and long_enough and agree else FORMING


def readout_html(status: Status, by_component: bool = True, doubt: str = "", former: float = math.nan) -> str:
    """The readout. Its height is constant: controls below must not move while the user operates them.

    ``by_component``: whether a body's colour shows its component; otherwise a legend of components would be wrong.
    ``doubt``: of :class:`AngleDoubt`; an angle in doubt is small and grey. ``former``: angle of the pile before [°].
    """
    components = legend(status.scene) if by_component else ""
    top = f"<div class='top'>{_state(status)}<span>{components}</span></div>"
    return f"{STYLE}<div class='pour'>{top}{_angle(status, doubt, former)}</div>"


def condition(status: Status) -> str:
    """State of the pour: a word of ``OUTCOME_WORDS``, slower than the wanted speed, or nothing special."""
    return OUTCOME_WORDS.get(status.outcome, SLOWER if status.capped else "")


def pace(status: Status) -> str:
    """Simulated seconds per second, such as "0.42"; one digit for a slow pour, as "0.00" would mean that it stands."""
    factor = status.real_time_factor
    return f"{factor:.2f}" if factor >= 0.1 else f"{factor:.1g}"


def not_later(events: Iterable[Event], status: Status) -> list[Event]:
    """Events without those of the present pour that, after it was brought back, have not happened yet."""
    return [event for event in events if event.generation != status.generation or event.time <= status.time]


def legend(scene: Scene) -> str:
    """Coloured dots with the components' names, as HTML."""
    dots = [
        f"<span class='dot' style='background:{css(component_colour(k))}'></span>{escape(body.name)}"
        for k, body in enumerate(scene.bodies)
    ]
    return "".join(dots)


def angle_of_repose_deg(status: Status) -> float:
    """Present angle of the pile [°]; NaN if there is none."""
    found = status.observables.get("angle_of_repose_deg")
    return math.nan if found is None else found.value


def _state(status: Status) -> str:
    kind = "state trouble" if status.state in TROUBLE else "state"
    pills = f"<span class='{kind}'>{STATE_WORDS[status.state]}</span>"
    if word := condition(status):
        kind = "condition trouble" if word in WARNINGS else "condition"
        pills += f" <span class='{kind}'>{word}</span>"
    return f"<span>{pills}</span>"


def _angle(status: Status, doubt: str, former: float) -> str:
    values = status.observables
    found = values.get("angle_of_repose_deg")
    if found is None:
        words = f"angle of repose: from {LEAST_SHARE_BELOW:.0%} of the mass below the outlet on"
    else:
        flanks = [values.get(f"angle_of_repose_{side}_deg") for side in ("left", "right")]
        left, right = (math.nan if flank is None else flank.value for flank in flanks)
        spread = "" if found.spread is None else f", SD over flanks {found.spread:.1f}°"
        words = f"angle of repose{spread} · one view: left {_degrees(left)}, right {_degrees(right)}"
    angle = _degrees(angle_of_repose_deg(status))
    before = f" <span class='former'>before: {former:.1f}°, one pour each</span>" if math.isfinite(former) else ""
    number = (
        f"<div class='doubt'>{angle} · {doubt}{before}</div>" if doubt else f"<div class='big'>{angle}{before}</div>"
    )
    return f"{number}<div class='dim'>{words}</div>"


def _degrees(angle_deg: float) -> str:
    return f"{angle_deg:.1f}°" if math.isfinite(angle_deg) else "–"
