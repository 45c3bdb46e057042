"""The batched minimiser against normal equations, SciPy's bounded solvers and a non-linear fit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares, lsq_linear

from doe.diagnose.emulation.predictor import Predictor
from doe.diagnose.emulation.terms import base_candidates, effect_candidates, monomials, slopes
from doe.diagnose.fitting.misfit import best_start, build_misfit, minimise

SETS, D = 40, 7


def predictor(exponents, generator, low, high, parameters):
    p = len(exponents)
    coefficients = generator.standard_normal((p, D)) * 5
    return Predictor(
        parameters=parameters,
        exponents=exponents,
        coefficients=(coefficients,),
        information_inverse=(np.zeros((p, p)),),
        pour_covariance=(np.eye(D),),
        lack_of_fit=(np.zeros(D),),
        excess=(np.zeros((1, D)),),
        amplitudes=(exponents.shape[1] - parameters,),
        low=low,
        high=high,
        columns=np.arange(p),
    )


def problem(exponents, seed, bound=1.0, parameters=3, prior=0.0):
    generator = np.random.default_rng(seed)
    q = exponents.shape[1]
    model = predictor(exponents, generator, -np.full(q, bound), np.full(q, bound), parameters)
    truth = generator.uniform(-1.2, 1.2, (SETS, q))
    means = monomials(truth, exponents) @ model.coefficients[0] + generator.standard_normal((SETS, D))
    roots = generator.standard_normal((SETS, D, D)) / 2 + np.eye(D)
    weights = roots.transpose(0, 2, 1) @ roots
    weight = np.full(parameters, prior)
    misfit = build_misfit(model, [means], [weights], np.full((SETS, parameters), 0.2), weight)
    return model, means, roots, misfit


def test_slopes_are_those_of_finite_differences():
    exponents = effect_candidates(2, 2)[-1]
    x = np.random.default_rng(0).uniform(-1, 1, (5, 4))
    for i, step in enumerate(1e-6 * np.eye(4)):
        numeric = (monomials(x + step, exponents) - monomials(x - step, exponents)) / 2e-6
        # Central differences of a cubic: error of the order of step^2 and of rounding/step.
        assert slopes(x, exponents)[:, i] == pytest.approx(numeric, abs=1e-8)


def test_terms_of_an_effect_vanish_at_amplitude_zero():
    x = np.random.default_rng(0).uniform(-1, 1, (5, 5))
    x[:, 3:] = 0
    assert all((monomials(x, exponents) == 0).all() for exponents in effect_candidates(3, 2))


def test_linear_without_bounds_is_weighted_least_squares():
    """T^2 and x of (J'WJ) x = J'W y, with a prior on the parameters."""
    model, means, roots, misfit = problem(base_candidates(3)[0], 1, bound=50.0, prior=4.0)
    found, values = minimise(misfit, np.zeros((SETS, 3)))
    constant, jacobian = model.coefficients[0][0], model.coefficients[0][1:].T
    for b in range(SETS):
        rows = np.concatenate([roots[b] @ jacobian, 2 * np.eye(3)])
        right = np.concatenate([roots[b] @ (means[b] - constant), np.full(3, 2 * 0.2)])
        x, square, *_ = np.linalg.lstsq(rows, right, rcond=None)
        assert found[b] == pytest.approx(x, abs=1e-6)
        assert values[b] == pytest.approx(square[0], rel=1e-9)


def test_linear_within_bounds_agrees_with_scipy():
    model, means, roots, misfit = problem(base_candidates(3)[0], 2)
    found, values = minimise(misfit, np.zeros((SETS, 3)))
    held = 0
    for b in range(SETS):
        jacobian = roots[b] @ model.coefficients[0][1:].T
        result = lsq_linear(jacobian, roots[b] @ (means[b] - model.coefficients[0][0]), (-1, 1), tol=1e-12)
        assert values[b] == pytest.approx(2 * result.cost, rel=1e-6)
        held += (np.abs(found[b]) == 1).any()
    assert held > SETS / 4


def test_polynomial_within_bounds_is_no_worse_than_scipy():
    """From the same start a local solver may end elsewhere; ours must not be worse in more than a few sets."""
    exponents = base_candidates(3)[2]
    model, means, roots, misfit = problem(exponents, 3)
    found, values = minimise(misfit, np.zeros((SETS, 3)))
    worse = 0
    for b in range(SETS):

        def residual(x, b=b):
            return roots[b] @ (means[b] - monomials(x, exponents) @ model.coefficients[0])

        other = least_squares(residual, np.zeros(3), bounds=(-1, 1))
        worse += values[b] > 2 * other.cost * (1 + 1e-4) + 1e-6
        assert values[b] == pytest.approx(float((residual(found[b]) ** 2).sum()))
    assert worse <= 4


def test_a_start_is_found_where_there_is_no_slope_at_zero():
    """y = a^2 (no linear term): from a = 0 no descent is possible, from the best start the fit is exact."""
    exponents = np.array([[0], [2]])
    coefficients = np.array([np.zeros(D), np.full(D, 10.0)])
    model = replace(
        predictor(exponents, np.random.default_rng(0), np.zeros(1), np.ones(1), 0), coefficients=(coefficients,)
    )
    misfit = build_misfit(model, [np.full((1, D), 4.9)], [np.eye(D)[None]], np.zeros((1, 0)), np.zeros(0))
    assert minimise(misfit, np.zeros((1, 1)))[1] > 100
    found, value = minimise(misfit, best_start(misfit, np.zeros(0)))
    assert found[0, 0] == pytest.approx(0.7, abs=1e-4)
    assert value[0] < 1e-4
