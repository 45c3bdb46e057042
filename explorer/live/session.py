"""A live pour in its own process: commands in, frames and statuses out. No viser, no Taichi.

A Taichi call holds the interpreter's lock until it returns, so the solver must not share a process with the
page. Each end copes with the loss of the other: if the solver dies, the state becomes ``died`` with a message, and a
restart brings a new solver; a solver whose parent is gone ends by itself.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import replace

from explorer.errors import CommandError
from explorer.live.details import Details
from explorer.live.frames import MAX_BODIES, Frame
from explorer.live.messages import (
    BackTo,
    Command,
    Event,
    Failure,
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
from explorer.live.solver_process import SolverProcess
from explorer.scene.source import SceneSource
from solver.params import ParameterError
from solver.pours.disturbance import PlateMotion, Pull
from solver.scenes.scene import Scene, actual, body_counts, canonical, parameters, poured_mass, with_values

SPEED_RANGE = (0.01, 10.0)
"""Allowed ratio of simulated to wall time."""
EVENTS_KEPT = 200


class SessionError(CommandError):
    """A command that cannot be carried out now; one line, fit for a user."""


class Session:
    """Owner of the solver process. Use it from one thread."""

    def __init__(self) -> None:
        self._process: SolverProcess | None = None
        self._watch = Watch(wanted=False)
        self._status: Status | None = None
        self._events: deque[Event] = deque(maxlen=EVENTS_KEPT)
        self._generation = 0
        self._speed = 1.0
        self._source: SceneSource | None = None

    def start(self, scene: Scene, seed: int, source: SceneSource | None = None) -> None:
        """Pour ``scene`` with ``seed``, in a new process if there is none. Returns at once.

        ``source``: the default against which changes are listed; None: as before, at first the scene itself.

        Raises ParameterError for a scene with more bodies than a frame holds.
        """
        bodies = sum(body_counts(actual(scene)))
        if bodies > MAX_BODIES:
            path = "rig.mass" if "rig.mass" in parameters(scene) else "rig"
            raise ParameterError(
                f"{path}: {poured_mass(scene):g} kg is {bodies} bodies; allowed in the live view: up to {MAX_BODIES}"
            )
        self._source = source or self._source or SceneSource((), scene)
        self._generation += 1
        # A process that has failed may live on for a moment, but takes no commands any more.
        failed = self._status is not None and self._status.state == SessionState.FAILED
        process = self._process if not failed else None
        if process is None or not process.alive:
            process = self._renewed()
        self._status = Status(
            state=SessionState.STARTING,
            message="starting the solver process",
            scene=scene,
            seed=seed,
            generation=self._generation,
            speed=self._speed,
        )
        process.send(Start(scene, seed, self._generation), SetSpeed(self._speed), self._watch)

    def restart(self, scene: Scene | None = None, seed: int | None = None) -> None:
        """Start again, by default with the scene as it is now and the same seed."""
        present = self._present()
        self.start(scene or present.scene, present.seed if seed is None else seed)

    def play(self) -> None:
        """Let time run."""
        self._send(Play())

    def pause(self) -> None:
        """Stop time."""
        self._send(Pause())

    def step(self) -> None:
        """Run for one sample interval of the scene (``numerics.sample_interval``), then pause."""
        self._send(Step(self._present().scene.numerics.sample_interval))

    def run_to(self, time: float) -> None:
        """Run to simulated ``time`` [s], then pause there; also allowed for a pour that was just started."""
        self._send(RunTo(time))

    def step_back(self) -> None:
        """Go back by one sample interval; everything is as it was then, parameters too.

        The pour pauses there, and repeats the same bits until something is changed.
        """
        self._send(StepBack(self._present().scene.numerics.sample_interval))

    def back_to(self, time: float) -> None:
        """Go back to ``time`` [s] as :meth:`step_back` does, whatever was run or asked for in the meantime."""
        self._send(BackTo(time))

    def set_speed(self, factor: float) -> None:
        """Aim at ``factor`` seconds of simulated time per second."""
        low, high = SPEED_RANGE
        if not (math.isfinite(factor) and low <= factor <= high):
            raise SessionError(f"speed: {factor!r} is outside {low:g} … {high:g}")
        self._send(SetSpeed(factor))
        self._speed = factor

    def set_parameters(self, values: Mapping[str, float | str]) -> None:
        """Change live parameters of the running pour by path (SI, or text with a unit), all together.

        Raises ParameterError for an unknown path, a value that is not finite or out of range, and a parameter
        that acts on restart only. ``status().scene`` holds what the solver has applied.
        """
        scene = self._present().scene
        known = parameters(scene)
        for path in values:
            if not known[canonical(scene, path)].live:
                raise ParameterError(f"{path}: takes effect on restart only, not during a pour")
        with_values(scene, dict(values))
        self._send(SetParameters(dict(values)))

    def move_plate(self, motion: PlateMotion) -> None:
        """Tap or shake the plate of the running pour. The outcome is reported as an event, even if it is a refusal."""
        self._send(MovePlate(motion))

    def pull(self, pull: Pull | None) -> None:
        """Pull one body until the next call; None: let go."""
        self._send(SetPull(pull))

    def watch(self, wanted: bool, body: int | None = None) -> None:
        """Say whether :meth:`details` are wanted, and of which body (by order of entry) all contacts are wanted."""
        if self._watch == Watch(wanted, body):
            return
        self._watch = Watch(wanted, body)
        if self._process is not None and self._process.alive:
            self._process.send(self._watch)

    def details(self) -> Details | None:
        """Velocities, loads and contacts of the present pour, as last read; None before the first reading."""
        details = self._process.details.newest() if self._process is not None else None
        return details if details is not None and details.generation == self._generation else None

    def frame(self) -> Frame | None:
        """The newest frame of the present pour; None before its first one."""
        frame = self._process.frames.newest() if self._process is not None else None
        return frame if frame is not None and frame.generation == self._generation else None

    def status(self) -> Status:
        """The newest status, after processing all that the solver process has sent."""
        self._listen()
        return self._present()

    def new_events(self) -> tuple[Event, ...]:
        """Changes of parameters and outcomes since the last call, oldest first; at most ``EVENTS_KEPT``."""
        self._listen()
        events = tuple(self._events)
        self._events.clear()
        return events

    def close(self) -> None:
        """End the solver process; afterwards only ``start`` and ``restart`` make sense."""
        if self._process is not None:
            self._process.close()
        if self._status is not None:
            self._status = replace(self._status, state=SessionState.CLOSED, message="", real_time_factor=0.0)

    @property
    def source(self) -> SceneSource:
        """Where the scene came from: the default against which its changes are listed."""
        if self._source is None:
            raise SessionError("no pour has been started")
        return self._source

    @property
    def process_id(self) -> int | None:
        """Process id of the solver process; None if there is none."""
        return self._process.process_id if self._process is not None and self._process.alive else None

    def _present(self) -> Status:
        if self._status is None:
            raise SessionError("no pour has been started")
        return self._status

    def _renewed(self) -> SolverProcess:
        """A new process in place of the former one."""
        if self._process is not None:
            self._process.kill()
        self._process = SolverProcess()
        return self._process

    def _send(self, command: Command) -> None:
        present = self.status()
        if self._process is None or not self._process.alive:
            raise SessionError(present.message or "the solver process does not run; restart the pour")
        self._process.send(command)

    def _listen(self) -> None:
        if self._process is None or self._status is None or self._status.state == SessionState.CLOSED:
            return
        # Checked before the messages are read: a process that is dead now has sent all it will send.
        alive = self._process.alive
        for report in self._process.heard():
            self._take(report)
        if not alive and self._status.state not in (SessionState.FAILED, SessionState.DIED):
            self._stand_still(
                SessionState.DIED,
                f"the solver process ended (exit code {self._process.exit_code}); restart the pour for a new one",
            )

    def _take(self, report: Report) -> None:
        if isinstance(report, Failure):
            self._stand_still(SessionState.FAILED, f"the solver stopped: {report.message}; restart the pour")
        elif report.generation == self._generation:
            if isinstance(report, Event):
                self._events.append(report)
            else:
                self._status = report

    def _stand_still(self, state: SessionState, message: str) -> None:
        self._status = replace(self._present(), state=state, message=message, real_time_factor=0.0)
