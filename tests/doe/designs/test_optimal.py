"""Optimal designs against designs that are known to be the best, and the algebra that their numbers come from."""

import numpy as np
import pytest

from doe.analysis.surface import second_order_terms
from doe.designs import DESIGNS, DesignOptions
from doe.designs.factorial import factorial
from doe.designs.optimal import GRID, Region, codes, efficiency, model_terms
from doe.errors import StatisticsError

SIX_RUNS = (4 - 13**0.5) / 3
"""d of Box and Draper's six points."""


def points(name, factors, **options):
    return DESIGNS[name].points(factors, DesignOptions(**options))


def free(*levels):
    return Region(levels, np.zeros((0, len(levels) + 1)))


def determinant(coded):
    model = second_order_terms(coded)
    return np.linalg.det(model.T @ model)


@pytest.mark.parametrize("name", ["d-optimal", "i-optimal"])
@pytest.mark.parametrize(
    "factors, runs, model", [(2, 4, "linear"), (3, 4, "linear"), (3, 8, "interactions"), (4, 12, "linear")]
)
def test_orthogonal_designs_are_found_where_there_are_any(name, factors, runs, model):
    """An orthogonal array of corners is D-, A-, G- and I-optimal: 100 %, and a mean variance of sum 3^-order / N."""
    found = points(name, factors, runs=runs, model=model)
    assert (np.abs(found.coded) == 1).all()
    numbers = found.efficiency
    assert (numbers.d, numbers.a, numbers.g) == pytest.approx((100, 100, 100))
    products = factors * (factors - 1) / 2 if model == "interactions" else 0
    assert numbers.mean_variance == pytest.approx((1 + factors / 3 + products / 9) / runs)


def test_nine_runs_of_two_factors_are_the_three_by_three():
    """Of all exact designs of nine runs for a quadratic on the square it has the largest det(X'X), 5184 (Box and
    Draper 1971, Technometrics 13:731; the number by hand, from the blocks of X'X).
    """
    found = points("d-optimal", 2, runs=9)
    assert {tuple(row) for row in found.coded.tolist()} == {(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)}
    assert determinant(found.coded) == pytest.approx(5184)
    assert found.efficiency.d == pytest.approx(100 * 5184 ** (1 / 6) / 9)


def test_six_runs_of_two_factors_are_nearly_the_best_six_points():
    """Box and Draper 1971: (-1, -1), (1, -1), (-1, 1), (-d, -d), (1, 3 d), (3 d, 1) with d = (4 - √13)/3 = 0.1315."""
    d = SIX_RUNS
    best = np.array([(-1, -1), (1, -1), (-1, 1), (-d, -d), (1, 3 * d), (3 * d, 1)])
    found = points("d-optimal", 2, runs=6)
    share = (determinant(found.coded) / determinant(best)) ** (1 / 6)
    assert 0.98 < share < 1  # on a grid of half units the six points themselves are not there


@pytest.mark.parametrize("factors, runs, model", [(2, 5, "linear"), (2, 6, "interactions"), (3, 5, "linear")])
def test_no_choice_of_corners_has_a_larger_determinant(factors, runs, model):
    from itertools import combinations_with_replacement

    corners = factorial(factors).astype(float)
    terms = model_terms((0,) * factors, model)
    worth = [
        np.linalg.det(x.T @ x)
        for chosen in combinations_with_replacement(range(len(corners)), runs)
        for x in [terms.matrix(corners[list(chosen)])]
    ]
    x = terms.matrix(points("d-optimal", factors, runs=runs, model=model).coded)
    assert np.linalg.det(x.T @ x) == pytest.approx(max(worth))


def test_each_criterion_is_best_by_its_own_number():
    by_coefficients, by_prediction = (points(name, 3, runs=16) for name in ("d-optimal", "i-optimal"))
    assert by_coefficients.efficiency.d > by_prediction.efficiency.d
    assert by_prediction.efficiency.mean_variance < by_coefficients.efficiency.mean_variance


def test_the_numbers_are_those_of_their_definitions():
    """Of a Box–Behnken design; mean variance by Gauss's rule, which is exact for x⁴, the largest one at a corner."""
    coded = DESIGNS["box-behnken"].points(3, DesignOptions(centre=3)).coded
    found = efficiency(model_terms((0, 0, 0), "quadratic"), free(0, 0, 0), coded, GRID["quadratic"])
    model = second_order_terms(coded)
    inverse = np.linalg.inv(model.T @ model)
    assert found.d == pytest.approx(100 * np.linalg.det(model.T @ model) ** (1 / 10) / 15)
    assert found.a == pytest.approx(100 * 10 / (15 * np.trace(inverse)))
    corner = second_order_terms(np.ones(3))
    assert found.g == pytest.approx(100 * 10 / (15 * corner @ inverse @ corner))
    nodes, weights = np.polynomial.legendre.leggauss(3)
    cube = second_order_terms(np.array(np.meshgrid(nodes, nodes, nodes)).reshape(3, -1).T)
    weight = np.einsum("i,j,k->ijk", weights, weights, weights).ravel() / 8
    assert found.mean_variance == pytest.approx(weight @ np.einsum("ni,ij,nj->n", cube, inverse, cube))


def test_terms_are_those_of_the_response_surface():
    coded = np.random.default_rng(2).uniform(-1, 1, (7, 3))
    assert np.allclose(model_terms((0, 0, 0), "quadratic").matrix(coded), second_order_terms(coded))


def test_runs_stay_within_constraints_and_reach_their_edge():
    """On the triangle x + y <= 0 the best three runs for a plane are its corners."""
    found = points("d-optimal", 2, runs=3, model="linear", constraints=((1.0, 1.0, 0.0),))
    assert {tuple(row) for row in found.coded.tolist()} == {(-1, -1), (1, -1), (-1, 1)}
    quadratic = points("i-optimal", 3, runs=14, constraints=((1.0, 1.0, 0.0, 0.5), (0.0, -1.0, 2.0, 1.25)))
    assert (quadratic.coded @ [1, 1, 0] <= 0.5 + 1e-9).all()
    assert (quadratic.coded @ [0, -1, 2] <= 1.25 + 1e-9).all()
    # Levels are round, or where a constraint ends the range with the other factors round.
    steps = np.isclose(quadratic.coded * 8 % 1, 0) | np.isclose(quadratic.coded * 8 % 1, 1)
    assert steps.all()


def test_the_mean_over_a_cut_region_is_of_its_own_points():
    """x <= 0 for a line: the mean of x² there is 1/3 and of x -1/2; the points are drawn, so within a percent."""
    terms = model_terms((0,), "linear")
    moments = terms.moments(Region((0,), np.array([[1.0, 0.0]])))
    assert moments == pytest.approx(np.array([[1, -1 / 2], [-1 / 2, 1 / 3]]), rel=0.01)


def test_names_are_balanced_and_their_contrasts_orthonormal():
    terms = model_terms((3, 2, 0), "interactions")
    assert terms.names[:5] == ("intercept", "A[1]", "A[2]", "B", "C")
    every = np.array([(a, b, c) for a in codes(3) for b in codes(2) for c in (-1, 1)])
    x = terms.matrix(every)
    assert np.allclose(x.T @ x, 12 * np.eye(len(terms.names)))
    assert "A^2" not in model_terms((3, 2, 0), "quadratic").names
    found = points("d-optimal", 3, runs=12, model="interactions", levels=(3, 2, 0))
    assert found.efficiency.d == pytest.approx(100)
    assert sorted(np.unique(found.coded[:, 0], return_counts=True)[1]) == [4, 4, 4]


def test_added_runs_tell_what_the_finished_ones_could_not():
    """A half fraction with I = ABC confuses A with BC; four more runs make it the whole 2^3."""
    half = factorial(3, ["C=AB"]).astype(float)
    found = points("d-optimal", 3, runs=4, model="interactions", kept=tuple(map(tuple, half.tolist())))
    assert np.array_equal(found.coded[:4], half)
    assert found.gained == ("A", "B", "C", "A*B", "A*C", "B*C")
    assert found.efficiency.d == pytest.approx(100)
    assert {tuple(row) for row in found.coded.tolist()} == {tuple(row) for row in factorial(3).tolist()}
    assert found.notes[1].startswith(
        "The 4 finished runs could not tell apart A, B, C, A*B, A*C, B*C; with the 4 added"
    )
    whole = tuple(map(tuple, factorial(3).tolist()))
    again = points("d-optimal", 3, runs=2, model="linear", kept=whole)
    assert (again.gained, "tell every term already" in again.notes[1]) == ((), True)


def test_the_same_seed_gives_the_same_runs():
    one, again = (points("i-optimal", 2, runs=8, seed=3).coded for _ in range(2))
    assert np.array_equal(one, again)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"runs": 5}, "runs = 5: too few for the 6 terms of the quadratic model; allowed: at least 6"),
        ({"runs": 3, "kept": ((-1.0, 0.0), (1.0, 0.0))}, "beside 2 finished runs, which determine 2 .* at least 4"),
        ({"constraints": ((1.0, 1.0, -1.99),)}, "only 0 of 4096 random points between low and high satisfy them"),
    ],
)  # fmt: skip
def test_what_cannot_be_told_is_refused(options, message):
    with pytest.raises(StatisticsError, match=message):
        points("d-optimal", 2, **options)


def test_a_region_that_no_corner_and_no_axis_reaches_is_searched_from_within():
    """0.3 … 0.4 of one factor and 0.6 … 0.7 of the other, both of 0 … 1: its four corners are best."""
    limits = ((1.0, 0.0, -0.2), (-1.0, 0.0, 0.4), (0.0, 1.0, 0.4), (0.0, -1.0, -0.2))
    found = points("d-optimal", 2, runs=8, model="linear", constraints=limits).coded
    corners = {(-0.4, 0.2), (-0.4, 0.4), (-0.2, 0.2), (-0.2, 0.4)}
    assert {tuple(row) for row in found.round(9).tolist()} == corners
