"""Effects of material and set-up: identities of mass, volume and inertia, and where bodies begin to slide."""

import numpy as np
import pytest

from solver.engine.world import Batch
from solver.params import ParameterError
from solver.pours.pour import Pour
from solver.scenes.body import Body, Members
from solver.scenes.material import Pair, effective_youngs_modulus
from solver.scenes.material_file import load_material
from solver.scenes.scene import actual, body_counts, poured_mass, with_values
from solver.shapes.solid import Solid
from solver.single_body.free_world import EARTH, GRAIN, PLATE, RADIUS, WALL, FreeWorld, scene_of
from tests.solver.effects.cases import ROOM, felt, hertz_rest, scene_with, sled, with_effects

SCENE = load_material("sunflower_extract")


def solid(kind, *dimensions):
    body = Body("grain", "grain", 1.0, Solid(kind, dimensions), GRAIN.density, spheres="coarse")
    pairs = (Pair("grain", "grain", 0.5, 0.5), Pair("grain", "wall", 0.5, 0.5))
    return scene_of((body,), (GRAIN, WALL), pairs, (PLATE,))


def changed(scene, name, **values):
    return actual(with_effects(scene, felt(name, **values)))


def test_density_changes_mass_and_inertia_and_leaves_the_mass_poured():
    heavier = changed(SCENE, "density_error", excess=0.25)
    for before, after in zip(SCENE.bodies, heavier.bodies, strict=True):
        assert after.mass == pytest.approx(1.25 * before.mass)
        assert after.clump.inertia == pytest.approx(1.25 * before.clump.inertia)
        assert after.extents == pytest.approx(before.extents)
        assert after.density == pytest.approx(heavier.material(after.material).density)
    assert poured_mass(heavier) == pytest.approx(poured_mass(SCENE))
    assert sum(body_counts(heavier)) == pytest.approx(sum(body_counts(SCENE)) / 1.25, abs=1.0)
    wall = SCENE.rig.wall
    assert heavier.material(wall).density == SCENE.material(wall).density


def test_density_of_bodies_declared_by_their_spheres():
    scene = scene_with(bodies=(sled(),))
    before, after = scene.bodies[0], changed(scene, "density_error", excess=0.5).bodies[0]
    assert after.mass == pytest.approx(1.5 * before.mass)
    assert after.clump.inertia == pytest.approx(1.5 * before.clump.inertia)


@pytest.mark.parametrize(
    ("kind", "dimensions", "expected"),
    [
        ("ellipsoid", (0.03, 0.01, 0.006), (1.2, 1.2**-0.5, 1.2**-0.5)),
        ("box", (0.01, 0.02, 0.005), (1.2**-0.5, 1.2, 1.2**-0.5)),
        ("cylinder", (0.005, 0.05), (1.2**-0.5, 1.2)),
        ("cylinder", (0.05, 0.005), (1.2, 1.2**-2)),
    ],
)
def test_elongation_keeps_volume_and_mass(kind, dimensions, expected):
    scene = solid(kind, *dimensions)
    before, after = scene.bodies[0], changed(scene, "shape_elongation", elongation=0.2).bodies[0]
    assert after.shape.dimensions == pytest.approx(tuple(d * f for d, f in zip(dimensions, expected, strict=True)))
    assert after.mass == pytest.approx(before.mass, rel=1e-9)


def test_a_sphere_becomes_an_ellipsoid_with_its_inertia():
    after = changed(solid("sphere", 0.01), "shape_elongation", elongation=0.44).bodies[0]
    a, b = 0.005 * 1.44, 0.005 / 1.2
    mass = 4.0 / 3.0 * np.pi * 0.005**3 * GRAIN.density
    # m (b² + c²)/5 of an ellipsoid
    assert sorted(after.clump.inertia) == pytest.approx(
        sorted((0.4 * mass * b**2, mass * (a**2 + b**2) / 5, mass * (a**2 + b**2) / 5)), rel=1e-6
    )


def test_spheres_of_a_body_move_apart_and_its_inertia_follows_the_stretch():
    """Two point-like balls on a rod: the longest axis is x, m x² of it grows by (1 + ε)²."""
    half, mass = 0.02, 1e-3
    along, across = mass * half**2, 1e-9  # ∫ x², ∫ y² = ∫ z²
    rod = Members(((-half, 0.0, 0.0), (half, 0.0, 0.0)), (1e-3,) * 2, mass, (2e-9, along + across, along + across))
    scene = scene_with(bodies=(Body("grain", "grain", 1.0, rod, GRAIN.density),))
    after = changed(scene, "shape_elongation", elongation=0.5).bodies[0]
    assert after.clump.centres[:, 0] == pytest.approx([-1.5 * half, 1.5 * half])
    assert after.clump.inertia == pytest.approx(
        [2e-9 / 1.5, 2.25 * along + across / 1.5, 2.25 * along + across / 1.5], rel=1e-9
    )
    assert after.mass == mass


def test_sizes_scatter_in_squares_beside_the_declared_ones_and_their_mean_stays():
    scene = with_values(SCENE, {"body.seed.size_distribution": "uniform", "body.seed.size_spread": 0.3})
    after = changed(scene, "size_dispersion", spread=0.4)
    seed, plate = after.bodies[0].sizes, after.bodies[1].sizes
    assert (seed.kind, seed.spread) == ("uniform", pytest.approx(0.5))
    assert (plate.kind, plate.spread) == ("log_normal", pytest.approx(0.4))
    assert poured_mass(after) == pytest.approx(poured_mass(SCENE))
    with pytest.raises(
        ParameterError, match=r"size_dispersion\.spread: 0\.4 and the declared size_spread 0\.4 combine to 0\.566"
    ):
        with_values(
            SCENE,
            {
                "effect.size_dispersion.spread": 0.4,
                "body.seed.size_distribution": "uniform",
                "body.seed.size_spread": 0.4,
            },
        )


def test_tilted_gravity_keeps_its_length_and_leans_as_declared():
    for tilts in ((5.0, 0.0), (0.0, -7.0), (3.0, 4.0)):
        g = np.array(changed(SCENE, "plate_tilt", tilt_x=tilts[0], tilt_y=tilts[1]).gravity)
        assert np.linalg.norm(g) == pytest.approx(9.81)
        angle = np.degrees(np.arctan2(np.hypot(g[0], g[1]), -g[2]))
        assert angle == pytest.approx(np.hypot(*tilts))
        assert g[:2] / np.hypot(g[0], g[1]) == pytest.approx(np.array(tilts) / np.hypot(*tilts))


@pytest.mark.usefixtures("taichi")
@pytest.mark.parametrize(("factor", "slides"), [(0.98, False), (1.02, True)])
def test_on_a_tilted_plate_a_body_slides_beyond_the_angle_of_friction(factor, slides):
    friction = 0.3
    tilt = factor * np.degrees(np.arctan(friction))
    x, y = tilt * np.cos(0.7), tilt * np.sin(0.7)
    tilted = felt("plate_tilt", tilt_x=x, tilt_y=y)
    scene = scene_with(tilted, bodies=(sled(),), friction=friction, restitution=0.3, gravity=EARTH)
    lab = FreeWorld(scene, 1)
    e_star = effective_youngs_modulus(GRAIN, WALL)
    lab.put(0, (0.0, 0.0, RADIUS - hertz_rest(scene.bodies[0].mass * 9.81 / 4.0, e_star)))
    lab.run(round(0.1 / lab.dt))
    first, steps = lab.state()[0], round(0.1 / lab.dt)
    lab.run(steps)
    gained = (lab.state()[0, 7:9] - first[7:9]) / (steps * lab.dt)
    alpha = np.radians(tilt)
    if slides:
        # The two parts nearly cancel: 2 % of 0.06 m/s² are 0.01 % of either.
        expected = 9.81 * (np.sin(alpha) - friction * np.cos(alpha))
        assert gained == pytest.approx(expected * np.array([np.cos(0.7), np.sin(0.7)]), rel=0.02)
    else:
        assert np.hypot(*lab.state()[0, :2]) < 5e-5  # the first swing of the load slips by as much
        assert np.hypot(*gained) < 1e-3


@pytest.mark.usefixtures("taichi")
def test_the_pile_of_a_displaced_funnel_is_the_same_pile_displaced():
    scene = with_values(SCENE, {"body.spheres": "coarse", "rig.mass": "2g", "insertion.rate": "60g/s"})
    piles = []
    for one in (scene, with_effects(scene, felt("funnel_offset"))):
        pour = Pour(Batch(ROOM), 0, one, 5)
        while pour.time < 0.25:
            steps = pour.steps_due()
            pour.after(steps, pour.batch.advance(np.array([steps], dtype=np.int32))[0])
        piles.append(pour.record().pile)
    shift = np.array([0.01, -0.02, 0.0])
    assert len(piles[0].mass) > 1
    assert np.array_equal(piles[1].position, piles[0].position + shift)
    assert np.array_equal(piles[1].spheres.centre, piles[0].spheres.centre + shift)
