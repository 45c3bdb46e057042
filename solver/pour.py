"""One pour in one world of a batch: bodies enter, the rig acts, they pile up or flow, and the run ends.

The rig says what it does and when a run is over (``rigs/rig.py``); nothing here knows a funnel from a drum. Everything
that decides about a run happens at fixed simulated moments, every ``numerics.sample_interval``: bodies enter, curves
are sampled, surfaces are set in motion, phases and outcomes are detected. How the steps in between are cut into
launches makes no difference to a single bit.
"""

from __future__ import annotations

import math
import time as clock

import numpy as np
import numpy.typing as npt

from solver import insertion
from solver.clump import scaled
from solver.contacts import Contacts, contacts_from
from solver.effects.set_up import actual
from solver.layout import layout
from solver.observables.free_surface import surface_heights
from solver.record import Bodies, Outcome, Phase, Record
from solver.record_builder import (
    bodies_of,
    entries_of,
    free_surface_of,
    measured_from,
    member_spheres,
    pile_of,
    rolling_away,
    trace_of,
)
from solver.retune import RAMP_STEPS, RAMP_TIME, Ramp, spring_ratio
from solver.rigs.rig import Container, Switch
from solver.scene import Scene, body_counts, pour_rig
from solver.sizes import drawn_sizes
from solver.time_step import time_step
from solver.verdict import Moment, verdict
from solver.world import SUMMARY_COLUMNS, Batch, law_table

SETTLE_LIMIT = 1.0
"""``fill_then_open``: the rig acts this long [s] after the last body entered even if the fill still moves."""

STALL_TIME = 0.5
"""A container that has let nothing out for this long [s] is done, even if what is stuck in it rocks: twice the time
that a body needs to fall through the funnel."""

Summary = dict[str, float]


class Pour:
    """State of one pour; ``scene`` is the one with its set-up effects carried out.

    Drive it with :meth:`steps_due`, ``batch.advance`` and :meth:`after`.
    """

    def __init__(self, batch: Batch, w: int, scene: Scene, seed: int) -> None:
        scene = actual(scene)
        self.batch, self.w, self.scene, self.seed = batch, w, scene, seed
        self.rig = pour_rig(scene)
        self._rng = np.random.default_rng(seed)
        self.order = insertion.shuffled_components(body_counts(scene), self._rng)
        sizes = drawn_sizes([body.sizes for body in scene.bodies], self.order, seed)
        self._layout = layout(scene, self.order, sizes)
        self.dt = time_step(scene)
        batch.load(w, scene, self._layout, self.dt, (True,) * len(self.rig.surfaces()))
        self._due = insertion.entry_times(self._layout.numbers[:, 0], scene.insertion.rate) - scene.insertion.lead
        self._table = law_table(scene)
        self._ramp: Ramp | None = None
        self._ramp_left = 0
        self.energy_put_in = 0.0
        self._supplied = 0.0
        self.entered = 0
        self._entries: list[tuple[float, int, insertion.Pose, npt.NDArray[np.float64]]] = []
        self.steps = 0
        self._time_base, self._steps_base = 0.0, 0
        self.outcome, self.message = Outcome.RUNNING, ""
        self.samples: list[Summary] = []
        self._free_surface: list[tuple[float, npt.NDArray[np.float64]]] = []
        self._moving, self._quiet_samples = 0.0, 0
        self._last_entry = 0.0
        self._began: float | None = None if scene.insertion.protocol == "fill_then_open" else 0.0
        self._to_do, self._inside = list(self.rig.actions()), self.container
        self._act()
        self._started = clock.perf_counter()
        self._left = self._interval_steps()
        self._insert()

    @property
    def time(self) -> float:
        """Simulated time [s], whatever the launches."""
        return self._time_base + (self.steps - self._steps_base) * self.dt

    @property
    def poured_mass(self) -> float:
        """Mass of all bodies of this pour [kg]."""
        return float(self._layout.numbers[:, 0].sum())

    @property
    def gate_shut(self) -> bool:
        """Whether the rig is still being filled and has not begun to act."""
        return self._began is None

    @property
    def gate_opened(self) -> float:
        """Time [s] at which the rig began to act; 0 for ``pour_through``, and as long as it has not."""
        return self._began or 0.0

    @property
    def container(self) -> Container:
        """The inside of the rig at this moment."""
        return self.rig.container(0.0 if self._began is None else self.time - self._began)

    @property
    def phase(self) -> Phase:
        """Where the pour is."""
        if self.outcome == Outcome.AT_REST:
            return Phase.AT_REST
        if self.entered < len(self.order) or self.gate_shut:
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
        return limit if at_most is None else min(limit, at_most)

    def decides_after(self, steps: int) -> bool:
        """Whether ``steps`` more lead to a moment of decision."""
        return steps >= self._left

    def after(self, steps: int, row: npt.NDArray[np.float64] | None = None) -> bool:
        """Take note of ``steps`` that were run. True at a moment of decision; it asks for this world's summary."""
        if row is None and self.decides_after(steps):
            raise ValueError("a moment of decision asks for the world's summary")
        self.steps += steps
        self._left -= steps
        if self._ramp is not None:
            # At moments of its own: a launch that was cut short must not change the bits of what follows.
            self._ramp_left -= steps
            if self._ramp_left <= 0:
                self._follow_ramp(self._ramp)
        if self._left > 0 or row is None:
            return False
        self._left = self._interval_steps()
        self._sample(dict(zip(SUMMARY_COLUMNS, row.tolist(), strict=True)))
        return True

    def retune(self, scene: Scene) -> None:
        """Let the running pour follow the material of ``scene``; wakes it up if it had come to rest.

        Friction and effects act at once; stiffness and damping are ramped (see ``solver/retune.py``). Only materials,
        pairs and effects of contacts and bodies may differ from the present scene; anything else takes a new pour. For
        effects the batch needs them compiled in (RuntimeError otherwise): see :meth:`move_to`.
        """
        scene = actual(scene)
        target = law_table(scene)
        self.batch.set_effects(self.w, scene)
        self.scene = scene
        self._ramp = Ramp(self._table, target, self.time)
        self._set_time_step(min(self.dt, time_step(scene)))
        self.energy_put_in = 0.0
        self._set_table(self._ramp.table(self.time))
        self._ramp_left = self._ramp_steps()
        self._quiet_samples = 0
        if self.outcome in (Outcome.AT_REST, Outcome.JAMMED):
            self.outcome, self.message = Outcome.RUNNING, ""

    def move_to(self, batch: Batch) -> None:
        """Go on in ``batch``, in the same world, with the same bits: for instance in one with effects compiled in."""
        kept = self.batch.take(self.w)
        batch.load(self.w, self.scene, self._layout, self.dt, (True,) * len(self.rig.surfaces()))
        batch.set_law(self.w, self._table)
        batch.put(self.w, kept)
        self.batch = batch

    def bodies(self) -> Bodies:
        """Present state of all bodies that have entered."""
        return bodies_of(self.scene, self.order, self._layout, self.batch.bodies(self.w, self.entered))

    def surface_poses(self) -> npt.NDArray[np.float64]:
        """Where the rig's surfaces are: origin [m] and orientation wxyz, shape (k, 7)."""
        return self.batch.surface_state(self.w)[:, :7]

    def contacts(self) -> Contacts:
        """Present contacts of the bodies, with each other and with the rig."""
        return contacts_from(self.batch.contacts(self.w))

    @property
    def entry_times(self) -> npt.NDArray[np.float64]:
        """When the bodies entered [s], in order of entry."""
        return np.array([time for time, *_ in self._entries], dtype=float)

    def record(self) -> Record:
        """What the run leaves behind."""
        state = self.batch.bodies(self.w, self.entered)
        bodies = bodies_of(self.scene, self.order, self._layout, state)
        spheres = member_spheres(self.scene, bodies)
        # What rolls away is no part of a pile at rest; at a given moment it lies where it is, for a camera as well.
        rolling = None if self.scene.numerics.duration > 0.0 else rolling_away(self.scene, self.container, state)
        pile = pile_of(self.container, bodies, spheres, rolling)
        return Record(
            scene=self.scene,
            seed=self.seed,
            outcome=self.outcome,
            message=self.message,
            bodies=bodies,
            spheres=spheres,
            pile=measured_from(pile, self.scene.axis),
            free_surface=free_surface_of(self.rig.watch, self._free_surface),
            trace=trace_of(self.samples),
            entries=entries_of(self.order, self._entries),
            gate_opened=self.gate_opened,
            poured_mass=self.poured_mass,
            dt=self.dt,
            steps=self.steps,
            wall_s=clock.perf_counter() - self._started,
        )

    def _interval_steps(self) -> int:
        """Steps to the next moment of decision; the moment of the reading is one, wherever it falls."""
        numerics = self.scene.numerics
        interval = round(numerics.sample_interval / self.dt)
        if numerics.duration > self.time:
            interval = min(interval, math.ceil((numerics.duration - self.time) / self.dt - 1e-6))
        return max(1, interval)

    def _insert(self) -> None:
        if self._began is not None and not self.rig.refills:
            return
        if self.entered == len(self.order) or self._due[self.entered] > self.time:
            return
        feed = self.rig.feed()
        speed = np.array([0.0, 0.0, -self.scene.insertion.drop_speed])
        spheres = member_spheres(self.scene, self.bodies())
        near = spheres.centre[:, 2] + spheres.radius > feed.floor
        centres, radii = spheres.centre[near], spheres.radius[near]
        while self.entered < len(self.order) and self._due[self.entered] <= self.time:
            clump = scaled(self.scene.bodies[self.order[self.entered]].clump, self._layout.scale[self.entered])
            pose = insertion.find_place(clump, self.scene.insertion, feed, centres, radii, self._rng)
            if pose is None:
                return
            centres = np.concatenate([centres, pose.position + insertion.turned(clump.centres, pose.quaternion)])
            radii = np.concatenate([radii, clump.radii])
            self.batch.enter(self.w, self.entered, pose.position, pose.quaternion, speed, np.zeros(3))
            self._entries.append((self.time, self.steps, pose, speed))
            self._supplied += self._mechanical_energy(self.entered, pose.position, speed)
            self.entered += 1
            self._last_entry = self.time

    def _act(self) -> None:
        """Carry out what the rig has to do by now."""
        if self._began is None:
            return
        # Less a hair: the sum of many steps must not miss a moment by rounding.
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
        mass, gravity = self._layout.numbers[b, 0], np.array(self.scene.gravity)
        return float(mass * (0.5 * velocity @ velocity - gravity @ position))

    def _sample(self, row: Summary) -> None:
        row["time"] = self.time
        row["supplied"] = self._supplied
        row["entered"] = float(self._layout.numbers[: self.entered, 0].sum())
        row["lost"] = float(self.batch.take_out(self.w))
        self.samples.append(row)
        self._insert()
        self._moving = max(row["speed"], row["funnel_speed"] if self.gate_shut else 0.0)
        self._quiet_samples = self._quiet_samples + 1 if self._moving < self.scene.numerics.rest_speed else 0
        self._watch()
        self.outcome, self.message = verdict(self.rig, self.scene.numerics, self._moment(row))
        waiting = self.time > self._last_entry + SETTLE_LIMIT
        if self.gate_shut and (self._all_in() or self._blocked()) and (self._quiet() or waiting):
            self._began, self._quiet_samples = self.time, 0
        self._act()

    def _watch(self) -> None:
        """Keep the free surface of this moment, if the rig wants it."""
        watch = self.rig.watch
        if watch is not None and self._began is not None and self.time - self._began >= watch.after:
            spheres = member_spheres(self.scene, self.bodies())
            self._free_surface.append((self.time, surface_heights(spheres, watch.half_width) - watch.height))

    def _quiet(self) -> bool:
        numerics = self.scene.numerics
        return self._quiet_samples * numerics.sample_interval >= numerics.rest_time

    def _all_in(self) -> bool:
        return self.entered == len(self.order)

    def _blocked(self) -> bool:
        """The next body has been due for long and finds no place: the rig is full to the feed opening."""
        return not self._all_in() and self.time > self._due[self.entered] + SETTLE_LIMIT

    def _stalled(self) -> bool:
        """Nothing has left the container for ``STALL_TIME``, although it could."""
        since = self.time - max(self._last_entry, self.gate_opened)
        back = math.ceil(STALL_TIME / self.scene.numerics.sample_interval)
        if since <= STALL_TIME or len(self.samples) <= back:
            return False
        return self.samples[-1 - back]["discharged"] == self.samples[-1]["discharged"]

    def _moment(self, row: Summary) -> Moment:
        return Moment(
            time=self.time,
            row=row,
            acting=None if self._began is None else self.time - self._began,
            acted=not self._to_do,
            missing=len(self.order) - self.entered,
            blocked=self._blocked(),
            quiet=self._quiet(),
            stalled=self._stalled(),
            speed=self._moving,
            room=self.batch.capacity.contacts,
        )

    def _ramp_steps(self) -> int:
        """Steps between two changes of the constants."""
        return max(1, math.ceil(RAMP_TIME / RAMP_STEPS / self.dt))

    def _follow_ramp(self, ramp: Ramp) -> None:
        self._ramp_left = self._ramp_steps()
        self._set_table(ramp.table(self.time))
        if ramp.over(self.time):
            self._ramp = None
            self._set_time_step(time_step(self.scene))

    def _set_table(self, table: npt.NDArray[np.float64]) -> None:
        elastic = SUMMARY_COLUMNS.index("elastic")
        before = self.batch.measure(self.w)[self.w, elastic]
        self.batch.set_law(self.w, table)
        self.batch.scale_springs(self.w, spring_ratio(self._table, table))
        self._table = table
        gained = float(self.batch.measure(self.w)[self.w, elastic] - before)
        self.energy_put_in += gained
        self._supplied += gained

    def _set_time_step(self, dt: float) -> None:
        self._time_base, self._steps_base = self.time, self.steps
        self._left = max(1, math.ceil(self._left * self.dt / dt))
        self.dt = dt
        self.batch.set_time_step(self.w, dt)
