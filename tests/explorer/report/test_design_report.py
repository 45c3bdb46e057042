"""The report of a design: every chart is one that plotly reads, for designs of every kind and for poor results."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go
import pytest

from doe.analysis.surface import Blocks
from doe.designs import box_behnken, central_composite, factorial, latin_hypercube, morris, plackett_burman
from doe.designs.mixture import simplex_centroid
from explorer.design.analysis import AnalyseOrder, analyse_runs
from explorer.design.choices import Surrogate
from explorer.design.factors_file import DesignFactor
from explorer.design.filled_sheet import Runs
from explorer.design.result import DesignResult
from explorer.design.text import analysis_text
from explorer.report.content import Figure, Folded, Table, Word
from explorer.report.design import design_html, design_markdown
from explorer.report.design.charts import design_plots
from explorer.report.design.sections import banner, sections_of
from explorer.report.figures.model import profiler, ranges
from explorer.report.sections.optimum import ranges_caption

pytestmark = pytest.mark.usefixtures("unprinted")


def runs(design, values, design_name=""):
    """A sheet of factors f1, f2, … between 10 and 20 mm."""
    k = np.shape(design)[1]
    responses = np.atleast_2d(np.asarray(values, dtype=float).T).T
    return Runs(
        design=design_name,
        factors=tuple(DesignFactor(f"f{j + 1}", 10.0, 20.0, "mm", 14.0) for j in range(k)),
        response="load",
        unit="N",
        coded=np.asarray(design, dtype=float),
        responses=responses,
        labels=tuple(tuple(f"{i + 1}.{r + 1}" for r in range(responses.shape[1])) for i in range(len(responses))),
        missing=int(np.isnan(responses).sum()),
    )


def noise(shape, seed=0):
    return np.random.default_rng(seed).standard_normal(shape)


def with_gap():
    values = 10 + factorial(3) @ [[1.0], [2.0], [0.0]] + noise((8, 2))
    values[2] = math.nan
    values[4, 1] = math.nan
    return runs(factorial(3), values)


def names():
    """A number, three names and two."""
    levels = np.array([(x, a, b) for x in (-1, 0, 1) for a in (-1, 0, 1) for b in (-1, 1)], dtype=float)
    sheet = runs(np.vstack([levels, levels]), 9 + np.tile(levels @ [1, 2, 0], 2) + 0.3 * noise(36))
    own = (sheet.factors[0], *(replace(f, low=-1, high=1, unit="", reference=0) for f in sheet.factors[1:]))
    return replace(
        sheet, factors=(own[0], replace(own[1], levels=("a", "b", "c")), replace(own[2], levels=("old", "new")))
    )


def in_groups():
    """Twelve groups of the runs of `names`, drawn at random."""
    sheet = names()
    of_run = (np.arange(36) % 12)[:, None]
    return replace(sheet, groups=Blocks(tuple(f"day {k}" for k in range(12)), of_run))


CASES = {
    "morris": (runs(morris(6, 4, 1), 9 + morris(6, 4, 1) @ [3, 2, 1, 0, 0, 0] + 0.1 * noise(28), "morris"), None),
    "process": (runs(box_behnken(3, 5), 9 + box_behnken(3, 5) @ [1, 2, 0] + 0.1 * noise(17)), 10.0),
    "process out of reach": (runs(factorial(2), 9 + noise((4, 3))), 1e6),
    "process without a target": (runs(latin_hypercube(5, 12, 1), 9 + noise(12)), None),
    "random groups": (in_groups(), None),
    "names": (names(), 9.5),
    "names without a target": (names(), None),
    "target out of reach of all names": (names(), 99.0),
    "one factor": (runs(np.array([[-1.0], [-0.5], [0], [0.5], [1], [1]]), 5 + noise(6)), 5.0),
    "two factors": (runs(central_composite(2, 4), 5 + noise(12)), 5.1),
    "three factors": (runs(box_behnken(3, 5), 9 + box_behnken(3, 5) @ [1, 2, 0] + 0.1 * noise(17)), 10.0),
    "without a target": (runs(box_behnken(3, 5), 9 + noise(17)), None),
    "target out of reach": (runs(factorial(2), 9 + noise((4, 3))), 1e6),
    "five factors": (runs(factorial(5, ["E=ABCD"]), 9 + noise(16)), 9.0),
    "four factors": (runs(central_composite(4, 3, "face-centred"), 9 + noise(27)), None),
    "fifteen factors": (runs(latin_hypercube(15, 40, 1), 9 + noise(40)), None),
    "screening": (runs(plackett_burman(12)[:, :8], 9 + noise(12), "plackett-burman"), None),
    "saturated": (runs(plackett_burman(8), 9 + noise(8), "plackett-burman"), 9.0),
    "hypercube": (
        runs(latin_hypercube(3, 30, 1), np.exp(latin_hypercube(3, 30, 1) @ [1, 0.5, 0] + 0.1 * noise(30))),
        None,
    ),
    "missing runs": (with_gap(), 10.0),
    "constant": (runs(box_behnken(3, 5), np.full(17, 4.0)), 4.0),
    "constant replicates": (runs(factorial(2), np.full((4, 2), 4.0)), None),
    "one centre run": (runs(box_behnken(3, 1), 9 + noise(13)), None),
    "negative response": (runs(box_behnken(3, 5), noise(17)), None),
    "no noise at all": (runs(box_behnken(3, 5), box_behnken(3, 5) @ [1.0, 2.0, 3.0]), 1.0),
}


@pytest.fixture(scope="module", params=CASES, ids=str)
def result(request):
    sheet, target = CASES[request.param]
    surrogate = Surrogate.GP if "process" in request.param else None
    return analyse_runs(sheet, AnalyseOrder("runs.csv", "load", target, surrogate=surrogate))


def figures(blocks):
    for block in blocks:
        if isinstance(block, Figure):
            yield block
        if isinstance(block, Folded):
            yield from figures(block.blocks)


def tables(blocks):
    for block in blocks:
        if isinstance(block, Table):
            yield block
        if isinstance(block, Folded):
            yield from tables(block.blocks)


def test_every_chart_is_one_that_plotly_reads(result):
    found = [figure for section in sections_of(result) for figure in figures(section.blocks)]
    assert found
    assert len({figure.name for figure in found}) == len(found)
    for figure in found:
        go.Figure(figure.spec)  # raises for a property or a value that plotly does not know


def test_every_row_has_as_many_cells_as_its_header_and_none_is_none_or_nan(result):
    for section in sections_of(result):
        for table in tables(section.blocks):
            for row in table.rows:
                assert len(row) == len(table.header)
                assert not {"None", "nan", ""} & set(row)


def test_page_markdown_and_terminal_are_made_and_show_no_hole(result):
    page, markdown, text = design_html(result), design_markdown(result), analysis_text(result)
    assert page.endswith("</html>\n")
    for words in (markdown, text):
        for hole in ("None", "nan", "inf ", "own:"):
            assert hole not in words


def test_what_acts_and_where_the_target_lies_are_in_short(result):
    first = sections_of(result)[0]
    assert first.title == "In short"
    facts = dict(next(block for block in first.blocks if hasattr(block, "pairs")).pairs)
    of_names = result.analysis.named is not None and result.target is not None
    assert ("Target" in facts) == (result.optimum is not None or of_names)
    assert ("Equation, coded" in facts) == (result.fitted is not None)
    assert ("Factors that act" in facts) == (result.effects is not None)


def test_the_result_survives_json(result):
    kept = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert DesignResult.from_dict(kept).to_dict() == kept


@pytest.mark.parametrize(
    ("case", "title", "figure", "points"),
    [
        ("morris", "Elementary effects", "morris", 6),
        ("names without a target", "Means of names", "names", 5),
        ("random groups", "Groups", "groups", 12),
    ],
)
def test_the_page_shows_the_report_s_chart_of_an_analysis_without_a_model(case, title, figure, points):
    found = analyse_runs(CASES[case][0], AnalyseOrder("runs.csv", "load", None))
    (drawn,) = [one for section in sections_of(found) for one in figures(section.blocks) if one.name == figure]
    plots = design_plots(found)
    assert list(plots) == [title]
    assert plots[title].make() == drawn.spec
    assert len(drawn.spec["data"][0]["x"]) == points


def test_names_from_outside_are_escaped():
    sheet, _ = CASES["two factors"]
    labels = tuple(("<script>alert(1)</script>",) for _ in sheet.labels)
    made = analyse_runs(Runs(**{**sheet.__dict__, "labels": labels}), AnalyseOrder("<img src=x>.csv", "load", None))
    page = design_html(made)
    assert "<script>alert(1)" not in page
    assert "<img src=x>" not in page
    assert "&lt;script&gt;alert(1)" in page


def test_where_nothing_could_be_tested_no_effect_found_is_no_verdict():
    constant, found = (analyse_runs(CASES[name][0], AnalyseOrder("runs.csv", "load")) for name in
                       ("constant", "without a target"))  # fmt: skip
    assert banner(constant).word is Word.NO_ANSWER
    assert "cannot be told without scatter" in banner(constant).why
    assert banner(found).word in (Word.NO_EFFECT, Word.EFFECT_FOUND)


def test_a_small_response_is_not_rounded_away():
    sheet, _ = CASES["three factors"]
    small = replace(sheet, unit="", responses=1e-4 * sheet.responses)
    result = analyse_runs(small, AnalyseOrder("runs.csv", "load", 1e-3))
    assert banner(result).headline == "TARGET REACHED 0.001"
    runs_table = next(section for section in sections_of(result) if section.title == "Runs").blocks[0]
    assert len({row[-1] for row in runs_table.rows}) > 5


def scaled(size):
    """Three factors whose response and one range are ``size`` times those of the case."""
    sheet, target = CASES["three factors"]
    first = replace(sheet.factors[0], low=10.0 * size, high=20.0 * size, reference=14.0 * size)
    sheet = replace(sheet, factors=(first, *sheet.factors[1:]), responses=size * sheet.responses)
    return analyse_runs(sheet, AnalyseOrder("runs.csv", "load", size * target))


@pytest.mark.parametrize("size", [1e-9, 1e12])
@pytest.mark.parametrize(
    ("title", "key", "trace"),
    [("Contours", "z", 0), ("Surface in 3-D, A and B", "z", 0), ("Solution surface", "value", 0)],
)
def test_a_chart_shows_a_response_of_any_size_as_finely(size, title, key, trace):
    drawn, same = (
        np.array(design_plots(scaled(one))[title].make()["data"][trace][key], dtype=float) / one for one in (size, 1.0)
    )
    # Both are rounded to a hundred-thousandth of their spread.
    np.testing.assert_allclose(drawn, same, atol=2e-5 * np.ptp(same))


def test_the_profile_of_a_small_response_is_no_step():
    found = scaled(1e-9).fitted
    curve = profiler(found, found.section_point)["data"][1]["y"]
    assert len(set(curve)) > 25


@pytest.mark.parametrize("kind", ["screening", "morris", "random groups", "names"])
def test_a_small_effect_is_not_rounded_away(kind):
    sheet, _ = CASES[kind]
    found = analyse_runs(replace(sheet, responses=1e-9 * sheet.responses), AnalyseOrder("runs.csv", "load"))
    for text in (design_markdown(found), analysis_text(found)):
        assert not re.search(r"[+−-]0\.0+\b", text)


@pytest.mark.parametrize("kind", ["one factor", "fifteen factors", "two factors"])
def test_a_design_has_the_plots_that_there_is_room_for(kind):
    sheet, target = CASES[kind]
    plots = design_plots(analyse_runs(sheet, AnalyseOrder("runs.csv", "load", target)))
    for plot in plots.values():
        spec = plot.make()
        go.Figure(spec["data"], spec["layout"])
    assert ("Contours" in plots) == (kind == "two factors")


@pytest.mark.parametrize("kind", ["random groups", "mixture"])
def test_what_takes_no_target_is_not_told_to_be_asked_for_one(kind):
    if kind == "mixture":
        shares = simplex_centroid(3)
        sheet = runs(2 * np.vstack([shares, shares]) - 1, np.tile(9 + shares @ [1, 2, 0], 2) + 0.01 * noise(14))
        sheet = replace(sheet, factors=tuple(replace(one, low=0.0, high=1.0, reference=0.5) for one in sheet.factors))
    else:
        sheet, _ = CASES[kind]
    found = banner(analyse_runs(sheet, AnalyseOrder("runs.csv", "load", random="day" if sheet.groups else "")))
    assert found.word is Word.EFFECT_FOUND
    assert "--target" not in found.then or "--block … --target" in found.then


def test_the_methods_count_settings_once_and_say_what_was_fitted():
    three = design_markdown(analyse_runs(CASES["without a target"][0], AnalyseOrder("runs.csv", "load")))
    assert "17 runs at 13 settings of 3 factors were analysed for load" in three
    one = design_markdown(analyse_runs(CASES["one factor"][0], AnalyseOrder("runs.csv", "load")))
    assert "6 runs at 5 settings of 1 factor were analysed" in one
    for kind, words in (("random groups", "restricted maximum likelihood"), ("morris", "Morris 1991")):
        text = design_markdown(analyse_runs(CASES[kind][0], AnalyseOrder("runs.csv", "load")))
        assert words in text.partition("## Methods")[2]
        assert "Sums of squares are partial" not in text


def test_markdown_takes_no_name_for_markup():
    sheet = names()
    odd = (r"x~~y~~", "a$b$", "u&lt;v")
    second = replace(sheet.factors[1], levels=odd)
    sheet = replace(sheet, factors=(sheet.factors[0], second, sheet.factors[2]))
    text = design_markdown(analyse_runs(sheet, AnalyseOrder("runs.csv", "load")))
    for raw, told in zip(odd, (r"x\~\~y\~\~", r"a\$b\$", r"u\&lt;v"), strict=True):
        assert raw not in text
        assert told in text


def test_the_caption_of_the_ranges_names_the_bars_that_are_drawn():
    open_ = analyse_runs(CASES["three factors"][0], AnalyseOrder("runs.csv", "load", 10.0))
    known = analyse_runs(CASES["one factor"][0], AnalyseOrder("runs.csv", "load", 5.0))
    far = analyse_runs(CASES["two factors"][0], AnalyseOrder("runs.csv", "load", 1e6))
    for found in (open_, known, far):
        text, drawn = ranges_caption(found.optimum, "n = 17"), {one.get("name") for one in ranges(found.fitted)["data"]}
        assert ("bootstrap" in text) == ("95 % set of the optimum (bootstrap)" in drawn)
        assert ("gives the target" in text) == ("range that gives the target" in drawn)


def test_an_axis_has_powers_of_ten_and_no_letters_for_them():
    """By default 2e-8 would be 20n, and 1e9 1B."""
    layout = design_plots(scaled(1e-9))["Contours"].make()["layout"]
    axes = [one for key, one in layout.items() if key.startswith(("xaxis", "yaxis"))]
    assert {one["exponentformat"] for one in [*axes, layout["coloraxis"]["colorbar"]]} == {"power"}
