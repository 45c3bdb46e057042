"""Effects beside each other and beside the rules of clumps: each stays what it is, and vanishes as it does alone."""

import dataclasses

import numpy as np
import pytest

from solver.effects import EFFECTS
from solver.effects.jkr_contact import grip
from solver.scenes.body import Body, Members
from solver.scenes.material import effective_youngs_modulus
from solver.single_body.free_world import GRAIN, RADIUS, WALL, FreeWorld, grain_on_plate
from tests.solver.effects.cases import felt, heavy, scene_with, with_effects

pytestmark = pytest.mark.usefixtures("taichi")

GAP = 5e-5
"""[m] within the reach of ``FAINT``."""
FAINT = felt("capillary_bridge", surface_tension=1e-6, bridge_volume=1e-9)
"""A bridge that holds and hardly pulls."""
MOST_GAP = grip(5.5, effective_youngs_modulus(GRAIN, WALL), RADIUS)


def force_of(lab):
    """Normal force [N] of the plane on the body at the last step; NaN where nothing acts."""
    rows = lab.batch.contacts(0)
    return float(rows[0, 10]) if len(rows) else np.nan


def at_gaps(effects, gaps):
    """Forces [N] on a sphere that has touched the plane and is held at one gap [m] after the other."""
    lab = FreeWorld(with_effects(grain_on_plate(restitution=1.0), *effects), 1)
    found = []
    for gap in (-1e-9, *gaps):
        lab.put(0, (0.0, 0.0, RADIUS + gap))
        lab.run(1)
        found.append(force_of(lab))
    return np.array(found[1:])


def works(first, second):
    """JKR of these works of adhesion [J/m²], among all and at walls."""
    return EFFECTS["adhesion_jkr"](first), EFFECTS["wall_adhesion"](second)


@pytest.mark.parametrize("split", [(5.0, 0.5), (0.5, 5.0), (2.75, 2.75)])
def test_two_works_of_adhesion_are_their_sum_up_to_where_the_surfaces_part(split):
    gaps = MOST_GAP * np.array([0.0, 0.5, 0.85, 0.93, 0.95, 0.999])
    whole = at_gaps(works(5.5, 0.0), gaps)
    assert np.isfinite(whole).all()
    assert at_gaps(works(*split), gaps) == pytest.approx(whole, rel=1e-9)


def test_surfaces_that_a_bridge_holds_do_not_begin_to_adhere_at_a_gap():
    back = [GAP, 0.9 * MOST_GAP]
    alone = at_gaps([FAINT], back)
    both = at_gaps([FAINT, *works(5.5, 0.0)], back)
    assert np.isfinite(alone).all()
    assert both == pytest.approx(alone, rel=1e-9)


def pressed_again(*effects):
    """Force [N] of the plane on a heavy sphere: pressed by 20 µm, taken off to a gap, pressed by 5 µm."""
    scene = with_effects(scene_with(bodies=(heavy(1e6),), friction=0.0, restitution=1.0), *effects)
    lab = FreeWorld(scene, 1, dt=1e-5)
    for overlap in (2e-5, -GAP, 5e-6):
        lab.put(0, (0.0, 0.0, RADIUS - overlap))
        lab.run(1)
    return -lab.batch.surface_state(0)[0, 15]


def test_a_dent_is_forgotten_when_surfaces_part_though_a_bridge_holds():
    plastic = felt("plastic_contact")
    assert pressed_again(plastic) > 0.01
    assert pressed_again(plastic, FAINT) == pytest.approx(pressed_again(plastic), rel=1e-4)


def rebound_after_a_graze(*effects):
    """Restitution of a hit at 2 m/s that follows a touch at 1 mm/s from which the surfaces part by a gap."""
    lab = FreeWorld(with_effects(grain_on_plate(restitution=0.6, friction=0.0), *effects), 1)
    for gap, speed in ((-1e-9, 1e-3), (GAP, 0.0)):
        lab.put(0, (0.0, 0.0, RADIUS + gap), velocity=(0.0, 0.0, -speed))
        lab.run(1)
    lab.put(0, (0.0, 0.0, RADIUS + 1e-6), velocity=(0.0, 0.0, -2.0))
    for _ in range(400):
        lab.run(10)
        if lab.state()[0, 9] > 0.0 and lab.state()[0, 2] > RADIUS + 1e-6:
            break
    return lab.state()[0, 9] / 2.0


def test_a_hit_has_the_restitution_of_its_own_speed_though_a_bridge_has_held():
    by_speed = felt("velocity_dependent_restitution")
    alone = rebound_after_a_graze(by_speed)
    assert alone < 0.58
    assert rebound_after_a_graze(by_speed, FAINT) == pytest.approx(alone, abs=2e-3)


def slab():
    """25 spheres in a square, which land at once."""
    mass, half = 5e-3, 0.012
    at = np.linspace(-half, half, 5)
    moment = mass * (2.0 * half) ** 2 / 12.0
    centres = tuple((float(x), float(y), 0.0) for x in at for y in at)
    members = Members(centres, (RADIUS,) * 25, mass, (moment, moment, 2.0 * moment))
    return Body("grain", "grain", 1.0, members, GRAIN.density)


def landed(rule, *effects, restitution=0.5):
    """Restitution of a slab that lands flat at 0.5 m/s, without friction."""
    scene = with_effects(grain_on_plate(slab(), friction=0.0, restitution=restitution), *effects)
    lab = FreeWorld(dataclasses.replace(scene, contact=dataclasses.replace(scene.contact, clump_rule=rule)), 1)
    lab.put(0, (0.0, 0.0, RADIUS + 1e-7), velocity=(0.0, 0.0, -0.5))
    for _ in range(4000):
        lab.run(20)
        if lab.state()[0, 9] > 0.0 and lab.state()[0, 2] > RADIUS + 2e-5:
            break
    return lab.state()[0, 9] / 0.5


@pytest.mark.slow
def test_adhesion_vanishes_for_contacts_that_share_their_stiffness():
    """A tenth of a percent: the state is looked at every 20 steps, and the pull goes with the root of w."""
    faint = EFFECTS["adhesion_jkr"](1e-9)
    assert landed("local_mass_shared", faint) == pytest.approx(landed("local_mass_shared"), abs=1e-3)


@pytest.mark.slow
def test_adhesion_goes_on_where_surfaces_that_share_their_stiffness_come_apart():
    """The force of the plane on a slab of 25 spheres an atom's width on either side of touching."""
    scene = with_effects(grain_on_plate(slab(), friction=0.0), EFFECTS["adhesion_jkr"](1.0))
    rule = dataclasses.replace(scene.contact, clump_rule="local_mass_shared")
    lab = FreeWorld(dataclasses.replace(scene, contact=rule), 1)
    forces = []
    for overlap in (1e-8, 1e-10, -1e-10):
        lab.put(0, (0.0, 0.0, RADIUS - overlap))
        lab.run(1)
        forces.append(lab.batch.contacts(0)[:, 10].sum())
    assert forces[1] < -0.1
    assert forces[2] == pytest.approx(forces[1], rel=1e-3)


def test_a_plastic_contact_gives_the_same_back_where_contacts_share():
    """e² = (1 − 5/2 λ + 3/2 λ^{5/3})/(1 − λ), at any stiffness."""
    share = 0.5
    expected = np.sqrt((1.0 - 2.5 * share + 1.5 * share ** (5.0 / 3.0)) / (1.0 - share))
    plastic = felt("plastic_contact", plasticity=share)
    assert landed("local_mass_shared", plastic, restitution=1.0) == pytest.approx(expected, abs=5e-3)


def test_an_effect_that_is_switched_on_again_begins_anew():
    """A grain at rest stays at rest, whatever its rolling spring held when the effect was switched off."""
    rolling = felt("rolling_resistance", rolling_friction=0.3)
    scene = grain_on_plate(restitution=0.6)
    lab = FreeWorld(scene.with_effect(rolling), 1)
    lab.put(0, (0.0, 0.0, RADIUS - 1e-6), velocity=(0.05, 0.0, 0.0), spin=(0.0, 10.0, 0.0))
    lab.run(400)
    lab.batch.set_effects(0, scene)
    lab.run(10)
    lab.put(0, (0.0, 0.0, RADIUS - 1e-6))
    lab.batch.set_effects(0, scene.with_effect(rolling))
    lab.run(30)
    assert np.abs(lab.state()[0, 10:13]).max() < 1e-9
