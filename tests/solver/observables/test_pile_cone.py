"""Cone-equivalent angles: exact on cones, their difference on what is no cone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.observables.pile import (
    angle_of_repose_cone,
    angle_of_repose_mass_cone,
    angle_of_repose_volume_cone,
    fitted_cone_angle_deg,
    mass_cone_angle_deg,
    volume_cone_angle_deg,
)
from solver.observables.reading import PileReading
from tests.solver.observables.made_up import cone, moved, seeds_in_cone

ANGLES = st.floats(5.0, 60.0)
HEIGHTS = st.floats(1e-3, 1.0)


@given(ANGLES, HEIGHTS)
def test_closed_forms_invert_a_cone(angle, height):
    base = height / np.tan(np.radians(angle))
    assert mass_cone_angle_deg(height / 4, base / 2) == pytest.approx(angle, rel=1e-12)
    assert volume_cone_angle_deg(np.pi * base**2 * height / 3, base / 2) == pytest.approx(angle, rel=1e-12)


def test_half_of_a_cone_lies_within_half_its_radius():
    radius = np.sqrt(np.linspace(0.0, 1.0, 200_001))  # equal areas
    mass = 1.0 - radius
    # Sum over 2e5 rings of equal area.
    assert mass[radius <= 0.5].sum() / mass.sum() == pytest.approx(0.5, abs=1e-5)


@given(ANGLES, HEIGHTS, st.floats(0.3, 0.9))
def test_fit_finds_the_cone_under_a_profile(angle, height, filled):
    base = height / np.tan(np.radians(angle))
    radius = (np.arange(200) + 0.5) / 200 * base / filled
    found = fitted_cone_angle_deg(radius, np.maximum(0.0, height * (1 - radius / base)))
    # Base radii are tried in steps of 0.1 % of the reach, which is 0.1 % / filled of the base and of the slope.
    assert np.tan(np.radians(found)) == pytest.approx(np.tan(np.radians(angle)), rel=1.2e-3 / filled)


@pytest.mark.parametrize("angle", [15.0, 25.0, 35.0])
def test_a_homogeneous_cone_gives_its_angle(angle):
    reading = PileReading(cone(angle))
    # Grid of 0.8 mm in r50 (mass), hollows of 0.16 mm and r50³ (volume).
    assert angle_of_repose_mass_cone(reading).value == pytest.approx(angle, abs=0.2)
    assert angle_of_repose_cone(reading).value == pytest.approx(angle, abs=0.2)
    assert angle_of_repose_volume_cone(reading).value == pytest.approx(angle, abs=0.8)


def test_scale_turn_and_shift_leave_them_unchanged():
    pile = seeds_in_cone(25.0, 80, np.random.default_rng(5), reach=0.5)
    before, after = PileReading(pile), PileReading(moved(pile, 37.0, 2.0, (0.1, -0.2)))
    mass_cone = angle_of_repose_mass_cone(before).value
    assert angle_of_repose_mass_cone(after).value == pytest.approx(mass_cone, rel=1e-9)
    # The height map's grid does not turn with the pile: 160 pixels over 3 r50.
    assert angle_of_repose_cone(after).value == pytest.approx(angle_of_repose_cone(before).value, abs=0.3)


def test_the_mass_cone_is_unbiased_for_homogeneous_mass():
    rng = np.random.default_rng(3)
    found = [angle_of_repose_mass_cone(PileReading(seeds_in_cone(25.0, 80, rng, reach=0.0))).value for _ in range(30)]
    assert np.mean(found) == pytest.approx(25.0, abs=3 * 3.2 / np.sqrt(30))  # sd of one pile 3.2°; 3 standard errors


@pytest.mark.parametrize("radius,height", [([], []), ([0.5, 1.5], [0.0, 0.0])])
def test_no_surface_no_angle(radius, height):
    assert np.isnan(fitted_cone_angle_deg(np.array(radius), np.array(height)))


def test_a_point_of_mass_has_no_angle():
    assert np.isnan(mass_cone_angle_deg(0.01, 0.0))
