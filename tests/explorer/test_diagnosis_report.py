"""Reports of made-up diagnoses: every kind of verdict reads well, and every number is the one in the result."""

import copy
import json
import re

import plotly.graph_objects as go
import pytest
from scipy import stats

from explorer.report.content import Figure, Folded, Table
from explorer.report.diagnosis import diagnosis_html, diagnosis_markdown, write_diagnosis_report
from explorer.report.diagnosis.findings import fall_beyond, summary_label
from explorer.report.diagnosis.in_short import cautions, verdict_sentence
from explorer.report.diagnosis.residuals import bands
from explorer.report.diagnosis.sections import sections_of
from explorer.report.diagnosis.seen import visible_shift
from solver.effects import EFFECTS
from tests.explorer.diagnosed import CASES, EXPECTED, HOSTILE, result_of_case


@pytest.fixture(scope="module")
def results():
    return {name: result_of_case(name) for name in CASES}


@pytest.fixture(params=CASES)
def result(request, results):
    return results[request.param]


def visible(page):
    """Text of a page as a reader sees it."""
    return re.sub(r"<[^>]+>", " ", re.sub(r"<(script|style)[^>]*>.*?</\1>", " ", page, flags=re.DOTALL))


def blocks_of(result):
    def walk(blocks):
        for block in blocks:
            yield block
            if isinstance(block, Folded):
                yield from walk(block.blocks)

    for section in sections_of(result):
        yield from walk(section.blocks)


def figures_of(result):
    return {block.name: block.spec for block in blocks_of(result) if isinstance(block, Figure)}


def tables(result, *start):
    """Tables whose header begins with ``start``, as they stand in the sections."""
    found = [block for block in blocks_of(result) if isinstance(block, Table)]
    return [block.rows for block in found if block.header[: len(start)] == start]


def as_number(cell):
    return float(re.search(r"[-+]?[\d.]+(e-?\d+)?", cell.replace("−", "-"))[0])


# Every variant


@pytest.mark.parametrize("name", CASES)
def test_the_cases_are_what_they_are_called(results, name):
    found, expected = (verdict.partition(":") for verdict in (results[name]["verdict"], EXPECTED[name]))
    assert (found[0], sorted(found[2].split(","))) == (expected[0], sorted(expected[2].split(",")))


def test_every_section_and_chart_is_on_the_page(result):
    page = diagnosis_html(result)
    text = visible(page)
    for section in sections_of(result):
        assert section.blocks
        assert section.title in text
    drawn = set(re.findall(r'<figure id="([^"]+)">', page))
    assert drawn == figures_of(result).keys()
    assert {"residuals", "signatures", "cosines", "pile-1"} <= drawn
    assert ("error" in drawn) == bool(result["error"]["holdout"])


def test_no_missing_number_leaks_into_the_text(result):
    for text in (visible(diagnosis_html(result)), diagnosis_markdown(result)):
        assert not re.search(r"\b(nan|NaN|None|inf|null|undefined|True|False)\b", text)
        assert "{" not in text


def test_page_loads_nothing_from_elsewhere(result):
    page = re.sub(r'<script id="plotly">.*?</script>', "", diagnosis_html(result), flags=re.DOTALL)
    assert not re.search(r"https?:|//cdn|@import|url\(", page)
    assert not re.search(r"<(script|img|link|iframe)[^>]+(src|href)=", page)


def test_charts_are_valid_for_plotly(result):
    for spec in figures_of(result).values():
        go.Figure(spec)  # raises ValueError for an unknown or malformed property
        json.dumps(spec, allow_nan=False)


def test_tables_are_rectangular(result):
    for block in blocks_of(result):
        if isinstance(block, Table):
            assert block.rows
            assert {len(row) for row in block.rows} == {len(block.header)}


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


def test_residuals_are_drawn_with_both_bands(result):
    spec = figures_of(result)["residuals"]
    one, every = bands(len(result["residuals"]))
    assert (one, every) == pytest.approx((1.96, stats.norm.isf(0.025 / 16)), abs=1e-3)
    for name, key in (("before", "z_before"), ("after", "z_after")):
        (drawn,) = (trace for trace in spec["data"] if trace["name"] == name)
        assert drawn["x"][::-1] == [row[key] for row in result["residuals"]]
    assert {shape["x0"] for shape in spec["layout"]["shapes"]} == {one, -one, every, -every}


def test_the_patterns_are_those_of_the_result_at_length_one(result):
    rows = figures_of(result)["signatures"]["data"][0]["z"]
    drawn = result["signatures"]
    assert len(rows) == len(result["residuals"]) + len(result["parameters"])
    columns = list(zip(*rows, strict=True))
    # Rounding of sixteen squares.
    assert [sum(x * x for x in column) for column in columns] == pytest.approx([1.0] * len(columns), rel=1e-12)
    assert [list(column) for column in columns[1:]] == drawn["vectors"]
    residual_cosine = [sum(a * b for a, b in zip(columns[0], column, strict=True)) for column in columns[1:]]
    assert residual_cosine == pytest.approx(drawn["residual_cosine"], abs=1e-9)
    assert figures_of(result)["cosines"]["data"][0]["z"][0][1:] == drawn["residual_cosine"]


def test_every_effect_stands_in_the_table_with_its_lever(result):
    (race,) = tables(result, "effect", "verdict", "amplitude")
    (bounds,) = tables(result, "effect", "simulated", "strongest supported")
    assert {row[0] for row in race} == {row[0] for row in bounds} == {f"`{row['name']}`" for row in result["effects"]}
    verdicts = {row[0].strip("`"): row[1] for row in race}
    assert verdicts["kinetic_friction"] == "not simulated"
    hidden = {row["name"] for row in result["effects"] if row["status"] == "not identifiable here"}
    assert {name for name, words in verdicts.items() if words.startswith("not identifiable here")} == hidden
    assert hidden <= {"air_drag"}
    for row in bounds:
        assert row[4] == EFFECTS[row[0].strip("`")].lever


def test_gates_and_parameters_are_complete(result):
    (gates,) = tables(result, "gate")
    assert [row[0] for row in gates] == [gate["name"] for gate in result["gates"]]
    assert not {"passed", "not passed"} & {row[4] for row in gates}  # every gate is known by name
    (rows,) = tables(result, "parameter", "measured range")
    for printed, row in zip(rows, result["parameters"], strict=True):
        assert as_number(printed[2]) == pytest.approx(row["before"], rel=6e-4)  # four printed digits
        assert (printed[4] != "–") == bool(row["edge_before"])
        assert (printed[7] != "–") == bool(row["edge_after"])


def test_the_pile_is_drawn_as_measured_before_and_after(result):
    spec = figures_of(result)["pile-1"]
    picture = next(row for row in result["piles"] if row["role"] == "holdout" or not result["error"]["holdout"])
    lines = {trace["name"]: trace for trace in spec["data"] if not trace["name"].endswith("sd")}
    assert lines.keys() == {"measured", "before", "after"}
    for name, trace in lines.items():
        half = [1e3 * height for height in picture[name]["mean"]]
        assert trace["y"] == half[::-1] + half
        assert trace["x"] == [-x for x in trace["x"]][::-1]


# One property of one variant


def test_what_each_verdict_says(results):
    says = {name: verdict_sentence(result) for name, result in results.items()}
    assert says["nothing"].startswith("Nothing is missing that these data could show")
    assert says["effect"].startswith("The declared model lacks `adhesion_sjkr`: with cohesion energy density ")
    assert "On data that were not fitted the error falls from" in says["effect"]
    assert "tilt x" in says["two amplitudes"]
    assert "tilt y" in says["two amplitudes"]
    assert says["not carried over"].startswith("The fitted data ask for `adhesion_sjkr`")
    assert "The held-out data do not confirm it" in says["not carried over"]
    assert "nothing independent confirms it" in says["no holdout"]
    assert "`adhesion_sjkr` with `density_error` together" in says["pair"]
    assert re.search("cannot tell whether it is `[a-z_]+` or `[a-z_]+`", says["ambiguous"])
    assert "Measure `half the mass` with " in says["ambiguous"]
    assert "none of the 5 effects" in says["unexplained"]
    assert results["unexplained"]["where"][0] in says["unexplained"]
    assert "needs static friction grain–steel at the end of the measured range" in says["at the edge"]


def test_a_choice_in_which_held_out_data_took_part_is_called_so(results):
    alone = results["effect"]
    assert "no other effect in the list comes near" in verdict_sentence(alone)
    chosen = alone | {"ruled_out": ["twisting"]}
    assert "as `twisting` would; the held-out data rule that out" in verdict_sentence(chosen)
    assert any("took part in the choice" in text for text in cautions(chosen))
    assert not any("took part in the choice" in text for text in cautions(alone))


def test_cautions_say_what_the_numbers_cannot(results):
    texts = {name: visible(diagnosis_html(result)) for name, result in results.items()}
    assert "does not carry over to the held-out conditions" in texts["not carried over"]
    assert "does not carry over" not in texts["effect"]
    assert "it is smaller than on new ones" in texts["no holdout"]
    for name, text in texts.items():
        rows = results[name]["error"]["holdout"]
        assert ("even the final model is" in text) == bool(rows and rows[-1]["ratio"] > 2.0)
    assert "even the final model is" in texts["unexplained"]
    assert "range and model do not fit together" in texts["at the edge"]
    assert "range and model do not fit together" not in texts["effect"]
    assert "Only the 7 effects in the table were considered, 5 of which these data can see" in texts["effect"]
    for text in texts.values():
        assert "Fresh pours that broke off or left nothing to be read: 1 of the declared model" in text


def test_unseen_effects_are_listed_only_where_nothing_was_found(results):
    titles = {name: {section.title for section in sections_of(result)} for name, result in results.items()}
    for name, found in titles.items():
        assert ("What could have been seen" in found) == (EXPECTED[name] == "no_missing_effect")
    (rows,) = tables(results["nothing"], "effect", "reach at its bound")
    seen = {row[0].strip("`"): row[2] for row in rows}
    assert seen["kinetic_friction"] == "was not simulated"
    assert seen["air_drag"] == "not for certain, even at its bound"
    row = next(row for row in results["nothing"]["effects"] if row["name"] == "rolling_resistance")
    share = visible_shift(1, 5, 0.005) / row["reach"]
    # Four printed digits.
    assert as_number(seen["rolling_resistance"]) == pytest.approx(
        share * EFFECTS["rolling_resistance"].strongest, rel=6e-4
    )


def test_the_visible_shift_has_the_power_it_is_named_for():
    # One amplitude: a normal deviate beyond the two-sided limit; the far side adds nothing at such shifts.
    limit = stats.norm.isf(0.005 / 5 / 2)
    assert stats.norm.sf(limit - visible_shift(1, 5, 0.005)) == pytest.approx(0.8, abs=1e-6)
    assert visible_shift(2, 5, 0.005) > visible_shift(1, 5, 0.005) > visible_shift(1, 1, 0.005)


def test_the_fall_beyond_an_edge_is_that_of_a_parabola():
    # T² = ((x − 3)/s)² held at x = 1 with s = 0.5: half slope 2/s², pull 2 · 2/s² · s = 8, fall (2/s)² = 16.
    assert fall_beyond(2 * (2 / 0.5**2) * 0.5) == pytest.approx(16.0)


def test_an_inadequate_best_effect_is_called_so(results):
    (race,) = tables(results["unexplained"], "effect", "verdict", "amplitude")
    assert race[0][1].startswith("best, but not adequate")
    assert "the best single effect although it is not adequate" in diagnosis_markdown(results["unexplained"])


def test_rivals_and_their_distance_stand_in_the_race(results):
    (race,) = tables(results["ambiguous"], "effect", "verdict", "amplitude")
    assert [row[1] for row in race[:2]] == ["named", "named"]
    assert race[2][1].startswith("behind the best: ΔB ")
    (menu,) = tables(results["ambiguous"], "set-up", "score")
    assert [row[0] for row in menu] == ["`half the mass`", "`as it is, poured again`"]
    assert menu[1][3] == "more than 100"


def test_skill_is_stated_only_where_something_was_added(results):
    rows = {name: tables(result, "observable", "before")[0] for name, result in results.items()}
    assert {row[5] for row in rows["nothing"]} == {row[6] for row in rows["nothing"]} == {"–"}
    overall = results["effect"]["error"]["holdout"][-1]
    assert as_number(rows["effect"][-1][5]) == pytest.approx(overall["skill"], abs=0.00501)


def test_summaries_read_as_words():
    words = {
        "angle_of_repose_deg": "angle of repose",
        "angle_of_repose_deg@45": "angle of repose seen from 45°",
        "height_profile_m(0.0125)": "height profile at 0.0125",
        "bulk_density_kg_m3": "bulk density",
        "overall": "all together",
    }
    assert {name: summary_label(name) for name in words} == words


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
    for row in bare["effects"]:
        row |= {"status": "not identifiable here", "amplitudes": [], "reach": None, "delta": None}
    bare["signatures"] |= {"names": [], "vectors": [], "cosines": [], "residual_cosine": []}
    text = diagnosis_markdown(bare)
    assert "that no effect that was simulated explains" in text
    assert not re.search(r"\b(nan|None)\b", text + visible(diagnosis_html(bare)))
    assert "Pattern of the residual" not in text


def test_files_appear_complete_or_not_at_all(results, tmp_path):
    write_diagnosis_report(results["effect"], tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"report.html", "report.md"}
    before = (tmp_path / "report.md").read_text(encoding="utf-8")
    broken = copy.deepcopy(results["effect"])
    del broken["limits"]
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
