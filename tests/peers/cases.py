"""Bodies set down by hand, the same in our solver and in another engine, and both motions at the same moments."""

import dataclasses
import json
from dataclasses import dataclass, field

import numpy as np

from explorer.export import EXPORTS
from explorer.export.deck import assembled
from explorer.export.frames import TRAJECTORY, BodyFrame, motion, read_frames
from explorer.export.liggghts import INPUT
from explorer.export.run import run_liggghts, run_yade
from explorer.export.yade import LAW
from explorer.scene.file import load_scene
from solver.effects import EFFECTS
from solver.engine.world import law_table
from solver.laws import HertzMindlin
from solver.pours.record import Entries
from solver.scenes.insertion import rotation_matrix
from solver.scenes.scene import with_values
from solver.scenes.time_step import time_step
from solver.single_body.free_world import FreeWorld

RUNNERS = {"liggghts": run_liggghts, "yade": run_yade}
LENGTH = 24.6e-3
"""Of the nine-sphere seed [m]."""


@dataclass(frozen=True)
class Case:
    """Nine-sphere seeds at given places, orientations and velocities, alone or above the plate."""

    position: np.ndarray
    quaternion: np.ndarray
    velocity: np.ndarray
    steps: int
    every: int
    friction: float
    tangential_damping: bool = True
    plate: bool = True
    rolling_friction: float = 0.0
    contact: dict[str, str] = field(default_factory=dict)
    """Settings of ``contact``, by path."""

    @property
    def scene(self):
        """The seed pour's scene with the friction of the case for all pairs; without a plate there is no weight."""
        paths = ("pair.seed.seed.static_friction", "pair.seed.rigid_sieve_plate.static_friction")
        scene = with_values(
            load_scene("seed_pour"), dict.fromkeys(paths, self.friction) | {"numerics.sleep_speed": 0.0} | self.contact
        )
        scene = scene.with_effect(EFFECTS["rolling_resistance"](rolling_friction=self.rolling_friction))
        return scene if self.plate else dataclasses.replace(scene, gravity=(0.0, 0.0, 0.0))

    @property
    def dt(self):
        """Time step [s]."""
        return time_step(self.scene)

    @property
    def deck(self):
        """The case for another engine."""
        n = len(self.position)
        zero = np.zeros(n, dtype=np.int32)
        entries = Entries(zero.astype(float), zero, zero, self.position, self.quaternion, self.velocity)
        return assembled(self.scene, 0, self.dt, self.steps, entries, plate=0.0 if self.plate else None)


def ours(case):
    """Step → :class:`BodyFrame` from our solver."""
    lab = FreeWorld(case.scene, len(case.position), dt=case.dt, active=(case.plate, False, False))
    if not case.tangential_damping:
        table = law_table(case.scene)
        table[..., HertzMindlin.columns.index("shear_damping")] = 0.0
        lab.batch.set_law(0, table)
    for b in range(len(case.position)):
        lab.put(b, case.position[b], velocity=case.velocity[b], quaternion=case.quaternion[b])
    found = {}
    for step in range(case.every, case.steps + 1, case.every):
        lab.run(case.every)
        rows = lab.state()
        turn = rotation_matrix(rows[:, 3:7])
        spin = np.einsum("bij,bj->bi", turn, rows[:, 10:13])
        found[step] = BodyFrame(rows[:, 0:3], turn, rows[:, 7:10], spin)
    return found


def theirs(case, engine, folder):
    """Step → :class:`BodyFrame` from the deck of the case, run by ``engine``.

    LIGGGHTS's step k is our k − 1 and its velocities are half a step younger: v dt and g dt, far below 1 %.
    """
    deck = case.deck
    EXPORTS[engine].write_deck(folder, deck)
    if not case.tangential_damping:
        _undamp(folder, engine)
    RUNNERS[engine](folder, dump_every=case.every)
    frames = {frame.step: frame for frame in read_frames(folder / TRAJECTORY)}
    return {step: motion(deck, frames[step]) for step in range(case.every, case.steps + 1, case.every)}


def _undamp(folder, engine):
    """Take the tangential dashpot out of an exported deck."""
    if engine == "liggghts":
        path = folder / INPUT
        path.write_text(path.read_text().replace("limitForce on", "limitForce on tangential_damping off"))
    else:
        path = folder / LAW
        law = json.loads(path.read_text())
        law["tangential_damping"] = [[0.0] * len(row) for row in law["tangential_damping"]]
        path.write_text(json.dumps(law))


def impact_ends(found):
    """Steps at which an impact of body 0 was over: its vertical velocity had risen by 0.05 m/s or more."""
    steps = sorted(found)
    height = np.array([found[step].velocity[0, 2] for step in steps])
    rising = np.append(np.diff(height) > 0.0, False)
    ends, start = [], None
    for k in range(len(steps)):
        if rising[k] and start is None:
            start = k
        elif not rising[k] and start is not None:
            if height[k] - height[start] > 0.05:
                ends.append(steps[k])
            start = None
    return ends


@dataclass(frozen=True)
class Deviation:
    """Largest differences between two motions of body 0, as fractions of a length, a speed and a spin."""

    place: float
    velocity: float
    spin: float


def flying(found, fall):
    """Steps before and after which body 0 touched nothing: its velocity changed by ``fall`` [m/s] downwards."""
    steps = sorted(found)
    change = np.diff([found[step].velocity[0, 2] for step in steps])
    free = np.abs(change + fall) < 1e-3 * fall
    return {steps[k] for k in range(1, len(steps) - 1) if free[k - 1] and free[k]}


def deviation(one, other, until, speed, fall):
    """Deviation up to step ``until``; velocities and spins only where both bodies fly, between impacts.

    Places are compared at every moment, in lengths of the body; velocities in ``speed``, spins in 2 ``speed``/length.
    ``fall``: speed gained between two moments [m/s].
    """
    quiet = [k for k in sorted(flying(one, fall) & flying(other, fall)) if k <= until]
    places = [one[k].position[0] - other[k].position[0] for k in one if k <= until]
    velocities = [one[k].velocity[0] - other[k].velocity[0] for k in quiet]
    spins = [one[k].spin[0] - other[k].spin[0] for k in quiet]
    return Deviation(_largest(places) / LENGTH, _largest(velocities) / speed, _largest(spins) * LENGTH / 2.0 / speed)


def _largest(vectors):
    return max(float(np.linalg.norm(vector)) for vector in vectors)
