"""One pour in one world of a batch: bodies enter, the rig acts, they pile up or flow, and the run ends.

The rig says what it does and when a run is over (``rigs/rig.py``); nothing here distinguishes a funnel from a drum.
Everything that decides about a run happens at fixed simulated moments, every ``numerics.sample_interval``: bodies
enter, curves are sampled, surfaces are set in motion, phases and outcomes are detected. How the steps in between are
divided into launches does not change a single bit.
"""

from __future__ import annotations

import math
import time as clock
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from solver.engine.world import SUMMARY_COLUMNS, Batch, law_table
from solver.laws import CONTACT_LAWS
from solver.observables.free_surface import surface_heights
from solver.params import ParameterError
from solver.pours.contacts import Contacts, contacts_from
from solver.pours.disturbance import PLATE, PlateMotion, Pull
from solver.pours.parameter_ramp import RAMP_STEPS, RAMP_TIME, Ramp, spring_ratio
from solver.pours.raw_pour import packed, unpacked
from solver.pours.record import Bodies, Outcome, Phase, Record, Verdict
from solver.pours.record_builder import (
    bodies_of,
    entries_of,
    free_surface_of,
    lying,
    measured_from,
    member_spheres,
    pile_of,
    rolling_away,
    trace_of,
)
from solver.pours.supply import Supply
from solver.pours.verdict import (
    RUNNING,
    Moment,
    at_rest,
    may_be_over,
    slow_moments,
    speed_that_counts,
    stalled,
    verdict,
)
from solver.rigs.outlet import Obstruction, obstruction, waiting
from solver.rigs.rig import Container, Switch
from solver.scenes.scene import Scene, actual, pour_rig
from solver.scenes.time_step import time_step

SETTLE_LIMIT = 1.0
"""``fill_then_open``: the rig acts this long [s] after the last body entered even if the fill still moves."""

Summary = dict[str, float]


class Pour:
    """State of one pour; ``scene`` is the scene with its set-up effects applied, ``declared`` that without.

    Drive it with :meth:`steps_due`, ``batch.advance`` and :meth:`after`.
    """

    def __init__(self, batch: Batch, w: int, scene: Scene, seed: int) -> None:
        self.declared = scene
        scene = actual(scene)
        self.batch, self.w, self.scene, self.seed = batch, w, scene, seed
        self.rig = pour_rig(scene)
        self.supply = Supply(scene, seed)
        self.dt = time_step(scene)
        batch.load(w, scene, self.supply.layout, self.dt, (True,) * len(self.rig.surfaces()))
        self._law, self._table = CONTACT_LAWS[scene.contact.law], law_table(scene)
        self._ramp: Ramp | None = None
        self._ramp_left = 0
        self._motion: tuple[PlateMotion, float] | None = None
        self._motion_left = 0
        self._pull: Pull | None = None
        self.disturbed = False
        """Whether the plate was moved or a body pulled since the pour began."""
        self.energy_put_in = 0.0
        self._supplied = 0.0
        self.steps = 0
        self._time_base, self._steps_base = 0.0, 0
        self.ended = self.outcome, self.message = RUNNING
        self.samples: list[Summary] = []
        self._free_surface: list[tuple[float, npt.NDArray[np.float64]]] = []
        self._moving, self._quiet_samples = 0.0, 0
        self._began: float | None = None if scene.insertion.protocol == "fill_then_open" else 0.0
        self._to_do, self._inside = list(self.rig.actions()), self.container
        self._act()
        self._started = clock.perf_counter()
        self._left = self._interval_steps()
        self._insert()

    @property
    def time(self) -> float:
        """Simulated time [s], which does not depend on the launches."""
        return self._time_base + (self.steps - self._steps_base) * self.dt

    @property
    def entered(self) -> int:
        """Number of bodies that have entered."""
        return self.supply.entered

    @property
    def gate_shut(self) -> bool:
        """Whether the rig is still being filled and has not begun to act."""
        return self._began is None

    @property
    def gate_opened(self) -> float:
        """Time [s] at which the rig began to act; 0 for ``pour_through``, and until it begins."""
        return self._began or 0.0

    @property
    def container(self) -> Container:
        """The inside of the rig at this moment."""
        return self.rig.container(0.0 if self._began is None else self.time - self._began)

    @property
    def phase(self) -> Phase:
        """Phase of the pour."""
        if self.ended[0] == Outcome.AT_REST:
            return Phase.AT_REST
        if self.supply.missing > 0 or self.gate_shut:
            return Phase.FILL
        if self.rig.running_time is not None:
            return Phase.RUN
        return Phase.DISCHARGE if self.samples and self.samples[-1]["in_funnel"] > 0.0 else Phase.PILE

    def steps_due(self, at_most: int | None = None) -> int:
        """Steps to run next: to the next moment of decision, or fewer; 0 when the pour is over."""
        if self.outcome != Outcome.RUNNING:
            return 0
        limit = self._left
        if self._ramp is not None:
            limit = min(limit, self._ramp_left)
        if self._motion is not None:
            limit = min(limit, self._motion_left)
        return limit if at_most is None else min(limit, at_most)

    def decides_after(self, steps: int) -> bool:
        """Whether a moment of decision is reached after ``steps`` more."""
        return steps >= self._left

    def after(self, steps: int, row: npt.NDArray[np.float64] | None = None) -> bool:
        """Take note of ``steps`` that were run. True at a moment of decision, which needs this world's summary."""
        if row is None and self.decides_after(steps):
            raise ValueError("a moment of decision asks for the world's summary")
        self.steps += steps
        self._left -= steps
        if self._ramp is not None:
            # At its own moments: a launch that was cut short must not change the bits of what follows.
            self._ramp_left -= steps
            if self._ramp_left <= 0:
                self._follow_ramp(self._ramp)
        if self._motion is not None:
            self._motion_left -= steps
            if self._motion_left <= 0:
                self._follow_motion(*self._motion)
        if self._left > 0 or row is None:
            return False
        self._left = self._interval_steps()
        self._sample(dict(zip(SUMMARY_COLUMNS, row.tolist(), strict=True)))
        return True

    def ramp_to(self, scene: Scene) -> None:
        """Let the running pour follow the material of ``scene``; wakes it up if it had come to rest.

        Friction and effects act at once; stiffness and damping are ramped (see ``solver/pours/parameter_ramp.py``).
        Only materials, pairs and effects of contacts and bodies may differ from the present scene; anything else needs
        a new pour. Effects must be compiled into the batch (RuntimeError otherwise): see :meth:`move_to`.
        """
        self.declared = scene
        scene = actual(scene)
        target = law_table(scene)
        self.batch.set_effects(self.w, scene)
        self.scene = scene
        self._ramp = Ramp(self._law, self._table, target, self.time)
        self._set_time_step(min(self.dt, time_step(scene)))
        self.energy_put_in = 0.0
        self._set_table(self._ramp.table(self.time))
        self._ramp_left = self._ramp_steps()
        self._wake()

    def move_plate(self, motion: PlateMotion) -> None:
        """Begin to move the plate, which ends where it began; wakes the pour up if it had come to rest.

        Raises ParameterError for a rig without a plate and while the plate is already moving.
        """
        if PLATE not in self.rig.surface_names:
            raise ParameterError(f"{self.rig.name}: has no plate that can be moved")
        if self._motion is not None:
            raise ParameterError("the plate is already moving; wait until it stops")
        self._motion, self.disturbed = (motion, self.time), True
        self._follow_motion(*self._motion)
        self._wake()

    def pull(self, pull: Pull | None) -> None:
        """Pull one body from now on, or none; wakes the pour up, unless there is nothing to let go.

        Raises ParameterError for a body that is not there.
        """
        if pull is None and self._pull is None:
            return
        if pull is not None and not 0 <= pull.body < self.entered:
            raise ParameterError(f"pull: there is no body {pull.body + 1}; {self.entered} have entered")
        self._pull, self.disturbed = pull, True
        self.apply_pull()
        self._wake()

    def apply_pull(self) -> None:
        """Tell the batch which body is pulled; wakes all bodies."""
        body, force = (None, (0.0, 0.0, 0.0)) if self._pull is None else (self._pull.body, self._pull.force)
        self.batch.set_pull(self.w, body, force)

    @property
    def disturbance(self) -> str:
        """What is being done to the pile, in words; empty for nothing."""
        motion = None if self._motion is None else self._motion[0]
        return "; ".join(str(one) for one in (motion, self._pull) if one is not None)

    def move_to(self, batch: Batch) -> None:
        """Go on in ``batch``, in the same world, with the same bits: for example in one with effects compiled in."""
        kept = self.batch.take(self.w)
        batch.load(self.w, self.scene, self.supply.layout, self.dt, (True,) * len(self.rig.surfaces()))
        batch.set_law(self.w, self._table)
        self.batch = batch
        self.apply_pull()
        batch.put(self.w, kept)

    def bodies(self) -> Bodies:
        """Present state of all bodies that have entered."""
        return bodies_of(self.scene, self.supply.order, self.supply.layout, self.batch.bodies(self.w, self.entered))

    def surface_poses(self) -> npt.NDArray[np.float64]:
        """Where the rig's surfaces are: origin [m] and orientation wxyz, shape (k, 7)."""
        return self.batch.surface_state(self.w)[:, :7]

    def contacts(self) -> Contacts:
        """Present contacts of the bodies, with each other and with the rig."""
        return contacts_from(self.batch.contacts(self.w))

    def record(self) -> Record:
        """What the run leaves behind."""
        state = self.batch.bodies(self.w, self.entered)
        bodies = bodies_of(self.scene, self.supply.order, self.supply.layout, state)
        spheres = member_spheres(self.scene, bodies)
        # What rolls away is no part of a pile at rest; in a reading at a given time it counts, as for a camera.
        rolling = None if self.scene.numerics.duration > 0.0 else rolling_away(self.scene, self.container, state)
        in_pile = lying(self.container, bodies, rolling)
        return Record(
            scene=self.scene,
            seed=self.seed,
            outcome=self.outcome,
            message=self.message,
            ended=self.ended,
            bodies=bodies,
            spheres=spheres,
            in_pile=in_pile,
            pile=measured_from(pile_of(bodies, spheres, in_pile), self.scene.axis),
            free_surface=free_surface_of(self.rig.watch, self._free_surface),
            trace=trace_of(self.samples),
            entries=entries_of(self.supply.order, self.supply.entries),
            gate_opened=self.gate_opened,
            poured_mass=self.supply.mass,
            dt=self.dt,
            steps=self.steps,
            wall_s=clock.perf_counter() - self._started,
        )

    def _interval_steps(self) -> int:
        """Steps to the next moment of decision; the moment of the reading is one too, wherever it falls."""
        numerics = self.scene.numerics
        interval = round(numerics.sample_interval / self.dt)
        if numerics.duration > self.time:
            interval = min(interval, math.ceil((numerics.duration - self.time) / self.dt - 1e-6))
        return max(1, interval)

    def _insert(self) -> None:
        if (self._began is not None and not self.rig.refills) or not self.supply.due(self.time):
            return
        there = member_spheres(self.scene, self.bodies())
        for b, entry in self.supply.placed(self.rig.feed(), there, self.time, self.steps):
            self.batch.enter(self.w, b, entry.pose.position, entry.pose.quaternion, entry.velocity, np.zeros(3))
            self._supplied += self._mechanical_energy(b, entry.pose.position, entry.velocity)

    def _act(self) -> None:
        """Carry out the actions of the rig that are due."""
        if self._began is None:
            return
        # A small tolerance: rounding in the sum of many steps must not miss a moment.
        while self._to_do and self._to_do[0].after <= self.time - self._began + 1e-9:
            action = self._to_do.pop(0)
            if isinstance(action, Switch):
                self.batch.set_active(self.w, action.surface, action.active)
            else:
                self.batch.set_motion(self.w, action.surface, action.velocity, action.angular_velocity)
        if self.container != self._inside:
            self._inside = self.container
            self.batch.set_container(self.w, self._inside)

    def _mechanical_energy(self, b: int, position: npt.NDArray[np.float64], velocity: npt.NDArray[np.float64]) -> float:
        """Kinetic and potential energy [J] of body ``b`` that does not turn."""
        mass, gravity = self.supply.layout.numbers[b, 0], np.array(self.scene.gravity)
        return float(mass * (0.5 * velocity @ velocity - gravity @ position))

    def _sample(self, row: Summary) -> None:
        row["time"] = self.time
        row["supplied"] = self._supplied
        row["entered"] = self.supply.entered_mass
        row["lost"] = float(self.batch.take_out(self.w))
        self.samples.append(row)
        self._insert()
        numerics = self.scene.numerics
        self._moving = speed_that_counts(row, self.gate_shut)
        self._quiet_samples = slow_moments(self._quiet_samples, self._moving, self._motion is not None, numerics)
        self._watch()
        self.ended = verdict(self.rig, numerics, self._moment(row))
        self.outcome, self.message = self._told()
        waiting = self.time > self.supply.last_entry + SETTLE_LIMIT
        if self.gate_shut and (self.supply.missing == 0 or self._blocked()) and (self._quiet() or waiting):
            self._began, self._quiet_samples = self.time, 0
        self._act()

    def _watch(self) -> None:
        """Record the free surface at this moment, if the rig asks for it."""
        watch = self.rig.watch
        if watch is not None and self._began is not None and self.time - self._began >= watch.after:
            spheres = member_spheres(self.scene, self.bodies())
            self._free_surface.append((self.time, surface_heights(spheres, watch.half_width) - watch.height))

    def _told(self) -> Verdict:
        """Outcome of the pour, if it has ended: read from the raw pour, so that a stored one gives the same."""
        if self.ended[0] != Outcome.AT_REST or not self.rig.leaves_heap:
            return self.ended
        kept = unpacked(packed(self.record()))
        return kept.outcome, kept.message

    def _quiet(self) -> bool:
        return at_rest(self._quiet_samples, self.scene.numerics)

    def _blocked(self) -> bool:
        """Whether the next body has long been due and finds no place: the rig is full to the feed opening."""
        return self.supply.overdue(self.time, SETTLE_LIMIT)

    def _at_outlet(self) -> tuple[Obstruction | None, int]:
        """What lies across the outlet now, and the number of bodies over it."""
        outlet, inside = self.rig.outlet, self.container
        if outlet is None:
            return None, 0
        bodies = self.bodies()
        there = np.hypot(bodies.position[:, 0], bodies.position[:, 1]) < inside.radius
        held = bodies.inside & there & (bodies.position[:, 2] > inside.height)
        spheres = member_spheres(self.scene, bodies)
        across = obstruction(outlet, inside.height, bodies, spheres, held, self.rig.keeps_material)
        return across, waiting(outlet, inside.height, bodies, held)

    def _moment(self, row: Summary) -> Moment:
        moment = Moment(
            time=self.time,
            row=row,
            acting=None if self._began is None else self.time - self._began,
            acted=not self._to_do,
            missing=self.supply.missing,
            blocked=self._blocked(),
            quiet=self._quiet(),
            stalled=stalled(self.samples, self.scene.numerics, max(self.supply.last_entry, self.gate_opened)),
            speed=self._moving,
            room=self.batch.capacity.contacts,
            poured_mass=self.supply.mass,
        )
        if not may_be_over(moment):
            return moment
        across, number = self._at_outlet()
        return replace(moment, across=across, waiting=number, spilled=self._spilled())

    def _spilled(self) -> float:
        """Mass that had left the rig when its gate opened [kg]; 0 in a rig without a gate."""
        opened = (row["discharged"] for row in self.samples if row["time"] >= self.gate_opened > 0.0)
        return next(opened, 0.0)

    def _ramp_steps(self) -> int:
        """Steps between two changes of the constants."""
        return max(1, math.ceil(RAMP_TIME / RAMP_STEPS / self.dt))

    def _follow_ramp(self, ramp: Ramp) -> None:
        self._ramp_left = self._ramp_steps()
        self._set_table(ramp.table(self.time))
        if ramp.over(self.time):
            self._ramp = None
            self._set_time_step(time_step(self.scene))

    def _follow_motion(self, motion: PlateMotion, began: float) -> None:
        """Give the plate the velocity of the next piece, or let it stand at the end."""
        plate, since = self.rig.surface_names.index(PLATE), self.time - began
        if since >= motion.duration - 0.5 * self.dt:
            self._motion, velocity = None, np.zeros(3)
        else:
            rest = min(motion.piece, motion.duration - since)
            # A small tolerance: rounding in a sum of steps must not add a step to a piece.
            self._motion_left = max(1, math.ceil(rest / self.dt - 1e-6))
            took = self._motion_left * self.dt
            here = self.surface_poses()[plate, :3] - np.array(self.rig.surfaces()[plate].pose.origin)
            velocity = (np.array(motion.displacement(min(since + took, motion.duration))) - here) / took
        self.batch.set_motion(self.w, plate, velocity.tolist(), (0.0, 0.0, 0.0))

    def _wake(self) -> None:
        """Let a pour that had come to rest go on."""
        self._quiet_samples = 0
        if self.ended[0] in (Outcome.AT_REST, Outcome.JAMMED, Outcome.OBSTRUCTED):
            self.ended = self.outcome, self.message = RUNNING

    def _set_table(self, table: npt.NDArray[np.float64]) -> None:
        elastic = SUMMARY_COLUMNS.index("elastic")
        before = self.batch.measure(self.w)[self.w, elastic]
        self.batch.set_law(self.w, table)
        self.batch.scale_springs(self.w, spring_ratio(self._law, self._table, table))
        self._table = table
        gained = float(self.batch.measure(self.w)[self.w, elastic] - before)
        self.energy_put_in += gained
        self._supplied += gained

    def _set_time_step(self, dt: float) -> None:
        self._time_base, self._steps_base = self.time, self.steps
        self._left, self._motion_left = (
            max(1, math.ceil(steps * self.dt / dt)) for steps in (self._left, self._motion_left)
        )
        self.dt = dt
        self.batch.set_time_step(self.w, dt)
