"""`explorer verify`: the table, its exit code, and the file it writes."""

import json

import pytest

from explorer.terminal.verification import (
    HEADER,
    MISSED_ALONE,
    curves,
    furthest,
    peers_text,
    result_of,
    summary_text,
    table_text,
)
from solver.verification.row import of_value
from tests.explorer.command_line import explorer, refused


def point(ours, limit=1.0, quantity="depth", at=""):
    return of_value("T0", quantity, 2.0, ours, limit, "made up", at)


POINTS = [point(2.001, at="a"), point(2.1, at="b"), point(2.0, quantity="width"), point(3.0, None, "shown")]


def test_a_curve_is_one_line_with_its_furthest_point():
    assert [len(points) for points in curves(POINTS)] == [2, 1, 1]
    assert furthest(POINTS[:2]).at == "b"
    assert furthest([point(2.1), point(float("nan"), at="nan")]).at == "nan"
    header, depth, width, shown = table_text(POINTS, every_point=False).splitlines()
    assert all(title in header for title in HEADER)
    assert depth.split() == ["T0", "depth", "2", "b", "2", "2.1", "5", "1", "value", "NO"]
    assert width.split()[-1] == "yes"
    assert shown.split()[-4:] == ["50", "-", "value", "-"]
    assert len(table_text(POINTS, every_point=True).splitlines()) == 5


def test_the_summary_counts_curves_and_names_the_missed_ones():
    assert summary_text(POINTS).splitlines() == ["1 of 2 within their limits at every point", "missed: T0, depth"]


def test_plain_data_has_every_row_and_null_for_what_is_no_number():
    result = result_of([*POINTS, point(float("nan"))])
    assert result["ok"] is False
    assert [row["ok"] for row in result["rows"]] == [True, False, True, True, False]
    assert result["rows"][-1]["ours"] is result["rows"][-1]["error_percent"] is None
    json.dumps(result, allow_nan=False)


@pytest.mark.usefixtures("taichi")
def test_one_part_within_its_limits(tmp_path):
    path = tmp_path / "verification.json"
    result = explorer("verify", "--only", "ROLLING", "--only", "slope", "--json", path)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[-1] == "4 of 4 within their limits at every point"
    written = json.loads(path.read_text(encoding="utf-8"))
    assert written["ok"] is True
    assert written["versions"]["taichi"]
    assert {row["test"] for row in written["rows"]} == {"rolling", "slope"}


@pytest.mark.usefixtures("taichi")
def test_a_missed_limit_is_exit_code_one():
    result = explorer("verify", "--only", "T8", "--all")
    assert result.exit_code == 1
    assert result.stdout.splitlines()[-1] == "missed: T8, β, case B, tail"
    assert sum(line.startswith("T8") for line in result.stdout.splitlines()) == 20


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--only", "T9"], ["--only", "T9", "T1, T2", "slope"]),
        (["--json", "no/such/folder/x.json"], ["--json", "no folder"]),
        (["--json", "."], ["--json", "is a folder; name a file"]),
        (["--peer-limit", "5"], ["--peer-limit: allowed only with --peers"]),
    ],
)
def test_refused(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = refused(explorer("verify", *arguments))
    assert all(word in line for word in words)


def sticking(test, ours, at, limit=1.0):
    return of_value(test, "β, sticking", 2.0, ours, limit, "made up", at)


def test_what_ours_misses_stands_beside_the_other_engines_number():
    rows = [sticking("T4", 2.1, "a"), sticking("T4", 2.1, "b"), sticking("T5", 2.1, "a"), sticking("T5", 2.0, "b")]
    peer = [sticking("T4", 2.0, "a"), sticking("T4", 2.2, "b"), sticking("T5", 2.0, "a"), sticking("T5", 2.3, "b")]
    header, *lines = peers_text([*rows, point(2.1)], {"LIGGGHTS": peer}).splitlines()
    assert "LIGGGHTS keeps it" in header
    assert lines[0].split()[-7:] == ["2", "2.1", "5", "2", "0", "1", "yes"]
    assert lines[1].split()[-7:] == ["2", "2.1", "5", "2.2", "10", "1", "NO"]
    assert lines[3] == "of 4 points that LIGGGHTS ran too, ours misses 3: 1 with LIGGGHTS, 2 alone"
    assert lines[4:6] == ["by ours alone: T4: β, sticking, a", f"    {MISSED_ALONE['T4']}"]
    assert lines[6:8] == ["by ours alone: T5: β, sticking, a", "    no reason is known: a bug until one is"]
    assert lines[8:] == ["by LIGGGHTS alone: T5, β, sticking, b"]


def test_plain_data_has_the_other_engines_numbers():
    rows, peer = [sticking("T4", 2.1, "a"), point(2.0)], [sticking("T4", 2.04, "a")]
    first, second = result_of(rows, {"LIGGGHTS": peer})["rows"]
    assert first["peers"]["LIGGGHTS"] == {"value": 2.04, "error_percent": pytest.approx(2.0), "ok": False}
    assert "peers" not in second


def test_peers_without_an_engine_is_one_line(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    assert refused(explorer("verify", "--peers")) == "liggghts: not installed (Debian: apt install liggghts)"


def test_peers_needs_a_part_that_another_engine_can_run():
    assert "T4, T5, T6, T8" in refused(explorer("verify", "--only", "slope", "--peers"))


@pytest.mark.usefixtures("taichi")
@pytest.mark.peers("liggghts")
def test_peers_are_printed_and_written(tmp_path):
    path = tmp_path / "verification.json"
    result = explorer("verify", "--only", "T8", "--peers", "--json", path)
    assert result.exit_code == 1, result.output
    assert "of 20 points that LIGGGHTS ran too, ours misses 3: 3 with LIGGGHTS, 0 alone" in result.stdout
    rows = json.loads(path.read_text(encoding="utf-8"))["rows"]
    assert all("LIGGGHTS" in row["peers"] for row in rows)


def test_an_economy_that_does_not_exist_is_refused():
    result = explorer("verify", "--economy", "sunflower_extract", "--change", "magic")
    assert result.exit_code == 2
    assert "--change: 'magic' is not one of larger_steps, softer_grains" in result.stderr


@pytest.mark.parametrize("option", [("--pours", "10"), ("--profile", "quick"), ("--change", "x"), ("--store", "s")])
def test_what_belongs_to_an_economy_is_refused_without_one(option):
    assert "allowed only with --economy" in refused(explorer("verify", "--only", "T1", *option))
