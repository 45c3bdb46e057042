"""Materials from other programs' inputs: numbers of small files in their own syntax, and of our own exports."""

import dataclasses
import math

import numpy as np
import pytest

from explorer.export.deck import assembled
from explorer.export.liggghts import unclamped_restitution, write_liggghts
from explorer.export.material_table import write_material_table
from explorer.export.yade import write_yade
from explorer.scene.file import load_scene, with_settings
from solver import Entries, value
from tests.explorer.command_line import explorer, refused

LIGGGHTS = """\
# two materials: beads and a plate
atom_style granular
units si
variable r equal 0.0015   # radius
variable E equal 5.0e6*2
fix m1 all property/global youngsModulus peratomtype ${E} 1.e8
fix m2 all property/global poissonsRatio peratomtype 0.45 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 2 &
    0.3 0.4 &
    0.4 0.5
fix m4 all property/global coefficientFriction peratomtypepair 2 0.5 0.35 0.35 0.1
fix m5 all property/global coefficientRollingFriction peratomtypepair 2 0.02 0.03 0.03 0.0
fix m6 all property/global cohesionEnergyDensity peratomtypepair 2 0 0 0 0
pair_style gran model hertz tangential history rolling_friction cdt
pair_coeff * *
fix gravi all gravity 9.81 vector 0.0 0.0 -1.0
fix zwalls all wall/gran model hertz tangential history primitive type 2 zplane 0.0
fix pts1 all particletemplate/sphere 15485863 atom_type 1 density constant 2500 radius constant ${r}
fix pdd1 all particledistribution/discrete 32452843 1 pts1 1.0
"""

YADE = """\
from yade import pack
import does_not_exist
young, phi = 1e7, radians(30)
beads = O.materials.append(FrictMat(young=young, poisson=.3, density=2500, frictionAngle=phi, label='beads'))
O.materials.append(FrictMat(young=2*young, poisson=.25, frictionAngle=atan(0.4), label='plate'))
O.materials.append(ViscElMat(kn=1e5))
O.bodies.append(sphere((0, 0, 1), radius=2e-3, material='beads'))
O.bodies.append(wall(0, axis=2, material='plate'))
O.engines = [
    Ip2_FrictMat_FrictMat_MindlinPhys(en=MatchMaker(matches=((0, 0, .6), (0, 1, .7))), krot=1.0),
    NewtonIntegrator(damping=0, gravity=(0, 0, -9.81)),
]
raise SystemExit("read, not run")
"""

EDEM = """\
Material,Poisson's Ratio,Solids Density [kg/m3],Shear Modulus [MPa],Work Function
maize,0.4,1197,137,1
steel,0.3,7800,70000,1

Material 1,Material 2,Coefficient of Restitution,Coefficient of Static Friction,Coefficient of Rolling Friction
maize,maize,0.182,0.431,0.0782
maize,steel,0.621,0.342,0.0515
"""


def imported(program, text, tmp_path, name="input.txt"):
    """The scene of the new material, and what was said."""
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return read_back(program, path, tmp_path)


def read_back(program, path, tmp_path):
    result = explorer("new", "material", "mine", f"--from-{program}", path, "--out", tmp_path)
    assert result.exit_code == 0, result.output
    return load_scene(str(tmp_path / "mine.toml")), result.stdout


def numbers(scene, *paths):
    return [float(value(scene, path)) for path in paths]


def test_a_liggghts_script(tmp_path):
    scene, said = imported("liggghts", LIGGGHTS, tmp_path)
    assert scene.material("type1").youngs_modulus == pytest.approx(1e7)
    assert scene.material("type1").density == 2500.0
    assert numbers(scene, "material.type1.poisson_ratio", "material.type2.poisson_ratio") == [0.45, 0.3]
    assert numbers(scene, "pair.type1.type1.static_friction", "pair.type1.type2.static_friction") == [0.5, 0.35]
    # without limitForce the contact gives back what is typed in
    assert numbers(scene, "pair.type1.type1.restitution", "pair.type1.type2.restitution") == [0.3, 0.4]
    assert numbers(scene, "effect.rolling_resistance.rolling_friction") == [0.02]
    assert scene.rig.wall == "type2"
    assert scene.gravity == (0.0, 0.0, -9.81)
    (body,) = scene.bodies
    assert (body.name, body.extents[0]) == ("pts1", pytest.approx(3e-3))
    assert "cohesionEnergyDensity: no counterpart" in said
    assert "tangential history keeps the spring as a displacement" in said
    assert "rolling friction: cdt there" in said
    assert "type1 and type2 0.03" in said
    assert scene.assumed == ()
    assert "# rolling friction: cdt there" in (tmp_path / "mine.toml").read_text(encoding="utf-8")


def test_a_rolling_friction_without_a_model_does_not_act_in_liggghts(tmp_path):
    scene, said = imported("liggghts", LIGGGHTS.replace(" rolling_friction cdt", ""), tmp_path)
    assert numbers(scene, "effect.rolling_resistance.rolling_friction") == [0.0]
    assert "coefficientRollingFriction: no rolling_friction in pair_style" in said


def test_walls_of_two_types_are_taken_as_one_and_said(tmp_path):
    side = "fix side all wall/gran model hertz tangential history primitive type 1 xplane 0.0\n"
    scene, said = imported("liggghts", LIGGGHTS + side, tmp_path)
    assert scene.rig.wall == "type2"
    assert "walls of type2, type1: all are taken as type2" in said


def test_a_liggghts_script_without_friction_says_that_here_it_acts(tmp_path):
    _, said = imported("liggghts", LIGGGHTS.replace("tangential history rolling", "tangential off rolling"), tmp_path)
    assert "tangential off: no counterpart; here friction acts" in said


def test_a_yade_script_is_read_and_not_run(tmp_path):
    scene, said = imported("yade", YADE, tmp_path, "script.py")
    assert scene.material("beads").youngs_modulus == pytest.approx(1e7)
    assert numbers(scene, "material.beads.density", "material.plate.poisson_ratio") == [2500.0, 0.25]
    # an angle there, its tangent here; of two materials the smaller one
    friction = numbers(scene, "pair.beads.beads.static_friction", "pair.beads.plate.static_friction")
    assert friction == pytest.approx([1.0 / math.sqrt(3.0), 0.4])
    assert numbers(scene, "pair.beads.beads.restitution", "pair.beads.plate.restitution") == [0.6, 0.7]
    assert (scene.rig.wall, scene.bodies[0].extents[0]) == ("plate", pytest.approx(4e-3))
    for words in ("tan(frictionAngle)", "ViscElMat (line 6): only FrictMat is taken", "krot: not taken"):
        assert words in said


def test_a_variable_of_a_yade_script_has_the_value_of_its_line(tmp_path):
    script = (
        "phi = atan(0.5)\nFrictMat(young=1e7, density=2500, frictionAngle=phi, label='a')\n"
        "phi = atan(0.2); FrictMat(young=1e7, density=2500, frictionAngle=phi, label='b')\n"
        "phi = 0.0\nwall(0, axis=2, material='b')\nsphere((0, 0, 1), radius=2e-3, material='a')\n"
    )
    scene, _ = imported("yade", script, tmp_path, "script.py")
    assert numbers(scene, "pair.a.a.static_friction", "pair.a.b.static_friction") == pytest.approx([0.5, 0.2])


def test_a_function_of_a_yade_script_may_use_what_is_set_below_it(tmp_path):
    script = (
        "def material():\n    return FrictMat(young=E, density=2500, frictionAngle=0.3, label='a')\n"
        "E = 1e7\nO.materials.append(material())\nwall(0, axis=2, material='a')\n"
    )
    scene, _ = imported("yade", script, tmp_path, "script.py")
    assert scene.material("a").youngs_modulus == pytest.approx(1e7)


def test_what_meets_others_but_never_itself_is_no_grain(tmp_path):
    """Two wall materials: one is taken, and what became of all is said."""
    text = EDEM.replace("\n\n", "\nacrylic,0.35,1190,1200,1\n\n") + "maize,acrylic,0.5,0.3,0.04\n"
    scene, said = imported("edem", text, tmp_path, "table.csv")
    assert [body.material for body in scene.bodies] == ["maize"]
    assert "materials not taken: acrylic" in said
    assert "no bodies are named: maize are poured, and the walls are of steel" in said


def test_a_pair_that_is_stated_twice_is_told(tmp_path):
    scene, said = imported("edem", EDEM + "maize,maize,0.3,0.431,0.0782\n", tmp_path, "table.csv")
    assert numbers(scene, "pair.maize.maize.restitution") == [0.3]
    assert "maize and maize: restitution 0.182, then 0.3; the last is taken" in said
    assert "static_friction 0.431, then" not in said


def test_edem_s_table_has_the_shear_modulus(tmp_path):
    scene, said = imported("edem", EDEM, tmp_path, "table.csv")
    maize = scene.material("maize")
    assert (maize.density, maize.shear_modulus) == (1197.0, 137e6)
    assert maize.youngs_modulus == pytest.approx(2.0 * 137e6 * 1.4)
    assert numbers(scene, "pair.maize.steel.restitution", "pair.maize.maize.static_friction") == [0.621, 0.431]
    assert numbers(scene, "effect.rolling_resistance.rolling_friction") == [0.0782]
    assert scene.rig.wall == "steel"
    assert "E = 2 G (1 + nu)" in said
    assert "constant torque" in said
    assert "work_function: no counterpart" in said
    # EDEM keeps shapes elsewhere
    assert "body.maize.shape" in scene.assumed


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-16"])
def test_tables_and_scripts_are_read_in_whatever_characters_they_were_saved(encoding, tmp_path):
    for program, text in (("edem", EDEM.replace("kg/m3", "kg/m³")), ("liggghts", f"# broyée\n{LIGGGHTS}")):
        path = tmp_path / f"{program}.txt"
        path.write_bytes(text.encode(encoding))
        scene, _ = read_back(program, path, tmp_path)
        assert scene.materials[0].density in (1197.0, 2500.0)
        (tmp_path / "mine.toml").unlink()


def test_edem_s_table_with_semicolons_has_decimal_commas(tmp_path):
    text = EDEM.replace(",", ";").replace(".", ",")
    scene, _ = imported("edem", text, tmp_path, "table.csv")
    assert numbers(scene, "pair.maize.steel.restitution", "material.maize.poisson_ratio") == [0.621, 0.4]


def test_where_there_is_one_material_bodies_and_wall_are_made_of_it(tmp_path):
    yade = "m = FrictMat(young=1e7, label='m')\nwall(0, axis=2, material=m)\nSpherePack().makeCloud(rMean=0.01)\n"
    liggghts = (
        "fix m all property/global youngsModulus peratomtype 1e7\nfix w all wall/gran model hertz type 1 zplane 0\n"
    )
    for program, text in (("yade", yade), ("liggghts", liggghts)):
        scene, _ = imported(program, text, tmp_path)
        assert [body.material for body in scene.bodies] == [scene.rig.wall]
        assert scene.material(scene.rig.wall).youngs_modulus == pytest.approx(1e7)
        (tmp_path / "mine.toml").unlink()


def test_what_a_file_does_not_say_is_assumed(tmp_path):
    scene, _ = imported("yade", "m = FrictMat(young=1e7)\n", tmp_path, "script.py")
    assert {"materials.m.density", "materials.m.poisson_ratio", "pair.m.m.static_friction"} <= set(scene.assumed)
    assert "materials.m.youngs_modulus" not in scene.assumed


DECKABLE = ["pair.seed.plate.static_friction=0.31", "pair.petiole.rigid_sieve_plate.restitution=0.44"]


@pytest.fixture
def declared():
    scene = with_settings(load_scene("funnel"), DECKABLE)
    return dataclasses.replace(
        scene, bodies=tuple(dataclasses.replace(body, spheres="coarse") for body in scene.bodies)
    )


def deck_of_nothing(scene):
    """A deck into which nothing falls: what it says of the material is the same."""
    nothing = {
        "step": (0,),
        "component": (0,),
        "time": (0,),
        "position": (0, 3),
        "quaternion": (0, 4),
        "velocity": (0, 3),
    }
    return assembled(scene, 1, 1e-5, 1, Entries(**{key: np.zeros(shape) for key, shape in nothing.items()}), plate=0.0)


def same(scene, again, names, rel=1e-9):
    """Materials, pairs and, with their mass, bodies of both; ``names``: ours → theirs."""
    for body in scene.bodies:
        ours, theirs = scene.material(body.material), again.material(names[body.material])
        for key in ("density", "youngs_modulus", "poisson_ratio"):
            assert getattr(theirs, key) == pytest.approx(getattr(ours, key), rel=rel), (body.name, key)
    for pair in scene.pairs:
        for key in ("static_friction", "restitution"):
            path = f"pair.{names[pair.a]}.{names[pair.b]}.{key}"
            assert value(again, path) == pytest.approx(getattr(pair, key), rel=rel), path


def test_a_deck_for_liggghts_comes_back(declared, tmp_path):
    scene = with_settings(declared, ["effect.rolling_resistance.rolling_friction=0.07"])
    write_liggghts(tmp_path, deck_of_nothing(scene))
    again, said = read_back("liggghts", tmp_path / "in.liggghts", tmp_path)
    kinds = ["seed", "plate", "petiole", "rigid_sieve_plate"]
    same(scene, again, {name: f"type{k}" for k, name in enumerate(kinds, start=1)})
    assert numbers(again, "effect.rolling_resistance.rolling_friction") == [0.07]
    assert "limitForce" in said  # 0.57 is typed in there as another number
    assert f"{unclamped_restitution(0.57):.3f}" in (tmp_path / "in.liggghts").read_text(encoding="utf-8")
    for ours, theirs in zip(scene.bodies, again.bodies, strict=True):
        assert theirs.mass == pytest.approx(ours.mass, rel=1e-9)
        assert np.allclose(theirs.clump.centres, ours.clump.centres, atol=1e-9)


def test_a_deck_for_yade_comes_back(declared, tmp_path):
    declared = with_settings(declared, ["contact.tangential_law=mindlin", "contact.tangential_dashpot=uncapped"])
    write_yade(tmp_path, deck_of_nothing(declared))
    again, _ = read_back("yade", tmp_path / "yade_pour.py", tmp_path)
    same(declared, again, {**{body.name: body.name for body in declared.bodies}, "rigid_sieve_plate": "wall"})
    assert [body.name for body in again.bodies] == [body.name for body in declared.bodies]
    assert again.contact == declared.contact


def test_tables_for_edem_come_back(declared, tmp_path):
    scene = with_settings(declared, ["effect.rolling_resistance.rolling_friction=0.07"])
    folder = tmp_path / "tables"
    folder.mkdir()
    write_material_table(folder, scene)
    again, said = read_back("edem", folder, tmp_path)
    same(scene, again, {name: name for name in ("seed", "plate", "petiole", "rigid_sieve_plate")}, rel=1e-6)
    assert again.rig.wall == "rigid_sieve_plate"
    fractions = {body.name: body.mass_fraction for body in again.bodies}
    assert fractions == pytest.approx({body.name: body.mass_fraction for body in scene.bodies})
    assert numbers(again, "effect.rolling_resistance.rolling_friction") == [0.07]
    assert "bodies.csv: mass, moments" in said


@pytest.mark.parametrize(
    ("program", "text", "words"),
    [
        ("liggghts", "units micro\n", "units micro; allowed: si"),
        ("liggghts", "run 10\n", "no material found"),
        ("liggghts", "fix a all property/global youngsModulus peratomtype v_E\n", "'v_E' is not a number"),
        ("liggghts", "fix a all property/global coefficientFriction peratomtypepair 2 1 2 3\n", "allowed: 4"),
        ("yade", "FrictMat(young=open('x').read())\n", "line 1: FrictMat(young=open('x').read()): cannot be evaluated"),
        (
            "liggghts",
            LIGGGHTS
            + "fix pts2 all particletemplate/sphere 7 atom_type 1 density constant 1200 radius constant 1e-3\n",
            "density 1200, but that of another template of atom type1 is 2500; allowed: templates of one density",
        ),
        ("yade", "a = = 1\n", "line 1: is not Python"),
        ("yade", "FrictMat(young=1e7, poisson=0.9)\n", "poisson_ratio"),
        (
            "liggghts",
            "fix p all particletemplate/multisphere 1 spheres file c.txt mass 1 inertia_tensor 1 0 0 1 0 1\n",
            "spheres file c.txt: No such file",
        ),
        (
            "liggghts",
            "fix p all particletemplate/multisphere 1 spheres file /etc/passwd mass 1 inertia_tensor 1 0 0 1 0 1\n",
            "spheres file /etc/passwd; allowed: a file beside the script",
        ),
        ("edem", "maize, 1, 2\n", "no material found"),
        (
            "edem",
            "Material 1,Material 2,Coefficient of Rolling Friction\na,b,0.01\n",
            "no material found in edem's syntax",
        ),
        ("edem", "Material,Shear Modulus [Pa]\nmaize,stiff\n", "maize: shear_modulus: 'stiffPa'"),
        ("edem", "Material,Shear Modulus [psi]\nmaize,3\n", "psi"),
    ],
)
def test_a_bad_input_is_one_line(program, text, words, tmp_path):
    path = tmp_path / "input.txt"
    path.write_text(text, encoding="utf-8")
    line = refused(explorer("new", "material", "mine", f"--from-{program}", path, "--out", tmp_path))
    assert line.startswith(str(path))
    assert words in line
    assert not (tmp_path / "mine.toml").exists()


def test_one_input_at_a_time_and_for_a_material(tmp_path):
    path = tmp_path / "input.txt"
    assert "No such file" in refused(explorer("new", "material", "mine", "--from-yade", path, "--out", tmp_path))
    assert "--from-liggghts" in refused(explorer("new", "material", "mine", "--from-liggghts", path, "--like", "maize"))
    assert "No such option: --from-edem" in refused(explorer("new", "study", "mine", "--from-edem", path))


def test_tables_of_names_with_blanks_come_back(tmp_path):
    """Pairs and moduli are found by them; without, all of it would be assumed."""
    folder = tmp_path / "edem"
    folder.mkdir()
    scene = load_scene("glass_beads")
    bead, (body,) = scene.material("bead"), scene.bodies
    declared = dataclasses.replace(
        scene,
        materials=tuple(dataclasses.replace(one, name="my bead") if one is bead else one for one in scene.materials),
        bodies=(dataclasses.replace(body, name="round one", material="my bead"),),
        pairs=tuple(
            dataclasses.replace(p, a=p.a.replace("bead", "my bead"), b=p.b.replace("bead", "my bead"))
            for p in scene.pairs
        ),
    )
    write_material_table(folder, declared)
    again, _ = read_back("edem", folder, tmp_path)
    assert set(again.assumed) == {"body.round one.shape"}
    assert again.material("my_bead").shear_modulus == pytest.approx(bead.shear_modulus, rel=1e-6)
    assert again.contact_pair(again.bodies[0], again.bodies[0]).restitution == 0.97


def liggghts(*changes, more=""):
    """The script with replacements (old, new), and further lines."""
    text = LIGGGHTS
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text + more


@pytest.mark.parametrize(
    ("lines", "radius"),
    [
        ("variable q equal 0.001\nvariable r equal v_q*2", 0.002),
        ("variable r equal 0.003\nvariable r equal 0.002", 0.002),
        ("variable r index 0.002 0.5 0.7\nvariable r index 0.9", 0.002),
        ("variable q equal PI\nvariable r equal 0.002*PI/${q}", 0.002),
    ],
)
def test_liggghts_variables_stand_for_what_they_stand_for_there(lines, radius, tmp_path):
    scene, _ = imported("liggghts", liggghts(("variable r equal 0.0015   # radius", lines)), tmp_path)
    assert scene.bodies[0].extents[0] == pytest.approx(2.0 * radius)


def test_a_liggghts_variable_that_cannot_be_read_is_no_older_one(tmp_path):
    path = tmp_path / "in.txt"
    lines = "variable r equal 0.002\nvariable r equal sqrt(v_unknown)*1e-3"
    path.write_text(liggghts(("variable r equal 0.0015   # radius", lines)))
    line = refused(explorer("new", "material", "mine", "--from-liggghts", path, "--out", tmp_path))
    assert "radius" in line
    assert "sqrt" in line


def test_liggghts_atom_types_may_be_variables_and_are_whole_numbers(tmp_path):
    text = liggghts(("atom_type 1", "atom_type ${t}"), ("units si", "units si\nvariable t equal 1"))
    scene, _ = imported("liggghts", text, tmp_path)
    assert (scene.bodies[0].material, scene.rig.wall) == ("type1", "type2")
    path = tmp_path / "in.txt"
    path.write_text(liggghts(("atom_type 1", "atom_type 1.5")))
    line = refused(explorer("new", "material", "other", "--from-liggghts", path, "--out", tmp_path))
    assert "atom_type 1.5; allowed: a whole number from 1 on" in line


def test_a_liggghts_wall_of_the_poured_type_is_one(tmp_path):
    scene, _ = imported("liggghts", liggghts(("primitive type 2", "primitive type 1")), tmp_path)
    assert scene.rig.wall == "type1"


def test_liggghts_takes_both_spellings_of_its_properties(tmp_path):
    plain, _ = imported("liggghts", LIGGGHTS, tmp_path)
    (tmp_path / "mine.toml").unlink()
    text = liggghts(("peratomtypepair", "atomtypepair"), ("peratomtype", "atomtype"))
    scene, _ = imported("liggghts", text, tmp_path)
    assert (scene.materials, scene.pairs) == (plain.materials, plain.pairs)


def test_liggghts_templates_in_no_distribution_are_not_poured(tmp_path):
    more = "".join(
        f"fix pts{k} all particletemplate/sphere 1 atom_type 1 density constant 2500 radius constant 0.00{k}\n"
        for k in (2, 3)
    )
    text = liggghts(("1 pts1 1.0", "2 pts1 0.25 pts2 0.75"), more=more)
    scene, said = imported("liggghts", text, tmp_path)
    assert {body.name: body.mass_fraction for body in scene.bodies} == {"pts1": 0.25, "pts2": 0.75}
    assert "pts3: in no particledistribution, so not poured" in said


def test_a_liggghts_file_of_spheres_may_have_comments_and_further_columns(tmp_path):
    (tmp_path / "clump.txt").write_text("# x y z r\n\n-0.001 0 0 0.002 7  # left\n0.001 0 0 0.002 8\n")
    clump = "particletemplate/multisphere 1 atom_type 1 density constant 2500 nspheres 2 spheres file clump.txt "
    clump += "scale 1.0 mass 1e-4 inertia_tensor 1e-10 0 0 2e-10 0 2e-10"
    sphere = "particletemplate/sphere 15485863 atom_type 1 density constant 2500 radius constant ${r}"
    scene, _ = imported("liggghts", liggghts((sphere, clump)), tmp_path)
    assert np.array(scene.bodies[0].shape.centres).tolist() == [[-0.001, 0.0, 0.0], [0.001, 0.0, 0.0]]


@pytest.mark.parametrize(
    ("old", "new", "note"),
    [
        ("pair_style gran model", "pair_style hybrid gran model", "pair_style hybrid: no counterpart"),
        ("9.81 vector 0.0 0.0 -1.0", "9.81 chute 20", "fix gravity chute: only a vector is taken"),
    ],
)
def test_what_liggghts_says_otherwise_is_noted(old, new, note, tmp_path):
    _, said = imported("liggghts", liggghts((old, new)), tmp_path)
    assert note in said


@pytest.mark.parametrize(
    "given",
    ["material=beads", "material='beads'", "material=O.materials['beads']", "material=0", "material='my beads'"],
)
def test_a_yade_material_is_found_by_whatever_names_it(given, tmp_path):
    text = YADE.replace("material='beads'", given)
    text = text.replace("label='beads'", "label='my beads'") if "my" in given else text
    scene, _ = imported("yade", text, tmp_path)
    (body,) = scene.bodies
    assert body.material in ("beads", "my_beads")
    assert body.extents[0] == pytest.approx(4e-3)
    assert scene.rig.wall == "plate"


@pytest.mark.parametrize(
    ("lines", "young"),
    [
        ("young *= 2", 2e7),
        ("young: float = 3e7", 3e7),
        ("for young in (1e6, 2e6): pass", None),
        ("if phi: young = 5e6", None),
    ],
)
def test_a_yade_number_that_changes_is_followed_or_refused(lines, young, tmp_path):
    text = YADE.replace("beads = O", f"{lines}\nbeads = O")
    if young is not None:
        scene, _ = imported("yade", text, tmp_path)
        assert scene.materials[0].youngs_modulus == pytest.approx(young)
        return
    path = tmp_path / "in.py"
    path.write_text(text)
    line = refused(explorer("new", "material", "mine", "--from-yade", path, "--out", tmp_path))
    assert "FrictMat(young=young): cannot be evaluated" in line


def test_yade_gravity_may_be_a_vector_and_another_law_is_noted(tmp_path):
    text = YADE.replace("gravity=(0, 0, -9.81)", "gravity=Vector3(0, 0, -5)")
    text = text.replace("O.engines = [", "O.engines = [\n    Law2_ScGeom_FrictPhys_CundallStrack(),")
    scene, said = imported("yade", text, tmp_path)
    assert scene.gravity == (0.0, 0.0, -5.0)
    assert "Law2_ScGeom_FrictPhys_CundallStrack: another contact law" in said


def test_an_edem_column_that_is_no_name_is_noted(tmp_path):
    table = EDEM.replace("Material,Poisson's", "Material,Type,Poissons").replace("maize,0.4", "maize,Bulk,0.4")
    scene, said = imported("edem", table.replace("steel,0.3", "steel,Equipment,0.3"), tmp_path)
    assert scene.materials[0].poisson_ratio == 0.4
    assert "type: no counterpart, not taken" in said
