"""Which effects are looked at again: shares of what the best one takes up of the residual."""

from types import SimpleNamespace

from doe.diagnose.follow_up.closer import IN_QUESTION, in_question, lost


def verdict(kind="unexplained", **drops):
    """Of effects with these drops of T²; one that these data cannot see takes part in nothing."""
    rows = [SimpleNamespace(name=name, drop=drop, status="raced") for name, drop in drops.items()]
    hidden = SimpleNamespace(name="hidden", drop=1e3, status="not identifiable here")
    return SimpleNamespace(kind=kind, effects=[*rows, hidden])


def test_a_second_look_is_for_all_that_take_up_their_share_best_first():
    share = 100.0 * IN_QUESTION
    assert in_question(verdict(near=share, best=100.0, not_so=share - 1.0, next=60.0)) == ("best", "next", "near")


def test_where_nothing_is_missing_or_nothing_helps_none_is_in_question():
    assert in_question(verdict("no_missing_effect", best=100.0)) == ()
    assert in_question(verdict(best=0.0)) == ()
    assert in_question(verdict()) == ()


def test_what_was_looked_at_and_has_gone_out_of_sight_is_not_given_up():
    seen = verdict(best=100.0, other=1.0)
    assert lost(seen, ("best", "hidden")) == ("hidden",)
    assert lost(seen, ("best", "other")) == ()
    assert "hidden" not in in_question(seen)
