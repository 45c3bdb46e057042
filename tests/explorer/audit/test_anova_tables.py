"""Folders with printed analyses of variance: what is altered or a slip is found, what is correct is left alone.

`cases` and `tables` are described in README.md beside them.
"""

from dataclasses import replace
from pathlib import Path
from shutil import copytree

import pytest

from doe.audit import audit_study, printed
from explorer.audit.read_study import read_study
from tests.explorer.command_line import explorer, refused

HERE = Path(__file__).parent
TABLES = sorted(folder.name for folder in (HERE / "tables").iterdir() if folder.is_dir())
SLIP = {"F of B*C": ("1.22", 1.195)}
"""Myers and Montgomery print 1.22 where 12.25/10.25 is 1.195."""
CASES = {
    "au": SLIP,
    "au2": {"F of A*C": ("40.22", 47.22)} | SLIP,
    "au3": {},
    "au5": SLIP,
    "au6": SLIP,
}


def audited(folder):
    return audit_study(read_study(folder))


@pytest.mark.parametrize("case", CASES)
def test_the_slip_and_the_altered_figure_are_found_and_nothing_else(case):
    """Whole runs (au, au2) hide none of them; a reduced model (au3) and "Error" (au5) are no faults."""
    audit = audited(HERE / "cases" / case)
    found = {figure.quantity: (figure.printed, figure.recomputed) for figure in audit.having("differs")}
    assert found == {name: (text, pytest.approx(value, abs=5e-4)) for name, (text, value) in CASES[case].items()}
    assert {figure.check for figure in audit.having("differs")} <= {"analysis of variance in itself"}
    # 733.35 is 933.73 − 200.38; unrounded it is 733.358. R: pf(9.14982, 4, 10, lower.tail = FALSE) is 0.00224227, which
    # was rounded up.
    rounded = [figure.printed for figure in audit.having("only if rounded")]
    assert rounded == (["733.35", "0.0023"] if case == "au3" else [])
    assert [figure.where for figure in audit.having("cannot be checked")] == ["made up"]
    assert len(audit.having("reproduced exactly")) >= 40


@pytest.mark.parametrize("table", TABLES)
def test_a_correct_table_of_any_program_is_left_alone(table):
    audit = audited(HERE / "tables" / table)
    assert audit.having("differs") == ()
    assert audit.having("cannot be checked") == ()
    assert len(audit.figures) > 10
    assert bool(audit.having("only if rounded")) == (table == "r_rsm_rounded_runs")


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("with_runs", [True, False])
def test_one_altered_f_is_found_in_every_table_with_and_without_its_runs(table, with_runs):
    study = read_study(HERE / "tables" / table)
    (surface,) = study.surfaces
    k, line = next((k, line) for k, line in enumerate(surface.anova) if line.f is not None)
    digits = line.f.text
    wrong = printed(("2" if digits[0] != "2" else "3") + digits[1:])
    anova = (*surface.anova[:k], replace(line, f=wrong), *surface.anova[k + 1 :])
    altered = replace(surface, anova=anova)
    if not with_runs:
        altered = replace(altered, responses=(), coded=surface.coded[:0])
    (figure,) = audit_study(replace(study, surfaces=(altered,))).having("differs")
    assert (figure.quantity[:5], figure.printed) == ("F of ", wrong.text)
    assert figure.recomputed == pytest.approx(line.f.value, rel=0.02)


def test_the_type_of_sums_of_squares_is_said():
    texts = {table: [remark.text for remark in audited(HERE / "tables" / table).remarks] for table in TABLES}
    assert {table for table, said in texts.items() if said} == {
        "r_anova_unbalanced",
        "r_rsm_rounded_runs",
        "sas_glm_natural",
    }
    assert "sequential sums of squares (Type I), in the order of the table" in texts["r_anova_unbalanced"][0]
    assert "partial sums of squares in natural units" in texts["sas_glm_natural"][0]


def case(tmp_path, name="au2"):
    folder = copytree(HERE / "cases" / name, tmp_path / name)
    toml = folder / "study.toml"
    return folder, toml, toml.read_text(encoding="utf-8")


def without_target(text):
    return text[: text.index("[target]")]


def test_a_table_needs_no_runs_and_no_target(tmp_path):
    folder, toml, text = case(tmp_path)
    (folder / "table_runs.csv").unlink()
    bare = "\n".join(line for line in without_target(text).splitlines() if not line.startswith(("runs", "response")))
    toml.write_text(bare.replace('where_runs = "Example 7.5"', ""), encoding="utf-8")
    audit = audited(folder)
    assert {figure.quantity for figure in audit.having("differs")} == set(CASES["au2"])
    (figure,) = audit.having("cannot be checked")
    assert (figure.quantity, figure.how) == ("28 figures that only the runs can give", "the runs are not printed")


def test_several_surfaces_are_audited_each_by_itself(tmp_path):
    folder, toml, text = case(tmp_path)
    (folder / "reduced.csv").write_bytes((HERE / "cases" / "au3" / "table_anova.csv").read_bytes())
    first = without_target(text).replace("[surface]", "[[surface]]")
    second = first[first.index("[[surface]]") :].replace("table_anova.csv", "reduced.csv")
    second = second.replace("ANOVA of example 7.5", "reduced model")
    toml.write_text(first + second, encoding="utf-8")
    audit = audited(folder)
    assert [(figure.where, figure.quantity) for figure in audit.having("differs")] == [
        ("ANOVA of example 7.5", name) for name in CASES["au2"]
    ]
    optimum = '[optimum]\nwhere = "text"\npredicted = 60.0\nvalues = { A = 175, B = 7.5, C = 20 }\n'
    toml.write_text(first + second + optimum, encoding="utf-8")
    assert "optimum.surface: is missing" in refused(explorer("audit", folder))
    toml.write_text(first + second + optimum + 'surface = "reduced model"\n', encoding="utf-8")
    (predicted,) = [f for f in audited(folder).figures if f.check == "prediction at the claimed optimum"]
    # The mean of the runs with A at 0 in the reduced model, which has no other term there.
    assert predicted.recomputed == pytest.approx((59 + 64 + 53 + 65 + 65 + 59 + 62) / 7)
    toml.write_text(first + second + optimum + 'surface = "elsewhere"\n', encoding="utf-8")
    assert "'elsewhere' is not one of ANOVA of example 7.5, reduced model" in refused(explorer("audit", folder))


def test_a_table_whose_degrees_of_freedom_do_not_fit_cannot_be_checked(tmp_path):
    """The reduced model without its line of C: four terms in the model, three in the table."""
    folder, _, _ = case(tmp_path, "au3")
    table = folder / "table_anova.csv"
    lines = table.read_text(encoding="utf-8").splitlines()
    table.write_text("\n".join(line for line in lines if not line.startswith("C,")), encoding="utf-8")
    audit = audited(folder)
    assert audit.having("differs") == ()
    assert "degrees of freedom do not fit: Model has 4" in audit.having("cannot be checked")[1].how
