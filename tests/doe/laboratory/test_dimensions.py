"""Dimensions by caliper: by hand, Table 1 from the shipped example, the spread's interval, and bad files."""

import csv
import math

import numpy as np
import pytest
from scipy import optimize, stats

from doe.laboratory import LaboratoryError, analyse
from doe.laboratory.dimensions import variation_interval
from solver.assets import asset_path
from solver.scenes.sizes import SizeDistribution, drawn_sizes
from tests.doe.laboratory.readings import assert_one_line, written

HEAD = "component,replicate,length_mm,width_mm,thickness_mm\n"


def by_name(result, component):
    return {one.name: one for one in result.derived if one.of == (component,)}


def test_by_hand(tmp_path):
    """8 · 4 · 2 = 4³ and 16 · 8 · 4 = 8³: D = 4 and 8 mm, mean 6, SD √8; D/L = 0.5 for both."""
    result = analyse("dimensions", written(tmp_path, HEAD + "seed,1,8,4,2\nseed,2,16,8,4\n"))
    found = by_name(result, "seed")
    assert found["geometric_mean_diameter"].values == pytest.approx((4e-3, 8e-3))
    assert found["sphericity"].values == pytest.approx((0.5, 0.5))
    assert found["length"].summary.mean == pytest.approx(12e-3)
    assert found["thickness"].values == pytest.approx((2e-3, 4e-3))
    (spread,) = result.estimates
    assert spread.value == pytest.approx(math.sqrt(8.0) / 6.0)
    assert spread.standard_error == pytest.approx(spread.value * math.sqrt(1 / 2 + spread.value**2 / 2))
    assert (spread.parameter, spread.of, spread.df) == ("body.seed.size_spread", ("seed",), 1.0)
    assert "do not tell an ellipsoid from a box" in result.notes[-1]


def test_the_length_of_a_sphere_is_its_diameter_in_any_unit(tmp_path):
    text = HEAD.replace("length_mm", "length_cm") + "ball,1,0.5,5,5\n"
    found = by_name(result := analyse("dimensions", written(tmp_path, text)), "ball")
    assert found["geometric_mean_diameter"].values == pytest.approx((5e-3,))
    assert found["sphericity"].values == pytest.approx((1.0,))
    # one piece has no spread
    assert result.estimates == ()


def test_the_shipped_example_has_table_1_s_means():
    result = analyse("dimensions", asset_path("laboratory", "dimensions"))
    with asset_path("source_tables", "table1_physical").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["component"] for row in rows] == ["seed", "plate", "petiole"]
    for row in rows:
        found = by_name(result, row["component"])
        means = {name: f"{1e3 * one.summary.mean:.2f}" for name, one in found.items()}
        assert (means["length"], means["width"]) == (row["length_mm"], row["width_or_diameter_mm"])
        assert {one.summary.n for one in found.values()} == {100}
        if row["thickness_mm"]:
            assert means["thickness"] == row["thickness_mm"]
    # Table 1 prints no thickness of the plates; both diameters of a petiole are its one.
    assert set(by_name(result, "plate")) == {"length", "width"}
    assert f"{1e3 * by_name(result, 'petiole')['thickness'].summary.mean:.2f}" == rows[2]["width_or_diameter_mm"]
    assert [one.of for one in result.estimates] == [("seed",), ("petiole",)]
    assert any(note.startswith("plate: no thickness") for note in result.notes)


def test_the_spread_that_a_material_declares_is_the_one_read_off_its_bodies(tmp_path):
    """3000 bodies of log-normal size 0.1: one from each of as many equal shares, so 0.1 % is ample (0.02 % found)."""
    scale = drawn_sizes([SizeDistribution("log_normal", 0.1)], np.zeros(3000, dtype=np.int32), 1)
    rows = "".join(f"seed,{k},{28 * s:.6f},{11 * s:.6f},{6 * s:.6f}\n" for k, s in enumerate(scale))
    (spread,) = analyse("dimensions", written(tmp_path, HEAD + rows)).estimates
    assert spread.value == pytest.approx(0.1, rel=1e-3)
    assert spread.low < 0.1 < spread.high


@pytest.mark.parametrize(("c", "n"), [(0.05, 5), (0.1, 10), (0.1, 100), (0.2, 30)])
def test_the_interval_is_nearly_the_exact_one(c, n):
    """√n/c is non-central t with √n/γ; its ends solve P(T ≤ √n/c) = 0.025 and 0.975. The approximation is of O(γ⁴)."""

    def missed(gamma, share):
        return stats.nct.cdf(math.sqrt(n) / c, n - 1, math.sqrt(n) / gamma) - share

    exact = [optimize.brentq(missed, 0.2 * c, 6 * c, args=(share,)) for share in (0.025, 0.975)]
    assert variation_interval(c, n) == pytest.approx(exact, rel=5e-3)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("seed,1,8,9,2\n", ["row 2", "column width", "longest dimension"]),
        ("seed,1,8,4,9\n", ["row 2", "column thickness", "longest dimension"]),
        ("seed,1,8,4,2\nseed,2,8,4,\n", ["row 3", "column thickness", "is empty", "row 2"]),
        ("seed,1,8,4,\nseed,2,8,4,2\n", ["row 3", "column thickness", "is given", "row 2"]),
        ("seed,1,8,,2\n", ["row 2", "column width_mm", "above 0"]),
        ("seed,1,8,4,0\n", ["row 2", "column thickness_mm", "above 0"]),
        ("seed,1,8,4,2\nseed,1,8,4,2\n", ["row 3", "column replicate", "row 2"]),
    ],
)
def test_bad_readings_are_one_line(rows, words, tmp_path):
    path = written(tmp_path, HEAD + rows)
    with pytest.raises(LaboratoryError) as caught:
        analyse("dimensions", path)
    assert_one_line(caught.value, path, words)


def test_a_missing_column_or_unit_is_named(tmp_path):
    bare = written(tmp_path, "component,replicate,length_mm\nseed,1,8\n")
    with pytest.raises(LaboratoryError, match="column width_m is missing"):
        analyse("dimensions", bare)
    unknown = written(tmp_path, HEAD.replace("width_mm", "width_inch") + "seed,1,8,4,2\n")
    with pytest.raises(LaboratoryError, match="wrong or missing unit; allowed: width_m"):
        analyse("dimensions", unknown)
    without = analyse("dimensions", written(tmp_path, "component,replicate,length_mm,width_mm\nseed,1,8,4\n"))
    assert [one.name for one in without.derived] == ["length", "width"]
