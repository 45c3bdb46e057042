"""The part of the campaign that CI runs: laboratories of two kinds pour on the campaign's own workers.

The whole of it in the small, answers included, is slow (`test_campaign.py`).
"""

from contextlib import closing

from doe.store import Store
from doe.validation.answers import Answers
from doe.validation.laboratory import OBSERVABLES, declared_model
from doe.validation.schedule import Case
from doe.validation.truth import REPLICATES, Truth
from doe.validation.work_place import WorkPlace
from tests.doe.validation.small_model import small_model


def test_laboratories_pour_with_and_without_an_effect_and_nothing_twice(tmp_path):
    measurement = declared_model(small_model(tmp_path / "model"))
    (condition, *_) = measurement.fit
    theta = tuple(0.5 * (parameter.low + parameter.high) for parameter in measurement.parameters)
    rolling = (("rolling_resistance", (0.3,)),)
    truths = [
        Truth(Case(0, "null"), theta),
        Truth(Case(1, "effect", "rolling_resistance"), theta, rolling),
        Truth(Case(2, "effect", "rolling_resistance"), theta, missing="bounds"),
    ]
    with closing(Store(tmp_path / "runs.sqlite")) as store, WorkPlace(store, 2) as place:
        answers = Answers(tmp_path / "model", measurement, None, None, place)  # nothing is judged
        plain, acting, missing = answers.measured(truths, [condition])
        assert missing is None
        poured = place.poured
        assert poured >= 2 * REPLICATES
        for data in (plain, acting):
            assert len(data[condition.name]) == REPLICATES
            assert all(set(reading) == set(OBSERVABLES) for reading in data[condition.name])
        assert plain != acting
        assert answers.measured(truths, [condition]) == [plain, acting, None]
        assert place.poured == poured
