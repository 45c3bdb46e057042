"""How far a project is, step by step from the material to the report, and what is next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from doe.target import Target
from explorer.background.command_process import CommandStatus
from explorer.live.messages import SessionState, Status
from explorer.outcomes import OUTCOME_WORDS
from explorer.photograph.target import PhotographedTarget
from explorer.units import observable_label, observed
from solver.pours.record import Outcome
from solver.scenes.scene import Scene


class StepState(StrEnum):
    """How far a step is."""

    EMPTY = "empty"
    ASSUMED = "assumed"
    """It rests on values that nobody measured."""
    MEASURED = "measured"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"


class Room(StrEnum):
    """Tabs of the page that a step leads to."""

    CONTROLS = "Controls"
    SET_UP = "Set-up"
    LOOK = "Look"
    EXPORT = "Export"
    POUR = "Pour"
    CALIBRATE = "Calibrate"
    DIAGNOSE = "Diagnose"
    LABORATORY = "Laboratory"
    REPORTS = "Reports"


@dataclass(frozen=True)
class Step:
    """One step of a project."""

    name: str
    state: StepState
    said: str
    """A word or a number about it, such as "25.1 ± 1.2°"; may be empty."""
    hint: str
    """What the step is, in a sentence."""
    room: Room
    """Tab in which the step is done."""


STOPPED = "stopped with an error"
"""Text for a command that broke off."""


@dataclass(frozen=True)
class Finished:
    """The newest finished study or diagnosis of a project."""

    said: str
    """Its verdict in a few words."""
    succeeded: bool
    report: bool
    """Whether a report was written."""


def material_step(scene: Scene) -> Step:
    """The step of the material: how many of its values are assumed."""
    n = len(scene.assumed)
    state, said = (StepState.ASSUMED, f"{n} assumed") if n else (StepState.MEASURED, "")
    return Step(
        "Material", state, said, "Parameters of the material: density, stiffness, friction, shape.", Room.SET_UP
    )


def measured_step(targets: Sequence[Target], photographed: PhotographedTarget | None = None) -> Step:
    """The step of the measured pile: the photographs that serve as the target, or the study's first target."""
    hint = "What was measured in the laboratory: the target of the calibration."
    if photographed is not None:
        # One pile says nothing about how piles differ.
        state = StepState.MEASURED if photographed.n > 1 else StepState.ASSUMED
        return Step("Measured", state, photographed.short, f"{hint} {photographed.line}", Room.LABORATORY)
    if not targets:
        return Step("Measured", StepState.EMPTY, "", hint, Room.LABORATORY)
    target = targets[0]
    spread = "" if target.sd is None else f" ± {observed(target.observable, target.sd)}"
    measured = target.sd is not None and target.sd_source == "measured"
    state = StepState.MEASURED if measured else StepState.ASSUMED
    hint += f" Mean ± SD of {observable_label(target.observable)}." if spread else ""
    hint += "".join(f" Also {observable_label(other.observable)}." for other in targets[1:])
    return Step("Measured", state, f"{observed(target.observable, target.mean)}{spread}", hint, Room.LABORATORY)


def pour_step(status: Status) -> Step:
    """The step of the live pour."""
    hint = "The pour in the scene: one pile of this material."
    if status.state in (SessionState.FAILED, SessionState.DIED):
        return Step("Pour", StepState.FAILED, "solver stopped", hint, Room.POUR)
    if status.outcome == Outcome.RUNNING:
        said = "starting" if status.state == SessionState.STARTING else ""
        return Step("Pour", StepState.RUNNING, said, hint, Room.POUR)
    if not status.outcome.valid:
        return Step("Pour", StepState.FAILED, OUTCOME_WORDS.get(status.outcome, str(status.outcome)), hint, Room.POUR)
    angle = status.observables.get("angle_of_repose_deg")
    return Step("Pour", StepState.DONE, "" if angle is None else f"{angle.value:.1f}°", hint, Room.POUR)


def command_step(name: str, hint: str, room: Room, status: CommandStatus, finished: Finished | None) -> Step:
    """The step of a calibration or a diagnosis: ``status`` of its process, and its newest ``finished`` result."""
    if status.alive:
        share = f"{status.done / status.planned:.0%}" if status.planned else ""
        return Step(name, StepState.RUNNING, "paused" if status.state == "paused" else share, hint, room)
    if status.state == "failed":
        return Step(name, StepState.FAILED, STOPPED, hint, room)
    if finished is None:
        return Step(name, StepState.EMPTY, "", hint, room)
    return Step(name, StepState.DONE if finished.succeeded else StepState.FAILED, finished.said, hint, room)


def report_step(results: Sequence[Finished | None]) -> Step:
    """The step of the report: done as soon as a result has a report."""
    n = sum(1 for one in results if one is not None and one.report)
    state = StepState.DONE if n else StepState.EMPTY
    return Step("Report", state, "", "What was done and found, as a page to read, print and send.", Room.REPORTS)


def next_step(steps: Sequence[Step]) -> tuple[str, Room]:
    """What to do next, in a few words, and in which tab."""
    by_name = {step.name: step for step in steps}
    measured, calibrate, diagnose = (by_name[name] for name in ("Measured", "Calibrate", "Diagnose"))
    for step in (calibrate, diagnose):
        if step.state == StepState.RUNNING:
            return f"see what {step.name} has found so far", step.room
    for step in (calibrate, diagnose):
        if step.said == STOPPED:
            return f"see under {step.name} why it stopped", step.room
    if by_name["Pour"].state == StepState.FAILED:
        return "see under Pour why there is no pile", Room.POUR
    if measured.state == StepState.EMPTY:
        return "read the angle of a measured pile off photographs", Room.LABORATORY
    if calibrate.state == StepState.EMPTY:
        assumed = measured.state == StepState.ASSUMED
        return "start the calibration" + (" (the target is uncertain)" if assumed else ""), Room.CALIBRATE
    if calibrate.state == StepState.FAILED and diagnose.state == StepState.EMPTY:
        return "ask which effect the model lacks", Room.DIAGNOSE
    if diagnose.state == StepState.EMPTY:
        return "read the report, or test the model by measured data", Room.REPORTS
    return "read the report", Room.REPORTS
