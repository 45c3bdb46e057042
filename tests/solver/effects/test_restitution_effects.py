"""Restitution that falls with speed, and plastic contacts: what comes back from an impact beside the closed forms."""

import dataclasses

import numpy as np
import pytest

from solver.backend import ti
from solver.effects.velocity_dependent_restitution import damping_of
from solver.laws import CONTACT_LAWS, HertzMindlin
from solver.laws.restitution import normal_damping
from solver.scenes.contact_model import ContactModel
from solver.scenes.insertion import rotation_matrix
from solver.scenes.material import effective_youngs_modulus
from solver.scenes.material_file import load_material
from solver.scenes.time_step import time_step
from solver.single_body.free_world import EARTH, GRAIN, RADIUS, WALL, FreeWorld, grain_on_plate
from tests.solver.effects.cases import felt, heavy, hertz_rest, scene_with

pytestmark = pytest.mark.usefixtures("taichi")


@ti.kernel
def dampings(restitutions: ti.types.ndarray(dtype=ti.f64, ndim=1), out: ti.types.ndarray(dtype=ti.f64, ndim=1)):
    for k in range(out.shape[0]):
        out[k] = damping_of(restitutions[k])


def test_the_series_of_the_damping_is_its_inverse():
    restitutions = np.linspace(0.05, 1.0, 500)
    out = np.zeros(500)
    dampings(restitutions, out)
    assert out == pytest.approx([normal_damping(e) for e in restitutions], abs=1e-6)


def rebounds(effect, speeds, restitution, law=HertzMindlin.name):
    """Restitution of spheres that hit the plane side by side at ``speeds``, without gravity."""
    scene = scene_with(effect, friction=0.0, restitution=restitution)
    # A third of the usual step: linear springs have fewer steps to a contact than Hertz's.
    lab = FreeWorld(dataclasses.replace(scene, contact=ContactModel(law=law)), len(speeds), fraction=0.03)
    for b, speed in enumerate(speeds):
        lab.put(b, (0.05 * b, 0.0, RADIUS + 1e-6), velocity=(0.0, 0.0, -speed))
    # The slowest takes longest, t ∝ v^(−1/5): 1.3 ms at 0.1 m/s.
    lab.run(round(0.01 / lab.dt))
    return lab.state()[:, 9] / np.array(speeds)


@pytest.mark.parametrize(("sensitivity", "reference"), [(1.0, 1.0), (0.5, 0.5), (2.0, 1.0)])
@pytest.mark.parametrize("law", CONTACT_LAWS)
def test_restitution_over_speed(sensitivity, reference, law):
    """One damping ratio gives one restitution in both laws, so the effect scales either damper."""
    speeds = np.array([0.03, 0.1, 0.3, 1.0, 2.0])
    effect = felt("velocity_dependent_restitution", speed_sensitivity=sensitivity, reference_speed=reference)
    expected = 1.0 - 0.5 * (1.0 + sensitivity * ((speeds / reference) ** 0.2 - 1.0))
    assert expected.min() > 0.05
    # Time step, as for the constant one (verification/README.md).
    assert rebounds(effect, speeds, 0.5, law) == pytest.approx(np.clip(expected, 0.05, 1.0), rel=5e-3)


def test_switched_on_a_contact_that_stands_keeps_its_damper():
    """A sphere that oscillates on the plane when the effect comes must not lose its damping."""
    lab = FreeWorld(scene_with(felt("air_drag", strength=1e-9), gravity=EARTH, restitution=0.3), 1)
    rest = hertz_rest(lab.scene.bodies[0].mass * 9.81, effective_youngs_modulus(GRAIN, WALL))
    lab.put(0, (0.0, 0.0, RADIUS - 0.5 * rest))
    lab.run(10)
    lab.batch.set_effects(0, scene_with(felt("velocity_dependent_restitution"), gravity=EARTH, restitution=0.3))
    lab.run(round(0.2 / lab.dt))
    assert RADIUS - lab.state()[0, 2] == pytest.approx(rest, rel=1e-5)


@pytest.mark.parametrize("plasticity", [0.25, 0.5, 0.8])
def test_a_plastic_contact_gives_back_the_same_share_at_any_speed(plasticity):
    """e² = (1 − 5/2 λ + 3/2 λ^{5/3})/(1 − λ), from the areas under the two branches."""
    expected = np.sqrt((1.0 - 2.5 * plasticity + 1.5 * plasticity ** (5.0 / 3.0)) / (1.0 - plasticity))
    found = rebounds(felt("plastic_contact", plasticity=plasticity), (0.3, 1.0), 1.0)
    assert found == pytest.approx([expected] * 2, rel=5e-3)  # the peak falls between two steps


EXTRACT = load_material("sunflower_extract")


def landings(body, plasticity, dt):
    """Share of the speed with which ``body`` leaves the plate, of falls at 2 m/s on its broad side, tilted a little."""
    grain = dataclasses.replace(body, name="grain", material="grain")
    scene = grain_on_plate(grain, friction=0.0, restitution=0.5)
    stiff = dataclasses.replace(EXTRACT.material(body.material), name="grain")
    scene = dataclasses.replace(scene, materials=(stiff, dataclasses.replace(WALL, shear_modulus=7e10)))
    tilts = np.radians([0.0, 0.02, 0.2, 1.0, 3.0])
    lab = FreeWorld(scene.with_effect(felt("plastic_contact", plasticity=plasticity)), len(tilts), dt=dt)
    for b, tilt in enumerate(tilts):
        turn = np.array([np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0])
        lowest = ((body.clump.centres @ rotation_matrix(turn).T)[:, 2] - body.clump.radii).min()
        lab.put(b, (0.2 * b, 0.0, 1e-6 - lowest), velocity=(0.0, 0.0, -2.0), quaternion=tuple(turn))
    lab.run(round(6e-3 / dt))
    return lab.state()[:, 9] / 2.0


@pytest.mark.parametrize("plasticity", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("body", EXTRACT.bodies, ids=lambda body: body.name)
def test_at_the_step_of_a_pour_a_body_leaves_as_with_an_eighth_of_it(body, plasticity):
    """Unloading is up to ten times as stiff as loading, and many spheres touch at once; the step is that without it."""
    dt = time_step(EXTRACT)
    # The step's own error: 0.010 without the effect, of a petiole that lands flat.
    assert landings(body, plasticity, dt) == pytest.approx(landings(body, plasticity, dt / 8.0), abs=0.015)


def test_a_dent_is_reloaded_along_its_unloading_branch():
    """A heavy sphere goes down, half up, down again and deeper: force over overlap by the formula at every sample."""
    plasticity, speed = 0.5, 1e-3
    scene = scene_with(
        felt("plastic_contact", plasticity=plasticity), bodies=(heavy(1e6),), friction=0.0, restitution=1.0
    )
    lab = FreeWorld(scene, 1, dt=1e-5)
    stiffness = 4.0 / 3.0 * effective_youngs_modulus(GRAIN, WALL) * np.sqrt(RADIUS)
    deepest, compared = 0.0, 0
    for start, stop in ((-1e-6, 1e-5), (1e-5, 8e-6), (8e-6, 1.4e-5), (1.4e-5, -1e-6)):
        direction = np.sign(stop - start)
        lab.put(0, (0.0, 0.0, RADIUS - start), velocity=(0.0, 0.0, -speed * direction))
        for _ in range(round(abs(stop - start) / (speed * lab.dt))):
            lab.run(1)
            overlap = max(0.0, RADIUS - lab.state()[0, 2] - direction * speed * lab.dt)  # when the force acted
            deepest = max(deepest, overlap)
            expected = (overlap**1.5 - plasticity * deepest**1.5) / (1.0 - plasticity)
            force = -lab.batch.surface_state(0)[0, 15]
            assert force == pytest.approx(max(0.0, stiffness * expected), rel=1e-3, abs=1e-4)  # it gives in a little
            compared += expected > 0.0
    assert compared > 1000
