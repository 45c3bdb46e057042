"""Charts of the page: from every kind of result, whole or in part, and from every kind of diagnosis."""

import itertools
import json
import math

import numpy as np
import plotly.graph_objects as go
import pytest
from scipy import stats

from doe.studies.campaign import PartialStages, run_campaign
from doe.studies.study_result import StudyDescription
from explorer.report.diagnosis.charts import diagnosis_plots
from explorer.report.figures.effects import all_effects, errors_at_hand, main_effects, pareto_against
from explorer.report.figures.model import fitted_targets, prediction, profiler
from explorer.report.figures.pours import noise_of_estimators
from explorer.report.figures.style import short_rows, stacked
from explorer.report.figures.surface import height_over, residual_quantiles, solutions
from explorer.report.study_charts import study_plots
from explorer.study.process import PARTIAL
from explorer.study.run import PartialResult
from tests.doe.formula_runner import FormulaRunner
from tests.explorer import diagnosed, reported_studies
from tests.explorer.reported_studies import BIAS, PROFILE, STUDY, planted, typed

TITLES = (
    "Noise of the estimators", "Pareto of effects, by replicates", "Pareto of effects, by dummies", "Half-normal",
    "Main effects", "Effects with intervals", "Scan of an assumption", "Ascent path", "Contours",
    "Predicted and observed", "Residual quantiles", "Solution surface", "Posterior of the factors",
    "Optimum and its refits", "Ranges of the optimum", "Verification",
)  # fmt: skip


@pytest.fixture(scope="module")
def result():
    return typed(reported_studies.result_of_case("planted"))


@pytest.fixture(scope="module")
def fitted(result):
    return fitted_targets(result)[0]


@pytest.mark.parametrize("case", sorted(reported_studies.CASES))
def test_every_plot_of_every_kind_of_study_is_one_that_plotly_takes(case):
    found = reported_studies.result_of_case(case)
    plots = study_plots(typed(found))
    for title, plot in plots.items():
        spec = plot.make()
        assert spec is not None, title
        # plotly's own check of every name and value; JSON has no NaN.
        go.Figure(spec["data"], spec["layout"])
        json.dumps(spec, allow_nan=False)
        assert plot.caption
        assert 0.4 < plot.aspect < 3
    if case == "planted":
        assert [title for title in plots if "3-D" not in title] == list(TITLES)


def test_texts_of_a_study_cannot_bring_markup():
    found = typed(reported_studies.result_of_case("no assumptions, no scan"))
    specs = [plot.make() for plot in study_plots(found).values()]
    assert "<script>" not in json.dumps(specs)


@pytest.mark.parametrize("case", sorted(diagnosed.CASES))
def test_every_plot_of_every_kind_of_diagnosis_is_one_that_plotly_takes(case):
    plots = diagnosis_plots(diagnosed.typed(diagnosed.result_of_case(case)))
    assert next(iter(plots)) == "Probability of each answer"
    assert "Residuals before and after" in plots
    for plot in plots.values():
        spec = plot.make()
        go.Figure(spec["data"], spec["layout"])
        assert "<script>" not in json.dumps(spec, allow_nan=False)


def test_the_pareto_of_one_error_has_its_limits(result):
    part = result.screening
    assert errors_at_hand(part.analysis) == ["replicates", "dummies"]
    spec = pareto_against(part, ["dummies"])
    drawn = [shape["x0"] for shape in spec["layout"]["shapes"]]
    error = part.analysis.dummy_error
    assert drawn == [error.t_limit, error.t_limit_bonferroni]
    # Student's t, 95 %, two-sided; Bonferroni over the 24 factors.
    assert drawn == pytest.approx([stats.t.ppf(0.975, error.df), stats.t.ppf(1 - 0.025 / 24, error.df)])


def test_panels_in_a_row_become_panels_below_each_other(result):
    before = noise_of_estimators(result.pilot)
    after = stacked(before)
    panels = [key for key in before["layout"] if key.startswith("xaxis")]
    assert len(panels) == 3  # σ, d′ and bias, which share the axis of the estimators
    ends = [after["layout"][key.replace("x", "y", 1)]["domain"] for key in panels]
    assert all(low > following_high for (low, _), (_, following_high) in itertools.pairwise(ends))
    for trace, old in zip(after["data"], before["data"], strict=True):
        assert trace["x"] == old["x"]
        assert trace.get("yaxis", "y") == trace.get("xaxis", "x").replace("x", "y")
    (zero,) = after["layout"]["shapes"]  # the line of no bias, in the last panel
    assert (zero["xref"], zero["yref"]) == ("x3", "y3 domain")
    assert len(before["layout"]) < len(after["layout"])


def test_short_names_of_rows_keep_the_long_ones_for_the_hover(result):
    error = errors_at_hand(result.screening.analysis)[0]
    long = pareto_against(result.screening, [error])
    axis = short_rows(long)["layout"]["yaxis"]
    names = dict(zip(axis["tickvals"], axis["ticktext"], strict=True))
    assert names["X7 · static friction seed–seed"] == "X7"
    assert set(names) == set(long["data"][0]["y"])


def test_main_effects_differ_by_the_effect(result):
    analysis = result.screening.analysis
    spec = main_effects(result.screening)
    sizes = [trace["y"][1] - trace["y"][0] for trace in spec["data"]]
    assert [abs(size) for size in sizes] == sorted((abs(size) for size in sizes), reverse=True)
    by_name = {effect.name: effect.effect for effect in analysis.effects}
    assert sizes == pytest.approx([by_name[trace["name"]] for trace in spec["data"]])
    # planted(): friction between seeds acts most, 4 per unit of the coded level
    assert spec["data"][0]["name"] == "X7"
    assert np.mean(spec["data"][0]["y"]) == pytest.approx(analysis.mean)


@pytest.mark.parametrize("case", ["planted", "no assumptions, no scan"])
def test_each_mark_of_the_effects_chart_has_its_own_entry_in_the_legend(case):
    found = typed(reported_studies.result_of_case(case))
    traces = all_effects(found.screening, found.assumptions)["data"]
    # plotly gives the legend the symbol of a trace's first point, so a trace has one symbol for all its points.
    symbols = {trace["name"]: trace["marker"]["symbol"] for trace in traces if trace.get("showlegend", True)}
    assert all(isinstance(symbol, str) for symbol in symbols.values())
    assert len(set(symbols.values())) == len(symbols) == len(traces)
    drawn = {x: trace["marker"]["symbol"] for trace in traces for x in trace["x"]}
    for name, part in (("factors", found.screening), ("assumptions about the set-up", found.assumptions)):
        untestable = {entry.factor for entry in part.not_testable} if part else set()
        for effect in part.analysis.factor_effects() if part else []:
            meaning = f"{name}, not testable" if effect.name in untestable else name
            assert drawn[effect.effect] == symbols[meaning]


def test_half_the_interval_of_a_model_follows_from_the_leverage(fitted):
    model, at = fitted.model, fitted.model.points
    np.testing.assert_allclose(model.predict(at), model.predicted, rtol=1e-12)
    # leverage h = x'(X'X)⁻¹x, so half the interval is t sqrt(MSE h)
    expected = stats.t.ppf(0.975, model.df_residual) * np.sqrt(model.mse * model.leverage)
    np.testing.assert_allclose(model.half_width(at), expected, rtol=1e-9)
    np.testing.assert_allclose(model.region.coded(model.region.natural(at)), at, atol=1e-12)


def test_the_profiler_passes_through_the_point_and_shows_the_optimums_interval(fitted):
    point, found = fitted.chosen, fitted.optimum.single
    mean, half = prediction(fitted, point)
    assert mean == pytest.approx(found.predicted, abs=1e-6)
    assert [mean - half, mean + half] == pytest.approx([found.predicted_low, found.predicted_high], abs=1e-6)
    spec = profiler(fitted, point)
    traces = [trace for trace in spec["data"] if trace.get("name") == "here"]
    assert [trace["y"] for trace in traces] == [[pytest.approx(mean)]] * 3
    for row, (band, curve) in enumerate(zip(spec["data"][::3], spec["data"][1::3], strict=True)):
        n = len(curve["x"])
        assert np.interp(traces[row]["x"][0], curve["x"], curve["y"]) == pytest.approx(mean, abs=0.02)
        assert (np.array(band["y"][:n]) > curve["y"]).all()
        assert (np.array(band["y"][n:])[::-1] < curve["y"]).all()


def test_moving_one_factor_moves_the_traces_of_the_others_only(fitted):
    centre = fitted.model.region.centre.tolist()
    other = [fitted.high[0], *centre[1:]]
    before, after = profiler(fitted, centre), profiler(fitted, other)
    curves = [trace["y"] for trace in before["data"][1::3]], [trace["y"] for trace in after["data"][1::3]]
    assert curves[0][0] == curves[1][0]
    assert curves[0][1] != curves[1][1]


def test_the_solution_surface_lies_where_the_model_gives_the_target(fitted):
    sheet = solutions(fitted)["data"][0]
    assert sheet["isomin"] == sheet["isomax"] == fitted.target
    assert min(sheet["value"]) < sheet["isomin"] < max(sheet["value"])
    chosen = next(trace for trace in solutions(fitted)["data"] if trace["name"] == "chosen by rule")
    place = [trace[0] for trace in (chosen["x"], chosen["y"], chosen["z"])]
    near = np.linalg.norm(
        (np.column_stack([sheet["x"], sheet["y"], sheet["z"]]) - place)
        / np.ptp([sheet["x"], sheet["y"], sheet["z"]], axis=1),
        axis=1,
    )
    assert sheet["value"][int(near.argmin())] == pytest.approx(sheet["isomin"], abs=1.0)


def test_the_surface_in_space_passes_through_the_optimum(fitted):
    spec = height_over(fitted, (0, 1))
    sheet, runs, star = spec["data"]
    assert len(runs["z"]) == len(fitted.model.observed)
    assert star["z"] == [pytest.approx(fitted.optimum.single.predicted, abs=1e-6)]
    column = int(np.abs(np.array(sheet["x"]) - star["x"][0]).argmin())
    row = int(np.abs(np.array(sheet["y"]) - star["y"][0]).argmin())
    # half a grid cell of at most 12 ° per factor over 24 cells, on each side
    assert sheet["z"][row][column] == pytest.approx(star["z"][0], abs=0.6)


def test_residual_quantiles_are_those_of_t(fitted):
    spec = residual_quantiles(fitted)
    shown, df = spec["data"][1], fitted.model.df_residual
    n = len(shown["x"])
    assert shown["y"] == sorted(shown["y"])
    assert shown["x"][n // 4] == pytest.approx(stats.t.ppf((n // 4 + 0.5) / n, df - 1))


def test_a_study_that_still_runs_has_plots_of_what_it_has(tmp_path, monkeypatch):
    monkeypatch.setattr("doe.studies.campaign.SHARE", 1.0)
    partial = PartialResult(tmp_path, StudyDescription.of(STUDY, PROFILE))
    versions = []

    class Watched(FormulaRunner):
        def run(self, stage, settings):
            rows = super().run(stage, settings)
            for runs in rows:
                for one in runs:
                    follower.add(stage, one)
            return rows

    def show(stage, found):
        partial.show(stage, found)
        versions.append(json.loads((tmp_path / PARTIAL).read_text()))

    ticks = iter(range(10**6))
    follower = PartialStages(show, clock=lambda: 2.0 * next(ticks))
    run_campaign(STUDY, PROFILE, Watched(planted, sigma=2.0), BIAS, on_begin=follower.begin, on_result=partial.keep)
    assert {version["partial"] for version in versions} >= {"pilot", "screening", "surface", "verification"}
    for version in versions:
        for title, plot in study_plots(typed(version)).items():
            spec = plot.make()
            assert spec is not None, title
            json.dumps(spec, allow_nan=False)
    assert "over 2 seeds" in next(version["line"] for version in versions)
    assert not any("nan" in version["line"] for version in versions)
    in_surface = next(v for v in versions if v["partial"] == "surface")
    assert in_surface["optimum"] is None
    assert "Contours" in study_plots(typed(in_surface))
    assert "Verification" not in study_plots(typed(in_surface))
    whole = json.loads((tmp_path / PARTIAL).read_text())
    assert whole["partial"] is None
    assert math.isfinite(whole["verification"]["tests"][0]["simulated"]["mean"])
    partial.remove()
    assert not (tmp_path / PARTIAL).exists()
