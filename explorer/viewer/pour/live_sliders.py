"""Sliders of the running pour: made from the declaration of a live parameter, with its range, unit and scale.

A parameter declares its range (``param(low=…, high=…)`` beside its default); a slider shows all of it, on a linear or a
logarithmic scale, or as a factor if it controls several values that differ.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import viser

from explorer.units import checked, screen_unit, title
from explorer.viewer.actions import Post, SharedBox
from explorer.viewer.number_box import with_decimals
from solver.params import Parameter
from solver.scenes.scene import Scene, value

Apply = Callable[[Mapping[str, float | str]], None]
"""Hands new values (SI, by path) to the solver."""

LINEAR_STEP = 0.01
POWER_DIGITS = 2
"""Decimals of a power of ten: as fine as the slider's step, and no more than its box can show."""
LARGEST_FACTOR, LARGEST_POWER = 4.0, 100.0
"""Largest factor by which differing values are scaled at once, on a linear and on a logarithmic slider."""
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
DECADES = 1.0
"""A logarithmic slider reaches this far to either side of the present value, then out to whole decades."""


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
        self._faces = self._made(gui, scene)
        for face in self._faces:
            self._listen(face, post, apply)

    def fits(self, scene: Scene) -> bool:
        """Whether this kind of control is the one for ``scene``; always while the user is moving it."""
        return self._held or agree(scene, self._paths)

    def follow(self, scene: Scene) -> None:
        """Move to the solver's value, unless the user is moving the control."""
        if self._held:
            return
        number = self._number(scene)
        for face in self._faces:
            shown = face.shown(number)
            if not math.isclose(face.box.value, shown, rel_tol=1e-9, abs_tol=1e-9):
                face.box.show(shown)

    def remove(self) -> None:
        """Remove the control from the page."""
        for face in self._faces:
            face.box.handle.remove()

    @property
    def _held(self) -> bool:
        return any(face.box.held() for face in self._faces)

    def _made(self, gui: viser.GuiApi, scene: Scene) -> tuple[Face, ...]:
        faces = log_faces if self._parameter.scale == "log" else linear_faces
        return faces(gui, self._parameter, self._number(scene), self._label)

    def _number(self, scene: Scene) -> float:
        return screen_unit(self._parameter).to_screen(float(value(scene, self._paths[0])))

    def _listen(self, face: Face, post: Post, apply: Apply) -> None:
        face.box.listen(post, lambda number: apply(self._values(face.read(number))))

    def _values(self, number: float) -> Mapping[str, float | str]:
        return dict.fromkeys(self._paths, screen_unit(self._parameter).to_si(number))


class ScalingControl(LiveControl):
    """One parameter at ``paths``, whose values differ: scaled together by a factor, so that their ratios stay.

    The factor is counted from the values as they were when the control was made, so that even from 0 it leads back.
    """

    def fits(self, scene: Scene) -> bool:
        """Whether the values are still those that the factor is counted from, or the user is moving the control."""
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
            return (Face(SharedBox(slider), math.log10, lambda entered: 10.0 ** checked(entered, bottom, top, name)),)
        slider = gui.add_slider(f"{name} ×", low, high, LINEAR_STEP, 1.0, hint=hint)
        return (Face(SharedBox(slider), lambda factor: factor, lambda entered: checked(entered, low, high, name)),)

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
    """One widget of a control. Numbers are in the displayed unit."""

    box: SharedBox
    shown: Callable[[float], float]
    """Number → value of the widget."""
    read: Callable[[object], float]
    """Value that came from a browser → number within the range; raises InputError."""


def linear_faces(gui: viser.GuiApi, parameter: Parameter, start: float, label: str = "") -> tuple[Face, ...]:
    """A slider over the declared range, titled ``label`` or with the parameter's title."""
    name, (low, high) = titled(parameter, label), screen_range(parameter)
    slider = gui.add_slider(name, low, high, LINEAR_STEP, start, hint=parameter.doc)
    return (Face(SharedBox(slider), lambda number: number, lambda entered: checked(entered, low, high, name)),)


def log_faces(gui: viser.GuiApi, parameter: Parameter, start: float, label: str = "") -> tuple[Face, ...]:
    """A number box in the displayed unit, titled ``label`` or with the parameter's title, and below it a slider over
    its power of ten.
    """
    name, (low, high) = titled(parameter, label), screen_range(parameter)
    unit = screen_unit(parameter).symbol
    bottom, top = decades_around(start, low, high)

    def power_of(number: float) -> float:
        return min(max(round(math.log10(number), POWER_DIGITS), bottom), top)

    box = with_decimals(gui.add_number(name, start, min=low, max=high, hint=parameter.doc))
    slider = gui.add_slider(
        f"log₁₀ {unit or name}",
        float(bottom),
        float(top),
        LINEAR_STEP,
        power_of(start),
        marks=tuple((power, decade_mark(power)) for power in range(bottom, top + 1)),
        hint=f"As a power of ten. {parameter.doc}",
    )

    def number_from(power: object) -> float:
        return min(max(10.0 ** checked(power, bottom, top, name), low), high)

    read = Face(SharedBox(box), lambda number: number, lambda entered: checked(entered, low, high, name))
    return read, Face(SharedBox(slider), power_of, number_from)


def titled(parameter: Parameter, label: str) -> str:
    """``label`` with the unit of ``parameter``; its own title where there is none."""
    unit = screen_unit(parameter).symbol
    return title(parameter) if not label else f"{label} [{unit}]" if unit else label


def screen_range(parameter: Parameter) -> tuple[float, float]:
    """Range of ``parameter`` in the displayed unit."""
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
