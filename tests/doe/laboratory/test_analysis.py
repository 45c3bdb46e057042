"""Every bench test by hand, and the article's tables from the numbers that it prints."""

import csv
import json
import math

import numpy as np
import pytest

from doe.laboratory import TESTS, LaboratoryError, analyse
from doe.laboratory.analysis import analyse_composition, analyse_elastic
from doe.laboratory.elastic import poisson_ratio, poisson_ratios
from doe.laboratory.result import derived
from doe.laboratory.tables import Table
from solver.assets import asset_path
from tests.doe.laboratory.readings import assert_one_line, written


def published(name):
    with asset_path("source_tables", name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def of(result, *names, quantity):
    return next(one for one in result.derived if one.of == names and one.name == quantity)


CURVE_HEAD = "component,replicate,thickness_mm,area_mm2,displacement_mm,force_N\n"


def test_equation_1_by_hand(tmp_path):
    """F = 30 N on 20 mm² is 1.5 MPa; 0.05 mm of 5 mm is 1 %: E = 150 MPa."""
    result = analyse("compression", written(tmp_path, CURVE_HEAD + "seed,1,5,20,0.05,30\nseed,2,5,20,0.05,31\n"))
    (found,) = result.derived
    assert found.values == pytest.approx((150e6, 155e6))
    assert (found.name, found.parameter) == ("youngs_modulus", "materials.seed.youngs_modulus")
    assert result.curves == ()


def test_equation_2_is_equation_1_for_shear(tmp_path):
    (found,) = analyse("shear", written(tmp_path, CURVE_HEAD + "seed,1,5,20,0.05,12\n")).derived
    assert (found.name, found.values) == ("shear_modulus", pytest.approx((60e6,)))


def test_a_curve_gives_the_slope_of_its_straight_part(tmp_path):
    """Nothing for 0.02 mm, then 600 N/mm: E = 600e3 · 5e-3/20e-6 = 150 MPa, though F/ΔL at its end is less."""
    rows = [f"seed,1,5,20,{x:.4f},{600.0 * max(0.0, x - 0.02):.4f}" for x in np.linspace(0.0, 0.1, 41)]
    result = analyse("compression", written(tmp_path, CURVE_HEAD + "\n".join(rows)))
    assert result.derived[0].values == pytest.approx((150e6,), rel=1e-3)
    (curve,) = result.curves
    assert curve.fit.origin == pytest.approx(0.02e-3, rel=1e-3)


def test_a_hertzian_curve_is_said_to_be_one(tmp_path):
    noise = 1.0 + 0.005 * np.random.default_rng(2).standard_normal(101)
    x = np.linspace(0.0, 0.1, 101)
    rows = [f"seed,1,5,20,{a:.4f},{f:.5f}" for a, f in zip(x, 1000.0 * x**1.5 * noise, strict=True)]
    (found,) = analyse("compression", written(tmp_path, CURVE_HEAD + "\n".join(rows))).derived
    assert "Hertzian" in found.notes[0]


def test_equation_3_gives_table_2():
    """The printed E and G give the printed ν; E and G themselves rest on forces that the article does not print."""
    rows = published("table2_elastic")
    assert len(rows) == 3
    for row in rows:
        ratio = poisson_ratio(float(row["elastic_modulus_MPa"]), float(row["shear_modulus_MPa"]))
        # printed digits
        assert round(ratio, 2) == float(row["poisson_ratio"])


def test_poisson_s_ratio_and_its_error_by_hand(tmp_path):
    """E = 150 ± 10 (n = 3), G = 60 ± 3 (n = 3): ν = 0.25, SE = 1.25 √((10/150)²/3 + (3/60)²/3) = 0.06014."""
    young = written(
        tmp_path, CURVE_HEAD + "".join(f"s,{k},5,20,0.05,{f}\n" for k, f in enumerate((28, 30, 32))), "e.csv"
    )
    shear = written(
        tmp_path, CURVE_HEAD + "".join(f"s,{k},5,20,0.05,{f}\n" for k, f in enumerate((11.4, 12, 12.6))), "g.csv"
    )
    (ratio,) = analyse_elastic(shear, young).estimates
    assert ratio.value == pytest.approx(0.25)
    assert ratio.standard_error == pytest.approx(0.06014, abs=1e-5)
    a, b = (10 / 150) ** 2 / 3, (3 / 60) ** 2 / 3
    assert ratio.df == pytest.approx((a + b) ** 2 / (a**2 / 2 + b**2 / 2))
    assert ratio.low < 0.25 < ratio.high
    assert ratio.files == (str(young), str(shear))


def test_the_interval_of_poisson_s_ratio_covers_it():
    """E = 150 ± 15, G = 60 ± 6, ten replicates each, ν = 0.25: 95 % of 400 intervals, standard error 1.1 %."""
    rng = np.random.default_rng(5)
    table = Table("made up", ())
    names = [str(k) for k in range(10)]
    covered = 0
    for _ in range(400):
        young, shear = (
            derived(table, name, "Pa", ("s",), "", names, rng.normal(mean, 0.1 * mean, 10).tolist())
            for name, mean in (("youngs_modulus", 150e6), ("shear_modulus", 60e6))
        )
        (ratio,) = poisson_ratios((young,), (shear,))
        covered += ratio.low < 0.25 < ratio.high
    assert covered / 400 == pytest.approx(0.95, abs=0.035)


def test_moduli_that_no_isotropic_solid_has_are_named(tmp_path):
    young = written(tmp_path, CURVE_HEAD + "s,1,5,20,0.05,40\ns,2,5,20,0.05,41\n", "e.csv")
    shear = written(tmp_path, CURVE_HEAD + "s,1,5,20,0.05,12\ns,2,5,20,0.05,12.1\n", "g.csv")
    (ratio,) = analyse_elastic(shear, young).estimates
    assert ratio.value > 0.5
    assert "no isotropic solid" in ratio.notes[0]


def test_moduli_of_other_components_give_no_ratio(tmp_path):
    young = written(tmp_path, CURVE_HEAD + "x,1,5,20,0.05,40\n", "e.csv")
    shear = written(tmp_path, CURVE_HEAD + "y,1,5,20,0.05,12\n", "g.csv")
    with pytest.raises(LaboratoryError, match="no component is in both"):
        analyse_elastic(shear, young)


def test_friction_is_the_mean_of_the_tangents(tmp_path):
    result = analyse("inclined_plane", written(tmp_path, "a,b,replicate,angle_deg\ns,w,1,30\ns,w,2,45\n"))
    assert of(result, "s", "w", quantity="static_friction").summary.mean == pytest.approx((1 / math.sqrt(3) + 1) / 2)
    assert of(result, "s", "w", quantity="sliding_angle").summary.mean == pytest.approx(math.radians(37.5))
    assert of(result, "s", "w", quantity="static_friction").parameter == "pair.s.w.static_friction"


def test_equation_7_and_the_tracked_rebound(tmp_path):
    """H = 200 mm, L = 232 mm: 0.58. Fall speed √(2 · 9.81 · 0.2) = 1.98091 m/s; (1.2 − 0.05)/1.98091 = 0.58054."""
    head = "a,b,replicate,drop_height_mm,distance_mm,v_x_m_s,v_z_m_s\n"
    result = analyse("drop", written(tmp_path, head + "s,w,1,200,232,1.2,-0.05\n"))
    assert of(result, "s", "w", quantity="restitution").values == pytest.approx((0.58054,), abs=1e-5)
    assert of(result, "s", "w", quantity="restitution").parameter == "pair.s.w.restitution"
    assert of(result, "s", "w", quantity="restitution_paper_L_over_2H").values == pytest.approx((0.58,))
    assert of(result, "s", "w", quantity="restitution_paper_L_over_2H").parameter == ""


def test_without_a_camera_the_restitution_is_equation_7_and_says_so(tmp_path):
    result = analyse("drop", written(tmp_path, "a,b,replicate,drop_height_mm,distance_mm\ns,w,1,200,232\n"))
    found = of(result, "s", "w", quantity="restitution")
    assert found.values == pytest.approx((0.58,))
    assert "horizontal rebound only" in found.notes[0]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("a,b,replicate,drop_height_mm,v_x_m_s\ns,w,1,200,1\n", "given alone"),
        ("a,b,replicate,drop_height_mm\ns,w,1,200\n", "distance_mm"),
        ("a,b,replicate,drop_height_mm,v_x_m_s,v_z_m_s\ns,w,1,200,2,0.5\n", "faster than the fall"),
        (
            "a,b,replicate,drop_height_mm,v_x_m_s,v_z_m_s\ns,w,1,200,1.4,1.35\n",
            r"v_z_m_s: .* is 1\.388; allowed: 0 … 1",
        ),
        ("a,b,replicate,drop_height_mm,v_x_m_s,v_z_m_s\ns,w,1,200,0.2,-1.2\n", r"is -0\.5048; allowed: 0 … 1"),
        (
            "a,b,replicate,drop_height_mm,distance_mm\ns,w,1,200,900\n",
            r"distance_mm: L/\(2H\) is 2\.25; allowed: up to 1",
        ),
    ],
)
def test_a_drop_needs_a_flight_or_a_rebound_that_a_body_can_have(text, word, tmp_path):
    with pytest.raises(LaboratoryError, match=word):
        analyse("drop", written(tmp_path, text))


def test_moisture_by_hand(tmp_path):
    """30 g of which 21.39 g stay: 28.7 % wet basis, 8.61/21.39 = 40.25 % dry basis; the tray does not matter."""
    head = "component,replicate,mass_container_g,mass_before_g,mass_after_g\n"
    result = analyse("moisture", written(tmp_path, head + "seed,1,12,42,33.39\n"))
    assert of(result, "seed", quantity="moisture_wet_basis").values == pytest.approx((0.287,))
    assert of(result, "seed", quantity="moisture_dry_basis").values == pytest.approx((8.61 / 21.39,))
    bare = analyse("moisture", written(tmp_path, "component,replicate,mass_before_g,mass_after_g\nseed,1,30,21.39\n"))
    assert of(bare, "seed", quantity="moisture_wet_basis").values == pytest.approx((0.287,))


def test_density_by_pycnometer_sinker_and_soaking(tmp_path):
    """10 g of 500 kg/m³ are 20 mL, 20 g of water."""
    head = "component,replicate,mass_g,mass_reference_g,mass_with_sample_g,liquid_density_g_cm3"
    pycnometer = analyse("density", written(tmp_path, f"{head}\nseed,1,10,150,140,1\n"))
    sinker = analyse("density", written(tmp_path, f"{head}\nseed,1,10,50,40,1\n"))
    soaked = analyse("density", written(tmp_path, f"{head},mass_soaked_g\nseed,1,10,50,42,1,12\n"))
    for result in (pycnometer, sinker, soaked):
        assert of(result, "seed", quantity="density").values == pytest.approx((500.0,))


def test_composition_adds_up_and_leaves_out(tmp_path):
    rows = "component,replicate,mass_g\nseed,1,75\nseed,2,70\nstalk,1,20\nstalk,2,25\ndust,1,5\ndust,2,5\n"
    path = written(tmp_path, rows)
    whole = analyse("composition", path)
    assert [one.summary.mean for one in whole.derived] == pytest.approx([0.725, 0.225, 0.05])
    clean = analyse_composition(path, ["dust"])
    assert of(clean, "seed", quantity="mass_fraction").values == pytest.approx((75 / 95, 70 / 95))
    assert sum(one.summary.mean for one in clean.derived) == pytest.approx(1.0)
    assert "dust" in clean.notes[-1]


@pytest.mark.parametrize(
    ("test", "text", "words"),
    [
        ("moisture", "component,replicate,mass_before_g,mass_after_g\ns,1,30,31\n", ["row 2", "mass_after"]),
        ("density", "component,replicate,mass_g,mass_reference_g,mass_with_sample_g,liquid_density_kg_m3\n"
         "s,1,5,2,7,1000\n", ["row 2", "displaced"]),
        ("composition", "component,replicate,mass_g\ns,1,30\nt,1,4\ns,2,30\n", ["t is missing in replicate 2"]),
        ("composition", "component,replicate,mass_g\ns,1,0\n", ["weighs nothing"]),
        ("compression", CURVE_HEAD + "s,1,5,20,0,30\n", ["row 2", "column displacement"]),
        ("compression", CURVE_HEAD + "s,1,5,20,0.01,30\ns,1,5,20,0.02,60\n", ["row 2", "2 rows"]),
        ("compression", CURVE_HEAD + "s,1,5,20,0.01,30\ns,1,6,20,0.02,60\n", ["row 3", "thickness", "row 2"]),
        ("compression", CURVE_HEAD + "".join(f"s,1,5,20,{k / 10},{math.exp(2 * k)}\n" for k in range(12)),
         ["row 2", "no straight part"]),
    ],
)  # fmt: skip
def test_readings_that_give_nothing_are_refused_in_one_line(test, text, words, tmp_path):
    path = written(tmp_path, text)
    with pytest.raises(LaboratoryError) as caught:
        analyse(test, path)
    assert_one_line(caught.value, path, words)


def test_leaving_out_what_is_not_there_is_refused(tmp_path):
    with pytest.raises(LaboratoryError, match="no component 'dust'"):
        analyse_composition(written(tmp_path, "component,replicate,mass_g\ns,1,30\n"), ["dust"])


def test_an_unknown_test_lists_the_known_ones(tmp_path):
    with pytest.raises(LaboratoryError, match="compression, shear, inclined_plane"):
        analyse("torsion", tmp_path / "x.csv")


def test_shipped_examples_give_the_article_s_means():
    """The examples are made up to the printed means; their readings are the inputs that the article does not print."""
    shipped = {path.stem for path in asset_path("laboratory", "drop").parent.glob("*.csv")}
    assert shipped - {"rebound_glass_acrylic"} == set(TESTS)
    for row in published("table1_physical"):
        moisture, density = (analyse(test, asset_path("laboratory", test)) for test in ("moisture", "density"))
        wet = of(moisture, row["component"], quantity="moisture_wet_basis").summary.mean
        # readings of 0.01 g of 30 g, three of them; of the immersed mass, of 8 g
        assert 100.0 * wet == pytest.approx(float(row["moisture_percent"]), abs=0.02)
        found = of(density, row["component"], quantity="density").summary.mean
        assert found == pytest.approx(float(row["density_kg_m3"]), rel=1e-3)
    plane, drop = (analyse(test, asset_path("laboratory", test)) for test in ("inclined_plane", "drop"))
    for row in published("table3_pairs"):
        pair = row["a"], row["b"]
        # printed digits
        assert round(of(plane, *pair, quantity="static_friction").summary.mean, 2) == float(row["static_friction"])
        assert round(of(drop, *pair, quantity="restitution").summary.mean, 2) == float(row["restitution"])
    elastic = analyse_elastic(asset_path("laboratory", "shear"), asset_path("laboratory", "compression"))
    for row in published("table2_elastic"):
        young = of(elastic, row["component"], quantity="youngs_modulus").summary.mean
        shear = of(elastic, row["component"], quantity="shear_modulus").summary.mean
        # Ten curves with noise of 0.2 % of their peak: the means are off by up to 0.15 %.
        assert young == pytest.approx(float(row["elastic_modulus_MPa"]) * 1e6, rel=3e-3)
        assert shear == pytest.approx(float(row["shear_modulus_MPa"]) * 1e6, rel=3e-3)
        ratio = next(one for one in elastic.estimates if one.of == (row["component"],))
        assert round(ratio.value, 2) == float(row["poisson_ratio"])


def test_ranges_of_table_4_are_those_of_the_examples():
    """Table 4's low and high levels are the smallest and largest measured value, says the article."""
    plane, drop = (analyse(test, asset_path("laboratory", test)) for test in ("inclined_plane", "drop"))
    rows = [row for row in published("table4_plackett_burman_factors") if row["b"]]
    assert len(rows) == 18
    for row in rows:
        result = plane if row["quantity"] == "static_friction" else drop
        found = of(result, row["a"], row["b"], quantity=row["quantity"]).summary
        # angles to 0.01°, distances to 0.1 mm
        assert (found.least, found.largest) == pytest.approx((float(row["low"]), float(row["high"])), abs=2e-4)


def test_results_are_plain_data():
    result = analyse("drop", asset_path("laboratory", "drop"))
    assert json.loads(json.dumps(result.to_dict()))["derived"][0]["summary"]["n"] == 10
