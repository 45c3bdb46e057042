"""Who is poured about its fit, where, and what becomes of pours that are there already."""

from types import SimpleNamespace

import numpy as np
import pytest

from doe.diagnose.emulation.fresh_pours import FreshPours
from doe.diagnose.follow_up.closer import CLOSE, POURS, SCATTER, STEP, WITHIN, contenders, poured, with_new
from doe.diagnose.runs import Condition, Declared, Effect, Parameter
from tests.doe.diagnose.simulation.made_up_pours import Noisy

DECLARED = Declared(
    (Parameter("p", 0.0, 1.0),),
    tuple(Effect(name, (0.0,), (2.0,)) for name in "abc"),
    (Condition("one", ("a", "b")),),
)


def model(name, criterion=0.0, coded=(0.0, 0.5)):
    return SimpleNamespace(label=name, members=("abc".index(name),), criterion=criterion, coded=np.array(coded))


def verdict(models, drops, kind="unexplained"):
    rows = [SimpleNamespace(name=name, drop=drop, status="raced") for name, drop in drops.items()]
    return SimpleNamespace(kind=kind, effects=rows, models=tuple(sorted(models, key=lambda m: m.criterion)))


def pours_of(name, number, coded=(0.0, 0.5)):
    theta, amplitude = np.full((number, 1), (1.0 + coded[0]) / 2.0), np.full((number, 1), 2.0 * coded[1])
    return FreshPours(("abc".index(name),), theta, amplitude, (np.zeros((number, 2)),))


def labels(found):
    return [one.label for one in found]


def test_every_effect_that_may_explain_the_residual_is_poured_before_the_criterion_is_asked():
    """From five settings a criterion says little: b is far behind and takes up as much, c takes up next to nothing."""
    models = [model("a"), model("b", 5.0 * WITHIN), model("c", 0.5)]
    seen = verdict(models, {"a": 60.0, "b": 55.0, "c": 5.0})
    assert labels(contenders(seen, DECLARED, ())) == ["a", "b"]
    # b has been heard and is behind; a needs the rest of its pours, and c is near by its criterion.
    heard = (pours_of("a", STEP), pours_of("b", STEP))
    assert labels(contenders(seen, DECLARED, heard)) == ["a", "c"]
    heard = (pours_of("a", POURS), pours_of("b", STEP), pours_of("c", POURS))
    assert contenders(seen, DECLARED, heard) == ()
    assert contenders(verdict(models, {"a": 60.0}, "no_missing_effect"), DECLARED, ()) == ()


def test_a_fit_that_has_left_its_pours_is_poured_again():
    """By half the box in the parameter: coded -1 … 1."""
    moved = model("a", coded=(1.0, 0.5))
    seen = verdict([moved], {"a": 60.0})
    assert labels(contenders(seen, DECLARED, (pours_of("a", POURS),))) == ["a"]
    near = model("a", coded=(1.8 * CLOSE, 0.5))
    assert contenders(verdict([near], {"a": 60.0}), DECLARED, (pours_of("a", POURS),)) == ()


def test_pours_about_the_same_fit_go_on_in_their_sequence():
    source, one = Noisy(a=1.0, b=1.0), model("a")
    first = poured([one], DECLARED, source, [()])
    assert [len(found.theta) for found in first] == [STEP]
    both = poured([one, model("b")], DECLARED, source, [first, first])
    assert [len(found.theta) for found in both] == [2 * STEP, STEP]
    np.testing.assert_array_equal(both[0].blocks[0][:STEP], first[0].blocks[0])
    assert [point.number for what, point in source.asked] == [*range(STEP), *range(STEP, 2 * STEP), *range(STEP)]
    # Within SCATTER of the box to either side: 0.15 of a parameter's unit, 0.3 of an amplitude that goes to 2.
    assert np.abs(both[0].theta - 0.5).max() <= SCATTER
    assert np.abs(both[0].amplitudes - 1.0).max() <= 2.0 * SCATTER
    assert np.ptp(both[0].theta) > SCATTER


def test_pours_that_go_on_take_the_place_of_the_earlier_ones():
    """Else they would teach the emulator twice; pours about another point, or of another effect, stay."""
    source, one = Noisy(a=1.0), model("a")
    first = poured([one], DECLARED, source, [()])
    elsewhere = poured([model("a", coded=(0.9, 0.9))], DECLARED, source, [first])
    other = (pours_of("b", STEP),)
    known = with_new(with_new(first, elsewhere), other)
    assert len(known) == 3
    more = poured([one], DECLARED, source, [known])
    assert [len(found.theta) for found in with_new(known, more)] == [STEP, STEP, 2 * STEP]


@pytest.mark.parametrize("number", [STEP, POURS])
def test_what_has_broken_off_is_not_a_number(number):
    class Broken(Noisy):
        def run(self, what, points):
            return [[SimpleNamespace(summaries=(0.0, 0.0), valid=False)] for _ in points]

    (found,) = poured([model("a")], DECLARED, Broken(), [()], number)
    assert np.isnan(found.blocks[0]).all()
    assert found.blocks[0].shape == (number, 2)
