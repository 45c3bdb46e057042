"""Sieving: curves of known distributions back, by hand, what sieves do not reach, and bad stacks."""

import math

import numpy as np
import pytest
from scipy import stats

from doe.laboratory import LaboratoryError, analyse
from doe.laboratory.bias import bias_table
from doe.laboratory.sieve import percentile, rosin_rammler
from doe.laboratory.tables import Reading
from solver.assets import asset_path
from solver.scenes.sizes import SizeDistribution
from tests.doe.laboratory.readings import assert_one_line, written

HEAD = "component,replicate,aperture_mm,mass_retained_g,mass_total_g\n"


def stack(openings, undersize):
    """Readings of a kilogram whose share finer than x is ``undersize(x)``."""
    ascending = sorted(openings)
    shares = np.diff([0.0, *(undersize(x) for x in ascending), 1.0])
    return [
        Reading(k, ("s",), "1", {"aperture": x, "mass_retained": float(share)})
        for k, (x, share) in enumerate(zip([0.0, *ascending], shares, strict=True))
    ]


def text_of(rows):
    return HEAD + "".join(
        f"s,1,{float(1e3 * row.values['aperture'])!r},{1e3 * row.values['mass_retained']!r},\n" for row in rows
    )


def found_in(tmp_path, rows):
    result = analyse("sieve", written(tmp_path, text_of(rows)))
    return {one.name: one.values[0] for one in result.derived}, result


def test_percentiles_by_hand(tmp_path):
    """20 % below 1 mm, 60 % below 2 mm, all below 4 mm: d50 = 1 · 2^0.75, d90 = 2 · 2^0.75; 10 % is in the pan."""
    text = HEAD + "s,1,4,0,\ns,1,2,40,\ns,1,1,40,\ns,1,0,20,\n"
    result = analyse("sieve", written(tmp_path, text))
    found = {one.name: one.values[0] for one in result.derived}
    assert found["d50"] == pytest.approx(1e-3 * 2**0.75)
    assert found["d90"] == pytest.approx(2e-3 * 2**0.75)
    assert "d10" not in found
    assert "span" not in found
    assert any("no d10" in note and "replicate 1" in note for note in result.notes)


def test_a_distribution_that_is_uniform_in_ln_x_is_given_back_exactly(tmp_path):
    """Linear in ln x from 1 to 8 mm, whatever the sieves: d_p = 8^p mm."""
    rows = stack([1e-3, 1.7e-3, 2.9e-3, 6e-3, 8e-3], lambda x: math.log(x / 1e-3) / math.log(8.0))
    for share in (0.1, 0.25, 0.5, 0.9):
        assert percentile(rows, share) == pytest.approx(1e-3 * 8.0**share)
    found, _ = found_in(tmp_path, rows)
    assert found["span"] == pytest.approx((8**0.9 - 8**0.1) / 8**0.5)


def test_the_order_of_the_rows_does_not_matter():
    rows = stack([1e-3, 2e-3, 4e-3], lambda x: 250 * x - 0.1)
    assert percentile(rows[::-1], 0.5) == percentile(rows, 0.5)


def test_a_level_curve_has_no_rosin_rammler_line(tmp_path):
    """Between the pan and one coarse sieve nothing stays: the share is the same at all openings between."""
    rows = [
        Reading(k, ("s",), "1", {"aperture": x, "mass_retained": m})
        for k, (x, m) in enumerate(zip((0.0, 1e-3, 2e-3, 4e-3, 8e-3), (0.5, 0.0, 0.0, 0.0, 0.5), strict=True))
    ]
    assert np.isnan(rosin_rammler(rows)).all()
    found, result = found_in(tmp_path, rows)
    assert "rosin_rammler_exponent" not in found
    assert any("no rosin_rammler_exponent: fewer than" in note for note in result.notes)


def test_samples_that_were_weighed_have_a_loss_whatever_the_others_have(tmp_path):
    rows = "".join(
        f"s,{k},{aperture},{mass},{total if aperture == 0 else ''}\n"
        for k, total in ((1, 102.0), (2, ""), (3, 104.0))
        for aperture, mass in ((0, 20.0), (1, 50.0), (2, 30.0))
    )
    result = analyse("sieve", written(tmp_path, HEAD + rows))
    (loss,) = (one for one in result.derived if one.name == "sieving_loss")
    assert loss.replicates == ("1", "3")
    assert loss.values == pytest.approx((1.0 - 100.0 / 102.0, 1.0 - 100.0 / 104.0))


def test_a_rosin_rammler_distribution_is_given_back():
    rows = stack(np.geomspace(0.5e-3, 5e-3, 8), lambda x: -math.expm1(-((x / 2.5e-3) ** 1.7)))
    assert rosin_rammler(rows) == pytest.approx((2.5e-3, 1.7))


def test_log_normal_sizes_weighed_give_the_spread_of_the_sizes_counted(tmp_path):
    """Spread 0.2 by number about 3 mm: by mass the median is exp(3σ²) times that by number, σ the same."""
    sigma = math.sqrt(math.log1p(0.2**2))
    by_number = 3e-3 * math.exp(-0.5 * sigma**2)
    weighed = stats.lognorm(sigma, scale=by_number * math.exp(3 * sigma**2))
    found, result = found_in(tmp_path, stack(np.geomspace(1e-3, 9e-3, 120), weighed.cdf))
    # Sieves 1.9 % apart: between two of them ln x against Q bends by less than a thousandth.
    assert found["size_spread"] == pytest.approx(0.2, rel=2e-3)
    assert found["size_number_mean"] == pytest.approx(3e-3, rel=2e-3)
    assert found["d50"] == pytest.approx(weighed.median(), rel=1e-3)
    (spread,) = (one for one in result.derived if one.parameter)
    assert spread.parameter == "body.s.size_spread"


def test_the_solver_s_sizes_sieved_give_their_spread_back(tmp_path):
    """200000 bodies of the solver's own distribution; its cut at 3σ takes 0.15 % of the mass, of the largest."""
    scale = SizeDistribution("log_normal", 0.15).quantile(np.random.default_rng(4).random(200_000))
    size, mass = 3e-3 * scale, scale**3
    found, _ = found_in(
        tmp_path, stack(np.geomspace(1.5e-3, 6e-3, 60), lambda x: float(mass[size < x].sum() / mass.sum()))
    )
    assert found["size_spread"] == pytest.approx(0.15, rel=0.02)
    assert found["size_number_mean"] == pytest.approx(3e-3, rel=0.005)


def test_the_loss_and_its_note(tmp_path):
    text = HEAD + "s,1,2,48,100\ns,1,1,30,\ns,1,0,20,\n"
    result = analyse("sieve", written(tmp_path, text))
    assert next(one for one in result.derived if one.name == "sieving_loss").values == pytest.approx((0.02,))
    assert "s, replicate 1: 2 % of the sample were lost in sieving" in result.notes
    assert not any("sieving_loss" in note for note in result.notes)


def test_the_error_of_a_share_carries_into_the_median(tmp_path):
    """Two fractions, p = m₁/(m₁ + m₂) below 2 mm; d50 = 2 mm · 2^((0.5 − p)/(1 − p)) above, by its derivative."""
    head = "component,replicate,aperture_mm,mass_retained_g,mass_retained_error_g\n"
    text = head + "s,1,4,0,0\ns,1,2,60,0.3\ns,1,1,40,0.3\ns,1,0,0,0\n"
    median = next(one for one in analyse("sieve", written(tmp_path, text)).derived if one.name == "d50")
    p, u = 0.4, 0.3 / math.sqrt(3.0)
    of_share = math.hypot(60.0, 40.0) / 100.0**2 * u
    slope = 2e-3 * 2 ** ((0.5 - p) / (1 - p)) * math.log(2.0) * 0.5 / (1 - p) ** 2
    assert median.values == pytest.approx((2e-3 * 2 ** (0.1 / 0.6),))
    assert median.reading.standard == pytest.approx(slope * of_share, rel=1e-3)


def test_the_shipped_samples_have_what_they_were_made_of():
    """ln x with median 4 mm and deviation 0.18; sieves 12 % apart read a spread that is 4 … 6 % too large (--bias)."""
    found = {one.name: one for one in analyse("sieve", asset_path("laboratory", "sieve")).derived}
    assert found["d50"].summary.mean == pytest.approx(4e-3, rel=0.02)
    ratio = found["size_spread"].summary.mean / math.sqrt(math.expm1(0.18**2))
    assert 1.03 < ratio < 1.06
    assert found["sieving_loss"].summary.largest < 0.01
    assert found["d50"].reading is not None


def test_what_coarse_stacks_read_of_a_spread_is_in_the_table_of_biases():
    """The wider the sieves stand, the larger the spread; sieves much closer than σ give it back."""
    table = bias_table("sieve")
    by_sigma = {}
    for _, spread, shown, ratio in table.rows:
        assert ratio == pytest.approx(shown / spread)
        by_sigma.setdefault(spread, []).append(ratio)
    for ratios in by_sigma.values():
        assert ratios == sorted(ratios)
    # σ 0.39, sieves 12 % apart: within a hundredth
    assert by_sigma[max(by_sigma)][0] == pytest.approx(1.0, abs=0.015)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("s,1,2,50,\ns,1,1,50,\n", ["row 2", "aperture", "no pan"]),
        ("s,1,2,50,\ns,1,0,50,\n", ["row 2", "1 sieve"]),
        ("s,1,2,50,\ns,1,2,50,\ns,1,0,1,\n", ["row 3", "row 2", "each sieve once"]),
        ("s,1,2,0,\ns,1,1,0,\ns,1,0,0,\n", ["row 2", "weighs nothing"]),
        ("s,1,2,5,11\ns,1,1,5,12\ns,1,0,1,\n", ["row 3", "mass_total", "one number"]),
        ("s,1,2,-5,\ns,1,1,5,\ns,1,0,1,\n", ["row 2", "mass_retained_g"]),
    ],
)
def test_a_bad_stack_is_one_line(rows, words, tmp_path):
    path = written(tmp_path, HEAD + rows)
    with pytest.raises(LaboratoryError) as refused:
        analyse("sieve", path)
    assert_one_line(refused.value, path, words)
