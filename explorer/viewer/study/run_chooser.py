"""Any run of a study, poured again on the page."""

from __future__ import annotations

from typing import Any

import viser

from doe.run_records import Run
from doe.studies.study_result import AnyStudy
from explorer.errors import CommandError
from explorer.outcomes import outcome_text
from explorer.session import Session
from explorer.study.runs import scene_of, settings_of, stages_with_runs
from explorer.units import observable_label, observed, parameter_label, parameter_value
from explorer.viewer.actions import Post
from explorer.viewer.study.process_view import escaped

NONE = "(no runs yet)"
CHANGES_SHOWN = 8


class RunChooser:
    """Stage, run, what stands behind it, and a button."""

    def __init__(self, server: viser.ViserServer, session: Session, post: Post) -> None:
        gui = server.gui
        self._session = session
        self._result: AnyStudy | None = None
        self._runs: dict[str, Run] = {}
        self._stage = gui.add_dropdown("Stage", (NONE,))
        self._run = gui.add_dropdown("Run", (NONE,), hint="Setting, seed, and what was read off the pile.")
        self._words = gui.add_markdown("")
        button = gui.add_button("Pour this run here", hint="Begins the live pour anew with this run's scene and seed.")
        self._stage.on_update(lambda event: post(self._show_stage) if event.client_id is not None else None)
        self._run.on_update(lambda event: post(self._tell) if event.client_id is not None else None)
        button.on_click(lambda _: post(self._pour))

    def show(self, result: AnyStudy | None) -> None:
        """Follow the result that the page shows."""
        self._result = result
        begun = () if result is None else stages_with_runs(result)
        _offer(self._stage, begun or (NONE,))
        self._show_stage()

    def _show_stage(self) -> None:
        self._runs = {} if self._result is None else listed(self._result, str(self._stage.value))
        _offer(self._run, tuple(self._runs) or (NONE,))
        self._tell()

    def _chosen(self) -> Run | None:
        return self._runs.get(str(self._run.value))

    def _tell(self) -> None:
        run = self._chosen()
        text = "" if run is None or self._result is None else run_markdown(self._result, str(self._stage.value), run)
        if self._words.content != text:
            self._words.content = text

    def _pour(self) -> None:
        run = self._chosen()
        if run is None or self._result is None:
            raise CommandError("no run is chosen; start a study, or choose a finished one above")
        scene, same = scene_of(self._result, str(self._stage.value), run)
        self._session.restart(scene, run.seed)
        note = "" if same else (
            "\n\nProgram, study file or material have changed since that run: this pour need not be the same."
        )  # fmt: skip
        self._words.content = run_markdown(self._result, str(self._stage.value), run) + note


def listed(result: AnyStudy, stage: str) -> dict[str, Run]:
    """Runs of a stage under the texts to choose them by."""
    name = result.study.targets[0].observable
    begun = stages_with_runs(result)  # the list holds a text of its own before a stage has begun
    return {run_text(run, name): run for runs in (result.runs_of(stage) if stage in begun else ()) for run in runs}


def run_text(run: Run, observable: str) -> str:
    """One run in a line, e.g. "row 3 · 24.3° · seed 17"."""
    value = run.observables.get(observable)
    seen = observed(observable, value) if value is not None and run.valid else ""
    return " · ".join(part for part in (run.label, seen or outcome_text(run.outcome), f"seed {run.seed}") if part)


def run_markdown(result: AnyStudy, stage: str, run: Run) -> str:
    """What was set in a run and what came out."""
    name = result.study.targets[0].observable
    settings = settings_of(result, stage, run.label)
    parts = [f"{escaped(parameter_label(path))} {escaped(parameter_value(path, v))}" for path, v in settings.items()]
    more = f" and {len(parts) - CHANGES_SHOWN} more" if len(parts) > CHANGES_SHOWN else ""
    setting = f"{', '.join(parts[:CHANGES_SHOWN])}{more}" if parts else "everything at the reference values"
    seen = f"{escaped(observable_label(name))} {escaped(observed(name, run.observables.get(name)))}"
    return f"{escaped(outcome_text(run.outcome))}; {seen}. Set: {setting}."


def _offer(dropdown: Any, options: tuple[str, ...]) -> None:
    if tuple(dropdown.options) != options:
        dropdown.options = options
