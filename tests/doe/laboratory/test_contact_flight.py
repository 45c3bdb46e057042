"""The flight of a sphere off a plate at 45°, and the tables of biases, against hand computations."""

import math

import pytest

from doe.laboratory.bias import (
    POISSON_RATIOS,
    STRAINS,
    bias_table,
    compression_ratio,
    drop_bias,
    shear_ratio,
)
from doe.laboratory.contact import GRIPPING, flight, restitution_of_flight, tangential_share
from doe.laboratory.tables import LaboratoryError


def test_a_horizontal_rebound_gives_the_restitution():
    assert flight(0.6, 0.6) == pytest.approx(0.6)


def test_a_sphere_that_grips_by_hand():
    """e = 0.5: x = (0.5 + 5/7)/2 = 0.607143, z = −0.107143; x (z + √(z² + 1)) = 0.607143 · 0.898581 = 0.545567."""
    assert flight(0.5, GRIPPING) == pytest.approx(0.545567, abs=1e-6)
    assert flight(0.5, 1.0) == pytest.approx(0.75 * (-0.25 + math.sqrt(1.0625)))


@pytest.mark.parametrize(("height", "restitution", "share"), [(0.2, 0.5, GRIPPING), (1.3, 0.3, 0.9)])
def test_the_flight_by_stepping_through_it(height, restitution, share):
    """Free fall of a point from the impact until H below it, in small steps."""
    gravity, speed = 9.81, math.sqrt(2.0 * 9.81 * height)
    v_x, v_z = 0.5 * (restitution + share) * speed, 0.5 * (restitution - share) * speed
    x = z = 0.0
    step = 1e-6
    while z > -height:
        x, z, v_z = x + v_x * step, z + (v_z - 0.5 * gravity * step) * step, v_z - gravity * step
    # a step of 1e-6 s at the speed of landing, relative to L/2H
    assert flight(restitution, share) == pytest.approx(x / (2.0 * height), rel=1e-4)


def test_the_sphere_slides_until_it_grips():
    assert tangential_share(0.5, 0.0) == 1.0
    assert tangential_share(0.5, 0.1) == pytest.approx(0.85)
    # (2/7)/(1 + e) is the friction from which on it leaves without slip
    assert tangential_share(0.5, 2 / 7 / 1.5) == pytest.approx(GRIPPING)
    assert tangential_share(0.5, 0.8) == GRIPPING


@pytest.mark.parametrize("share", [GRIPPING, 0.85, 1.0])
@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.58, 1.0])
def test_the_inverse_returns_the_restitution(restitution, share):
    assert restitution_of_flight(flight(restitution, share), share) == pytest.approx(restitution, abs=1e-9)


def test_no_sphere_lands_nearer_or_farther():
    assert flight(0.0, GRIPPING) == pytest.approx(0.2517, abs=1e-4)
    assert math.isnan(restitution_of_flight(0.2, GRIPPING))
    assert math.isnan(restitution_of_flight(1.1, GRIPPING))


def test_the_bias_of_the_drop_over_its_range():
    rows = {(mu, e): (shown, ratio) for mu, e, shown, ratio in drop_bias().rows}
    assert len(rows) == 20
    assert rows[0.6, 0.5] == pytest.approx((0.5456, 1.0911), abs=1e-4)
    assert rows[0.0, 0.2][1] > 2.0
    assert rows[0.6, 0.8][1] < 1.0


def test_the_bias_of_equations_1_and_2_by_hand():
    """Hertz: F = 4/3 E* √R δ^1.5 on π R δ, over 2 δ/2R; R = 5 mm, δ = 0.05 mm, E = 100 MPa, ν = 0.3."""
    radius, overlap, young, ratio = 5e-3, 5e-5, 1e8, 0.3
    e_star = young / (1.0 - ratio**2)
    force = 4.0 / 3.0 * e_star * math.sqrt(radius) * overlap**1.5
    apparent = force / (math.pi * radius * overlap) / (2.0 * overlap / (2.0 * radius))
    assert compression_ratio(overlap / radius, ratio) == pytest.approx(apparent / young)
    # Mindlin: F_t = 8 G* a u on π a², over 2 u/2R
    shear, slip = young / (2.0 * (1.0 + ratio)), 1e-6
    contact = math.sqrt(radius * overlap)
    tangential = 8.0 * shear / (2.0 - ratio) * contact * slip
    apparent = tangential / (math.pi * contact**2) / (2.0 * slip / (2.0 * radius))
    assert shear_ratio(overlap / radius, ratio) == pytest.approx(apparent / shear)


@pytest.mark.parametrize("test", ["compression", "shear"])
def test_the_bias_of_a_modulus_falls_with_the_strain(test):
    table = bias_table(test)
    assert len(table.rows) == len(STRAINS) * len(POISSON_RATIOS)
    middle = [ratio for _, poisson, ratio in table.rows if poisson == 0.3]
    assert middle == sorted(middle, reverse=True)


def test_a_test_without_bias_says_why():
    with pytest.raises(LaboratoryError, match="tan σ gives back"):
        bias_table("inclined_plane")
    with pytest.raises(LaboratoryError, match="difference of masses"):
        bias_table("moisture")
