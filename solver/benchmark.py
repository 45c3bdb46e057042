"""Speed of the solver on declared cases, each in a process of its own, on the threads that it is given.

A bed holds equal spheres at rest under gravity: the case in which every sphere has contacts at every step. A small bed
is settled in a box, then copied side by side to the wanted number, so that beds of 10³ and 10⁵ spheres have the same
height and the same contacts per sphere. The spheres are numbered at random: in the order of their places neighbours
would lie side by side in memory, as they do in no bed that was poured.
Spheres: d 5 mm, ρ 2500 kg/m³, G 10 MPa, ν 0.25, μ 0.5, e 0.5.

Pours run against the clock: one world step by step, and many worlds on several cores.
"""

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver import backend
from solver.engine.state import Capacity
from solver.engine.tables import body_tables
from solver.engine.world import SUMMARY_COLUMNS, Batch
from solver.pours.pour import Pour
from solver.pours.record import Outcome
from solver.pours.run import Job, capacity_for
from solver.pours.worker_pool import WorkerPool
from solver.rigs.rig import BareRig
from solver.rigs.surface import Plane, Surface, SurfacePose, horizontal
from solver.scenes.body import Body, Members
from solver.scenes.material import Material, Pair
from solver.scenes.numerics import Numerics
from solver.scenes.scene import Scene, with_values
from solver.scenes.time_step import time_step

__all__ = ["Bed", "BenchmarkResult", "measure_batch", "measure_bed", "measure_pour", "shuffled", "wide_bed"]

Array = npt.NDArray[np.float64]

RADIUS = 2.5e-3
SKIN = 0.2e-3
TILE = (10, 10, 10)
"""Spheres of the small bed along x, y and z before it settles."""
SPACING = 2.06 * RADIUS
SETTLING_TIME = 0.25
"""Simulated time [s] for the small bed to come to rest."""
RELAXING_TIME = 0.04
"""The same for a bed put together of copies."""
WARM_UP = {"numerics.max_time": 0.1}
"""A run as short as the declared range allows compiles every kernel."""


@dataclass(frozen=True)
class BenchmarkResult:
    """One engine on one case. Contacts are those that touch at the end; rates are over the stepping loop."""

    case: str
    engine: str
    bodies: int
    spheres: int
    steps: int
    wall_s: float
    simulated_s: float
    contacts: float
    """Touching contacts at the end; NaN where the engine does not tell."""
    mean_contacts: float
    """The same over the run, sampled; NaN where the engine does not tell."""
    timed_out: bool = False
    """The engine was stopped at its time limit, ``wall_s``, before it said how many steps it had made."""

    @property
    def steps_per_s(self) -> float:
        """Steps per second of wall time; NaN if it timed out."""
        return float("nan") if self.timed_out else self.steps / self.wall_s

    @property
    def sphere_steps_per_s(self) -> float:
        """Member spheres times steps per second."""
        return self.spheres * self.steps_per_s

    @property
    def ns_per_contact(self) -> float:
        """Wall time per step and touching contact [ns], everything included."""
        return 1e9 / self.steps_per_s / self.mean_contacts if self.mean_contacts > 0.0 else float("nan")


@dataclass(frozen=True)
class Box(BareRig):
    """An open box: floor z = 0 and four walls, ``width`` × ``depth`` [m]."""

    width: float
    depth: float
    wall: str = "wall"
    domain_half_width: float = 1e3

    def surfaces(self) -> tuple[Surface, ...]:
        """Floor, then the walls at x = 0, x = width, y = 0, y = depth."""
        half = float(np.sqrt(0.5))
        return (
            horizontal(0.0, self.wall),
            Plane(self.wall, SurfacePose((0.0, 0.0, 0.0), (half, 0.0, half, 0.0))),
            Plane(self.wall, SurfacePose((self.width, 0.0, 0.0), (half, 0.0, -half, 0.0))),
            Plane(self.wall, SurfacePose((0.0, 0.0, 0.0), (half, -half, 0.0, 0.0))),
            Plane(self.wall, SurfacePose((0.0, self.depth, 0.0), (half, half, 0.0, 0.0))),
        )


@dataclass(frozen=True)
class Bed:
    """Centres (n, 3) and velocities (n, 3) of equal spheres of ``RADIUS`` in a box."""

    box: Box
    centres: Array
    velocities: Array


def measure_bed(bed: Bed, steps: int) -> BenchmarkResult:
    """``steps`` of ``bed`` on one thread."""
    backend.init(threads=1)
    batch, dt = load_bed(bed)
    batch.advance(np.array([1], dtype=np.int32))
    begin = time.perf_counter()
    batch.advance(np.array([steps], dtype=np.int32))
    wall = time.perf_counter() - begin
    n, contacts = len(bed.centres), summary_of(batch)["touching"]
    return BenchmarkResult(bed_name(n), "ours, nothing sleeps", n, n, steps, wall, steps * dt, contacts, contacts)


def measure_pour(
    case: str, scene: Scene, seed: int, duration: float | None, sleeping: bool, times: int = 1
) -> BenchmarkResult:
    """One pour on one thread, ``times`` over; steps, wall time and simulated time are those of all together.

    Parameters
    ----------
    case
        Name of the case.
    scene, seed
        What is poured.
    duration
        Simulated time of a pour [s]; it goes on when the pile is at rest, as other engines' runs do. None: to rest.
    sleeping
        Whether bodies may fall asleep.
    times
        How often the pour is run: a short one is over before the clock tells much.

    Raises
    ------
    RuntimeError
        A pour ended otherwise than at rest, jammed, or at its time limit.
    """
    backend.init(threads=1)
    values: dict[str, float] = {} if sleeping else {"numerics.sleep_speed": 0.0}
    if duration is not None:
        # A rest time beyond the end: nothing but the clock stops the run.
        values |= {"numerics.max_time": duration, "numerics.rest_time": 5.0}
    scene = with_values(scene, values)
    batch = Batch(capacity_for([scene], 1))
    _drive(batch, Pour(batch, 0, with_values(scene, WARM_UP), seed))
    wall, steps, simulated = 0.0, 0, 0.0
    for _ in range(times):
        pour = Pour(batch, 0, scene, seed)
        begin = time.perf_counter()
        contacts = _drive(batch, pour)
        wall += time.perf_counter() - begin
        if pour.ended[0] not in (Outcome.AT_REST, Outcome.TIME_LIMIT, Outcome.JAMMED, Outcome.OBSTRUCTED):
            raise RuntimeError(f"{case}: the pour ended with {pour.outcome}: {pour.message}")
        steps, simulated = steps + pour.steps, simulated + pour.time
    spheres = sum(len(scene.bodies[k].clump.radii) for k in pour.supply.order)
    name, touching = "ours" if sleeping else "ours, nothing sleeps", float(np.mean(contacts))
    return BenchmarkResult(case, name, len(pour.supply.order), spheres, steps, wall, simulated, contacts[-1], touching)


def measure_batch(case: str, scene: Scene, seeds: Sequence[int], workers: int) -> BenchmarkResult:
    """Pours of ``seeds`` to rest by a pool of ``workers``, as studies run them; steps are those of all together."""
    with WorkerPool(workers) as pool:
        list(pool.run_queue(deque(Job(with_values(scene, WARM_UP), seed) for seed in seeds), [scene]))
        begin = time.perf_counter()
        records = [record for _, record in pool.run_queue(deque(Job(scene, seed) for seed in seeds), [scene])]
        wall = time.perf_counter() - begin
    steps = sum(record.steps for record in records)
    bodies = max(len(record.bodies.mass) for record in records)
    spheres = max(len(record.spheres.radius) for record in records)
    simulated = sum(record.steps * record.dt for record in records)
    name = f"{len(seeds)} pours, {workers} worker{'s' if workers > 1 else ''}"
    return BenchmarkResult(case, name, bodies, spheres, steps, wall, simulated, float("nan"), float("nan"))


def wide_bed(tiles: tuple[int, int], copies: tuple[int, int] = (1, 1), seed: int = 1) -> Bed:
    """``tiles`` of the small bed side by side, relaxed for a moment; then ``copies`` of that; numbered at random.

    Parameters
    ----------
    tiles
        Small beds along x and y.
    copies
        Wide beds along x and y; with a tenth as many seams per sphere they are relaxed for a tenth of the time.
    seed
        Of the small bed's speeds and of the numbering.

    Returns
    -------
    The bed; the same order for every engine that is given it.
    """
    backend.init(threads=1)
    bed = settled(side_by_side(small_bed(seed), tiles), RELAXING_TIME)
    if copies != (1, 1):
        bed = settled(side_by_side(bed, copies), RELAXING_TIME / 10.0)
    return shuffled(bed, seed)


def small_bed(seed: int = 1) -> Bed:
    """The small bed at rest: a loose lattice with random speeds, dropped into its box."""
    rng = np.random.default_rng(seed)
    lattice = np.stack(np.meshgrid(*(np.arange(n) for n in TILE), indexing="ij"), axis=-1).reshape(-1, 3)
    box = Box(TILE[0] * SPACING, TILE[1] * SPACING)
    centres = (lattice + 0.5) * SPACING
    speeds = np.asarray(rng.normal(0.0, 0.1, centres.shape), dtype=float)
    return settled(Bed(box, np.asarray(centres, dtype=float), speeds), SETTLING_TIME)


def side_by_side(bed: Bed, copies: tuple[int, int]) -> Bed:
    """``copies`` of ``bed`` along x and y without the walls between them, at rest."""
    width, depth = bed.box.width, bed.box.depth
    shift = np.array([(i * width, j * depth, 0.0) for i in range(copies[0]) for j in range(copies[1])])
    centres = (shift[:, None, :] + bed.centres[None]).reshape(-1, 3)
    return Bed(Box(copies[0] * width, copies[1] * depth), centres, np.zeros_like(centres))


def shuffled(bed: Bed, seed: int) -> Bed:
    """``bed`` with its spheres numbered at random."""
    order = np.random.default_rng(seed).permutation(len(bed.centres))
    return Bed(bed.box, bed.centres[order], bed.velocities[order])


def settled(bed: Bed, duration: float) -> Bed:
    """``bed`` after ``duration`` [s]."""
    batch, dt = load_bed(bed)
    batch.advance(np.array([round(duration / dt)], dtype=np.int32))
    state = batch.bodies(0, len(bed.centres))
    return Bed(bed.box, state[:, 0:3], state[:, 7:10])


def bed_scene(box: Box) -> Scene:
    """The scene of a bed; no body sleeps, so that the figures are those of a bed that moves."""
    mass = 4.0 / 3.0 * np.pi * RADIUS**3 * 2500.0
    sphere = Members(((0.0, 0.0, 0.0),), (RADIUS,), mass, (0.4 * mass * RADIUS**2,) * 3)
    material = Material("glass", density=2500.0, shear_modulus=1e7, poisson_ratio=0.25)
    wall = Material("wall", density=2500.0, shear_modulus=1e7, poisson_ratio=0.25)
    return Scene(
        title="packed bed",
        materials=(material, wall),
        bodies=(Body("sphere", "glass", 1.0, sphere, 2500.0),),
        pairs=(Pair("glass", "glass", 0.5, 0.5), Pair("glass", "wall", 0.5, 0.5)),
        rig=box,
        numerics=Numerics(rayleigh_fraction=0.2, skin=SKIN, sleep_speed=0.0),
    )


def load_bed(bed: Bed) -> tuple[Batch, float]:
    """A batch of one world that holds ``bed``, and its time step [s]."""
    n = len(bed.centres)
    batch = Batch(Capacity(worlds=1, bodies=n, members=n, contacts=8 * n, kinds=2))
    scene = bed_scene(bed.box)
    dt = time_step(scene)
    batch.load(0, scene, body_tables(scene, np.zeros(n, dtype=np.int32)), dt, [True] * 5)
    upright, still = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)
    for b in range(n):
        batch.enter(0, b, bed.centres[b], upright, bed.velocities[b], still)
    return batch, dt


def summary_of(batch: Batch) -> dict[str, float]:
    """Summary of the one world by name."""
    return dict(zip(SUMMARY_COLUMNS, batch.measure(0)[0].tolist(), strict=True))


def bed_name(n: int) -> str:
    """Name of the case with ``n`` spheres."""
    return f"bed of {n} spheres"


def _drive(batch: Batch, pour: Pour) -> list[float]:
    """Run ``pour`` to its end; touching contacts at its moments of decision."""
    touching = SUMMARY_COLUMNS.index("touching")
    contacts = [0.0]
    while steps := pour.steps_due():
        row = batch.advance(np.array([steps], dtype=np.int32))[0]
        contacts.append(float(row[touching]))
        pour.after(steps, row)
    return contacts
