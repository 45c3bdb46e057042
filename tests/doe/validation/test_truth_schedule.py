"""The schedule: enough sets of every kind, other sets of another root, and a prefix that stays."""

import math
from collections import Counter

from doe.validation.outside import OUTSIDE_EFFECTS
from doe.validation.truth import STRENGTHS, WIDE_STRENGTHS, cases

FULL = 370


def plain(case):
    return case.number, case.kind, case.label, None if math.isnan(case.strength) else round(case.strength, 9)


def test_a_test_holds_what_the_targets_ask_for():
    asked = list(cases(3, FULL, tuple(OUTSIDE_EFFECTS)))
    kinds = Counter(case.kind for case in asked)
    assert kinds == {"null": 150, "effect": 120, "pair": 40, "outside": 60}
    assert Counter(case.strength for case in asked if case.kind == "effect") == dict.fromkeys(STRENGTHS, 60)
    outside = Counter(case.label for case in asked if case.kind == "outside")
    assert set(outside) == set(OUTSIDE_EFFECTS)
    assert max(outside.values()) - min(outside.values()) <= 1
    assert all(6.0 <= case.strength <= 10.0 for case in asked if case.kind == "pair")
    assert [case.number for case in asked] == list(range(FULL))
    assert {case.root for case in asked} == {3}


def test_fewer_sets_are_the_first_of_more():
    some, more = (list(map(plain, cases(3, n, tuple(OUTSIDE_EFFECTS)))) for n in (40, 150))
    assert more[:40] == some
    assert {kind for _, kind, _, _ in more} == {"null", "effect", "pair", "outside"}


def test_another_root_asks_for_other_sets():
    one, other = (list(map(plain, cases(root, 100, tuple(OUTSIDE_EFFECTS)))) for root in (3, 4))
    assert one != other
    assert next(iter(cases(3, 1, ("a",)))).seed != next(iter(cases(4, 1, ("a",)))).seed


def test_a_development_campaign_meets_every_strength():
    asked = Counter(case.strength for case in cases(3, FULL, ("a",), wide=True) if case.kind == "effect")
    assert set(asked) == set(WIDE_STRENGTHS)
    assert max(asked.values()) - min(asked.values()) <= 1
