"""The whole analysis against published examples, and what it says where it cannot say much."""

import numpy as np
import pytest

from doe.analysis.analyse import analyse_design
from doe.analysis.contrasts import is_regular
from doe.analysis.optimum import ResponseTarget
from doe.designs import box_behnken, factorial, fold_over, plackett_burman
from doe.errors import StatisticsError
from tests.doe.analysis.textbook import (
    FILTRATION,
    FILTRATION_EFFECTS,
    FILTRATION_RATE,
    YIELD,
    YIELD_POINTS,
    YIELD_REGION,
    region,
)


def effects_of(analysis):
    return {effect.name: effect.effect for effect in analysis.effects.screening.effects}


def test_unreplicated_factorial_gives_montgomerys_effects_and_lenths_margins():
    """Montgomery 2017, example 6.2: effects, and PSE 2.625, ME 6.748, SME 13.699."""
    analysis = analyse_design(FILTRATION, FILTRATION_RATE[:, None], region("ABCD"))
    assert effects_of(analysis) == pytest.approx(FILTRATION_EFFECTS, abs=1e-12)
    lenth = analysis.effects.screening.lenth
    assert lenth.pseudo_standard_error == pytest.approx(2.625, abs=1e-12)
    assert lenth.margin == pytest.approx(6.748, abs=5e-4)
    assert lenth.simultaneous_margin == pytest.approx(13.699, abs=5e-4)
    # The five interactions of three and four are its error, and the 11 degrees of freedom of the rest its model.
    assert analysis.effects.screening.dummy_error.df == 5
    assert analysis.model.surface.df_residual == 5


def test_three_factors_of_the_same_runs_are_a_replicated_factorial():
    """Montgomery 2017, table 6.13: B dropped, 2^3 with two replicates: SS_A 1870.56, SS_AC 1314.06, SS_AD 1105.56,
    error 179.52 on 8 degrees of freedom (F_A 83.36).
    """
    analysis = analyse_design(FILTRATION[:, [0, 2, 3]], FILTRATION_RATE[:, None], region("ACD"), "interactions")
    anova = analysis.model.anova
    assert anova.row("A").sum_of_squares == pytest.approx(1870.56, abs=5e-3)
    assert anova.row("A*C").sum_of_squares == pytest.approx(1314.06, abs=5e-3)
    assert anova.row("A*D").sum_of_squares == pytest.approx(1105.56, abs=5e-3)
    assert anova.row("pure_error").sum_of_squares == pytest.approx(179.5, abs=0.05)
    assert anova.row("pure_error").df == 8


def test_half_fraction_gives_montgomerys_aliased_estimates():
    """Montgomery 2017, example 8.1: [A] = 19.00, [B] = 1.50, [C] = 14.00, [D] = 16.50, [AB] = -1.00, [AC] = -18.50,
    [AD] = 19.00, each with its alias.
    """
    design = factorial(4, ["D=ABC"]).astype(float)
    rate = np.array([45, 100, 45, 65, 75, 60, 80, 96.0])
    analysis = analyse_design(design, rate[:, None], region("ABCD"))
    expected = {"A": 19.0, "B": 1.5, "C": 14.0, "D": 16.5, "A*B": -1.0, "A*C": -18.5, "A*D": 19.0}
    assert effects_of(analysis) == pytest.approx(expected, abs=1e-12)
    aliases = analysis.effects.contrasts.aliases
    assert {name: aliases[name] for name in ("A*B", "A*C", "A*D")} == {
        "A*B": ("C*D",),
        "A*C": ("B*D",),
        "A*D": ("B*C",),
    }


def test_centre_runs_show_curvature_as_in_the_book():
    """Montgomery 2017, example 6.6: 2^2 with five centre runs: SS 0.0027 for curvature, MSE 0.043, F = 0.06."""
    design = np.vstack([factorial(2), np.zeros((5, 2))]).astype(float)
    values = np.array([39.3, 40.9, 40.0, 41.5, 40.3, 40.5, 40.7, 40.2, 40.6])
    curvature = analyse_design(design, values[:, None], region("AB")).effects.curvature
    assert curvature.difference == pytest.approx(40.425 - 40.46, abs=1e-12)
    assert curvature.sum_of_squares == pytest.approx(0.0027, abs=5e-5)
    assert curvature.error_mean_square == pytest.approx(0.043, abs=5e-4)
    assert curvature.df_error == 4


def test_central_composite_gives_the_printed_analysis():
    """Montgomery 2017, section 11.2: equation, lack of fit, fit statistics (Design-Expert) and canonical analysis."""
    analysis = analyse_design(YIELD_POINTS, YIELD[:, None], YIELD_REGION)
    model = analysis.model
    assert model.surface.coefficients == pytest.approx([79.94, 0.99, 0.52, 0.25, -1.38, -1.00], abs=6e-3)
    anova = model.anova
    assert anova.row("model").f == pytest.approx(79.67, abs=5e-3)
    assert anova.row("lack_of_fit").sum_of_squares == pytest.approx(0.28, abs=5e-3)
    assert anova.row("pure_error").sum_of_squares == pytest.approx(0.21, abs=5e-3)
    assert anova.press == pytest.approx(2.35, abs=5e-3)
    assert anova.r_squared == pytest.approx(0.9827, abs=5e-5)
    assert anova.r_squared_adjusted == pytest.approx(0.9704, abs=5e-5)
    assert model.canonical.kind == "maximum"
    assert model.canonical.stationary_coded == pytest.approx([0.389, 0.306], abs=5e-4)
    assert model.canonical.stationary_natural == pytest.approx([86.95, 176.53], abs=5e-3)
    assert model.canonical.stationary_response == pytest.approx(80.21, abs=5e-3)
    assert sorted(model.canonical.eigenvalues) == pytest.approx([-1.4141, -0.9634], abs=5e-4)


def test_unused_columns_of_a_plackett_burman_table_are_its_error():
    design = plackett_burman(12)
    values = 50 + 4 * design[:, 0] + np.random.default_rng(1).standard_normal(12)
    analysis = analyse_design(design[:, :6].astype(float), values[:, None], region("ABCDEF"))
    assert analysis.effects.contrasts.dummies == ("D1", "D2", "D3", "D4", "D5")
    assert analysis.effects.screening.dummy_error.df == 5
    # The same sum of squares as the residual of the linear model.
    residual = analysis.model.anova.row("residual").sum_of_squares
    assert 12 / 12 * analysis.effects.screening.dummy_error.sigma**2 * 5 == pytest.approx(residual, rel=1e-9)


def test_unused_columns_of_a_folded_table_are_found():
    design = fold_over(plackett_burman(12))
    values = np.random.default_rng(2).standard_normal(24)
    analysis = analyse_design(design[:, :8].astype(float), values[:, None], region("ABCDEFGH"))
    assert analysis.effects.contrasts.dummies == ("D1", "D2", "D3")


def test_saturated_screening_stands_on_lenths_margin_alone():
    design = plackett_burman(8)
    values = 10 + 3 * design[:, 2] + np.array([0.1, -0.2, 0.15, 0.05, -0.1, 0.2, -0.15, -0.05])
    analysis = analyse_design(design.astype(float), values[:, None], region("ABCDEFG"))
    assert analysis.model is None
    assert any("Lenth" in note for note in analysis.notes)
    sizes = {name: abs(effect) for name, effect in effects_of(analysis).items()}
    assert [name for name, size in sizes.items() if size > analysis.effects.screening.lenth.margin] == ["C"]


def test_replicates_decide_and_a_lost_row_leaves_the_factors():
    design = factorial(3).astype(float)
    generator = np.random.default_rng(5)
    values = 20 + 5 * design[:, [0]] + generator.standard_normal((8, 3))
    full = analyse_design(design, values, region("ABC"))
    assert full.effects.screening.error_source == "replicates"
    assert full.effects.screening.significant() == ("A",)
    values[3] = np.nan
    lost = analyse_design(design, values, region("ABC"))
    assert set(effects_of(lost)) == {"A", "B", "C", "A*B", "A*C", "B*C"}
    assert any("leave out A*B*C" in note for note in lost.notes)


@pytest.mark.parametrize("row", range(8))
def test_an_interaction_makes_no_main_effect_where_a_row_is_lost(row):
    """By main effects alone, A, B and C would be ± 2.5 each, with t = 11."""
    design = factorial(3).astype(float)
    values = 20 + 5 * design[:, [0]] * design[:, [1]] + 0.5 * np.random.default_rng(5).standard_normal((8, 3))
    values[row] = np.nan
    found = analyse_design(design, values, region("ABC")).effects.screening
    assert found.significant()[0] == "A*B"
    assert not {"A", "B", "C"} & set(found.significant())
    assert found.mean == pytest.approx(20.0, abs=0.5)


def test_a_lost_corner_is_no_curvature():
    """y = 10 + 5 A: the mean of seven corners is not the response between them."""
    design = np.vstack([factorial(3), np.zeros((4, 3))]).astype(float)
    values = 10 + 5 * design[:, 0]
    values[8:] = [9.9, 10.1, 10.0, 10.0]
    values[int(np.flatnonzero((design == 1).all(axis=1))[0])] = np.nan
    assert analyse_design(design, values[:, None], region("ABC")).effects.curvature.difference == pytest.approx(
        0.0, abs=1e-12
    )
    uneven = np.column_stack([10 + 5 * design[:, 0]] * 2)
    uneven[8:, 0] += [0.1, -0.1, 0.1, -0.1]
    uneven[0, 1] = np.nan
    assert analyse_design(design, uneven, region("ABC")).effects.curvature.difference == pytest.approx(0.0, abs=1e-12)


def test_the_error_of_a_folded_table_is_that_of_its_unused_columns():
    """An interaction of two factors is orthogonal to main effects and to the three unused columns."""
    design = fold_over(plackett_burman(12))[:, :8].astype(float)
    values = (
        20 + 2 * design[:, 0] + 5 * design[:, 0] * design[:, 1] + 0.5 * np.random.default_rng(2).standard_normal(24)
    )
    found = analyse_design(design, values[:, None], region("ABCDEFGH")).effects.screening
    assert found.dummy_error.df == 3
    assert found.dummy_error.sigma < 1.5
    assert "A" in found.significant(adjust="none")


def test_what_a_folded_table_leaves_unexplained_does_not_leak_into_its_main_effects():
    design = fold_over(plackett_burman(12))[:, :8].astype(float)
    values = 20 + 5 * design[:, [0]] * design[:, [1]] + 0.5 * np.random.default_rng(2).standard_normal((24, 2))
    (note,) = analyse_design(design, values, region("ABCDEFGH")).effects.screening.notes
    assert note.endswith("interactions act; the main effects are clear of those of two factors.")
    plain = plackett_burman(12)[:, :8].astype(float)
    (note,) = analyse_design(plain, values[:12], region("ABCDEFGH")).effects.screening.notes
    assert note.endswith("interactions leak into the main effects.")


def test_box_behnken_of_four_factors_is_solved_for_a_target():
    """Planted y = 10 + 2 A - B + A C + D^2, almost without noise: the solution lies on it."""
    design = box_behnken(4, 5).astype(float)

    def truth(x):
        return 10 + 2 * x[..., 0] - x[..., 1] + x[..., 0] * x[..., 2] + x[..., 3] ** 2

    values = truth(design) + 1e-3 * np.random.default_rng(4).standard_normal(len(design))
    analysis = analyse_design(design, values[:, None], region("ABCD"), target=ResponseTarget(11.0, 0.0, np.zeros(4)))
    assert analysis.optimum.reached
    assert truth(analysis.optimum.point) == pytest.approx(11.0, abs=5e-3)  # five times the noise
    # In the plane y = 10 + 2 A - B + … the nearest point to the centre is about (0.4, -0.2, 0, 0).
    assert analysis.optimum.distance < 0.47
    assert analysis.effects is None


def test_a_corner_beyond_every_run_is_called_an_extrapolation():
    design = box_behnken(3, 5).astype(float)
    values = 10 + design @ [1.0, 1.0, 1.0] + 0.01 * np.random.default_rng(4).standard_normal(17)
    analysis = analyse_design(design, values[:, None], region("ABC"), target=ResponseTarget(12.95, 0.0, np.zeros(3)))
    assert any("extrapolation" in note for note in analysis.notes)
    inside = analyse_design(design, values[:, None], region("ABC"), target=ResponseTarget(11.0, 0.0, np.zeros(3)))
    assert not any("extrapolation" in note for note in inside.notes)


def test_more_than_four_factors_are_not_solved_but_told():
    design = factorial(5).astype(float)
    values = 10 + design[:, 0] + 0.1 * np.random.default_rng(4).standard_normal(32)
    analysis = analyse_design(design, values[:, None], region("ABCDE"), target=ResponseTarget(10.5, 0.0, np.zeros(5)))
    assert analysis.optimum is None
    assert any("up to 4 factors" in note for note in analysis.notes)


def test_constant_response_finds_nothing_and_says_so():
    analysis = analyse_design(FILTRATION, np.full((16, 1), 7.0), region("ABCD"))
    assert not analysis.effects.screening.significant()
    assert not analysis.model.anova.better_than_noise
    assert analysis.model.box_cox.note


def test_too_few_runs_and_terms_that_cannot_be_separated_are_refused():
    design = box_behnken(3, 3).astype(float)
    values = np.full((15, 1), np.nan)
    values[[0, 1, 2]] = 1.0
    with pytest.raises(StatisticsError, match="too few for a linear model"):
        analyse_design(design, values, region("ABC"))
    with pytest.raises(StatisticsError, match="cannot separate"):
        analyse_design(FILTRATION, FILTRATION_RATE[:, None], region("ABCD"), "quadratic")
    with pytest.raises(StatisticsError, match="not a term of the model"):
        analyse_design(FILTRATION, FILTRATION_RATE[:, None], region("ABCD"), terms=["A", "Q"])


def test_a_plackett_burman_table_of_twelve_is_not_regular_but_two_of_its_columns_are():
    assert not is_regular(plackett_burman(12)[:, :3])
    assert is_regular(plackett_burman(12)[:, :2])
    assert is_regular(plackett_burman(16)[:, :10])
