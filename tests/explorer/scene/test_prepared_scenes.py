"""Prepared scenes: in each the change of one slider is seen within 2 s of simulated time; how far is measured."""

import math

import numpy as np
import pytest

from explorer.scene.file import load_scene
from solver.assets import shipped_assets
from solver.engine.world import Batch
from solver.pours.pour import Pour
from solver.pours.record import Outcome
from solver.pours.run import capacity_for
from solver.scenes.scene import Scene, parameters, with_values

pytestmark = pytest.mark.usefixtures("taichi")

G = 9.81
SOON = 2.0
"""Simulated time [s] within which a change has to be seen."""
SEEN = 6e-3
"""[m]: half a bead, more than a twentieth of the height of the rig in the picture."""


def poured(name: str, seconds: float) -> Pour:
    """A pour of the scene after ``seconds`` of simulated time, or at its end."""
    scene = load_scene(name)
    return advance(Pour(Batch(capacity_for([scene], 1)), 0, scene, 1), seconds)


def advance(pour: Pour, seconds: float) -> Pour:
    end = pour.time + seconds
    while pour.time < end - pour.dt and (steps := pour.steps_due(max(1, round((end - pour.time) / pour.dt)))) > 0:
        pour.after(steps, pour.batch.advance(np.array([steps], dtype=np.int32))[0])
    return pour


def moved(scene: Scene, name: str, number: float) -> Scene:
    """``scene`` with the slider of ``name`` at ``number`` for all pairs or materials of bodies; all have to be live."""
    bodies = {body.material for body in scene.bodies}
    paths = [path for path in parameters(scene) if path.endswith(f".{name}")]
    paths = [path for path in paths if path.startswith("pair.") or path.split(".")[1] in bodies]
    assert all(parameters(scene)[path].live for path in paths)
    return with_values(scene, dict.fromkeys(paths, number))


def test_there_is_one_for_friction_for_restitution_and_for_stiffness():
    assert set(shipped_assets("scenes")) == {"friction_on_a_slope", "bouncing_beads", "soft_beads"}


def test_on_the_slope_friction_below_its_tangent_lets_everything_slide():
    pour = poured("friction_on_a_slope", 2.0)
    slope = math.radians(15.0)
    rest = pour.bodies().position.copy()
    # Above tan 15° = 0.268 the pile stands, whatever friction is: to the eye, since after two seconds some bodies still
    # rock by 1 mm or so, other ones on other processors.
    pour.ramp_to(moved(pour.scene, "static_friction", 0.35))
    advance(pour, 0.3)
    still = pour.bodies().position.copy()
    assert np.median(np.linalg.norm(still - rest, axis=1)) < 0.5 * SEEN
    pour.ramp_to(moved(pour.scene, "static_friction", 0.1))
    advance(pour, 0.3)
    slid = pour.bodies().position - still
    # Coulomb: a = g (sin θ − μ cos θ), down the slope.
    wanted = 0.5 * G * (math.sin(slope) - 0.1 * math.cos(slope)) * 0.3**2
    assert wanted > 10 * SEEN
    assert np.median(slid[:, 0]) == pytest.approx(wanted, rel=0.15)


def bounce(pour: Pour, seconds: float) -> float:
    """Height [m] to which the beads' largest upward velocity within ``seconds`` would carry them."""
    end, fastest = pour.time + seconds, 0.0
    while pour.time < end:
        advance(pour, 0.01)
        fastest = max(fastest, float(pour.batch.bodies(0, pour.entered)[:, 9].max()))
    return fastest**2 / (2 * G)


def test_beads_bounce_to_the_square_of_their_restitution():
    pour = poured("bouncing_beads", 0.6)
    rig, drop = pour.scene.rig, pour.scene.insertion.drop_speed
    fall = rig.inlet_height - 6e-3 + drop**2 / (2 * G)
    before = bounce(pour, 0.5 * SOON)
    assert before == pytest.approx(0.85**2 * fall, rel=0.25)
    pour.ramp_to(moved(pour.scene, "restitution", 0.1))
    advance(pour, 0.4)  # who is in the air has fallen
    after = bounce(pour, SOON - 0.4)
    assert after < 0.3 * before
    assert before - after > 10 * SEEN


def test_soft_beads_squeeze_through_the_outlet_that_holds_stiff_ones():
    pour = poured("soft_beads", 5.0)
    held = pour.entered
    assert pour.outcome == Outcome.JAMMED
    assert pour.bodies().position[:, 2].min() > pour.scene.rig.outlet_height - 6e-3
    pour.ramp_to(moved(pour.scene, "shear_modulus", 1e5))  # woken, at the modulus that it has: the arch holds
    advance(pour, SOON)
    assert pour.bodies().position[:, 2].min() > pour.scene.rig.outlet_height - 6e-3
    pour.ramp_to(moved(pour.scene, "shear_modulus", 1e4))
    advance(pour, SOON)
    through = (pour.bodies().position[:, 2] < pour.scene.rig.outlet_height - 6e-3).sum()
    assert through > held / 3
    assert pour.outcome in (Outcome.RUNNING, Outcome.JAMMED, Outcome.AT_REST, Outcome.NO_HEAP)
