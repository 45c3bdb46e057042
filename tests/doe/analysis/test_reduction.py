"""Backward elimination and the intervals of further runs against statsmodels and a printed factor."""

import numpy as np
import pytest
import statsmodels.api as sm

from doe.analysis.models import corrected_aic, reduced_model, terms_of
from doe.analysis.surface import Blocks, fit_surface, included_terms, second_order_terms
from doe.designs import box_behnken
from doe.errors import StatisticsError
from tests.doe.analysis.textbook import region

REGION = region("ABC")
QUADRATIC = terms_of("ABC", "quadratic")
DESIGN = box_behnken(3).astype(float)


def runs(seed, noise=0.5):
    """y = 10 + A + 2 B C: B and C act through their product alone."""
    random = np.random.default_rng(seed)
    return (10 + DESIGN[:, 0] + 2 * DESIGN[:, 1] * DESIGN[:, 2] + noise * random.normal(size=len(DESIGN)))[:, None]


def aicc(values, terms):
    """Of the model of these terms on the runs of `DESIGN`."""
    fitted = fit_surface(DESIGN, values, REGION, terms)
    return corrected_aic(fitted.mse * fitted.df_residual, fitted.df_residual, len(DESIGN))


def model(terms):
    return second_order_terms(DESIGN)[:, included_terms("ABC", terms)]


def test_aicc_is_that_of_another_program():
    """Of statsmodels' log-likelihood, which has n (1 + ln 2π) more; sigma counts as a coefficient."""
    values = runs(1)
    for terms in (QUADRATIC, ("A", "B", "A*B"), ("C",)):
        theirs = sm.OLS(values[:, 0], model(terms)).fit()
        n, q = len(values), len(theirs.params) + 1
        expected = -2 * theirs.llf + 2 * q + 2 * q * (q + 1) / (n - q - 1) - n * (1 + np.log(2 * np.pi))
        assert aicc(values, terms) == pytest.approx(expected)


@pytest.mark.parametrize("rule", ["aicc", "p"])
@pytest.mark.parametrize("seed", range(5))
def test_what_acts_stays_and_a_factor_stays_with_its_product(rule, seed):
    found = reduced_model(DESIGN, runs(seed), REGION, QUADRATIC, rule)
    assert {"A", "B", "C", "B*C"} <= set(found.terms)
    assert set(found.terms) | set(found.dropped) == set(QUADRATIC)
    assert not set(found.terms) & set(found.dropped)
    for term in found.terms:
        assert set(term.removesuffix("^2").split("*")) <= set(found.terms)


@pytest.mark.parametrize("seed", range(5))
def test_elimination_by_p_is_that_of_statsmodels_step_by_step(seed):
    values, left, dropped = runs(seed, noise=3), list(QUADRATIC), []
    while len(left) > 1:
        fit = sm.OLS(values[:, 0], model(left)).fit()
        held = {part for term in left if len(term) > 1 for part in term.removesuffix("^2").split("*")}
        p = {term: fit.pvalues[1 + k] for k, term in enumerate(left) if term not in held}
        worst = max(p, key=p.get)
        if p[worst] <= 0.05:
            break
        left.remove(worst)
        dropped.append(worst)
    found = reduced_model(DESIGN, values, REGION, QUADRATIC, "p")
    assert (found.terms, found.dropped) == (tuple(left), tuple(dropped))


@pytest.mark.parametrize("seed", range(5))
def test_no_single_term_less_has_a_smaller_aicc(seed):
    values = runs(seed, noise=3)
    found = reduced_model(DESIGN, values, REGION, QUADRATIC, "aicc")
    assert found.criterion == aicc(values, found.terms)
    held = {part for term in found.terms if len(term) > 1 for part in term.removesuffix("^2").split("*")}
    for term in set(found.terms) - held:
        fewer = [one for one in found.terms if one != term]
        assert not fewer or aicc(values, fewer) >= found.criterion


def test_blocks_stay_in_the_model_that_is_reduced():
    """A shift of a whole block is neither a term nor scatter."""
    blocks = Blocks(("1", "2"), (np.arange(len(DESIGN)) % 2)[:, None])
    values = runs(2) + 50 * blocks.of_run
    assert {"A", "B*C"} <= set(reduced_model(DESIGN, values, REGION, QUADRATIC, "p", blocks).terms)


def test_a_model_that_the_runs_do_not_bear_is_not_reduced():
    with pytest.raises(StatisticsError, match="cannot separate"):
        reduced_model(DESIGN[:8], runs(1)[:8], REGION, QUADRATIC, "p")


def test_one_further_run_is_predicted_as_by_statsmodels():
    surface = fit_surface(DESIGN, runs(3), REGION)
    at = np.array([[0.3, -0.7, 0.2], [1.0, 1.0, 1.0]])
    theirs = sm.OLS(runs(3)[:, 0], second_order_terms(DESIGN)).fit().get_prediction(second_order_terms(at))
    low, high = theirs.conf_int(obs=True).T
    assert surface.prediction_half_width(at) == pytest.approx((high - low) / 2)


def test_the_tolerance_factor_of_a_mean_is_the_printed_one():
    """NIST/SEMATECH e-Handbook, section 7.2.6.3: 43 runs, 90 % of all with a confidence of 99 %: k = 2.217."""
    values = np.random.default_rng(1).normal(size=(43, 1))
    surface = fit_surface(np.zeros((43, 3)), values, REGION, ())
    half = surface.tolerance_half_width(np.zeros(3), share=0.90, level=0.99)
    assert half / values.std(ddof=1) == pytest.approx(2.217, abs=5e-4)


def test_most_runs_are_within_the_tolerance_interval_as_often_as_it_says():
    """Of 2000 sets of runs, the share whose interval holds 95 % of a normal law: 95 %, within what chance leaves."""
    from scipy import stats

    random, at, good = np.random.default_rng(7), np.array([0.5, 0.0, 0.0]), 0
    x = second_order_terms(DESIGN)[:, :4]
    inverse, point = np.linalg.inv(x.T @ x), second_order_terms(at)[:4]
    surface = fit_surface(DESIGN, runs(1), REGION, ("A", "B", "C"))
    factor = float(surface.tolerance_half_width(at)) / np.sqrt(surface.mse)
    for _ in range(2000):
        noise = random.normal(size=len(DESIGN))
        fitted = inverse @ (x.T @ noise)
        s = np.sqrt(((noise - x @ fitted) ** 2).sum() / (len(noise) - 4))
        middle = point @ fitted
        good += stats.norm.cdf(middle + factor * s) - stats.norm.cdf(middle - factor * s) >= 0.95
    assert good / 2000 == pytest.approx(0.95, abs=3 * (0.95 * 0.05 / 2000) ** 0.5 + 0.005)  # the formula is approximate
