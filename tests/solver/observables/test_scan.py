"""A scanned pile is the pile that was scanned: centres of mass, masses, and what is refused."""

import dataclasses

import numpy as np
import pytest

from solver.observables.scan import centre_weights, scanned_pile
from solver.params import ParameterError
from solver.scenes.insertion import random_quaternion, rotation_matrix
from solver.scenes.material_file import load_material
from solver.scenes.scene import with_values

SUNFLOWER = load_material("sunflower_extract")
SEEDS = with_values(
    dataclasses.replace(SUNFLOWER, bodies=(dataclasses.replace(SUNFLOWER.bodies[0], mass_fraction=1.0),)),
    {"body.spheres": "coarse"},
)
CLUMP = SEEDS.bodies[0].clump


def scanned(n=5, scales=None):
    """Centres of mass, and the spheres of ``n`` seeds at random places, body after body."""
    rng = np.random.default_rng(3)
    scales = np.ones(n) if scales is None else scales
    position = rng.uniform(-0.05, 0.05, (n, 3))
    turned = [s * CLUMP.centres @ rotation_matrix(random_quaternion(rng)).T for s in scales]
    xyz = np.concatenate([x + t for x, t in zip(position, turned, strict=True)])
    radius = np.concatenate([s * CLUMP.radii for s in scales])
    return position, xyz, radius, np.repeat(np.arange(n), len(CLUMP.radii))


def test_centres_of_mass_and_masses_come_back():
    position, xyz, radius, body = scanned()
    pile = scanned_pile(SEEDS, xyz, radius, body)
    np.testing.assert_allclose(pile.position, position, atol=1e-12)  # sums of ten-odd numbers of 0.1 m
    np.testing.assert_allclose(pile.mass, CLUMP.mass, rtol=1e-12)
    np.testing.assert_allclose(pile.spheres.centre, xyz)


def test_sizes_show_in_mass_and_place():
    scales = np.array([0.8, 1.0, 1.3])
    position, xyz, radius, body = scanned(3, scales)
    pile = scanned_pile(SEEDS, xyz, radius, body)
    np.testing.assert_allclose(pile.mass, CLUMP.mass * scales**3, rtol=1e-12)
    np.testing.assert_allclose(pile.position, position, atol=1e-12)


def test_bodies_may_stand_in_any_order_under_any_numbers():
    position, xyz, radius, body = scanned()
    m = len(CLUMP.radii)
    order = np.arange(xyz.shape[0]).reshape(5, m).T.ravel()  # first spheres of all bodies, then the second ones
    pile = scanned_pile(SEEDS, xyz[order], radius[order], (7 * body + 2)[order])
    np.testing.assert_allclose(pile.position, position, atol=1e-12)
    assert np.array_equal(np.unique(pile.spheres.body), np.arange(5))


def test_weights_of_a_triangle_by_hand():
    # Centre of mass on the side from (-1, 0) to (2, 0): two parts of the near corner, one of the far one.
    corners = np.array([[-1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    np.testing.assert_allclose(centre_weights(corners, 1.0), [2 / 3, 1 / 3, 0.0], atol=1e-12)


def test_a_centre_of_mass_beside_all_spheres_is_refused():
    with pytest.raises(ParameterError, match="sphere_centres: the centre of mass cannot be computed"):
        centre_weights(np.array([[-1.0, 0.5, 0.0], [1.0, 0.5, 0.0]]), 1.0)


def test_what_is_refused():
    _, xyz, radius, body = scanned()
    with pytest.raises(ParameterError, match=r"shapes .* allowed: \(n, 3\), \(n,\), \(n,\)"):
        scanned_pile(SEEDS, xyz[:-1], radius, body)
    with pytest.raises(ParameterError, match="spheres in body 4; allowed"):
        scanned_pile(SEEDS, xyz[:-1], radius[:-1], body[:-1])
    with pytest.raises(ParameterError, match="not finite, or a radius is not positive"):
        scanned_pile(SEEDS, xyz, -radius, body)
    with pytest.raises(ParameterError, match="whole numbers"):
        scanned_pile(SEEDS, xyz, radius, body.astype(float))
    with pytest.raises(ParameterError, match="a scan does not tell seed, plate, petiole apart"):
        scanned_pile(SUNFLOWER, xyz, radius, body)
