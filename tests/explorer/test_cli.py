"""The command line: help, versions, refusals. Every refusal is one line and exit code 2, and leaves nothing behind."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from explorer.cli import app
from tests.explorer.command_line import explorer, refused

ROOT = Path(__file__).parents[2]
COMMANDS = [command.callback.__name__.replace("_", "-") for command in app.registered_commands if command.callback]


def test_help_answers_without_the_solver():
    program = (
        "import sys\nfrom explorer.cli import app\n"
        "try: app(['--help'], prog_name='explorer')\nexcept SystemExit as end: assert end.code == 0\n"
        "heavy = {'taichi', 'numpy', 'rerun', 'viser'} & set(sys.modules)\nassert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert all(name in done.stdout for name in COMMANDS)


@pytest.mark.parametrize(("given", "used"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")])
def test_small_matrices_are_left_to_one_thread_unless_the_user_says_otherwise(given, used):
    """It is set before NumPy is imported, which reads it then, and worker processes inherit it."""
    program = (
        "import os, sys\nfrom explorer import cli\n"
        "cli.app = lambda **_: print('numpy' in sys.modules, os.environ['OPENBLAS_NUM_THREADS'])\ncli.main()\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"} | given
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.stdout.split() == ["False", used], done.stderr


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_have_help(command):
    result = explorer(command, "--help")
    assert result.exit_code == 0
    assert result.stdout.startswith(f"Usage: explorer {command}")


def test_version():
    result = explorer("--version")
    assert result.exit_code == 0
    assert result.stdout.startswith("explorer ")


AT = "tcp://127.0.0.1:9"
"""An address where no scheduler is."""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["funnel", "--set", "rig.outlet_hight=65mm"], ["rig.outlet_hight", "rig.outlet_height"]),
        (["funnel", "--set", "pair.seed.gold.restitution=0.5"], ["pair.seed.gold", "seed.plate"]),
        (["funnel", "--set", "material.seed.poisson_ratio=0.7"], ["material.seed.poisson_ratio", "0 … 0.49"]),
        (["funnel", "--set", "rig.mass=-30g"], ["rig.mass", "-0.03 kg", "1e-05 … 10 kg"]),
        (["funnel", "--set", "rig.mass=nan"], ["rig.mass", "'nan'"]),
        (["funnel", "--set", "rig.mass=1e999"], ["rig.mass", "finite"]),
        (["funnel", "--set", "rig.outlet_height=2.5inch"], ["rig.outlet_height", "inch", "mm"]),
        (["funnel", "--set", "rig.outlet_diameter=15mm"], ["rig.outlet_diameter", "too narrow for a body"]),
        (["funnel", "--set", "insertion.protocol=throw"], ["insertion.protocol", "pour_through, fill_then_open"]),
        (["funnel", "--set", "rig.mass"], ["rig.mass", "path=value"]),
        (["cone"], ["cone", "funnel", "sunflower_extract"]),
        (["missing.toml"], ["missing.toml", "no such file"]),
        (["funnel", "--material", "gold"], ["gold", "sunflower_extract"]),
        (
            ["sunflower_extract", "--material", "sunflower_extract"],
            ["--material", "allowed only with the name of a rig"],
        ),
        (["funnel", "--seed", "-1"], ["--seed", "0"]),
        (["funnel", "--replicates", "0"], ["--replicates", "1"]),
        (["funnel", "--record", "pour.txt"], ["pour.txt", ".rrd"]),
        (["funnel", "--record", "no/such/folder/pour.rrd"], ["pour.rrd", "no folder"]),
        (["funnel", "--checkpoint", "."], ["--checkpoint", "is a folder; name a file"]),
        ([], ["RIG_OR_FILE"]),
        (["funnel", "--frobnicate"], ["--frobnicate"]),
        (["funnel", "--scheduler", AT, "--record", "pour.rrd"], ["--record", "leave out --scheduler"]),
        (["funnel", "--scheduler", AT, "--checkpoint", "pour.npz"], ["--checkpoint", "leave out --scheduler"]),
        (["inclined_plane", "--scheduler", AT], ["inclined_plane is a bench test", "--scheduler"]),
        (["inclined_plane", "--threads", "2"], ["inclined_plane is a bench test", "--threads"]),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_simulate_refuses(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = refused(explorer("simulate", *arguments, *(["--out", "result"] if arguments else [])))
    assert all(word in line for word in words), line
    assert list(tmp_path.iterdir()) == []


STUDY = 'format = 1\nmaterial = "sunflower_extract"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("format = 1\nmaterial = = 3\n", ["line 2"]),
        ('format = 2\nmaterial = "sunflower_extract"\n', ["format", "2"]),
        ("format = 1\n", ["material"]),
        ("format = 1\nmaterial = 7\n", ["material", "7"]),
        ('format = 1\nmaterial = "gold"\n', ["gold", "sunflower_extract"]),
        (STUDY + '[rig]\nname = "drum"\n', ["rig.name", "drum", "funnel"]),
        (STUDY + "[rig]\noutlet_hight = 0.065\n", ["rig.outlet_hight", "rig.outlet_height"]),
        (STUDY + "[rig]\nmass = -0.03\n", ["rig.mass", "1e-05 … 10 kg"]),
        (STUDY + "[insertion]\nrate = [1, 2]\n", ["insertion.rate"]),
        (STUDY + "rig = 3\n", ["rig", "table"]),
        ("format = 1\n[materials.grain]\ndensity = 1.0\n", ["body: missing"]),
        (STUDY + "[rigg]\nmass = 0.03\n", ["rigg", "unknown key", "rig"]),
        (STUDY + "[numerics]\nskin = '1kg'\n", ["numerics.skin", "mm"]),
        (STUDY + "dummies = 3\n[[target]]\nmean = 3\n", ["target.observable: missing"]),
    ],
)
def test_simulate_names_the_file_that_is_wrong(text, words, tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(text)
    line = refused(explorer("simulate", path))
    assert all(word in line for word in [str(path), *words]), line


def test_a_folder_with_something_in_it_is_left_alone(tmp_path):
    precious = tmp_path / "precious.txt"
    precious.write_text("keep me")
    assert "not empty" in refused(explorer("simulate", "funnel", "--out", tmp_path))
    assert [path.name for path in tmp_path.iterdir()] == ["precious.txt"]
    assert "is a file" in refused(explorer("simulate", "funnel", "--out", precious))
    assert precious.read_text() == "keep me"


@pytest.mark.parametrize(
    "command",
    [
        ["simulate", "funnel", "--replicates", "2"],
        ["calibrate", "--headless"],
        ["diagnose", "trefoil_2"],
        ["repeat", "funnel"],
        ["validate-diagnosis"],
        ["serve"],
    ],
    ids=lambda command: command[0],
)
def test_a_scheduler_that_is_none_or_of_no_use_is_refused_before_anything_is_made(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for address in (
        "127.0.0.1:8786",
        "tcp://host",
        "tcp://host:0",
        "tcp://host:70000",
        "inproc://host:1",
        "tcp://a b:1",
    ):
        line = refused(explorer(*command, "--scheduler", address))
        assert line == f"--scheduler {address}: allowed: tcp://HOST:PORT, or tls, ws, wss in place of tcp"
    if command[0] not in ("validate-diagnosis", "serve"):
        assert "--threads 2" in refused(explorer(*command, "--scheduler", AT, "--threads", 2))
    monkeypatch.setenv("EXPLORER_ARCH", "cuda")
    assert "not by --arch cuda" in refused(explorer(*command, "--scheduler", AT))
    assert list(tmp_path.iterdir()) == []


def test_an_existing_recording_is_left_alone(tmp_path):
    existing = tmp_path / "pour_2.rrd"
    existing.write_bytes(b"keep me")
    line = refused(
        explorer("simulate", "funnel", "--replicates", 2, "--record", tmp_path / "pour.rrd", "--out", tmp_path / "o")
    )
    assert "pour_2.rrd" in line
    assert existing.read_bytes() == b"keep me"
    assert [path.name for path in tmp_path.iterdir()] == ["pour_2.rrd"]


def test_refusal_in_a_process_of_its_own(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "explorer", "simulate", "funnel", "--set", "rig.mass=-1g", "--out", str(tmp_path / "o")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: --set: rig.mass: -0.001 kg is outside 1e-05 … 10 kg\n"
    assert list(tmp_path.iterdir()) == []


def test_parameters_lists_every_path():
    from solver import load_material, parameters

    result = explorer("parameters")
    assert result.exit_code == 0
    first_words = [line.split()[0] for line in result.stdout.splitlines()[1:]]
    assert first_words == list(parameters(load_material("sunflower_extract")))
    shear = next(line for line in result.stdout.splitlines() if "seed.shear_modulus" in line)
    assert shear.split()[1:3] == ["5.63e+07", "Pa"]
    assert "at once" in shear


def test_serve_passes_on_what_was_asked(monkeypatch):
    from solver import value

    seen: dict[str, Any] = {}
    monkeypatch.setattr(
        "explorer.viewer.app.serve", lambda project, scene, **others: seen.update(others, project=project, scene=scene)
    )
    result = explorer("serve", "--port", 0, "--seed", 7, "--set", "rig.outlet_height=70mm", "--scheduler", AT)
    assert result.exit_code == 0, result.output
    assert (seen["port"], seen["host"], seen["seed"], seen["scheduler"]) == (0, "127.0.0.1", 7, AT)
    assert value(seen["scene"], "rig.outlet_height") == 0.07
    assert seen["project"].study.name == "sunflower_extract.toml"


def test_serve_refuses_two_materials():
    line = refused(explorer("serve", "--study", "sunflower_extract", "--material", "sunflower_extract"))
    assert "name one of the two" in line


@pytest.mark.parametrize("option", [("--seed", 1), ("--store", "runs.sqlite"), ("--set", "rig.mass=1g")])
def test_a_recording_is_played_without_what_belongs_to_a_pour(option):
    assert "leave out the other options" in refused(explorer("serve", "--replay", "pour.rrd", *option))


def test_a_material_of_one_s_own_is_served_with_a_study_of_its_own_factors(monkeypatch, tmp_path):
    from doe.studies.study import load_study

    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert explorer("new", "material", "bean", "--out", tmp_path).exit_code == 0
    seen: dict[str, Any] = {}
    monkeypatch.setattr("explorer.viewer.app.serve", lambda project, scene, **others: seen.update(project=project))
    result = explorer("serve", "--material", tmp_path / "bean.toml")
    assert result.exit_code == 0, result.output
    study = load_study(str(seen["project"].study))
    assert "pair.grain.grain.static_friction" in [factor.path for factor in study.factors]
    assert study.scene.bodies == seen["project"].source.scene.bodies


def test_a_project_is_made_and_served(monkeypatch, tmp_path):
    folder = tmp_path / "lentil"
    made = explorer("new", "project", folder)
    assert made.exit_code == 0, made.output
    assert f"try it: explorer serve {folder}" in made.stdout
    seen: dict[str, Any] = {}
    monkeypatch.setattr("explorer.viewer.app.serve", lambda project, scene, **others: seen.update(project=project))
    assert explorer("serve", folder).exit_code == 0
    project = seen["project"]
    assert (project.title, project.study.name) == ("lentil", "lentil_study.toml")
    assert project.studies.is_relative_to(folder)
    assert "exists already" in refused(explorer("new", "project", folder))
    (folder / "project.toml").write_text('format = 1\nstudy = "gone.toml"\n', encoding="utf-8")
    assert f"{folder / 'project.toml'}: study: {folder / 'gone.toml'} does not exist" in refused(
        explorer("serve", folder)
    )
    assert "no such file" in refused(explorer("serve", tmp_path / "nowhere"))


def test_a_bug_keeps_its_traceback(monkeypatch):
    def broken(*arguments):
        raise ValueError("a mistake of the program")

    monkeypatch.setattr("explorer.scene.file.load_scene", broken)
    result = explorer("parameters")
    assert result.exit_code == 1
    assert isinstance(result.exception, ValueError)
