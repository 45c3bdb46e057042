"""The checks on a clean made-up study, where they must find nothing, and on the same study with one fault planted."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from doe.audit import audit_study
from doe.audit.printed import printed
from doe.audit.study import DesignSteps
from doe.audit.surface_refit import refit
from tests.doe.audit.made_up import CHOSEN, clean_study, shown


@pytest.fixture(scope="module")
def clean():
    return clean_study()


def at(sequence, k, value):
    """The sequence with one entry replaced."""
    return tuple(value if i == k else entry for i, entry in enumerate(sequence))


def differing(study):
    return [(f.check, f.where, f.quantity) for f in audit_study(study).having("differs")]


def test_nothing_is_wrong_with_the_clean_study(clean):
    audit = audit_study(clean)
    assert audit.having("differs") == ()
    assert audit.having("cannot be checked") == ()
    assert audit.remarks == ()
    assert len(audit.figures) > 120


@pytest.mark.parametrize("seed", range(5))
def test_no_figure_of_a_clean_study_is_called_wrong_whatever_its_noise(seed):
    assert differing(clean_study(seed)) == []


def derived(study):
    return replace(
        study, derived=(replace(study.derived[0], printed=at(study.derived[0].printed, 1, printed("0.33"))),)
    )


def mean_of_replicates(study):
    return replace(study, measured=(replace(study.measured[0], printed=shown([1223, 352], 0)),))


def target_sd(study):
    return replace(study, target=replace(study.target, sd=printed("0.75")), verified=None)


def target_number(study):
    return replace(study, target=replace(study.target, n=10), verified=None)


def shares(study):
    return replace(study, totals=(replace(study.totals[0], total=printed("101.00")),))


def quote(study):
    return replace(study, quotes=(replace(study.quotes[0], value=printed("0.60")),))


def drop_formula(study):
    return replace(study, drop_test=replace(study.drop_test, formula="L / (2 * H)"))


def f_value(study):
    screening = study.screening
    return replace(study, screening=replace(screening, f=at(screening.f, 3, printed("99.000")), p=screening.p))


def p_value(study):
    screening = study.screening
    wrong = printed(f"{min(1.0, screening.p[5].value + 0.02):.5f}")
    return replace(study, screening=replace(screening, p=at(screening.p, 5, wrong)))


def screening_sum(study):
    screening = study.screening
    wrong = printed(f"{screening.sums[0].value + 3:.4f}")
    return replace(study, screening=replace(screening, sums=at(screening.sums, 0, wrong)))


def screening_total(study):
    screening = study.screening
    return replace(study, screening=replace(screening, total=printed(f"{screening.total.value + 2:.2f}")))


def one_significant_factor_not_named(study):
    return replace(study, screening=replace(study.screening, significant=("F1", "F2")))


def one_named_factor_too_many(study):
    return replace(study, screening=replace(study.screening, significant=("F1", "F2", "F3", "F5")))


def one_other_factor_below_its_level(study):
    """F4 has p = 0.038: not significant at 0.01, but p > 0.05 is not true of it."""
    return replace(study, screening=replace(study.screening, level_of_others=0.05))


def a_printed_p_that_hides_a_factor(study):
    """F says p < 0.0001, the print 0.21, and the factor is not named."""
    screening = study.screening
    wrong = replace(screening, p=at(screening.p, 4, printed("0.21")), significant=("F1", "F2"))
    return replace(study, screening=wrong)


def design_levels(study):
    return replace(study, surfaces=(replace(study.surface, steps=DesignSteps("1", "3", "4")),))


def design_centre(study):
    return replace(study, surfaces=(replace(study.surface, steps=DesignSteps("2", "4", "4")),))


def one_ascent_error(study):
    return replace(study, ascent=replace(study.ascent, errors=at(study.ascent.errors, 2, printed("4.49"))))


def best_step(study):
    return replace(study, ascent=replace(study.ascent, best="1"))


def anova_cell(study):
    line = study.surface.anova[2]
    wrong = replace(line, sum_of_squares=printed(f"{line.sum_of_squares.value + 1:.4f}"))
    return replace(study, surfaces=(replace(study.surface, anova=at(study.surface.anova, 2, wrong)),))


def anova_total(study):
    line = study.surface.anova[-1]
    wrong = replace(line, sum_of_squares=printed(f"{line.sum_of_squares.value + 1:.4f}"))
    return replace(study, surfaces=(replace(study.surface, anova=(*study.surface.anova[:-1], wrong)),))


def r_squared(study):
    return replace(study, surfaces=(replace(study.surface, statistics={"r_squared": printed("0.8123")}),))


def coefficient(study):
    equation = study.surface.equation
    wrong = printed(f"{equation.coefficients['A*C'].value + 0.0019:.5f}")
    changed = replace(equation, coefficients={**equation.coefficients, "A*C": wrong})
    return replace(study, surfaces=(replace(study.surface, equation=changed),), optimum=None)


def verified_mean(study):
    return replace(study, verified=replace(study.verified, mean=printed("30.92"), relative_error_percent=None))


def verified_p(study):
    return replace(study, verified=replace(study.verified, p_two_sample=printed("0.912")))


ON_THE_WALK = "levels of the design on the walk"
PLANTED = {
    derived: ("stated formula", "Table 1", "Poisson's ratio, husk"),
    mean_of_replicates: ("mean of replicates", "Table 1", "density, husk"),
    target_sd: ("mean of replicates", "section 2", "angle of repose, standard deviation"),
    target_number: ("mean of replicates", "section 2", "angle of repose, number of values"),
    shares: ("parts add up", "Table 2", "share [%]"),
    quote: ("values said twice", "section 4", "restitution"),
    drop_formula: ("formula of the restitution test", "Equation 4", "e = L / (2 * H), put in 0.4"),
    f_value: ("F from sums of squares", "Table 5", "F of F4"),
    p_value: ("p from F", "Table 5", "p of F6"),
    screening_sum: ("sums of squares from the design", "Table 5", "sum of squares of F1"),
    screening_total: ("sums of squares add up", "Table 5", "total sum of squares"),
    one_significant_factor_not_named: ("significance", "Table 5", "factors not named: p > 0.01"),
    one_named_factor_too_many: ("significance", "Table 5", "factors named: p < 0.01"),
    one_other_factor_below_its_level: ("significance", "Table 5", "factors not named: p > 0.05"),
    a_printed_p_that_hides_a_factor: ("significance", "Table 5", "factors not named: p > 0.01"),
    one_ascent_error: ("relative error against the stated target", "Table 6", "relative error [%], step 3"),
    best_step: ("nearest step", "Table 6", "step nearest to the target"),
    design_levels: (ON_THE_WALK, "Table 6 and Table 7", "level −1 of the design, the lower of steps 1 and 4"),
    design_centre: (ON_THE_WALK, "Table 6 and Table 7", "level 0 of the design, step 4"),
    anova_cell: ("analysis of variance from the runs", "Table 8", "sum of squares of B"),
    anova_total: ("sums of squares add up", "Table 8", "sum of squares of total"),
    r_squared: ("statistics of the fit", "section 4", "R²"),
    coefficient: ("printed equation", "Equation 5", "coefficient of A*C"),
    verified_mean: ("mean of replicates", "Table 9", "mean response"),
    verified_p: ("two-sample t test", "Table 9", "p"),
}
ALSO = {
    # A wrong F belongs to another p (and makes F4 significant), a wrong sum to another F; a wrong total is not that of
    # the runs either.
    f_value: ("p from F", "significance"),
    a_printed_p_that_hides_a_factor: ("p from F",),
    # Step 1 is the higher one of the factor that the walk lowers.
    design_levels: (ON_THE_WALK,),
    screening_sum: ("F from sums of squares", "sums of squares add up"),
    anova_total: ("analysis of variance from the runs",),
}


@pytest.mark.parametrize("plant", PLANTED, ids=lambda plant: plant.__name__)
def test_one_planted_fault_is_found_and_nothing_else(clean, plant):
    found = differing(plant(clean))
    assert PLANTED[plant] in found
    others = [one for one in found if one != PLANTED[plant]]
    assert {check for check, _, _ in others} <= set(ALSO.get(plant, ()))
    assert len(others) <= len(ALSO.get(plant, ()))


def test_errors_against_another_target_are_recognised(clean):
    wrong = [100 * abs(one.value - 29.0) / 29.0 for one in clean.ascent.responses]
    audit = audit_study(replace(clean, ascent=replace(clean.ascent, errors=shown(wrong, 2))))
    assert len(audit.having("differs")) == 6
    assert all("29.0 instead of" in f.how or "29.00 instead of" in f.how for f in audit.having("differs"))
    (remark,) = audit.remarks
    assert f"29.00 and not from the stated {clean.target.mean.text}" in remark.text


def test_an_error_divided_by_the_simulated_value_is_recognised(clean):
    mean, stated = clean.verified.mean.value, clean.target.mean.value
    wrong = printed(f"{100 * abs(mean - stated) / mean:.3f}")
    (figure,) = audit_study(replace(clean, verified=replace(clean.verified, relative_error_percent=wrong))).having(
        "differs"
    )
    assert "divides by the simulated value" in figure.how


def test_an_optimum_elsewhere_than_the_target_is_found(clean):
    centre = shown((clean.surface.low + clean.surface.high) / 2 + 0.3 * (clean.surface.high - clean.surface.low), 3)
    audit = audit_study(replace(clean, optimum=replace(clean.optimum, values=centre), verified=None))
    assert [f.quantity for f in audit.having("differs")] == [
        "refitted model at the optimum",
        "Equation 5 as printed at the optimum",
    ]
    (remark,) = audit.remarks
    assert "the nearest to the claimed one" in remark.text


def test_a_corner_of_a_box_behnken_design_is_extrapolation(clean):
    corner = shown((clean.surface.low[0], clean.surface.low[1], clean.surface.high[2]), 2)
    audit = audit_study(replace(clean, optimum=replace(clean.optimum, values=corner), verified=None))
    texts = [remark.text for remark in audit.remarks if remark.check == "extrapolation"]
    assert len(texts) == 1
    assert "the design's (−1, −1, +1) corner, where the design has no run" in texts[0]
    assert "1.73 against 1.41" in texts[0]


def test_runs_of_the_design_s_edge_are_no_extrapolation(clean):
    edge = shown(
        (clean.surface.high[0], clean.surface.high[1], clean.surface.low[2] / 2 + clean.surface.high[2] / 2), 2
    )
    audit = audit_study(replace(clean, optimum=replace(clean.optimum, values=edge), verified=None))
    assert not [remark for remark in audit.remarks if remark.check == "extrapolation"]


def test_coefficients_with_too_few_digits_miss_the_design_s_own_runs(clean):
    equation = clean.surface.equation
    coarse = {name: printed(f"{cell.value:.2g}") for name, cell in equation.coefficients.items()}
    study = replace(
        clean, surfaces=(replace(clean.surface, equation=replace(equation, coefficients=coarse)),), optimum=None
    )
    audit = audit_study(study)
    missed = [f for f in audit.having("differs") if f.check == "printed equation at the design's own runs"]
    assert missed
    assert any("half a unit in the last digit" in remark.text for remark in audit.remarks)
    # Each coefficient is the right one, rounded.
    assert not [f for f in audit.having("differs") if f.check == "printed equation"]


def test_verification_far_from_the_model_is_remarked(clean):
    runs = shown([36.0, 36.1, 36.2], 1)
    verified = replace(clean.verified, responses=runs, mean=None, relative_error_percent=None, p_two_sample=None)
    (remark,) = audit_study(replace(clean, verified=verified)).remarks
    assert remark.check == "runs against the model"
    assert "gave 36.10" in remark.text


@pytest.mark.parametrize(("share", "remarks"), [(0.95, 0), (1.05, 1), (-1.05, 1)])
def test_a_mean_of_three_runs_is_held_against_its_own_prediction_interval(clean, share, remarks):
    """t √(s²/3 + SE²) about the model at the optimum; of a single run it would be t √(s² + SE²)."""
    surface = refit(clean.surface)
    point = surface.region.coded([one.value for one in clean.optimum.values])
    half = stats.t.ppf(0.975, surface.df_residual) * np.sqrt(surface.mse / 3 + surface.standard_error(point) ** 2)
    runs = shown([float(surface.predict(point)) + share * half] * 3, 4)
    verified = replace(clean.verified, responses=runs, mean=None, relative_error_percent=None, p_two_sample=None)
    found = audit_study(replace(clean, verified=verified)).remarks
    assert [one.check for one in found].count("runs against the model") == remarks


@pytest.mark.parametrize(("off", "remarks"), [(0.2, 1), (0.3, 0)])
def test_an_error_below_that_of_the_mean_is_no_evidence(clean, off, remarks):
    """Four runs of ± 0.433 have s = 0.5 and a mean known to 0.25."""
    mean = clean.target.mean.value + off
    runs = shown([mean - 0.4330127, mean + 0.4330127] * 2, 6)
    verified = replace(clean.verified, responses=runs, mean=None, relative_error_percent=None, p_two_sample=None)
    found = audit_study(replace(clean, verified=verified)).remarks
    assert [one.check for one in found].count("what the runs can show") == remarks


def test_an_ascent_step_far_from_the_model_is_remarked(clean):
    ascent = replace(clean.ascent, settings=clean.ascent.settings.copy(), errors=(), best=None)
    ascent.settings[3] = (clean.surface.low + clean.surface.high) / 2
    near = replace(ascent, responses=at(ascent.responses, 3, printed("30.10")))
    low = replace(ascent, responses=at(ascent.responses, 3, printed("25.00")))
    assert audit_study(replace(clean, ascent=near)).remarks == ()
    (remark,) = audit_study(replace(clean, ascent=low)).remarks
    assert "step 4 gave 25.00" in remark.text


def test_a_diagonal_of_the_ranges_is_no_steepest_ascent(clean):
    ranges = {factor.name: (factor.low, factor.high) for factor in clean.screening.factors}
    low, high = np.array([ranges[name] for name in clean.ascent.factors]).T
    grid = low + np.linspace(0, 1, 6)[:, None] * (high - low)
    remarks = audit_study(replace(clean, ascent=replace(clean.ascent, settings=grid))).remarks
    (remark,) = [one for one in remarks if one.check == "direction of the ascent"]
    assert "even grid from end to end" in remark.text
    sizes = np.sqrt([clean.screening.sums[k].value for k in CHOSEN])  # effects are the roots of sums of squares
    shares = zip(clean.ascent.factors, sizes / sizes.max(), strict=True)
    assert f"would be {', '.join(f'{name} {share:.2f}' for name, share in shares)}." in remark.text
    assert f"The best step, {clean.ascent.best}, is the grid's step {clean.ascent.best} of 6." in remark.text


def test_a_factor_that_holm_s_correction_loses_is_remarked(clean):
    weak = replace(clean.screening, p=at(clean.screening.p, 4, printed("0.00900")), f=clean.screening.f)
    remarks = [r for r in audit_study(replace(clean, screening=weak)).remarks if r.check == "significance"]
    assert len(remarks) == 1
    assert "F5 (p = 0.054)" in remarks[0].text


def test_errors_printed_with_a_sign_are_no_fault(clean):
    signed = tuple(printed(f"-{error.text}") for error in clean.ascent.errors)
    assert differing(replace(clean, ascent=replace(clean.ascent, errors=signed))) == []


def test_sums_of_squares_alone_are_held_against_the_design(clean):
    bare = replace(clean.screening, f=(), p=(), significant=None)
    audit = audit_study(replace(clean, screening=bare))
    assert audit.having("differs") == ()
    assert sum(figure.where == "Table 5" for figure in audit.figures) == 9


def test_without_its_design_the_standard_order_is_tried(clean):
    screening = replace(clean.screening, design=None)
    assert audit_study(replace(clean, screening=screening)).having("cannot be checked") == ()
    mixed = replace(screening, responses=screening.responses[1:] + screening.responses[:1])
    (figure,) = audit_study(replace(clean, screening=mixed)).having("cannot be checked")
    assert "without the rows of the design" in figure.how


def test_a_test_without_the_spread_of_the_measurement_cannot_be_checked(clean):
    target = replace(clean.target, sd=None, replicates=None)
    unchecked = audit_study(replace(clean, target=target)).having("cannot be checked")
    assert [f.quantity for f in unchecked] == ["angle of repose", "p"]
    assert f"would need {clean.target.sd.value:.2f} (Student's test)" in unchecked[1].how


def test_few_scattered_runs_are_no_evidence_of_agreement(clean):
    runs = shown([28.5, 30.1, 31.6], 1)
    verified = replace(clean.verified, responses=runs, mean=None, relative_error_percent=None, p_two_sample=None)
    (remark,) = audit_study(replace(clean, verified=verified)).remarks
    assert remark.check == "what the runs can show"


def test_a_surface_that_cannot_be_fitted_is_said_once(clean):
    few = replace(clean.surface, coded=clean.surface.coded[:9], responses=clean.surface.responses[:9])
    audit = audit_study(replace(clean, surfaces=(few,), optimum=None, verified=None))
    assert any("cannot separate" in figure.how for figure in audit.having("cannot be checked"))


def test_two_values_of_one_unnamed_quantity_are_found(clean):
    first = replace(clean.quotes[0], original=None, among=())
    study = replace(clean, quotes=(first, replace(first, value=printed("0.55"))))
    (figure,) = audit_study(study).having("differs")
    assert (figure.printed, figure.recomputed) == ("0.55", 0.4)


def test_a_number_that_the_table_prints_as_something_else_is_told():
    """A quote without its row has to be one of the column; one that is not is looked for in the rest of the table."""
    study = clean_study()
    among = study.quotes[0].among
    free = replace(study.quotes[0], original=None, value=printed("0.55"))
    (found,) = [f for f in audit_study(replace(study, quotes=(free,))).figures if f.check == "values said twice"]
    assert found.status == "reproduced exactly"
    lost = replace(free, value=printed("0.31"), elsewhere=("nu of seed",))
    (found,) = [f for f in audit_study(replace(study, quotes=(lost,))).figures if f.check == "values said twice"]
    assert (found.status, found.recomputed) == ("differs", among[0].value)
    assert found.how.endswith("it prints 0.31 as nu of seed")


def test_without_a_target_all_that_needs_none_is_checked(clean):
    audit = audit_study(replace(clean, target=None))
    assert audit.having("differs") == ()
    unchecked = {(figure.where, figure.quantity) for figure in audit.having("cannot be checked")}
    assert unchecked == {
        ("Table 6", "relative errors, nearest step"),
        ("section 5", "response"),
        ("Table 9", "relative error [%]"),
        ("Table 9", "p"),
    }
    assert next(figure.quantity for figure in audit.figures if figure.where == "Table 9") == "mean response"
