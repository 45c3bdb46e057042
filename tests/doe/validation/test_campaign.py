"""The campaign in the small: 26 bodies a pour, one parameter, two effects, one set of each kind, from an empty store.

It proves that the machinery works on real pours from end to end. How often the diagnosis is right it cannot prove;
that takes the whole campaign. 115 s of processor time: slow, one to three minutes. What CI runs of it is in
`test_laboratory.py`. Last run on 2026-11-23: all pass.
"""

import dataclasses
from contextlib import closing

import numpy as np
import pytest

from doe.diagnose.simulation.budget import Budget
from doe.store import Store
from doe.validation.answers import Answers, Question, judged_folder
from doe.validation.campaign import CampaignOrder, emulated, run_campaign
from doe.validation.laboratory import declared_model, write_folder
from doe.validation.schedule import Case
from doe.validation.truth import ruler, truth_of
from doe.validation.work_place import WorkPlace
from tests.doe.validation.disguise import disguise
from tests.doe.validation.small_model import small_model

pytestmark = pytest.mark.slow

STRONG = 10.0
CASES = (
    Case(0, "null"),
    Case(1, "effect", "rolling_resistance", STRONG),
    Case(2, "outside", "sticky_funnel"),
)


@pytest.fixture(scope="module")
def order(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    return CampaignOrder(
        out=folder / "out",
        number=len(CASES),
        store=folder / "runs.sqlite",
        workers=2,
        model=small_model(folder / "model"),
        effects=("rolling_resistance", "plate_tilt"),
        budget=Budget(base=16, middle=8, scaling=2, screening=8, widened=8),
        cases=CASES,
    )


@pytest.fixture(scope="module")
def rows(order):
    return run_campaign(order, print)


def numbers(rows):
    """What a set comes to, without the time that it took; as text, where NaN is NaN."""
    return [str(dataclasses.replace(row, seconds=0.0)) for row in rows]


def test_each_kind_of_truth_gets_its_answer(rows):
    assert [row.number for row in rows] == [0, 1, 2]
    null, effect, outside = rows
    assert null.answer == "nothing"
    assert (effect.answer, effect.verdict) == ("right", "effect:rolling_resistance")
    assert outside.answer == "unexplained"


def test_a_right_name_is_tried_on_held_out_data(rows):
    _, effect, _ = rows
    assert effect.after < effect.before
    assert [row.after == row.after for row in rows] == [False, True, False]


def test_a_campaign_goes_on_where_it_stopped(order, rows):
    path = order.out / "sets.csv"
    kept = path.read_text()
    assert numbers(run_campaign(order, print)) == numbers(rows)
    assert path.read_text() == kept


def test_a_row_that_is_lost_comes_out_the_same_without_a_new_pour(order, rows):
    path = order.out / "sets.csv"
    kept = path.read_text().splitlines()
    path.write_text("\n".join(kept[:2]) + "\n")
    with closing(Store(order.store)) as store:
        before = len(list(store.runs()))
        again = run_campaign(order, print)
        assert len(list(store.runs())) == before
    assert numbers(again) == numbers(rows)


def test_time_that_is_over_stops_it_cleanly(order, tmp_path):
    said = []
    late = dataclasses.replace(order, out=tmp_path, store=tmp_path / "empty.sqlite", minutes=1e-4)
    assert run_campaign(late, said.append) == []
    assert "goes on" in said[-1]


def test_the_verdict_depends_on_numbers_only(order, rows, tmp_path):
    """Another name of the folder, other free text, other comments, rows in another order: the same verdict."""
    with closing(Store(order.store)) as store, WorkPlace(store, 1) as place:
        measurement = declared_model(order.model)
        screened = emulated(order, measurement, place, print)
        declared, runs = screened.declared, screened.runs
        answers = Answers(order.model, measurement, screened, ruler(declared, runs, declared.effects), place)
        (data,) = answers.measured([truth_of(CASES[1], answers.ruler)], measurement.fit)
        assert place.poured == 0
    first, second = tmp_path / "rolling_resistance", tmp_path / "plate_tilt"
    for folder in (first, second):
        folder.mkdir()
        write_folder(folder, order.model, data)
    disguise(second, np.random.default_rng(0))
    question = Question(declared, runs, order.model, data)
    one, other = (judged_folder(folder, question) for folder in (first, second))
    assert one.kind == "effect:rolling_resistance"
    assert other.to_dict() == one.to_dict()
