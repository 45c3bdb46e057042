"""Settings become pours: seeds, replacement of failed runs, and reuse from the store."""

import dataclasses
import weakref
from contextlib import closing

import numpy as np
import pytest
import trimesh

from doe.pour_runner import TRIES, PourRunner, seed_of
from doe.run_records import Run, Setting, no_pile_shares, responses
from doe.store import Store, StoreError
from solver import load_material, pour_key, run_queue, with_rig, with_values
from solver.observables import OBSERVABLES, Observable, Value
from solver.rigs import Funnel
from solver.shapes.solid import Solid
from tests.solver.observables.made_up import empty_pile, record_of

TINY = {"body.spheres": "coarse", "rig.mass": "1.5g", "insertion.rate": "100g/s"}


def run_of(label, replicate, attempt, outcome, angle):
    return Run(label, replicate, attempt, 1, outcome, "", {"angle": angle}, 0.0, "")


def test_seeds_differ_and_repeat():
    seeds = {
        seed_of(1, stage, row, rep, tries)
        for stage in ("a", "b")
        for row in range(9)
        for rep in range(3)
        for tries in range(3)
    }
    assert len(seeds) == 2 * 9 * 3 * 3
    assert seed_of(1, "a", 2, 1, 0) == seed_of(1, "a", 2, 1, 0) != seed_of(2, "a", 2, 1, 0)


def test_seeds_of_the_own_rig_are_those_of_numpy_s_sequence_without_an_experiment():
    entropy = [3, *b"pilot", 2, 1, 0]
    assert seed_of(3, "pilot", 2, 1, 0) == np.random.SeedSequence(entropy).generate_state(1)[0]
    assert seed_of(3, "pilot", 2, 1, 0, "drum") != seed_of(3, "pilot", 2, 1, 0)


def test_a_failed_run_counts_for_the_no_pile_share_and_not_for_the_response():
    rows = [
        [run_of("r", 0, 0, "jammed", 99.0), run_of("r", 0, 1, "at_rest", 20.0), run_of("r", 1, 0, "at_rest", 22.0)],
        [run_of("s", 0, k, "jammed", 99.0) for k in range(3)],
    ]
    table = responses(rows, "angle")
    assert table[0].tolist() == [20.0, 22.0]
    assert np.isnan(table[1]).all()
    assert no_pile_shares(rows).tolist() == pytest.approx([1 / 3, 1.0])


@pytest.mark.usefixtures("taichi")
def test_pours_are_stored_reused_and_replaced(tmp_path):
    # Eight grams make a heap; a gram and a half lie flat.
    scene = with_values(load_material("sunflower_extract"), TINY | {"rig.mass": "8g"})
    store = Store(tmp_path / "runs.sqlite")
    seen = []
    runner = PourRunner(scene, store, "test", 4, on_run=lambda stage, run, left: seen.append((run, left)))
    settings = [
        Setting("good", {}, 2),
        Setting("never at rest", {"numerics.max_time": 0.1}, 1),
    ]
    first = runner.run("stage", settings)
    assert [run.outcome for run in first[0]] == ["at_rest", "at_rest"]
    assert [(run.outcome, run.attempt) for run in first[1]] == [("time_limit", k) for k in range(TRIES)]
    assert len({run.seed for run in first[1]}) == TRIES
    assert seen[-1][1] == 0
    assert len(list(store.runs("test"))) == 2 + TRIES

    again = runner.run("stage", settings)
    assert all(run.reused for runs in again for run in runs)
    assert [run.observables for run in again[0]] == [run.observables for run in first[0]]
    assert len(list(store.runs("test"))) == 2 + TRIES

    # The whole design once, then again; a replicate may be given more seeds later.
    assert [run.label for run, _ in seen[-5:]] == ["good", *["never at rest"] * TRIES, "good"]
    more = PourRunner(scene, store, "test", 4, tries=TRIES + 1).run("stage", settings)
    assert [run.attempt for run in more[1]] == list(range(TRIES + 1))
    assert [run.reused for run in more[1]] == [True] * TRIES + [False]


def made_up(queue, room):
    """In place of pours: an empty pile of each job."""
    while queue:
        yield queue.popleft(), record_of(empty_pile(), np.zeros(1), np.zeros(1), poured_mass=1.0)


def test_runs_that_are_yielded_are_not_kept(tmp_path):
    scene = with_values(load_material("sunflower_extract"), TINY)
    runner = PourRunner(scene, Store(tmp_path / "runs.sqlite"), "test", 1, pours=made_up, seeds=range(1, 6))
    before: list[weakref.ref[Run]] = []
    for _, run in runner.each("stage", [Setting("a", {}, 5)]):
        assert all(one() is None for one in before)
        before.append(weakref.ref(run))
    assert len(before) == 5


def test_every_experiment_is_poured_under_seeds_keys_and_labels_of_its_own(tmp_path):
    own = with_values(load_material("sunflower_extract"), TINY)
    drum = with_values(with_rig(load_material("sunflower_extract"), "rotating_drum"), {"body.spheres": "coarse"})
    settings = [
        Setting("both", {"pair.seed.seed.static_friction": 0.5}, 2, ("", "drum")),
        Setting("own", {"rig.outlet_height": 0.06}, 1),
    ]
    plain = [Setting(one.label, one.values, one.replicates) for one in settings]
    with closing(Store(tmp_path / "plain.sqlite")) as store:
        before = PourRunner(own, store, "test", 1, pours=made_up, tries=1).run("stage", plain)
    with closing(Store(tmp_path / "runs.sqlite")) as store:
        rows = PourRunner(own, store, "test", 1, pours=made_up, tries=1, experiments={"drum": drum}).run(
            "stage", settings
        )
        # The own rig's runs are what they were before there was another.
        kept = [[run for run in runs if not run.experiment] for runs in rows]
        assert [[(run.seed, run.key) for run in runs] for runs in kept] == [
            [(run.seed, run.key) for run in runs] for runs in before
        ]
        assert [(run.experiment, run.replicate, run.title) for run in rows[0]] == [
            ("", 0, "both"),
            ("", 1, "both"),
            ("drum", 0, "both, drum"),
            ("drum", 1, "both, drum"),
        ]
        assert [run.experiment for run in rows[1]] == [""]
        for run in rows[0][2:]:
            scene = with_values(drum, settings[0].values)
            assert run.seed == seed_of(1, "stage", 0, run.replicate, 0, "drum")
            assert run.key == pour_key(scene, run.seed)
            assert store.find(run.key).parameters["rig.name"] == "rotating_drum"
            assert {name.partition("/")[0] for name in run.observables} <= {"drum"}
        assert {run.label for run in store.runs()} == {"both", "both, drum", "own"}
        again = PourRunner(own, store, "test", 1, pours=never, tries=1, experiments={"drum": drum}).run(
            "stage", settings
        )
        assert [[(run.key, run.reused) for run in runs] for runs in again] == [
            [(run.key, True) for run in runs] for runs in rows
        ]


def never(queue, room):
    """In place of pours, where none may be run."""
    raise AssertionError(f"{len(queue)} pours were asked for")


@pytest.mark.usefixtures("taichi")
def test_a_new_observable_is_read_off_all_stored_pours_without_pouring(tmp_path, monkeypatch):
    scene = with_values(load_material("sunflower_extract"), TINY)
    with closing(Store(tmp_path / "runs.sqlite")) as store:
        settings = [Setting("good", {}, 3), Setting("rough", {"pair.seed.seed.static_friction": 0.9}, 2)]
        first = PourRunner(scene, store, "test", 1).run("stage", settings)
        poured = sum(len(runs) for runs in first)

        heaviest = Observable("heaviest_kg", "kg", "", lambda record: Value(record.bodies.mass.max(), "kg"), "record")
        monkeypatch.setitem(OBSERVABLES.things, heaviest.name, heaviest)
        monkeypatch.setattr(Funnel, "gives", (*Funnel.gives, heaviest.name))
        again = PourRunner(scene, store, "test", 1, pours=never).run("stage", settings)
        assert all(run.reused for runs in again for run in runs)
        flat = ([run for runs in rows for run in runs] for rows in (again, first))
        for run, other in zip(*flat, strict=True):
            assert run.observables["heaviest_kg"] == pytest.approx(max(body.mass for body in scene.bodies))
            assert {name: run.observables[name] for name in other.observables} == other.observables
        assert [run.observables.keys() >= {"heaviest_kg"} for run in store.runs()] == [True] * poured


def test_a_mesh_that_is_changed_while_it_is_poured_ends_the_study(tmp_path):
    """Which of the two was poured nobody can say, so it is kept under neither."""
    mesh = tmp_path / "grain.stl"
    trimesh.creation.box((9e-3, 7e-3, 6e-3)).export(mesh)
    scene = with_values(load_material("sunflower_extract"), TINY)
    bodies = tuple(dataclasses.replace(body, shape=Solid("mesh", file=str(mesh))) for body in scene.bodies)
    scene = dataclasses.replace(scene, bodies=bodies)

    def changed(queue, room):
        trimesh.creation.box((9e-3, 7e-3, 7e-3)).export(mesh)
        yield queue.popleft(), record_of(empty_pile(), np.zeros(1), np.zeros(1), poured_mass=1.0)

    with closing(Store(tmp_path / "runs.sqlite")) as store:
        with pytest.raises(StoreError, match="stage, good: a mesh file changed during the pour; start again"):
            PourRunner(scene, store, "test", 1, pours=changed).run("stage", [Setting("good", {}, 1)])
        assert list(store.runs()) == []


@pytest.mark.usefixtures("taichi")
@pytest.mark.parametrize("apart", [False, True], ids=["this process", "elsewhere"])
def test_who_watches_sees_how_every_pour_ends(tmp_path, apart):
    scene = with_values(load_material("sunflower_extract"), TINY)
    seen = []

    def watched(pours):
        def run(queue, room):
            for job, record in pours(queue, room):
                seen.append((job.seed, str(record.outcome)))
                yield job, record

        return run

    with closing(Store(tmp_path / "runs.sqlite")) as store:
        runner = PourRunner(scene, store, "test", 1, pours=run_queue if apart else None, tries=1, watched=watched)
        (runs,) = runner.run("pilot", [Setting("reference", {}, 2)])
    assert sorted(seen) == sorted((run.seed, run.outcome) for run in runs)
