"""Parts of a material: what `explorer lab --out` writes, and how it gets into a material."""

import dataclasses
import hashlib
import math
import tomllib

import pytest

from doe.laboratory import analyse
from doe.laboratory.analysis import analyse_composition, analyse_elastic
from explorer.laboratory.part import (
    measured_text,
    merged,
    part_table,
    part_text,
    read_part,
    with_part,
    write_measured_material,
)
from solver import ParameterError, load_material, value
from solver.assets import asset_path


def shipped(test):
    return asset_path("laboratory", test)


@pytest.fixture
def scene():
    return load_material("sunflower_extract")


def test_a_part_reads_back_as_it_was_and_says_where_it_is_from(tmp_path):
    table = part_table(analyse("inclined_plane", shipped("inclined_plane")))
    path = tmp_path / "friction.toml"
    path.write_text(part_text(table, "two\nlines"))
    assert read_part(path) == table
    assert path.read_text().startswith("# two\n# lines\n")
    origin = table["measured"]["pair"]["seed"]["plate"]["static_friction"]
    assert origin["value"] == table["pair"]["seed"]["plate"]["static_friction"] == pytest.approx(0.55, abs=1e-4)
    assert (origin["n"], origin["source"], origin["formula"]) == (10, "inclined_plane.csv", "μ = tan σ")
    assert origin["sha256"] == hashlib.sha256(shipped("inclined_plane").read_bytes()).hexdigest()
    assert origin["low_95"] < origin["value"] < origin["high_95"]
    assert origin["sd"] > 0.0


def test_two_files_are_both_named_where_both_counted():
    table = part_table(analyse_elastic(shipped("shear"), shipped("compression")))
    measured = table["measured"]["materials"]["seed"]
    assert measured["poisson_ratio"]["source"] == "compression.csv, shear.csv"
    assert measured["youngs_modulus"]["source"] == "compression.csv"
    assert measured["shear_modulus"]["source"] == "shear.csv"


def test_rolling_friction_is_that_of_the_effect(scene, tmp_path):
    path = tmp_path / "rolling.toml"
    path.write_text(part_text(part_table(analyse("rolling", shipped("rolling"))), "rolling"))
    table = read_part(path)
    mean = table["effect"]["rolling_resistance"]["rolling_friction"]
    assert mean == pytest.approx(0.0498, abs=1e-4)
    assert value(with_part(scene, table), "effect.rolling_resistance.rolling_friction") == mean
    origin = table["measured"]["effect"]["rolling_resistance"]["rolling_friction"]
    assert origin["u_combined"] == pytest.approx(math.hypot(origin["sd"] / math.sqrt(10), origin["u_readings"]))
    assert (
        "u_readings"
        not in part_table(analyse("drop", shipped("drop")))["measured"]["pair"]["seed"]["seed"]["restitution"]
    )


@pytest.mark.parametrize("entry", [{"rolling_resistance": {"rolling": 0.1}}, {"rolling": {"rolling_friction": 0.1}}])
def test_an_effect_that_there_is_not_does_not_fit(scene, entry):
    with pytest.raises(ParameterError, match=r"effect\.rolling"):
        with_part(scene, {"format": 1, "effect": entry})


def test_the_spread_of_a_sieve_is_the_body_s(scene):
    table = part_table(analyse("sieve", shipped("sieve")))
    assert value(with_part(scene, table), "body.seed.size_spread") == pytest.approx(0.19, abs=0.001)
    assert table["body"][0]["size_distribution"] == "log_normal"


@pytest.mark.parametrize("test", ["bulk_density", "drum", "draw_down"])
def test_a_target_is_kept_as_measured_and_no_parameter(test):
    table = part_table(analyse(test, shipped(test)))
    assert set(table) == {"format", "measured"}


def test_friction_and_restitution_get_into_the_material_in_either_order(scene):
    other = with_part(scene, {"format": 1, "pair": {"plate": {"seed": {"static_friction": 0.3, "restitution": 0.2}}}})
    assert value(other, "pair.seed.plate.static_friction") == 0.3
    assert value(other, "pair.seed.plate.restitution") == 0.2
    assert value(other, "pair.seed.seed.restitution") == value(scene, "pair.seed.seed.restitution")


@pytest.mark.parametrize(
    ("entry", "shear", "ratio"),
    [
        ({"shear_modulus": 4e7}, 4e7, 0.31),
        ({"youngs_modulus": 1.31e8}, 5e7, 0.31),
        ({"youngs_modulus": 1.2e8, "shear_modulus": 5e7}, 5e7, 0.2),
        ({"youngs_modulus": 1.2e8, "poisson_ratio": 0.2}, 5e7, 0.2),
        ({"youngs_modulus": 1.2e8, "shear_modulus": 5e7, "poisson_ratio": 0.2}, 5e7, 0.2),
    ],
)
def test_what_is_measured_of_elasticity_fixes_the_rest(entry, shear, ratio, scene):
    seed = with_part(scene, {"format": 1, "materials": {"seed": entry}}).material("seed")
    assert (seed.shear_modulus, seed.poisson_ratio) == pytest.approx((shear, ratio))


def kept(folder, name, entry):
    """A part with elastic constants of the seed [Pa], with their origin."""
    path = folder / name
    origins = {key: {"value": value, "source": name} for key, value in entry.items()}
    tables = {"format": 1, "materials": {"seed": entry}, "measured": {"materials": {"seed": origins}}}
    path.write_text(part_text(tables, name))
    return path


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_moduli_of_two_tests_hold_together_in_either_order(order, tmp_path):
    parts = [kept(tmp_path, "e.toml", {"youngs_modulus": 1.2e8}), kept(tmp_path, "g.toml", {"shear_modulus": 5e7})]
    file = write_measured_material(tmp_path, "own", "sunflower_extract", [parts[k] for k in order])
    seed = load_material(str(file)).material("seed")
    assert (seed.shear_modulus, seed.poisson_ratio) == pytest.approx((5e7, 0.2))
    # One after the other, over the file of the first.
    first = write_measured_material(tmp_path, "first", "sunflower_extract", [parts[order[0]]])
    then = load_material(str(write_measured_material(tmp_path, "then", str(first), [parts[order[1]]])))
    assert then.material("seed") == seed


def test_a_measured_modulus_that_was_changed_since_is_not_brought_back(scene):
    measured = {"materials": {"seed": {"shear_modulus": {"value": 4.5e7}}}}
    seed = with_part(scene, {"format": 1, "materials": {"seed": {"youngs_modulus": 1.31e8}}}, measured)
    assert seed.material("seed").poisson_ratio == scene.material("seed").poisson_ratio


@pytest.mark.parametrize(
    ("entry", "left"),
    [
        ({"youngs_modulus": 1.2e8}, {"poisson_ratio"}),
        ({"shear_modulus": 5e7}, {"poisson_ratio"}),
        ({"youngs_modulus": 1.2e8, "shear_modulus": 5e7}, set()),
        ({"poisson_ratio": 0.2}, {"youngs_modulus", "shear_modulus"}),
    ],
)
def test_what_a_measured_modulus_fixes_is_no_longer_assumed(entry, left, scene):
    names = ("youngs_modulus", "shear_modulus", "poisson_ratio")
    assumed = dataclasses.replace(scene, assumed=tuple(f"materials.seed.{name}" for name in names))
    found = with_part(assumed, {"format": 1, "materials": {"seed": entry}})
    assert {path.rpartition(".")[2] for path in found.assumed} == left


def test_composition_replaces_all_fractions_at_once_and_they_are_no_longer_assumed(scene):
    part = part_table(analyse_composition(shipped("composition"), ["light_impurity"]))
    other = with_part(scene, part)
    assert [body.mass_fraction for body in other.bodies] == pytest.approx([75 / 96, 13 / 96, 8 / 96], rel=1e-3)
    assert "body.seed.mass_fraction" in scene.assumed
    assert set(scene.assumed) - set(other.assumed) == {f"body.{b.name}.mass_fraction" for b in scene.bodies}


def test_moisture_is_kept_though_it_is_no_parameter():
    table = part_table(analyse("moisture", shipped("moisture")))
    assert set(table) == {"format", "measured"}
    assert table["measured"]["seed"]["moisture_wet_basis"]["value"] == pytest.approx(0.287, abs=1e-4)


def test_the_other_estimates_of_a_drop_are_kept_beside_the_paper_s():
    table = part_table(analyse("drop", shipped("drop")))
    measured = table["measured"]["pair"]["seed"]["plate"]
    assert set(measured) == {"restitution", "restitution_gripping_sphere"}
    assert set(table["pair"]["seed"]["plate"]) == {"restitution"}


def test_a_measured_spread_of_sizes_comes_with_a_distribution_and_no_shape(scene):
    part = part_table(analyse("dimensions", shipped("dimensions")))
    assert [body["name"] for body in part["body"]] == ["seed", "petiole"]
    assert set(part["body"][0]) == {"name", "size_distribution", "size_spread"}
    other = with_part(scene, part)
    for old, new in zip(scene.bodies, other.bodies, strict=True):
        assert (new.shape, new.mass_fraction) == (old.shape, old.mass_fraction)
    seed = other.bodies[0].sizes
    assert (seed.kind, seed.spread) == ("log_normal", part["measured"]["body"]["seed"]["size_spread"]["value"])
    assert part["measured"]["seed"]["length"]["value"] == pytest.approx(27.92e-3)


@pytest.mark.parametrize(
    ("table", "word"),
    [
        ({"pair": {"seed": {"stone": {"restitution": 0.5}}}}, "pair.seed.stone"),
        ({"pair": {"seed": {"seed": {"restitution": 1.4}}}}, "outside"),
        ({"pair": {"seed": {"seed": {"grip": 1.4}}}}, "grip"),
        ({"pair": {"seed": 3}}, "pair.seed"),
        ({"materials": {"stone": {"density": 3.0}}}, "stone"),
        ({"materials": {"seed": {"youngs_modulus": 3e8, "shear_modulus": 5e7}}}, "poisson_ratio"),
        ({"materials": {"seed": {"youngs_modulus": "soft", "shear_modulus": 5e7}}}, "youngs_modulus"),
        (
            {"materials": {"seed": {"youngs_modulus": 1e8, "poisson_ratio": "x"}}},
            "seed.poisson_ratio: 'x' is not a number",
        ),
        ({"body": [{"name": "seed", "mass_fraction": 1.0}]}, "seed, plate, petiole"),
        ({"body": [{"name": n, "mass_fraction": 0.5} for n in ("seed", "plate", "petiole")]}, "add up to 1.5"),
        ({"body": [{"name": "seed", "mass_fraction": "much"}]}, "mass_fraction"),
        ({"body": [{"name": "seed"}]}, "a mass_fraction, or with size_distribution and size_spread"),
        ({"body": [{"name": "seed", "size_distribution": "log_normal", "size_spread": 0.7}]}, "size_spread"),
        ({"body": [{"name": "stone", "size_spread": 0.1}]}, "body.stone"),
    ],
)
def test_a_part_that_does_not_fit_is_refused(table, word, scene):
    with pytest.raises(ParameterError, match=word) as caught:
        with_part(scene, {"format": 1, **table})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "word"), [("format = 2", "format"), ("format = 1\nrig = 3", "rig"), ("= 1", "line 1")]
)
def test_a_file_that_is_no_part_is_refused(text, word, tmp_path):
    path = tmp_path / "part.toml"
    path.write_text(text)
    with pytest.raises(ParameterError, match=word):
        read_part(path)


def test_merging_keeps_both_and_the_later_of_two():
    one, other = {"a": {"x": 1, "y": 1}, "b": 1}, {"a": {"y": 2}, "c": {"z": 3}}
    assert merged(one, other) == {"a": {"x": 1, "y": 2}, "b": 1, "c": {"z": 3}}
    assert one == {"a": {"x": 1, "y": 1}, "b": 1}


def test_dates_and_times_that_were_noted_by_hand_are_kept():
    text = "[measured.note]\nday = 2024-01-15\nat = 08:30:00\nwhen = 2024-01-15T08:30:00+01:00\n"
    table = tomllib.loads(text)
    assert tomllib.loads(measured_text(table["measured"])) == table


def test_names_that_toml_would_misread_are_quoted(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("a,b,replicate,angle_deg\n-x_1,2-y,1,30\n")
    table = part_table(analyse("inclined_plane", path))
    assert tomllib.loads(part_text(table, "")) == table
