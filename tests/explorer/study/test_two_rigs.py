"""The example study of two rigs, on a formula: its result, scenes, board, report, and what it is told to take."""

import json
import tomllib
from pathlib import Path

import jsonschema
import plotly.graph_objects as go
import pytest

from doe.stages import planned_runs
from doe.studies.campaign import run_campaign
from doe.studies.study import load_study, with_profile
from explorer.commands.schema import KINDS
from explorer.report import report_markdown
from explorer.report.figures.model import fitted_targets, profiler
from explorer.report.identified import settings
from explorer.report.sections import sections_of
from explorer.report.study_charts import study_plots
from explorer.study.duration import duration_text, reckoned_time, runs_of_scenes
from explorer.study.run import result_of
from explorer.study.run_scene import scene_of
from explorer.units import observed
from explorer.viewer.board.board import board_json
from explorer.viewer.board.study_board import listed_runs, study_board
from explorer.viewer.study.profiler_panel import prediction_markdown
from explorer.viewer.study.study_panel import target_markdown
from solver import value
from tests.doe.formula_runner import FormulaRunner
from tests.explorer.command_line import explorer
from tests.explorer.reported_studies import tables_in, typed

FILE = Path(__file__).parents[3] / "examples" / "two_rigs" / "grains_study.toml"
FRICTION, STEEL = "pair.grain.grain.static_friction", "pair.grain.steel.static_friction"
TRUTH = {FRICTION: 0.6, STEEL: 0.3}


def pile(values):
    """18.6° at the truth."""
    return 18.6 + 20.0 * (float(values.get(FRICTION, 0.5)) - 0.6) + 20.0 * (float(values.get(STEEL, 0.4)) - 0.3)


def drum(values):
    """45.7° at the truth."""
    return 45.7 + 5.0 * (float(values.get(FRICTION, 0.5)) - 0.6) + 40.0 * (float(values.get(STEEL, 0.4)) - 0.3)


@pytest.fixture(scope="module")
def study():
    return with_profile(load_study(str(FILE)), "quick")


@pytest.fixture(scope="module")
def result(study):
    runner = FormulaRunner(pile, sigma=0.4, experiments={"drum": {"dynamic_angle_deg": drum}})
    found = run_campaign(*study, runner, dict.fromkeys(study[0].estimators, ((0.0, 0.1),) * 3))
    return typed(json.loads(json.dumps(result_of(*study, found, 60.0).to_dict(), allow_nan=False)))


def test_the_example_is_a_valid_study_file():
    assert "study" in KINDS
    schema = json.loads(explorer("schema", "study").stdout)
    table = tomllib.loads(FILE.read_text(encoding="utf-8"))
    jsonschema.validate(table, schema)
    for spoil in ({"colour": 1}, {"rig": {"name": "bucket"}}, {"name": 3}):
        wrong = table | {"experiment": [table["experiment"][0] | spoil]}
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema)


def test_a_run_of_an_experiment_opens_in_its_own_rig(result):
    point = next(setting for setting in result.surface.settings if setting.label == "point 3")
    runs = {run.experiment: run for run in result.surface.runs[2]}
    scene = scene_of(result, "surface", runs["drum"])[0]
    assert scene.rig.name == "rotating_drum"
    assert scene_of(result, "surface", runs[""])[0].rig.name == "lifting_cylinder"
    assert value(scene, FRICTION) == pytest.approx(point.values[FRICTION])


def test_the_board_names_the_experiment_of_a_run_and_shows_what_all_targets_leave(result):
    board = study_board(result, None)
    assert board_json(board)
    table = board.tables[-1].table
    rows = {(row[1], row[2]): row for row in table.rows}
    name, run = "drum/dynamic_angle_deg", next(run for run in result.surface.runs[2] if run.experiment)
    assert rows["point 3, drum", str(run.seed)][4] == observed(name, run.observables[name])
    assert len(table.rows) == len(listed_runs(result))
    assert "dynamic angle" in table.caption
    plots = study_plots(result)
    for title in ("Targets over each other", "Posterior of the factors"):
        spec = plots[title].make()
        assert len(go.Figure(spec).data) == len(spec["data"]) > 0


def test_the_intervals_of_the_report_are_those_of_both_targets(result):
    assert result.optimum.posterior.p > 0.01
    known = {one.name: one.identified for one in settings(result.optimum)}
    for k, factor in enumerate(result.optimum.factors):
        if factor.path in TRUTH:
            assert known[factor.name]
            assert result.optimum.posterior.low[k] < TRUTH[factor.path] < result.optimum.posterior.high[k]
    titles = [section.title for section in sections_of(result)]
    assert titles.index("Reach") < titles.index("Screening")
    text = report_markdown(result)
    assert "Experiment drum: rotating drum" in text
    assert "In the experiment drum, " in text
    tables = tables_in(text)
    assert [row[0] for row in tables["factor", "parameter", "mean", "95 % interval", "of the region"]] == list(known)
    assert tables["target", "factor", "effect", "95 %", "p Holm"]


def test_the_profiler_goes_through_both_targets(result):
    targets = fitted_targets(result)
    here = targets[0].section_point
    for one in targets:
        assert len(go.Figure(profiler(one, here)).data) == 3 * len(one.factors)
    told = prediction_markdown(targets, here)
    assert told.count("target ") == 2
    assert "drum" in told
    assert "Also: " in target_markdown(result.study.targets, None)


def test_what_it_takes_counts_the_pours_of_every_experiment(study, tmp_path):
    one, profile = study
    counts = runs_of_scenes(one, profile)
    assert set(counts) == {"", "drum"}
    assert sum(counts.values()) == sum(planned_runs(one, profile).values())
    # Pilot, eight rows, the steps, fifteen points and the verification, once each in the drum.
    assert counts["drum"] == profile.pilot_runs + 8 + profile.ascent_steps + 15 + profile.verification_runs
    seconds = sum(n * reckoned_time(one, profile, name) for name, n in counts.items()) / sum(counts.values())
    said = duration_text(one, profile, tmp_path / "none.sqlite", 2)
    assert said.startswith(f"{sum(counts.values())} runs")
    assert f"({seconds:.0f} s a pour, from spheres and steps" in said
