"""What is poured for which effect: nothing for one that cannot be seen, all of a wider range."""

import pytest

from doe.diagnose.runs import Declared, Effect
from doe.diagnose.simulation.budget import LEAST, Budget
from doe.diagnose.simulation.ranges import UNSEEN
from doe.diagnose.simulation.screen import continued, over_wider_ranges, screen
from doe.errors import StatisticsError
from tests.doe.diagnose.simulation.made_up_pours import DECLARED, Noisy


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
    screened = [point for what, point in model.asked if what == "screening" and not point.sequence.endswith("middle")]
    assert {name for point in screened for name, _ in point.effects} == {"clear"}
    assert any("faint" in line and "too little" in line for line in said)


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


def test_more_settings_go_on_in_the_sequence_of_the_present_range():
    declared = Declared(DECLARED.parameters, (Effect("e", (0.0,), (0.25,)),), DECLARED.conditions)
    widest = Declared(DECLARED.parameters, (Effect("e", (0.0,), (1.0,)),), DECLARED.conditions)
    model = Noisy(e=40.0)

    def numbers(what):
        return [point.number for asked, point in model.asked if asked == what]

    found = screen(declared, model, Budget(base=24, middle=16, screening=4), lambda line: None)
    found = continued(found, "second look", ("e",), 4, model, lambda line: None)
    assert numbers("second look") == [4, 5, 6, 7]
    found = continued(found, "third look", ("e",), 8, model, lambda line: None)
    assert numbers("third look") == list(range(8, 16))
    one = [point for point in found.points if point.effects and not point.sequence.endswith("middle")]
    assert len({point.theta for point in one}) == 16

    found = over_wider_ranges(found, ("e",), widest, model, Budget(widened=10), lambda line: None)
    continued(found, "fourth look", ("e",), 3, model, lambda line: None)
    assert numbers("fourth look") == [10, 11, 12]


@pytest.mark.parametrize("runs", [109, 200, 300, 600, 3000])
def test_a_budget_is_all_but_what_is_asked_for(runs):
    """15 effects in one condition, as for the shipped trefoils: by itself 64 + 15 × (1 + 4) = 139 pours."""
    assert Budget().planned(15, 1) == 64 + 75 == 139
    found = Budget().scaled(runs, 15, 1)
    # Of what every effect gets alike nothing may be left out: steps of 15 pours, at most two at once.
    assert runs - 30 <= found.planned(15, 1) <= runs
    assert all(getattr(found, key) >= value for key, value in vars(LEAST).items())


def test_a_budget_that_can_bear_no_verdict_is_refused():
    assert LEAST.planned(15, 1) == 34 + 75
    with pytest.raises(StatisticsError, match="108 pours; 15 effects in 1 fitted conditions take at least 109"):
        Budget().scaled(108, 15, 1)
