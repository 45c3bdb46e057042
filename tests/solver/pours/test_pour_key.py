"""The key of a pour changes with all that decides its bits, and with nothing else."""

import dataclasses
import hashlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from solver import PHYSICS, load_material, pour_key, pour_keys, value, with_rig, with_values
from solver.arch import chosen
from solver.effects import EFFECTS
from solver.params import param
from solver.pours import pour_key as pour_key_module
from solver.scenes.body import Members
from solver.scenes.insertion import Insertion
from solver.scenes.numerics import Numerics
from solver.scenes.scene import parameters
from solver.shapes.solid import Solid
from tests.explorer.beads import bead_scene
from tests.solver.effects.cases import FELT

SCENE = load_material("sunflower_extract")
KEY = pour_key(SCENE, 1)
ROOT = Path(__file__).parents[3]


def test_equal_scenes_have_equal_keys():
    assert pour_key(load_material("sunflower_extract"), 1) == KEY
    assert re.fullmatch(r"[0-9a-f]{64}", KEY)


def test_seed_and_variant_count():
    assert len({KEY, pour_key(SCENE, 2), pour_key(SCENE, 1, "sticky"), pour_key(SCENE, 1, "misread")}) == 4


def test_keys_of_many_seeds_are_digests_of_one_json_text_each():
    described = pour_key_module._decisive(SCENE)
    texts = {s: json.dumps([PHYSICS, s, "wet", chosen(), described], sort_keys=True) for s in (0, 7, 2**32 - 1)}
    assert pour_keys(SCENE, texts, "wet") == {s: hashlib.sha256(text.encode()).hexdigest() for s, text in texts.items()}
    assert pour_keys(SCENE, [1]) == {1: KEY}


@pytest.mark.parametrize("rig", ["funnel", "rotating_drum"])
def test_every_parameter_counts(rig):
    """Each moved by a little, or to another choice; those of effects to where they are felt."""
    scene = with_rig(SCENE, rig)
    keys = {pour_key(scene, 1)}
    known = {path: one for path, one in parameters(scene).items() if not path.startswith("effect.")}
    changed = 0
    for path, one in known.items():
        now = value(scene, path)
        others = [o for o in (one.choices or (now * 0.99, now * 1.01, now + 0.01)) if o != now]
        for other in others:
            try:
                keys.add(pour_key(with_values(scene, {path: other}), 1))
            except ValueError:
                continue  # does not fit the rest of the scene
            changed += 1
            break
    assert changed > 0.9 * len(known)
    assert len(keys) == changed + 1


def test_every_effect_counts_and_one_that_is_off_does_not():
    felt = {pour_key(with_values(SCENE, {f"effect.{n}.{k}": x for k, x in FELT[n].items()}), 1) for n in EFFECTS}
    assert len(felt | {KEY}) == len(EFFECTS) + 1
    assert pour_key(with_values(SCENE, {"effect.rolling_resistance.rolling_friction": 0.0}), 1) == KEY


def test_the_revision_of_an_effect_counts_for_the_pours_in_which_it_acts(monkeypatch):
    acting = with_values(SCENE, {"effect.twisting.strength": 5.0})
    before = pour_key(acting, 1)
    monkeypatch.setattr(EFFECTS["twisting"], "revision", EFFECTS["twisting"].revision + 1)
    assert pour_key(acting, 1) != before
    assert pour_key(SCENE, 1) == KEY
    assert pour_key(with_values(SCENE, {"effect.twisting.strength": 0.0}), 1) == KEY


def test_titles_and_what_was_assumed_do_not_count():
    assert pour_key(dataclasses.replace(SCENE, title="renamed", assumed=("numerics.skin",)), 1) == KEY


def test_a_new_parameter_at_its_default_leaves_every_key_as_it_was():
    @dataclasses.dataclass(frozen=True)
    class MoreNumerics(Numerics):
        clump_share: float = param(0.0, doc="Another way to share the mass.")

    assert pour_key(dataclasses.replace(SCENE, numerics=MoreNumerics()), 1) == KEY
    assert pour_key(dataclasses.replace(SCENE, numerics=MoreNumerics(clump_share=0.5)), 1) != KEY
    assert pour_key(dataclasses.replace(SCENE, insertion=Insertion(rate=0.021)), 1) != KEY


def test_a_mesh_counts_by_its_contents_wherever_it_lies(tmp_path):
    shipped = ROOT / "assets/meshes/square_hopper.stl"
    for folder in ("one", "other"):
        (tmp_path / folder).mkdir()
        shutil.copy(shipped, tmp_path / folder / "grain.stl")

    def with_mesh(folder):
        solid = Solid("mesh", file=str(tmp_path / folder / "grain.stl"))
        bodies = tuple(dataclasses.replace(body, shape=solid) for body in SCENE.bodies)
        return pour_key(dataclasses.replace(SCENE, bodies=bodies), 1)

    key = with_mesh("one")
    assert with_mesh("other") == key
    with (tmp_path / "other/grain.stl").open("ab") as file:
        file.write(b" ")
    assert with_mesh("other") != key


def test_the_surface_that_is_drawn_over_declared_spheres_does_not_count(tmp_path):
    scene = bead_scene()
    (body,) = scene.bodies
    assert isinstance(body.shape, Members)
    drawn = dataclasses.replace(body.shape, drawn=Solid("sphere", (12e-3,)))
    assert pour_key(dataclasses.replace(scene, bodies=(dataclasses.replace(body, shape=drawn),)), 1) == pour_key(
        scene, 1
    )
    heavier = dataclasses.replace(body.shape, mass=2.0 * body.shape.mass)
    assert pour_key(dataclasses.replace(scene, bodies=(dataclasses.replace(body, shape=heavier),)), 1) != pour_key(
        scene, 1
    )


def test_docstrings_and_comments_of_the_solver_do_not_count(tmp_path):
    """In a copy of the program with every docstring of the solver's files reworded, the key is the same."""
    shutil.copytree(ROOT / "solver", tmp_path / "solver")
    shutil.copytree(ROOT / "assets/materials", tmp_path / "assets/materials")
    files = [path for path in (tmp_path / "solver").rglob("*.py") if path.read_text(encoding="utf-8").startswith('"""')]
    assert len(files) > 100
    for path in files:
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace('"""', '"""Reworded. ', 1) + "# a comment\n", encoding="utf-8")
    program = "import solver; print(solver.__file__, solver.pour_key(solver.load_material('sunflower_extract'), 1))"
    out = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env={"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True
    )
    file, key = out.stdout.split()
    assert file.startswith(str(tmp_path)), out.stderr
    assert key == KEY


def test_the_kind_of_processor_counts(monkeypatch):
    """Its bits are others: what was poured on a GPU is not the reference."""
    monkeypatch.setenv("EXPLORER_ARCH", "cuda")
    assert pour_key(SCENE, 1) != KEY
