"""A factor that the target does not identify has a range that gives the target, and no 95 % set."""

import copy
import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from doe.studies.campaign import run_campaign
from explorer.design.analysis import AnalyseOrder, run_analyse
from explorer.laboratory.command_results import analysis_result
from explorer.report import report_html, report_markdown
from explorer.report.comparison import comparison
from explorer.report.content import Table
from explorer.report.design import design_markdown
from explorer.report.design.charts import design_plots
from explorer.report.figures.model import fitted_targets, ranges
from explorer.report.html import escaped
from explorer.report.sections.designs import effect_table, further_effects
from explorer.report.sections.optimum import optimum
from explorer.report.study_charts import study_plots
from explorer.study.for_ci import errors, junit
from explorer.units import MISSING, observable_label, observed, parameter_range, parameter_value, signed
from tests.explorer import reported_studies
from tests.explorer.command_line import explorer
from tests.explorer.reported_studies import typed

SET_TRACE = "95 % set of the optimum (bootstrap)"


@pytest.fixture(scope="module")
def open_study():
    """One whose target identifies none of its three factors."""
    result = reported_studies.result_of_case("planted")
    assert result["optimum"]["single"]["unidentified"] == ["X7", "X4", "X16"]
    return result


def identifying(result, *names):
    """The same result if the target identified the factors ``names``."""
    changed = copy.deepcopy(result)
    single = changed["optimum"]["single"]
    single["unidentified"] = [name for name in single["names"] if name not in names]
    return changed


def texts_of(optimum):
    """Factor → its 95 % set, the range that gives the target and the chosen value, as they are printed."""
    single = optimum["single"]
    return {
        factor["name"]: (
            parameter_range(factor["path"], single["point_low"][k], single["point_high"][k]),
            parameter_range(factor["path"], single["solution_low"][k], single["solution_high"][k]),
            parameter_value(factor["path"], optimum["values"][factor["path"]]),
        )
        for k, factor in enumerate(optimum["factors"])
    }


def lines_of(table):
    return "\n".join(" | ".join(row) for row in (*table.rows, (table.caption,)))


def traces(plots):
    return [trace["name"] for plot in plots.values() for trace in plot.make()["data"] if "name" in trace]


def test_the_terminal_shows_ranges_and_a_choice_where_nothing_is_identified():
    """Processes 2022, 10, 185, Table 8: one angle leaves all three factors open."""
    result = explorer("analyse", "sunflower_extract", "--target", 24.68)
    assert result.exit_code == 0
    found = run_analyse(AnalyseOrder("sunflower_extract", target=24.68)).optimum.to_dict()
    rows = {line[0]: re.split(r"\s{2,}", line) for line in result.stdout.splitlines() if " (chosen by rule)" in line}
    assert rows.keys() == {"A", "B", "C"}
    for name, (confidence_set, feasible, chosen) in texts_of(found).items():
        assert confidence_set not in result.stdout
        assert rows[name][2:4] == ["no", feasible]
        assert rows[name][5:7] == [f"{chosen} (chosen by rule)", "-"]
    assert rows["A"][3] == "48.99 … 58.34 MPa"
    assert "Chosen by rule: nearest the reference among the settings that give the target" in result.stdout
    assert "does not identify A, B, C: the model gives it with A in 48.99 … 58.34" in result.stdout


def test_the_page_and_the_report_of_a_design_say_the_same():
    order = AnalyseOrder("sunflower_extract", target=24.68)
    result = run_analyse(order)
    answer, markdown = analysis_result(order), design_markdown(result)
    page = answer.files["report.html"].decode()
    for confidence_set, feasible, chosen in texts_of(result.optimum.to_dict()).values():
        for text in (answer.text, markdown, page):
            assert escaped(confidence_set) not in text
            assert confidence_set not in text
        assert feasible in answer.text
        assert feasible in markdown
        assert f"{escaped(chosen)} (chosen by rule)" in page
    shown = traces(answer.plots)
    assert SET_TRACE not in shown
    assert "optimum" not in shown
    assert "chosen by rule" in shown
    optimum = replace(result.analysis.optimum, unidentified=())
    known = replace(result, analysis=replace(result.analysis, optimum=optimum))
    assert SET_TRACE in traces(design_plots(known))


def test_a_study_report_without_identified_factors_prints_no_95_percent_set(open_study):
    html, markdown = report_html(typed(open_study)), report_markdown(typed(open_study))
    for name, (confidence_set, feasible, chosen) in texts_of(open_study["optimum"]).items():
        assert confidence_set not in markdown
        assert confidence_set not in html
        assert escaped(confidence_set) not in html
        (row,) = re.findall(rf"^\| {name} \| [^|]* \| no \|.*$", markdown, re.MULTILINE)
        assert f"| **{feasible}** |" in row
        assert f"| {chosen} (chosen by rule) | – |" in row
        assert f"{feasible} (chosen by rule: {chosen})" in markdown  # in short
    assert "Chosen by rule: nearest the measured parameters among the settings that give the target" in markdown
    assert "The 95 % set and this share" not in markdown
    assert SET_TRACE not in html
    shown = traces(study_plots(typed(open_study)))
    assert "optimum" not in shown
    assert SET_TRACE not in shown


def test_a_study_report_with_every_factor_identified_prints_its_95_percent_sets(open_study):
    result = identifying(open_study, "X7", "X4", "X16")
    html, markdown = report_html(typed(result)), report_markdown(typed(result))
    for name, (confidence_set, feasible, chosen) in texts_of(result["optimum"]).items():
        (row,) = re.findall(rf"^\| {name} \| [^|]* \| yes \|.*$", markdown, re.MULTILINE)
        assert f"| {feasible} |" in row
        assert f"| {chosen} | {confidence_set} |" in row
        assert f") = {chosen}" in markdown  # in short
    for text in (html, markdown):
        assert not re.search("chosen by rule|rule's choice", text, re.IGNORECASE)
    assert SET_TRACE in html
    assert "The 95 % set and this share include the target's own standard error" in markdown


def test_of_some_identified_factors_only_these_have_a_95_percent_set(open_study):
    result = identifying(open_study, "X7")
    markdown = report_markdown(typed(result))
    shown = {name: confidence_set in markdown for name, (confidence_set, _, _) in texts_of(result["optimum"]).items()}
    assert shown == {"X7": True, "X4": False, "X16": False}
    spec = ranges(fitted_targets(typed(result))[0])
    bars = [trace["y"][0] for trace in spec["data"] if trace["name"] == SET_TRACE]
    assert bars == ["X7 · static friction seed–seed"]
    stars = {
        trace["name"]: [row[:3].strip() for row, x in zip(trace["y"], trace["x"], strict=True) if x is not None]
        for trace in spec["data"]
        if trace["name"] in ("optimum", "chosen by rule")
    }
    assert stars == {"optimum": ["X7"], "chosen by rule": ["X4", "X16"]}


def test_a_target_out_of_reach_identifies_nothing():
    result = reported_studies.result_of_case("out of reach")
    markdown = report_markdown(typed(result))
    assert not result["optimum"]["single"]["reached"]
    for confidence_set, _, chosen in texts_of(result["optimum"]).values():
        assert f"| no | – | – | ~~{chosen} (chosen by rule)~~ | – |" in markdown
        assert confidence_set not in markdown
    assert "Chosen by rule: where the model comes nearest the target" in markdown


def test_several_targets_have_a_rule_of_their_own():
    result = reported_studies.result_of_case("two targets")
    assert result["optimum"]["single"]["unidentified"]
    assert "Chosen by rule: the setting of least weighted misfit over all targets" in report_markdown(typed(result))


def test_two_studies_are_compared_by_what_each_identifies(open_study):
    known = identifying(open_study, "X7", "X4", "X16")
    tables = comparison(typed(open_study), typed(known), ("open", "known"))
    assert all(isinstance(table, Table) for table in tables)
    cells = {row[0]: row[1:] for row in tables[1].rows}
    for factor, (confidence_set, feasible, chosen) in zip(
        open_study["optimum"]["factors"], texts_of(open_study["optimum"]).values(), strict=True
    ):
        words = next(row for label, row in cells.items() if factor["path"].split(".")[-1].replace("_", " ") in label)
        assert words == (f"{feasible} (chosen by rule: {chosen})", f"{chosen} ({confidence_set})")


def test_a_study_of_several_targets_is_compared_by_each(open_study):
    several = typed(reported_studies.result_of_case("two targets"))
    findings = comparison(several, typed(open_study), ("two", "one"))[0]
    cells = {row[0]: row[1:] for row in findings.rows}
    one = open_study["study"]["targets"][0]["observable"]
    for target, test in zip(several.study.targets, several.verification.tests, strict=True):
        label = observable_label(target.observable)
        two, other = cells[f"{label}: verification"]
        assert two.startswith(observed(target.observable, test.simulated.mean))
        assert (other == MISSING) == (target.observable != one), target.observable
        assert cells[f"{label}: verdict"][0] == test.verdict


def test_an_automatic_check_limits_the_error_of_every_target():
    result = reported_studies.result_of_case("two targets")
    for test, percent in zip(result["verification"]["tests"], (1.0, 7.0), strict=True):
        test["relative_error_percent"] = percent
    several = typed(result)
    assert [bool(one.fault(5.0)) for one in errors(several)] == [False, True]
    cases = ElementTree.fromstring(junit(several, (), 5.0)).findall("testcase")
    assert [case.find("failure") is not None for case in cases] == [False, True]
    label = observable_label(several.study.targets[1].observable)
    assert errors(several)[1].fault(5.0) == f"{label}: relative error 7.00 % is above the limit of 5 %"


def test_the_progress_of_a_study_calls_the_point_chosen_by_rule():
    study, profile, runner = reported_studies.CASES["planted"]
    found = run_campaign(study, profile, runner, reported_studies.BIAS).stages.optimum
    line, single = found.line, found.single
    assert line.startswith("chosen by rule: ")
    for name, low, high in zip(single.names, single.solution_low, single.solution_high, strict=True):
        assert f"{name} in {low:.4g} … {high:.4g}" in line


def test_effects_stand_in_the_unit_that_their_title_names():
    """A height in metres: its effects are read in millimetres, as the title says."""
    part = typed(reported_studies.result_of_case("planted")).screening

    def in_metres(analysis):
        shrunk = [
            replace(one, effect=1e-3 * one.effect, sum_of_squares=1e-6 * one.sum_of_squares) for one in analysis.effects
        ]
        return replace(analysis, effects=tuple(shrunk))

    height = replace(
        part,
        response="apex_height_m",
        analysis=in_metres(part.analysis),
        target_analysis=in_metres(part.target_analysis),
        further_analyses={"apex_height_m": in_metres(part.target_analysis)},
    )
    assert "apex height [mm]" in effect_table(height).caption
    for seen, same in zip(effect_table(height).rows, effect_table(part).rows, strict=True):
        assert (seen[3], seen[8], seen[10]) == (same[3], same[8], same[10])
    largest = max(part.target_analysis.factor_effects(), key=lambda one: abs(one.effect))
    rows = {row[1]: row for row in further_effects(height).rows}
    assert rows[largest.name][0] == "apex height [mm]"
    assert rows[largest.name][2] == signed(largest.effect)


def test_of_several_targets_no_sentence_calls_the_chosen_setting_that_of_one():
    several = typed(reported_studies.result_of_case("two targets"))
    single, values = several.optimum.single, list(several.optimum.values.values())
    assert values != single.point.tolist()
    section = optimum(several)
    assert section.blocks[0].text.startswith("By the angle of repose, silhouette alone: of all settings at which the ")
    assert "this one is nearest" not in section.blocks[0].text
    spec = next(block for block in section.blocks if getattr(block, "name", "") == "cloud").spec
    star = next(trace for trace in spec["data"] if trace["marker"].get("symbol") == "star")
    assert star["x"] == [pytest.approx(values[0])]


def test_the_ranges_of_several_targets_are_those_of_their_table():
    several = typed(reported_studies.result_of_case("two targets"))
    found, fitted = several.optimum, fitted_targets(several)[0]
    drawn = [trace for trace in ranges(fitted)["data"] if trace["name"] == "95 % interval by all targets"]
    told = [parameter_range(path, one.low, one.high) for path, one in found.estimates.items()]
    assert [trace["hovertemplate"].removesuffix("<extra></extra>").partition(": ")[2] for trace in drawn] == told
    assert "range that gives the target" not in {trace["name"] for trace in ranges(fitted)["data"]}
    alone = replace(fitted, optimum=replace(found, posterior=None))
    names = {trace["name"] for trace in ranges(alone)["data"]}
    assert "range that gives the target, first target alone" in names
    assert study_plots(several)["Optimum and its refits"].caption.endswith(
        "The refits are of the first target alone, the star is the setting of all targets."
    )


def test_a_study_of_a_share_is_compared_in_numbers_that_say_something():
    """Of a plain number two places would cut away what there is."""
    result = typed(reported_studies.result_of_case("planted"))
    part = result.screening
    small = [replace(one, effect=1e-4 * one.effect) for one in part.analysis.effects]
    part = replace(part, response="own:share []", analysis=replace(part.analysis, effects=tuple(small)))
    both = (replace(result, screening=part),) * 2
    rows = comparison(*both, ("one", "other"))[2].rows
    assert not any(row[1].startswith(("+0.00 ", "−0.00 ")) for row in rows)
