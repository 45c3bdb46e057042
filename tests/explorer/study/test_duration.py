"""What a study takes is told before it starts, by what stored pours of its kind took."""

from dataclasses import replace

import pytest

from doe.stages import planned_runs
from doe.store import Store, StoredRun
from doe.studies.study import load_study, with_profile
from explorer.export import EXPORTS
from explorer.scene.pour_cost import PACE, PACES, SETTLING, SPHERE_GB, WORKER_GB, large_pour_text
from explorer.study.duration import duration_text
from solver import PHYSICS, ParameterError, body_counts, value, with_rig, with_values
from solver.pours.run import MOST_BODIES, sizes_for
from solver.rigs.funnel import Funnel
from solver.scenes.time_step import time_step
from solver.shapes.solid import Solid
from tests.explorer.command_line import explorer

STUDY = load_study("sunflower_extract")
QUICK, STANDARD = STUDY.profiles["quick"], STUDY.profiles["standard"]


@pytest.fixture
def store(tmp_path):
    """Four pours of the quick profile that took 2, 4, 6 and 8 s, and others that say nothing of it."""
    file = tmp_path / "runs.sqlite"
    kept = Store(file)
    rows = [(2.0, STUDY.name, "coarse", QUICK.mass), (4.0, STUDY.name, "coarse", QUICK.mass)]
    rows += [(6.0, STUDY.name, "coarse", QUICK.mass), (8.0, STUDY.name, "coarse", QUICK.mass)]
    rows += [(100.0, STUDY.name, "standard", QUICK.mass), (100.0, STUDY.name, "coarse", 2.0 * QUICK.mass)]
    rows += [(100.0, "another", "coarse", QUICK.mass)]
    for k, (wall_s, study, spheres, mass) in enumerate(rows):
        parameters = {"body.spheres": spheres, "rig.mass": mass}
        kept.add(
            StoredRun(
                f"{k}", study, "pilot", "reference", k, PHYSICS, "at_rest", "", parameters, 1, {}, 1e-5, 1, wall_s, b""
            )
        )
    kept.close()
    return file


def test_the_time_is_runs_times_mean_over_cores(store):
    runs = sum(planned_runs(STUDY, QUICK).values())
    said = duration_text(STUDY, QUICK, store, 2)
    # (2 + 4 + 6 + 8) s / 4 for every run, two at a time.
    assert f"about {runs * 5.0 / 2 / 60:.0f} min on 2 cores (5.0 s a pour, mean of 4 stored ones)" in said
    assert "0.5 GB" in said


def test_before_the_first_pours_it_is_reckoned_from_spheres_and_steps(store, tmp_path):
    scene = with_profile(STUDY, "standard")[0].scene
    spheres = sum(n * len(body.clump.radii) for n, body in zip(body_counts(scene), scene.bodies, strict=True))
    # 30 g at 20 g/s, then it settles.
    seconds = spheres * (1.5 + SETTLING) / time_step(scene) / PACES[Funnel]
    minutes = sum(planned_runs(STUDY, STANDARD).values()) * seconds / 2 / 60.0
    for file in (store, tmp_path / "none.sqlite"):
        said = duration_text(STUDY, STANDARD, file, 2)
        assert f"roughly {minutes:.0f} min on 2 cores ({seconds:.0f} s a pour, from spheres and steps" in said
    assert not (tmp_path / "none.sqlite").exists()


def test_a_drum_takes_its_filling_and_its_turns(tmp_path):
    drum = replace(STUDY, scene=with_rig(STUDY.scene, "rotating_drum"))
    scene = with_profile(drum, "standard")[0].scene
    counts = body_counts(scene)
    spheres = sum(n * len(body.clump.radii) for n, body in zip(counts, scene.bodies, strict=True))
    mass = sum(n * body.mass for n, body in zip(counts, scene.bodies, strict=True))
    turns = value(scene, "rig.transient_turns") + value(scene, "rig.averaging_turns")
    simulated = mass / value(scene, "insertion.rate") + SETTLING + 60.0 * turns / value(scene, "rig.speed_rpm")
    seconds = spheres * simulated / time_step(scene) / PACE
    said = duration_text(drum, STANDARD, tmp_path / "none.sqlite", 2)
    assert f"({seconds:.0f} s a pour, from spheres and steps" in said


def test_pours_in_another_rig_say_nothing_of_the_own_one(store):
    """Stored under the same study, with its shapes and mass: of another experiment."""
    before = duration_text(STUDY, QUICK, store, 2)
    kept = Store(store)
    parameters = {"rig.name": "lifting_cylinder", "body.spheres": "coarse", "rig.mass": QUICK.mass}
    kept.add(
        StoredRun(
            "other", STUDY.name, "pilot", "reference, lift", 9, PHYSICS, "at_rest", "", parameters, 1, {}, 1e-5, 1,
            500.0, b"",
        )
    )  # fmt: skip
    kept.close()
    assert duration_text(STUDY, QUICK, store, 2) == before


def test_a_study_whose_pilot_sizes_it_takes_at_least_that(store):
    sized = replace(QUICK, resolution_deg=2.0)
    assert duration_text(STUDY, sized, store, 2).startswith("at least ")
    assert "at least about" in duration_text(STUDY, sized, store, 2)


def test_a_profile_that_the_study_cannot_have_tells_no_time(tmp_path):
    said = duration_text(STUDY, replace(STANDARD, name="nobody's"), tmp_path / "none.sqlite", 2)
    assert "how long is told after the first pours" in said


def test_a_large_pour_is_told_beforehand_and_a_small_one_is_not():
    assert large_pour_text(STUDY.scene) == ""
    large = with_values(STUDY.scene, {"rig.mass": 5.0})
    spheres = sum(n * len(body.clump.radii) for n, body in zip(body_counts(large), large.bodies, strict=True))
    # It ends at its limit of time, before all are in.
    seconds = spheres * value(large, "numerics.max_time") / time_step(large) / PACES[Funnel]
    told = large_pour_text(large)
    assert told.startswith(
        f"{sum(body_counts(large))} bodies of {spheres} spheres: roughly {seconds / 60:.0f} min a pour"
    )
    assert told.endswith(f"{WORKER_GB + spheres * SPHERE_GB:.1f} GB of memory")


def test_an_export_tells_a_large_pour_before_it_pours(tmp_path, monkeypatch):
    """The deck's pour is replaced by nothing; a table of the material pours nothing, and tells nothing."""
    monkeypatch.setattr(type(EXPORTS["liggghts"]), "write", lambda *_: "a deck")
    large = ("funnel", "--set", "rig.mass=5kg")
    assert "bodies of" in explorer("export", *large, tmp_path / "deck", "--to", "liggghts").stderr
    assert "bodies of" not in explorer("export", *large, tmp_path / "table", "--to", "edem").stderr


def test_a_pour_of_too_many_bodies_is_refused_before_room_is_made_for_it():
    grain = replace(STUDY.scene.bodies[0], shape=Solid("sphere", (2e-4,)), mass_fraction=1.0)
    scene = with_values(replace(STUDY.scene, bodies=(grain,)), {"rig.mass": 5.0})
    with pytest.raises(ParameterError, match=rf"5 kg is \d+ bodies; allowed: up to {MOST_BODIES} in a pour"):
        sizes_for([scene], 1)
