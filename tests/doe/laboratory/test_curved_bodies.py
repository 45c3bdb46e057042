"""Compression of curved bodies from the file to the modulus, and what is said against a modulus."""

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from doe.laboratory import LaboratoryError, analyse
from doe.laboratory.hertz import EXACT, S368
from tests.doe.laboratory.readings import assert_one_line, written

BY_AREA = Path(__file__).parent / "hertz_yield.csv"
"""A sphere, R 5 mm, E 100 MPa, ν 0.3, between two plates: Hertz up to half the stroke, 10.4 N, then straight; noise
0.2 %. Its columns are those of Equation (1), with the cross-section as area."""
BODY = "radius_mm,poisson_ratio,contacts"
HEAD = f"component,replicate,{BODY},displacement_mm,force_N\n"
FLAT_HEAD = "component,replicate,thickness_mm,area_mm2,displacement_mm,force_N\n"


def with_radius(tmp_path, columns=BODY, cells="5,0.3,2"):
    """The same readings with what Hertz's law needs, and without an area."""
    head, *rows = BY_AREA.read_text().splitlines()
    assert head == FLAT_HEAD.strip()
    kept = [row.split(",") for row in rows]
    lines = [f"{of},{replicate},{cells},{x},{f}" for of, replicate, _, _, x, f in kept]
    return written(tmp_path, HEAD.replace(BODY, columns) + "\n".join(lines))


def sphere(noise=0.0, points=60, toe=0.0, replicates=3, begin=0.0):
    """Rows of HEAD of a sphere, R 5 mm, 100 MPa, ν 0.3, one contact: 4/3 · 100/0.91 · √5 = 327.629 N/mm^1.5."""
    rng = np.random.default_rng(3)
    x = np.linspace(0.0, 0.2, points)
    rows = []
    for replicate in range(replicates):
        force = 327.629 * np.maximum(x - toe, 0.0) ** 1.5 * (1.0 + noise * rng.standard_normal(points))
        rows += [f"s,{replicate},5,0.3,1,{begin + a:.5f},{f:.6f}" for a, f in zip(x, force, strict=True)]
    return HEAD + "\n".join(rows)


def notes(result):
    return "\n".join(result.derived[0].notes)


def test_a_sphere_that_yields_gives_the_modulus_of_the_part_before(tmp_path):
    """By area and slope it reads 7.93 MPa; the interval of three specimens holds the 100 MPa that were put in."""
    by_hertz, by_standard = analyse("compression", with_radius(tmp_path)).derived
    assert by_hertz.summary.low < 100e6 < by_hertz.summary.high
    assert by_hertz.summary.mean == pytest.approx(100e6, rel=5e-3)
    assert by_hertz.parameter == "materials.seed.youngs_modulus"
    assert "agrees with Hertz's 1.5" in notes(analyse("compression", with_radius(tmp_path)))
    # 0.11 % by its constant, and one point's noise
    assert by_standard.summary.mean == pytest.approx(100.1e6, rel=1e-2)
    assert (by_standard.name, by_standard.parameter) == ("youngs_modulus_asae_s368", "")


def test_where_it_yields_is_told(tmp_path):
    for one in analyse("compression", with_radius(tmp_path)).curves:
        # The tangent parts from the law by 0.2 % of the force in a fifth one and a half points later.
        assert one.fit.yield_force == pytest.approx(10.4, rel=0.12)
        assert one.fit.last_displacement < 0.2e-3


def test_without_a_radius_the_straight_part_stays_and_the_curved_one_below_is_told():
    result = analyse("compression", BY_AREA)
    assert result.derived[0].summary.mean == pytest.approx(7.931e6, rel=1e-4)
    assert "a curved contact" in notes(result)
    assert "radius_mm, poisson_ratio and contacts" in notes(result)


def test_a_toe_below_a_straight_part_is_no_curved_contact(tmp_path):
    """Slope rising over the first 30 %, F ∝ δ², then straight."""
    x = np.linspace(0.0, 1.0, 101)
    force = 100.0 * np.where(x < 0.3, x**2 / 0.6, x - 0.15)
    rows = [f"s,1,5,20,{0.1 * a:.4f},{f:.5f}" for a, f in zip(x, force, strict=True)]
    assert "curved contact" not in notes(analyse("compression", written(tmp_path, FLAT_HEAD + "\n".join(rows))))


def test_a_second_radius_that_is_the_first_is_a_sphere_s(tmp_path):
    both = with_radius(tmp_path, "radius_mm,radius_2_um,poisson_ratio,contacts", "5,5000,0.3,2")
    found = analyse("compression", both).derived[0].values
    assert found == pytest.approx(analyse("compression", with_radius(tmp_path)).derived[0].values, rel=1e-9)


def test_a_single_reading_by_hand_says_what_it_hides(tmp_path):
    """F = 327.629 · 0.1^1.5 = 10.3605 N."""
    result = analyse("compression", written(tmp_path, HEAD + "s,1,5,0.3,1,0.1,10.3605\ns,2,5,0.3,1,0.1,10.3605\n"))
    assert result.derived[0].values == pytest.approx((100e6, 100e6), rel=1e-5)
    assert "2 of 2 replicates are single readings" in notes(result)
    flat = analyse("compression", written(tmp_path, FLAT_HEAD + "s,1,5,20,0.05,30\ns,2,5,20,0.05,31\n"))
    assert "2 of 2 replicates are single readings" in notes(flat)


def test_one_curve_has_the_interval_of_its_fit_alone(tmp_path):
    result = analyse("compression", written(tmp_path, sphere(noise=0.002, replicates=1)))
    assert "one curve: the 95 % interval of its fit" in notes(result)
    assert np.isnan(result.derived[0].summary.low)


def test_the_interval_of_one_straight_curve_is_scipy_s(tmp_path):
    """slope ± t stderr of the points of the straight part, times 5 mm over 20 mm²."""
    x = np.linspace(0.0, 0.1, 14)
    force = np.round(600.0 * x + np.random.default_rng(4).standard_normal(14), 4)
    rows = [f"s,1,5,20,{a:.7f},{f:.4f}" for a, f in zip(x, force, strict=True)]
    result = analyse("compression", written(tmp_path, FLAT_HEAD + "\n".join(rows)))
    (fit,) = (one.fit for one in result.curves)
    used = (x >= 1e3 * fit.first_displacement - 1e-6) & (x <= 1e3 * fit.last_displacement + 1e-6)
    line = stats.linregress(x[used], force[used])
    half = stats.t.ppf(0.975, used.sum() - 2) * line.stderr
    low, high = (0.25 * (line.slope + sign * half) for sign in (-1.0, 1.0))
    assert f"the 95 % interval of its fit, {low:.4g} … {high:.4g} MPa" in notes(result)


@pytest.mark.parametrize(("noise", "said"), [(0.002, False), (0.03, True)])
def test_noise_is_told(noise, said, tmp_path):
    result = analyse("compression", written(tmp_path, sphere(noise=noise, points=120)))
    assert ("noise of" in notes(result)) == said


@pytest.mark.parametrize(("toe", "said"), [(0.01, False), (0.08, True)])
@pytest.mark.parametrize("begin", [0.0, 3.0])
def test_a_long_toe_is_fitted_and_told(toe, said, begin, tmp_path):
    result = analyse("compression", written(tmp_path, sphere(toe=toe, begin=begin)))
    assert result.derived[0].values == pytest.approx((100e6,) * 3, rel=1e-4)
    # The standard's rounded constant, at one point whose way is counted from the contact too.
    assert result.derived[1].values == pytest.approx((100e6 * S368 / EXACT,) * 3, rel=1e-4)
    assert ("a long toe in replicates 0, 1, 2" in notes(result)) == said


def test_a_curve_with_another_exponent_is_said_not_to_be_hertzian(tmp_path):
    x = np.linspace(0.0, 0.2, 60)
    rows = [f"s,1,5,0.3,2,{a:.5f},{50.0 * a:.5f}" for a in x]
    assert "is not Hertz's 1.5" in notes(analyse("compression", written(tmp_path, HEAD + "\n".join(rows))))


def test_flat_and_curved_components_stand_in_one_sheet(tmp_path):
    head = "component,replicate,thickness_mm,area_mm2,radius_mm,poisson_ratio,contacts,displacement_mm,force_N\n"
    rows = "block,1,5,20,,,,0.05,30\nball,1,,,5,0.3,1,0.1,10.3605\n"
    block, ball, _ = analyse("compression", written(tmp_path, head + rows)).derived
    assert block.values == pytest.approx((150e6,))
    assert ball.values == pytest.approx((100e6,), rel=1e-5)


MIXED = "component,replicate,thickness_mm,area_mm2,radius_mm,poisson_ratio,contacts,displacement_mm,force_N\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD + "s,1,5,0.3,3,0.1,1\n", ["row 2", "column contacts", "below 3"]),
        (HEAD + "s,1,5,0.3,1.5,0.1,1\n", ["row 2", "column contacts", "1.5", "two plates"]),
        (HEAD + "s,1,5,0.6,2,0.1,1\n", ["row 2", "column poisson_ratio", "below 0.5"]),
        (HEAD + "s,1,5,,2,0.1,1\n", ["row 2", "poisson_ratio", "is missing"]),
        (HEAD + "s,1,,0.3,2,0.1,1\n", ["row 2", "thickness", "is missing", "radius"]),
        (HEAD + "s,1,5,0.3,2,0.1,1\ns,1,6,0.3,2,0.2,3\n", ["row 3", "radius", "row 2"]),
        (MIXED + "s,1,5,20,,,,0.1,1\ns,2,,,5,0.3,2,0.1,1\n", ["row 3", "radius", "every replicate of s"]),
        (HEAD.replace("radius_mm", "radius") + "s,1,5,0.3,2,0.1,1\n", ["radius", "radius_mm"]),
    ],
)
def test_a_body_that_is_not_known_is_refused_in_one_line(text, words, tmp_path):
    path = written(tmp_path, text)
    with pytest.raises(LaboratoryError) as caught:
        analyse("compression", path)
    assert_one_line(caught.value, path, words)


def test_a_curve_that_is_hertzian_all_the_way_asks_for_a_radius(tmp_path):
    rows = [f"s,1,10,78.5,{a:.5f},{300.0 * a**1.5:.6f}" for a in np.linspace(0.0, 0.2, 100)]
    with pytest.raises(LaboratoryError, match="columns radius_mm, poisson_ratio and contacts"):
        analyse("compression", written(tmp_path, FLAT_HEAD + "\n".join(rows)))
