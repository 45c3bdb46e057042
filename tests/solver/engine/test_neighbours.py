"""The contact list never misses a contact, and surfaces are where they should be."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from solver.backend import ti
from solver.engine.kernels.geometry import nearest_on_revolved
from solver.engine.state import Vec3, Vec4
from solver.engine.tables import body_tables
from solver.engine.world import SUMMARY_COLUMNS, Batch
from solver.pours.run import Job, capacity_for, run_pours
from solver.scenes.insertion import rotation_matrix
from solver.scenes.material_file import load_material
from solver.scenes.scene import with_values
from solver.single_body.free_world import RADIUS, ROOM, UPRIGHT, FreeWorld, grain_on_plate

pytestmark = pytest.mark.usefixtures("taichi")

SMALL = {"rig.mass": "5g", "body.spheres": "coarse", "insertion.rate": "100g/s", "numerics.max_time": 0.45}


@ti.kernel
def distance_to_cone(out: ti.types.ndarray(dtype=ti.f64, ndim=1), g: ti.types.ndarray(dtype=ti.f64, ndim=1)):
    for _ in range(1):
        hit = nearest_on_revolved(Vec4(g[0], g[1], g[2], g[3]), Vec3(g[4], g[5], g[6]))
        for k in ti.static(range(4)):
            out[k] = hit[k]


@pytest.mark.parametrize("seed", range(10))
def test_distance_to_a_revolved_segment_against_a_search(seed):
    rng = np.random.default_rng(seed)
    segment, point = np.abs(rng.normal(size=4)), rng.normal(size=3)
    out = np.zeros(4)
    distance_to_cone(out, np.concatenate([segment, point]))

    def distance(t):
        r, z = segment[:2] + t * (segment[2:] - segment[:2])
        return np.hypot(np.hypot(point[0], point[1]) - r, point[2] - z)

    best = minimize_scalar(distance, bounds=(0, 1), method="bounded", options={"xatol": 1e-12})
    expected = min(best.fun, distance(0.0), distance(1.0))
    assert out[3] == pytest.approx(expected, rel=1e-9)
    assert np.linalg.norm(out[:3]) == pytest.approx(1.0)
    foot = point - out[3] * out[:3]  # the nearest point must lie on the surface
    again = np.zeros(4)
    distance_to_cone(again, np.concatenate([segment, foot]))
    assert again[3] == pytest.approx(0.0, abs=1e-9)


def test_every_touching_pair_is_in_the_list():
    """Touching pairs counted by the kernel against all pairs of member spheres in NumPy, through a crowded pour."""
    scene = with_values(load_material("sunflower_extract"), SMALL)
    checked = []

    def compare(_, pour):
        bodies = pour.bodies()
        centres, radii, owner = [], [], []
        for b in range(len(bodies.mass)):
            clump = scene.bodies[bodies.component[b]].clump
            centres.append(bodies.position[b] + clump.centres @ rotation_matrix(bodies.quaternion[b]).T)
            radii.append(clump.radii)
            owner.append(np.full(len(clump.radii), b))
        c, r, o = np.concatenate(centres), np.concatenate(radii), np.concatenate(owner)
        gap = np.linalg.norm(c[:, None] - c[None], axis=2) - r[:, None] - r[None]
        touching = (gap < 0) & (o[:, None] < o[None])
        # The summary counts contacts as they were one step before the positions seen here.
        near = (np.abs(gap) < 1e-5) & (o[:, None] < o[None])
        plate = c[:, 2] < r
        counted = pour.samples[-1]["touching"]
        cone = sum(on_cone(scene.rig, point, radius) for point, radius in zip(c, r, strict=True))
        checked.append(
            abs(counted - touching.sum() - plate.sum() - cone) <= near.sum() + (np.abs(c[:, 2] - r) < 1e-5).sum() + 1
        )

    list(run_pours([Job(scene, 4)], worlds=1, on_sample=compare))
    assert len(checked) > 30
    assert np.mean(checked) == 1.0


def on_cone(rig, point, radius):
    out = np.zeros(4)
    segment = [rig.outlet_diameter / 2, rig.outlet_height, rig.inlet_diameter / 2, rig.inlet_height]
    distance_to_cone(out, np.array([*segment, *point]))
    return out[3] < radius


def test_skin_changes_no_bit():
    scenes = [with_values(load_material("sunflower_extract"), {**SMALL, "numerics.skin": s}) for s in (3e-4, 2e-3)]
    records = [record for _, record in sorted(run_pours([Job(s, 2) for s in scenes], worlds=2), key=lambda x: x[0])]
    assert records[0].steps == records[1].steps > 10_000
    assert np.array_equal(records[0].bodies.position, records[1].bodies.position)
    assert np.array_equal(records[0].bodies.quaternion, records[1].bodies.quaternion)


@pytest.mark.slow
def test_a_list_that_does_not_fit_is_built_with_narrow_margins():
    """A crowd that flies as one: nobody comes nearer, and yet every margin is wide."""
    lab = FreeWorld(grain_on_plate(), 1, plate=False)
    crowd = 2.3 * RADIUS * np.stack(np.meshgrid(*[np.arange(4.0)] * 3), axis=-1).reshape(-1, 3)
    batch = Batch(dataclasses.replace(ROOM, contacts=100))
    batch.load(0, lab.scene, body_tables(lab.scene, np.zeros(len(crowd), dtype=np.int32)), lab.dt, [False])
    for b, place in enumerate(crowd):
        batch.enter(0, b, place, UPRIGHT, np.array([3.0, 0.0, 0.0]), np.zeros(3))
    row = dict(zip(SUMMARY_COLUMNS, batch.advance(np.array([200], dtype=np.int32))[0], strict=True))
    assert row["overflow"] == 0
    assert batch.bodies(0, len(crowd))[:, 0] == pytest.approx(crowd[:, 0] + 3.0 * 200 * lab.dt)


def test_a_body_swings_as_far_as_its_farthest_member_whichever_thread_loads_it():
    """Two threads load a world, each a share of the members; a body of theirs may lie on the border."""
    scene = with_values(load_material("sunflower_extract"), {"rig.mass": "60g"})
    bodies = body_tables(scene, np.arange(60, dtype=np.int32) % len(scene.bodies))
    expected = np.zeros(60)
    np.maximum.at(expected, bodies.owner[:, 0], np.linalg.norm(bodies.spheres[:, :3], axis=1))
    batch = Batch(capacity_for([scene], 1))
    for _ in range(50):
        batch.load(0, scene, bodies, 1e-6, [True] * len(scene.rig.surfaces()))
        assert batch._s.body.swing.to_numpy()[0, :60] == pytest.approx(expected, rel=1e-12)
