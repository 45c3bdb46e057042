"""Controls of the second pile: it stays as poured while the first is changed; both results are shown side by side."""

from __future__ import annotations

import math
from html import escape

from explorer.live.messages import SessionState, Status
from explorer.outcomes import OUTCOME_SENTENCES, OUTCOME_WORDS
from explorer.scene.source import change_lines, differences, same_bodies
from explorer.viewer.actions import button_group
from explorer.viewer.panel import POUR, Now, PageContext, Panel
from explorer.viewer.pour.readout import STATE_WORDS, TROUBLE, angle_of_repose_deg
from solver.pours.record import Outcome

DIFFERENCES_SHOWN = 6
POUR_SECOND = "Pour a second"
SECOND_HINT = (
    "Pours a pile beside this one: the same seed, with the parameters as they are now. It stays so while you change "
    "the first."
)
NONE = f"None yet. *{POUR_SECOND}* pours one as it is now, to compare with what you change."


class SecondPile(Panel):
    """Buttons and the comparison; the pile itself is ``page.beside``."""

    name, tab, title = "second_pile", POUR, "Second pile"

    def __init__(self, page: PageContext) -> None:
        gui = page.server.gui
        self._beside = page.beside
        button_group(
            gui,
            "Second pile",
            {POUR_SECOND: self._beside.pour_present, "Take away": self._beside.close},
            page.post,
            hint=SECOND_HINT,
        )
        self._text = gui.add_markdown(NONE)

    def close(self) -> None:
        """End the second pour and remove it from the page."""
        self._beside.close()

    def draw(self, now: Now) -> None:
        """Draw the newest frame of the second pile."""
        self._beside.draw()

    def show(self, now: Now) -> None:
        """Show both results; the second pour runs or pauses with the first."""
        second = self._beside.follow(now.status)
        text = NONE
        if second is not None:
            text = comparison_markdown(now.status, second)
            self._beside.say(come_to(now.status), come_to(second))
        if self._text.content != text:
            self._text.content = text


def come_to(status: Status) -> str:
    """How far a pour is, in a few words: its angle once it has ended."""
    if status.outcome == Outcome.RUNNING:
        return STATE_WORDS[status.state] if status.state in TROUBLE else f"pouring, {status.time:.1f} s"
    angle = angle_of_repose_deg(status)
    if not status.outcome.valid:
        return OUTCOME_WORDS.get(status.outcome, str(status.outcome))
    return f"{angle:.1f}°, one pour" if math.isfinite(angle) else "at rest, no angle"


def comparison_markdown(first: Status, second: Status) -> str:
    """Both piles side by side: their states, their angles with the spread over flanks, and their differences."""
    rows = [
        ("", "first", "second"),
        (":--", "--:", "--:"),
        ("state", *(_state(status) for status in (first, second))),
        ("angle of repose", *(_angle(status) for status in (first, second))),
        ("mass below the outlet", *(f"{1e3 * status.discharged_mass:.1f} g" for status in (first, second))),
        ("simulated time", *(f"{status.time:.2f} s" for status in (first, second))),
    ]
    difference = angle_of_repose_deg(first) - angle_of_repose_deg(second)
    lines = ["\n".join(f"| {' | '.join(row)} |" for row in rows)]
    if math.isfinite(difference):
        lines.append(f"First − second: **{difference:+.1f}°**. One pour each: seeds alone scatter by degrees.")
    if second.state in (SessionState.FAILED, SessionState.DIED):
        lines.append(escape(second.message))
    if same_bodies(first.scene, second.scene):
        found = change_lines(differences(second.scene, first.scene))
        shown = [f"- {line}" for line in found[:DIFFERENCES_SHOWN]]
        more = [f"- and {len(found) - len(shown)} more"] if len(found) > len(shown) else []
        lines.append("Second → first:\n\n" + "\n".join(shown + more) if found else "Same parameters.")
    else:
        lines.append("Another material.")
    return "\n\n".join(lines)


def _state(status: Status) -> str:
    return STATE_WORDS[status.state] if status.outcome == Outcome.RUNNING else OUTCOME_SENTENCES[status.outcome]


def _angle(status: Status) -> str:
    found = status.observables.get("angle_of_repose_deg")
    if found is None or not math.isfinite(found.value):
        return "–"
    return f"{found.value:.1f}°" + ("" if found.spread is None else f", SD over flanks {found.spread:.1f}°")
