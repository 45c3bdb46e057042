"""Material files and parameter paths: what is read, and one clear line for whatever is wrong."""

import copy
import dataclasses
import math
import tomllib

import pytest

from solver.assets import asset_path
from solver.params import Parameter, ParameterError, parse_quantity
from solver.scenes.body import counts
from solver.scenes.material_file import load_material, scene_from
from solver.scenes.scene import canonical, parameters, value, with_rig, with_values

PATH = asset_path("materials", "sunflower_extract")
TABLE = tomllib.loads(PATH.read_text())


@pytest.fixture
def scene():
    return load_material("sunflower_extract")


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [("56.3MPa", "Pa", 56.3e6), ("65mm", "m", 0.065), ("20g/s", "kg/s", 0.02), ("1e-3", "m", 1e-3), ("50 %", "1", 0.5)],
)
def test_quantities_with_a_unit(text, unit, expected):
    assert parse_quantity(text, unit, "x") == pytest.approx(expected)


@pytest.mark.parametrize("bad", ["abc", "1 2", "nan", "inf", "5 kg", "", True, [1]])
def test_bad_quantities_are_refused(bad):
    with pytest.raises(ParameterError, match=r"^rig\.mass: "):
        parse_quantity(bad, "m", "rig.mass")


def test_every_path_reads_and_writes(scene):
    for path, parameter in parameters(scene).items():
        old = value(scene, path)
        assert parameter.check(old) == old
        assert value(with_values(scene, {path: old}), path) == pytest.approx(old) if not isinstance(old, str) else old


def test_the_order_of_a_pair_is_free(scene):
    changed = with_values(scene, {"pair.petiole.seed.static_friction": 0.6})
    assert canonical(scene, "pair.petiole.seed.restitution") == "pair.seed.petiole.restitution"
    assert value(changed, "pair.seed.petiole.static_friction") == 0.6
    assert value(changed, "pair.seed.seed.static_friction") == 0.57


@pytest.mark.parametrize(
    ("path", "bad", "says"),
    [
        ("material.seed.shear_modulus", "-5MPa", "outside"),
        ("material.corn.density", 500, "seed"),
        ("pair.seed.corn.restitution", 0.5, "known"),
        ("rig.outlet_diameter", "10mm", "too narrow for a body"),
        ("rig.outlet_diameter", "120mm", "inlet"),
        ("insertion.protocol", "shake", "pour_through"),
        ("body.spheres", "many", "coarse"),
        ("insertion.region_radius", "90mm", "wider than the feed opening"),
        ("rig.mass", "nan", "not a number"),
        ("rig.domain_half_width", "55mm", "lies within the feed opening; allowed: more than 0.057"),
        ("rig.mas", 1, "rig.mass"),
    ],
)
def test_bad_settings_say_what_is_allowed(scene, path, bad, says):
    with pytest.raises(ParameterError, match=says) as error:
        with_values(scene, {path: bad})
    assert path.split(".")[0] in str(error.value)
    assert "\n" not in str(error.value)


def mutated(**changes):
    table = copy.deepcopy(TABLE)
    for path, new in changes.items():
        *parents, last = path.split("__")
        spot = table
        for part in parents:
            spot = spot[int(part)] if isinstance(spot, list) else spot[part]
        if new is None:
            del spot[last]
        else:
            spot[last] = new
    return table


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"format": 2}, "format: 2"),
        ({"colour": "red"}, "colour: unknown key"),
        ({"contact_law": "jkr"}, "contact_law"),
        ({"materials__seed__density": -1}, r"materials\.seed\.density"),
        ({"materials__seed__hardness": 1}, "hardness"),
        ({"materials__seed__youngs_modulus": 1e8}, "exactly two"),
        ({"materials__seed__poisson_ratio": None}, "exactly two"),
        ({"body__0__mass_fraction": 0.5}, "add up to"),
        ({"body__0__material": "corn"}, "corn"),
        ({"body__0__material": ["a"]}, "material"),
        ({"body__0__shape": {"ellipsoid": [1.0, -1.0, 1.0]}}, r"body\.seed\.shape"),
        ({"body__0__spheres": "tiny"}, "coarse"),
        ({"body": 3}, r"body: 3; allowed: a list of tables \[\[body\]\]"),
        ({"assumed": 3}, "assumed: 3; allowed: a list of names"),
        ({"pair__seed__seed": None}, r"pair\.seed\.seed: no such pair"),
        ({"pair__seed__seed__restitution": 1.5}, "restitution"),
        ({"pair__seed__seed__restitution": None}, "restitution is missing"),
        ({"pair__plate__seed": {"static_friction": 0.5, "restitution": 0.5}}, "appears twice"),
        (
            {"pair__seed__corn": {"static_friction": 0.5, "restitution": 0.5}},
            "no material or body 'corn'; known: seed,",
        ),
        ({"gravity": [0, 0]}, "gravity"),
        ({"gravity": [0, 0, 9.81]}, r"gravity: \[0.0, 0.0, 9.81\] m/s2; allowed: third number below 0"),
        ({"gravity": [0, 0, 0]}, "gravity"),
        ({"gravity": [0, 0, -1e300]}, "up to 10000"),
        ({"wall": "glass"}, "glass"),
    ],
)
def test_bad_material_files_say_what_is_allowed(changes, says):
    with pytest.raises(ValueError, match=says) as error:
        scene_from(mutated(**changes), PATH)
    assert "\n" not in str(error.value)


def test_what_is_assumed_may_be_named_by_its_path():
    table = mutated(assumed=["material.seed.density", "materials.seed.youngs_modulus", "pair.plate.seed.restitution"])
    assert scene_from(table, PATH).assumed == (
        "materials.seed.density",
        "materials.seed.youngs_modulus",
        "pair.seed.plate.restitution",
    )


def test_a_bad_file_is_named(tmp_path):
    broken = tmp_path / "grain.toml"
    broken.write_text("format = 1\n[materials")
    with pytest.raises(ParameterError, match=r"grain\.toml: Expected"):
        load_material(str(broken))
    broken.write_text("format = 1\n")
    with pytest.raises(ParameterError, match=r"grain\.toml: materials: missing"):
        load_material(str(broken))


def test_two_elastic_constants_give_the_third(scene):
    steel = scene.material("rigid_sieve_plate")
    assert steel.youngs_modulus == pytest.approx(2.0e11)
    assert steel.shear_modulus == pytest.approx(2.0e11 / 2.6)


def test_a_computed_level_that_misses_a_limit_by_rounding_is_the_limit(scene):
    """0.05 of a coefficient of restitution is its least: a walk from 0.175 + 0.125 x ends a rounding error below."""
    path = "pair.seed.seed.restitution"
    below = (0.05 + 0.30) / 2 - 1.0 * (0.30 - 0.05) / 2
    assert below < 0.05
    assert value(with_values(scene, {path: below}), path) == 0.05
    with pytest.raises(ParameterError, match=r"0\.0499999 is outside 0\.05 … 1"):
        with_values(scene, {path: 0.0499999})
    # Without an upper limit nothing is rounded.
    size = Parameter("rig.size", "m", 0.0, math.inf, "Size.")
    assert size.check(1e-300) == 1e-300
    with pytest.raises(ParameterError):
        size.check(-1e-300)


def test_counts_are_the_largest_remainder_and_the_same_for_every_seed(scene):
    # By hand: 0.78·30/0.34552 = 67.7, 0.14·30/1.40383 = 2.99, 0.08·30/0.4283 = 5.60 → total 76.3 → 76 bodies;
    # quotas 67.46, 2.98, 5.58 → whole 67, 2, 5, the two largest remainders are those of plate and petiole.
    assert counts(scene.bodies, 0.030) == (67, 3, 6)


def test_a_set_mass_fraction_scales_the_others(scene):
    changed = with_values(scene, {"body.seed.mass_fraction": 0.70})
    assert sum(body.mass_fraction for body in changed.bodies) == pytest.approx(1.0)
    assert changed.bodies[1].mass_fraction / changed.bodies[2].mass_fraction == pytest.approx(0.14 / 0.08)


def test_the_rest_goes_to_the_others_though_they_had_none(scene):
    alone = with_values(scene, {"body.seed.mass_fraction": 1.0})
    assert [body.mass_fraction for body in alone.bodies] == [1.0, 0.0, 0.0]
    again = with_values(alone, {"body.seed.mass_fraction": 0.6})
    assert [body.mass_fraction for body in again.bodies] == pytest.approx([0.6, 0.2, 0.2])


def test_fractions_that_are_set_together_stay_as_they_are(scene):
    fractions = {"body.seed.mass_fraction": 0.86, "body.petiole.mass_fraction": 0.10}
    for order in (fractions, dict(reversed(fractions.items()))):
        bodies = with_values(scene, order).bodies
        assert [body.mass_fraction for body in bodies] == pytest.approx([0.86, 0.04, 0.10])
    every = {"body.seed.mass_fraction": 0.5, "body.plate.mass_fraction": 0.3, "body.petiole.mass_fraction": 0.2}
    assert [body.mass_fraction for body in with_values(scene, every).bodies] == [0.5, 0.3, 0.2]
    with pytest.raises(ParameterError, match=r"seed, plate, petiole add up to 1\.1, but there is no other component"):
        with_values(scene, every | {"body.seed.mass_fraction": 0.6})
    with pytest.raises(ParameterError, match=r"mass_fraction: seed, petiole add up to 1\.06; allowed: up to 1"):
        with_values(scene, fractions | {"body.petiole.mass_fraction": 0.2})


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_single_component_is_all_of_the_mass(share):
    with pytest.raises(ParameterError, match=r"body\.bead\.mass_fraction: .* there is no other component; allowed: 1"):
        with_values(load_material("glass_beads"), {"body.bead.mass_fraction": share})


def test_a_share_that_misses_1_by_what_a_file_may_is_1():
    scene = load_material("glass_beads")
    bodies = (dataclasses.replace(scene.bodies[0], mass_fraction=1.0 - 1e-7),)
    assert (
        with_values(dataclasses.replace(scene, bodies=bodies), {"body.bead.mass_fraction": 1.0 - 1e-7}).bodies == bodies
    )


def test_a_box_may_reach_to_the_corners_of_its_domain():
    boxed = with_rig(load_material("glass_beads"), "draw_down_box")
    changed = {"rig.width": 0.1, "rig.depth": 0.1, "rig.domain_half_width": 0.06}
    assert with_values(boxed, changed).rig.domain_half_width == 0.06
    with pytest.raises(ParameterError, match="lies within the feed opening; allowed: more than"):
        with_values(boxed, changed | {"rig.domain_half_width": 0.05})


def test_mass_is_proportional_to_density(scene):
    before = scene.bodies[0]
    after = with_values(scene, {"material.seed.density": 2 * 346.0}).bodies[0]
    assert after.mass == pytest.approx(2 * before.mass, rel=1e-12)
    assert after.clump.mass == pytest.approx(2 * before.clump.mass, rel=1e-12)
    assert after.clump.inertia == pytest.approx(2 * before.clump.inertia, rel=1e-12)


@pytest.mark.parametrize("name", ["", "p.p"])
def test_a_material_s_name_is_a_part_of_a_path(name):
    table = copy.deepcopy(TABLE)
    table["materials"][name] = table["materials"]["seed"]
    with pytest.raises(ParameterError, match=rf"^materials: '{name}' must be a non-empty name without a dot$"):
        scene_from(table, PATH)
