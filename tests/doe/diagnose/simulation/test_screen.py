"""How far an effect's range is drawn in, on made-up answers of known size."""

import numpy as np
import pytest

from doe.diagnose.runs import Condition, Declared, Effect, Parameter
from doe.diagnose.simulation.pours import Pour
from doe.diagnose.simulation.screen import (
    REPLICATES,
    TOO_FAR,
    TOO_LITTLE,
    UNSEEN,
    Budget,
    looked_twice,
    over_wider_ranges,
    scaled_range,
    screen,
)

SUMMARIES = ("a", "b")
DECLARED = Declared((Parameter("p", 0.0, 1.0),), (), (Condition("one", SUMMARIES),))
STANDARD_ERROR = 1 / np.sqrt(REPLICATES)


class Answering:
    """Pours of which the first summary is ``answer`` (amplitude), in standard errors, the second nothing."""

    def __init__(self, answer):
        self.answer, self.tried = answer, []

    def run(self, what, points):
        ((_, (amplitude,)),) = points[0].effects
        self.tried.append(amplitude)
        return [[Pour((self.answer(amplitude) * STANDARD_ERROR, 0.0), "measured")] for _ in points]


@pytest.fixture
def centre():
    rows = np.random.default_rng(1).normal(size=(400, 2))
    rows = (rows - rows.mean(axis=0)) / rows.std(axis=0, ddof=1)
    return [[Pour(tuple(row), "measured")] for row in rows]


@pytest.mark.parametrize(
    ("answer", "share"),
    [
        (lambda a: 5.0 * a, (1.0, 1.0)),  # too weak for more: all that the literature allows
        (lambda a: 20.0 * a, (1.0, 1.0)),
        (lambda a: 100.0 * a, (0.12, 0.24)),
        (lambda a: 1000.0 * a**2, (0.109, 0.155)),  # the step inward goes too far, and is taken back
        (lambda a: 30.0 * min(1.0, 10.0 * a), (0.04, 0.08)),  # saturates
    ],
)
def test_the_range_ends_where_the_shift_is_about_the_wanted_one(centre, answer, share):
    """The shares follow from answer(share) = TOO_LITTLE … TOO_FAR; 20 % for what noise takes off the square."""
    model = Answering(answer)
    found, shift = scaled_range(DECLARED, Effect("e", (0.0,), (1.0,)), model, 3, centre)
    low, high = share
    assert 0.8 * low <= found.high[0] <= 1.2 * high
    assert shift <= TOO_FAR
    assert shift >= TOO_LITTLE or found.high == (1.0,)
    assert model.tried[-1] == found.high[0]


def test_an_effect_that_is_too_strong_everywhere_is_drawn_in_as_far_as_it_goes(centre):
    found, shift = scaled_range(DECLARED, Effect("e", (-1.0,), (1.0,)), Answering(lambda a: 100.0), 3, centre)
    assert 0.0 < found.high[0] < 0.01
    assert found.low == (-found.high[0],)
    assert shift > TOO_FAR


class Noisy:
    """Pours with unit noise; an effect shifts the first summary by ``answer`` (amplitude) standard errors."""

    def __init__(self, **answers):
        self.answers, self.asked = answers, []
        self.rng = np.random.default_rng(7)

    def run(self, what, points):
        self.asked += [(what, point) for point in points]
        shifts = [sum(self.answers[name] * a for name, (a,) in point.effects) * STANDARD_ERROR for point in points]
        rows = [self.rng.normal(size=2) + np.array([shift, 0.0]) for shift in shifts]
        return [[Pour(tuple(row), "measured")] for row in rows]


def test_what_shifts_too_little_is_looked_at_twice_and_not_screened():
    declared = Declared(
        DECLARED.parameters, (Effect("faint", (0.0,), (1.0,)), Effect("clear", (0.0,), (1.0,))), DECLARED.conditions
    )
    model = Noisy(faint=0.5, clear=14.0)
    said = []
    found = screen(declared, model, Budget(base=24, middle=16, screening=8), said.append)
    faint, clear = found.declared.effects
    assert faint.unseen is not None
    assert faint.unseen < UNSEEN
    assert clear.unseen is None
    screened = [point for what, point in model.asked if what == "screening"]
    assert {name for point in screened for name, _ in point.effects} == {"clear"}
    assert any("faint" in line and "too little" in line for line in said)


def test_an_effect_of_five_standard_errors_is_not_given_up(centre):
    effect, kept = Effect("e", (0.0,), (1.0,)), 0
    for seed in range(40):
        model = Noisy(e=5.0)
        model.rng = np.random.default_rng(seed)
        kept += looked_twice(DECLARED, effect, model, centre)[0].unseen is None
    # Eight pours: the shift of 5 is measured with a standard error of 0.9.
    assert kept >= 36


def test_a_wider_range_asks_for_points_over_it_and_keeps_the_others():
    declared = Declared(DECLARED.parameters, (Effect("e", (-0.25,), (0.25,)),), DECLARED.conditions)
    widest = Declared(DECLARED.parameters, (Effect("e", (-0.4,), (1.0,)),), DECLARED.conditions)
    model = Noisy(e=40.0)
    first = screen(declared, model, Budget(base=24, middle=16, screening=8), lambda line: None)
    wider = over_wider_ranges(first, ("e",), widest, model, Budget(widened=10), lambda line: None)
    assert (wider.declared.effects[0].low, wider.declared.effects[0].high) == ((-0.4,), (0.5,))
    assert wider.points[: len(first.points)] == first.points
    new = [point.effects[0][1][0] for point in wider.points[len(first.points) :]]
    assert len(new) == 10
    assert max(new) == 0.5
    assert min(new) == -0.4
