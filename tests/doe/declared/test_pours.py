"""Which pours are the same: model, number and condition, not the number alone."""

import dataclasses
import math
from contextlib import closing

import numpy as np
import pytest

from doe.declared import pours as module
from doe.declared.model import Declared, DeclaredCondition
from doe.declared.points import Point
from doe.declared.pours import ModelPours, PointPour
from doe.diagnose.confirm import confirm
from doe.diagnose.result import CalibratedModel
from doe.diagnose.training_amplitudes import whitened_shift
from doe.measurement import summary_names
from doe.measurement.features import feature_set
from doe.store import Store
from doe.validation.laboratory import TREFOILS, read_laboratory
from solver import Outcome, value
from tests.solver.observables.made_up import empty_pile, record_of

FRICTION = "pair.grain.grain.static_friction"


@pytest.fixture
def poured(monkeypatch, tmp_path):
    """A model of one parameter whose every summary is that parameter, and the jobs that were run."""
    condition = read_laboratory(TREFOILS).declared.fit[0]
    jobs = []

    def run(queue, room):
        while queue:
            job = queue.popleft()
            jobs.append(job)
            friction = float(value(job.scene, FRICTION))
            # What is read is read off the raw pour, which knows no friction: the mass stands for it.
            record = record_of(empty_pile(), np.zeros(1), np.zeros(1), poured_mass=friction)
            yield job, dataclasses.replace(record, scene=job.scene, outcome=Outcome.MEASURED)

    def features(asked, record, sight):
        return np.full(len(feature_set(asked).names), record.poured_mass)

    monkeypatch.setattr(module, "features_of_record", features)
    with closing(Store(tmp_path / "runs.sqlite")) as store:
        yield ModelPours([condition], [FRICTION], store, run), jobs


def test_two_models_are_confirmed_by_pours_of_their_own(poured):
    pours, jobs = poured
    width = len(read_laboratory(TREFOILS).readings) - 1
    for asked in ((0.5,), (0.6, 0.5)):
        found = confirm([CalibratedModel((friction,)) for friction in asked], pours, 3, [width])
        assert [one.blocks[0].tolist() for one in found] == [[[friction] * width] * 3 for friction in asked]
    # The last asks for what the first has poured.
    assert len(jobs) == 6


def at(friction, number=0):
    return Point("search", number, (friction,))


def test_searches_are_answered_side_by_side_and_what_follows_a_pour_goes_first(poured):
    """A search of three steps beside two of one: each gets its own pours, and the long one does not come last.

    But for its last step, which asks for two: nothing waits for these.
    """
    pours, jobs = poured

    def climbing(friction):
        for _ in range(2):
            (row,) = yield [at(friction)]
            friction = row[0].summaries[0] + 0.01
        rows = yield [at(friction), at(friction, 1)]
        return [row[0].summaries[0] for row in rows]

    def single(friction):
        ((pour,),) = yield [at(friction)]
        return pour.summaries[0]

    found = pours.answered("search", [climbing(0.5), single(0.6), single(0.7)])
    assert found == [pytest.approx([0.52, 0.52]), 0.6, 0.7]
    run = [float(value(job.scene, FRICTION)) for job in jobs]
    assert run == pytest.approx([0.5, 0.51, 0.6, 0.7, 0.52, 0.52])
    # All of it is known now: the searches end without a pour.
    assert pours.answered("search", [climbing(0.5), single(0.7)]) == [pytest.approx([0.52, 0.52]), 0.7]
    assert (len(jobs), pours.run_now) == (6, 6)


def test_a_point_that_is_asked_for_twice_is_poured_once(poured):
    pours, jobs = poured
    first, second = pours.run("twice", [at(0.5), at(0.5)])
    assert first == second
    assert len(jobs) == 1


def test_an_effect_under_which_no_pour_ends_is_infinitely_far():
    declared = Declared((), (), (DeclaredCondition("one", ("a", "b")),))
    centre = [(PointPour(tuple(row), "measured"),) for row in np.random.default_rng(0).normal(size=(8, 2))]
    for moved in (PointPour((math.nan, 1.0), "measured"), PointPour((1.0, 1.0), "jammed")):
        assert whitened_shift(declared, centre, [(moved,)]) == math.inf


def test_a_shift_by_hand():
    """Base (±1, ±1) in step, twice: s² = 8/7 each, covariance 8/7, halved by the shrinking; moved by (2, 1), two pours.

    Six pours: 6 · (2, 1) C⁻¹ (2, 1)ᵀ with C = 8/7 [1, ½; ½, 1], less 6 (1/2 + 1/8) for each of two features.
    """
    declared = Declared((), (), (DeclaredCondition("one", ("a", "b")),))
    base = [(PointPour((sign, sign), "measured"),) for sign in (1.0, -1.0) * 4]
    moved = [(PointPour((2.0 + off, 1.0 - off), "measured"),) for off in (0.3, -0.3)]
    square = 6.0 * 7.0 / 8.0 * (4.0 + 1.0 - 2.0) / 0.75 - 6.0 * (1.0 / 2.0 + 1.0 / 8.0) * 2
    assert whitened_shift(declared, base, moved) == pytest.approx(math.sqrt(square))


def test_a_new_summary_is_read_off_all_stored_pours_without_pouring(poured):
    """A data set of the same set-up that offers more: the pours of the first serve it as they are."""
    pours, jobs = poured
    points = [at(0.5), at(0.6), at(0.7, 1)]
    pours.run("first", points)
    (condition,) = pours._conditions
    # Fewer numbers were measured first, then more: in the order of a laboratory that looks again.
    for observations in (condition.observations[:3], condition.observations[:5]):
        smaller = dataclasses.replace(condition, observations=observations)
        other = ModelPours([smaller], [FRICTION], pours._store, pours._pours)
        found = other.run("second", points)
        width = len(summary_names(smaller))
        assert [row[0].summaries for row in found] == [(f,) * width for f in (0.5, 0.6, 0.7)]
        assert other.run_now == 0
    taller = dataclasses.replace(condition.observations[0], observable="centre_height_m")
    more = dataclasses.replace(condition, observations=(*condition.observations, taller))
    assert "centre_height_m" in summary_names(more)
    other = ModelPours([more], [FRICTION], pours._store, pours._pours)
    assert other.run("third", points)[0][0].summaries == (0.5,) * len(summary_names(more))
    assert (other.run_now, len(jobs)) == (0, 3)


def test_a_turned_rig_sees_a_tilt_the_other_way_and_a_displaced_funnel_as_before(poured):
    pours, _ = poured
    condition = read_laboratory(TREFOILS).declared.fit[0]
    turned = ModelPours([dataclasses.replace(condition, turned=True)], [FRICTION], None, None)
    effects = (("plate_tilt", (1.0, -2.0)), ("funnel_offset", (0.003, 0.001)))
    point = Point("search", 0, (0.5,), effects)
    paths = [f"effect.{name}" for name in ("plate_tilt.tilt_x", "plate_tilt.tilt_y", "funnel_offset.dx")]
    assert [value(pours.scene(point, 0), path) for path in paths] == [1.0, -2.0, 0.003]
    assert [value(turned.scene(point, 0), path) for path in paths] == [-1.0, 2.0, 0.003]


def test_a_possible_addition_has_the_seeds_of_its_place_in_the_data():
    """Wherever it stands among the candidates, its pours are found again once it is measured."""
    first, second = read_laboratory(TREFOILS).declared.fit
    point = Point("base", 3, (0.5,))
    candidates = ModelPours([first, second], [FRICTION], None, None, place=2)
    data = ModelPours([first, first, second], [FRICTION], None, None)
    assert candidates.seed(point, 0) == candidates.seed(point, 1) == data.seed(point, 2)
