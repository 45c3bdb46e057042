"""`explorer audit`: what it finds in the article's tables by itself, its format, its files, and its refusals."""

import dataclasses
import json
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from doe.audit import Printed, Status, audit_study, printed
from doe.audit.surface_refit import refit
from explorer.audit.read_study import places, read_study, read_table
from explorer.audit.report import HEADINGS, audit_html, audit_sections, audit_text, write_audit
from solver.assets import asset_path
from tests.doe.audit.made_up import clean_study
from tests.explorer.audit.audited_folder import write_study
from tests.explorer.command_line import explorer, refused

pytestmark = pytest.mark.usefixtures("unprinted")

SHIPPED = asset_path("source_tables", "table1_physical").parent


@pytest.fixture(scope="module")
def article():
    return audit_study(read_study(SHIPPED))


@pytest.fixture(scope="module")
def clean():
    return clean_study()


def of(audit, check, where):
    """Figures of one check at one place."""
    found = [figure for figure in audit.figures if (figure.check, figure.where) == (check, where)]
    assert found, f"{check}, {where}"
    return found


def remark(audit, check, where):
    (found,) = [one.text for one in audit.remarks if (one.check, one.where) == (check, where)]
    return found


def test_table_9_and_equation_8_reproduce_from_table_8(article):
    cells = of(article, "analysis of variance from the runs", "Table 9")
    coefficients = of(article, "printed equation", "Equation 8")
    assert (len(cells), len(coefficients)) == (52, 10)
    # Of Table 8's angles as printed it is -0.025496, which rounds to -0.025 and not to -0.026.
    (rounded,) = [figure for figure in cells + coefficients if figure.status != "reproduced exactly"]
    assert (rounded.quantity, rounded.status) == ("coefficient of X1^2", "only if rounded")
    assert "only if responses were rounded by up to ± 0.005" in rounded.how
    assert {figure.status for figure in of(article, "statistics of the fit", "section 3.3.1")} == {"reproduced exactly"}


def test_table_7_was_computed_against_23_68(article):
    errors = of(article, "relative error against the stated target", "Table 7")
    assert [figure.status for figure in errors] == ["differs"] * 6
    assert [round(figure.recomputed, 2) for figure in errors] == [23.22, 8.31, 2.55, 2.63, 8.47, 25.16]
    assert all(f"23.68 instead of 24.68 gives {figure.printed}" in figure.how for figure in errors)
    text = remark(article, "relative error against the stated target", "Table 7")
    assert "23.68 and not from the stated 24.68: one digit is another" in text


def test_the_claimed_optimum_is_a_corner_at_which_the_model_gives_another_angle(article):
    refitted, equation = of(article, "prediction at the claimed optimum", "section 3.3.2")
    assert (refitted.status, equation.status) == ("differs", "differs")
    assert (refitted.printed, equation.printed) == ("24.68", "24.68")
    assert refitted.recomputed == pytest.approx(28.335, abs=5e-4)
    assert "28.3 ± 0.4 (standard error)" in refitted.how
    assert equation.recomputed == pytest.approx(26.8, abs=0.05)
    text = remark(article, "extrapolation", "section 3.3.2")
    assert "the design's (+1, +1, +1) corner, where the design has no run" in text
    assert "1.73 against 1.41 of the farthest run, leverage 1.36 against at most 0.75" in text


def test_the_study_s_own_runs_at_that_corner_are_far_from_its_model(article):
    texts = [one.text for one in article.remarks if one.check == "runs against the model"]
    assert any("step 4 gave 25.33" in text and "28.34" in text for text in texts)
    assert any("3 runs at the claimed optimum gave 24.91" in text for text in texts)


def test_equation_8_as_printed_misses_the_design_s_own_runs(article):
    centre, worst = of(article, "printed equation at the design's own runs", "Equation 8")
    assert (centre.status, worst.status) == ("differs", "differs")
    assert centre.quantity == "response at (0, 0, 0)"
    assert float(centre.printed) == pytest.approx(23.2, abs=0.05)
    assert centre.recomputed == pytest.approx(24.37, abs=1e-9)


def test_the_error_of_table_10_divides_by_the_simulated_value(article):
    (figure,) = of(article, "relative error against the stated target", "Table 10")
    assert (figure.status, figure.printed) == ("differs", "0.923")
    assert figure.recomputed == pytest.approx(100 * (74.74 / 3 - 24.68) / 24.68)
    assert "divides by the simulated value" in figure.how


def test_the_total_of_table_5_is_table_6_and_the_residual_of_its_f_values(article):
    (figure,) = of(article, "sums of squares add up", "Table 5 and Table 6")
    assert figure.status == "reproduced exactly"
    assert figure.recomputed == pytest.approx(193.71, abs=5e-3)
    assert "192.34 of the 24 factors + 1.37 of the error" in figure.how


def test_equations_4_to_7_hold_for_a_horizontal_rebound_only(article):
    (figure,) = of(article, "formula of the restitution test", "Equations 4–7")
    assert figure.status == "differs"
    assert "only for a horizontal rebound off the 45° plate" in figure.how


def test_table_3_is_quoted_otherwise_below_table_7(article):
    """Of 20 clauses six differ; petiole–petiole's restitution is given out as a friction."""
    quotes = of(article, "values said twice", "text below Table 7")
    differ = {(figure.quantity, figure.printed): figure for figure in quotes if figure.status == "differs"}
    assert len(quotes) == 20
    assert {figure.status for figure in quotes} == {"reproduced exactly", "differs"}
    assert {key: figure.recomputed for key, figure in differ.items()} == {
        ("restitution, plate–plate", "0.86"): 0.56,
        ("static friction of an unnamed pair", "0.48"): 0.54,
        ("static friction, petiole–petiole", "0.58"): 0.83,
        ("static friction of petioles, the partner not named", "0.58"): 0.57,
        ("static friction, plate–rigid sieve plate", "0.51"): 0.61,
        ("restitution, plate–rigid sieve plate", "0.55"): 0.50,
    }
    assert "prints 0.48 as restitution of petiole–petiole" in differ["static friction of an unnamed pair", "0.48"].how


def test_the_readme_tells_the_same_counts(article):
    readme = " ".join((Path(__file__).parents[3] / "README.md").read_text(encoding="utf-8").split())
    counts = [len(article.having(status)) for status in get_args(Status)]
    exactly, rounded, other, none = counts
    said = f"of {sum(counts)} figures {exactly} are reproduced exactly and {rounded} only if the runs were rounded, "
    assert f"{said}{other} differ and {none} cannot" in readme


def test_the_ascent_is_the_grid_of_table_4_s_ranges(article):
    text = remark(article, "direction of the ascent", "Table 7")
    assert "even grid from end to end of the ranges" in text
    assert "grid's step 3 of 6" in text


def test_what_the_article_does_not_print_is_said_so(article):
    unchecked = {(figure.where, figure.quantity): figure.how for figure in article.having("cannot be checked")}
    assert "without the rows of the design" in unchecked["Table 6", "sums of squares of 24 factors"]
    assert "1.64 (Student's test)" in unchecked["Table 10", "p"]
    assert "10 values" in unchecked["section 2.6", "angle of repose"]


def test_the_three_factors_named_are_the_significant_ones(article):
    """Section 3.2: p < 0.01 for three factors, p > 0.05 for all others."""
    named, others = of(article, "significance", "Table 6")
    assert (named.status, others.status) == ("reproduced exactly", "reproduced exactly")
    assert (named.printed, others.printed) == ("X4, X7, X16", "the other 21")
    assert others.quantity == "factors not named: p > 0.05"
    assert others.how == "nearest to the level is X17 0.0537 as printed, 0.0537 from F"


def test_table_8_is_centred_on_step_3_between_steps_2_and_4(article):
    low, centre, high = of(article, "levels of the design on the walk", "Table 7 and Table 8")
    assert {figure.status for figure in (low, centre, high)} == {"reproduced exactly"}
    assert [figure.printed for figure in (low, centre, high)] == [
        "46.18, 0.52, 0.536",
        "52.26, 0.57, 0.572",
        "58.34, 0.62, 0.608",
    ]


def test_nothing_else_differs(article):
    places = {(figure.check, figure.where) for figure in article.having("differs")}
    assert places == {
        ("formula of the restitution test", "Equations 4–7"),
        ("values said twice", "text below Table 7"),
        ("relative error against the stated target", "Table 7"),
        ("relative error against the stated target", "Table 10"),
        ("printed equation at the design's own runs", "Equation 8"),
        ("prediction at the claimed optimum", "section 3.3.2"),
    }


def test_a_study_survives_its_folder(clean, tmp_path):
    again = read_study(write_study(tmp_path, clean))
    assert _plain(again) == _plain(clean)
    assert audit_study(again).having("differs") == ()


def test_a_surface_may_be_written_in_other_units(clean, tmp_path):
    """The same runs in natural units, the equation in coded ones."""
    surface = clean.surface
    folder = write_study(tmp_path, clean)
    natural = (surface.low + surface.high) / 2 + surface.coded * (surface.high - surface.low) / 2
    rows = [",".join((*map(repr, row), y.text)) for row, y in zip(natural.tolist(), surface.responses, strict=True)]
    (folder / "surface.csv").write_text("\n".join((",".join((*surface.factors, "angle")), *rows)), encoding="utf-8")
    coded = refit(surface).coefficients
    terms = "\n".join(f'"{name}" = {b:.4f}' for name, b in zip(surface.equation.coefficients, coded, strict=True))
    text = (folder / "study.toml").read_text(encoding="utf-8")
    head, _, tail = text.partition("[surface.equation]")
    end = tail[tail.index("[optimum]") :]
    equation = f'[surface.equation]\nwhere = "Equation 5"\nunits = "coded"\n[surface.equation.terms]\n{terms}\n'
    text = head.replace('runs = "surface.csv"', 'runs = "surface.csv"\ncoded = false') + equation + end
    (folder / "study.toml").write_text(text, encoding="utf-8")
    again = read_study(folder)
    assert again.surface.coded == pytest.approx(surface.coded, abs=1e-9)
    assert again.surface.equation.coded
    audit = audit_study(again)
    assert audit.having("differs") == ()
    assert len(of(audit, "printed equation", "Equation 5")) == 10


def test_a_number_is_found_in_a_table_however_it_is_printed(tmp_path):
    """Rows are named by their words; a bound, though written with the same digits, is not the number."""
    (tmp_path / "t.csv").write_text("part,form,size,p\nseed,,\u22121.2e-3,<0.05\nhusk,flat,0.05,7\n", encoding="utf-8")
    table = read_table(tmp_path, "t.csv")
    assert places(table, printed("-0.0012")) == ("size of seed",)
    assert places(table, printed("0.05")) == ("size of husk–flat",)


def _plain(value):
    """Field by field, arrays as lists; labels of parts without a name are not compared."""
    if isinstance(value, Printed):
        return value.text
    if dataclasses.is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value


def test_the_command_prints_counts_and_every_difference(article):
    result = explorer("audit")
    assert result.exit_code == 0, result.output
    assert result.stdout.rstrip("\n") == audit_text(article)
    counts = [len(article.having(status)) for status in HEADINGS]
    words = "{} differ, {} cannot be checked, {} reproduced only if rounded, {} reproduced exactly"
    assert words.format(*counts) in result.stdout
    assert "Table 10: relative error [%]: printed 0.923, recomputed 0.9454." in result.stdout


def test_plain_data_and_a_report(clean, tmp_path):
    folder = write_study(tmp_path, clean)
    result = explorer("audit", folder, "--json", "--out", tmp_path / "report")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert {figure["status"] for figure in found["figures"]} == {"reproduced exactly"}
    assert found.items() <= json.loads((tmp_path / "report" / "audit.json").read_text()).items()
    files = {"audit.json", "report.html", "report.md", "references.bib", "data", "figures"}
    assert {path.name for path in (tmp_path / "report").iterdir()} == files
    assert "is not empty" in refused(explorer("audit", folder, "--out", tmp_path / "report"))


def test_the_report_holds_every_figure_and_lets_no_markup_through(article, tmp_path):
    figure = dataclasses.replace(article.figures[0], how="<script>alert(1)</script> [link](x)")
    audit = dataclasses.replace(article, title="<b>study</b>", figures=(figure, *article.figures[1:]))
    write_audit(audit, tmp_path)
    html, markdown = (tmp_path / "report.html").read_text(), (tmp_path / "report.md").read_text()
    assert "<script>alert" not in html
    assert "<b>study" not in html
    assert "\\<script\\>" in markdown
    for one in article.figures[1:]:
        assert one.where in markdown
    assert html.count("<tr>") >= len(article.figures)


def test_a_study_in_which_nothing_differs_has_no_empty_section(clean):
    titles = [section.title for section in audit_sections(audit_study(clean))]
    assert titles == ["In short", "What is reproduced exactly"]
    assert "What is reproduced" in audit_html(audit_study(clean))


SPOILED = {
    "no target": ("study.toml", "[target]", "[aim]", "aim: unknown key; allowed"),
    "unknown key": ("study.toml", "n = 6", "number = 6", "target.number: unknown key; allowed:"),
    "format": ("study.toml", "format = 1", "format = 2", "format: this program reads format 1"),
    "not toml": ("study.toml", "[target]", "[target", "study.toml: Expected"),
    "no number": ("study.toml", "mean = 29.98", "mean = true", "target.mean: a number is needed, not True"),
    "zero": ("study.toml", "mean = 29.98", "mean = 0", "target.mean: 0 is not allowed"),
    "nan": ("study.toml", "mean = 29.98", "mean = nan", "target.mean: 'nan' is not a printed number"),
    "no file": ("study.toml", '"shares.csv"', '"elsewhere.csv"', "elsewhere.csv: no such file"),
    "other folder": ("study.toml", '"shares.csv"', '"../shares.csv"', "is not the name of a file beside study.toml"),
    "column": ("study.toml", 'column = "share"', 'column = "part of it"', "shares.csv: no column 'part of it'"),
    "text in a column": ("shares.csv", "18.50", "much", "shares.csv, line 3, share: 'much' is not a printed number"),
    "ragged": ("shares.csv", "18.50", "18.50,1", "shares.csv, line 3: 3 cells; the table has 2 columns"),
    "formula": ("study.toml", "E / (2 * G) - 1", "open('x')", "is not arithmetic"),
    "name in a formula": ("study.toml", "(vx + vy) / v", "vz / v", "drop_test.formula: 'vz' is not known"),
    "angle": (
        "study.toml",
        "plate_angle_deg = 45.0",
        "plate_angle_deg = 120",
        "120 is not allowed; allowed: above 0, up to 89",
    ),
    "restitution": ("drop.csv", "0.55", "5.5", "drop_test.column: a restitution of 5.5 is not allowed; allowed: 0 … 1"),
    "size": ("surface.csv", ",3", ",1e300\n#", "'1e300' is out of range"),
    "row": ("study.toml", 'pair = "0"', 'pair = "9"', "quoted 1.row: 0 rows of drop.csv fit; exactly one is needed"),
    "range": ("study.toml", "low = 20.0", "low = 60.0", "surface.factor: low must be below high"),
    "term": ("study.toml", '"A*B" =', '"A*D" =', "A*D: is not one of 1, A, B, C"),
    "best": ("study.toml", "[ascent]", '[ascent]\nfoo = "1"', "ascent.foo: unknown key"),
    "step": (
        "study.toml",
        'centre = "3"',
        'centre = "9"',
        "surface.steps.centre: '9' is not a step of the ascent; allowed: 1",
    ),
    "significant": ("study.toml", '["F1"', '["G1"', "screening.significant: 'G1' is not one of F1"),
    "empty": ("shares.csv", None, "", "a line of column names and at least one row are needed"),
    "binary": ("shares.csv", None, b"\xff\xfe\x00", "neither text nor a workbook"),
}


@pytest.mark.parametrize("name", SPOILED)
def test_a_bad_folder_is_one_line(clean, tmp_path, name):
    file, old, new, line = SPOILED[name]
    path = write_study(tmp_path, clean) / file
    if old is None:
        path.write_bytes(new if isinstance(new, bytes) else new.encode())
    else:
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), encoding="utf-8")
    said = refused(explorer("audit", tmp_path))
    assert line in said
    assert said.startswith(str(tmp_path))


def test_a_folder_that_is_none_is_one_line(tmp_path):
    assert refused(explorer("audit", tmp_path / "nowhere")) == f"{tmp_path / 'nowhere'}: no such folder"
    assert "study.toml: no such file" in refused(explorer("audit", tmp_path))
