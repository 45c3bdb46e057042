"""One pour in one world of a batch: bodies enter, fall, pile up and come to rest.

Everything that decides about a run happens at fixed simulated moments, every ``numerics.sample_interval``: bodies
enter, curves are sampled, phases and outcomes are detected. How the steps in between are cut into launches makes no
difference to a single bit.
"""

from __future__ import annotations

import math
import time as clock

import numpy as np
import numpy.typing as npt

from solver import insertion
from solver.body import counts
from solver.layout import layout
from solver.record import Bodies, Outcome, Phase, Record
from solver.record_builder import bodies_of, entries_of, member_spheres, pile_of, rolling_away, trace_of
from solver.retune import RAMP_STEPS, RAMP_TIME, Ramp, spring_ratio
from solver.rigs.funnel import GATE
from solver.scene import Scene
from solver.time_step import time_step
from solver.world import SUMMARY_COLUMNS, Batch, law_table

SETTLE_LIMIT = 1.0
"""``fill_then_open``: the gate opens this long [s] after the last body entered even if the fill still moves."""

STALL_TIME = 0.5
"""A funnel that has let nothing through for this long [s] is done, even if what is stuck in it rocks: twice the time
that a body needs to fall through."""

Summary = dict[str, float]


class Pour:
    """State of one pour; drive it with :meth:`steps_due`, ``batch.advance`` and :meth:`after`."""

    def __init__(self, batch: Batch, w: int, scene: Scene, seed: int) -> None:
        self.batch, self.w, self.scene, self.seed = batch, w, scene, seed
        self._rng = np.random.default_rng(seed)
        self.order = insertion.shuffled_components(counts(scene.bodies, scene.rig.mass), self._rng)
        self._layout = layout(scene, self.order)
        self.dt = time_step(scene)
        self.gate_shut = scene.insertion.protocol == "fill_then_open"
        self.gate_opened = 0.0
        batch.load(w, scene, self._layout, self.dt, (True, True, self.gate_shut))
        self._due = insertion.entry_times(self._layout.numbers[:, 0], scene.insertion.rate)
        self._table = law_table(scene)
        self._ramp: Ramp | None = None
        self.energy_put_in = 0.0
        self.entered = 0
        self._entries: list[tuple[float, int, insertion.Pose, npt.NDArray[np.float64]]] = []
        self.steps = 0
        self._time_base, self._steps_base = 0.0, 0
        self.outcome, self.message = Outcome.RUNNING, ""
        self.samples: list[Summary] = []
        self._quiet_samples = 0
        self._last_entry = 0.0
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
    def phase(self) -> Phase:
        """Where the pour is."""
        if self.outcome == Outcome.AT_REST:
            return Phase.AT_REST
        if self.entered < len(self.order) or self.gate_shut:
            return Phase.FILL
        return Phase.DISCHARGE if self.samples and self.samples[-1]["in_funnel"] > 0.0 else Phase.PILE

    def steps_due(self, at_most: int | None = None) -> int:
        """Steps to run next: to the next moment of decision, or fewer; 0 when the pour is over."""
        if self.outcome != Outcome.RUNNING:
            return 0
        limit = self._left
        if self._ramp is not None:
            limit = min(limit, max(1, math.ceil(RAMP_TIME / RAMP_STEPS / self.dt)))
        return limit if at_most is None else min(limit, at_most)

    def after(self, steps: int, row: npt.NDArray[np.float64]) -> bool:
        """Take note of ``steps`` that were run; ``row`` is this world's summary. True at a moment of decision."""
        self.steps += steps
        self._left -= steps
        if self._ramp is not None:
            self._follow_ramp(self._ramp)
        if self._left > 0:
            return False
        self._left = self._interval_steps()
        self._sample(dict(zip(SUMMARY_COLUMNS, row.tolist(), strict=True)))
        return True

    def retune(self, scene: Scene) -> None:
        """Let the running pour follow the material of ``scene``; wakes it up if it had come to rest.

        Friction acts at once; stiffness and damping are ramped (see ``solver/retune.py``). Only materials and pairs
        may differ from the present scene; anything else takes a new pour.
        """
        target = law_table(scene)
        self.scene = scene
        self._ramp = Ramp(self._table, target, self.time)
        self._set_time_step(min(self.dt, time_step(scene)))
        self.energy_put_in = 0.0
        self._set_table(self._ramp.table(self.time))
        self._quiet_samples = 0
        if self.outcome in (Outcome.AT_REST, Outcome.JAMMED):
            self.outcome, self.message = Outcome.RUNNING, ""

    def bodies(self) -> Bodies:
        """Present state of all bodies that have entered."""
        return bodies_of(self.scene, self.order, self._layout, self.batch.bodies(self.w, self.entered))

    def record(self) -> Record:
        """What the run leaves behind."""
        state = self.batch.bodies(self.w, self.entered)
        bodies = bodies_of(self.scene, self.order, self._layout, state)
        spheres = member_spheres(self.scene, bodies)
        return Record(
            scene=self.scene,
            seed=self.seed,
            outcome=self.outcome,
            message=self.message,
            bodies=bodies,
            spheres=spheres,
            pile=pile_of(self.scene, bodies, spheres, rolling_away(self.scene, state)),
            trace=trace_of(self.samples),
            entries=entries_of(self.order, self._entries),
            gate_opened=self.gate_opened,
            poured_mass=self.poured_mass,
            dt=self.dt,
            steps=self.steps,
            wall_s=clock.perf_counter() - self._started,
        )

    def _interval_steps(self) -> int:
        return max(1, round(self.scene.numerics.sample_interval / self.dt))

    def _insert(self) -> None:
        speed = np.array([0.0, 0.0, -self.scene.insertion.drop_speed])
        while self.entered < len(self.order) and self._due[self.entered] <= self.time:
            spheres = member_spheres(self.scene, self.bodies())
            near = spheres.centre[:, 2] + spheres.radius > self.scene.rig.inlet_height
            pose = insertion.find_place(
                self.scene.bodies[self.order[self.entered]].clump,
                self.scene.insertion,
                self.scene.rig.inlet_height,
                spheres.centre[near],
                spheres.radius[near],
                self._rng,
            )
            if pose is None:
                return
            self.batch.enter(self.w, self.entered, pose.position, pose.quaternion, speed, np.zeros(3))
            self._entries.append((self.time, self.steps, pose, speed))
            self.entered += 1
            self._last_entry = self.time

    def _sample(self, row: Summary) -> None:
        row["time"] = self.time
        row["entered"] = float(self._layout.numbers[: self.entered, 0].sum())
        row["lost"] = float(self.batch.take_out(self.w))
        self.samples.append(row)
        self._insert()
        moving = max(row["speed"], row["funnel_speed"] if self.gate_shut else 0.0)
        self._quiet_samples = self._quiet_samples + 1 if moving < self.scene.numerics.rest_speed else 0
        self.outcome, self.message = self._verdict(row)
        waiting = self.time > self._last_entry + SETTLE_LIMIT
        if self.gate_shut and (self._all_in() or self._blocked()) and (self._quiet() or waiting):
            self.batch.set_active(self.w, GATE, False)
            self.gate_shut, self.gate_opened, self._quiet_samples = False, self.time, 0

    def _quiet(self) -> bool:
        numerics = self.scene.numerics
        return self._quiet_samples * numerics.sample_interval >= numerics.rest_time

    def _all_in(self) -> bool:
        return self.entered == len(self.order)

    def _blocked(self) -> bool:
        """The next body has been due for long and finds no place: the funnel is full to the inlet."""
        return not self._all_in() and self.time > self._due[self.entered] + SETTLE_LIMIT

    def _stalled(self) -> bool:
        """Nothing has passed the outlet for ``STALL_TIME``, although it could."""
        since = self.time - max(self._last_entry, self.gate_opened)
        back = math.ceil(STALL_TIME / self.scene.numerics.sample_interval)
        if since <= STALL_TIME or len(self.samples) <= back:
            return False
        return self.samples[-1 - back]["discharged"] == self.samples[-1]["discharged"]

    def _verdict(self, row: Summary) -> tuple[Outcome, str]:
        numerics = self.scene.numerics
        if not row["finite"]:
            return Outcome.NON_FINITE, f"a position or speed is not finite at {self.time:.3f} s"
        if row["overflow"]:
            return (
                Outcome.BUFFER_OVERFLOW,
                f"more than {self.batch.capacity.contacts} entries in the contact list",
            )
        if row["lost"]:
            return Outcome.LOST_BODY, f"{row['lost']:.0f} left the domain above the outlet or through the plate"
        if row["overlap"] > numerics.overlap_limit:
            return Outcome.OVERLAP_LIMIT, f"overlap of {row['overlap']:.3g} radii at {self.time:.3f} s"
        fed = not self.gate_shut and (self._all_in() or self._blocked())
        empty = row["hanging"] == 0
        if fed and self._quiet() and (empty or self._stalled()):
            if self._blocked() or row["hanging"] > numerics.hanging_bodies:
                return (
                    Outcome.JAMMED,
                    f"{row['hanging']:.0f} bodies ({1e3 * row['in_funnel']:.3g} g) stay in the funnel",
                )
            return Outcome.AT_REST, "" if empty else f"{1e3 * row['in_funnel']:.3g} g hang in the funnel"
        if self.time >= numerics.max_time:
            return Outcome.TIME_LIMIT, f"still moving at {row['speed']:.3g} m/s after {numerics.max_time:g} s"
        return Outcome.RUNNING, ""

    def _follow_ramp(self, ramp: Ramp) -> None:
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
        self.energy_put_in += float(self.batch.measure(self.w)[self.w, elastic] - before)

    def _set_time_step(self, dt: float) -> None:
        self._time_base, self._steps_base = self.time, self.steps
        self._left = max(1, math.ceil(self._left * self.dt / dt))
        self.dt = dt
        self.batch.set_time_step(self.w, dt)
