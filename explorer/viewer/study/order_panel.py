"""What the next study is asked for: ranges of its factors and the target, as in the file or changed here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import viser

from doe.studies.study import Factor, Study
from explorer.study.edit import RANGE_KEYS, StudyEdits, edited_study, listed_edits
from explorer.units import checked, number, observable_label, parameter_label, unit_of_observable, unit_of_parameter
from explorer.viewer.actions import Post
from explorer.viewer.study.process_view import escaped
from solver import parameters

WORDS = {"low": "Low", "high": "High", "reference": "Measured", "mean": "Target", "sd": "Its sd", "margin": "Margin"}
LARGEST = 1e12
"""No number of a target is beyond this."""


class OrderPanel:
    """Inputs for one factor at a time, and for the first target; ``edits`` is what was changed.

    ``study`` is that of ``file``, None where it cannot be read.
    """

    def __init__(self, server: viser.ViserServer, file: Path, study: Study | None, post: Post) -> None:
        gui = server.gui
        self._file, self._study = file, study
        self._ranges: dict[str, dict[str, float]] = {}
        self._target: dict[str, float] = {}
        self._told = gui.add_markdown("")
        self._inputs: dict[str, Any] = {}
        self._goal: dict[str, Any] = {}
        if self._study is None:
            self._told.content = f"{escaped(str(file))} cannot be read; start it to see why."
            return
        self._factors = {f"{f.name} · {parameter_label(f.path)}": f for f in self._study.factors}
        self._choice = gui.add_dropdown("Factor", tuple(self._factors), hint="Its range, from which the study starts.")
        first = self._study.factors[0]
        self._inputs = {key: gui.add_number(WORDS[key], self._shown(first, key)) for key in RANGE_KEYS}
        self._label()
        self._add_target(gui)
        back = gui.add_button("All as in the file")
        self._choice.on_update(lambda event: post(self._show_factor) if event.client_id is not None else None)
        for handle in (*self._inputs.values(), *self._goal.values()):
            handle.on_update(lambda event: post(self._take) if event.client_id is not None else None)
        back.on_click(lambda _: post(self._forget))
        self._tell()

    @property
    def edits(self) -> StudyEdits:
        """What is asked otherwise than in the file; SI."""
        return StudyEdits({name: dict(values) for name, values in self._ranges.items()}, dict(self._target))

    def _add_target(self, gui: viser.GuiApi) -> None:
        assert self._study is not None
        target = self._study.targets[0]
        unit = unit_of_observable(target.observable)
        words = f"{observable_label(target.observable)}{f' [{unit.symbol}]' if unit.symbol else ''}"
        for key in ("mean", "sd", "margin"):
            value = getattr(target, key)
            if value is not None:
                self._goal[key] = gui.add_number(WORDS[key], float(number_on_screen(unit.of(value))), hint=words)
        if target.n is not None:
            self._goal["n"] = gui.add_number("Measurements", target.n, min=2, step=1, hint="Number of measured piles.")

    def _factor(self) -> Factor:
        assert self._study is not None
        return self._factors.get(str(self._choice.value), self._study.factors[0])

    def _shown(self, factor: Factor, key: str) -> float:
        value = self._ranges.get(factor.name, {}).get(key, float(getattr(factor, key)))
        return number_on_screen(unit_of_parameter(factor.path).of(value))

    def _show_factor(self) -> None:
        for key, handle in self._inputs.items():
            handle.value = self._shown(self._factor(), key)
        self._label()

    def _label(self) -> None:
        symbol = unit_of_parameter(self._factor().path).symbol
        for key, handle in self._inputs.items():
            handle.label = f"{WORDS[key]} [{symbol}]" if symbol else WORDS[key]

    def _take(self) -> None:
        """Read the inputs; what stands there as in the file is no change."""
        assert self._study is not None
        factor = self._factor()
        unit, declared = unit_of_parameter(factor.path), parameters(self._study.scene)[factor.path]
        changed = {}
        for key, handle in self._inputs.items():
            entered = checked(handle.value, unit.of(declared.low), unit.of(declared.high), f"{factor.name} {key}")
            if entered != number_on_screen(unit.of(float(getattr(factor, key)))):
                changed[key] = min(max(entered * unit.size, declared.low), declared.high)
        self._ranges[factor.name] = changed
        target = self._study.targets[0]
        size = unit_of_observable(target.observable).size
        self._target = {}
        for key, handle in self._goal.items():
            entered = checked(handle.value, -LARGEST, LARGEST, f"target {key}")
            scale = 1.0 if key == "n" else size
            if entered != number_on_screen(getattr(target, key) / scale):
                self._target[key] = entered * scale
        self._tell()

    def _forget(self) -> None:
        assert self._study is not None
        self._ranges, self._target = {}, {}
        self._show_factor()
        target = self._study.targets[0]
        size = unit_of_observable(target.observable).size
        for key, handle in self._goal.items():
            handle.value = getattr(target, key) if key == "n" else number_on_screen(getattr(target, key) / size)
        self._tell()

    def _tell(self) -> None:
        assert self._study is not None
        edits = self.edits
        if not edits:
            self._told.content = (
                "Ranges and target are those of the file. What is changed here holds for the next start."
            )
            return
        text = edits_markdown(self._study, edits)
        try:
            edited_study(self._file, edits)
        except ValueError as error:
            text += f"\n\n**This study cannot start:** {escaped(str(error))}"
        self._told.content = text


def edits_markdown(study: Study, edits: StudyEdits) -> str:
    """A table of what is changed: in the file, now."""
    paths = {factor.name: factor.path for factor in study.factors}
    rows = []
    for whose, key, before, after in listed_edits(study, edits):
        unit = unit_of_observable(study.targets[0].observable) if whose == "target" else unit_of_parameter(paths[whose])
        old, new = (
            number(float(v)) if key == "n" else unit.attach(number(unit.of(float(v)), 4))
            for v in (before or 0.0, after)
        )
        rows.append(f"| {escaped(whose)} {escaped(key)} | {old} | {new} |")
    return "| Changed | in the file | now |\n|:--|--:|--:|\n" + "\n".join(rows)


def number_on_screen(value: float) -> float:
    """Six digits: what a number box shows."""
    return float(f"{value:.6g}")
