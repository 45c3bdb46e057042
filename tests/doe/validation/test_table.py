"""Counting: intervals against statsmodels, answers and targets of made-up rows by hand."""

import math
import re
from pathlib import Path

import pytest
from statsmodels.stats.proportion import proportion_confint

from doe.validation.outside import AMPLITUDE
from doe.validation.rates import targets, wilson
from doe.validation.schedule import cases
from doe.validation.sets import Row, answer_to, append_row, read_rows
from explorer.tables.validation import campaign_text
from solver import EFFECTS

NAN = math.nan
ROOT = Path(__file__).parents[3]
SCHEDULE = 327
"""Data sets of the whole campaign."""


def row(number, kind, label, verdict, strength=NAN, cosine=NAN, after=NAN):
    return Row(number, kind, label, strength, "", 9.5, verdict, 0.001, cosine, 2.0 * after, after, 12, 1.5)


@pytest.mark.parametrize(("hits", "sets"), [(0, 150), (3, 150), (7, 9), (9, 9)])
def test_wilson_interval_is_that_of_statsmodels(hits, sets):
    assert wilson(hits, sets) == pytest.approx(proportion_confint(hits, sets, method="wilson"), abs=1e-12)


@pytest.mark.parametrize(
    ("verdict", "label", "cosine", "answer"),
    [
        ("no_missing_effect", "none", NAN, "nothing"),
        ("no_missing_effect", "a", NAN, "nothing"),
        ("effect:a", "a", 1.0, "right"),
        ("effect:a", "none", NAN, "wrong"),
        ("effect:a", "a+b", NAN, "wrong"),
        ("effects:b+a", "a+b", NAN, "right"),
        ("effects:a+c", "a", NAN, "wrong"),
        ("ambiguous:b,a", "a", 0.95, "right"),
        ("ambiguous:b,a", "a", 0.85, "undecided"),
        ("ambiguous:b,a", "a", NAN, "undecided"),
        ("ambiguous:b,c", "a", 0.95, "wrong"),
        ("ambiguous:a+b,a+c", "a+b", NAN, "undecided"),
        ("unexplained", "sticky_funnel", NAN, "unexplained"),
        ("out of reach: bounds", "a", NAN, "out of reach"),
    ],
)
def test_what_an_answer_is_worth(verdict, label, cosine, answer):
    assert answer_to(verdict, label, cosine) == answer


def test_rows_come_back_as_they_were_written(tmp_path):
    rows = [row(1, "null", "none", "no_missing_effect"), row(0, "effect", "a", "ambiguous:a,b", 6.0, 0.93, 1.25)]
    for one in rows:
        append_row(tmp_path / "sets.csv", one)
    assert [str(one) for one in read_rows(tmp_path / "sets.csv")] == [str(one) for one in reversed(rows)]


def test_the_readme_s_table_is_that_of_the_rows_that_stand_beside_it():
    rows = read_rows(ROOT / "assets/validation/sets.csv")
    # Every row is that of the schedule with its number, once.
    planned = list(cases(SCHEDULE, tuple(EFFECTS), tuple(AMPLITUDE)))
    assert len({one.number for one in rows}) == len(rows)
    for one in rows:
        case = planned[one.number]
        assert (one.kind, one.strength) == (case.kind, pytest.approx(case.strength, nan_ok=True))
        assert case.label in ("", one.label)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"```\n{campaign_text(rows)}\n```" in readme
    assert f"--n {SCHEDULE} --minutes 0 --out assets/validation" in readme


def test_targets_by_hand():
    rows = [row(k, "null", "none", "no_missing_effect") for k in range(49)]
    rows += [row(49, "null", "none", "ambiguous:a,b")]
    rows += [row(50 + k, "effect", "a", "effect:a", 10.0, 1.0, after) for k, after in enumerate((0.9, 1.0, 1.2, 1.4))]
    rows += [row(54, "effect", "a", "effect:b", 10.0, 0.2)]
    rows += [row(55, "effect", "a", "out of reach: bounds", 6.0)]
    rows += [row(56, "outside", "sticky_funnel", "unexplained"), row(57, "outside", "sticky_funnel", "effect:b")]
    rows += [row(58, "pair", "a+b", "effect:a", 10.0), row(59, "pair", "a+b", "unexplained", 10.0)]
    found = {target.name: target for target in targets([one for one in rows if one.answer != "out of reach"])}
    assert found["an effect blamed where none is"].found.startswith("1/50 = 2.0 %")
    assert found["wrong name, library effects and pairs"].found.startswith("2/7 = 28.6 %")
    assert found["right name at 10 σ"].found.startswith("4/5 = 80.0 %")
    assert found["holdout error ÷ noise floor, right names"].found == "1.10 over 4 sets"
    assert found["holdout error ÷ noise floor ≤ 1.25, right names"].found.startswith("3/4 = 75.0 %")
    assert found["outside effects called unexplained"].found.startswith("1/2")
    assert [target.met for target in found.values()] == [True, False, True, None, False, False, True, False]
    text = campaign_text(rows)
    assert "59 data sets judged, 1 out of reach" in text
    # Seen shifts of 9.5 σ each, and the answers of the five sets.
    assert re.search(r"effect, 10 σ +5 +9\.5 +0 +4 +0 +0 +1\n", text)
    assert "wrong, set 54: a at 10 σ → effect:b" in text
    assert "out of reach: bounds, not counted: a at 6 σ" in text
