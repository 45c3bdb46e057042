"""The schedule: enough sets of every kind, and a prefix that does not depend on how many are asked for."""

import itertools
import math
from collections import Counter

from doe.validation.outside import AMPLITUDE
from doe.validation.schedule import STRENGTHS, cases
from solver import EFFECTS

FULL = 327


def test_the_whole_campaign_holds_what_the_targets_need():
    asked = list(cases(FULL, tuple(EFFECTS), tuple(AMPLITUDE)))
    kinds = Counter(case.kind for case in asked)
    assert kinds["null"] >= 150
    assert sum(kinds.values()) - kinds["null"] >= 100
    assert len(AMPLITUDE) >= 4
    single = Counter((case.label, case.strength) for case in asked if case.kind == "effect")
    assert set(single) == set(itertools.product(EFFECTS, STRENGTHS))
    assert len(set(single.values())) == 1
    assert [case.number for case in asked] == list(range(FULL))


def test_fewer_sets_are_the_first_of_more():
    def plain(case):
        return case.number, case.kind, case.label, None if math.isnan(case.strength) else case.strength

    some, more = (list(map(plain, cases(n, tuple(EFFECTS), tuple(AMPLITUDE)))) for n in (40, 150))
    assert more[:40] == some
    assert {kind for _, kind, _, _ in more} == {"null", "effect", "pair", "outside"}
