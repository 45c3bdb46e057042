"""The benchmark's table, its figures from known measurements, and a short real run of each of our cases."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from explorer import benchmark
from explorer.benchmark import POUR, Options, growth
from explorer.cli import app
from explorer.export.run import PeerTimeout
from explorer.scene.file import load_scene
from explorer.terminal.benchmark import fallen, markdown, result_of, table_text
from solver.benchmark import (
    RADIUS,
    SPACING,
    Bed,
    BenchmarkResult,
    Box,
    measure_bed,
    measure_pour,
    shuffled,
    side_by_side,
)

NAN = math.nan


def measured(case, engine, spheres, steps, wall, contacts=NAN):
    return BenchmarkResult(case, engine, spheres, spheres, steps, wall, 4.0, contacts, contacts)


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


ROUNDS = [
    measured("short pour, 0.5 s", engine, 261, steps, wall)
    # The second round finds a machine that is half as fast: both take longer, the ratio stays.
    for walls in ((1.0, 4.0), (2.0, 8.0), (1.0, 5.0))
    for engine, steps, wall in zip(("ours", "liggghts 3.8"), (3000, 1000), walls, strict=True)
]
MACHINE = {
    "date": "2026-01-02",
    "cpu": "Some CPU",
    "cores": 2,
    "system": "Linux",
    "versions": {"Taichi": "1.7"},
    "load_before": 0.3,
    "load_after": 1.0,
}


def test_a_ratio_is_the_median_of_those_within_a_round():
    ours, theirs = result_of(ROUNDS)["measurements"]
    assert ours["rounds_ratio"] == [12.0, 12.0, 15.0]
    assert (ours["ratio"], ours["wall_s"], theirs["wall_s"]) == (12.0, 1.0, 5.0)
    assert table_text(ROUNDS).splitlines()[1].split()[-1] == "12.00"


def test_the_pour_to_rest_is_compared_with_the_peers_pour_of_four_seconds():
    pours = [
        measured("pour to rest", "ours", 783, 1000, 1.0),
        measured("pour, 4 s", "ours", 783, 1000, 2.0),
        measured("pour, 4 s", "liggghts 3.8", 783, 100, 2.0),
    ]
    assert [row["ratio"] for row in result_of(pours)["measurements"]] == [20.0, 10.0, 1.0]


def test_the_page_for_docs_has_date_machine_ranges_and_what_is_asked():
    slept = [measured("pour to rest", "ours", 783, 1000, 1.0), measured("pour, 4 s", "liggghts 3.8", 783, 100, 2.0)]
    page = markdown([*ROUNDS, *slept], MACHINE, False, ["--only short"])
    assert "`explorer bench --only short`, 2026-01-02, stopped before its end." in page
    assert "Machine: Some CPU, 2 cores, Linux." in page
    assert "Versions: Taichi 1.7, 3.8." in page
    assert "| short pour, 0.5 s | ours | 3 | 333.3 (333.3–666.7) | 12.00 (12.00–15.00) |  |" in page
    assert "| pour to rest | ours | 1 | 1000 | 20.00 | 22 |" in page


def test_engines_take_turns_and_one_that_times_out_has_no_second_turn(monkeypatch):
    """The runs are counted, not timed: either no time is too long, or every time is."""
    quick = measured("case", "ours", 1, 1, 1.0)
    late = BenchmarkResult("case", "yade", 1, 1, 0, 60.0, 0.0, NAN, NAN, timed_out=True)
    monkeypatch.setattr("explorer.benchmark.LONG", math.inf)
    turns = list(benchmark._in_turn(Options(4.0, (), (), rounds=4), [lambda: quick, lambda: late]))
    assert [one.engine for one in turns] == ["ours", "yade", "ours", "ours", "ours"]
    monkeypatch.setattr("explorer.benchmark.LONG", -1.0)
    assert [len(list(benchmark._in_turn(Options(4.0, (), (), rounds=n), [lambda: quick]))) for n in (1, 4)] == [1, 3]


def test_a_peer_that_does_not_end_is_printed_as_timed_out(monkeypatch):
    def never(folder, limit):
        raise PeerTimeout(f"stopped after {limit:g} s")

    monkeypatch.setattr(benchmark, "run_yade", never)
    run = benchmark._peer_run("case", "yade", lambda folder, what: None, None, (87, 783), 1e-6, 60.0)
    rows = [measured("case", "ours", 783, 1000, 1.0), run(), measured("case", "liggghts 3.8", 783, 1000, 2.0)]
    lines = table_text(rows).splitlines()
    assert "timed out after 60 s" in lines[2]
    assert lines[1].split()[-1] == "2.00"
    assert lines[2].split()[-1] == "-"
    yade = result_of(rows)["measurements"][1]
    assert (yade["timed_out"], yade["steps_per_s"], yade["ratio"]) == (True, None, None)
    json.dumps(result_of(rows), allow_nan=False)
    assert "timed out after 60 s" in markdown(rows, MACHINE, True, [])


def test_a_ratio_that_has_fallen_by_a_tenth_is_a_warning():
    before = {"measurements": [{"case": "short pour, 0.5 s", "engine": "ours", "ratio": 13.3}]}
    assert fallen(ROUNDS, before, "docs/x.json")[0].startswith("1 ratios to LIGGGHTS compared with docs/x.json: none")
    before["measurements"][0]["ratio"] = 13.4
    (line,) = fallen(ROUNDS, before, "docs/x.json")
    assert line == (
        "warning: short pour, 0.5 s, ours: 12.00 times as fast as LIGGGHTS, 10 % less than the 13.40 of docs/x.json"
    )


def test_a_fallen_ratio_is_printed_and_the_exit_code_stays_zero(monkeypatch, tmp_path):
    committed, page = tmp_path / "before.json", tmp_path / "page.md"
    rows = [{"case": "short pour, 0.5 s", "engine": "ours", "ratio": 99.0}]
    committed.write_text(json.dumps({"measurements": rows}))
    monkeypatch.setattr("explorer.benchmark.CASES", {"short": lambda options: iter(ROUNDS)})
    result = CliRunner().invoke(app, ["bench", "--against", str(committed), "--table", str(page), "--rounds", "3"])
    assert result.exit_code == 0
    assert result.stdout.splitlines()[-1].startswith("warning: short pour, 0.5 s, ours: 12.00 times")
    assert "`explorer bench --rounds 3`, 20" in page.read_text()


def test_ci_finds_the_committed_ratio_of_the_short_pour():
    root = Path(__file__).parents[2]
    (line,) = [line for line in (root / ".ci/run").read_text().splitlines() if "explorer bench" in line]
    name = line.split("--against ")[1].split()[0]
    rows = {(row["case"], row["engine"]): row for row in json.loads((root / name).read_text())["measurements"]}
    assert rows[f"short pour, {benchmark.SHORT:g} s", "ours"]["ratio"] > 1.0


def test_a_bed_is_numbered_at_random_and_stays_the_same_bed():
    places = np.arange(300.0).reshape(100, 3)
    bed = Bed(Box(1.0, 1.0), places, 2.0 * places)
    found = shuffled(bed, 1)
    assert (found.velocities == 2.0 * found.centres).all()
    assert (np.sort(found.centres[:, 0]) == places[:, 0]).all()
    # Neighbours in number are 33 apart on average; in the order of their places they are 1 apart.
    assert np.abs(np.diff(found.centres[:, 0])).mean() > 3 * 20
    assert (shuffled(bed, 1).centres == found.centres).all()


def test_copies_stand_side_by_side():
    bed = Bed(Box(2.0, 3.0), np.array([[0.5, 0.5, 0.1], [1.5, 2.5, 0.1]]), np.ones((2, 3)))
    wide = side_by_side(bed, (2, 1))
    assert wide.box == Box(4.0, 3.0)
    assert wide.centres[:, 0].tolist() == [0.5, 1.5, 2.5, 3.5]
    assert not wide.velocities.any()


@pytest.mark.usefixtures("taichi")
def test_a_pour_is_run_for_the_time_asked_for():
    scene = load_scene(POUR)
    run = measure_pour("pour", scene, 1, 0.2, sleeping=False)
    assert (run.bodies, run.spheres) == (87, 783)
    assert run.simulated_s == pytest.approx(0.2, rel=0.06)  # decisions fall on sample moments, every 10 ms
    assert run.simulated_s == pytest.approx(run.steps * 3.3e-6, rel=1e-3)
    assert run.wall_s > 0.0
    twice = measure_pour("pour", scene, 1, 0.2, sleeping=False, times=2)
    assert (twice.steps, twice.simulated_s) == (2 * run.steps, 2 * run.simulated_s)


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
        (["--only", "race"], "'race' is not one of short, pour, bed, batch"),
        (["--spheres", "5"], "5 is not one of 1000, 10000, 100000, 1000000"),
        (["--json", "/no/such/folder/x.json"], "no folder /no/such/folder"),
        (["--table", "/tmp"], "is a folder; name a file"),
        (["--table", "/no/such/folder/x.md"], "no folder /no/such/folder"),
        (["--against", "/no/such/x.json"], "not what --json of this command writes"),
    ],
)
def test_bad_options_are_one_line(options, words):
    result = CliRunner().invoke(app, ["bench", *options])
    assert result.exit_code == 2
    assert words in result.output
    assert len(result.output.strip().splitlines()) == 1


@pytest.mark.parametrize(("option", "value", "case"), [("--spheres", "1000", "pour"), ("--duration", "1", "bed")])
def test_an_option_of_a_case_that_is_left_out_is_refused(option, value, case):
    result = CliRunner().invoke(app, ["bench", "--only", case, option, value])
    assert result.exit_code == 2
    assert result.stderr.splitlines()[-1].startswith(f"error: {option}: applies to the case")
