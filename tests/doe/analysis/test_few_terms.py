"""Few terms under heredity: a published reanalysis, planted models, noise, and what each column carries in part."""

from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
import statsmodels.api as sm
from statsmodels.tools import eval_measures

from doe.analysis.few_terms import few_terms, main_effect_aliases
from doe.designs import DESIGNS, DesignOptions
from doe.designs.plackett_burman import plackett_burman

# Hunter, Hodi and Eager 1982: log life of repaired castings in a Plackett-Burman design of 12 runs, factors A to G.
CAST = np.array(
    [
        [1, 1, -1, 1, 1, 1, -1], [1, -1, 1, 1, 1, -1, -1], [-1, 1, 1, 1, -1, -1, -1], [1, 1, 1, -1, -1, -1, 1],
        [1, 1, -1, -1, -1, 1, -1], [1, -1, -1, -1, 1, -1, 1], [-1, -1, -1, 1, -1, 1, 1], [-1, -1, 1, -1, 1, 1, -1],
        [-1, 1, -1, 1, 1, -1, 1], [1, -1, 1, 1, -1, 1, 1], [-1, 1, 1, -1, 1, 1, 1], [-1, -1, -1, -1, -1, -1, -1],
    ]
)  # fmt: skip
LIFE = np.array([6.058, 4.733, 4.625, 5.899, 7.0, 5.752, 5.682, 6.607, 5.818, 5.917, 5.863, 4.809])
NAMES = tuple("ABCDEFG")


def test_hamada_and_wu_s_model_of_the_cast_fatigue_data_is_found():
    best = few_terms(CAST, NAMES, LIFE)[0]
    # Hamada and Wu 1992: F and FG, R² 0.89; the main effects alone explain nothing for sure.
    assert best.terms == ("F", "F*G")
    assert best.r_squared == pytest.approx(0.89, abs=5e-3)
    assert best.coefficients == pytest.approx([5.73, 0.458, -0.459], abs=1e-3)
    assert best.p < 0.05


def test_each_model_has_the_fit_and_the_aicc_of_another_program():
    """statsmodels; its AICc has the constants n ln 2π + n, and counts σ as a parameter where that is told."""
    for found in few_terms(CAST, NAMES, LIFE):
        columns = [CAST[:, [NAMES.index(part) for part in term.split("*")]].prod(axis=1) for term in found.terms]
        theirs = sm.OLS(LIFE, np.column_stack([np.ones(12), *columns])).fit()
        assert found.coefficients == pytest.approx(theirs.params)
        assert (found.r_squared, found.r_squared_adjusted) == pytest.approx((theirs.rsquared, theirs.rsquared_adj))
        aicc = eval_measures.aicc(theirs.llf, 12, len(found.terms) + 2)
        assert found.aicc == pytest.approx(aicc - 12 * (np.log(2 * np.pi) + 1))


@pytest.mark.parametrize("terms", [("B",), ("A", "A*D"), ("C", "E", "C*E")])
def test_a_planted_model_is_found_with_its_coefficients(terms):
    levels = plackett_burman(12)[:, :6]
    names = NAMES[:6]
    y = 3.0 + np.random.default_rng(4).normal(0.0, 0.05, 12)
    for k, term in enumerate(terms):
        y += (1.0 + 0.5 * k) * levels[:, [names.index(part) for part in term.split("*")]].prod(axis=1)
    best = few_terms(levels, names, y)[0]
    assert best.terms[: len(terms)] == terms
    assert best.coefficients[1 : 1 + len(terms)] == pytest.approx([1.0 + 0.5 * k for k in range(len(terms))], abs=0.1)


def test_noise_is_not_taken_for_a_model():
    """The p of the best model of a size is one of a search: over data sets of noise it is spread over 0 … 1."""
    generator = np.random.default_rng(5)
    p = np.array([few_terms(CAST, NAMES, generator.normal(size=12))[0].p for _ in range(60)])
    # Of 60, 3 are expected at or below 0.05, and half below 0.5; the size is chosen first, which bends that a little.
    assert (p <= 0.05).sum() <= 10
    assert (p > 0.5).sum() >= 10


def test_an_interaction_needs_one_of_its_factors():
    found = few_terms(CAST, NAMES, 1.0 * CAST[:, 1] * CAST[:, 2])
    assert {one.terms for one in found} == {("B", "B*C"), ("C", "B*C")}


def test_in_twelve_runs_every_factor_carries_a_third_of_each_interaction_without_it():
    found = main_effect_aliases(CAST, NAMES)
    for name in NAMES:
        assert len(found[name]) == 15  # pairs of the other six
        assert {one.lstrip("-").split()[0] for one in found[name]} == {"1/3"}
    assert ("-1/3 B*G" in found["F"]) == (int((CAST[:, 5] * CAST[:, 1] * CAST[:, 6]).sum()) == -4)


def test_an_interaction_that_is_a_main_effect_wholly_is_told():
    """2^(11-7) of 16 runs, too many factors for all products: B*K, C*L and H*J are A."""
    levels = DESIGNS["factorial"].points(11, DesignOptions(runs=16)).coded.astype(np.int64)
    found = main_effect_aliases(levels, "ABCDEFGHJKL")
    assert found["A"] == ("B*K", "C*L", "H*J")
    turned = levels * np.where(np.arange(11) == 1, -1, 1)
    assert main_effect_aliases(turned, "ABCDEFGHJKL")["A"] == ("-B*K", "C*L", "H*J")


def test_shares_of_a_design_that_is_not_orthogonal_are_those_of_least_squares():
    levels = DESIGNS["d-optimal"].points(5, DesignOptions(runs=10, model="linear")).coded.astype(np.int64)
    names, found = "ABCDE", main_effect_aliases(levels, "ABCDE")
    for i, j in combinations(range(5), 2):
        share = np.linalg.lstsq(np.column_stack([np.ones(10), levels]), levels[:, i] * levels[:, j], rcond=None)[0][1:]
        told = [{one.split()[1]: one.split()[0] for one in found[name]} for name in names]
        assert [float(Fraction(one.get(f"{names[i]}*{names[j]}", "0"))) for one in told] == pytest.approx(
            share, abs=1e-9
        )
    assert "-2/7 A*B" in found["A"]  # a factor's own interaction leaks into it too


def test_nothing_is_searched_in_too_few_rows_or_too_many_factors():
    assert few_terms(CAST[:7], NAMES, LIFE[:7]) == ()
    assert few_terms(plackett_burman(24)[:, :12], tuple(map(str, range(12))), np.arange(24.0)) == ()
    assert few_terms(CAST, NAMES, np.full(12, 3.0)) == ()
