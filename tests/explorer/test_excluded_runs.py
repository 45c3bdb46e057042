"""Runs left out of a finished study: the refit, the file beside the result, the table, and what the board says."""

from dataclasses import replace

import numpy as np
import pytest

from doe.analysis.surface import fit_surface
from doe.errors import StatisticsError
from doe.run_records import responses
from doe.studies.exclusion import ExcludedRun, optimum_without
from explorer.errors import CommandError
from explorer.study.excluded_runs import FILE, keep_excluded, load_excluded
from explorer.viewer.board.study_board import study_board
from explorer.viewer.tables.runs_page import REASON, excluded_runs, run_rows
from tests.explorer.reported_studies import CASES, result_of_case, typed


@pytest.fixture(scope="module")
def result():
    return typed(result_of_case(next(iter(CASES))))


def left_out(result, count):
    """The first runs of the surface, one of each setting."""
    return [ExcludedRun.of(runs[0], "spilled") for runs in result.surface.runs[:count]]


@pytest.mark.parametrize("case", list(CASES))
def test_with_every_run_the_answer_is_that_of_the_study(case):
    """The refit is the study's own: nothing but the exclusion can move the answer."""
    result = typed(result_of_case(case))
    again = optimum_without(result, ())
    assert again.values == result.optimum.values
    assert again.single.statement == result.optimum.single.statement


def test_without_a_run_the_answer_is_that_of_the_model_of_the_others(result):
    excluded = left_out(result, 2)
    table = responses(result.surface.runs, result.surface.observables[0])
    for k in range(2):
        table[k, result.surface.runs[k][0].replicate] = np.nan
    model = fit_surface(np.asarray(result.surface.design), table, result.surface.region)
    point = np.array([optimum_without(result, excluded).values[factor.path] for factor in result.surface.factors])
    target = result.study.targets[0].mean
    assert abs(model.predict(result.surface.region.coded(point)) - target) < 1e-3 * abs(target)
    assert optimum_without(result, excluded).values != result.optimum.values


def test_another_pour_with_the_same_seed_is_not_left_out(result):
    """Continued with other ranges, "point 1" is another scene, though its seeds are the same."""
    excluded = left_out(result, 1)
    row = tuple(replace(run, key=f"other {run.key}") for run in result.surface.runs[0])
    other = replace(result, surface=replace(result.surface, runs=(row, *result.surface.runs[1:])))
    assert optimum_without(other, excluded).values == other.optimum.values
    assert not any(table.title == "Runs left out" for table in study_board(other, None, excluded=excluded).tables)
    assert optimum_without(result, excluded).values != result.optimum.values


def test_without_any_run_there_is_no_model(result):
    every = [ExcludedRun.of(run, "all") for row in result.surface.runs for run in row]
    with pytest.raises(StatisticsError):
        optimum_without(result, every)
    tables = {one.title: one.table for one in study_board(result, None, excluded=every).tables}
    assert tables["Parameters without these runs"].rows[0][0].startswith("no model: ")


def test_what_is_left_out_is_kept_with_its_reasons(result, tmp_path):
    assert load_excluded(tmp_path) == ()
    excluded = [*left_out(result, 1), ExcludedRun.of(result.surface.runs[3][0], 'wedged; "see film", 12 ü')]
    keep_excluded(tmp_path, result, excluded)
    assert list(load_excluded(tmp_path)) == excluded
    with pytest.raises(CommandError, match="no run of the response surface"):
        keep_excluded(tmp_path, result, [ExcludedRun("point 1", "", -1, "k", "x")])
    assert list(load_excluded(tmp_path)) == excluded
    keep_excluded(tmp_path, result, [])
    assert load_excluded(tmp_path) == ()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a,b\n",
        "label,experiment,seed,reason\np,,one,x\n",
        "label,experiment,seed,key,reason\np,,one,k,x\n",
        "label,experiment,seed,key,reason\np,,1,k,\n",
    ],
)
def test_a_file_of_another_kind_is_refused_in_a_line(tmp_path, text):
    (tmp_path / FILE).write_text(text)
    with pytest.raises(CommandError) as refused:
        load_excluded(tmp_path)
    assert "\n" not in str(refused.value)


def test_a_file_of_an_older_version_is_known_by_its_seeds(result, tmp_path):
    run = result.surface.runs[0][0]
    (tmp_path / FILE).write_text(f"label,experiment,seed,reason\n{run.label},{run.experiment},{run.seed},spilled\n")
    (one,) = load_excluded(tmp_path)
    assert one.is_of(run)
    assert not one.is_of(replace(run, seed=run.seed + 1))
    assert optimum_without(result, (one,)).values != result.optimum.values


def test_the_table_gives_back_what_a_person_writes(result):
    excluded = left_out(result, 1)
    rows = run_rows(result, excluded)
    assert len(rows) == sum(map(len, result.surface.runs))
    assert excluded_runs(result, rows[::-1]) == excluded
    rows[1][REASON] = "  too \n wet "
    assert [one.reason for one in excluded_runs(result, rows)] == ["spilled", "too wet"]
    with pytest.raises(CommandError, match="not the runs of the study"):
        excluded_runs(result, rows[1:])
    rows[1][REASON] = "x" * 201
    with pytest.raises(CommandError, match="allowed: up to 200"):
        excluded_runs(result, rows)


def test_the_board_says_both_answers_and_why(result):
    titles = [one.title for one in study_board(result, None).tables]
    assert "Runs left out" not in titles
    tables = {one.title: one.table for one in study_board(result, None, excluded=left_out(result, 1)).tables}
    assert tables["Runs left out"].rows[0][2] == "spilled"
    answers = tables["Parameters without these runs"]
    assert answers.header == ("Factor", "Parameter", "All runs", "Without")
    assert len(answers.rows) == len(result.surface.factors)
    assert any(row[2] != row[3] for row in answers.rows)
