"""Study files: what is read, and one clear line for whatever is wrong."""

import copy
import tomllib

import pytest

from doe.errors import StudyFileError
from doe.studies.factors import bodies_touched
from doe.studies.study import load_study, study_from, with_profile
from solver import ParameterError, asset_path, value

PATH = asset_path("studies", "sunflower_extract")
TABLE = tomllib.loads(PATH.read_text())


def test_the_shipped_study_is_read():
    study = load_study("sunflower_extract")
    assert [factor.name for factor in study.factors] == [f"X{k}" for k in range(1, 25)]
    assert study.targets[0].mean == 24.68
    assert study.targets[0].sd_source == "derived"
    modulus = next(factor for factor in study.factors if factor.name == "X4")
    assert modulus.level(-1) == pytest.approx(40.1e6)
    assert modulus.level(0) == pytest.approx(55.3e6)
    assert value(study.scene, "rig.outlet_height") == 0.065


def test_a_profile_sets_shapes_and_mass():
    study, profile = with_profile(load_study("sunflower_extract"), "quick")
    assert value(study.scene, "rig.mass") == profile.mass
    assert study.scene.bodies[0].spheres == "coarse"
    with pytest.raises(ParameterError, match="quick, standard, full"):
        with_profile(study, "huge")


def test_without_a_mass_in_the_profile_the_rig_s_is_poured():
    study = study_with(lambda t: (t["rig"].update(mass="100g"), t["profile"]["quick"].pop("mass")))
    sized, profile = with_profile(study, "quick")
    assert value(sized.scene, "rig.mass") == profile.mass == 0.1
    study = study_with(lambda t: t.pop("profile"))
    assert with_profile(study, "standard")[1].mass == value(study.scene, "rig.mass")


def test_mass_fractions_of_factors_and_assumptions_are_poured_as_stated():
    """The assumption states what the material has; the factor differs from it."""
    study = study_with(
        lambda t: (
            t["factor"][3].update(path="body.plate.mass_fraction", low=0.1, high=0.3, reference=0.20),
            next(a for a in t["assumption"] if a["path"] == "body.seed.mass_fraction").update(reference=0.78),
        )
    )
    shares = [body.mass_fraction for body in study.scene.bodies]
    assert shares == pytest.approx([0.78, 0.20, 0.02])


def test_what_is_assumed_is_what_is_poured():
    study = study_with(lambda t: t["assumption"][0].update(reference=t["assumption"][0]["high"]))
    one = study.assumptions[0]
    assert value(study.scene, one.path) == one.reference == one.high
    assert value(load_study("sunflower_extract").scene, one.path) != one.high
    sized, profile = with_profile(load_study("sunflower_extract"), "quick")
    shapes = next(one for one in sized.assumptions if one.path == "body.spheres")
    assert shapes.reference == profile.spheres == sized.scene.bodies[0].spheres == "coarse"


def test_a_named_level_is_used_as_it_stands():
    resolution = next(a for a in load_study("sunflower_extract").assumptions if a.path == "body.spheres")
    assert (resolution.level(-1), resolution.level(1)) == ("coarse", "standard")


@pytest.mark.parametrize(
    ("path", "bodies"),
    [
        ("material.petiole.shear_modulus", 6),
        ("pair.seed.plate.restitution", 3),
        ("pair.seed.rigid_sieve_plate.static_friction", 67),
        ("rig.outlet_height", float("inf")),
        ("body.plate.thickness", 3),
        ("body.seed.mass_fraction", 76),
        ("body.spheres", 76),
    ],
)
def test_bodies_touched_by_a_factor(path, bodies):
    assert bodies_touched(load_study("sunflower_extract").scene, path) == bodies


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda t: t.pop("material"), "material: missing; needed: a shipped material"),
        (lambda t: t.update(colour=1), "colour: unknown key"),
        (lambda t: t["rig"].update(width=1), r"rig\.width: no such parameter"),
        (lambda t: t["rig"].update(name="drum"), "drum"),
        (lambda t: t["rig"].update(mass="-3g"), r"rig\.mass"),
        (lambda t: t.update(target=[]), r"\[\[target\]\]"),
        (lambda t: t["target"][0].pop("mean"), r"target\.mean: missing"),
        (lambda t: t["target"][0].update(margin=0.0), "margin: 0; allowed: more than 0"),
        (
            lambda t: t["target"].append({"observable": "apex_height_m", "mean": 0.03}),
            r"target\.margin: missing for apex_height_m; only an angle has a default, 2°",
        ),
        (lambda t: t["factor"][3].update(low="90MPa"), "not below"),
        (
            lambda t: (
                t["factor"][3].update(path="body.plate.mass_fraction", low=0.1, high=0.3, reference=0.14),
                t["factor"][5].update(path="body.petiole.mass_fraction", low=0.05, high=0.8, reference=0.08),
            ),
            r"factor\.path: mass fractions of plate, petiole, up to 1\.1 together; allowed: up to 1, with",
        ),
        (lambda t: t["factor"][3].update(reference="1MPa"), "reference"),
        (lambda t: t["factor"][3].update(path="material.seed.colour"), "no such parameter"),
        (lambda t: t["factor"][3].pop("high"), r"factor\.high: missing in X4"),
        (lambda t: t["factor"][3].update(name="X5"), "appears twice"),
        (lambda t: t.update(factor=t["factor"][:2]), "factor: 2 factors; at least 3"),
        (lambda t: t.update(fallback=["X4", "X99", "X7"]), "X99"),
        (lambda t: t.update(fallback=["X4"]), "at least 3"),
        (lambda t: t["profile"]["quick"].update(pilot_runs=0), "pilot_runs"),
        (lambda t: t["profile"]["quick"].update(speed=1), "unknown key"),
        (lambda t: t["scan"].update(values=["20mm", "-1mm"]), "outside"),
        (lambda t: t["change"][0].update(values={"rig.nothing": 1}), "no such parameter"),
        (lambda t: t.update(format=2), "format: 2; allowed: 1"),
        (lambda t: t["target"][0].update(observable="angle"), r"target\.observable: 'angle' is not one of angle_of"),
        (
            lambda t: t["target"][0].update(mean=-5.0),
            r"target\.mean: -5 deg of angle_of_repose_deg; allowed: 0 … 90 deg",
        ),
        (lambda t: t["target"][0].update(mean=95.0), r"target\.mean: 95 deg of .*; allowed: 0 … 90 deg"),
        (
            lambda t: t["target"].append({"observable": "residual_mass_kg", "mean": -0.02}),
            r"target\.mean: -0\.02 kg of residual_mass_kg; allowed: 0 kg and more",
        ),
        (
            lambda t: t["target"].append({"observable": "solid_fraction", "mean": 58.0}),
            r"target\.mean: 58 of solid_fraction; allowed: 0 … 1$",
        ),
        (lambda t: t["target"][0].update(mean="24.68"), r"target\.mean: '24\.68' is not a number"),
        (lambda t: t["target"][0].update(sd=-1.0), r"target\.sd: -1 is below 0"),
        (lambda t: t["target"][0].update(sd=True), r"target\.sd: True is not a number"),
        (lambda t: t["target"][0].update(n=1), r"target\.n: 1 is not a whole number of at least 2"),
        (lambda t: t["target"][0].update(n=9.5), r"target\.n: 9\.5"),
        (lambda t: t["target"][0].update(weight="much"), r"target\.weight: 'much'"),
        (lambda t: t.update(estimators="angle_of_repose_deg"), "estimators: .*; allowed: a list of names"),
        (lambda t: t.update(estimators=["angle_of_repose_deg", "slope"]), "estimators: 'slope' is not one of"),
        (lambda t: t.update(dummies=0), "dummies: 0 is not a whole number of at least 1"),
        (lambda t: t.update(dummies="3"), "dummies: '3'"),
        (lambda t: t.update(dummies=4), "24 factors with 4 dummies; allowed: up to 23 in a 28-run plackett-burman"),
        (lambda t: t.update(seed=-1), "seed: -1"),
        (lambda t: t.update(factor={"name": "X1"}), r"factor: .*; allowed: a list of tables \[\[factor\]\]"),
        (
            lambda t: t["factor"][3].update(path=t["factor"][4]["path"], low=25e6, high=45e6, reference=35e6),
            r"factor\.path: 'material\.plate\.shear_modulus' appears twice",
        ),
        (
            lambda t: t["factor"][3].update(path="body.spheres", low="coarse", high="fine", reference="fine"),
            "body.spheres of X4 has named levels",
        ),
        (lambda t: t["assumption"][5].update(low="standard"), "low and high are both 'standard'"),
        (lambda t: t["change"][0].pop("name"), r"change\.name: missing"),
        (lambda t: t["change"][0].pop("values"), r"change\.values: missing"),
        (lambda t: t["change"][0].update(values=3), "values: 3; allowed: a table"),
        (lambda t: t["change"][0].update(values={}), "changes nothing"),
        (lambda t: t["change"][1].update(name=t["change"][0]["name"]), r"change\.name: .* appears twice"),
        (lambda t: t["change"][1].update(name="reference"), r"change\.name: 'reference' .* is that of the reference"),
        (lambda t: t["scan"].pop("path"), r"scan\.path: missing"),
        (lambda t: t["scan"].pop("values"), r"scan\.values: missing"),
        (lambda t: t["scan"].update(path="body.spheres", values=["coarse"]), "a list of numbers"),
        (
            lambda t: t["profile"]["quick"].update(spheres="round"),
            r"profile\.quick\.spheres: 'round' is not one of coarse",
        ),
        (lambda t: t["profile"]["quick"].update(mass=0), r"profile\.quick\.mass: 0 kg; allowed: more than 0 kg"),
        (lambda t: t["profile"]["quick"].update(ascent_steps=1), r"ascent_steps: 1 .* at least 2"),
        (lambda t: t["profile"]["quick"].update(pilot_runs=True), "pilot_runs: True"),
        (lambda t: t["profile"]["full"].update(resolution_deg=0.0), r"resolution_deg: 0; allowed: more than 0"),
        (lambda t: t["profile"].update(quick=3), "quick: 3; allowed: a table"),
        (lambda t: t["profile"].update({"a/b": {}}), r"profile: 'a/b' is no name; allowed: .* no / and no"),
        (lambda t: t["profile"].update({"": {}}), "profile: '' is no name; allowed: 1 to 60 characters"),
    ],
)
def test_bad_study_files_say_what_is_allowed(change, says):
    table = copy.deepcopy(TABLE)
    change(table)
    with pytest.raises((ParameterError, StudyFileError), match=says) as error:
        study_from(table, PATH)
    assert "\n" not in str(error.value)


def test_a_bad_file_is_named(tmp_path):
    broken = tmp_path / "mine.toml"
    broken.write_text('format = 1\nmaterial = "sunflower_extract"\ncolour = 1\n')
    with pytest.raises(ParameterError, match=r"mine\.toml: colour: unknown key"):
        load_study(str(broken))


def study_with(change):
    table = copy.deepcopy(TABLE)
    change(table)
    return study_from(table, PATH)


def test_what_an_earlier_model_gave_may_be_no_measured_value():
    study = study_with(lambda t: t["target"][0].update(before_mean=-0.4, before_sd=0.2, before_n=6))
    assert study.targets[0].before_mean == -0.4


def test_the_observables_of_targets_are_always_among_the_estimators():
    density = {"observable": "bulk_density_kg_m3", "mean": 200.0, "margin": 5.0}
    study = study_with(lambda t: (t["target"].append(density), t.update(estimators=["angle_of_repose_cone_deg"])))
    assert study.estimators == ("angle_of_repose_deg", "bulk_density_kg_m3", "angle_of_repose_cone_deg")


def test_a_fallback_that_the_mixture_cannot_test_is_refused_before_the_first_run():
    study = study_with(lambda t: t.update(fallback=["X4", "X5", "X7"]))
    with pytest.raises(ParameterError, match="fallback: X5 acts on 3 bodies in profile standard; at least 3 factors"):
        with_profile(study, "standard")
    enough = study_with(lambda t: t.update(fallback=["X4", "X5", "X7", "X16"]))
    assert with_profile(enough, "standard")[1].name == "standard"


def test_a_resolution_in_degrees_needs_an_angle():
    study = study_with(lambda t: t["target"][0].update(observable="apex_height_m", mean=0.03, sd=0.002, margin=0.002))
    with pytest.raises(ParameterError, match=r"resolution_deg: the first target, apex_height_m, is not in degrees"):
        with_profile(study, "full")
    assert with_profile(study, "quick")[1].name == "quick"
