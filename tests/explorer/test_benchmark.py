"""The benchmark's table, its figures from known measurements, and a short real run of each of our cases."""

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from explorer.benchmark import POUR, growth
from explorer.cli import app
from explorer.scene.file import load_scene
from explorer.tables.benchmark import result_of, table_text
from solver.benchmark import Measurement, measure_bed, measure_pour
from solver.benchmark.packed_bed import RADIUS, SPACING, Bed, Box

NAN = math.nan


def measured(case, engine, spheres, steps, wall, contacts=NAN):
    return Measurement(case, engine, spheres, spheres, steps, wall, 4.0, contacts, contacts)


TWO_BEDS = [
    measured("bed of 1000 spheres", "ours, nothing sleeps", 1000, 1000, 0.5, 2500.0),
    measured("bed of 1000 spheres", "liggghts 3.8", 1000, 1000, 1.0),
    measured("bed of 100000 spheres", "ours, nothing sleeps", 100_000, 10, 1.0, 250_000.0),
]


def test_figures_follow_from_the_measurement():
    ours = TWO_BEDS[0]
    assert ours.steps_per_s == 2000.0
    assert ours.sphere_steps_per_s == 2e6
    assert ours.ns_per_contact == pytest.approx(0.5 / 1000 / 2500 * 1e9)
    assert math.isnan(TWO_BEDS[1].ns_per_contact)


def test_growth_is_the_exponent_of_the_cost():
    """0.5 ms per step for 10³, 100 ms for 10⁵: the exponent is log 200 / log 100."""
    assert growth(TWO_BEDS) == pytest.approx(math.log(200.0) / math.log(100.0))
    assert math.isnan(growth(TWO_BEDS[:2]))


def test_ratio_is_that_of_steps_per_second_on_the_same_case():
    rows = result_of(TWO_BEDS)["measurements"]
    assert [row["ratio"] for row in rows] == [2.0, 1.0, None]
    lines = table_text(TWO_BEDS).splitlines()
    assert lines[1].split()[-1] == "2.00"
    assert lines[3].split()[-1] == "-"
    assert lines[-1].endswith("(number of spheres)^1.151")


def test_a_whole_pour_is_set_beside_the_peers_run():
    pours = [measured("pour to rest", "ours", 783, 1000, 5.0), measured("pour, 4 s", "liggghts 3.8", 783, 1000, 60.0)]
    assert "12.0 times as long" in table_text(pours)


@pytest.mark.usefixtures("taichi")
def test_a_pour_is_run_for_the_time_asked_for():
    scene = load_scene(POUR)
    run = measure_pour("pour", scene, 1, 0.2, sleeping=False)
    assert (run.bodies, run.spheres) == (87, 783)
    assert run.simulated_s == pytest.approx(0.2, rel=0.06)  # decisions fall on sample moments, every 10 ms
    assert run.simulated_s == pytest.approx(run.steps * 3.3e-6, rel=1e-3)
    assert run.wall_s > 0.0


@pytest.mark.usefixtures("taichi")
def test_a_bed_keeps_its_spheres_in_contact():
    """A square of spheres that overlap a little: every inner one has four neighbours and the floor."""
    n = 6
    distance = 1.999 * RADIUS
    places = [((i + 0.5) * distance, (j + 0.5) * distance, 0.9995 * RADIUS) for i in range(n) for j in range(n)]
    bed = Bed(Box(n * distance, n * distance), np.array(places), np.zeros((n * n, 3)))
    run = measure_bed(bed, 1)
    assert run.contacts == 2 * n * (n - 1) + n * n + 4 * n  # between spheres, with the floor, with the walls
    assert SPACING > 2 * RADIUS


@pytest.mark.parametrize(("failure", "code"), [(KeyboardInterrupt, 130), (RuntimeError("no room"), 1)])
def test_a_run_that_stops_keeps_what_it_has_measured(monkeypatch, tmp_path, failure, code):
    kept, seen = tmp_path / "bench.json", []

    def stops(options):
        seen.append(json.loads(kept.read_text()))
        raise failure
        yield

    cases = {"pour": lambda options: iter(TWO_BEDS[:2]), "bed": stops, "batch": lambda options: seen.append("batch")}
    monkeypatch.setattr("explorer.benchmark.CASES", cases)
    result = CliRunner().invoke(app, ["bench", "--json", str(kept)])
    assert result.exit_code == code
    found = json.loads(kept.read_text())
    # Kept before the next case begins; and nothing is run after the one that stopped.
    assert seen == [found]
    assert (found["complete"], [row["engine"] for row in found["measurements"]]) == (
        False,
        ["ours, nothing sleeps", "liggghts 3.8"],
    )
    assert list(tmp_path.iterdir()) == [kept]
    lines = result.stdout.splitlines()
    assert [line.split()[-1] for line in lines[1:3]] == ["2.00", "1.00"]
    assert lines[-1] == "incomplete: the run was stopped; measured so far: 2"


def test_a_run_to_its_end_is_complete(monkeypatch, tmp_path):
    monkeypatch.setattr("explorer.benchmark.CASES", {"bed": lambda options: iter(TWO_BEDS)})
    result = CliRunner().invoke(app, ["bench", "--json", str(tmp_path / "bench.json")])
    assert result.exit_code == 0
    found = json.loads((tmp_path / "bench.json").read_text())
    assert (found["complete"], len(found["measurements"])) == (True, 3)
    assert "incomplete" not in result.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--only", "race"], "'race' is not one of pour, bed, batch"),
        (["--spheres", "5"], "5 is not one of 1000, 10000, 100000"),
        (["--json", "/no/such/folder/x.json"], "no folder /no/such/folder"),
    ],
)
def test_bad_options_are_one_line(options, words):
    result = CliRunner().invoke(app, ["bench", *options])
    assert result.exit_code == 2
    assert words in result.output
    assert len(result.output.strip().splitlines()) == 1
