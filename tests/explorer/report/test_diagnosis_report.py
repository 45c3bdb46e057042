"""Reports of made-up diagnoses: every kind of verdict reads well, and every number is the one in the result."""

import copy
import json
import math
import re

import plotly.graph_objects as go
import pytest
from scipy import stats

from doe.diagnose.posterior import TEMPERATURE
from doe.record import RecordError, VersionError
from explorer.diagnosis.result import DiagnosisResult
from explorer.report.content import Table
from explorer.report.diagnosis.charts import MOST_RESIDUALS, bands
from explorer.report.diagnosis.rivals import VISIBLE
from explorer.report.diagnosis.wording import (
    chance,
    feature_label,
    size_text,
)
from solver.effects import EFFECTS
from tests.explorer.diagnosed import CASES, EXPECTED, HOSTILE, NAMES, SEEN_AS, typed
from tests.explorer.reported_diagnoses import (
    amplitude_text,
    as_number,
    blocks_of,
    diagnosis_html,
    diagnosis_markdown,
    feature_value,
    figures_of,
    sections_of,
    tables,
    write_diagnosis_report,
)
from tests.explorer.reported_studies import visible

pytestmark = pytest.mark.usefixtures("unprinted")


@pytest.fixture(params=CASES)
def result(request, results):
    return results[request.param]


# Every variant


@pytest.mark.parametrize("name", CASES)
def test_the_cases_are_what_they_are_called(results, name):
    found, expected = (verdict.partition(":") for verdict in (results[name]["verdict"], EXPECTED[name]))
    assert (found[0], sorted(found[2].split(","))) == (expected[0], sorted(expected[2].split(",")))


def test_every_kind_of_verdict_is_among_them(results):
    kinds = {result["verdict"].partition(":")[0] for result in results.values()}
    assert kinds == {"no_missing_effect", "effect", "effects", "ambiguous", "unexplained"}
    assert {result["taken_back"] for result in results.values()} == {
        "",
        "effect:adhesion_sjkr",
        "no_missing_effect",
    }


def test_what_is_written_is_what_is_read(result):
    assert typed(result).to_dict() == result


def test_every_section_and_chart_is_on_the_page(result):
    page = diagnosis_html(result)
    text = visible(page)
    for section in sections_of(result):
        assert section.blocks
        assert section.title in text
    drawn = set(re.findall(r'<figure id="([^"]+)">', page))
    assert drawn == figures_of(result).keys()
    assert {"probabilities", "residuals"} <= drawn
    assert ("pile-1" in drawn) == bool(result["piles"])
    assert ("error" in drawn) == bool(result["error"]["holdout"])


def test_no_missing_number_leaks_into_the_text(result):
    for text in (visible(diagnosis_html(result)), diagnosis_markdown(result)):
        assert not re.search(r"\b(nan|NaN|None|inf|null|undefined|True|False)\b", text)
        assert "{" not in text
        assert SEEN_AS not in text


def test_page_loads_nothing_from_elsewhere(result):
    page = re.sub(r'<script id="plotly"[^>]*>.*?</script>', "", diagnosis_html(result), flags=re.DOTALL)
    assert not re.search(r"https?:|//cdn|@import|url\(", page)
    assert not re.search(r"<(script|img|link|iframe)[^>]+(src|href)=", page)


def test_charts_are_valid_for_plotly(result):
    for spec in figures_of(result).values():
        drawn = go.Figure(spec)  # raises ValueError for an unknown or malformed property
        assert 0 < len(drawn.data) == len(spec["data"])
        assert json.loads(json.dumps(spec, allow_nan=False))["data"]


def test_tables_are_rectangular(result):
    for block in blocks_of(result):
        if isinstance(block, Table):
            assert block.rows
            assert {len(row) for row in block.rows} == {len(block.header)}


def test_the_probabilities_are_those_of_the_result_and_add_up(result):
    (rows,) = tables(result, "answer", "probability")
    words = {"nothing missing": "nothing", "something outside the library": "outside"}
    known = {f"`{'` with `'.join(row['name'].split('+'))}`": row["probability"] for row in result["effects"]}
    known |= {word: result["probabilities"][key] for word, key in words.items()}
    assert [row[1] for row in rows[:-1]] == [chance(known[row[0]]) for row in rows[:-1]]
    shown = [known[row[0]] for row in rows[:-1]]
    assert shown == sorted(shown, reverse=True)
    assert shown[0] == max(known.values())
    assert rows[-1][:2] == ("all other answers together", chance(max(0.0, 1.0 - sum(shown))))
    drawn = figures_of(result)["probabilities"]["data"][0]
    assert drawn["x"][::-1] == pytest.approx([100.0 * p for p in shown])
    assert [name.replace("`", "") for name, *_ in rows[:-1]] == drawn["y"][::-1]


def test_the_error_table_holds_the_result(result):
    role = "holdout" if result["error"]["holdout"] else "fit"
    rows = tables(result, "observable", "before", "after", "noise floor")[0]
    size = {"m": 1e3}
    assert len(rows) == len(result["error"][role])
    for printed, row in zip(rows, result["error"][role], strict=True):
        for cell, key in zip(printed[1:4], ("before", "after", "noise_floor"), strict=True):
            # Three printed digits.
            assert as_number(cell) == pytest.approx(row[key] * size.get(row["unit"], 1.0), rel=6e-3)
        assert as_number(printed[4]) == pytest.approx(row["ratio"], abs=0.00501)


def test_residuals_are_drawn_with_both_bands_and_listed(result):
    spec = figures_of(result)["residuals"]
    one, every = bands(len(result["residuals"]))
    assert (one, every) == pytest.approx((1.96, stats.norm.isf(0.025 / 25)), abs=1e-3)
    for name, key in (("before", "z_before"), ("after", "z_after")):
        (drawn,) = (trace for trace in spec["data"] if trace["name"] == name)
        assert drawn["x"][::-1] == [row[key] for row in result["residuals"]]
    assert {shape["x0"] for shape in spec["layout"]["shapes"]} == {one, -one, every, -every}
    (rows,) = tables(result, "condition", "feature", "measured")
    for printed, row in zip(rows, result["residuals"], strict=True):
        assert printed[0] == row["condition"]
        # Two printed decimals.
        assert [as_number(cell) for cell in printed[5:]] == pytest.approx(
            [row["z_before"], row["z_after"]], abs=0.00501
        )


def test_the_residual_is_placed(result):
    (rows,) = tables(result, "condition", "share of the squared residual")
    for printed, row in zip(rows, result["where"], strict=True):
        assert as_number(printed[1]) == pytest.approx(100.0 * row["share"], abs=0.501)
        assert printed[2] == feature_label(row["feature"])
        assert as_number(printed[3]) == pytest.approx(row["z"], abs=0.00501)


def test_every_effect_stands_in_the_table_with_its_lever(result):
    (rows,) = tables(result, "effect", "probability", "log evidence")
    for printed, row in zip(rows, result["effects"], strict=True):
        assert printed[0].replace("`", "") == row["name"].replace("+", " with ")
        assert printed[1] == chance(row["probability"])
        assert as_number(printed[2]) == pytest.approx(row["log_evidence"], abs=0.0501)
        assert all(amplitude_text(one) in printed[3] for one in row["amplitudes"])
        assert as_number(printed[5]) == pytest.approx(row["fitted_strength"], abs=0.0501)
        assert as_number(printed[6]) == pytest.approx(row["cosine"], abs=0.00501)
        assert (printed[7] == "–") == ("+" in row["name"])
        if row["reference"]:
            assert printed[7] == size_text(row["name"], math.hypot(*row["reference"]))
            assert as_number(printed[8]) == pytest.approx(row["strength"], abs=0.0501)
            assert int(printed[9]) == row["pours"]
    (bounds,) = tables(result, "effect", "range", "strongest supported")
    assert [row[0] for row in bounds] == [f"`{name}`" for name in NAMES]
    for row in bounds:
        assert row[4] == EFFECTS[row[0].strip("`")].lever


def test_parameters_stand_beside_their_measurement(result):
    (rows,) = tables(result, "parameter", "measured", "range")
    for printed, row in zip(rows, result["parameters"], strict=True):
        # Four printed digits.
        assert as_number(printed[3]) == pytest.approx(row["before"], rel=6e-4)
        assert as_number(printed[4]) == pytest.approx(row["after"], rel=6e-4)
        assert (printed[1] == "–") == (row["mean"] is None)


def test_the_data_say_what_they_offer_and_what_a_scan_would_add(result):
    (rows,) = tables(result, "condition", "role", "rig")
    assert [row[4] for row in rows][:2] == ["scalars and scans of the surface", "scalars"]
    for printed, row in zip(rows, result["offered"], strict=False):
        assert int(printed[5]) == row["features"]
    assert [row[6] for row in rows][:2] == ["nothing more", "37 features"]
    text = diagnosis_markdown(result)
    assert "centre of volume of the core, y (fit)" in text
    assert "photographs: not read" in text
    assert "mass: clipped" in text


def test_the_paragraph_for_a_paper_has_the_numbers_of_the_result(result):
    text = diagnosis_markdown(result).partition("## For a paper")[2].partition("## ")[0]
    assert f"on {result['pours']['settings']} simulated settings" in text
    assert f"from a posterior probability of {result['threshold']} on" in text
    pours = "1 pour" if result["measured"][0]["replicates"] == 1 else "6 pours"
    for row in result["offered"]:
        assert f"{row['condition']} ({row['features']} features, {pours})" in text
    if result["error"]["holdout"]:
        total = result["error"]["holdout"][-1]
        assert feature_value(result, "overall", total["before"]) in text
        assert feature_value(result, "overall", total["noise_floor"]) in text
        assert (feature_value(result, "overall", total["after"]) in text) or result["final"] == "base"
    final = next((row for row in result["effects"] if row["name"] == result["final"]), None)
    if final is not None:
        assert all(amplitude_text(one) in text for one in final["amplitudes"])
    assert ("was withdrawn" in text) == bool(result["taken_back"])


def test_the_method_states_its_rules(result):
    text = diagnosis_markdown(result).partition("## How the answer was reached")[2].partition("## ")[0]
    assert text.count("\n- ") == 6
    assert (
        "effect or pair, a pair by pours of a follow-up only, is named if it reaches 90 % (after a follow-up, which"
        in text
    )
    assert "the data are likely under it (p ≥ 0.01), and unlikely under the declared" in text
    assert "or it has less than 0.1 % even with its parameters measured at their best fit)" in text
    assert "unless the calibrated declared model fitted (p ≥ 0.1) and kept 0.1 % or" in diagnosis_markdown(result)
    old = result | {"rule": {name: one for name, one in result["rule"].items() if name != "hidden"}}
    assert "unless the calibrated declared model fitted (p ≥ 0.1) and the name rested" in diagnosis_markdown(old)
    younger = ("doubted", "hidden", "pairs_at_once")
    before = result | {"rule": {name: one for name, one in result["rule"].items() if name not in younger}}
    assert "effect or pair is named if it reaches 90 %" in diagnosis_markdown(before)
    assert "the declared model (p <" not in diagnosis_markdown(before)
    assert "model fitted (p" not in diagnosis_markdown(before)
    assert f"The temperature is {TEMPERATURE:g};" in text


def test_the_pile_is_drawn_as_measured_before_and_after(result):
    if not result["piles"]:  # measured once: no band can be drawn
        assert {row["replicates"] for row in result["measured"]} == {1}
        return
    spec = figures_of(result)["pile-1"]
    picture = next(row for row in result["piles"] if row["role"] == "holdout" or not result["error"]["holdout"])
    lines = {trace["name"]: trace for trace in spec["data"] if not trace["name"].endswith("sd")}
    assert lines.keys() == {"measured", "before", "after"}
    for name, trace in lines.items():
        half = [1e3 * height for height in picture[name]["mean"]]
        assert trace["y"] == half[::-1] + half
        assert trace["x"] == [-x for x in trace["x"]][::-1]


def test_the_map_shows_measured_minus_poured(result):
    if not result["maps"]:
        assert {row["replicates"] for row in result["measured"]} == {1}
        return
    (picture,) = result["maps"]
    spec = figures_of(result)["map-1"]
    heat = {trace["name"]: trace for trace in spec["data"] if trace["type"] == "heatmap"}
    assert heat.keys() == {"before", "after"}
    for name, trace in heat.items():
        height, z = picture[name]["height"], picture[name]["z"]
        for x, y in ((3, 17), (11, 12), (20, 6)):
            assert trace["z"][y][x] == pytest.approx(1e3 * height[x][y], abs=1e-3)
            assert trace["customdata"][y][x] == pytest.approx(z[x][y], abs=0.05)
    assert heat["before"]["x"] == heat["before"]["y"] == [-x for x in heat["before"]["x"]][::-1]
    ((row,),) = tables(result, "condition", "root mean square before")
    worst = max(abs(one) for line in picture["before"]["z"] for one in line)
    assert abs(float(row[4].removesuffix(" σ").replace("−", "-"))) == pytest.approx(worst, abs=0.006)


# One property of one variant


# One property of one variant


def test_unseen_effects_are_listed_only_where_nothing_was_found(results):
    for name, result in results.items():
        titles = {section.title for section in sections_of(result)}
        assert ("What could have been seen" in titles) == (EXPECTED[name] == "no_missing_effect")
    (rows,) = tables(results["nothing"], "effect", "strength at the end of its range")
    seen = {row[0].strip("`"): row[1:3] for row in rows}
    assert list(seen) == list(NAMES)
    assert seen["air_drag"][1] == "not for certain, even at its bound"
    assert seen["plate_tilt"][1].endswith("in any direction")
    for name, share in (("rolling_resistance", 0.4), ("density_error", 0.4), ("plate_tilt", 0.4)):
        row = next(row for row in results["nothing"]["effects"] if row["name"] == name)
        # By proportion; one and three printed digits.
        assert as_number(seen[name][0]) == pytest.approx(row["strength"] / share, abs=0.0501)
        amount = share * EFFECTS[name].strongest * VISIBLE / row["strength"]
        assert as_number(seen[name][1]) == pytest.approx(amount, rel=6e-3)


def test_what_looks_the_same_is_named_with_what_would_tell(results):
    (rows,) = tables(results["ambiguous"], "effect", "looks like")
    assert {row[0] for row in rows} <= {"`twisting`", "`rolling_resistance`"}
    cosine = {frozenset((a, b)): c for a, b, c in results["ambiguous"]["similar"]}
    for row in rows:
        pair = frozenset(cell.strip("`") for cell in row[:2])
        assert as_number(row[2]) == pytest.approx(cosine[pair], abs=0.00501)
    text = diagnosis_markdown(results["ambiguous"])
    for name in ("twisting", "rolling_resistance"):
        assert f"- `{name}`: {EFFECTS[name].lever}" in text
    (menu,) = tables(results["ambiguous"], "set-up", "chance of an answer")
    assert [row[0] for row in menu] == ["`half the mass`", "`as it is, poured again`"]
    assert menu[1][1] == "6 pours: 0 %"
    assert int(menu[0][1].removeprefix("6 pours: ").removesuffix(" %")) > 50
    assert "No other effect shifts these features as `adhesion_sjkr` would" in diagnosis_markdown(results["effect"])
    assert "37 in fit fast" in text


def test_skill_is_stated_only_where_something_was_added(results):
    rows = {name: tables(result, "observable", "before")[0] for name, result in results.items()}
    assert {row[5] for row in rows["nothing"]} == {row[6] for row in rows["nothing"]} == {"–"}
    overall = results["effect"]["error"]["holdout"][-1]
    assert as_number(rows["effect"][-1][5]) == pytest.approx(overall["skill"], abs=0.00501)


def test_of_many_features_the_farthest_are_drawn_and_all_are_listed(results):
    many = copy.deepcopy(results["effect"])
    row = many["residuals"][0]
    many["residuals"] += [row | {"condition": f"more {k}", "z_before": 1e-3 * k, "z_after": 0.0} for k in range(60)]
    drawn = figures_of(many)["residuals"]["data"][0]["y"]
    assert len(drawn) == MOST_RESIDUALS
    assert not any(name.startswith("more 0 ") for name in drawn)
    assert f"The {MOST_RESIDUALS} of 85 features that are farthest off." in visible(diagnosis_html(many))
    (rows,) = tables(many, "condition", "feature", "measured")
    assert len(rows) == 85


def test_hostile_names_stay_text(results):
    result = copy.deepcopy(results["hostile"])
    old = "fit fast"
    text = json.dumps(result).replace(json.dumps(old)[1:-1], json.dumps(HOSTILE.replace("|", ""))[1:-1])
    result = json.loads(text)
    page = diagnosis_html(result)
    assert "<script>alert" not in page
    assert page.count("<script") == len(figures_of(result)) + 2
    assert "&lt;script&gt;alert" in page
    outside_code = re.sub(r"`[^`]*`", "", diagnosis_markdown(result))
    assert "alert" in outside_code
    assert not re.search(r"(?<!\\)<script", outside_code)


def test_command_line_repeats_the_diagnosis(results):
    assert "explorer diagnose 'data/made up' --out 'results/made up' --budget 900" in diagnosis_markdown(
        results["effect"]
    )
    chosen = copy.deepcopy(results["effect"])
    chosen["order"] |= {"effects": ["air_drag", "twisting"], "budget": None}
    assert "--out 'results/made up' --effects air_drag,twisting\n" in diagnosis_markdown(chosen)


def test_data_without_profiles_have_no_picture(results):
    bare = copy.deepcopy(results["effect"])
    bare["piles"] = []
    assert "The pile" not in {section.title for section in sections_of(bare)}


def test_pours_that_leave_nothing_to_read_make_dashes(results):
    bare = copy.deepcopy(results["unexplained"])
    for rows in bare["error"].values():
        for row in rows:
            row |= {key: None for key, value in row.items() if isinstance(value, float)}
    bare["next_experiment"], bare["held_out"] = [], None
    text = diagnosis_markdown(bare) + visible(diagnosis_html(bare))
    assert not re.search(r"\b(nan|None)\b", text)


def test_an_effect_that_fell_out_of_the_table_is_a_dash(results):
    few = copy.deepcopy(results["nothing"])
    few["effects"] = [row for row in few["effects"] if row["name"] != "twisting"]
    (rows,) = tables(few, "effect", "strength at the end of its range")
    assert next(row for row in rows if row[0] == "`twisting`")[1:3] == ("–", "–")


@pytest.mark.parametrize(
    ("schema", "maker"), [(1, "an older version"), (4, "another version"), (None, "another version")]
)
def test_a_result_of_another_version_is_refused_in_one_line(results, schema, maker):
    with pytest.raises(VersionError, match=rf"^diagnosis.json: made by {maker} of the program .*again$"):
        DiagnosisResult.from_dict(results["effect"] | {"schema": schema})


def test_a_result_without_a_number_is_refused_in_one_line(results):
    broken = copy.deepcopy(results["effect"])
    del broken["effects"][0]["probability"]
    with pytest.raises(RecordError, match=r"^diagnosis.json: effects\[0\].probability: is missing$"):
        DiagnosisResult.from_dict(broken)


def test_files_appear_complete_or_not_at_all(results, tmp_path):
    write_diagnosis_report(results["effect"], tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {
        "report.html",
        "report.md",
        "figures",
        "data",
        "references.bib",
    }
    before = (tmp_path / "report.md").read_text(encoding="utf-8")
    broken = copy.deepcopy(results["effect"])
    broken["effects"][0]["amplitudes"][0]["effect"] = "no such effect"
    with pytest.raises(KeyError):
        write_diagnosis_report(broken, tmp_path)
    assert (tmp_path / "report.md").read_text(encoding="utf-8") == before


@pytest.mark.browser
def test_browser_draws_every_chart_and_asks_for_nothing(results, tmp_path, chromium):
    from playwright.sync_api import sync_playwright

    write_diagnosis_report(results["effect"], tmp_path)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page()
        requests, errors = [], []
        page.on("request", lambda request: requests.append(request.url))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto((tmp_path / "report.html").as_uri())
        page.wait_for_function("document.querySelectorAll('.main-svg').length > 0")
        drawn = page.locator("figure .js-plotly-plot").count()
        browser.close()
    assert drawn == len(figures_of(results["effect"]))
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert errors == []
