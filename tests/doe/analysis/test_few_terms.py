"""Few terms under heredity: a published reanalysis, planted models, noise, and what each column carries in part."""

import numpy as np
import pytest

from doe.analysis.few_terms import few_terms, partial_aliases
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
    for found in few_terms(CAST, NAMES, 1.0 * CAST[:, 1] * CAST[:, 2]):
        for term in found.terms:
            assert "*" not in term or set(term.split("*")) & set(found.terms)


def test_in_twelve_runs_every_factor_carries_a_third_of_each_interaction_without_it():
    found = partial_aliases(CAST, NAMES)
    for name in NAMES:
        assert len(found[name]) == 15  # pairs of the other six
        assert {one.lstrip("-").split()[0] for one in found[name]} == {"1/3"}
    assert ("-1/3 B*G" in found["F"]) == (int((CAST[:, 5] * CAST[:, 1] * CAST[:, 6]).sum()) == -4)


def test_nothing_is_searched_in_too_few_rows_or_too_many_factors():
    assert few_terms(CAST[:7], NAMES, LIFE[:7]) == ()
    assert few_terms(plackett_burman(24)[:, :12], tuple(map(str, range(12))), np.arange(24.0)) == ()
    assert few_terms(CAST, NAMES, np.full(12, 3.0)) == ()
