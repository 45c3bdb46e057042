"""Declared model, runs and data: what is refused, dropped and given a floor."""

import numpy as np
import pytest

from doe.diagnose.runs import (
    BASE,
    CONSTANT_FLOOR,
    Condition,
    Declared,
    Effect,
    Observed,
    Parameter,
    Runs,
    select_summaries,
)
from doe.errors import StatisticsError

DECLARED = Declared(
    (Parameter("friction", 0.2, 0.6, mean=0.5, sd=0.05),),
    (Effect("tilt", (-2.0, -4.0), (1.0, 4.0)),),
    (Condition("pour", ("angle", "residue")),),
)


def runs(block):
    n = len(block)
    return Runs(np.full((n, 1), 0.4), np.full(n, BASE), np.zeros((n, 2)), (np.asarray(block, dtype=float),))


def observed(block):
    return Observed((np.asarray(block, dtype=float),), (np.zeros(2),))


def test_coding_is_its_own_inverse():
    parameter = DECLARED.parameters[0]
    assert parameter.coded(0.6) == pytest.approx(1.0)
    assert parameter.natural(float(parameter.coded(0.25))) == pytest.approx(0.25)
    assert DECLARED.effects[0].scale.tolist() == [2.0, 4.0]


@pytest.mark.parametrize(
    ("make", "part"),
    [
        (lambda: Parameter("p", 1.0, 1.0), "low < high"),
        (lambda: Parameter("p", 0.0, 1.0, mean=0.5), "both"),
        (lambda: Effect("e", (0.1,), (1.0,)), "must contain 0"),
        (lambda: Effect("e", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), "1 or 2"),
        (lambda: Runs(np.zeros((3, 1)), np.zeros(2), np.zeros((3, 2)), ()), "agree"),
    ],
)
def test_bad_declarations_are_refused(make, part):
    with pytest.raises(StatisticsError, match=part):
        make()


@pytest.mark.parametrize(
    ("block", "data", "part"),
    [
        ([[1, 2, 3]], [[1, 2]], "summaries"),
        ([[1, 2]], [[np.nan, 2]], "no measured replicate"),
        ([[np.nan, 2]], [[1, 2]], "no complete pour"),
        ([[1, 2], [1, 2]], [[1, 2]], "every summary is constant"),
    ],
)
def test_bad_data_are_refused(block, data, part):
    with pytest.raises(StatisticsError, match=part):
        select_summaries(DECLARED, runs(block), observed(data))


def test_a_constant_that_is_equal_is_dropped_from_both():
    found = select_summaries(DECLARED, runs([[1, 0], [2, 0]]), observed([[1.5, 0], [1.6, 0]]))
    assert found.dropped == ("pour: residue",)
    assert found.declared.labels == ("pour: angle",)
    assert found.runs.blocks[0].shape == (2, 1)
    assert found.observed.blocks[0].shape == (2, 1)
    assert found.floors[0].tolist() == [0.0]


def test_a_constant_that_differs_is_kept_with_a_floor():
    found = select_summaries(DECLARED, runs([[1, 0], [2, 0]]), observed([[1.5, 3.0], [1.6, 5.0]]))
    assert found.floored == ("pour: residue",)
    assert found.floors[0] == pytest.approx([0.0, np.sqrt(2)])
    same = select_summaries(DECLARED, runs([[1, 0], [2, 0]]), observed([[1.5, 3.0], [1.6, 3.0]]))
    assert same.floors[0][1] == pytest.approx(3.0 * CONSTANT_FLOOR)
