"""Two seeds meet askew in free space: momenta, velocities and spins afterwards, in our solver, LIGGGHTS and YADE."""

import numpy as np
import pytest

from tests.peers.cases import LENGTH, Case, ours, theirs

pytestmark = pytest.mark.usefixtures("taichi")

APPROACH = 1.0
"""Speed at which the two come together [m/s]."""
ROUNDING = 1e-9
"""Twelve digits are written."""


def meeting(friction, **options):
    """Two seeds, each turned another way, one moving to the right and one to the left; they touch off centre."""
    turns = np.array([[0.9, 0.1, 0.3, 0.2], [0.3, -0.5, 0.6, 0.4]])
    return Case(
        position=np.array([[0.0, 0.0, 0.1], [0.016, 0.004, 0.103]]),
        quaternion=turns / np.linalg.norm(turns, axis=1)[:, None],
        velocity=np.array([[0.5, 0.05, 0.1], [-0.5, 0.0, 0.0]]),
        steps=4000,
        every=4000,
        friction=friction,
        plate=False,
        **options,
    )


def after(motions):
    """The last moment."""
    return motions[max(motions)]


def angular_momentum(case, motion):
    """Of both bodies about the origin, per unit mass [m²/s]."""
    clump = case.scene.bodies[0].clump
    own = [
        turn @ (clump.inertia / clump.mass * (turn.T @ w)) for turn, w in zip(motion.rotation, motion.spin, strict=True)
    ]
    return np.cross(motion.position, motion.velocity).sum(axis=0) + np.sum(own, axis=0)


def differences(one, other):
    """Largest difference of the velocities, and of the spins times half a length, as fractions of the approach."""
    velocity = np.abs(one.velocity - other.velocity).max() / APPROACH
    return velocity, np.abs(one.spin - other.spin).max() * LENGTH / 2.0 / APPROACH


@pytest.mark.parametrize(
    ("engine", "friction", "dashpot", "limit"),
    [
        # Asked for is 1 %; 0.04 % came out: the same functions, but ours takes the damper at the middle of the step.
        pytest.param("liggghts", 0.0, True, 0.01, marks=pytest.mark.peers("liggghts")),
        pytest.param("yade", 0.0, True, 0.01, marks=pytest.mark.peers("yade")),
        # Without tangential dashpots, YADE's law but for the unloading; LIGGGHTS's where the seeds slide on each other.
        pytest.param("yade", 0.57, False, 0.01, marks=pytest.mark.peers("yade")),
        pytest.param("liggghts", 0.1, False, 0.01, marks=pytest.mark.peers("liggghts")),
        # Their dashpots may exceed the Coulomb limit at first touch, ours may not: 7.4 % of spin, 2.6 % of velocity.
        pytest.param("liggghts", 0.57, True, 0.1, marks=pytest.mark.peers("liggghts")),
        pytest.param("yade", 0.57, True, 0.1, marks=pytest.mark.peers("yade")),
    ],
)
def test_two_seeds_part_alike(engine, friction, dashpot, limit, tmp_path):
    case = meeting(friction, tangential_damping=dashpot)
    one, other = after(ours(case)), after(theirs(case, engine, tmp_path))
    assert np.abs(one.velocity - case.velocity).max() > 0.2 * APPROACH  # they did meet
    assert other.velocity.sum(axis=0) == pytest.approx(case.velocity.sum(axis=0), abs=ROUNDING)
    assert one.velocity.sum(axis=0) == pytest.approx(case.velocity.sum(axis=0), abs=ROUNDING)
    assert max(differences(one, other)) < limit


@pytest.mark.peers("liggghts")
def test_angular_momentum_is_kept_by_both(tmp_path):
    case = meeting(0.57)
    start = np.cross(case.position, case.velocity).sum(axis=0)
    # Spins are half a step older than orientations: ½ |ω| dt = 1e-4 of them.
    scale = 0.5 * LENGTH * APPROACH
    for motions in (ours(case), theirs(case, "liggghts", tmp_path)):
        assert angular_momentum(case, after(motions)) == pytest.approx(start, abs=1e-3 * scale)
