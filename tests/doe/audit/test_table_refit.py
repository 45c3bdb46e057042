"""Lines of an analysis of variance from the runs: types of sums of squares, bounds over the rounding of the runs."""

from dataclasses import replace

import numpy as np
import pytest

from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import fit_surface
from doe.audit import audit_study
from doe.audit.anova_table import read_lines
from doe.audit.printed import printed
from doe.audit.study import AnovaLine, PublishedStudy, SurfaceStudy
from doe.audit.table_refit import KINDS, TableRefit
from tests.doe.audit.made_up import clean_study, show

FACTORS = ("A", "B")
SOURCES = ("Model", "B^2", "A", "B", "A*B", "Residual", "Lack of fit", "Pure error", "Total")
ORDER = ("B^2", "A", "B", "A*B")
LINES = read_lines([AnovaLine(source) for source in SOURCES], FACTORS)
POINTS = np.array(
    [(-1, -1), (1, -0.8), (-0.7, 1), (1, 1), (0, 0.2), (0, 0.2), (0.4, 0), (0.4, 0), (-1, 0.1), (0.3, -1)]
)


def refitted(responses, half=0.0):
    region = Region(FACTORS, np.array([3.0, 30.0]), np.array([1.0, 10.0]), ())
    return TableRefit(fit_surface(POINTS, responses[:, None], region, ORDER), half)


def runs(seed):
    return 5 + POINTS @ [2.0, -1.0] + np.random.default_rng(seed).normal(0, 0.8, len(POINTS))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("half", [0.05, 0.5])
def test_no_responses_in_the_box_leave_the_bounds(kind, half):
    y, rng = runs(0), np.random.default_rng(1)
    fit = refitted(y, half)
    rows, statistics = fit.rows(LINES, ORDER, kind, "residual"), fit.statistics()
    corners = np.where(rng.random((150, len(y))) < 0.5, -half, half) * rng.choice([1.0, 0.6], (150, 1))
    for moved in y + corners:
        other = refitted(moved)
        for row, truth in zip(rows, other.rows(LINES, ORDER, kind, "residual"), strict=True):
            for column, bounded in row.items():
                low, high = bounded.interval
                assert low - 1e-9 <= truth[column].value <= high + 1e-9 or not np.isfinite(truth[column].value)
        for name, bounded in other.statistics().items():
            low, high = statistics[name].interval
            assert low - 1e-9 <= bounded.value <= high + 1e-9, name


def test_without_rounding_the_bounds_are_the_value():
    for row in refitted(runs(3)).rows(LINES, ORDER, "partial", "residual"):
        for bounded in row.values():
            assert bounded.interval == pytest.approx((bounded.value,) * 2, rel=1e-9) or np.isnan(bounded.value)


def test_types_of_sums_of_squares_are_drops_of_the_residual():
    """By hand with the residual sums of squares of the models that each type compares."""
    y = runs(4)
    columns = {"A": POINTS[:, 0], "B": POINTS[:, 1], "A*B": POINTS.prod(axis=1), "B^2": POINTS[:, 1] ** 2}

    def left(terms, table=columns):
        model = np.column_stack([np.ones(len(y)), *(table[term] for term in terms)])
        return float(((y - model @ np.linalg.lstsq(model, y, rcond=None)[0]) ** 2).sum())

    x, z = 3 + POINTS[:, 0], 30 + 10 * POINTS[:, 1]
    natural = {"A": x, "B": z, "A*B": x * z, "B^2": z**2}
    drops = {
        "partial": left(["B^2", "B", "A*B"]) - left(ORDER),
        "sequential": left(["B^2"]) - left(["B^2", "A"]),
        "marginal": left(["B^2", "B"]) - left(["B^2", "B", "A"]),
        "natural": left(["B^2", "B", "A*B"], natural) - left(ORDER, natural),
    }
    assert len({round(drop, 6) for drop in drops.values()}) == 4
    for kind, drop in drops.items():
        row = refitted(y).rows(LINES, ORDER, kind, "residual")[SOURCES.index("A")]
        assert row["sum_of_squares"].value == pytest.approx(drop, rel=1e-7)


def table(fit, kind="partial", error="residual"):
    """The lines as a program prints them, to four decimals."""
    rows = fit.rows(LINES, ORDER, kind, error)
    columns = ("sum_of_squares", "df", "mean_square", "f", "p")
    return tuple(
        AnovaLine(source, *(show(row[c].value, 0 if c == "df" else 4) if c in row else None for c in columns))
        for source, row in zip(SOURCES, rows, strict=True)
    )


def study(anova, responses, decimals):
    surface = SurfaceStudy(
        where_runs="Table 1",
        where_anova="Table 2",
        where_statistics="Table 2",
        factors=FACTORS,
        screened=FACTORS,
        low=np.array([2.0, 20.0]),
        high=np.array([4.0, 40.0]),
        coded=POINTS,
        responses=tuple(show(one, decimals) for one in responses),
        anova=anova,
        statistics={},
        equation=None,
    )
    return PublishedStudy("made up", "nowhere", surfaces=(surface,))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("decimals", [12, 2, 1, 0])
def test_a_correct_table_of_any_type_is_called_wrong_by_no_rounding_of_its_runs(kind, decimals):
    y = runs(5)
    audit = audit_study(study(table(refitted(y), kind), y, decimals))
    assert audit.having("differs") == ()
    assert audit.having("cannot be checked") == ()
    if decimals == 12:
        assert audit.having("only if rounded") == ()
        stated = [remark.text for remark in audit.remarks if KINDS[kind] in remark.text]
        assert len(stated) == (kind != "partial")
    if decimals == 1:
        rounded = audit.having("only if rounded")
        assert rounded
        assert all("only if responses were rounded by up to ± 0.05, which moves it by up to" in f.how for f in rounded)
        assert all(figure.slack > 0 for figure in rounded)


def spoiled(anova, source, **cells):
    return tuple(replace(line, **cells) if line.source == source else line for line in anova)


@pytest.mark.parametrize("column, words", [("sum_of_squares", "sum of squares"), ("mean_square", "mean square")])
def test_the_figure_that_the_runs_do_not_give_is_the_wrong_one(column, words):
    """MS is not SS/df: the wrong one is the one that the runs do not give, although whole numbers have slack."""
    y = np.round(10 * runs(6))
    right = table(refitted(y))
    altered = show(getattr(right[2], column).value + 7, 4)
    audit = audit_study(study(spoiled(right, "A", **{column: altered}), y, 0))
    assert [figure.quantity for figure in audit.having("differs")] == [f"{words} of A"]


def test_terms_that_do_not_fit_the_degrees_of_freedom_accuse_nobody():
    y = runs(7)
    anova = tuple(line for line in table(refitted(y)) if line.source != "B")
    audit = audit_study(study(anova, y, 12))
    assert audit.having("differs") == ()
    (figure,) = audit.having("cannot be checked")
    assert "Model has 4 in the table, but 3 with 10 runs and the 3 terms that it names (B^2, A, A*B)" in figure.how
    # What the table says of itself is checked all the same.
    spoilt = audit_study(study(spoiled(anova, "A", f=printed("99.0000")), y, 12))
    assert [figure.quantity for figure in spoilt.having("differs")] == ["F of A"]


def test_a_table_without_a_line_that_the_fit_has_still_names_its_model():
    y = runs(8)
    anova = tuple(line for line in table(refitted(y)) if line.source not in ("Model", "Lack of fit", "Total"))
    audit = audit_study(study(anova, y, 12))
    assert len(audit.having("reproduced exactly")) == len(audit.figures) > 20
    bare = tuple(replace(line, df=None) for line in anova if line.source in ORDER)
    (figure,) = audit_study(study(bare, y, 12)).having("cannot be checked")
    assert "lacks the degrees of freedom that tell whether the model has more terms" in figure.how


def test_axial_points_printed_with_few_digits_are_those_of_the_design():
    """α = 2^(3/4) = 1.6818 printed as 1.68; the table is that of the unrounded design."""
    clean = clean_study()
    alpha = 2**0.75
    cube = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    design = np.vstack([cube, alpha * np.eye(3), -alpha * np.eye(3), np.zeros((4, 3))])
    y = 20 + design @ [2.0, 1.0, -1.0] - 1.5 * (design**2).sum(axis=1) + np.random.default_rng(2).normal(0, 0.3, 18)
    surface = replace(clean.surface, coded=design, responses=tuple(show(one, 9) for one in y), statistics={}, anova=())
    surface = replace(surface, equation=None, steps=None)
    sources = [line.source for line in clean.surface.anova]
    lines = read_lines([AnovaLine(source) for source in sources], surface.factors)
    region = Region(surface.factors, np.zeros(3), np.ones(3), ())
    rows = TableRefit(fit_surface(design, y[:, None], region), 0.0).rows(lines, sources[1:10], "partial", "residual")
    anova = tuple(
        AnovaLine(source, show(row["sum_of_squares"].value, 4), show(row["df"].value, 0))
        for source, row in zip(sources, rows, strict=True)
    )
    rounded = replace(surface, anova=anova, coded=np.where(np.abs(design) > 1, np.sign(design) * 1.68, design))
    audit = audit_study(PublishedStudy("made up", "nowhere", surfaces=(rounded,)))
    assert len(audit.having("reproduced exactly")) == len(audit.figures)
    (remark,) = audit.remarks
    assert "axial points at ± 1.6818" in remark.text
