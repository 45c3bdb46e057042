"""Diagnoses in the background: the command line's ``diagnose``, run by `explorer.background.command_process`.

One runs at a time; others wait (`explorer.background.orders`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from doe.declared.budget import scaled_budget
from doe.measurement.load import load_measurement
from explorer.background.command_process import PROGRAM, BackgroundError, CommandProcess, PourPlace
from explorer.background.orders import BackgroundOrders, OrderedCommands
from explorer.background.output_folder import new_folder, newest_unfinished
from explorer.diagnosis.result import DiagnosisResult
from solver import EFFECTS
from solver.assets import measurement_folder, shipped_measurements

RESULT = DiagnosisResult.NAME
OWN, FURTHER, FOLLOWED = "-own", "-further", "-followed"
"""Suffixes of the data's name in the name of an output folder: for data that only share a shipped set's name, for a
diagnosis that continues another one, and for one with a follow-up."""


@dataclass(frozen=True)
class Question:
    """What a diagnosis is asked. ``data``: folder of measured data, or a shipped name; ``effects``: the candidates, all
    if empty; ``budget``: approximate number of pours for the emulator, None for the program's own choice; ``given``:
    folder of a finished diagnosis whose effect is in the model, "" for none; ``follow_up``: folder of a follow-up that
    is filled in, "" for none.
    """

    data: str
    effects: tuple[str, ...] = ()
    budget: int | None = None
    given: str = ""
    follow_up: str = ""


class DiagnosisProcess(BackgroundOrders, Protocol):
    """What the page needs of diagnoses, wherever they run."""

    @property
    def store(self) -> Path | None:
        """File of the store of runs, also used for the page's other pours; None for the default store."""

    def start(self, question: Question) -> None:
        """Start a new diagnosis. Raises a ValueError if one is running already or the question cannot be asked."""

    def queue(self, question: Question) -> None:
        """Start it after those already queued; at once if none runs and none waits."""

    def resume(self, question: Question) -> None:
        """Continue the newest stopped diagnosis of these data. Raises a ValueError if there is none."""

    def stopped(self, question: Question) -> Path | None:
        """The folder in which :meth:`resume` continues; None if there is nothing to continue."""


class DiagnoseProcess(OrderedCommands[Question]):
    """``explorer diagnose`` as a child process.

    Args:
        folder: where output folders are made, one per start: ``<data>-<date>-<time>``.
        store: file of the store of runs; None for the default store.
        program: how the command line is called.
        place: where diagnoses that are started or resumed from then on do their pours; None for this machine.
    """

    def __init__(
        self,
        folder: Path,
        store: Path | None = None,
        program: Sequence[str] = PROGRAM,
        place: PourPlace | None = None,
    ) -> None:
        super().__init__(CommandProcess("diagnosis", {0: "report"}, program), folder, RESULT, "diagnoses")
        self.store, self._place = store, place or PourPlace()

    def start(self, question: Question) -> None:
        """Start a new diagnosis."""
        checked = _checked(question)
        self._process.refuse_while_running()
        self._begin(checked)

    def queue(self, question: Question) -> None:
        """Start it when those queued before it have ended."""
        self._add(_checked(question))

    def resume(self, question: Question) -> None:
        """Continue the newest diagnosis of these data that was stopped, even one of an earlier session of the page.

        Effects and budget are those of ``question``; pours made for others stay in the store.
        """
        checked = _checked(question)
        self._process.refuse_while_running()
        out = self.stopped(checked)
        if out is None:
            raise BackgroundError(f"no diagnosis of {Path(checked.data).name} was stopped before its end")
        self._go_on_in(out, self._arguments(checked, out))

    def stopped(self, question: Question) -> Path | None:
        """Folder of the newest diagnosis of these data that was stopped before its end; None if there is none."""
        found = newest_unfinished(self._folder, (_stem(question.data),), RESULT)
        return None if found is None else found[0]

    def _begin(self, question: Question) -> None:
        # A diagnosis that continues another, or has a follow-up, is not resumed by its data's name; when it is started
        # again, it finds its pours in the store.
        behind = FOLLOWED if question.follow_up else FURTHER if question.given else ""
        out = new_folder(self._folder, _stem(question.data) + behind)
        self._start(out, self._arguments(question, out))

    def _in_words(self, question: Question) -> str:
        """Name of its data, and what differs from the default question."""
        few = f", {len(question.effects)} effects" if question.effects else ""
        pours = "" if question.budget is None else f", about {question.budget} pours"
        given = f", going on from {Path(question.given).name}" if question.given else ""
        followed = ", with its follow-up" if question.follow_up else ""
        return f"{Path(question.data).name}{few}{pours}{given}{followed}"

    def _arguments(self, question: Question, out: Path) -> list[str]:
        """The command line that is run, as a person would type it."""
        store = () if self.store is None else ("--store", str(self.store))
        effects = ("--effects", ",".join(question.effects)) if question.effects else ()
        budget = () if question.budget is None else ("--budget", str(question.budget))
        given = ("--given", question.given) if question.given else ()
        follow_up = ("--follow-up", question.follow_up) if question.follow_up else ()
        asked = (*effects, *budget, *given, *follow_up, *store, *self._place.arguments)
        return ["diagnose", question.data, "--out", str(out), "--apply", *asked]


def _stem(data: str) -> str:
    """Beginning of the names of output folders of these data: their name, plus OWN if a shipped set has it too."""
    folder, name = Path(data).absolute(), Path(data).name
    own = name != data and name in shipped_measurements() and folder != measurement_folder(name).absolute()
    return name + (OWN if own else "")


def _checked(question: Question) -> Question:
    """The question with the folder of its data; raises a ValueError if it cannot be asked."""
    if not question.data.strip():
        raise BackgroundError("choose measured data, or name their folder")
    for name in question.effects:
        if name not in EFFECTS:
            raise BackgroundError(f"effects: {name!r} is not one of {', '.join(EFFECTS)}")
    folder = measurement_folder(question.data.strip()).absolute()
    if question.budget is not None:
        # Checked here, before a process is started for it.
        scaled_budget(question.budget, load_measurement(folder), question.effects or tuple(EFFECTS))
    return replace(question, data=str(folder))
