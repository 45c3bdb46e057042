"""What single runs and levels ask for: lost cells, slips of the pen, factors that nothing tells apart."""

import math

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf

from doe.analysis.surface_anova import CONSTANT
from doe.designs import morris
from explorer.design.analysis import FAR, AnalyseOrder, run_analyse
from explorer.design.factors_file import coded_constraint, make_factor
from explorer.errors import CommandError

HEAD = "# factor | temp | 150 | 200 | °C\n# factor | agit | 5 | 10\n# factor | rate | 15 | 25\ntemp,agit,rate,visc\n"
# Box–Behnken in three factors with three centre runs (Myers and Montgomery 2002, example 7.5).
RUNS = """150,5,20,53
200,5,20,58
150,10,20,59
200,10,20,56
150,7.5,15,64
200,7.5,15,45
150,7.5,25,35
200,7.5,25,60
175,5,15,59
175,10,15,64
175,5,25,53
175,10,25,65
175,7.5,20,65
175,7.5,20,59
175,7.5,20,62
"""
LOST = RUNS.replace("150,10,20,59", "150,10,20,").replace("200,7.5,15,45", "200,7.5,15,NA")


def analysed(tmp_path, runs, head=HEAD, **asked):
    sheet = tmp_path / "sheet.csv"
    sheet.write_text(head + runs, encoding="utf-8")
    return run_analyse(AnalyseOrder(str(sheet), **asked))


def test_a_whole_sheet_needs_no_note(tmp_path):
    assert analysed(tmp_path, RUNS).analysis.notes == ()


def test_two_lost_cells_name_the_runs_that_nothing_checks(tmp_path):
    found = analysed(tmp_path, LOST, target=60.0).analysis
    # With rows 3 and 6 lost, each run that shares an edge of the cube with both, or stands across, fills a gap alone:
    # p = 0.03 holds as it did, and only what leaves such a run out cannot be told.
    (note, *_) = [one for one in found.notes if one.startswith("Runs ")]
    assert "line 6, line 11, line 13, line 16: without any of them this model cannot be fitted" in note
    assert found.model.anova.row("model").p == pytest.approx(0.0320, abs=5e-4)
    assert found.model.anova.better_than_noise
    assert found.optimum.better_than_noise
    assert not any("not better than noise" in one for one in (*found.notes, *found.model.anova.notes))
    for line in ("6", "11", "13", "16"):  # the claim itself: each is indispensable
        rest = "".join(row for k, row in enumerate(LOST.splitlines(True), start=5) if str(k) != line)
        with pytest.raises(CommandError, match="cannot separate the 10 terms"):
            analysed(tmp_path, rest, order="quadratic")


def test_a_level_that_is_off_by_a_factor_of_ten_is_named(tmp_path):
    notes = analysed(tmp_path, RUNS.replace("150,10,20", "1500,10,20")).analysis.notes
    # (1500 − 175)/25 half-widths.
    assert "line 7: temp is 1500, 53.0 half-widths from the middle of 150 … 200: a slip?" in notes[0]
    star = 175 + 25 * 2**1.25  # of a rotatable design in five factors
    assert analysed(tmp_path, RUNS + f"{star},7.5,20,61\n").analysis.notes == ()
    assert FAR > 2**1.25


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t, a, r: (175.0, a, r), "column temp: is 175 in every run with a result, .* --only agit,rate"),
        (lambda t, a, r: (t, a, (t - 75) / 5), "temp and rate change together in every run, .* --only temp,agit"),
        (
            lambda t, a, r: (150 + 5 * (a - 5) + 2 * (r - 15), a, r),
            "temp, agit and rate change together in every run, .* --only temp,agit",
        ),
    ],
)
def test_factors_that_nothing_tells_apart_are_named(tmp_path, change, said):
    rows = [[float(cell) for cell in line.split(",")] for line in RUNS.splitlines()]
    runs = "".join(",".join(f"{one:g}" for one in (*change(*row[:3]), row[3])) + "\n" for row in rows)
    with pytest.raises(CommandError, match=said):
        analysed(tmp_path, runs)


def test_a_mixture_beside_another_factor_is_called_one(tmp_path):
    parts = "# factor | a | 0 | 1\n# factor | b | 0 | 1\n# factor | c | 0 | 1\n"
    head = parts + "a,b,c,y\n"
    blends = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5), (1 / 3, 1 / 3, 1 / 3)]
    runs = "".join(f"{a:.12g},{b:.12g},{c:.12g},{5 + a + 2 * b}\n" for a, b, c in blends)
    heat = "".join(f"{line},{k % 2}\n" for k, line in enumerate(runs.split()))
    with pytest.raises(CommandError, match=r"a, b and c add up to 1 in every run: a mixture, .* --only a,b,heat$"):
        analysed(tmp_path, heat, parts + "# factor | heat | 0 | 1\na,b,c,y,heat\n")
    assert analysed(tmp_path, runs, head).analysis.mixture is not None
    # One component follows from the others: with one left out it is a plane, which is found.
    found = analysed(tmp_path, runs, head, only=("a", "b"))
    assert found.analysis.fits[0].r_squared == pytest.approx(1.0)


BLOCKED = (
    "# factor | Time | 80 | 90\n# factor | Temp | 170 | 180\nbatch,Time,Temp,y\n"
    "b1,80,170,80.5\nb1,80,180,81.5\nb1,90,170,82\nb1,90,180,83.5\nb1,85,175,83.9\nb1,85,175,84.3\nb1,85,175,84\n"
    "b2,85,175,79.7\nb2,85,175,79.8\nb2,85,175,79.5\nb2,92.07,175,78.4\nb2,77.93,175,75.6\nb2,85,182.07,78.5\n"
    "b2,85,167.93,77\n"
)
"""Myers, Montgomery and Anderson-Cook, table 7.6: `ChemReact` of the R package rsm, whose vignette analyses it."""


def test_runs_in_blocks_are_analysed_as_rsm_does(tmp_path):
    found = analysed(tmp_path, BLOCKED, "", block="batch").analysis
    surface, anova = found.model.surface, found.model.anova
    # rsm 2.10, rsm(Yield ~ Block + SO(x1, x2)): R² 0.9981; lack of fit F = 0.53 on 3 and 4 df, p = 0.6851.
    assert anova.r_squared == pytest.approx(0.9981, abs=5e-5)
    lack = anova.row("lack_of_fit")
    assert (lack.df, anova.row("pure_error").df, anova.row("block").df) == (3, 4, 1)
    assert (lack.f, lack.p) == (pytest.approx(0.53, abs=5e-3), pytest.approx(0.6851, abs=5e-5))
    assert anova.row("block").sum_of_squares == pytest.approx(69.531, abs=5e-4)
    # Stationary point 0.3722954, 0.3343802 of its canonical analysis, whose levels are rounded as here.
    assert found.model.canonical.stationary_coded == pytest.approx([0.3723, 0.3344], abs=2e-4)
    # The blocks' effects cancel, and what is predicted is their mean.
    assert surface.block_names == ("b1", "b2")
    assert surface.block_effects.sum() == pytest.approx(0.0, abs=1e-12)
    assert surface.block_effects[0] > 2.0
    assert found.notes == ()


def test_least_squares_with_blocks_are_those_of_statsmodels(tmp_path):
    found = analysed(tmp_path, BLOCKED, "", block="batch").analysis.model
    rows = [line.split(",") for line in BLOCKED.splitlines()[3:]]
    time, temp, y = (np.array([float(row[k]) for row in rows]) for k in (1, 2, 3))
    data = {"a": (time - 85) / 5, "b": (temp - 175) / 5, "y": y, "batch": [row[0] for row in rows]}
    fit = smf.ols("y ~ C(batch, Sum) + a*b + I(a**2) + I(b**2)", pd.DataFrame(data)).fit()
    names = ("Intercept", "a", "b", "a:b", "I(a ** 2)", "I(b ** 2)")
    assert found.surface.coefficients == pytest.approx([fit.params[name] for name in names], rel=1e-9)
    assert found.anova.coefficient_standard_errors == pytest.approx([fit.bse[name] for name in names], rel=1e-9)
    assert found.anova.press == pytest.approx((fit.get_influence().resid_press ** 2).sum(), rel=1e-9)
    assert found.diagnostics.cooks_distance == pytest.approx(fit.get_influence().cooks_distance[0], rel=1e-8)


def test_blocks_that_nobody_named_are_noticed(tmp_path):
    notes = analysed(tmp_path, BLOCKED, "").analysis.notes
    assert any(one.startswith("Not used: batch.") for one in notes)
    # Seven residuals above zero, then seven below: 2 of C(14, 7) arrangements have two stretches.
    (drift,) = [one for one in notes if "change their sign 1 times" in one]
    assert f"(p = {2 / math.comb(14, 7):.2g})" in drift


def test_a_block_that_is_none_is_refused_in_one_line(tmp_path):
    with pytest.raises(CommandError, match=r"--block shift: no such column for blocks; the other columns are batch$"):
        analysed(tmp_path, BLOCKED, "", block="shift")
    with pytest.raises(CommandError, match="line 4, column batch: is empty"):
        analysed(tmp_path, BLOCKED.replace("b1,80,170", ",80,170"), "", block="batch")
    with pytest.raises(CommandError, match="every valid run is in block 'b1'; at least two"):
        analysed(tmp_path, BLOCKED.replace("b2,", "b1,"), "", block="batch")


NAMED_AS_LETTERS = "# factor | T | 0 | 1\n# factor | C | 0 | 1\n# factor | P | 0 | 1\nT,C,P,y\n"


def test_a_name_that_is_another_factor_s_letter_is_the_name(tmp_path):
    """T, C and P go by the letters A, B and C: the response follows the factor C, whose letter is B."""
    runs = "".join(f"{t},{c},{p},{5 * c + 0.1 * t * p}\n" for t in (0, 1) for c in (0, 1) for p in (0, 1))
    found = analysed(tmp_path, runs, NAMED_AS_LETTERS, terms=("C",)).analysis.model
    assert np.array(found.surface.terms)[found.surface.included].tolist() == ["intercept", "B"]
    assert found.anova.r_squared > 0.99
    assert analysed(tmp_path, runs, NAMED_AS_LETTERS, terms=("P", "A")).analysis.model.anova.r_squared < 0.01


def test_a_factor_called_e_is_no_exponent():
    factors = tuple(make_factor(name, -1.0, 1.0, "", None, "factor") for name in "ABCDE")
    assert coded_constraint("2E+3B<=10", factors) == pytest.approx((0.0, 3.0, 0.0, 0.0, 2.0, 10.0))
    assert coded_constraint("2e1 A<=10", factors[:2]) == pytest.approx((20.0, 0.0, 10.0))


def test_a_constraint_on_a_name_that_is_another_factor_s_letter_is_on_the_name():
    factors = tuple(make_factor(name, 0.0, 1.0, "", None, "factor") for name in "TCP")
    assert coded_constraint("C <= 0.5", factors) == pytest.approx((0.0, 0.5, 0.0, 0.0))
    assert coded_constraint("B + A <= 0.5", factors) == pytest.approx((0.5, 0.5, 0.0, -0.5))


def test_a_mixture_of_rounded_amounts_is_refused(tmp_path):
    """As an ordinary polynomial of nearly dependent factors it would have no significant part."""
    head = "# design | mixture\n" + "".join(f"# factor | {name} | 0 | 1\n" for name in "abc") + "a,b,c,y\n"
    blends = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5), (0.33, 0.33, 0.33)] * 2
    runs = "".join(f"{a},{b},{c},{5 + a + 2 * b}\n" for a, b, c in blends)
    with pytest.raises(CommandError, match=r"add up to 0\.99 … 1; allowed: the same sum in every run"):
        analysed(tmp_path, runs, head)


def test_a_constant_mixture_is_told_in_a_note(tmp_path):
    blends = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)] * 2
    parts = "# factor | a | 0 | 1\n# factor | b | 0 | 0.5\n# factor | c | 0 | 1\na,b,c,y\n"
    same = "".join(f"{a},{b},{c},5.1\n" for a, b, c in blends)
    assert analysed(tmp_path, same, parts).analysis.notes[1] == CONSTANT
    other = "".join(f"{a},{b},{c},{5 + a + 2 * b}\n" for a, b, c in blends)
    found = analysed(tmp_path, other, parts).analysis
    assert CONSTANT not in found.notes
    assert found.mixture.highest.amounts == pytest.approx([0.5, 0.5, 0.0])  # b keeps to its high


def test_effects_of_some_factors_of_a_morris_design_come_from_its_own_steps(tmp_path):
    """y = 100 x2 + x0: where x0 alone moves the response changes by its 1 alone, whatever else is left out."""
    design = (morris(3, 10, 1) + 1) / 2
    head = "# design | morris\n" + "".join(f"# factor | x{k} | 0 | 1\n" for k in range(3)) + "x0,x1,x2,y\n"
    runs = "".join(f"{a:.12g},{b:.12g},{c:.12g},{100 * c + a:.12g}\n" for a, b, c in design)
    whole = analysed(tmp_path, runs, head).analysis.elementary
    found = analysed(tmp_path, runs, head, only=("x0",)).analysis.elementary
    assert (whole.steps, found.steps) == (30, 10)
    assert found.effects[0].mu_star == pytest.approx(1.0)
    assert found.effects[0].effects == pytest.approx(whole.effects[0].effects)
