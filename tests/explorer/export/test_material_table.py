"""A material as tables: the declared numbers, and what is said of those that do not transfer."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from explorer.export.deck import pair_tables
from explorer.export.liggghts import unclamped_restitution
from explorer.export.material_table import write_material_table
from explorer.scene.file import load_scene, with_settings
from tests.explorer.command_line import explorer, refused
from tests.explorer.reported_studies import result_of_case

ROLLING = "effect.rolling_resistance.rolling_friction=0.1"


def tables(folder, settings=()):
    write_material_table(folder, with_settings(load_scene("funnel"), settings))
    found = {}
    for path in folder.glob("*.csv"):
        with path.open(newline="", encoding="utf-8") as file:
            found[path.stem] = list(csv.DictReader(file))
    return found


def test_another_law_is_named_and_does_not_transfer(tmp_path):
    (tmp_path / "hertz").mkdir()
    assert "contact law" not in {row["quantity"] for row in tables(tmp_path / "hertz")["conventions"]}
    assert "Hertz–Mindlin without slip" in (tmp_path / "hertz" / "README.txt").read_text(encoding="utf-8")
    linear = ["contact.law=linear_spring_dashpot", "contact.characteristic_velocity=0.4m/s"]
    row = next(row for row in tables(tmp_path, linear)["conventions"] if row["quantity"] == "contact law")
    assert "linear_spring_dashpot" in row["here"]
    assert "V = 0.4 m/s" in row["here"]
    assert row["transfers"].startswith("no")
    assert "LINEAR springs" in (tmp_path / "README.txt").read_text(encoding="utf-8")


def test_the_declared_numbers_are_in_the_tables(tmp_path):
    found = tables(tmp_path, ["material.seed.shear_modulus=60MPa"])
    seed = found["materials"][0]
    assert (seed["material"], float(seed["density_kg_m3"])) == ("seed", 346.0)
    assert float(seed["shear_modulus_Pa"]) == 60e6
    assert float(seed["youngs_modulus_Pa"]) == pytest.approx(2 * 60e6 * 1.31)
    wall = found["materials"][-1]
    assert (wall["material"], wall["density_kg_m3"]) == ("rigid_sieve_plate", "")
    pairs = {(row["a"], row["b"]): row for row in found["interactions"]}
    assert len(pairs) == 9
    petiole = pairs["plate", "petiole"]
    assert [float(petiole[key]) for key in ("restitution", "static_friction")] == [0.40, 0.82]
    assert float(petiole["restitution_same_damping"]) == pytest.approx(unclamped_restitution(0.40), rel=1e-6)


def test_bodies_have_the_mass_of_their_true_solid(tmp_path):
    bodies = {row["body"]: row for row in tables(tmp_path)["bodies"]}
    ellipsoid = np.pi / 6 * 27.92e-3 * 11.18e-3 * 6.11e-3 * 346.0
    assert float(bodies["seed"]["mass_kg"]) == pytest.approx(ellipsoid, rel=1e-4)
    assert float(bodies["petiole"]["Iyy_kg_m2"]) == float(bodies["petiole"]["Izz_kg_m2"])


@pytest.mark.parametrize("settings, cell, here, transfers", [((), "0", "0", "yes"), ((ROLLING,), "", "0.1", "no:")])
def test_a_rolling_friction_is_not_handed_on_as_a_number(tmp_path, settings, cell, here, transfers):
    found = tables(tmp_path, settings)
    assert {row["rolling_friction"] for row in found["interactions"]} == {cell}
    assert {row["rolling_friction_here"] for row in found["interactions"]} == {here}
    (row,) = [row for row in found["conventions"] if row["quantity"] == "rolling friction"]
    assert row["transfers"].startswith(transfers)


@pytest.mark.parametrize(("rule", "transfers"), [("body_mass", "yes"), ("local_mass", "no: ")])
def test_the_clump_rule_is_named_and_transfers_where_it_is_that_of_edem(tmp_path, rule, transfers):
    found = tables(tmp_path, [f"contact.clump_rule={rule}"])
    (row,) = [row for row in found["conventions"] if row["quantity"] == "clump rule"]
    assert row["here"].startswith(f"contact.clump_rule = {rule}: dashpots take the mass")
    assert row["transfers"].startswith(transfers)


def test_a_restitution_that_no_other_damping_has_is_left_out(tmp_path):
    row = tables(tmp_path, ["pair.seed.seed.restitution=0.06"])["interactions"][0]
    assert (row["restitution"], row["restitution_same_damping"]) == ("0.06", "")


def test_effects_that_the_tables_cannot_hold_are_named(tmp_path):
    found = tables(tmp_path, ["effect.air_drag.strength=1"])
    assert found["conventions"][-1]["quantity"] == "effect air_drag"
    assert "air_drag" in (tmp_path / "README.txt").read_text()


def test_effects_of_the_rig_are_named_though_they_are_carried_out(tmp_path):
    tables(tmp_path, ["effect.plate_tilt.tilt_x=5", "effect.funnel_offset.dx=5mm", "effect.density_error.excess=0.1"])
    assert "cannot hold: plate_tilt, funnel_offset." in (tmp_path / "README.txt").read_text()


def test_of_several_pairs_that_would_apply_the_table_has_that_of_the_solver(tmp_path):
    scene = load_scene("funnel")
    names = ("seed", "plate")
    materials = tuple(
        replace(one, name=f"{one.name} stuff" if one.name in names else one.name) for one in scene.materials
    )
    bodies = tuple(replace(one, material=f"{one.name} stuff") if one.name in names else one for one in scene.bodies)
    one, other = (body for body in bodies if body.name in names)
    by_material = [(one.name, other.material, 0.5), (other.name, one.material, 0.3)]
    pairs = tuple(replace(scene.pairs[0], a=a, b=b, static_friction=friction) for a, b, friction in by_material)
    kept = tuple(pair for pair in scene.pairs if not pair.joins(one.name, other.name))
    scene = replace(scene, materials=materials, bodies=bodies, pairs=(*pairs, *kept))
    write_material_table(tmp_path, scene)
    with (tmp_path / "interactions.csv").open(newline="", encoding="utf-8") as file:
        rows = {(row["a"], row["b"]): row for row in csv.DictReader(file)}
    friction = pair_tables(scene)[0]
    assert float(rows[one.name, other.name]["static_friction"]) == pytest.approx(friction[0, 1]) == 0.3


def test_effects_of_the_set_up_are_carried_out(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    plain = tables(tmp_path / "a")["bodies"][0]
    heavy = tables(tmp_path / "b", ["effect.density_error.excess=0.1"])["bodies"][0]
    assert float(heavy["mass_kg"]) == pytest.approx(1.1 * float(plain["mass_kg"]), rel=1e-5)


def test_the_command_writes_them_without_a_pour(tmp_path):
    result = explorer("export", "sunflower_extract", tmp_path / "edem", "--to", "edem")
    assert result.exit_code == 0, result.output
    names = {path.name for path in (tmp_path / "edem").iterdir()}
    assert names == {"README.txt", "materials.csv", "interactions.csv", "bodies.csv", "conventions.csv"}


def test_every_is_about_moments_only(tmp_path):
    line = refused(explorer("export", "funnel", tmp_path / "new", "--to", "edem", "--every", "0.1"))
    assert line == "--every: allowed only with --to paraview, not with edem"


@pytest.mark.parametrize("option", [("--time", 2), ("--seed", 1)])
def test_what_belongs_to_a_pour_is_refused_where_the_material_alone_is_taken(option, tmp_path):
    line = refused(explorer("export", "funnel", tmp_path / "new", "--to", "edem", *option))
    assert line == "--time, --seed: not allowed with --to edem, which exports only the material"


@pytest.fixture(scope="module")
def calibrations(tmp_path_factory):
    """Folders with the result.json of a study that found something, and of one that did not."""
    folders = {}
    for case in ("planted", "nothing acts"):
        folders[case] = tmp_path_factory.mktemp(case.replace(" ", "_"))
        result = result_of_case(case)
        result["study"]["profile"]["name"] = "standard"  # the made-up studies run in a profile of no file
        (folders[case] / "result.json").write_text(json.dumps(result), encoding="utf-8")
    return folders


def test_a_calibration_is_exported_at_its_optimum(calibrations, tmp_path):
    folder = calibrations["planted"]
    result = explorer("export", folder, tmp_path / "edem", "--to", "edem")
    assert result.exit_code == 0, result.output
    # The one target leaves all three factors open.
    assert result.stderr.startswith(f"note: {folder}/result.json: the target does not identify every factor: ")
    assert result.stderr.count("(chosen by rule: ") == 3
    values = json.loads((folder / "result.json").read_text())["optimum"]["values"]
    assert "pair.seed.seed.static_friction" in values
    with (tmp_path / "edem" / "interactions.csv").open(newline="", encoding="utf-8") as file:
        seeds = next(csv.DictReader(file))
    assert float(seeds["static_friction"]) == pytest.approx(values["pair.seed.seed.static_friction"], rel=1e-6)
    assert float(seeds["static_friction"]) != 0.57


def test_an_identified_optimum_is_exported_without_a_note(calibrations, tmp_path):
    result = json.loads((calibrations["planted"] / "result.json").read_text())
    result["optimum"]["single"]["unidentified"] = []
    (tmp_path / "result.json").write_text(json.dumps(result))
    assert explorer("export", tmp_path, tmp_path / "edem", "--to", "edem").stderr == ""


def test_an_optimum_in_noise_is_exported_with_a_note(calibrations, tmp_path):
    result = explorer("export", calibrations["nothing acts"], tmp_path / "edem", "--to", "edem")
    assert result.exit_code == 0, result.output
    assert "not better than noise, so this is not a calibration" in result.stderr


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"study": 3}', '{"study": {"profile": {"name": "x"}, "file": "x"}}'])
def test_a_folder_with_another_result_is_one_line(text, tmp_path):
    (tmp_path / "result.json").write_text(text)
    line = refused(explorer("export", tmp_path, tmp_path / "new", "--to", "edem"))
    assert line == f"{tmp_path}/result.json: is not the result of `explorer calibrate`"
