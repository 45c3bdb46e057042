"""The campaign in the small: 26 bodies a pour, one parameter, two effects, one set of each kind, from an empty store.

It proves that the machinery works on real pours from end to end. How often the diagnosis is right it cannot prove;
that takes the whole campaign. Slow: some minutes. What CI runs of it is in `test_laboratory.py`.
"""

import dataclasses
from contextlib import closing

import numpy as np
import pytest

from doe.declared.budget import Budget
from doe.declared.model import Declared, declare
from doe.measurement import load_measurement
from doe.store import Store
from doe.validation.campaign import Answers, CampaignOrder, run_campaign
from doe.validation.laboratory import read_laboratory
from doe.validation.limit import DataKind, Reached, Strength
from doe.validation.truth import Case, strengths_of, truth_of
from doe.validation.work_place import WorkPlace
from tests.doe.validation.disguise import disguise
from tests.doe.validation.small_model import small_laboratory

pytestmark = pytest.mark.slow

EFFECTS = ("rolling_resistance", "plate_tilt")
CASES = (
    Case(9, 0, "null"),
    Case(9, 1, "effect", "rolling_resistance", 12.0),
    Case(9, 2, "outside", "sticky_funnel"),
)


def strengths(declared: Declared):
    """Nobody has measured the small model: an amplitude that is strong by all experience."""
    found = (Reached(DataKind(EFFECTS[0], EFFECTS[0], False), (0.3,), Strength(12.0, 0.5), Strength(6.0, 0.5), {}),)
    return dataclasses.replace(strengths_of(found, declared, {}), declared=declared)


@pytest.fixture(scope="module")
def order(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    laboratory = small_laboratory(folder / "laboratory")
    return CampaignOrder(
        out=folder / "out",
        number=len(CASES),
        store=folder / "runs.sqlite",
        workers=2,
        laboratory=laboratory,
        effects=EFFECTS,
        budget=Budget(base=16, screening=4, more=6, looks=2),
        cases=CASES,
        strengths=strengths(declare(read_laboratory(laboratory).declared, EFFECTS)),
    )


class Listener:
    """Keeps what it is told."""

    def __init__(self):
        self.pours, self.sets = [], []

    def pour(self, part, left, ended):
        self.pours.append((part, left))

    def judged(self, done, planned, judged_now, line):
        self.sets.append((done, planned, judged_now))

    def watched(self, pours):
        return pours


@pytest.fixture(scope="module")
def rows(order):
    listener = Listener()
    found = run_campaign(order, print, listener)
    assert listener.sets == [(1, 3, 1), (2, 3, 2), (3, 3, 3)]
    assert {"laboratory"} < {part for part, _ in listener.pours}
    return found


def numbers(rows):
    """What a set comes to, without the time that it took; as text, where NaN is NaN."""
    return [str(dataclasses.replace(row, seconds=0.0, pours=0)) for row in rows]


def test_each_kind_of_truth_gets_its_answer(rows):
    assert [(row.number, row.offer) for row in rows] == [(k, offer) for k in range(3) for offer in ("scalars", "scan")]
    null, effect, outside = rows[0:2], rows[2:4], rows[4:6]
    assert not any(row.named for row in null)
    assert all(row.answer == "right" for row in effect)
    assert not any(row.answer == "right" for row in outside)


def test_a_right_name_is_tried_on_held_out_data(rows):
    for row in rows[2:4]:
        assert row.after < row.before
    assert [row.after == row.after for row in rows] == [False, False, True, True, False, False]


def test_a_campaign_goes_on_where_it_stopped(order, rows):
    path = order.out / "sets.jsonl"
    kept = path.read_text()
    assert numbers(run_campaign(order, print)) == numbers(rows)
    assert path.read_text() == kept


def test_a_row_that_is_lost_comes_out_the_same_without_a_new_pour(order, rows):
    path = order.out / "sets.jsonl"
    kept = path.read_text().splitlines()
    path.write_text("\n".join(kept[:2]) + "\n")
    with closing(Store(order.store)) as store:
        before = len(list(store.runs()))
        again = run_campaign(order, print)
        assert len(list(store.runs())) == before
    assert numbers(again) == numbers(rows)


def test_two_shards_are_the_campaign(order, rows, tmp_path):
    for shard in (1, 2):
        run_campaign(dataclasses.replace(order, out=tmp_path, shard=shard, of=2), print)
    assert numbers(run_campaign(dataclasses.replace(order, out=tmp_path), print)) == numbers(rows)


def test_single_sets_are_judged_alone(order, rows, tmp_path):
    found = run_campaign(dataclasses.replace(order, out=tmp_path, only=(2, 0)), print)
    assert numbers(found) == numbers([*rows[0:2], *rows[4:6]])


def test_time_that_is_over_stops_it_cleanly(order, tmp_path):
    said = []
    late = dataclasses.replace(order, out=tmp_path, store=tmp_path / "empty.sqlite", minutes=1e-4)
    assert run_campaign(late, said.append) == []
    assert "the same command continues" in said[-1]


def test_the_verdict_depends_on_numbers_only(order, rows, tmp_path):
    """Another name of the folder, other free text, other comments, rows in another order: the same verdict."""
    first, second = tmp_path / "rolling_resistance", tmp_path / "plate_tilt"
    with closing(Store(order.store)) as store, WorkPlace(store, 1) as place:
        laboratory = read_laboratory(order.laboratory)
        answers = Answers(laboratory, order.strengths, place, order.budget)
        truth = truth_of(CASES[1], order.strengths)
        data = answers.measured(truth, laboratory.declared.conditions)
        assert place.poured == 0
        readings = {name: [sample.reading for sample in samples] for name, samples in data.items()}
        for folder in (first, second):
            folder.mkdir()
            laboratory.write(folder, readings)
        disguise(second, np.random.default_rng(0))
        one, other = (answers.judged_data(load_measurement(folder), truth, "scalars").row for folder in (first, second))
    assert one.verdict == "effect:rolling_resistance"
    assert numbers([one]) == numbers([other])
