"""One pour that obeys commands: the part of the solver process that owns Taichi's objects."""

from __future__ import annotations

import dataclasses
import math
import sys
import time as clock
from collections.abc import Callable, Mapping
from copy import copy

import numpy as np

from explorer.live.angle_reader import AngleReader
from explorer.live.details import DetailWriter
from explorer.live.frames import FrameWriter
from explorer.live.history import History, Moment
from explorer.live.messages import (
    Command,
    Event,
    Pause,
    Play,
    Report,
    SessionState,
    SetParameters,
    SetSpeed,
    Start,
    Status,
    Step,
    StepBack,
    Watch,
)
from explorer.live.pace import Pace
from explorer.outcomes import outcome_text
from explorer.scene.changes import changes
from solver.effects.columns import kernel_effects
from solver.params import ParameterError
from solver.pour import Pour
from solver.record import Outcome
from solver.rewind import keep, put_back
from solver.run import capacity_for
from solver.scene import Scene, with_values
from solver.time_step import stability_limit
from solver.world import Batch

FRAME_INTERVAL = 1.0 / 60.0
"""Wall time [s] between published frames."""
STATUS_INTERVAL = 0.1
"""Wall time [s] between reports."""
DETAIL_INTERVAL = 0.1
"""Wall time [s] between details, while they are looked at."""
BEFORE_FIRST_SAMPLE = {"entered": 0.0, "discharged": 0.0, "kinetic": 0.0, "touching": 0.0}
"""Sums over all bodies while none has been sampled yet."""


class LivePour:
    """A pour with play and pause, live parameters, frames and reports. One thread only (the one with Taichi)."""

    def __init__(
        self, start: Start, frames: FrameWriter, report: Callable[[Report], None], details: DetailWriter
    ) -> None:
        self._frames, self._report, self._details = frames, report, details
        self._watch, self._detailed = Watch(wanted=False), 0.0
        self._pace = Pace(speed=1.0)
        self._published = self._reported = 0.0
        self._begin(start)

    def obey(self, command: Command) -> None:
        """Carry out ``command``; parameters that are refused become an event, never an exception."""
        match command:
            case Start():
                self._begin(command)
            case Play():
                self._paused = False
                self._pace.restart(clock.perf_counter(), self._pour.time)
            case Pause():
                self._paused, self._run_until = True, -math.inf
                self._keep()
                # What stands on the screen is the moment that is told, not the last frame that was due before it.
                self._publish()
            case Step(duration=duration):
                # Steps that are asked for while one runs are added to it.
                self._paused, self._run_until = True, max(self._run_until, self._pour.time) + duration
                self._pace.restart(clock.perf_counter(), self._pour.time)
            case StepBack(duration=duration):
                self._go_back(self._pour.time - duration)
            case SetSpeed(factor=factor):
                self._pace.speed = factor
                self._pace.restart(clock.perf_counter(), self._pour.time)
            case SetParameters(values=values):
                self._set_parameters(values)
            case Watch():
                self._watch = command
                self._publish_details()
        self._report(self.status())

    def seconds_to_wait(self) -> float | None:
        """Wall time until the next launch is due; None while nothing is to be done."""
        if self._pour.steps_due(1) == 0 or (self._paused and self._pour.time >= self._run_until):
            return None
        return max(0.0, self._pace.wait(clock.perf_counter(), self._pour.time))

    def advance(self) -> None:
        """Run one short launch, then publish and report what is due."""
        steps = self._pour.steps_due(min(self._pace.steps(self._pour.dt), self._steps_to_stop()))
        before = clock.perf_counter()
        decided = self._launch(steps)
        if decided or (self._paused and self._pour.time >= self._run_until):
            self._keep()
        now = clock.perf_counter()
        self._pace.launched(steps, now - before, now, self._pour.time)
        over = self._pour.outcome != Outcome.RUNNING
        if over:
            self._event(outcome_text(self._pour.outcome, self._pour.message))
        if over or self._angles.due(self._pour.time, now):
            self._observe()
        # The status goes first: who sees the last frame of a pour can know that it was the last.
        if over or self._paused or now - self._reported >= STATUS_INTERVAL:
            self._reported = now
            self._report(self.status())
        if over or self._paused or now - self._published >= FRAME_INTERVAL:
            self._publish()
        if over or self._paused or now - self._detailed >= DETAIL_INTERVAL:
            self._publish_details()

    def status(self) -> Status:
        """What the page is told."""
        pour = self._pour
        state = SessionState.RUNNING
        if pour.outcome != Outcome.RUNNING:
            state = SessionState.ENDED
        elif self._paused:
            state = SessionState.PAUSED
        sample = self._sample()
        return Status(
            state=state,
            message=pour.message,
            scene=self._scene,
            seed=pour.seed,
            generation=self._generation,
            speed=self._pace.speed,
            capped=state == SessionState.RUNNING and self._pace.capped,
            real_time_factor=self._pace.real_time_factor if state == SessionState.RUNNING else 0.0,
            phase=pour.phase,
            outcome=pour.outcome,
            time=pour.time,
            dt=pour.dt,
            dt_limit=self._dt_limit,
            earliest=self._history.earliest,
            bodies=pour.entered,
            bodies_planned=len(pour.order),
            entered_mass=sample["entered"],
            discharged_mass=sample["discharged"],
            poured_mass=pour.poured_mass,
            kinetic_energy=sample["kinetic"],
            contacts=round(sample["touching"]),
            gate_shut=pour.gate_shut,
            energy_put_in=pour.energy_put_in if self._retuned else None,
            observables=self._angles.observables,
            outline=self._angles.outline,
        )

    def _begin(self, start: Start) -> None:
        self._scene, self._generation = start.scene, start.generation
        self._announce(start, "fitting member spheres to the shapes")
        for body in start.scene.bodies:
            _ = body.clump  # fitted once per process and shape; the pour below takes it from the cache
        self._announce(start, "compiling the solver")
        self._batch = Batch(capacity_for([start.scene], 1))
        self._pour = Pour(self._batch, 0, endless(start.scene), start.seed)
        self._warm_up()
        self._angles, self._history = AngleReader(), History()
        self._dt_limit = stability_limit(self._pour.scene)
        self._paused, self._run_until, self._retuned = False, -math.inf, False
        self._keep()
        self._publish()
        self._pace.restart(clock.perf_counter(), self._pour.time)
        self._report(self.status())

    def _warm_up(self) -> None:
        """Compile every kernel now, those of a change of stiffness too, so that the first slider does not stall."""
        self._launch(self._pour.steps_due(1))
        kinds = self._batch.capacity.kinds
        self._batch.scale_springs(0, np.ones((kinds, kinds)))
        self._batch.measure(0)

    def _announce(self, start: Start, message: str) -> None:
        self._report(
            Status(SessionState.STARTING, message, start.scene, start.seed, start.generation, self._pace.speed)
        )

    def _launch(self, steps: int) -> bool:
        row = self._batch.advance(np.array([steps], dtype=np.int32))
        return self._pour.after(steps, row[0])

    def _keep(self) -> None:
        """Keep the present moment, so that the person at the screen can come back to it."""
        if self._pour.outcome != Outcome.NON_FINITE:
            self._history.add(Moment(keep(self._pour), self._scene, copy(self._angles), self._retuned))

    def _go_back(self, time: float) -> None:
        """Bring everything back to how it was at ``time`` [s], or as early as is kept, and pause."""
        self._paused, self._run_until = True, -math.inf
        found = self._history.back_to(time, self._pour.time)
        if found is None:
            self._event("this is the earliest moment that is kept")
            return
        moment, until = found
        before, self._scene = self._scene, moment.scene
        put_back(self._pour, moment.kept)
        self._angles, self._retuned = copy(moment.angles), moment.retuned
        self._dt_limit = stability_limit(self._pour.scene)
        # What was thinned out of the history is run again: the same bits, up to the next change that a person made.
        while (left := self._whole_steps(until)) > 0 and (steps := self._pour.steps_due(left)) > 0:
            self._launch(steps)
        self._keep()
        for line in changes(before, self._scene):
            self._event(line)
        self._publish()
        self._publish_details()

    def _set_parameters(self, values: Mapping[str, float | str]) -> None:
        try:
            changed = with_values(self._scene, dict(values))
        except ParameterError as error:
            self._event(f"refused: {error}")
            return
        for line in changes(self._scene, changed):
            self._report(Event(self._generation, self._pour.time, line, is_change=True))
        if changed == self._scene:
            return
        if kernel_effects(changed) and not self._batch.capacity.effects:
            self._event("compiling the effects; the pour goes on when that is done")
            self._batch = Batch(dataclasses.replace(self._batch.capacity, effects=True))
            self._pour.move_to(self._batch)
        self._scene = changed
        self._pour.retune(endless(changed))
        self._dt_limit = stability_limit(self._pour.scene)
        self._retuned = True
        self._history.changed(self._pour.time)
        self._keep()
        self._pace.restart(clock.perf_counter(), self._pour.time)

    def _publish(self) -> None:
        # The last finite frame stays on the screen when the state is no longer finite.
        if self._pour.outcome != Outcome.NON_FINITE:
            self._frames.publish(self._pour.bodies(), self._generation, self._pour.time, self._pour.surface_poses())
        self._published = clock.perf_counter()

    def _publish_details(self) -> None:
        pour, self._detailed = self._pour, clock.perf_counter()
        if self._watch.wanted and pour.outcome != Outcome.NON_FINITE:
            bodies, contacts = pour.bodies(), pour.contacts()
            self._details.publish(self._generation, pour.time, bodies, pour.entry_times, contacts, self._watch.body)

    def _observe(self) -> None:
        pour = self._pour
        if pour.outcome != Outcome.NON_FINITE:
            share_below = self._sample()["discharged"] / pour.poured_mass
            self._angles.read(pour.record().pile, share_below, pour.time, clock.perf_counter)

    def _sample(self) -> Mapping[str, float]:
        return self._pour.samples[-1] if self._pour.samples else BEFORE_FIRST_SAMPLE

    def _steps_to_stop(self) -> int:
        """Steps to the first that reaches the end of a step of the person at the screen; without end while playing."""
        if not self._paused:
            return sys.maxsize
        # Less a hair: a sum of steps must not miss its end by rounding and take one more.
        return max(1, math.ceil((self._run_until - self._pour.time) / self._pour.dt - 1e-6))

    def _whole_steps(self, time: float) -> int:
        """Steps that end at or before ``time`` [s], but for rounding."""
        return math.floor((time - self._pour.time) / self._pour.dt + 1e-6)

    def _event(self, text: str) -> None:
        self._report(Event(self._generation, self._pour.time, text))


def endless(scene: Scene) -> Scene:
    """``scene`` without the limit on simulated time: in the live view the person at the screen ends a pour."""
    return dataclasses.replace(scene, numerics=dataclasses.replace(scene.numerics, max_time=math.inf))
