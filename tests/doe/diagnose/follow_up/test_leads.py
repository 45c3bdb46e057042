"""Which effects are followed: shares of what the best one takes up of the residual."""

from types import SimpleNamespace

import pytest

from doe.diagnose.follow_up.closer import LEAD_SHARE, MAYBE_SHARE, leads, lost, maybe_leads
from doe.diagnose.simulation.budget import LEADS


def verdict(kind="unexplained", **drops):
    """Of effects with these drops of T²; one that these data cannot see takes part in nothing."""
    rows = [SimpleNamespace(name=name, drop=drop, status="raced") for name, drop in drops.items()]
    hidden = SimpleNamespace(name="hidden", drop=1e3, status="not identifiable here")
    return SimpleNamespace(kind=kind, effects=[*rows, hidden])


def test_a_second_look_is_for_more_effects_than_lead():
    seen = verdict(best=100.0, near=100.0 * LEAD_SHARE, maybe=100.0 * MAYBE_SHARE, not_so=100.0 * MAYBE_SHARE - 1.0)
    assert maybe_leads(seen) == ("best", "near", "maybe")
    assert leads(seen) == ("best", "near")


def test_no_more_than_some_lead_and_the_best_come_first():
    many = verdict(**{f"e{k}": 90.0 + k for k in range(LEADS + 3)})
    assert leads(many) == tuple(f"e{k}" for k in range(LEADS + 2, 2, -1))
    assert len(maybe_leads(many)) == LEADS + 3


@pytest.mark.parametrize("asked", [maybe_leads, leads])
def test_where_nothing_is_missing_or_nothing_helps_none_lead(asked):
    assert asked(verdict("no_missing_effect", best=100.0)) == ()
    assert asked(verdict(best=0.0)) == ()
    assert asked(verdict()) == ()


def test_what_was_looked_at_and_has_gone_out_of_sight_is_not_given_up():
    seen = verdict(best=100.0, other=1.0)
    assert lost(seen, ("best", "hidden")) == ("hidden",)
    assert lost(seen, ("best", "other")) == ()
    assert "hidden" not in leads(seen)
