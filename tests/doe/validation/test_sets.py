"""Counting: intervals against statsmodels, answers and targets of made-up rows by hand."""

import json
import math
import re
from dataclasses import replace

import pytest
from statsmodels.stats.proportion import proportion_confint

from doe.diagnose.posterior import NOTHING, OUTSIDE, PAIRS
from doe.diagnose.result import BODIES_ALONE
from doe.diagnose.verdict import THRESHOLD
from doe.errors import StatisticsError
from doe.validation.sets import (
    LEAST_P,
    NONE,
    TEMPERATURES,
    SetRow,
    answer_to,
    append_rows,
    by_temperature,
    read_rows,
    scores,
    targets,
    wilson,
)
from explorer.terminal.validation import campaign_text
from solver import PHYSICS

NAN = math.nan


def row(number, kind, label, verdict, strength=NAN, after=NAN, offer="scan"):
    return SetRow(
        laboratory="blind",
        root=5,
        number=number,
        kind=kind,
        label=label,
        strength=strength,
        amplitude="",
        offer=offer,
        verdict=verdict,
        nothing=0.1,
        outside=0.1,
        best="a",
        best_p=0.8,
        evidence={"base": 0.0},
        fits={"base": 0.05},
        before=2.0 * after,
        after=after,
        pours=12,
        seconds=1.5,
    )


@pytest.mark.parametrize(("hits", "sets"), [(0, 150), (3, 150), (7, 9), (9, 9)])
def test_wilson_interval_is_that_of_statsmodels(hits, sets):
    assert wilson(hits, sets) == pytest.approx(proportion_confint(hits, sets, method="wilson"), abs=1e-12)


@pytest.mark.parametrize(
    ("verdict", "kind", "label", "answer"),
    [
        ("no_missing_effect", "null", "none", "nothing"),
        ("no_missing_effect", "effect", "a", "nothing"),
        ("effect:a", "effect", "a", "right"),
        ("effect:a", "null", "none", "wrong"),
        ("effect:a", "pair", "a+b", "wrong"),
        ("effects:b+a", "pair", "a+b", "right"),
        ("effects:a+c", "effect", "a", "wrong"),
        ("ambiguous:b,a", "effect", "a", "undecided"),
        ("ambiguous:b,c", "effect", "a", "wrong"),
        ("ambiguous:b,no_missing_effect", "effect", "a", "wrong"),
        ("ambiguous:b,no_missing_effect", "null", "none", "undecided"),
        ("ambiguous:a+b,a+c", "pair", "a+b", "undecided"),
        ("unexplained", "outside", "sticky_funnel", "unexplained"),
        ("ambiguous:b,unexplained", "outside", "sticky_funnel", "undecided"),
        ("ambiguous:b,unexplained", "effect", "a", "wrong"),
        ("ambiguous:b,c", "outside", "sticky_funnel", "wrong"),
        ("out of reach: bounds", "effect", "a", "out of reach"),
    ],
)
def test_what_an_answer_is_worth(verdict, kind, label, answer):
    assert answer_to(verdict, kind, label) == answer


@pytest.mark.parametrize(
    ("verdict", "named"),
    [
        ("effect:a", True),
        ("effects:a+b", True),
        ("ambiguous:a,b", True),
        ("ambiguous:a,no_missing_effect", False),
        ("ambiguous:unexplained,a", False),
        ("no_missing_effect", False),
        ("unexplained", False),
    ],
)
def test_who_is_accused(verdict, named):
    assert row(0, "null", "none", verdict).named is named


def test_rows_come_back_as_they_were_written(tmp_path):
    rows = [row(1, "null", "none", "no_missing_effect"), row(0, "effect", "a", "ambiguous:a,b", 6.0, 1.25)]
    for one in rows:
        append_rows(tmp_path / "sets.jsonl", [one])
    assert [str(one) for one in read_rows(tmp_path / "sets.jsonl")] == [str(one) for one in reversed(rows)]
    for line in (tmp_path / "sets.jsonl").read_text().splitlines():
        assert json.loads(line)["root"] == 5


def test_follow_ups_are_held_against_the_chance_that_they_were_said_to_have():
    rows = [
        replace(row(k, kind, label, verdict), first="ambiguous:a,b", follow_up="half the mass", asked=asked, chance=0.8)
        for k, (kind, label, verdict, asked) in enumerate(
            [
                ("effect", "a", "effect:a", 6),
                ("effect", "a", "no_missing_effect", 6),
                ("null", "none", "no_missing_effect", 6),
                ("outside", "x", "unexplained", 24),
                ("pair", "a+b", "ambiguous:a+b,b", 24),
            ]
        )
    ]
    text = campaign_text([*rows, row(9, "null", "none", "no_missing_effect")])
    assert "answered by 6 more pours, stated chance 80%: 2/3 = 66.7 %" in text
    assert "answered by 24 more pours, stated chance 80%: 1/2 = 50.0 %" in text
    assert "single bodies" not in text
    checks = [replace(one, follow_up=BODIES_ALONE, asked=0, chance=0.9) for one in rows[:2]]
    text = campaign_text([*checks, *rows[3:]])
    assert "checked by single bodies alone, stated chance 90%: 1/2 = 50.0 %" in text
    assert "answered by 24 more pours, stated chance 80%: 1/2 = 50.0 %" in text


def test_a_line_that_was_cut_off_is_passed_over_and_its_set_can_be_judged_again(tmp_path):
    path, rows = tmp_path / "sets.jsonl", [row(k, "null", "none", "no_missing_effect") for k in (1, 2)]
    append_rows(path, rows)
    path.write_text(path.read_text()[:-30])
    assert [one.number for one in read_rows(path)] == [1]
    append_rows(path, rows)
    assert [str(one) for one in read_rows(path)] == [str(one) for one in rows]


@pytest.mark.parametrize("line", ['{"root": 1}', '{"root": }', '{"other": 1, "laboratory": "a"}'])
def test_a_line_that_is_no_row_is_refused_in_one_line(tmp_path, line):
    path = tmp_path / "sets.jsonl"
    append_rows(path, [row(1, "null", "none", "no_missing_effect")])
    path.write_text(path.read_text() + line + "\n")
    with pytest.raises(StatisticsError, match=r"sets\.jsonl: line 2: .*; allowed: a row of a campaign"):
        read_rows(path)


def judged(number, kind, label, verdict, best, best_p, nothing=0.0, outside=0.0, truth_p=NAN):
    one = row(number, kind, label, verdict, 6.0)
    return replace(one, best=best, best_p=best_p, nothing=nothing, outside=outside, truth_p=truth_p)


def test_scores_by_hand():
    rows = [
        judged(0, "null", "none", "no_missing_effect", "a", 0.1, nothing=0.8),
        judged(1, "effect", "a", "effect:a", "a", 0.95, truth_p=0.95),
        judged(2, "effect", "b", "ambiguous:a,b", "a", 0.6, truth_p=0.4),
        judged(3, "effect", "b", "effect:b", "b", 1.0, truth_p=1.0),
        judged(4, "pair", "a+b", "effect:a", "a", 0.92),
        judged(5, "outside", "draught", "unexplained", "a", 0.2, outside=0.7),
    ]
    found = scores(rows)
    # The pair was not weighed: its probability counts as the least.
    p = [0.8, 0.95, 0.4, 1.0, LEAST_P, 0.7]
    assert found.log_loss == pytest.approx(-sum(map(math.log, p)) / 6)
    # By probability: b right at 1, a right at 0.95, then the pair's wrong name.
    assert [(rate.hits, rate.sets) for rate in found.coverage] == [(2, 4)] * 3
    assert [(one.right.hits, one.right.sets) for one in found.reliability] == [(0, 0), (0, 1), (2, 2), (1, 2), (1, 1)]
    # a and b named rightly, and one of the pair: 3 of the 5 that act.
    assert found.f1 == pytest.approx(2 * 3 / (2 * 3 + 2))


def test_the_two_of_a_pair_are_right_in_any_order():
    found = scores([judged(0, "pair", "a+b", "effects:b+a", "b+a", 0.95)])
    assert found.log_loss == pytest.approx(-math.log(0.95))
    assert [rate.hits for rate in found.coverage] == [1, 1, 1]
    assert [one.right.hits for one in found.reliability if one.right.sets] == [1]


def weighed(number, kind, label, **evidence):
    return replace(row(number, kind, label, "unexplained", 6.0), evidence={"base": 0.0, "outside": -50.0} | evidence)


def test_other_temperatures_by_hand():
    rows = [
        weighed(0, "effect", "a", a=8.0, b=2.0),
        weighed(1, "effect", "a", a=2.0, b=8.0),
        weighed(2, "null", "none", a=6.0, b=0.0),
        weighed(3, "pair", "a+b", a=9.0, b=0.0),
    ]
    found = {one.temperature: one for one in by_temperature(rows)}
    share = (1 - NOTHING - OUTSIDE - PAIRS) / 2
    for temperature in TEMPERATURES:
        one, total = found[temperature], NOTHING + share * (math.exp(8 * temperature) + math.exp(2 * temperature))
        logs = [math.log(total / share) - x * temperature for x in (8, 2)]
        logs += [math.log(1 + share * (1 + math.exp(6 * temperature)) / NOTHING)]
        assert one.log_loss == pytest.approx(sum(logs) / 3, rel=1e-6)
        sure = share * math.exp(8 * temperature) / total >= THRESHOLD
        assert (one.right.hits, one.wrong.hits, one.right.sets) == (sure, sure, 2)
        accused = share * math.exp(6 * temperature) / (NOTHING + share * (1 + math.exp(6 * temperature))) >= THRESHOLD
        assert (one.false.hits, one.false.sets) == (accused, 1)
    # Colder is surer.
    assert not found[0.4].right.hits
    assert found[1.0].right.hits
    assert found[1.0].false.hits


def test_targets_by_hand():
    rows = [row(k, "null", "none", "no_missing_effect") for k in range(49)]
    rows += [row(49, "null", "none", "ambiguous:a,b")]
    rows += [row(50 + k, "effect", "a", "effect:a", 10.0, after) for k, after in enumerate((0.9, 1.0, 1.2, 1.4))]
    rows += [row(54, "effect", "a", "effect:b", 10.0)]
    rows += [row(55, "effect", "a", "out of reach: bounds", 6.0)]
    rows += [row(56, "outside", "sticky_funnel", "unexplained"), row(57, "outside", "sticky_funnel", "effect:b")]
    rows += [row(58, "pair", "a+b", "effect:a", 7.3), row(59, "pair", "a+b", "unexplained", 6.8)]
    rows += [row(60, "effect", "a", "effect:b", 25.0), row(50, "effect", "a", "unexplained", 10.0, offer="scalars")]
    found = {one.name: one for one in targets([one for one in rows if one.answer != "out of reach"], "scan")}
    assert found["effect named where none is"].found.startswith("1/50 = 2.0 %")
    # What is stronger than the test's strengths is not among its targets.
    assert found["wrong name, effects of 6 and 10 σ and pairs"].found.startswith("2/7 = 28.6 %")
    assert found["right name at 10 σ"].found.startswith("4/5 = 80.0 %")
    assert found["right name at 6 σ"].met is None
    assert found["holdout error ÷ noise floor, right names"].found == "1.10 over 4 sets"
    assert found["holdout error ÷ noise floor ≤ 1.25, right names"].found.startswith("3/4 = 75.0 %")
    assert found["outside effects called unexplained"].found.startswith("1/2")
    assert found["outside effects blamed on the library"].found.startswith("1/2")
    text = campaign_text(rows)
    assert "60 of 61 data sets within reach" in text
    assert re.search(r"effect, 10 σ +5 +0 +4 +0 +0 +1\n", text)
    assert "wrong, set 5.54: a at 10 σ → effect:b" in text
    assert "with scalars" in text


def test_sets_of_another_physics_are_told_apart():
    rows = [replace(row(k, "null", NONE, "no_missing_effect"), physics=one) for k, one in enumerate((PHYSICS, 2, 2, 0))]
    assert f"poured: 1 by one not kept, 2 by physics 2, 1 by physics {PHYSICS};" in campaign_text(rows)
    assert "poured:" not in campaign_text(rows[:1])
