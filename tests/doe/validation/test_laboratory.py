"""The part of the campaign that CI runs: laboratories of two kinds pour on the campaign's own workers.

The whole of it in the small, answers included, is slow (`test_campaign.py`).
"""

from contextlib import closing

import numpy as np

from doe.diagnose.budget import Budget
from doe.measurement import load_measurement
from doe.measurement.features import SCALARS, SCAN, features_of_data, offer_of
from doe.store import Store
from doe.validation.answers import Answers
from doe.validation.laboratory import OBSERVABLES, declared_model, hand_out
from doe.validation.scanner import Scanner
from doe.validation.schedule import Case
from doe.validation.truth import REPLICATES, Truth
from doe.validation.work_place import WorkPlace
from tests.doe.validation.small_model import small_model


def test_laboratories_pour_with_and_without_an_effect_and_nothing_twice(tmp_path):
    model = small_model(tmp_path / "model")
    measurement = declared_model(model)
    (condition, *_) = measurement.fit
    theta = tuple(0.5 * (parameter.low + parameter.high) for parameter in measurement.parameters)
    rolling = (("rolling_resistance", (0.3,)),)
    null, effect = Truth(Case(9, 0, "null"), theta), Truth(Case(9, 1, "effect"), theta, rolling)
    with closing(Store(tmp_path / "runs.sqlite")) as store, WorkPlace(store, 2) as place:
        answers = Answers(model, measurement, None, place, Budget())  # nothing is judged
        assert answers.measured(Truth(Case(9, 2, "effect"), theta, missing="bounds"), [condition]) is None
        plain, acting = (answers.measured(truth, [condition]) for truth in (null, effect))
        poured = place.poured
        assert poured >= 2 * REPLICATES
        for data in (plain, acting):
            assert len(data[condition.name]) == REPLICATES
            assert all(set(sample.reading) == set(OBSERVABLES) for sample in data[condition.name])
        assert [one.reading for one in plain[condition.name]] != [one.reading for one in acting[condition.name]]
        again = answers.measured(null, [condition])
        assert [one.reading for one in again[condition.name]] == [one.reading for one in plain[condition.name]]
        assert place.poured == poured
    for scanner, offer in ((None, SCALARS), (Scanner.drawn(np.random.default_rng(0)), SCAN)):
        folder = tmp_path / offer
        folder.mkdir()
        hand_out(folder, model, plain, scanner, (9, 0))
        (read,) = load_measurement(folder).fit
        assert offer_of(read) == offer
        assert np.isfinite(features_of_data(read)).all()
