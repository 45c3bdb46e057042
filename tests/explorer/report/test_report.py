"""Reports of studies with a planted truth: every number on the page is the one in the result, and nothing is hidden."""

import copy
import csv
import dataclasses
import io
import json
import math
import re

import plotly.graph_objects as go
import pytest

from doe.record import RecordError
from doe.run_records import valid_values
from explorer.report import report_html, report_markdown, write_report
from explorer.report.content import Figure, Folded, Table
from explorer.report.html import embedded
from explorer.report.sections import sections_of
from explorer.report.sections.designs import row_table
from explorer.report.sections.surface import equation
from explorer.study.for_ci import errors, summary
from explorer.units import p_value
from solver import asset_path
from tests.explorer.reported_studies import CASES, HOSTILE, result_of_case, table, typed, visible

pytestmark = pytest.mark.usefixtures("unprinted")


@pytest.fixture(scope="module")
def studies():
    """The content of the file of every made-up study, by its case."""
    return {name: result_of_case(name) for name in CASES}


@pytest.fixture(params=CASES)
def result(request, studies):
    return studies[request.param]


def figures_of(result):
    def walk(blocks):
        for block in blocks:
            if isinstance(block, Folded):
                yield from walk(block.blocks)
            elif isinstance(block, Figure):
                yield block

    return {figure.name: figure.spec for section in sections_of(typed(result)) for figure in walk(section.blocks)}


def charts_in(page):
    """Chart name → specification, parsed from the page itself."""
    found = re.findall(r'<figure id="([^"]+)"><script type="application/json">(.*?)</script>', page, re.DOTALL)
    return {name: json.loads(text) for name, text in found}


def as_number(cell):
    """First number of a cell."""
    return float(re.search(r"[-+]?[\d.]+(e-?\d+)?", cell.replace("−", "-"))[0])


def trace(spec, name):
    return next(entry for entry in spec["data"] if entry["name"] == name)


# Every variant


def test_every_section_and_chart_is_on_the_page(result):
    page = report_html(typed(result))
    text = visible(page)
    for section in sections_of(typed(result)):
        assert section.blocks
        assert section.title in text
    assert charts_in(page).keys() == figures_of(result).keys()
    expected = {"noise", "effects", "half-normal", "pareto", "ascent", "contours-1", "fit-1", "cloud", "ranges"}
    assert expected | {"verification-1"} <= charts_in(page).keys()


def test_no_missing_number_leaks_into_the_text(result):
    for text in (visible(report_html(typed(result))), report_markdown(typed(result))):
        assert not re.search(r"\b(nan|NaN|None|inf|null|undefined|True|False)\b", text)
        assert "{" not in text


def test_a_target_of_zero_has_no_relative_error(studies):
    result = copy.deepcopy(studies["two targets"])
    for target in (result["study"]["targets"][1], result["verification"]["targets"][1]):
        target["mean"] = 0.0
    result["verification"]["tests"][1]["relative_error_percent"] = None
    found = typed(result)
    texts = [visible(report_html(found)), report_markdown(found), found.verification.line, summary(found, ())]
    assert not any(re.search(r"\b(nan|inf)\b", text, re.IGNORECASE) for text in texts)
    assert [one.fault(5.0) for one in errors(found)][1].endswith("cannot be told: the target is 0, or no pour is valid")


def test_middle_levels_of_a_screening_are_no_low_ones(studies):
    screening = typed(studies["planted"]).screening
    design = screening.design.copy()
    design[0] = 0.0
    levels = [row[1] for row in row_table(dataclasses.replace(screening, design=design)).rows]
    assert levels[0] == f"`{'0' * design.shape[1]}`"
    assert set(levels[1]) == set("`+−")


def test_page_loads_nothing_from_elsewhere(result):
    page = re.sub(r'<script id="plotly"[^>]*>.*?</script>', "", report_html(typed(result)), flags=re.DOTALL)
    assert len(page) < 1_500_000
    assert not re.search(r"https?:|//cdn|@import|url\(", page)
    assert not re.search(r"<(script|img|link|iframe)[^>]+(src|href)=", page)
    assert all(link.startswith("#") for link in re.findall(r'href="([^"]*)"', page))


def test_page_stays_below_five_megabytes(result):
    assert len(report_html(typed(result)).encode()) < 5e6


def test_charts_are_valid_for_plotly(result):
    for spec in figures_of(result).values():
        drawn = go.Figure(spec)  # raises ValueError for an unknown or malformed property
        assert 0 < len(drawn.data) == len(spec["data"])
        assert json.loads(json.dumps(spec, allow_nan=False))["data"]


def test_tables_are_rectangular(result):
    def walk(blocks):
        for block in blocks:
            if isinstance(block, Table):
                assert block.rows
                assert {len(row) for row in block.rows} == {len(block.header)}
            elif isinstance(block, Folded):
                walk(block.blocks)

    for section in sections_of(typed(result)):
        walk(section.blocks)


def test_effects_chart_shows_factors_and_assumptions_with_their_intervals(result):
    spec = figures_of(result)["effects"]
    parts = {"factors": result["screening"], "assumptions about the set-up": result["assumptions"]}
    for name, part in parts.items():
        factors = [e for e in part["analysis"]["effects"] if not e["is_dummy"]] if part else []
        shown = [entry for entry in spec["data"] if entry["name"].startswith(name)]
        bars = {x: bar for entry in shown for x, bar in zip(entry["x"], entry["error_x"]["array"], strict=True)}
        assert sorted(bars) == sorted(effect["effect"] for effect in factors)
        for effect in factors:
            error = part["analysis"]["pure_error"] or part["analysis"]["dummy_error"]
            test = effect["by_replicates"] or effect["by_dummies"]
            assert bars[effect["effect"]] == error["t_limit"] * test["standard_error"]


def test_markdown_table_of_effects_holds_the_result(result):
    rows = {row[0].removesuffix(" †"): row for row in table(result, "factor", "parameter", "low … high")}
    effects = [effect for effect in result["screening"]["analysis"]["effects"] if not effect["is_dummy"]]
    assert len(rows) == len(effects) == 24
    for effect in effects:
        # Two printed decimals.
        assert as_number(rows[effect["name"]][3]) == pytest.approx(effect["effect"], abs=0.00501)
        dummies = effect["by_dummies"]
        assert rows[effect["name"]][6] == ("–" if dummies is None else p_value(dummies["p"]))


def test_markdown_table_of_the_anova_holds_the_result(result):
    rows = table(result, "source", "sum of squares")
    for printed, row in zip(rows, result["surface"]["anova"][0]["rows"], strict=True):
        # Four printed digits.
        assert as_number(printed[1]) == pytest.approx(row["sum_of_squares"], rel=6e-4, abs=1e-12)
        assert int(printed[2]) == row["df"]
        assert printed[5] == p_value(row["p"])


def test_verification_chart_and_tables_hold_the_pours(result):
    stage = result["verification"]
    for index, target in enumerate(stage["targets"]):
        spec, test = figures_of(result)[f"verification-{index + 1}"], stage["tests"][index]
        assert trace(spec, "fresh pours")["y"] == valid_values(typed(result).verification.runs, target["observable"])
        assert trace(spec, "simulated mean, 95 % interval")["y"] == [test["simulated"]["mean"]]
        band = spec["layout"]["shapes"][0]
        assert (band["y0"], band["y1"]) == (target["mean"] - target["margin"], target["mean"] + target["margin"])
    simulated = table(result, "", "mean", "sd")[0]
    assert as_number(simulated[1]) == pytest.approx(stage["tests"][0]["simulated"]["mean"], abs=0.00501)


def test_all_pours_are_counted(result):
    rows = {row[0]: row for row in table(result, "stage", "pours", "valid")}
    assert sum(int(row[1]) for row in rows.values()) == result["runs"]["total"]
    assert sum(int(row[2]) for row in rows.values()) == result["runs"]["valid"]


def test_printed_equation_gives_the_prediction_at_the_optimum(result):
    part, values = result["surface"], result["optimum"]["values"]
    found = typed(result).surface
    _, actual = equation(found.models[0], found.factors, found.observables[0])
    size = {"material.seed.shear_modulus": 1e6}
    at = {factor["name"]: values[factor["path"]] / size.get(factor["path"], 1.0) for factor in part["factors"]}
    total, largest = 0.0, 0.0
    for sign, coefficient, term in re.findall(r"([+−]? ?)(\d[\d.e−]*)( [X\d·²]+)?", actual):
        value = float(coefficient.replace("−", "-")) * (-1 if "−" in sign else 1)
        for name in filter(None, term.strip().split("·")):
            value *= at[name.rstrip("²")] ** (2 if name.endswith("²") else 1)
        total, largest = total + value, max(largest, abs(value))
    single = result["optimum"]["single"]
    if result["optimum"]["compromise"] is None:
        # Five printed digits in each of ten terms, which partly cancel.
        assert total == pytest.approx(single["predicted"], abs=10 * 5e-5 * largest)


def test_contours_pass_through_the_optimum(result):
    spec, factors = figures_of(result)["contours-1"], result["optimum"]["factors"]
    star = next(entry for entry in spec["data"] if entry["name"] in ("optimum", "chosen by rule"))
    size = 1e6 if factors[0]["path"].endswith("shear_modulus") else 1.0
    assert star["x"] == [result["optimum"]["values"][factors[0]["path"]] / size]
    grid = trace(spec, "model")
    across = min(range(len(grid["x"])), key=lambda k: abs(grid["x"][k] - star["x"][0]))
    up = min(range(len(grid["y"])), key=lambda k: abs(grid["y"][k] - star["y"][0]))
    expected = result["optimum"]["single"]["predicted"]
    if result["optimum"]["compromise"] is None:
        # The nearest node is at most half a mesh, 1/80 of the region, away; slopes are below 10° per half region.
        assert grid["z"][up][across] == pytest.approx(expected, abs=0.4)


# One property of one variant


def test_pareto_has_both_errors_and_both_limits(studies):
    result = studies["planted"]
    spec, analysis = charts_in(report_html(typed(result)))["pareto"], result["screening"]["analysis"]
    for name, key in (("replicates", "pure_error"), ("dummies", "dummy_error")):
        sizes = [abs(e[f"by_{name}"]["t"]) for e in analysis["effects"] if e[f"by_{name}"] is not None]
        assert sorted(t for t in trace(spec, name)["x"] if t is not None) == sorted(sizes)
        drawn = {shape["x0"] for shape in spec["layout"]["shapes"]}
        assert {analysis[key]["t_limit"], analysis[key]["t_limit_bonferroni"]} <= drawn
    quick = figures_of(studies["one pour per row"])["pareto"]
    assert [entry["name"] for entry in quick["data"]] == ["dummies"]


def test_ascent_and_scan_charts_hold_means_and_intervals(studies):
    result = studies["planted"]
    charts = charts_in(report_html(typed(result)))
    walk = trace(charts["ascent"], "mean, 95 % interval")
    assert walk["y"] == result["ascent"]["means"]
    assert walk["error_y"]["array"] == [1.96 * error for error in result["ascent"]["standard_error"]]
    scan = trace(charts["scan"], "mean, 95 % interval")
    assert scan["x"] == pytest.approx([60, 70, 80, 100])
    assert scan["y"] == result["scan"]["means"]


def test_bootstrap_cloud_holds_every_refit(studies):
    single = studies["planted"]["optimum"]["single"]
    drawn = trace(figures_of(studies["planted"])["cloud"], "bootstrap refits")
    modulus = single["names"].index("X4")
    assert modulus < 2  # the first panel shows the first two factors
    axis = drawn[("x", "y")[modulus]]
    assert axis == [point[modulus] / 1e6 for point in single["bootstrap_points"]]


def test_stages_that_did_not_run_leave_no_section(studies):
    bare = {section.title for section in sections_of(typed(studies["no assumptions, no scan"]))}
    full = {section.title for section in sections_of(typed(studies["planted"]))}
    assert full - bare == {"Over the outlet height", "Compared with the paper"}
    text = visible(report_html(typed(studies["no assumptions, no scan"])))
    assert "this study declares no assumption" in text
    stripped = copy.deepcopy(studies["no assumptions, no scan"])
    stripped["study"]["assumed"] = []
    assert "What the source does not state" not in {section.title for section in sections_of(typed(stripped))}


def test_hostile_names_stay_text(studies):
    result = copy.deepcopy(studies["planted"])
    result["study"] |= {"name": HOSTILE, "title": HOSTILE}
    for part in (result["ascent"], result["surface"], result["optimum"]):
        part["factors"][0]["name"] = HOSTILE
    result["assumptions"]["analysis"]["notes"] = [HOSTILE]
    # The estimators' table looks every estimator up under every change.
    for entry in result["pilot"]["choice"]["separations"]:
        entry["change"] = HOSTILE
    result["pilot"]["choice"]["separations"] = result["pilot"]["choice"]["separations"][:5]
    page = report_html(typed(result))
    assert "<script>alert" not in page
    assert page.count("<script") == len(figures_of(result)) + 2
    assert "&lt;script&gt;alert" in page
    outside_code = re.sub(r"`[^`]*`", "", report_markdown(typed(result)))
    assert "alert" in outside_code
    assert not re.search(r"(?<!\\)<script", outside_code)


def test_embedded_json_cannot_end_its_element():
    text = embedded({"data": ["</script><!--"], "layout": {}})
    assert "<" not in text
    assert json.loads(text)["data"] == ["</script><!--"]


def test_paper_is_compared_only_for_its_own_study(studies):
    text = report_markdown(typed(studies["planted"]))
    for printed in ("25.96°, 25.31°, 23.47°", "24.91°", "0.923 %", "0.827", "58.34 MPa", "0.608"):
        assert printed in text
    rows = {row[0]: row for row in table(studies["planted"], "factor", "parameter", "paper: sum of squares")}
    with asset_path("source_tables", "table6_plackett_burman_anova").open(encoding="utf-8") as file:
        printed_p = {row["factor"]: row["p_value"] for row in csv.DictReader(io.StringIO(file.read()))}
    assert {name: row[4] for name, row in rows.items()} == {name: printed_p[name] for name in rows}
    assert "Compared with the paper" not in report_markdown(typed(studies["no assumptions, no scan"]))


def test_cautions_say_what_the_numbers_cannot(studies):
    texts = {name: visible(report_html(typed(result))) for name, result in studies.items()}
    assert "went on without being significant" in texts["nothing acts"]
    assert "not better than noise" in texts["nothing acts"]
    assert "lies outside what the model reaches" in texts["out of reach"]
    assert "rests on the dummy columns alone" in texts["one pour per row"]
    assert "Screening row 3 has no valid pour" in texts["missing row"]
    assert "does not identify X" in texts["planted"]
    assert all("is derived, not measured" in text for text in texts.values())


def test_the_noise_table_shows_the_range_of_the_bias(studies):
    rows = {row[0]: row for row in table(studies["planted"], "estimator", "mean")}
    # Third of reported_studies.BIAS: k = 3 times (0.3, 3.0, −1.5), less 0.5.
    assert rows["angle of repose, centre-of-mass cone"][-1] == "−5.0 … +8.5°"


def test_the_page_tells_the_spread_by_setting_and_which_assumption_is_not_testable(studies):
    text = report_markdown(typed(studies["planted"]))
    pilot = studies["planted"]["pilot"]
    assert f"Brown–Forsythe: p = {p_value(pilot['equal_variance']['p'])}" in text
    assert re.search(r"plate thickness .*acts on 3 bodies", text)
    assert "the target's own" in text


def test_the_scan_and_the_sizes_of_a_full_profile_state_what_they_resolve(studies):
    rows = {row[0]: row for row in table(studies["planted"], "stage", "pours", "valid")}
    smallest = studies["planted"]["scan"]["smallest_difference"]
    assert rows["scan"][4] == f"{smallest:.2f}° between two values"
    sized = copy.deepcopy(studies["planted"])
    size = {"stage": "ascent", "wanted": 1.0, "needed": 64, "taken": 12, "resolved": 2.39}
    sized["pilot"]["sizes"] = [size]
    assert table(sized, "stage", "pours per row needed") == [["ascent", "64", "12", "1.00°", "2.39°"]]


def test_the_optimum_says_whether_the_target_is_taken_as_exact(studies):
    assert "the target's own standard error, 0.51°" in report_markdown(typed(studies["planted"]))
    exact = copy.deepcopy(studies["planted"])
    exact["optimum"]["single"]["target_standard_error"] = 0.0
    assert "The target is taken as exact" in report_markdown(typed(exact))


def test_relative_error_below_the_standard_error_is_marked(studies):
    result = copy.deepcopy(studies["planted"])
    test = result["verification"]["tests"][0]
    spread = 100 * test["simulated"]["sd"] / math.sqrt(test["simulated"]["n"]) / 24.68
    test["relative_error_percent"] = 0.9 * spread
    assert "is smaller than the standard error" in visible(report_html(typed(result)))
    test["relative_error_percent"] = 1.1 * spread
    assert "is smaller than the standard error" not in visible(report_html(typed(result)))


def test_largest_unknown_is_named_beside_the_largest_factor(studies):
    text = report_markdown(typed(studies["planted"]))
    assumed = max((e for e in studies["planted"]["assumptions"]["analysis"]["effects"] if not e["is_dummy"]),
                  key=lambda e: abs(e["effect"]))  # fmt: skip
    assert assumed["name"] == "outlet_height"  # planted: −6° against +8° of X7
    assert f"outlet height moves the response by {abs(assumed['effect']):.2f}°" in text
    assert "the largest factor, X7 (static friction seed–seed)" in text


def test_command_line_repeats_the_study(studies):
    command = "explorer calibrate --headless --study sunflower_extract --profile test --out results"
    assert command in report_markdown(typed(studies["planted"]))
    own = copy.deepcopy(studies["planted"])
    own["study"] |= {"name": "mine", "file": "/home/me/my studies/mine.toml"}
    assert "--study '/home/me/my studies/mine.toml'" in report_markdown(typed(own))
    assert "--tries" not in report_markdown(typed(own))
    own["study"]["tries"] = 6
    assert "--tries 6 --out results" in report_markdown(typed(own))


def test_files_appear_complete_or_not_at_all(studies, tmp_path):
    write_report(typed(studies["planted"]), tmp_path)
    made = {path.name for path in tmp_path.iterdir()}
    assert made == {"report.html", "report.md", "figures", "data", "references.bib"}
    before = (tmp_path / "report.md").read_text(encoding="utf-8")
    broken = copy.deepcopy(studies["planted"])
    del broken["verification"]["tests"][0]["simulated"]
    with pytest.raises(RecordError, match=r"^result of a study: verification\.tests\[0\]\.simulated: is missing$"):
        write_report(typed(broken), tmp_path)
    assert (tmp_path / "report.md").read_text(encoding="utf-8") == before


@pytest.mark.browser
def test_browser_draws_every_chart_and_asks_for_nothing(studies, tmp_path, chromium):
    from playwright.sync_api import sync_playwright

    write_report(typed(studies["two targets"]), tmp_path)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page()
        requests, errors = [], []
        page.on("request", lambda request: requests.append(request.url))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.goto((tmp_path / "report.html").as_uri())
        page.wait_for_function("document.querySelectorAll('.main-svg').length > 0")
        drawn = page.locator("figure .js-plotly-plot").count()
        browser.close()
    assert drawn == len(figures_of(studies["two targets"]))
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert errors == []
