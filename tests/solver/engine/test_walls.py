"""Walls of any pose, shape and motion: triangle meshes against primitives, moving walls, forces on walls."""

import dataclasses

import numpy as np
import pytest
import trimesh

from solver.engine.tables import LEAVE, SEE_GUARD, mesh_wall
from solver.params import ParameterError
from solver.rigs.rig import BareRig
from solver.rigs.surface import Plane, Revolved, SurfacePose, TriangleMesh, load_mesh, rectangle
from solver.scenes.insertion import rotation_matrix
from solver.single_body.free_world import EARTH, FREE, RADIUS, FreeWorld, grain_on_plate, sphere

pytestmark = pytest.mark.usefixtures("taichi")


@dataclasses.dataclass(frozen=True)
class Walls(BareRig):
    """A rig of bare surfaces."""

    parts: tuple
    wall: str = "wall"
    domain_half_width: float = 10.0

    def surfaces(self):
        return self.parts


def room(*surfaces, n=1, gravity=EARTH, friction=0.3, restitution=0.5, body=None, fraction=0.1):
    scene = grain_on_plate(body=body, friction=friction, restitution=restitution, gravity=gravity)
    scene = dataclasses.replace(scene, rig=Walls(tuple(surfaces)))
    return FreeWorld(scene, n, fraction=fraction, active=[True] * len(surfaces))


def as_mesh(mesh, material="wall"):
    vertices = tuple(tuple(float(x) for x in v) for v in mesh.vertices)
    return TriangleMesh(vertices, tuple(tuple(int(k) for k in f) for f in mesh.faces), material)


def sheet(size, n, seed=0):
    """A flat square of 2 n² triangles whose inner corners are displaced at random within the plane."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(-size, size, n + 1), np.linspace(-size, size, n + 1), indexing="ij")
    inner = np.zeros_like(x, dtype=bool)
    inner[1:-1, 1:-1] = True
    step = 2 * size / n
    x, y = x + inner * rng.uniform(-0.3, 0.3, x.shape) * step, y + inner * rng.uniform(-0.3, 0.3, x.shape) * step
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    faces = []
    for i in range(n):
        for j in range(n):
            a, b, c, d = (i * (n + 1) + j, (i + 1) * (n + 1) + j, (i + 1) * (n + 1) + j + 1, i * (n + 1) + j + 1)
            faces += [(a, b, c), (a, c, d)]
    return trimesh.Trimesh(vertices, faces, process=False)


PLATE = Plane("wall")
TILT = SurfacePose((0.01, -0.02, 0.03), tuple(np.array([0.9, 0.2, -0.1, 0.3]) / np.linalg.norm([0.9, 0.2, -0.1, 0.3])))


def rolled(surface, steps=18_000):
    lab = room(surface)
    lab.put(0, (-0.03, 0.002, RADIUS - 1e-6), velocity=(0.3, 0.05, 0.0))
    path = []
    for _ in range(30):
        lab.run(steps // 30)
        path.append(lab.state()[0, :13])
    return np.array(path)


@pytest.mark.slow
def test_a_sphere_rolls_on_a_finely_meshed_plane_as_on_the_primitive():
    """Facets of 2 mm under a sphere of 5 mm: slipping, sticking and rolling over some thirty edges."""
    primitive, meshed = rolled(PLATE), rolled(as_mesh(sheet(0.08, 80)))
    travelled = np.linalg.norm(primitive[-1, :2] - primitive[0, :2])
    assert travelled > 0.05
    # The nearest point of a triangle is computed by another formula than that of a plane: rounding of the height.
    assert np.abs(meshed[:, :3] - primitive[:, :3]).max() < 1e-9
    assert np.abs(meshed[:, 7:13] - primitive[:, 7:13]).max() < 1e-6


def test_one_patch_for_a_flat_sheet_and_six_for_a_box():
    assert mesh_wall(as_mesh(sheet(0.1, 10))).patch.max() == 0
    box = mesh_wall(as_mesh(trimesh.creation.box((1, 1, 1))))
    assert box.patch.max() == 5
    # Each of the twelve edges is one triangle's to guard and another's to leave.
    assert (box.edges == SEE_GUARD).sum() == (box.edges == LEAVE).sum() == 12


def test_patches_do_not_depend_on_the_winding():
    mesh = trimesh.creation.box((1, 1, 1)).subdivide()
    flipped = mesh.faces.copy()
    flipped[::3] = flipped[::3, ::-1]
    other = trimesh.Trimesh(mesh.vertices, flipped, process=False)
    assert mesh_wall(as_mesh(other)).patch.max() == 5


@pytest.mark.parametrize("pose", [SurfacePose(), TILT])
def test_a_plane_and_a_cone_in_any_pose_push_as_at_home(pose):
    """Turning walls, gravity and the body together turns the motion."""
    turn = rotation_matrix(np.array(pose.quaternion))
    cone = (0.02, 0.0, 0.03, 0.02)
    start, velocity = np.array([0.006, 0.0, 0.02]), np.array([0.3, 0.1, 0.0])
    home = room(PLATE, Revolved(*cone, "wall"), gravity=EARTH)
    home.put(0, start, velocity=velocity)
    home.run(7000)
    expected = pose.origin + turn @ home.state()[0, :3]
    free = velocity + np.array(EARTH) * 7000 * home.dt
    assert np.linalg.norm(home.state()[0, 7:10] - free) > 0.2  # it has met the walls
    away = room(Plane("wall", pose), Revolved(*cone, "wall", pose), gravity=tuple(turn @ np.array(EARTH)))
    away.put(0, pose.origin + turn @ start, velocity=turn @ velocity)
    away.run(7000)
    assert np.allclose(away.state()[0, :3], expected, atol=1e-8)  # rounding, grown by three bounces


def test_a_box_edge_pushes_once():
    """A sphere that meets the edge of a box from outside is pushed along the bisector with the force of one contact."""
    box = as_mesh(trimesh.creation.box((0.04, 0.04, 0.04)))
    lab = room(box, gravity=FREE, friction=0.0, restitution=1.0)
    outward = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    lab.put(0, np.array([0.02, 0.003, 0.02]) + (RADIUS + 1e-4) * outward, velocity=-0.5 * outward)
    lab.run(4000)
    state = lab.state()[0]
    flat = room(PLATE, gravity=FREE, friction=0.0, restitution=1.0)
    flat.put(0, (0.0, 0.0, RADIUS + 1e-4), velocity=(0.0, 0.0, -0.5))
    flat.run(4000)
    assert np.allclose(state[7:10], 0.5 * outward, atol=2e-3)
    # Two contacts in the same place would give the speed back, too, but sooner.
    way = np.linalg.norm(state[:3] - [0.02, 0.003, 0.02])
    assert way == pytest.approx(flat.state()[0, 2], rel=1e-4)


def test_a_corner_inside_a_box_pushes_from_all_three_sides():
    """A sphere pressed into the inner corner of a meshed box stands on three walls, a third of its weight on each."""
    box = as_mesh(trimesh.creation.box((0.04, 0.04, 0.04)))
    down = -9.81 * np.ones(3) / np.sqrt(3.0)
    lab = room(box, gravity=tuple(down), friction=0.0, restitution=0.2)
    lab.put(0, -0.02 + (RADIUS + 1e-6) * np.ones(3))
    row = lab.run(60_000)
    assert row["touching"] == 3
    mass = lab.scene.bodies[0].mass
    assert np.allclose(lab.batch.surface_state(0)[0, 13:16], mass * down, rtol=1e-3)


def test_a_rectangle_carries_and_its_hole_lets_through():
    lab = room(rectangle((0.0, -0.05, 0.0), (0.05, 0.0, 0.0), (0.0, 0.1, 0.0), "wall"), n=2, restitution=0.3)
    lab.put(0, (0.02, 0.0, 0.01))
    lab.put(1, (-0.02, 0.0, 0.01))
    lab.run(30_000)
    state = lab.state()
    assert state[0, 2] == pytest.approx(RADIUS, rel=1e-3)
    assert state[1, 2] < -0.1


def test_a_moving_plate_carries_a_ball_up_and_tells_its_weight():
    lab = room(PLATE, restitution=0.3)
    lab.put(0, (0.0, 0.0, RADIUS))
    lab.run(20_000)
    lab.batch.set_motion(0, 0, (0.0, 0.0, 0.05), (0.0, 0.0, 0.0))
    steps = 40_000
    row = lab.run(steps)
    lift = 0.05 * steps * lab.dt
    mass = lab.scene.bodies[0].mass
    assert lab.state()[0, 2] == pytest.approx(RADIUS + lift, abs=5e-6)  # overlap
    assert lab.batch.surface_state(0)[0, 15] == pytest.approx(-mass * 9.81, rel=1e-3)
    # Work of the wall: lifting, and bringing the ball to speed.
    assert row["wall_work"] == pytest.approx(mass * 9.81 * lift + 0.5 * mass * 0.05**2, rel=0.01)


def test_a_belt_drags_a_ball_into_rolling():
    """On a belt that moves at V a sliding ball ends rolling at 2/7 V: momentum μ m g t, spin 5/2 of it over r."""
    lab = room(PLATE, restitution=0.3)
    lab.put(0, (0.0, 0.0, RADIUS - 1e-6))
    lab.batch.set_motion(0, 0, (0.2, 0.0, 0.0), (0.0, 0.0, 0.0))
    lab.run(60_000)
    assert lab.state()[0, 7] == pytest.approx(0.2 * 2.0 / 7.0, rel=2e-3)


def test_a_turning_mesh_is_where_its_turned_twin_is():
    """A ball thrown at a paddle that has turned by 90° bounces as from one that was built so."""
    paddle = rectangle((-0.02, -0.02, 0.0), (0.04, 0.0, 0.0), (0.0, 0.04, 0.0), "wall")
    turning = room(paddle, gravity=FREE)
    turning.put(0, (1.0, 0.0, 0.0))
    steps = 20_000
    turning.batch.set_motion(0, 0, (0.0, 0.0, 0.0), (0.0, 0.5 * np.pi / (steps * turning.dt), 0.0))
    turning.run(steps)
    turning.batch.set_motion(0, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    after_turning = bounced(turning)
    built = room(rectangle((0.0, -0.02, -0.02), (0.0, 0.04, 0.0), (0.0, 0.0, 0.04), "wall"), gravity=FREE)
    as_built = bounced(built)
    assert as_built[7] > 0.2
    assert np.allclose(after_turning, as_built, atol=1e-6)


def bounced(lab):
    lab.put(0, (0.02, 0.004, 0.003), velocity=(-0.5, 0.0, 0.0))
    lab.run(4000)
    return lab.state()[0, :13]


def test_a_body_follows_a_wall_that_was_switched_off():
    lab = room(PLATE, rectangle((-0.1, -0.1, 0.05), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0), "wall"), restitution=0.2)
    lab.put(0, (0.0, 0.0, 0.05 + RADIUS))
    lab.run(20_000)
    assert lab.state()[0, 2] == pytest.approx(0.05 + RADIUS, rel=1e-3)
    lab.batch.set_active(0, 1, False)
    lab.run(60_000)
    assert lab.state()[0, 2] == pytest.approx(RADIUS, rel=1e-3)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb"])
def test_a_mesh_file_becomes_a_wall(tmp_path, suffix):
    path = tmp_path / f"box.{suffix}"
    trimesh.creation.box((20.0, 20.0, 20.0)).export(path)
    wall = load_mesh(path, "wall", metres_per_unit=1e-3)
    assert mesh_wall(wall).patch.max() == 5
    assert np.abs(np.array(wall.vertices)).max() == pytest.approx(0.01)


def test_a_file_without_triangles_is_named(tmp_path):
    path = tmp_path / "nothing.stl"
    path.write_text("solid nothing\nendsolid nothing\n")
    with pytest.raises(ParameterError, match=r"nothing\.stl"):
        load_mesh(path, "wall", metres_per_unit=1.0)


def test_spheres_of_a_body_touch_a_mesh_each_for_itself():
    """A pair of coincident spheres in one body has two contacts with the same patch."""
    lab = room(as_mesh(sheet(0.05, 8)), body=sphere(copies=2), restitution=0.3)
    lab.put(0, (0.0, 0.0, RADIUS - 1e-7))
    assert lab.run(20_000)["touching"] == 2
