"""How far an effect's range is drawn in, on made-up answers of known size."""

import numpy as np
import pytest

from doe.diagnose.runs import Effect
from doe.diagnose.simulation.pours import Pour
from doe.diagnose.simulation.ranges import TOO_FAR, TOO_LITTLE, looked_twice, scaled_range
from tests.doe.diagnose.simulation.made_up_pours import DECLARED, STANDARD_ERROR, AtOnce, Noisy


class Answering(AtOnce):
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
    found, shift = _found(scaled_range(DECLARED, Effect("e", (0.0,), (1.0,)), 3, centre), model)
    low, high = share
    assert 0.8 * low <= found.high[0] <= 1.2 * high
    assert shift <= TOO_FAR
    assert shift >= TOO_LITTLE or found.high == (1.0,)
    assert model.tried[-1] == found.high[0]


def test_an_effect_that_is_too_strong_everywhere_is_drawn_in_as_far_as_it_goes(centre):
    found, shift = _found(scaled_range(DECLARED, Effect("e", (-1.0,), (1.0,)), 3, centre), Answering(lambda a: 100.0))
    assert 0.0 < found.high[0] < 0.01
    assert found.low == (-found.high[0],)
    assert shift > TOO_FAR


def test_an_effect_of_five_standard_errors_is_not_given_up(centre):
    effect, kept = Effect("e", (0.0,), (1.0,)), 0
    for seed in range(40):
        model = Noisy(e=5.0)
        model.rng = np.random.default_rng(seed)
        kept += _found(looked_twice(DECLARED, effect, centre), model)[0].unseen is None
    # Eight pours: the shift of 5 is measured with a standard error of 0.9.
    assert kept >= 36


@pytest.mark.parametrize(("shift", "least", "most"), [(0.0, 6, 8), (12.0, 2, 3)])
def test_a_second_look_ends_once_it_is_clear(centre, shift, least, most):
    """Two summaries, v = 1/n: nothing is told apart from 3 by eight pours or six, a shift of 12 by two or three.

    At n pours the deviation of the square is √(2·2·(6/n)² + 4·(6/n)·9): at 8 it is 5.4, at 2 it is 12; 9 − 1.645·5.4
    is 0.1, and 144 lies 11 of them above 9.
    """
    numbers = []
    for seed in range(20):
        model = Noisy(e=shift)
        model.rng = np.random.default_rng(seed)
        _found(looked_twice(DECLARED, Effect("e", (0.0,), (1.0,)), centre), model)
        numbers.append(max(point.number for _, point in model.asked) + 1)
    assert least <= np.median(numbers) <= most


def _found(search, model):
    return model.result_of("range", search)
