"""Parameters that act on the running pour: choose materials or pairs, move sliders, read what the solver has.

Controls are made from the declarations of live parameters: one control moves one parameter of one or many things. One
parameter of all pairs is a matrix: what the solver has in force, and a box for every pair. viser has no table of
inputs; a row of the lower triangle is a vector of up to three boxes, and longer rows take several.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import viser

from explorer.live.messages import Status
from explorer.session import Session
from explorer.units import InputError, checked, quantity, screen_unit, title
from explorer.viewer.actions import Post
from explorer.viewer.panel import SET_UP
from explorer.viewer.pour.rebuilt_panel import RebuiltPanel
from explorer.viewer.view import small_html
from solver.effects import EFFECTS, SetUpEffect
from solver.params import Parameter, declared
from solver.scenes.material import Pair
from solver.scenes.scene import Scene, parameters, value

Apply = Callable[[Mapping[str, float | str]], None]
"""Hands new values (SI, by path) to the solver."""
Targets = dict[str, tuple[str, ...]]
"""Text of a choice → prefixes of the parameter paths that it stands for."""

LINEAR_STEP = 0.01
POWER_DIGITS = 2
"""Decimals of a power of ten: as fine as the slider's step, and no more than its box can show."""
LARGEST_FACTOR, LARGEST_POWER = 4.0, 100.0
"""By which values that differ are scaled at most in one go, on a linear and on a logarithmic slider."""
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
DECADES = 1.0
"""A logarithmic slider reaches this far to either side of the present value, then out to whole decades."""
HANDS_OFF = 1.5
"""Seconds after a person's input during which the solver's echo does not move the control."""
BOXES = 3
"""Most boxes in a row: viser's longest vector."""


class LivePanel(RebuiltPanel["LiveSections"]):
    """What acts on the running pour."""

    name, tab = "live", SET_UP

    def build(self, scene: Scene) -> LiveSections:
        """Make the sections for ``scene``."""
        return LiveSections(self._page.server, self._page.session, scene, self._page.post)


class LiveSections:
    """One section per kind of thing that has live parameters (materials, pairs of materials)."""

    def __init__(self, server: viser.ViserServer, session: Session, scene: Scene, post: Post) -> None:
        self._sections = [
            _Section(server, session, scene, post, "Pair", pair_targets(scene)),
            _Section(server, session, scene, post, "Material", material_targets(scene)),
            _Section(server, session, scene, post, "Effect", effect_targets()),
        ]
        self._matrices = [
            PairMatrix(server.gui, scene, name, post, session.set_parameters) for name in pair_parameters()
        ]

    def show(self, status: Status) -> None:
        """Follow the solver's values; call it inside ``server.atomic()``."""
        for section in self._sections:
            section.show(status.scene)
        for matrix in self._matrices:
            matrix.follow(status.scene)


class _Section:
    def __init__(
        self,
        server: viser.ViserServer,
        session: Session,
        scene: Scene,
        post: Post,
        name: str,
        targets: Targets,
    ):
        self._server, self._session, self._post, self._targets = server, session, post, targets
        self._folder = server.gui.add_folder(f"{name} (acts now)")
        with self._folder:
            self._chooser = server.gui.add_dropdown(name, tuple(targets))
            self._echo = server.gui.add_html("")
        self._live: list[LiveControl] = []
        self._build(scene, next(iter(targets)))

        @self._chooser.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            chosen = event.target.value
            if event.client_id is not None and chosen in targets:
                post(lambda: self._build(session.status().scene, chosen))

    def _build(self, scene: Scene, chosen: str) -> None:
        """Controls for the live parameters of what was chosen, in place of those that there were."""
        for control in self._live:
            control.remove()
        self._chosen = chosen
        with self._folder:
            self._live = [
                control_for(scene, paths)(
                    self._server.gui, parameter, paths, scene, self._post, self._session.set_parameters
                )
                for parameter, paths in live_parameters(scene, self._targets[chosen])
            ]

    def show(self, scene: Scene) -> None:
        if not all(control.fits(scene) for control in self._live):
            self._build(scene, self._chosen)
        for control in self._live:
            control.follow(scene)
        echo = echo_html(scene, self._targets[self._chosen])
        if self._echo.content != echo:
            self._echo.content = echo


def live_parameters(scene: Scene, prefixes: tuple[str, ...]) -> Iterator[tuple[Parameter, tuple[str, ...]]]:
    """Declarations of the live parameters under the first prefix, each with its paths under all ``prefixes``."""
    for path, parameter in parameters(scene).items():
        prefix, _, name = path.rpartition(".")
        if parameter.live and prefix == prefixes[0]:
            yield parameter, tuple(f"{one}.{name}" for one in prefixes)


def material_targets(scene: Scene) -> Targets:
    """Choices of materials: those of all bodies together (not the wall), then each one."""
    bodies = tuple(dict.fromkeys(f"material.{body.material}" for body in scene.bodies))
    return {"all bodies": bodies} | {m.name: (f"material.{m.name}",) for m in scene.materials}


def pair_targets(scene: Scene) -> Targets:
    """Choices of pairs: all together, then each one."""
    prefixes = {f"{pair.a} – {pair.b}": (f"pair.{pair.a}.{pair.b}",) for pair in scene.pairs}
    return {"all pairs": tuple(one for (one,) in prefixes.values())} | prefixes


def effect_targets() -> Targets:
    """Choices of effects that act on a running pile; all are off until an amplitude is moved from zero."""
    acting = (kind for kind in EFFECTS.values() if not issubclass(kind, SetUpEffect))
    return {kind.name: (f"effect.{kind.name}",) for kind in acting}


def echo_html(scene: Scene, prefixes: tuple[str, ...]) -> str:
    """What the solver has in force for a choice: one line per live parameter, a range where values differ."""
    lines = []
    for parameter, paths in live_parameters(scene, prefixes):
        values = sorted({float(value(scene, path)) for path in paths})
        texts = dict.fromkeys(quantity(number, parameter.unit) for number in (values[0], values[-1]))
        name = escape(title(parameter).split(" [")[0])
        lines.append(f"<span style='opacity:0.65'>{name}</span> {' … '.join(texts)}")
    text = " &nbsp; ".join(lines)
    return f"<div style='padding:0 0.75em; font-size:0.8em'>In the solver: {text}</div>"


class LiveControl:
    """One parameter at ``paths``, which have one value, set together; follows what the solver has in force."""

    def __init__(
        self,
        gui: viser.GuiApi,
        parameter: Parameter,
        paths: Sequence[str],
        scene: Scene,
        post: Post,
        apply: Apply,
        label: str = "",
    ) -> None:
        self._parameter, self._paths, self._label = parameter, tuple(paths), label
        self._touched = -math.inf
        self._faces = self._made(gui, scene)
        for face in self._faces:
            self._listen(face, post, apply)

    def fits(self, scene: Scene) -> bool:
        """Whether this kind of control is the one for ``scene``; always while a person is at it."""
        return self._held or agree(scene, self._paths)

    def follow(self, scene: Scene) -> None:
        """Move to the solver's value, unless a person is at the control."""
        if self._held:
            return
        number = self._number(scene)
        for face in self._faces:
            shown = face.shown(number)
            if not math.isclose(face.handle.value, shown, rel_tol=1e-9, abs_tol=1e-9):
                face.handle.value = shown

    def remove(self) -> None:
        """Take the control off the page."""
        for face in self._faces:
            face.handle.remove()

    @property
    def _held(self) -> bool:
        return time.monotonic() < self._touched + HANDS_OFF

    def _made(self, gui: viser.GuiApi, scene: Scene) -> tuple[Face, ...]:
        faces = log_faces if self._parameter.scale == "log" else linear_faces
        return faces(gui, self._parameter, self._number(scene), self._label)

    def _number(self, scene: Scene) -> float:
        return screen_unit(self._parameter).to_screen(float(value(scene, self._paths[0])))

    def _listen(self, face: Face, post: Post, apply: Apply) -> None:
        def entered(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is None:  # set by follow(), not by a person
                return
            self._touched = time.monotonic()
            number = event.target.value
            post(lambda: apply(self._values(face.read(number))))

        face.handle.on_update(entered)

    def _values(self, number: float) -> Mapping[str, float | str]:
        return dict.fromkeys(self._paths, screen_unit(self._parameter).to_si(number))


class ScalingControl(LiveControl):
    """One parameter at ``paths``, whose values differ: scaled together by a factor, so that their ratios stay.

    The factor is counted from the values as they were when the control was made, so that even from 0 it leads back.
    """

    def fits(self, scene: Scene) -> bool:
        """Whether the values are still those that the factor is counted from, or a person is at it."""
        found = [float(value(scene, path)) for path in self._paths]
        wanted = self._scaled(self._factor)
        return self._held or all(math.isclose(one, wanted[path]) for path, one in zip(self._paths, found, strict=True))

    def _made(self, gui: viser.GuiApi, scene: Scene) -> tuple[Face, ...]:
        self._factor = 1.0
        self._base = {path: float(value(scene, path)) for path in self._paths}
        parameter, name = self._parameter, self._label or f"{title(self._parameter).split(' [')[0]} (mixed)"
        largest = LARGEST_POWER if parameter.scale == "log" else LARGEST_FACTOR
        low, high = factor_range(list(self._base.values()), parameter.low, parameter.high, largest)
        hint = f"The values differ. All are multiplied by this factor, so that their ratios stay. {parameter.doc}"
        if parameter.scale == "log":
            bottom, top = (round(math.log10(end), POWER_DIGITS) for end in (max(low, 1.0 / LARGEST_POWER), high))
            hint = f"1 is ten times as much, −1 a tenth. {hint}"
            slider = gui.add_slider(f"{name}, decades", bottom, top, LINEAR_STEP, 0.0, hint=hint)
            return (Face(slider, math.log10, lambda entered: 10.0 ** checked(entered, bottom, top, name)),)
        slider = gui.add_slider(f"{name} ×", low, high, LINEAR_STEP, 1.0, hint=hint)
        return (Face(slider, lambda factor: factor, lambda entered: checked(entered, low, high, name)),)

    def _number(self, scene: Scene) -> float:
        return self._factor  # it fits, or the control is made anew

    def _values(self, number: float) -> Mapping[str, float | str]:
        self._factor = number
        return dict(self._scaled(number))

    def _scaled(self, factor: float) -> dict[str, float]:
        low, high = self._parameter.low, self._parameter.high
        return {path: min(max(factor * base, low), high) for path, base in self._base.items()}


def control_for(scene: Scene, paths: Sequence[str]) -> type[LiveControl]:
    """The control of a parameter at ``paths``: of their value, or of a factor where they have several."""
    return LiveControl if agree(scene, paths) else ScalingControl


@dataclass(frozen=True)
class Face:
    """One widget of a control. Numbers are in the unit of the screen."""

    handle: Any
    shown: Callable[[float], float]
    """Number → value of the widget."""
    read: Callable[[object], float]
    """Value that came from a browser → number within the range; raises InputError."""


def linear_faces(gui: viser.GuiApi, parameter: Parameter, start: float, label: str = "") -> tuple[Face, ...]:
    """A slider over the declared range, called ``label`` or as the parameter is."""
    name, (low, high) = titled(parameter, label), screen_range(parameter)
    slider = gui.add_slider(name, low, high, LINEAR_STEP, start, hint=parameter.doc)
    return (Face(slider, lambda number: number, lambda entered: checked(entered, low, high, name)),)


def log_faces(gui: viser.GuiApi, parameter: Parameter, start: float, label: str = "") -> tuple[Face, ...]:
    """A number box in the unit of the screen, and below it a slider over its power of ten.

    With a ``label`` the slider alone, in one row of the narrow panel.
    """
    name, (low, high) = titled(parameter, label), screen_range(parameter)
    unit = screen_unit(parameter).symbol
    bottom, top = decades_around(start, low, high)

    def power_of(number: float) -> float:
        return min(max(round(math.log10(number), POWER_DIGITS), bottom), top)

    box = None if label else gui.add_number(name, start, min=low, max=high, hint=parameter.doc)
    slider = gui.add_slider(
        f"{label} [log {unit}]" if label else f"log₁₀ of {unit or name}",
        float(bottom),
        float(top),
        LINEAR_STEP,
        power_of(start),
        marks=tuple((power, decade_mark(power)) for power in range(bottom, top + 1)),
        hint=f"As a power of ten. {parameter.doc}",
    )

    def number_from(power: object) -> float:
        return min(max(10.0 ** checked(power, bottom, top, name), low), high)

    power = Face(slider, power_of, number_from)
    if box is None:
        return (power,)
    return Face(box, lambda number: number, lambda entered: checked(entered, low, high, name)), power


def titled(parameter: Parameter, label: str) -> str:
    """``label`` with the unit of ``parameter``; its own title where there is none."""
    unit = screen_unit(parameter).symbol
    return title(parameter) if not label else f"{label} [{unit}]" if unit else label


def screen_range(parameter: Parameter) -> tuple[float, float]:
    """Range of ``parameter`` in the unit of the screen."""
    unit = screen_unit(parameter)
    return unit.to_screen(parameter.low), unit.to_screen(parameter.high)


def agree(scene: Scene, paths: Sequence[str]) -> bool:
    """Whether the parameters at ``paths`` have one value."""
    return len({value(scene, path) for path in paths}) == 1


def factor_range(
    numbers: Sequence[float], low: float, high: float, largest: float = LARGEST_FACTOR
) -> tuple[float, float]:
    """Factors by which all of ``numbers`` stay within ``low`` … ``high``, at most ``largest``."""
    least = max((low / number for number in numbers if number > 0.0), default=1.0)
    most = min((high / number for number in numbers if number > 0.0), default=1.0)
    # To the slider's step, inwards.
    steps = 1.0 / LINEAR_STEP
    return min(1.0, math.ceil(steps * least) / steps), max(1.0, math.floor(steps * min(most, largest)) / steps)


def decades_around(number: float, low: float, high: float) -> tuple[int, int]:
    """Whole powers of ten at least ``DECADES`` to either side of ``number``, within those of ``low`` … ``high``."""
    bottom = max(math.floor(math.log10(number) - DECADES), math.floor(math.log10(low)))
    top = min(math.ceil(math.log10(number) + DECADES), math.ceil(math.log10(high)))
    return bottom, top


def decade_mark(power: int) -> str:
    """Text of a mark at 10^power, e.g. 2 → "100"; beyond that as a power: room is scarce at a slider's end."""
    return f"{10.0**power:g}" if power <= 2 else f"10{str(power).translate(SUPERSCRIPT)}"


class PairMatrix:
    """The matrix of the parameter ``name`` in a folder of its own."""

    def __init__(self, gui: viser.GuiApi, scene: Scene, name: str, post: Post, apply: Apply) -> None:
        self._name, self._apply = name, apply
        self._parameter = declared(Pair, "pair")[f"pair.{name}"]
        with gui.add_folder(f"{title(self._parameter)} of every pair (acts now)", expand_by_default=False):
            self._table = gui.add_html(matrix_html(scene, self._parameter, name))
            self._rows = [self._row(gui, scene, one, others) for one, others in triangle(scene)]
        for row in self._rows:
            self._listen(row, post)

    def follow(self, scene: Scene) -> None:
        """Show the solver's values, but not in a row that a person is at."""
        html = matrix_html(scene, self._parameter, self._name)
        if self._table.content != html:
            self._table.content = html
        for row in self._rows:
            numbers = self._numbers(scene, row.paths)
            if time.monotonic() < row.touched + HANDS_OFF or entries(row.handle.value) == numbers:
                continue
            row.shown, row.handle.value = numbers, numbers if len(numbers) > 1 else numbers[0]

    def _row(self, gui: viser.GuiApi, scene: Scene, one: str, others: tuple[str, ...]) -> PairRow:
        paths = tuple(f"pair.{one}.{other}.{self._name}" for other in others)
        numbers, (low, high) = self._numbers(scene, paths), screen_range(self._parameter)
        hint = f"{one} with {', '.join(others)}. {self._parameter.doc}"
        if len(numbers) == 1:
            return PairRow(
                gui.add_number(one, numbers[0], min=low, max=high, step=LINEAR_STEP, hint=hint), paths, numbers
            )
        add: Any = gui.add_vector2 if len(numbers) == 2 else gui.add_vector3
        ends = {"min": (low,) * len(numbers), "max": (high,) * len(numbers)}
        return PairRow(add(one, numbers, **ends, step=LINEAR_STEP, hint=hint), paths, numbers)

    def _numbers(self, scene: Scene, paths: tuple[str, ...]) -> tuple[float, ...]:
        return tuple(screen_unit(self._parameter).to_screen(float(value(scene, path))) for path in paths)

    def _listen(self, row: PairRow, post: Post) -> None:
        def entered(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is None:  # set by follow(), not by a person
                return
            row.touched = time.monotonic()
            sent = event.target.value
            post(lambda: self._take(row, sent))

        row.handle.on_update(entered)

    def _take(self, row: PairRow, sent: object) -> None:
        """Set those pairs of a row whose box shows another number than before."""
        low, high = screen_range(self._parameter)
        numbers = tuple(checked(number, low, high, title(self._parameter)) for number in entries(sent))
        if len(numbers) != len(row.paths):
            raise InputError(f"{title(self._parameter)}: {len(row.paths)} numbers are needed, not {len(numbers)}")
        unit = screen_unit(self._parameter)
        found = zip(row.paths, numbers, row.shown, strict=True)
        changed: dict[str, float | str] = {path: unit.to_si(new) for path, new, old in found if new != old}
        row.shown = numbers
        if changed:
            self._apply(changed)


@dataclass
class PairRow:
    """Boxes for the pairs of one material with some others."""

    handle: Any
    paths: tuple[str, ...]
    shown: tuple[float, ...]
    """What the boxes showed last, in the unit of the screen."""
    touched: float = -math.inf
    """Moment of a person's last input [s]."""


def pair_parameters() -> tuple[str, ...]:
    """Names of what pairs have, each with a matrix of its own."""
    return tuple(path.partition(".")[2] for path, parameter in declared(Pair, "pair").items() if parameter.live)


def entries(sent: object) -> tuple[Any, ...]:
    """What boxes hold, one or several."""
    return tuple(sent) if isinstance(sent, (tuple, list)) else (sent,)


def names_in_pairs(scene: Scene) -> tuple[str, ...]:
    """Materials (or bodies) that pairs name, in order of appearance."""
    return tuple(dict.fromkeys(name for pair in scene.pairs for name in (pair.a, pair.b)))


def triangle(scene: Scene) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Rows of the lower triangle: a name, and up to ``BOXES`` names that it has a pair with; none is left out."""
    names = names_in_pairs(scene)
    for k, one in enumerate(names):
        others = [other for other in names[: k + 1] if _pair(scene, one, other) is not None]
        for first in range(0, len(others), BOXES):
            yield one, tuple(others[first : first + BOXES])


def matrix_html(scene: Scene, parameter: Parameter, name: str) -> str:
    """The whole matrix as the solver has it; a dash where there is no such pair."""
    names = names_in_pairs(scene)
    style = "style='padding:0 0.5em; text-align:right; font-variant-numeric:tabular-nums'"
    head = "".join(f"<th {style}>{escape(other)}</th>" for other in names)
    rows = []
    for one in names:
        pairs = (_pair(scene, one, other) for other in names)
        cells = ("–" if pair is None else quantity(getattr(pair, name), parameter.unit) for pair in pairs)
        rows.append(f"<tr><th {style}>{escape(one)}</th>{''.join(f'<td {style}>{cell}</td>' for cell in cells)}</tr>")
    table = f"<table><tr><th></th>{head}</tr>{''.join(rows)}</table>"
    return small_html(f"In the solver:<div style='overflow-x:auto; overflow-wrap:normal'>{table}</div>")


def _pair(scene: Scene, one: str, other: str) -> Pair | None:
    return next((pair for pair in scene.pairs if pair.joins(one, other)), None)
