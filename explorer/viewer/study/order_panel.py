"""The order for the next study: ranges of its factors and the target, as in the file or changed here."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import viser

from doe.studies.study import Factor, Study
from explorer.photograph.target import OBSERVABLE
from explorer.study.edit import RANGE_KEYS, StudyEdits, edited_study, listed_edits
from explorer.units import checked, number, observable_label, parameter_label, unit_of_observable, unit_of_parameter
from explorer.viewer.actions import Action, Post
from explorer.viewer.number_box import with_decimals
from explorer.viewer.study.process_view import escaped
from explorer.viewer.tables.ranges_page import Range, RangeRow
from solver import parameters

TARGET_WORDS = {"mean": "mean", "sd": "SD", "margin": "counts as met within ±"}
MEASURED_KEYS = ("mean", "sd", "n")
"""Keys of a target that photographs give."""
COLUMNS = "Low, high and measured value of each factor; the study starts from these ranges."
LARGEST = 1e12
"""Largest number in a target."""


class OrderPanel:
    """Low, high and reference of every factor in a row of its own, and the first target; ``edits`` holds the changes.

    ``study`` is that of ``file``, None if it cannot be read.
    """

    def __init__(self, server: viser.ViserServer, file: Path, study: Study | None, post: Post) -> None:
        gui = server.gui
        self._file, self._study = file, study
        self._ranges: dict[str, dict[str, float]] = {}
        self._target: dict[str, float] = {}
        self._photographed: tuple[str, ...] = ()
        self._told = gui.add_markdown("")
        self._rows: dict[str, Any] = {}
        self._goal: dict[str, Any] = {}
        if self._study is None:
            self._told.content = f"{escaped(str(file))} cannot be read; start it to see why."
            return
        self._add_target(gui)
        gui.add_markdown(COLUMNS)
        self._rows = {factor.name: self._row(gui, factor) for factor in self._study.factors}
        back = gui.add_button("Reset to file")
        for name, handle in self._rows.items():
            handle.on_update(lambda event, name=name: self._posted(post, event, lambda: self._take_range(name)))
        for handle in self._goal.values():
            handle.on_update(lambda event: self._posted(post, event, self._take_target))
        back.on_click(lambda _: post(self._forget))
        self._tell()

    @property
    def edits(self) -> StudyEdits:
        """What differs from the file; SI. Photographs take precedence for what they measured."""
        target = {key: value for key, value in self._target.items() if key not in self._photographed}
        return StudyEdits({name: dict(values) for name, values in self._ranges.items()}, target)

    def follow(self, photographed: bool) -> None:
        """Show mean, SD and number of the target only while they come from the file."""
        first = OBSERVABLE if self._study is None else self._study.targets[0].observable
        hidden = MEASURED_KEYS if photographed and first == OBSERVABLE else ()
        if hidden == self._photographed:
            return
        self._photographed = hidden
        for key, handle in self._goal.items():
            handle.visible = key not in hidden
        if self._study is not None:
            self._tell()

    @staticmethod
    def _posted(post: Post, event: viser.GuiEvent[Any], act: Action) -> None:
        if event.client_id is not None:  # not what the panel itself sets
            post(act)

    def _add_target(self, gui: viser.GuiApi) -> None:
        assert self._study is not None
        target = self._study.targets[0]
        unit = unit_of_observable(target.observable)
        symbol = f" [{unit.symbol}]" if unit.symbol else ""
        name = observable_label(target.observable)
        for key, word in TARGET_WORDS.items():
            value = getattr(target, key)
            if value is not None:
                label = f"Target: {word}{symbol}"
                shown = float(number_on_screen(unit.of(value)))
                self._goal[key] = with_decimals(gui.add_number(label, shown, hint=f"Of {name}."))
        if target.n is not None:
            hint = f"Number of measured piles behind the mean and the SD of {name}."
            self._goal["n"] = gui.add_number("Target: measured piles", target.n, min=2, step=1, hint=hint)

    def _row(self, gui: viser.GuiApi, factor: Factor) -> Any:
        """Three boxes for one factor."""
        symbol = unit_of_parameter(factor.path).symbol
        label = f"{factor.name} · {parameter_label(factor.path)}{f' [{symbol}]' if symbol else ''}"
        return with_decimals(gui.add_vector3(label, self._in_file(factor), hint=COLUMNS))

    def _in_file(self, factor: Factor) -> tuple[float, float, float]:
        unit = unit_of_parameter(factor.path)
        low, high, reference = (number_on_screen(unit.of(float(getattr(factor, key)))) for key in RANGE_KEYS)
        return low, high, reference

    def ranges(self) -> list[RangeRow]:
        """Every factor at present, in displayed units."""
        if self._study is None:
            return []
        return [
            RangeRow(
                one.name, parameter_label(one.path), unit_of_parameter(one.path).symbol, _shown(self._rows[one.name])
            )
            for one in self._study.factors
        ]

    def take_ranges(self, ranges: Mapping[str, Range]) -> None:
        """Take low, high and measured value of factors, in displayed units; all of them, or none."""
        changed = {name: self._changed(name, sent) for name, sent in ranges.items()}
        self._ranges = {name: values for name, values in (self._ranges | changed).items() if values}
        for name, sent in ranges.items():
            self._rows[name].value = sent
        self._tell()

    def _take_range(self, name: str) -> None:
        """Read one row."""
        self._ranges[name] = self._changed(name, self._rows[name].value)
        self._tell()

    def _changed(self, name: str, sent: Range) -> dict[str, float]:
        """The parts of a range that differ from the file; SI."""
        assert self._study is not None
        factor = next(one for one in self._study.factors if one.name == name)
        unit, declared = unit_of_parameter(factor.path), parameters(self._study.scene)[factor.path]
        changed = {}
        for key, value, before in zip(RANGE_KEYS, sent, self._in_file(factor), strict=True):
            entered = checked(value, unit.of(declared.low), unit.of(declared.high), f"{factor.name} {key}")
            if number_on_screen(entered) != before:
                changed[key] = min(max(entered * unit.size, declared.low), declared.high)
        return changed

    def _take_target(self) -> None:
        """Read the target."""
        assert self._study is not None
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
        for factor in self._study.factors:
            self._rows[factor.name].value = self._in_file(factor)
        target = self._study.targets[0]
        size = unit_of_observable(target.observable).size
        for key, handle in self._goal.items():
            handle.value = getattr(target, key) if key == "n" else number_on_screen(getattr(target, key) / size)
        self._tell()

    def _tell(self) -> None:
        assert self._study is not None
        edits = self.edits
        if not edits:
            what = "Ranges are those of the file, the target that of the photographs."
            what = what if self._photographed else "Ranges and target are those of the file."
            self._told.content = f"{what} What is changed here holds for the next start."
            return
        text = edits_markdown(self._study, edits)
        try:
            edited_study(self._file, edits)
        except ValueError as error:
            text += f"\n\n**This study cannot start:** {escaped(str(error))}"
        self._told.content = text


def _shown(handle: Any) -> Range:
    low, high, measured = handle.value
    return float(low), float(high), float(measured)


def edits_markdown(study: Study, edits: StudyEdits) -> str:
    """A table of the changes: value in the file, value now."""
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
    """``value`` to six digits, as a number box shows it."""
    return float(f"{value:.6g}")
