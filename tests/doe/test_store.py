"""The store keeps every run and finds it again by what was run, and by nothing else."""

import csv
import dataclasses
import io

import pytest

from doe.store import Store, StoredRun, StoreError, run_key, write_csv
from solver import load_material, with_values

RUN = StoredRun(
    key="k1",
    study="s",
    stage="pilot",
    label="reference",
    seed=7,
    code_version="0+abc",
    outcome="at_rest",
    message="",
    parameters={"rig.mass": 0.03, "body.spheres": "coarse"},
    observables={"angle_of_repose_deg": 21.5, "residual_mass_kg": None},
    dt=1e-6,
    steps=10,
    wall_s=0.5,
)


def test_a_run_comes_back_as_it_went_in(tmp_path):
    store = Store(tmp_path / "new folder" / "runs.sqlite")
    store.add(RUN)
    store.close()
    again = Store(tmp_path / "new folder" / "runs.sqlite").find("k1")
    assert dataclasses.replace(again, created=0.0) == RUN
    assert again.created > 1.6e9


def test_two_connections_see_each_others_runs(tmp_path):
    one, two = Store(tmp_path / "r"), Store(tmp_path / "r")
    one.add(RUN)
    assert two.find("k1") is not None
    assert two.find("k2") is None


def test_the_key_changes_with_anything_that_changes_the_bits():
    scene = load_material("sunflower_extract")
    key = run_key(scene, 1, "v")
    assert key == run_key(load_material("sunflower_extract"), 1, "v")
    assert key != run_key(scene, 2, "v")
    assert key != run_key(scene, 1, "w")
    assert key != run_key(with_values(scene, {"pair.seed.seed.restitution": 0.571}), 1, "v")
    assert key != run_key(with_values(scene, {"body.spheres": "coarse"}), 1, "v")


def test_a_file_that_is_no_store_is_one_clear_line(tmp_path):
    wrong = tmp_path / "notes.txt"
    wrong.write_text("this is not a database, " * 100)
    with pytest.raises(StoreError, match=r"notes\.txt: cannot be used"):
        Store(wrong)


def test_csv_has_a_column_per_parameter_and_observable(tmp_path):
    store = Store(tmp_path / "r")
    store.add(RUN)
    store.add(dataclasses.replace(RUN, key="k2", study="other", observables={"apex_height_m": 0.02}))
    out = io.StringIO()
    assert write_csv(store.runs(), out) == 2
    rows = list(csv.DictReader(io.StringIO(out.getvalue())))
    assert rows[0]["angle_of_repose_deg"] == "21.5"
    assert rows[0]["residual_mass_kg"] == ""
    assert rows[1]["apex_height_m"] == "0.02"
    assert rows[1]["rig.mass"] == "0.03"
    assert [run.key for run in store.runs("other")] == ["k2"]
