"""`explorer verify`: the table, its exit code, and the file it writes."""

import json

import pytest

from explorer.tables.verification import HEADER, curves, furthest, result_of, summary_text, table_text
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
    ],
)
def test_refused(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = refused(explorer("verify", *arguments))
    assert all(word in line for word in words)
