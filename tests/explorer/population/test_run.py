"""``explorer repeat``: new seeds into the store, told as they come, and kept when it is cut off."""

import json
import signal
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest

from doe.analysis.t_tests import Sample
from doe.store import Store
from explorer.background.events import PROGRESS
from explorer.background.reporter import Reporter
from explorer.errors import CommandError
from explorer.population import run
from explorer.population.process import PopulationProcess
from explorer.population.run import PoursOrder, new_seeds, pour_more
from explorer.scene.file import load_scene
from solver import pour_key, with_values
from tests.explorer.background.waiting import wait_for
from tests.explorer.command_line import TINY, explorer, settings

SCENE = with_values(load_scene("funnel"), TINY)


def test_seeds_are_the_smallest_that_are_not_stored():
    assert new_seeds([2, 5, 900], 4) == (1, 3, 4, 6)
    assert new_seeds([], 2) == (1, 2)


@pytest.fixture(scope="module")
def poured(tmp_path_factory):
    """A store into which the command has poured twice."""
    folder = tmp_path_factory.mktemp("repeat")
    for k, pours in enumerate((2, 1)):
        more = ("--pours", str(pours), "--store", str(folder / "s.sqlite"), "--out", str(folder / f"out{k}"))
        assert explorer("repeat", "funnel", *settings(TINY), *more).exit_code == 0
    return folder


def test_more_pours_have_seeds_of_their_own_and_keys_like_any_pour(poured):
    store = Store(poured / "s.sqlite", pouring=False)
    runs = list(store.pours_of(SCENE))
    assert [run.seed for run in runs] == [1, 2, 3]
    assert all(store.find(pour_key(SCENE, seed)).seed == seed for seed in (1, 2, 3))
    store.close()


def test_progress_counts_the_pours(poured):
    lines = [json.loads(line) for line in (poured / "out0" / PROGRESS).read_text().splitlines()]
    assert [(line["event"], line["done"], line["planned"]) for line in lines] == [
        ("start", 0, 2),
        ("pour", 1, 2),
        ("pour", 2, 2),
        ("end", 2, 2),
    ]


def test_what_the_process_reads_is_what_the_command_has_poured(poured):
    found = PopulationProcess(poured / "pours", poured / "s.sqlite").read(SCENE, "residual_mass_kg")
    assert found.n + found.void == 3


def test_a_store_that_is_not_there_is_an_empty_population_and_stays_away(tmp_path):
    found = PopulationProcess(tmp_path / "pours", tmp_path / "none.sqlite").read(SCENE, "angle_of_repose_deg")
    assert (found.n, found.void) == (0, 0)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_with_something_in_it_is_refused(tmp_path):
    (tmp_path / "notes").write_text("mine")
    with pytest.raises(CommandError, match="not empty"):
        pour_more(PoursOrder(SCENE, 1, tmp_path, tmp_path / "s.sqlite"), Reporter("repeat", print))
    assert not (tmp_path / "s.sqlite").exists()


ASKED = "import sys, time, pathlib; pathlib.Path(sys.argv[sys.argv.index('--out') + 1]).mkdir(); time.sleep(60)"


@pytest.mark.parametrize("law", [{}, {"contact.law": "linear_spring_dashpot", "contact.clump_rule": "local_mass"}])
def test_the_page_hands_over_the_very_scene_and_can_cancel(law, tmp_path):
    scene = with_values(SCENE, law)
    program = (sys.executable, "-c", ASKED)
    process = PopulationProcess(tmp_path / "pours", tmp_path / "s.sqlite", program)
    process.start(scene, 8)
    assert process.status().alive
    with pytest.raises(ValueError, match="running already"):
        process.start(scene, 8)
    process.cancel()
    wait_for(lambda: not process.status().alive)
    assert process.status().state == "cancelled"
    (file,) = (tmp_path / "pours").glob("*.toml")
    assert pour_key(load_scene(str(file)), 5) == pour_key(scene, 5)


def test_a_scene_that_no_material_file_holds_is_refused(tmp_path):
    process = PopulationProcess(tmp_path / "pours", tmp_path / "s.sqlite", ("false",))
    with pytest.raises(ValueError, match="no material file holds"):
        process.start(replace(SCENE, axis=(1e-3, 0.0)), 8)


def test_cut_off_it_ends_in_order_and_keeps_what_is_there(tmp_path):
    store = tmp_path / "s.sqlite"
    command = [
        sys.executable,
        "-m",
        "explorer",
        "repeat",
        "funnel",
        *settings(TINY),
        "--pours",
        "200",
        "--store",
        str(store),
    ]
    process = subprocess.Popen([*command, "--threads", "1", "--out", str(tmp_path / "out")], stdout=subprocess.PIPE)
    progress = tmp_path / "out" / PROGRESS
    wait_for(lambda: process.poll() is not None or (progress.is_file() and len(progress.read_text().splitlines()) > 2))
    assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert process.returncode == 130
    kept = Store(store, pouring=False)
    assert 2 <= len(list(kept.pours_of(SCENE))) < 200
    kept.close()


def test_one_seed_has_no_standard_deviation(monkeypatch):
    one = SimpleNamespace(observable="angle_of_repose_deg", sample=Sample.of([24.5]), n=1, void=0)
    monkeypatch.setattr(run, "pour_more", lambda order, reporter: [one])
    said = explorer("repeat", "funnel", "--pours", "1").stdout.splitlines()
    assert said[-1].split() == ["angle_of_repose_deg", "24.5", "-", "1", "0"]
