"""What the solver is doing, in numbers: phase, time, bodies, time step, outcome, mass below the outlet, pace."""

from __future__ import annotations

import math

from explorer.live.messages import SessionState, Status
from explorer.outcomes import OUTCOME_SENTENCES
from explorer.viewer.panel import POUR, Now, PageContext, Panel
from explorer.viewer.pour.readout import PHASE_WORDS, pace

STYLE = """<style>
.readings .grid {display: grid; grid-template-columns: 1fr 1fr; column-gap: 1.6em; margin-top: 0.3em;}
.readings .cell {display: flex; justify-content: space-between; font-variant-numeric: tabular-nums;}
.readings .wide {grid-column: 1 / 3;}
.readings {padding: 0.2em 1.1em 0.4em 0.75em; font-size: 13px; line-height: 1.5;}
.readings .dim {opacity: 0.75;}
</style>"""


class ReadingsPanel(Panel):
    """A table of what the solver reports about itself."""

    name, tab = "readings", POUR

    def __init__(self, page: PageContext) -> None:
        self._html = page.server.gui.add_html("")

    def show(self, now: Now) -> None:
        """Show what the solver is doing."""
        html = readings_html(now.status)
        if self._html.content != html:
            self._html.content = html


def readings_html(status: Status) -> str:
    """HTML of all readings."""
    cells = "".join(_cell(name, text) for name, text in readings(status))
    cells += "".join(_cell(name, text, "wide") for name, text in long_readings(status))
    return f"{STYLE}<div class='readings'><div class='grid'>{cells}</div></div>"


def readings(status: Status) -> list[tuple[str, str]]:
    """Names and texts of the short readings, two to a line."""
    names = ("Phase", "Simulated time", "Bodies", "Back to")
    if status.state == SessionState.STARTING:
        return [(name, "–") for name in names]
    bodies = f"{status.bodies} of {status.bodies_planned}"
    earliest = f"{status.earliest:.3f} s" if math.isfinite(status.earliest) else "–"
    texts = (PHASE_WORDS[status.phase], f"{status.time:.3f} s", bodies, earliest)
    return list(zip(names, texts, strict=True))


def long_readings(status: Status) -> list[tuple[str, str]]:
    """Names and texts of the readings that take a whole line each."""
    starting, running = status.state == SessionState.STARTING, status.state == SessionState.RUNNING
    real_time = f"{pace(status)} of {status.speed:.3g} wanted" if running else "–"
    mass = f"{1e3 * status.discharged_mass:.1f} of {1e3 * status.poured_mass:.1f} g"
    found = [
        ("Real-time factor", real_time),
        ("Time step", "–" if starting else time_step_text(status)),
        ("Outcome", "–" if starting else OUTCOME_SENTENCES[status.outcome]),
        ("Mass below the outlet", "–" if starting else mass),
    ]
    if status.energy_put_in is not None:
        found.append(("Energy put in by the last change", f"{1e6 * status.energy_put_in:.3g} µJ"))
    return found


def time_step_text(status: Status) -> str:
    """Time step, and its share of the largest stable time step."""
    text = f"{1e6 * status.dt:.2f} µs"
    if math.isfinite(status.dt_limit):
        text += f", {status.dt / status.dt_limit:.0%} of the stability limit"
    return text


def _cell(name: str, text: str, kind: str = "") -> str:
    return f"<div class='cell {kind}'><span class='dim'>{name}</span><span>{text}</span></div>"
