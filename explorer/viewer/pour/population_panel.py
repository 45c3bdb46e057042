"""The angles that other seeds give, beside that of one pour: a strip of the stored pours, and *Pour 8 more*.

The stored pours are those of exactly the parameters in force, by the keys under which a calibration finds its own.
After a change of parameters, the present pours are compared with the former ones: what one pour shows, what more would.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from doe.population import Comparison, Population, compared
from explorer.background.command_process import CommandStatus
from explorer.population.process import PopulationProcess
from explorer.scene.source import change_lines, differences, same_bodies
from explorer.viewer.actions import BackgroundWork, OwnAction
from explorer.viewer.palette import FLANK, css
from explorer.viewer.panel import CONTROLS, SELDOM, Now, PageContext, Panel
from explorer.viewer.pour.readout import AngleDoubt, angle_of_repose_deg
from explorer.viewer.study.process_view import time_left
from solver import Scene

OBSERVABLE = "angle_of_repose_deg"
MORE = 8
"""Number of pours in one order."""
POUR_MORE, POUR_BOTH = f"Pour {MORE} more", "Pour to compare"
SETTLED = 0.7
"""Wall time [s] without change before pours of the parameters are looked up: a slider being dragged asks once."""
AGAIN = 4.0
"""Least wall time [s] between two look-ups of the same parameters, while pours are added to the store."""
TRUSTED = 10
"""Number of values from which the standard deviation is given without its own uncertainty."""
WIDTH, HEIGHT, MARGIN, BASE = 300.0, 54.0, 14.0, 27.0
"""Dimensions of the strip; ``BASE``: height of its axis."""
BOX_HEIGHT = "7.2em"
"""Constant height: controls below must not move while the user operates them."""
DOT = 3.2
"""Radius of a dot."""
HINT = (
    "Mean ± standard deviation of the angle over stored pours with exactly these parameters, one dot per seed. "
    "One pour falls within m ± t(0.975, n−1) s √(1 + 1/n) of them with 95 %; n pours of each of two settings show a "
    "difference of (shift of the noncentral t for 80 % power at p < 0.05) · s √(2/n)."
)


@dataclass(frozen=True)
class ThisPour:
    """The single pour on the screen."""

    angle: float
    """[°]; NaN where there is none."""
    seed: int
    doubt: str
    """Why the angle is not yet that of a pile; empty if it is."""
    changed: bool
    """Parameters were changed or the pile was disturbed, so it is not a draw from this population."""


class PopulationPanel(Panel):
    """The strip, the line, and the order for more pours."""

    name, tab, every = "population", CONTROLS, SELDOM

    def __init__(self, page: PageContext) -> None:
        gui = page.server.gui
        self._session, self._post = page.session, page.post
        # Nobody asks for a look into the store.
        self._work = BackgroundWork(lambda act: page.post(OwnAction(act)))
        self._process = PopulationProcess(page.data / "pours", page.diagnosis.store, place=page.place)
        self._doubt = AngleDoubt()
        self._scene: Scene | None = None
        self._since = self._asked_at = -math.inf
        self._asked_for: object = None
        self._found: tuple[Scene, Population] | None = None
        self._former: tuple[Scene, Population] | None = None
        self._changed = ""
        self._compared_for: object = None
        self._comparison: Comparison | None = None
        self._poured: Scene | None = None
        self._to_come: tuple[Scene, int] | None = None
        self._html = gui.add_html("")
        self._more = gui.add_button(POUR_MORE, hint=f"In the background, with other seeds. {HINT}")
        self._stop = gui.add_button("Cancel these pours", visible=False, hint="Finished pours are kept.")
        self._more.on_click(lambda _: page.post(self._pour))
        self._stop.on_click(lambda _: page.post(self._cancel))

    def show(self, now: Now) -> None:
        """Look up pours of the parameters in force, and show them."""
        status, wall = now.status, time.monotonic()
        if status.scene != self._scene:
            self._scene, self._since = status.scene, wall
        command = self._process.status()
        if self._to_come is not None and not command.alive:
            (scene, pours), self._to_come = self._to_come, None
            # As an action, so that a refusal is reported and ends nothing.
            self._post(OwnAction(lambda: self._begin(scene, pours)))
        if self._more.visible == command.alive:
            self._more.visible, self._stop.visible = not command.alive, command.alive
        no_draw = status.energy_put_in is not None or status.disturbed
        pour = ThisPour(angle_of_repose_deg(status), status.seed, self._doubt.doubt(status), no_draw)
        if not self._work.busy_with and wall >= self._since + SETTLED:
            self._look(status.scene, pour, wall)
        here = self._found is not None and self._found[0] == status.scene
        population = self._found[1] if self._found is not None and here else None
        former = None if self._former is None else self._former[1]
        changed = self._changed if here else ""
        label = POUR_BOTH if changed else POUR_MORE
        if self._more.label != label:
            self._more.label = label
        html = population_html(population, pour, command, changed, self._comparison, former, self._whose(status.scene))
        if self._html.content != html:
            self._html.content = html

    def close(self) -> None:
        """End pours in the background; finished ones are kept."""
        self._process.close()

    def _pour(self) -> None:
        """Order more pours of the present parameters; after a change also of the former, until both have as many."""
        scene = self._session.status().scene
        if self._former is None or self._found is None or not self._changed or self._found[0] != scene:
            self._begin(scene, MORE)
            return
        sides = (self._found, self._former)
        wanted = max(MORE, *(population.n for _, population in sides))
        wanted += MORE if all(population.n == wanted for _, population in sides) else 0
        orders = [(one, wanted - population.n) for one, population in sides if population.n < wanted]
        self._begin(*orders[0])
        self._to_come = next(iter(orders[1:]), None)

    def _begin(self, scene: Scene, pours: int) -> None:
        self._process.start(scene, pours)
        self._poured = scene

    def _whose(self, scene: Scene) -> str:
        """Whose pours are made in the background, if not those of ``scene``, which is on the screen."""
        if self._poured is None or self._poured == scene:
            return ""
        former = self._former is not None and self._former[0] == self._poured
        return "the former parameters" if former else f"{self._poured.title}, other parameters"

    def _cancel(self) -> None:
        self._to_come = None
        self._process.cancel()

    def _look(self, scene: Scene, pour: ThisPour, wall: float) -> None:
        """Read the store if it may have changed, then compare, both off the loop."""
        wanted = scene, self._process.stamp()
        anew = self._found is None or self._found[0] != scene
        if wanted != self._asked_for and (anew or wall >= self._asked_at + AGAIN):
            self._asked_for, self._asked_at = wanted, wall
            scenes = [scene] if self._former is None else [scene, self._former[0]]
            self._work.start(
                "reading stored pours",
                lambda: [(one, self._process.read(one, OBSERVABLE)) for one in scenes],
                self._take,
            )
        elif self._found is not None and self._former is not None and not anew:
            new, former = self._found[1], self._former[1]
            single = math.nan if pour.doubt else round(pour.angle, 1)
            if (new, single, former) != self._compared_for:
                self._compared_for = new, single, former
                self._work.start("comparing pours", lambda: compared(new, single, former), self._take_comparison)

    def _take(self, read: Sequence[tuple[Scene, Population]]) -> None:
        """Take the population of the parameters in force, and the renewed one of the former parameters."""
        (scene, population), *former = read
        self._former = next(iter(former), self._former)
        if self._found is not None and self._found[0] != scene:
            # Intermediate positions of a slider have no pours; the parameters before them say more.
            if self._former is None or self._found[1].n > 1:
                self._former = self._found
            self._comparison = None
            self._changed = told_difference(self._former[0], scene)
        self._found = scene, population

    def _take_comparison(self, comparison: Comparison | None) -> None:
        self._comparison = comparison


def told_difference(former: Scene, scene: Scene) -> str:
    """What was changed, in words; empty if there is nothing to compare."""
    if former.rig.name != scene.rig.name or not same_bodies(former, scene):
        return ""
    return "; ".join(change_lines(differences(former, scene)))


def population_html(
    population: Population | None,
    pour: ThisPour,
    command: CommandStatus,
    changed: str,
    comparison: Comparison | None,
    former: Population | None = None,
    whose: str = "",
) -> str:
    """Strip, line, comparison and progress; ``changed``: what differs from the ``former`` parameters, "" for nothing.

    ``whose``: whose pours are made in the background, "" for those of the parameters in force.
    """
    lines = [_process_line(command, whose)]
    if population is None:
        lines.insert(0, "Looking for other pours with these parameters …")
        return _block("", lines)
    lines = [*lines, _compared_line(population, changed, comparison, former), _of_this_pour(population, pour)]
    sample = population.sample
    head = "" if population.n < 2 else f"<b>{sample.mean:.1f} ± {sample.sd:.1f}°</b> SD ({population.n} seeds); "
    drawn = strip_svg(population, pour) if population.n else ""
    told = f"<div>{head}{_few(population)}</div>{drawn}"
    # While more are poured, that comes first: the box shows five lines.
    return _block("", [lines[0], told, *lines[1:]]) if command.alive else _block(told, lines)


def strip_svg(population: Population, pour: ThisPour) -> str:
    """One dot per seed over an axis in degrees, a bar for mean ± sd, and a mark for the pour on the screen."""
    sample, mark = population.sample, pour.angle if math.isfinite(pour.angle) else None
    spread = sample.sd if population.n > 1 else 0.0
    ends = [*population.values, sample.mean - spread, sample.mean + spread, *([] if mark is None else [mark])]
    low, high = float(math.floor(min(ends))), float(math.ceil(max(ends)))
    low, high = (low - 1.0, high + 1.0) if high - low < 2.0 else (low, high)

    def x(angle: float) -> float:
        return MARGIN + (WIDTH - 2 * MARGIN) * (angle - low) / (high - low)

    parts = [f"<line x1='{MARGIN}' x2='{WIDTH - MARGIN}' y1='{BASE}' y2='{BASE}' stroke='currentColor' opacity='.5'/>"]
    if spread:
        left, width = x(sample.mean - spread), x(sample.mean + spread) - x(sample.mean - spread)
        parts.append(
            f"<rect x='{left:.1f}' y='{BASE - 3}' width='{width:.1f}' height='6' fill='currentColor' opacity='.3'/>"
        )
        parts.append(f"<rect x='{x(sample.mean) - 1:.1f}' y='{BASE - 6}' width='2' height='12' fill='currentColor'/>")
    parts += [
        f"<circle cx='{cx:.1f}' cy='{cy:.1f}' r='{DOT}' fill='currentColor' fill-opacity='.75'>"
        f"<title>seed {seed}: {angle:.1f}°</title></circle>"
        for seed, angle, (cx, cy) in zip(
            population.seeds, population.values, stacked([x(angle) for angle in population.values]), strict=True
        )
    ]
    if mark is not None:
        at, colour = x(mark), css(FLANK)
        inside = "none" if pour.doubt or pour.changed else colour
        parts.append(
            f"<path d='M{at:.1f} {BASE + 2} l5 9 h-10 z' fill='{inside}' stroke='{colour}' stroke-width='1.5'>"
            f"<title>this pour: {mark:.1f}°</title></path>"
        )
    for angle, anchor in ((low, "start"), (high, "end")):
        parts.append(
            f"<text x='{x(angle):.1f}' y='{HEIGHT - 3}' text-anchor='{anchor}' font-size='11' fill='currentColor'>"
            f"{angle:.0f}°</text>"
        )
    label = f"{population.n} stored pours between {min(population.values):.1f} and {max(population.values):.1f}°"
    return (
        f"<svg viewBox='0 0 {WIDTH:.0f} {HEIGHT:.0f}' width='100%' role='img' aria-label='{label}' "
        f"style='display:block; max-width:26em'>{''.join(parts)}</svg>"
    )


def stacked(places: Sequence[float]) -> list[tuple[float, float]]:
    """Centres of dots at ``places`` along the axis, each as low above it as possible without overlap."""
    rows: list[list[float]] = []
    found: list[tuple[float, float]] = []
    for place in places:
        row = next((k for k, taken in enumerate(rows) if all(abs(place - one) > 2 * DOT for one in taken)), len(rows))
        rows[row:row] = [[]] if row == len(rows) else []
        rows[row].append(place)
        # Rows for which there is no room overlap.
        found.append((place, max(DOT + 1, BASE - 9 - 2.1 * DOT * row)))
    return found


def _few(population: Population) -> str:
    n, void = population.n, population.void
    lost = f" {void} more gave no valid pile." if void else ""
    if n == 0:
        return "No other pour with these parameters is stored, so the scatter between pours is unknown." + lost
    if n == 1:
        return f"One stored pour, {population.values[0]:.1f}°: how far seeds scatter is unknown." + lost
    low, high = population.interval
    mean = f"mean 95 % {low:.1f} … {high:.1f}°"
    # Standard error of a standard deviation of normal values: σ/√(2(n − 1)).
    known = 100 / math.sqrt(2 * (n - 1))
    few = f"; with so few pours the SD is known only to about ±{known:.0f} %" if n < TRUSTED else ""
    return f"{mean}{few}.{lost}"


def _of_this_pour(population: Population, pour: ThisPour) -> str:
    if not math.isfinite(pour.angle) or not population.n:
        return ""
    about = pour.doubt or ("changed or disturbed on its way" if pour.changed else f"seed {pour.seed}")
    return f"<span style='color:{css(FLANK)}'>▲</span> this pour {pour.angle:.1f}° ({about})."


def _compared_line(population: Population, changed: str, found: Comparison | None, former: Population | None) -> str:
    if not changed:
        return ""
    if found is None:
        stored = 0 if former is None else former.n
        if stored > 1:
            return f"{escape(changed)}: {stored} stored pours of the former parameters, none of these yet."
        few = "one stored pour" if stored else "no stored pour"
        return f"{escape(changed)}: {few} of the former parameters; <b>{POUR_BOTH}</b> tells whether it is real."
    pours = "one pour" if population.n < 2 else f"{found.pours} pours"
    low, high = found.difference - found.half_width, found.difference + found.half_width
    sides = f"{found.difference:+.1f}°, 95 % {low:+.1f} … {high:+.1f}°,"
    verdict = "distinguishable" if found.distinguishable else "not distinguishable"
    more = f"; {found.planned} pours of each would show {found.resolved:.1f}°"
    return f"{escape(changed)}: {sides} against {found.former} former: <b>{verdict} in {pours}</b>{more}."


def _process_line(command: CommandStatus, whose: str) -> str:
    if command.alive:
        of = f" ({escape(whose)})" if whose else ""
        left = f"time left {time_left(command.eta_s)}" if command.done else "the first one takes longest"
        return f"Pouring in the background{of}: {command.done} of {command.planned or MORE}, {left}."
    return escape(command.message) if command.state in ("failed", "cancelled") else ""


def _block(head: str, lines: Sequence[str]) -> str:
    said = "".join(f"<div style='opacity:0.8'>{line}</div>" for line in lines if line)
    return (
        "<div class='population' tabindex='0' style='padding:0 0.9em 0.2em 0.75em; font-size:0.82em; line-height:1.4; "
        f"height:{BOX_HEIGHT}; overflow-y:auto; font-variant-numeric:tabular-nums'>{head}{said}</div>"
    )
