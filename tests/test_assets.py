"""The shipped data agree with the published tables, with each other, and are found."""

import csv
import math
import statistics
import tomllib
from pathlib import Path
from typing import Any

import pytest
from scipy.optimize import brentq
from scipy.stats import ttest_ind_from_stats

from solver.assets import AssetNotFoundError, asset_path, shipped_assets

COMPONENTS = ("seed", "plate", "petiole")
# Relative difference of E = 2 G (1 + ν) from the printed E: ν has two digits, so up to 0.005 / (1 + ν).
ROUNDING_OF_POISSON_RATIO = 0.005 / 1.26


def table(name: str) -> list[dict[str, str]]:
    with asset_path("source_tables", name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def load(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def material() -> dict[str, Any]:
    return load(asset_path("materials", "sunflower_extract"))


@pytest.fixture(scope="module")
def study() -> dict[str, Any]:
    return load(asset_path("studies", "sunflower_extract"))


def in_si(value: float | str) -> float:
    """A number of the study file, which gives moduli with the unit that Table 4 prints."""
    if isinstance(value, str):
        return float(value.removesuffix("MPa")) * 1e6
    return value


def declared(material: dict[str, Any], path: str) -> float:
    """Value of a parameter path of the study in the material file."""
    kind, *keys = path.split(".")
    value = material["materials" if kind == "material" else kind]
    for key in keys:
        value = value[key]
    return float(value)


def test_table_1_is_in_the_material(material):
    bodies = {body["name"]: body for body in material["body"]}
    mm = 1e-3
    for row in table("table1_physical"):
        name = row["component"]
        length, width = float(row["length_mm"]) * mm, float(row["width_or_diameter_mm"]) * mm
        # Table 1 prints no thickness for the plate (assumed) and none is needed for the petiole.
        thickness = [float(row["thickness_mm"]) * mm] if row["thickness_mm"] else []
        ((solid, edges),) = bodies[name]["shape"].items()
        expected_solid, printed = {
            "seed": ("ellipsoid", [length, width, *thickness]),
            "plate": ("box", [length, width]),
            "petiole": ("cylinder", [width, length]),
        }[name]
        assert solid == expected_solid
        assert edges[: len(printed)] == pytest.approx(printed, rel=1e-12)  # rounding of the change of unit
        assert material["materials"][name]["density"] == float(row["density_kg_m3"])
        assert material["measured"][name]["moisture_percent"] == float(row["moisture_percent"])


def test_table_2_is_in_the_material(material):
    for row in table("table2_elastic"):
        elastic = material["materials"][row["component"]]
        assert elastic["shear_modulus"] == pytest.approx(float(row["shear_modulus_MPa"]) * 1e6, rel=1e-12)
        assert elastic["poisson_ratio"] == float(row["poisson_ratio"])
        printed = float(row["elastic_modulus_MPa"])
        assert material["measured"][row["component"]]["youngs_modulus_MPa"] == printed
        implied = 2 * elastic["shear_modulus"] * (1 + elastic["poisson_ratio"]) / 1e6
        assert implied == pytest.approx(printed, rel=ROUNDING_OF_POISSON_RATIO)


def test_table_3_is_in_the_material(material):
    rows = table("table3_pairs")
    for row in rows:
        pair = material["pair"][row["a"]][row["b"]]
        assert pair["static_friction"] == float(row["static_friction"])
        assert pair["restitution"] == float(row["restitution"])
    assert sum(len(partners) for partners in material["pair"].values()) == len(rows)


def test_table_4_is_in_the_study(study):
    rows = table("table4_plackett_burman_factors")
    assert [factor["name"] for factor in study["factor"]] == [row["factor"] for row in rows]
    for factor, row in zip(study["factor"], rows, strict=True):
        if row["b"]:
            assert factor["path"] == f"pair.{row['a']}.{row['b']}.{row['quantity']}"
        else:
            assert factor["path"] == f"material.{row['a']}.{row['quantity']}"
        for level in ("low", "high"):
            printed = f"{row[level]}MPa" if row["unit"] == "MPa" else float(row[level])
            assert factor[level] == printed


def test_references_of_the_factors_are_the_measured_means(study, material):
    for factor in study["factor"]:
        reference = in_si(factor["reference"])
        assert reference == pytest.approx(declared(material, factor["path"]), rel=1e-12), factor["name"]
        assert in_si(factor["low"]) < reference < in_si(factor["high"]), factor["name"]


def test_screening_fills_the_28_run_design(study):
    assert len(study["factor"]) + study["dummies"] == len(table("table5_plackett_burman_results")) - 1


def test_fallback_is_what_the_article_found_significant(study):
    by_p = sorted(table("table6_plackett_burman_anova"), key=lambda row: float(row["p_value"]))
    assert set(study["fallback"]) == {row["factor"] for row in by_p[:3]}


def test_standard_deviation_of_the_target_follows_from_the_printed_p_value(study):
    """Student's two-sample t-test of Table 10 against the target gives the printed p = 0.827 at this sd."""
    (target,) = study["target"]
    angles = [float(row["simulated_angle_of_repose_deg"]) for row in table("table10_verification")]
    simulated = (statistics.mean(angles), statistics.stdev(angles), len(angles))

    def excess_p(sd: float) -> float:
        return float(ttest_ind_from_stats(*simulated, target["mean"], sd, target["n"]).pvalue) - 0.827

    assert round(brentq(excess_p, 0.1, 10.0), 1) == target["sd"]


def test_reference_of_every_assumption_is_what_the_files_assume(study, material):
    bodies = {body["name"]: body for body in material["body"]}
    assumed_in_files = {
        "rig.outlet_height": study["rig"]["outlet_height"],
        "insertion.rate": study["insertion"]["rate"],
        "insertion.drop_speed": study["insertion"]["drop_speed"],
        "body.seed.mass_fraction": bodies["seed"]["mass_fraction"],
        "body.plate.thickness": bodies["plate"]["shape"]["box"][2],
        "body.spheres": bodies["seed"]["spheres"],
    }
    assert {one["path"]: one["reference"] for one in study["assumption"]} == assumed_in_files


def test_every_assumed_outlet_height_clears_the_longest_body(study):
    longest = max(float(row["length_mm"]) for row in table("table1_physical")) * 1e-3
    (height,) = [one for one in study["assumption"] if one["path"] == "rig.outlet_height"]
    assert longest < height["low"] < study["rig"]["outlet_height"] < height["high"]


def test_mass_fractions_sum_to_one(material):
    assert sum(body["mass_fraction"] for body in material["body"]) == pytest.approx(1.0, abs=1e-12)
    assert tuple(body["name"] for body in material["body"]) == COMPONENTS


def test_assumed_paths_name_something_that_the_material_declares(material):
    bodies = {body["name"]: body for body in material["body"]}
    for path in material["assumed"]:
        kind, *keys = path.split(".")
        if kind == "body":
            assert keys[1] in bodies[keys[0]] or keys[1] == "thickness", path
        else:
            node = material[kind]
            for key in keys:
                node = node[key]


def test_profiles_spend_more_from_quick_to_full(study):
    quick, standard, full = (study["profile"][name] for name in ("quick", "standard", "full"))
    assert quick["mass"] < standard["mass"] == full["mass"] == study["rig"]["mass"]
    replicates = {key for key in standard if key.endswith("_replicates")}
    assert replicates == {key for key in quick if key.endswith("_replicates")}
    assert all(quick[key] <= standard[key] for key in replicates)
    assert not replicates & full.keys()
    assert full["resolution_deg"] > 0
    assert standard["verification_runs"] >= 10


@pytest.mark.parametrize("name", ["sunflower_extract", "sunflower_extract.toml"])
def test_a_shipped_name_is_found_with_and_without_suffix(name):
    assert asset_path("materials", name).name == "sunflower_extract.toml"


def test_a_users_file_is_found_by_its_path(tmp_path, monkeypatch):
    own = tmp_path / "sunflower_extract.toml"
    own.write_text("format = 1\n", encoding="utf-8")
    assert asset_path("materials", str(own)) == own
    assert asset_path("materials", own.name, relative_to=tmp_path) == own
    monkeypatch.chdir(tmp_path)
    assert asset_path("materials", own.name).resolve() == own
    assert asset_path("materials", "sunflower_extract") != own


COMMON = [name for name in shipped_assets("materials") if name not in ("sunflower_extract", "nine_sphere_seed")]
"""Materials that are shipped beside those of the article."""


def declared_numbers(table):
    """Path → number (or numbers) of what a material file says of its materials, bodies, pairs and effects."""
    found = {f"materials.{name}.{key}": n for name, entry in table["materials"].items() for key, n in entry.items()}
    for body in table["body"]:
        ((_, size),) = body["shape"].items()
        found[f"body.{body['name']}.shape"] = size
    for a, partners in table["pair"].items():
        found |= {f"pair.{a}.{b}.{key}": number for b, entry in partners.items() for key, number in entry.items()}
    for name, entry in table.get("effect", {}).items():
        found |= {f"effect.{name}.{key}": number for key, number in entry.items()}
    return found


@pytest.mark.parametrize("name", COMMON)
def test_every_number_of_a_common_material_has_a_source_or_is_assumed(name):
    """And a spread, or says that its source states none; what is assumed is there to be assumed."""
    table = load(asset_path("materials", name))
    numbers, assumed = declared_numbers(table), set(table["assumed"])
    assert assumed <= set(numbers)
    for path, number in numbers.items():
        entry = table["measured"]
        for key in path.split("."):
            entry = entry.get(key, {})
        assert entry or path in assumed, path
        if entry:
            assert path in assumed or entry["value"] == number
            assert entry["source"]
            assert {"sd", "low"} & set(entry) or "spread not stated" in entry["source"], path


@pytest.mark.parametrize("name", COMMON)
def test_what_nobody_measured_of_a_common_material_says_why(name):
    """Behind every assumed number stands a comment with the reason."""
    text = asset_path("materials", name).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if "# assumed: " in line or "# [m] assumed: " in line]
    assert len(lines) == len(load(asset_path("materials", name))["assumed"])
    assert all(line.split("assumed: ")[1].strip() for line in lines)


@pytest.mark.parametrize(
    ("name", "thousand", "tolerance"),
    [("soybean", 103.57e-3, 0.05), ("maize", 240.36e-3, 0.01), ("rice", 27.63e-3, 0.03), ("abs_beads", 0.200, 0.001)],
)
def test_a_grain_weighs_what_its_source_weighed(name, thousand, tolerance):
    """Its solid of the measured axes at the measured density against the measured mass of 1000 grains [kg]."""
    table = load(asset_path("materials", name))
    (body,) = table["body"]
    axes = body["shape"].get("ellipsoid") or 3 * [body["shape"]["sphere"]]
    mass = math.pi / 6.0 * math.prod(axes) * table["materials"][body["material"]]["density"]
    assert 1000.0 * mass == pytest.approx(thousand, rel=tolerance)


def test_an_unknown_name_lists_what_is_shipped():
    with pytest.raises(AssetNotFoundError, match=r"'gold'.*shipped: .*sunflower_extract"):
        asset_path("materials", "gold")


@pytest.mark.parametrize("name", ["", ".", "..", ".toml"])
def test_a_name_that_is_no_file_is_refused(name):
    with pytest.raises(AssetNotFoundError):
        asset_path("studies", name)


def test_an_unknown_kind_lists_the_kinds():
    with pytest.raises(ValueError, match="allowed: materials, studies, benchmarks, scenes, presets, meshes, "):
        asset_path("recipes", "wheat")  # type: ignore[arg-type]


def test_all_ten_tables_are_shipped():
    assert len(shipped_assets("source_tables")) == 10


def test_the_benchmark_s_pour_is_the_one_that_its_file_describes():
    from explorer.scene.file import load_scene
    from solver import body_counts
    from solver.scenes.time_step import time_step
    from solver.shapes.solid import Solid, mass_properties

    scene = load_scene("seed_pour")
    body = scene.bodies[0]
    assert body_counts(scene) == (87,)
    assert len(body.clump.radii) == 9
    assert time_step(scene) == pytest.approx(3.3e-6, rel=1e-5)  # digits of rayleigh_fraction
    whole = mass_properties(Solid("ellipsoid", (27.92e-3, 11.18e-3, 6.11e-3)), 346.0)
    assert body.mass == pytest.approx(whole.mass, rel=1e-4)  # printed digits
    assert list(body.clump.inertia) == pytest.approx(list(whole.inertia), rel=1e-4)
    # Every sphere inside the ellipsoid, to the last digit of its radius: distance of its centre from the surface.
    half = [13.96e-3, 5.59e-3, 3.055e-3]
    for centre, radius in zip(body.clump.centres, body.clump.radii, strict=True):
        assert distance_to_ellipsoid(half, centre) >= radius - 1e-7


def distance_to_ellipsoid(half, point):
    """Distance [m] of a point inside in the plane z = 0 from an ellipsoid: the foot is a² p/(a² + t), t its own."""
    (a, b, c), (x, y, _) = half, [abs(coordinate) for coordinate in point]

    def height(t):
        """1 − (x/a)² − (y/b)² of the foot with multiplier t; its z is c times the root of it."""
        return 1.0 - (a * x / (a * a + t)) ** 2 - (b * y / (b * b + t)) ** 2

    # z ≠ 0 needs t = −c²: the foot lies above or below, if there is one.
    above = height(-c * c)
    if above < 0.0:
        raise ValueError("the nearest point lies in the plane of the centres")
    foot = a * a * x / (a * a - c * c), b * b * y / (b * b - c * c), c * above**0.5
    return ((foot[0] - x) ** 2 + (foot[1] - y) ** 2 + foot[2] ** 2) ** 0.5
