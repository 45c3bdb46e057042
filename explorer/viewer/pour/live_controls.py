"""Sliders made from the declarations of live parameters: one control moves one parameter of one or many things."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import viser

from explorer.units import checked, screen_unit, title
from explorer.viewer.actions import Post
from solver.params import Parameter
from solver.scenes.scene import Scene, value

Apply = Callable[[Mapping[str, float | str]], None]
"""Hands new values (SI, by path) to the solver."""

LINEAR_STEP = 0.01
POWER_DIGITS = 2
"""Decimals of a power of ten: as fine as the slider's step, and no more than its box can show."""
DECADES = 1.0
"""A logarithmic slider reaches this far to either side of the present value, then out to whole decades."""
HANDS_OFF = 1.5
"""Seconds after a person's input during which the solver's echo does not move the control."""


@dataclass(frozen=True)
class Face:
    """One widget of a control. Numbers are in the unit of the screen."""

    handle: Any
    shown: Callable[[float], float]
    """Number → value of the widget."""
    read: Callable[[object], float]
    """Value that came from a browser → number within the range; raises InputError."""


class LiveControl:
    """One parameter at ``paths``, set together; follows what the solver has in force."""

    def __init__(
        self,
        gui: viser.GuiApi,
        parameter: Parameter,
        paths: Sequence[str],
        scene: Scene,
        post: Post,
        apply: Apply,
    ) -> None:
        self._parameter, self._paths = parameter, tuple(paths)
        self._touched = -math.inf
        faces = log_faces if parameter.scale == "log" else linear_faces
        self._faces = faces(gui, parameter, self._number(scene))
        for face in self._faces:
            self._listen(face, post, apply)

    def follow(self, scene: Scene) -> None:
        """Move to the solver's value, unless a person is at the control."""
        if time.monotonic() < self._touched + HANDS_OFF:
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

    def _number(self, scene: Scene) -> float:
        return screen_unit(self._parameter).to_screen(
            mean_value(scene, self._paths, geometric=self._parameter.scale == "log")
        )

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


def linear_faces(gui: viser.GuiApi, parameter: Parameter, start: float) -> tuple[Face, ...]:
    """A slider over the declared range."""
    name, (low, high) = title(parameter), screen_range(parameter)
    slider = gui.add_slider(name, low, high, LINEAR_STEP, start, hint=parameter.doc)
    return (Face(slider, lambda number: number, lambda entered: checked(entered, low, high, name)),)


def log_faces(gui: viser.GuiApi, parameter: Parameter, start: float) -> tuple[Face, ...]:
    """A number box in the unit of the screen, and below it a slider over its power of ten."""
    name, (low, high) = title(parameter), screen_range(parameter)
    unit = screen_unit(parameter).name
    bottom, top = decades_around(start, low, high)

    def power_of(number: float) -> float:
        return min(max(round(math.log10(number), POWER_DIGITS), bottom), top)

    box = gui.add_number(name, start, min=low, max=high, hint=parameter.doc)
    slider = gui.add_slider(
        f"log₁₀ of {unit or name}",
        float(bottom),
        float(top),
        LINEAR_STEP,
        power_of(start),
        marks=tuple((power, decade_mark(power, unit)) for power in range(bottom, top + 1)),
        hint=f"The same value as a power of ten. {parameter.doc}",
    )

    def number_from(power: object) -> float:
        return min(max(10.0 ** checked(power, bottom, top, name), low), high)

    return (
        Face(box, lambda number: number, lambda entered: checked(entered, low, high, name)),
        Face(slider, power_of, number_from),
    )


def screen_range(parameter: Parameter) -> tuple[float, float]:
    """Range of ``parameter`` in the unit of the screen."""
    unit = screen_unit(parameter)
    return unit.to_screen(parameter.low), unit.to_screen(parameter.high)


def mean_value(scene: Scene, paths: Sequence[str], geometric: bool = False) -> float:
    """Arithmetic or geometric mean of the parameters at ``paths`` [SI]: where a slider for all of them
    stands.

    The value itself where they agree; otherwise three digits, since no thing has that value.
    """
    values = [float(value(scene, path)) for path in paths]
    if min(values) == max(values):
        return values[0]
    if geometric:
        return float(f"{math.exp(sum(math.log(number) for number in values) / len(values)):.3g}")
    return float(f"{sum(values) / len(values):.3g}")


def decades_around(number: float, low: float, high: float) -> tuple[int, int]:
    """Whole powers of ten at least ``DECADES`` to either side of ``number``, within those of ``low`` … ``high``."""
    bottom = max(math.floor(math.log10(number) - DECADES), math.floor(math.log10(low)))
    top = min(math.ceil(math.log10(number) + DECADES), math.ceil(math.log10(high)))
    return bottom, top


def decade_mark(power: int, unit: str) -> str:
    """Text of a mark at 10^power, e.g. 2, "MPa" → "100"; from a thousand MPa on in GPa."""
    if unit == "MPa" and power >= 3:
        return f"{10 ** (power - 3)} GPa"
    return f"{10.0**power:g}"
