"""What jams, ends nowhere, or contradicts only a part of an answer costs no more than that part."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from doe.declared.model import CandidateEffect, declare
from doe.declared.points import Direction, directions_of
from doe.diagnose import diagnosis, training_amplitudes, training_pours
from doe.diagnose.confirm import Confirmed
from doe.diagnose.posterior import BestAmplitude
from doe.diagnose.result import Amplitude, CalibratedModel
from doe.diagnose.training_amplitudes import level_of
from doe.diagnose.training_pours import TRIALS, TrainingPours
from doe.errors import StatisticsError
from doe.holdout import MeasuredReplicates
from solver import EFFECTS
from tests.doe.diagnose.test_loop import BUDGET, NAMES, FormulaPours, acting, measure, too_small, twins

pytestmark = pytest.mark.usefixtures("plates")


def taught(measurement):
    pours = FormulaPours(measurement.fit, [], None, None)
    return TrainingPours(declare(measurement, NAMES), measurement.fit, pours, BUDGET, lambda line: None)


def jammed(pour):
    return replace(pour, outcome="jammed")


def test_set_ups_in_which_everything_jams_are_no_candidates_and_take_no_verdict_with_them(measurement, monkeypatch):
    measurement = replace(measurement, conditions=measurement.fit)
    known = {condition.name for condition in measurement.fit}

    class Jams(FormulaPours):
        def pour(self, point, condition):
            pour = super().pour(point, condition)
            return pour if condition.name in known else jammed(pour)

    monkeypatch.setattr(diagnosis, "ModelPours", Jams)
    measure(monkeypatch, (("air_drag", (0.5 * EFFECTS["air_drag"].strongest,)),), 1, twins)
    found = diagnosis.run_diagnosis(measurement, None, None, NAMES, BUDGET, lambda line: None)
    assert found.verdict.kind.startswith("ambiguous:")
    assert found.suggestions == ()


def test_a_level_is_no_amplitude_at_which_everything_jams(monkeypatch):
    shifts = []

    def shift(declared, base, moved):
        shifts.append(moved)
        return math.inf if moved > 0.06 else 40.0 * moved

    monkeypatch.setattr(training_amplitudes, "whitened_shift", shift)
    search = level_of(None, Direction("a", "a", (1.0,)), None, lambda share, number: share, TRIALS)
    share = next(search)
    while share is not None:
        try:
            share = search.send(share)
        except StopIteration as end:
            level, share = end.value, None
    assert shifts[-1] > 0.06
    assert (level.share, level.shift) == (pytest.approx(0.05), pytest.approx(2.0))


def test_pours_that_each_jam_in_another_condition_teach_nothing(measurement, monkeypatch):
    measurement = replace(measurement, conditions=tuple(replace(one, role="fit") for one in measurement.conditions))
    first = measurement.fit[0].name

    class Half(FormulaPours):
        def pour(self, point, condition):
            pour = super().pour(point, condition)
            return pour if (point.number % 2 == 0) == (condition.name == first) else jammed(pour)

    monkeypatch.setattr(diagnosis, "ModelPours", Half)
    measure(monkeypatch, (), 1)
    with pytest.raises(StatisticsError, match="0 of 24 pours end in a valid pile in every condition"):
        diagnosis.run_diagnosis(measurement, None, None, NAMES, BUDGET, lambda line: None)


def test_an_effect_in_the_plane_keeps_one_level_where_one_of_its_directions_jams(measurement, monkeypatch):
    monkeypatch.setattr(training_pours, "level_of", too_small)
    monkeypatch.setattr(training_pours, "unchanged_by_a_quarter_turn", lambda scene: False)
    whole, size = FormulaPours.pour, EFFECTS["plate_tilt"].strongest

    def broken(self, point, condition):
        far = any(name == "plate_tilt" and a[1] < -0.12 * size for name, a in acting(point))
        pour = whole(self, point, condition)
        return jammed(pour) if far else pour

    monkeypatch.setattr(FormulaPours, "pour", broken)
    training = taught(measurement)
    tilts = [one for one in training.levels if one.direction.effect == "plate_tilt"]
    assert len({one.share for one in tilts}) == 1
    assert tilts[0].share <= 0.12
    others = [one for one in training.levels if one.direction.effect == "rolling_resistance"]
    assert others[0].share > 0.2


def test_a_pair_is_refined_where_its_members_are_in_it(measurement, monkeypatch):
    training, wanted = taught(measurement), []
    ways = {way.name: (number, way) for number, way in enumerate(training.ways)}
    (up, _), (down, lighter) = ways["density_error +"], ways["density_error -"]
    roll, rolling = ways["rolling_resistance"]
    label = "density_error+rolling_resistance"
    amplitudes = [
        Amplitude("density_error", 0, 0.6 * lighter.unit[0], 0.0, 0.0, False),
        Amplitude("rolling_resistance", 0, 1.5 * rolling.unit[0], 0.0, 0.0, False),
    ]
    # Alone, a higher density fits best.
    levels = BestAmplitude(up, 1.0, 0.0), BestAmplitude(down, 1.0, -9.0), BestAmplitude(roll, 1.0, 0.0)
    found = SimpleNamespace(levels=levels, fits={label: SimpleNamespace(amplitudes=amplitudes)})
    monkeypatch.setattr(training, "_pour", lambda what, asked: wanted.extend(asked))
    training.refine(found, label)
    far = min(2.0, rolling.most)
    assert {(way, multiple) for way, multiple, _ in wanted} == {(down, 0.5), (down, 1.0), (roll, 1.0), (roll, far)}


@pytest.mark.parametrize(("nothing_is_off", "withdrawn"), [(0.0, False), (9.0, True)])
def test_nothing_missing_stays_possible_unless_held_out_data_contradict_it_too(
    measurement, monkeypatch, nothing_is_off, withdrawn
):
    rng, held = np.random.default_rng(1), measurement.holdout
    data = MeasuredReplicates("far", ("height", "width"), rng.standard_normal((6, 2)), np.zeros(2))
    model = CalibratedModel((), ())
    before, after = (
        Confirmed(model, (rng.standard_normal((8, 2)) + off,) * len(held), 0) for off in (nothing_is_off, 9.0)
    )
    monkeypatch.setattr(diagnosis, "confirm", lambda *_: (before, after))
    monkeypatch.setattr(diagnosis, "model_of", lambda fit, declared: model)
    monkeypatch.setattr(diagnosis, "replicates_of", lambda condition: data)
    monkeypatch.setattr(diagnosis, "taken_back", lambda verdict, why: SimpleNamespace(kind="unexplained"))
    kind = "ambiguous:no_missing_effect,a"
    verdict = SimpleNamespace(kind=kind, names=("a",), final="a")
    compared = SimpleNamespace(posterior=SimpleNamespace(fits={"a": None, "base": None}))
    found, last = diagnosis.concluded(verdict, compared, None, held, None, lambda line: None)
    assert last.kind == ("unexplained" if withdrawn else kind)
    assert found.held_out.p == pytest.approx(0.0 if withdrawn else 1.0, abs=0.9)


def test_a_range_that_ends_at_zero_has_one_direction():
    (down,) = directions_of(CandidateEffect("a", (-2.0,), (0.0,)))
    (up,) = directions_of(CandidateEffect("a", (0.0,), (3.0,)))
    assert [(one.name, one.full) for one in (down, up)] == [("a", (-2.0,)), ("a", (3.0,))]
    both = directions_of(replace(CandidateEffect("a", (-2.0,), (3.0,))))
    assert [(one.name, one.full) for one in both] == [("a +", (3.0,)), ("a -", (-2.0,))]
