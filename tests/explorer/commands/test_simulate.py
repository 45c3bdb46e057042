"""`explorer simulate`: what it prints and writes is what the solver returned."""

import csv
import dataclasses
import json
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from explorer.files.run_result import simulation_result
from explorer.recordings.recording import FRAME_INTERVAL
from explorer.recordings.recording_reader import read_recording
from explorer.scene.file import load_scene, with_settings
from explorer.simulation import SimulateOrder, simulation_of
from solver import Outcome, run_pour, run_pours
from solver.observables import Value, observe
from tests.explorer.command_line import TINY, explorer, refused, settings
from tests.explorer.events import checked_events


@pytest.fixture(scope="module")
def simulation(taichi, tmp_path_factory):
    """Two seeds, once, with everything that the command can write: (result of the call, its folder)."""
    folder = tmp_path_factory.mktemp("simulate")
    result = explorer(
        *("simulate", "funnel", *settings(TINY), "--seed", 5, "--replicates", 2, "--json"),
        *("--out", folder / "run", "--record", folder / "pour.rrd"),
    )
    assert result.exit_code == 0, result.output
    return result, folder


@pytest.fixture(scope="module")
def record(taichi):
    """The first of the two pours, straight from the solver."""
    scene = with_settings(load_scene("funnel"), [f"{path}={value}" for path, value in TINY.items()])
    return run_pour(scene, 5)


def test_json_and_nothing_else_is_printed(simulation):
    result, folder = simulation
    printed = json.loads(result.stdout)
    assert result.stderr == ""
    assert printed == json.loads((folder / "run" / "result.json").read_text())


def test_the_numbers_are_the_solver_s(simulation, record):
    printed = json.loads(simulation[0].stdout)
    assert (printed["seed"], printed["seeds"]) == (5, [5, 6])
    assert (printed["outcome"], printed["message"]) == (record.outcome, record.message)
    assert printed["outcomes"] == {"time_limit": 2}
    assert (printed["dt"], printed["steps"]) == (record.dt, record.steps)
    for name, observed in observe(record).items():
        entry = printed["observables"][name]
        assert entry["unit"] == observed.unit
        # same bits from the same seed; what could not be measured is null
        assert entry["value"] == (observed.value if np.isfinite(observed.value) else None)
        assert printed["runs"][0]["observables"][name]["value"] == entry["value"]
        # neither pour came to rest: there is no mean over piles
        assert (entry["mean"], entry["sd"], entry["n"]) == (None, None, 0)
    assert None in {entry["value"] for entry in printed["observables"].values()}
    assert printed["parameters"]["rig.mass"] == {"value": 0.001, "unit": "kg"}
    assert set(printed["versions"]) == {"repose-explorer", "physics", "taichi", "numpy", "python"}
    assert printed["wall_s"] > 0.0


def test_the_folder_holds_the_run(simulation, record):
    folder = simulation[1] / "run"
    names = sorted(path.name for path in folder.iterdir())
    assert names == [
        *("parameters.toml", "pile_5.npz", "pile_6.npz", "result.json", "trace_5.csv", "trace_6.csv"),
    ]
    with (folder / "trace_5.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["time_s"]) for row in rows] == record.trace.time.tolist()
    assert [float(row["kinetic_energy_J"]) for row in rows] == record.trace.kinetic_energy.tolist()
    with np.load(folder / "pile_5.npz") as pile:
        assert np.array_equal(pile["xyz"], record.pile.spheres.centre)
        assert np.array_equal(pile["radius"], record.pile.spheres.radius)
        assert np.array_equal(pile["body"], record.pile.spheres.body)
    values = tomllib.loads((folder / "parameters.toml").read_text())
    assert values["body.spheres"] == "coarse"
    assert values["material.seed.shear_modulus"] == 56.3e6


def test_nothing_but_results_is_left(simulation):
    names = sorted(path.name for path in simulation[1].iterdir())
    assert names == ["pour_5.rrd", "pour_6.rrd", "run"]


def test_a_pour_loads_nothing_of_studies_measurements_and_reports():
    """These take over a second to load, of some three that a start takes."""
    code = """
import sys
from explorer.cli import main
sys.argv = ["explorer", "simulate", "funnel", "--set", "numerics.max_time=0.1s", "--json"]
try:
    main()
finally:
    late = {"scipy.stats", "scipy.optimize", "plotly", "PIL", "doe.studies", "doe.measurement", "explorer.report"}
    print(*sorted(late & set(sys.modules)), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert json.loads(done.stdout)["runs"]
    assert done.stderr.split() == []


def test_means_are_over_the_replicates_at_rest(record, monkeypatch):
    """Angles 10, 20, 30, 40° and one that could not be measured; the pour with 20° jammed."""
    angles = {1: 10.0, 2: 20.0, 3: 30.0, 4: 40.0, 5: float("nan")}
    monkeypatch.setattr(
        "explorer.files.run_result.observe", lambda record: {"angle": Value(angles[record.seed], "deg", 1.5)}
    )
    outcomes = {seed: Outcome.JAMMED if seed == 2 else Outcome.AT_REST for seed in angles}
    records = [dataclasses.replace(record, seed=seed, outcome=outcomes[seed]) for seed in angles]
    result = simulation_result(record.scene, records, wall_s=1.0)
    entry = result.observables["angle"]
    # by hand: mean of 10, 30, 40 is 80/3; sum of squares 1400/3, over n - 1 = 2
    assert entry.mean == pytest.approx(80.0 / 3.0, rel=1e-12)
    assert entry.sd == pytest.approx((700.0 / 3.0) ** 0.5, rel=1e-12)
    assert (entry.n, entry.value, entry.spread, entry.unit) == (3, 10.0, 1.5, "deg")
    assert result.outcomes == {"at_rest": 4, "jammed": 1}
    assert result.to_dict()["runs"][4]["observables"]["angle"] == {"value": None, "spread": 1.5}


def test_table_for_people(record, monkeypatch):
    monkeypatch.setattr("explorer.simulation.run_pours", lambda jobs, **options: iter([(0, record)]))
    result = explorer("simulate", "funnel", *settings(TINY), "--seed", 5)
    assert result.exit_code == 0
    heading, row, message = result.stdout.splitlines()[:3]
    assert heading.split()[:2] == ["seed", "outcome"]
    assert row.split()[:2] == ["5", "time_limit"]
    assert message.strip() == record.message
    assert "angle_of_repose_deg" in result.stdout


@pytest.mark.usefixtures("taichi")
def test_a_pour_that_diverges_leaves_a_scene_that_reproduces_it(tmp_path):
    wild = TINY | {"material.seed.shear_modulus": "10kPa", "insertion.drop_speed": "10m/s"}
    arguments = ("--seed", 3, "--events", "--out", tmp_path / "run")
    result = explorer("simulate", "funnel", *settings(wild), *arguments)
    _, pour, end = checked_events(result.stdout)
    assert (pour["run"]["outcome"], pour["scene"]) == ("overlap_limit", str(tmp_path / "run" / "diverged_3.toml"))
    assert (end["outcome"], end["result"]) == ("finished", str(tmp_path / "run" / "result.json"))
    assert f"to reproduce it: explorer simulate {pour['scene']} --seed 3\n" in result.stderr
    assert explorer("simulate", pour["scene"], "--seed", 3, "--out", tmp_path / "again").exit_code == 0
    first, again = (json.loads((tmp_path / name / "result.json").read_text()) for name in ("run", "again"))
    for key in ("outcome", "message", "steps", "parameters"):
        assert first[key] == again[key]
    assert first["runs"][0]["energy"] == again["runs"][0]["energy"]


def test_events_and_the_result_are_not_printed_together():
    assert "allowed: one of the two" in refused(explorer("simulate", "funnel", "--json", "--events"))


@pytest.mark.parametrize(("failure", "code"), [(KeyboardInterrupt, 130), (RuntimeError, 1)])
def test_a_run_that_breaks_off_leaves_no_folder(failure, code, tmp_path, monkeypatch):
    def broken(jobs, **options):
        raise failure

    monkeypatch.setattr("explorer.simulation.run_pours", broken)
    result = explorer("simulate", "funnel", "--out", tmp_path / "run")
    assert result.exit_code == code
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_pour_keeps_its_seed(monkeypatch):
    monkeypatch.setattr("explorer.simulation.read_checkpoint", lambda path: SimpleNamespace(seed=3))
    line = refused(explorer("simulate", "funnel", "--resume", "pour.npz", "--seed", 5))
    assert line == "--seed 5: the interrupted pour has the seed 3; leave out --seed"
    order = SimulateOrder(source="funnel", resume=Path("pour.npz"))
    assert list(simulation_of(order).seeds) == [3]
    assert list(simulation_of(dataclasses.replace(order, seed=3)).seeds) == [3]
    assert list(simulation_of(dataclasses.replace(order, resume=None)).seeds) == [1]


@pytest.mark.usefixtures("taichi")
def test_the_recordings_of_a_run_that_is_interrupted_are_named(tmp_path, monkeypatch):
    def interrupted(jobs, **options):
        yield next(pours(jobs, **options))
        raise KeyboardInterrupt

    pours = run_pours
    monkeypatch.setattr("explorer.simulation.run_pours", interrupted)
    result = explorer("simulate", "funnel", *settings(TINY), "--replicates", 2, "--record", tmp_path / "pour.rrd")
    assert result.exit_code == 130
    head, *files = result.stdout.splitlines()[-3:]
    assert head == "2 pours recorded:"
    # TINY ends after 0.1 s; a pour that is cut off lacks less than one interval between frames.
    for k, line in enumerate(files, start=1):
        path, length = line.split(": ")
        assert path == str(tmp_path / f"pour_{k}.rrd")
        times = read_recording(tmp_path / f"pour_{k}.rrd").times
        assert length == f"{times[-1] - times[0]:.3f} s, from {times[0]:.3f} to {times[-1]:.3f} s"
        assert 0.1 - FRAME_INTERVAL < times[-1] < 0.1 + FRAME_INTERVAL


def test_an_empty_folder_is_filled(record, tmp_path, monkeypatch):
    monkeypatch.setattr("explorer.simulation.run_pours", lambda jobs, **options: iter([(0, record)]))
    (tmp_path / "run").mkdir()
    assert explorer("simulate", "funnel", "--out", tmp_path / "run").exit_code == 0
    assert (tmp_path / "run" / "result.json").is_file()
    assert len(list(tmp_path.iterdir())) == 1
