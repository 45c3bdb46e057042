"""One pour that obeys commands and publishes its state: the part of the solver's process that owns Taichi's objects.

The pour is alone in its batch, and everything that it will need is compiled when it begins. Frames go to shared memory,
as do details of its contacts while they are shown.
"""

from __future__ import annotations

import dataclasses
import math
import sys
import time as clock
from collections.abc import Callable, Mapping
from functools import partial
from multiprocessing.connection import Connection

import numpy as np

from explorer.live.angle_reader import AngleReader
from explorer.live.details import DetailWriter
from explorer.live.frames import FrameWriter
from explorer.live.history import History, Moment
from explorer.live.messages import (
    BackTo,
    Command,
    Event,
    MovePlate,
    Pause,
    Play,
    Report,
    RunTo,
    SessionState,
    SetParameters,
    SetPull,
    SetSpeed,
    Start,
    Status,
    Step,
    StepBack,
    Watch,
)
from explorer.live.throttle import Throttle
from explorer.outcomes import outcome_text
from explorer.scene.source import change_lines, differences
from solver.effects.columns import kernel_effects
from solver.engine.world import Batch
from solver.params import ParameterError
from solver.pours.checkpoint import keep, put_back
from solver.pours.pour import Pour
from solver.pours.record import Outcome
from solver.pours.run import capacity_for
from solver.scenes.scene import Scene, with_values
from solver.scenes.time_step import stability_limit

FRAME_INTERVAL = 1.0 / 60.0
"""Wall time [s] between published frames."""
DETAIL_INTERVAL = 0.1
"""Wall time [s] between details, while they are shown."""
KEPT_EVERY = 0.02
"""Simulated time [s] between two moments to which the pour can return at once; those between are simulated again."""
STATUS_INTERVAL = 0.1
"""Wall time [s] between reports."""
BEFORE_FIRST_SAMPLE = {"entered": 0.0, "discharged": 0.0, "kinetic": 0.0, "touching": 0.0}
"""Sums over all bodies before the first sample."""


class LivePour:
    """A pour with play and pause, live parameters, frames and reports. For one thread only (the one with Taichi)."""

    def __init__(
        self, start: Start, screen: Publisher, report: Callable[[Report], None], reading: Connection | None = None
    ) -> None:
        """``reading``: connection to a process that reads angles; without it they are read between two launches."""
        self._screen, self._report = screen, report
        self._angles = AngleReader(reading, clock.perf_counter)
        self._throttle = Throttle(speed=1.0)
        self._reported = 0.0
        self._begin(start)

    def obey(self, command: Command) -> None:
        """Carry out ``command``; refused parameters become an event, never an exception."""
        match command:
            case Start():
                self._begin(command)
            case Play():
                self._paused = False
                self._throttle.restart(clock.perf_counter(), self._pour.time)
            case Pause():
                self._paused, self._run_until = True, -math.inf
                self._keep()
                # The screen is to show the moment that is reported, not the last frame that was due before it.
                self._observe()
                self._publish()
            case Step(duration=duration):
                # Steps requested while one runs are added to it.
                self._paused, self._run_until = True, max(self._run_until, self._pour.time) + duration
                self._throttle.restart(clock.perf_counter(), self._pour.time)
            case RunTo(time=time):
                self._paused, self._run_until = True, time
                self._throttle.restart(clock.perf_counter(), self._pour.time)
            case StepBack(duration=duration):
                self._go_back(self._pour.time - duration)
            case BackTo(time=time):
                if time < self._pour.time:
                    self._go_back(time)
            case SetSpeed(factor=factor):
                self._throttle.speed = factor
                self._throttle.restart(clock.perf_counter(), self._pour.time)
            case SetParameters(values=values):
                self._set_parameters(values)
            case MovePlate(motion=motion):
                self._disturb(partial(self._pour.move_plate, motion))
            case SetPull(pull=pull):
                self._disturb(partial(self._pour.pull, pull))
            case Watch():
                self._screen.watch(command)
                self._publish()
        self._report(self.status())

    def seconds_to_wait(self) -> float | None:
        """Wall time until the next launch is due; None while there is nothing to do."""
        if self._pour.steps_due(1) == 0 or self._stepped:
            return None
        return max(0.0, self._throttle.wait(clock.perf_counter(), self._pour.time))

    def advance(self) -> None:
        """Run one short launch, then publish and report whatever is due."""
        steps = self._pour.steps_due(min(self._throttle.steps(self._pour.dt), self._steps_to_stop()))
        before = clock.perf_counter()
        decided = launch(self._pour, steps)
        if (decided and self._history.since(self._pour.time) >= KEPT_EVERY) or self._stepped:
            self._keep()
        now = clock.perf_counter()
        self._throttle.launched(steps, now - before, now, self._pour.time)
        over = self._pour.outcome != Outcome.RUNNING
        if over:
            self._event(outcome_text(self._pour.outcome, self._pour.message))
        self._angles.hear()
        if over or self._angles.due(self._pour.time):
            self._observe()
        # The status goes first, so that a reader of the last frame of a pour can know that it is the last.
        if over or self._paused or now - self._reported >= STATUS_INTERVAL:
            self._reported = now
            self._report(self.status())
        if over or self._paused:
            self._publish()
        else:
            self._screen.publish_due(self._pour, self._generation, now)

    def status(self) -> Status:
        """The status for the page."""
        pour = self._pour
        state = SessionState.RUNNING
        if pour.outcome != Outcome.RUNNING:
            state = SessionState.ENDED
        elif self._stepped:
            state = SessionState.PAUSED
        sample = self._sample()
        return Status(
            state=state,
            message=pour.message,
            scene=self._scene,
            seed=pour.seed,
            generation=self._generation,
            speed=self._throttle.speed,
            capped=state == SessionState.RUNNING and self._throttle.capped,
            real_time_factor=self._throttle.real_time_factor if state == SessionState.RUNNING else 0.0,
            phase=pour.phase,
            outcome=pour.outcome,
            time=pour.time,
            dt=pour.dt,
            dt_limit=self._dt_limit,
            earliest=self._history.earliest,
            bodies=pour.entered,
            bodies_planned=len(pour.supply.order),
            entered_mass=sample["entered"],
            discharged_mass=sample["discharged"],
            poured_mass=pour.supply.mass,
            kinetic_energy=sample["kinetic"],
            contacts=round(sample["touching"]),
            gate_shut=pour.gate_shut,
            energy_put_in=pour.energy_put_in if self._retuned else None,
            disturbance=pour.disturbance,
            disturbed=pour.disturbed,
            observables=self._angles.newest.observables,
            outline=self._angles.newest.outline,
        )

    def _begin(self, start: Start) -> None:
        self._scene, self._generation = start.scene, start.generation
        self._pour = begun(start.scene, start.seed, partial(self._announce, start))
        self._history = History()
        self._angles.forget()
        self._dt_limit = stability_limit(self._pour.scene)
        self._paused, self._run_until, self._retuned = False, -math.inf, False
        self._keep()
        self._publish()
        self._throttle.restart(clock.perf_counter(), self._pour.time)
        self._report(self.status())

    def _announce(self, start: Start, message: str) -> None:
        self._report(
            Status(SessionState.STARTING, message, start.scene, start.seed, start.generation, self._throttle.speed)
        )

    def _keep(self) -> None:
        """Keep the present moment, so that the user can return to it."""
        if self._pour.outcome != Outcome.NON_FINITE:
            self._history.add(Moment(keep(self._pour), self._scene, self._angles.newest, self._retuned))

    def _go_back(self, time: float) -> None:
        """Restore everything as it was at ``time`` [s], or at the earliest moment kept, and pause."""
        self._paused, self._run_until = True, -math.inf
        found = self._history.back_to(time, self._pour.time)
        if found is None:
            self._event("this is the earliest moment that is kept")
            return
        moment, until = found
        before, self._scene = self._scene, moment.scene
        put_back(self._pour, moment.kept)
        self._angles.forget(moment.angles)
        self._retuned = moment.retuned
        self._dt_limit = stability_limit(self._pour.scene)
        # What was thinned out of the history is simulated again: the same bits, up to the next change by the user.
        while (left := self._whole_steps(until)) > 0 and (steps := self._pour.steps_due(left)) > 0:
            launch(self._pour, steps)
        self._keep()
        for line in change_lines(differences(before, self._scene)):
            self._event(line)
        self._publish()

    def _set_parameters(self, values: Mapping[str, float | str]) -> None:
        try:
            changed = with_values(self._scene, dict(values))
        except ParameterError as error:
            self._event(f"refused: {error}")
            return
        for line in change_lines(differences(self._scene, changed)):
            self._report(Event(self._generation, self._pour.time, line, is_change=True))
        if changed == self._scene:
            return
        capacity = self._pour.batch.capacity
        if kernel_effects(changed) and not capacity.effects:
            self._event("compiling the effects; the pour goes on when that is done")
            self._pour.move_to(Batch(dataclasses.replace(capacity, effects=True)))
        self._scene = changed
        self._pour.ramp_to(endless(changed))
        self._dt_limit = stability_limit(self._pour.scene)
        self._retuned = True
        self._history.changed(self._pour.time)
        self._keep()
        self._throttle.restart(clock.perf_counter(), self._pour.time)

    def _disturb(self, act: Callable[[], None]) -> None:
        """Carry out ``act`` on the pour, as an event to which, and past which, the pour can be brought back."""
        before = self._pour.disturbance
        try:
            act()
        except ParameterError as error:
            self._event(f"refused: {error}")
            return
        now = self._pour.disturbance
        text = now if now else f"no more: {before}" if before else ""
        if text:
            self._report(Event(self._generation, self._pour.time, text, is_order=True))
        self._history.changed(self._pour.time)
        self._keep()
        self._throttle.restart(clock.perf_counter(), self._pour.time)

    def _publish(self) -> None:
        self._screen.publish(self._pour, self._generation, clock.perf_counter())

    def _observe(self) -> None:
        pour = self._pour
        if pour.outcome != Outcome.NON_FINITE:
            share_below = self._sample()["discharged"] / pour.supply.mass
            running = pour.outcome == Outcome.RUNNING and not self._paused
            read = self._angles.ask if running else self._angles.read
            read(pour.record().pile, share_below, pour.time)

    def _sample(self) -> Mapping[str, float]:
        return self._pour.samples[-1] if self._pour.samples else BEFORE_FIRST_SAMPLE

    @property
    def _stepped(self) -> bool:
        """Whether the pour stands still: paused, and the end of the user's step is reached."""
        return self._paused and self._pour.time >= self._run_until

    def _steps_to_stop(self) -> int:
        """Time steps to the first that reaches the end of the user's step; unlimited while playing."""
        if not self._paused:
            return sys.maxsize
        # Less a small tolerance: rounding in a sum of steps must not add one more.
        return max(1, math.ceil((self._run_until - self._pour.time) / self._pour.dt - 1e-6))

    def _whole_steps(self, time: float) -> int:
        """Time steps that end at or before ``time`` [s], within rounding."""
        return math.floor((time - self._pour.time) / self._pour.dt + 1e-6)

    def _event(self, text: str) -> None:
        self._report(Event(self._generation, self._pour.time, text))


class Publisher:
    """Publishes one pour after another; ``wall`` is the present time [s] on the caller's clock.

    If the state of a pour is no longer finite, the last finite state stays on the screen.
    """

    def __init__(self, frames: FrameWriter, details: DetailWriter) -> None:
        self._frames, self._details = frames, details
        self._watch = Watch(wanted=False)
        self._framed = self._detailed = -math.inf

    def watch(self, order: Watch) -> None:
        """Publish the details that ``order`` asks for from now on."""
        self._watch = order

    def publish(self, pour: Pour, generation: int, wall: float) -> None:
        """Publish the present state."""
        self._frame(pour, generation, wall)
        self._detail(pour, generation, wall)

    def publish_due(self, pour: Pour, generation: int, wall: float) -> None:
        """Publish what has not been published for its interval."""
        if wall - self._framed >= FRAME_INTERVAL:
            self._frame(pour, generation, wall)
        if wall - self._detailed >= DETAIL_INTERVAL:
            self._detail(pour, generation, wall)

    def _frame(self, pour: Pour, generation: int, wall: float) -> None:
        self._framed = wall
        if pour.outcome != Outcome.NON_FINITE:
            self._frames.publish(pour.bodies(), generation, pour.time, pour.surface_poses())

    def _detail(self, pour: Pour, generation: int, wall: float) -> None:
        self._detailed = wall
        if self._watch.wanted and pour.outcome != Outcome.NON_FINITE:
            bodies, contacts = pour.bodies(), pour.contacts()
            self._details.publish(generation, pour.time, bodies, pour.supply.times, contacts, self._watch.body)


def begun(scene: Scene, seed: int, announce: Callable[[str], None]) -> Pour:
    """A pour of ``scene`` after a single step; ``announce`` is told what takes long."""
    announce("fitting member spheres to the shapes")
    for body in scene.bodies:
        _ = body.clump  # fitted once per process and shape; the pour below takes it from the cache
    announce("compiling the solver")
    pour = Pour(Batch(capacity_for([scene], 1)), 0, endless(scene), seed)
    _compile(pour)
    return pour


def _compile(pour: Pour) -> None:
    """Compile every kernel now, also those for a change of stiffness, so that the first slider does not stall."""
    launch(pour, pour.steps_due(1))
    kinds = pour.batch.capacity.kinds
    pour.batch.scale_springs(0, np.ones((kinds, kinds)))
    pour.batch.measure(0)


def endless(scene: Scene) -> Scene:
    """``scene`` without the limit on simulated time: in the live view, the user ends a pour."""
    return dataclasses.replace(scene, numerics=dataclasses.replace(scene.numerics, max_time=math.inf))


def launch(pour: Pour, steps: int) -> bool:
    """Run ``steps``; True if they end at a decision, which needs the world's summary; other launches do not read it."""
    launched = np.array([steps], dtype=np.int32)
    if not pour.decides_after(steps):
        pour.batch.run(launched)
        return pour.after(steps)
    return pour.after(steps, pour.batch.advance(launched)[0])
