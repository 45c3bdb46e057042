"""The whole loop with pours by a formula: a planted effect is named, nothing is found in nothing, pours confirm it.

y = Σ_j θ_j u_j + Σ_k a_k s_k + e,  e ~ N(0, 1) per pour, with unit vectors u_j, s_k of each condition's own; full
amplitudes shift six pours by 22 standard errors in each condition.
"""

import hashlib
import math
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from doe.declared.budget import LEAST, Budget, scaled_budget
from doe.declared.given import with_given
from doe.declared.model import declare
from doe.declared.points import AS_IT_IS
from doe.declared.pours import PointPour
from doe.diagnose import diagnosis, training_pours
from doe.diagnose.compared_features import MeasuredFeatures
from doe.diagnose.posterior import BestAmplitude
from doe.diagnose.result import CalibratedModel, Level
from doe.diagnose.training_amplitudes import REPLICATES, whitened_shift
from doe.diagnose.training_pours import TrainingPours
from doe.errors import StatisticsError
from doe.holdout import CONTRADICTED
from doe.measurement import load_measurement, summary_names
from doe.measurement.features import SCAN, feature_set
from solver import EFFECTS
from solver.assets import measurement_folder

NAMES = ("rolling_resistance", "air_drag", "density_error", "plate_tilt", "funnel_offset")
BUDGET = Budget(base=24, screening=4, more=8)
pytestmark = pytest.mark.usefixtures("plates")


def direction(name, width):
    generator = np.random.default_rng(int.from_bytes(hashlib.sha256(name.encode()).digest()[:8]))
    vector = generator.standard_normal(width)
    return vector / np.linalg.norm(vector)


def acting(point):
    """Effects of a point, those that its view stands for among them."""
    effects = dict(point.effects)
    if any(point.view.shift):
        effects["funnel_offset"] = point.view.shift
    if "plate_tilt" in effects:
        x, y = effects["plate_tilt"]
        for _ in range(point.view.turns):
            x, y = -y, x
        effects["plate_tilt"] = (x, y)
    return tuple(effects.items())


def expected(theta, effects, condition, width):
    """Mean summaries: parameters as deviations from the declared means."""
    mean = np.zeros(width)
    for k, value in enumerate(theta):
        mean += 0.3 * value * direction(f"{condition} θ{k}", width)
    for name, amplitude in effects:
        for k, value in enumerate(amplitude):
            mean += 9.0 * value / EFFECTS[name].strongest * direction(f"{condition} {name} {k}", width)
    return mean


def noise(text, width):
    return np.random.default_rng(int.from_bytes(hashlib.sha256(text.encode()).digest()[:8])).normal(size=width)


class FormulaPours:
    """Stands for ``ModelPours``: summaries by a formula, with unit noise per pour."""

    formula = staticmethod(expected)
    declared = None

    def __init__(self, conditions, paths, store, pours, on_pour=None, root=0, place=None):
        self.conditions, self.paths, self.run_now = conditions, paths, 0

    def answered(self, what, searches, where=None, widest=()):
        return [self.result_of(what, search) for search in searches]

    def result_of(self, what, search):
        pours = None
        while True:
            try:
                pours = self.run(what, search.send(pours))
            except StopIteration as end:
                return end.value

    def run(self, what, points, where=None):
        asked = [self.conditions[c] for c in (range(len(self.conditions)) if where is None else where)]
        self.run_now += len(points) * len(asked)
        return [[self.pour(point, condition) for condition in asked] for point in points]

    def records(self, points, condition):
        """No pile stands behind a formula."""
        return []

    def pour(self, point, condition):
        width = len(summary_names(condition))
        numbers = " ".join(f"{x:.8g}" for x in (*point.theta, *(a for _, pair in point.effects for a in pair)))
        text = f"{point.sequence} {point.number} {numbers} {condition.name}"
        theta = self.declared.theta(point.theta)
        mean = self.formula(theta, acting(point), condition.name, width)
        # No surface can be read off a formula.
        surface = (math.nan,) * (feature_set(condition).offered(SCAN) - width)
        return PointPour(tuple(mean + noise(text, width)), "measured", (), surface)


def measure(monkeypatch, effects, seed, formula=expected, held_out=None, instrument=0.0):
    """Let the laboratory read the formula with ``effects``, in the fitted and in the held-out conditions.

    ``instrument``: the error that it states of each number, without making one.
    """
    monkeypatch.setattr(FormulaPours, "formula", staticmethod(formula))
    rng = np.random.default_rng(seed)

    def replicates(condition):
        width = len(summary_names(condition))
        there = effects if held_out is None or condition.role == "fit" else held_out
        return formula(np.zeros(3), there, condition.name, width) + rng.normal(size=(REPLICATES, width))

    def measured(condition, offer=None):
        names = summary_names(condition)
        return MeasuredFeatures(
            condition.name, "scalars", names, replicates(condition), np.full(len(names), instrument), 1, len(names)
        )

    monkeypatch.setattr(diagnosis, "measured", measured)
    monkeypatch.setattr("doe.measurement.summaries.complete_rows", replicates)


def run(measurement, monkeypatch, effects, seed=1, formula=expected, held_out=None, budget=BUDGET):
    measure(monkeypatch, effects, seed, formula, held_out)
    said = []
    found = diagnosis.run_diagnosis(measurement, None, None, NAMES, budget, said.append)
    return found, said


def test_a_planted_effect_is_named_with_its_amplitude(measurement, monkeypatch):
    planted = 0.7 * EFFECTS["rolling_resistance"].strongest
    found, said = run(measurement, monkeypatch, (("rolling_resistance", (planted,)),))
    assert found.verdict.kind == "effect:rolling_resistance", said
    row = found.verdict.effects[0]
    assert row.amplitudes[0].low <= planted <= row.amplitudes[0].high
    assert row.pours >= BUDGET.screening + BUDGET.more
    assert found.after.model.effects[0][0] == "rolling_resistance"
    # Fresh pours of the named model are nearer to the fitted data than those of the base model.
    overall = next(one for one in found.fit_error if one.observable == "overall")
    beyond_noise = [error**2 - overall.noise_floor**2 for error in (overall.before, overall.after)]
    assert beyond_noise[1] < 0.25 * beyond_noise[0]
    assert found.held_out.p >= CONTRADICTED


@pytest.mark.parametrize(("name", "amplitude"), [("plate_tilt", (1.5, -1.2)), ("funnel_offset", (-0.006, 0.006))])
def test_an_effect_askew_of_both_axes_is_named_with_both_amplitudes(measurement, monkeypatch, name, amplitude):
    found, said = run(measurement, monkeypatch, ((name, amplitude),))
    assert found.verdict.kind == f"effect:{name}", said
    for one, planted in zip(found.verdict.effects[0].amplitudes, amplitude, strict=True):
        assert one.low <= planted <= one.high


def strong(theta, effects, condition, width):
    """As :func:`expected`, with effects three times as strong."""
    return expected(theta, [(name, tuple(3.0 * a for a in amplitude)) for name, amplitude in effects], condition, width)


def test_an_effect_far_beyond_the_first_level_is_followed(measurement, monkeypatch):
    """It is poured where it shifts by 12 standard errors at first; at its strongest it shifts by 66."""
    planted = 0.95 * EFFECTS["rolling_resistance"].strongest
    found, said = run(measurement, monkeypatch, (("rolling_resistance", (planted,)),), formula=strong)
    assert found.verdict.kind == "effect:rolling_resistance", said
    (amplitude,) = found.verdict.effects[0].amplitudes
    assert amplitude.value > 0.8 * planted
    level = next(one for one in found.levels if one.direction.effect == "rolling_resistance")
    assert level.share < 0.4


def test_two_effects_at_once_ask_for_another_set_up_before_they_are_named(measurement, monkeypatch):
    both = "rolling_resistance+density_error"
    planted = (("rolling_resistance", (0.6 * EFFECTS["rolling_resistance"].strongest,)), ("density_error", (0.2,)))
    found, said = run(measurement, monkeypatch, planted)
    assert found.verdict.kind.startswith(f"ambiguous:{both},"), said
    assert {name for name, _ in found.after.model.effects} == {"rolling_resistance", "density_error"}
    first = found.suggestions[0]
    assert first.pours > 0
    assert first.rivals[0] == both
    # Both answers count alike, though one is all but certain.
    assert first.experiment.chance > 0.9
    other_set_up = replace(measurement.fit[0], name="another set-up")
    poured, by_bodies = (replace(measurement, conditions=conditions) for conditions in ((other_set_up,), ()))
    for follow_ups, kind in [([by_bodies], f"ambiguous:{both},"), ([poured, by_bodies], f"effects:{both}")]:
        measure(monkeypatch, planted, 1)
        again = diagnosis.run_diagnosis(measurement, None, None, NAMES, BUDGET, said.append, follow_ups=follow_ups)
        assert again.verdict.kind.startswith(kind), said
        # What is left open asks for another set-up again.
        assert any(one.pours for one in again.suggestions) == again.verdict.kind.startswith("ambiguous")


def not_adding(theta, effects, condition, width):
    """As :func:`expected`, but a wrong density does something else beside rolling resistance.

    A parameter more than the three that are declared is the amplitude of a rolling resistance that is given.
    """
    effects, given = dict(effects), FormulaPours.declared.parameters[3:]
    if given and len(theta) > 3:
        effects["rolling_resistance"] = (given[0].natural(theta[3]),)
    mean = expected(theta[:3], effects.items(), condition, width)
    if "rolling_resistance" in effects and "density_error" in effects:
        size = 9.0 * effects["density_error"][0] / EFFECTS["density_error"].strongest
        mean += size * (direction(f"{condition} beside", width) - direction(f"{condition} density_error 0", width))
    return mean


def test_what_is_missing_beside_a_given_effect_is_named_where_the_two_do_not_add(measurement, monkeypatch):
    rolling = 0.6 * EFFECTS["rolling_resistance"].strongest
    planted = (("rolling_resistance", (rolling,)), ("density_error", (0.25,)))
    found, said = run(measurement, monkeypatch, planted, formula=not_adding)
    assert found.verdict.kind == "unexplained", said
    given = with_given(measurement, {"rolling_resistance": (0.9 * rolling,)})
    monkeypatch.setattr(FormulaPours, "declared", declare(given, NAMES))
    found, said = run(given, monkeypatch, planted, formula=not_adding)
    assert found.verdict.kind == "effect:density_error", said
    known = found.verdict.parameters[3]
    assert known.name == "effect.rolling_resistance.rolling_friction"
    assert known.after == pytest.approx(rolling, abs=3.0 * known.after_sd)
    assert known.after_sd < 0.2 * rolling


def test_beside_all_that_is_missing_nothing_else_is(measurement, monkeypatch):
    rolling = 0.6 * EFFECTS["rolling_resistance"].strongest
    given = with_given(measurement, {"rolling_resistance": (1.1 * rolling,)})
    monkeypatch.setattr(FormulaPours, "declared", declare(given, NAMES))
    found, said = run(given, monkeypatch, (("rolling_resistance", (rolling,)),), formula=not_adding)
    assert found.verdict.kind == "no_missing_effect", said


FITTED = {condition.name for condition in load_measurement(measurement_folder("trefoil_1")).fit}


def twins(theta, effects, condition, width, hidden="air_drag"):
    """As :func:`expected`, but the fitted conditions cannot tell the effect ``hidden`` from rolling resistance."""
    mean = expected(theta, (), condition, width)
    for name, amplitude in effects:
        as_read = "rolling_resistance" if condition in FITTED and name == hidden else name
        for k, value in enumerate(amplitude):
            mean += 9.0 * value / EFFECTS[name].strongest * direction(f"{condition} {as_read} {k}", width)
    return mean


@pytest.mark.parametrize(("hidden", "bodies"), [("air_drag", ()), ("density_error", (("trefoil", "mass"),))])
def test_what_the_data_cannot_tell_apart_is_ambiguous_and_gets_a_next_experiment(
    measurement, monkeypatch, hidden, bodies
):
    planted = ((hidden, (0.5 * EFFECTS[hidden].strongest,)),)
    measurement = replace(measurement, conditions=measurement.fit)
    found, said = run(measurement, monkeypatch, planted, formula=partial(twins, hidden=hidden))
    assert found.verdict.kind.startswith("ambiguous:"), said
    assert {hidden, "rolling_resistance"} <= set(found.verdict.names)
    assert found.suggestions[0].levers
    assert {one.bodies for one in found.suggestions} == {bodies}
    # Where bodies tell all that can be told, no other set-up is poured.
    names = {one.experiment.name for one in found.suggestions}
    assert names == {"as it is, poured again"} if bodies else len(names) > 5


def test_no_more_is_poured_where_the_noise_of_the_data_hides_what_is_between_two_answers(measurement, monkeypatch):
    planted = (("rolling_resistance", (0.6 * EFFECTS["rolling_resistance"].strongest,)),)
    looks, fitted = {}, replace(measurement, conditions=measurement.fit)
    for instrument in (0.05, 2.0):
        measure(monkeypatch, planted, 1, twins, instrument=instrument)
        said = []
        found = diagnosis.run_diagnosis(fitted, None, None, NAMES, BUDGET, said.append, plan_next=False)
        assert found.verdict.kind.startswith("ambiguous:"), said
        looks[instrument] = sum(line.startswith("after a closer look") for line in said)
        assert any(line.startswith("no pours can tell ") for line in said) == (instrument == 2.0), said
    assert looks == {0.05: BUDGET.looks, 2.0: 1}


def test_what_could_be_measured_next_is_left_out_where_it_is_not_wanted(measurement, monkeypatch):
    measure(monkeypatch, (("air_drag", (1.0,)),), 1, twins)
    only_fitted = replace(measurement, conditions=measurement.fit)
    found = diagnosis.run_diagnosis(only_fitted, None, None, NAMES, BUDGET, print, plan_next=False)
    assert (found.verdict.kind[:10], found.suggestions) == ("ambiguous:", ())


def test_held_out_data_take_a_name_back(measurement, monkeypatch):
    planted = (("rolling_resistance", (0.5 * EFFECTS["rolling_resistance"].strongest,)),)
    found, said = run(measurement, monkeypatch, planted, held_out=(("density_error", (0.3,)),))
    assert found.verdict.kind == "unexplained", said
    assert found.verdict.taken_back == "effect:rolling_resistance"
    assert "contradict" in found.verdict.statement


def test_held_out_data_take_back_that_nothing_is_missing(measurement, monkeypatch):
    found, said = run(measurement, monkeypatch, (), held_out=(("density_error", (0.3,)),))
    assert found.verdict.kind == "unexplained", said
    assert found.verdict.taken_back == "no_missing_effect"


def outside(theta, effects, condition, width):
    """As :func:`expected`, with a shift that no effect makes where "outside" acts."""
    known = [(name, amplitude) for name, amplitude in effects if name != "outside"]
    mean = expected(theta, known, condition, width)
    return mean + 6.0 * direction(f"{condition} outside", width) * (len(known) < len(effects))


def test_what_no_effect_makes_is_unexplained(measurement, monkeypatch):
    found, said = run(measurement, monkeypatch, (("outside", ()),), formula=outside)
    assert found.verdict.kind == "unexplained", said
    assert found.verdict.names == ()
    assert found.suggestions == ()


def test_nothing_planted_is_nothing_found(measurement, monkeypatch):
    found, said = run(measurement, monkeypatch, ())
    assert found.verdict.kind == "no_missing_effect", said
    assert found.after is found.before
    assert [one.bodies for one in found.suggestions] == [(("trefoil", "mass"),)]
    assert found.verdict.final == "base"


def test_probabilities_add_up(measurement, monkeypatch):
    found, _ = run(measurement, monkeypatch, ())
    verdict = found.verdict
    assert verdict.nothing + verdict.outside + sum(row.probability for row in verdict.effects) == pytest.approx(1.0)


def test_the_same_model_asks_for_the_same_pours(measurement, monkeypatch):
    """What is simulated before the first look at the data must not depend on measured values."""
    asked = []

    class Recording(FormulaPours):
        def run(self, what, points, where=None):
            if what in ("base model", "amplitudes", "screening"):
                asked[-1].extend((point.sequence, point.number, point.theta, point.effects) for point in points)
            return super().run(what, points, where)

    monkeypatch.setattr(diagnosis, "ModelPours", Recording)
    for effects in ((), (("air_drag", (2.0,)),)):
        asked.append([])
        run(measurement, monkeypatch, effects)
    assert asked[0] == asked[1]


def test_a_closer_look_pours_the_base_model_too(measurement, monkeypatch):
    """All models begin with it: where it is known least, data without an effect fit it least."""
    asked = set()

    class Recording(FormulaPours):
        def run(self, what, points, where=None):
            if what == "closer look":
                asked.update(point for point in points if point.sequence == "base" and point.view == AS_IT_IS)
            return super().run(what, points, where)

    monkeypatch.setattr(diagnosis, "ModelPours", Recording)
    run(measurement, monkeypatch, (("air_drag", (1.0,)),), formula=twins, held_out=())
    assert {point.number for point in asked} >= set(range(BUDGET.base, BUDGET.base + BUDGET.more))


def test_closer_looks_pour_both_sides_of_a_best_fit(measurement):
    declared = declare(measurement, NAMES)
    training = TrainingPours(declared, measurement.fit, FormulaPours(measurement.fit, [], None, None), BUDGET, str)
    way = next(k for k, one in enumerate(training.ways) if one.name == "rolling_resistance")
    base = SimpleNamespace(log_evidence=0.0, theta=np.array([0.3, -1.6, 1.4]))
    # At 0.8 of its level: nearer to all of it than to half.
    found = SimpleNamespace(
        effects={"rolling_resistance": 0.5}, levels=[BestAmplitude(way, 0.8, 3.0)], fits={"base": base}, nothing=0.5
    )

    def poured():
        lessons = training.lessons()
        amplitudes = lessons.amplitude[lessons.way == way]
        return int((amplitudes == 1.0).sum()), int((amplitudes == 0.5).sum())

    screened = poured()
    assert set(np.abs(training.lessons().theta).ravel().round(9)) == {1.0}
    assert training.look(found) == ("rolling_resistance",)
    assert poured() == (screened[0] + BUDGET.more, screened[1])
    # The parameter that the base model needs 1.6 deviations down is poured farther off, to that side.
    theta = training.lessons().theta
    far = np.abs(theta) > 1.001
    assert far.sum() == far[:, 1].sum() == BUDGET.more
    assert set(theta[far]) == {theta[far].min()}
    assert training.lessons().way[far.any(axis=1)].max() == -1
    training.look(found)
    assert poured() == (screened[0] + BUDGET.more, screened[1] + BUDGET.more)


def test_symmetries_cost_no_pours(measurement, monkeypatch):
    """A displaced funnel is poured by nobody, a tilted plate along one axis only."""
    asked = set()

    class Recording(FormulaPours):
        def run(self, what, points, where=None):
            asked.update(point for point in points)
            return super().run(what, points, where)

    monkeypatch.setattr(diagnosis, "ModelPours", Recording)
    run(measurement, monkeypatch, ())
    effects = [point.effects for point in asked]
    assert not any(name == "funnel_offset" for some in effects for name, _ in some)
    tilts = {amplitude for some in effects for name, amplitude in some if name == "plate_tilt"}
    assert tilts
    assert all(x > 0.0 and y == 0.0 for x, y in tilts)


def test_a_model_that_never_ends_well_is_refused(measurement, monkeypatch):
    class Jammed(FormulaPours):
        def pour(self, point, condition):
            return PointPour((math.nan,) * len(summary_names(condition)), "jammed")

    monkeypatch.setattr(diagnosis, "ModelPours", Jammed)
    measure(monkeypatch, (), 1)
    with pytest.raises(StatisticsError, match=r"0 of 24 pours end in a valid pile .*jammed"):
        diagnosis.run_diagnosis(measurement, None, None, NAMES, BUDGET, lambda line: None)


def test_an_effect_whose_pours_mostly_break_off_is_weighed_by_the_others(measurement, monkeypatch):
    class Half(FormulaPours):
        def pour(self, point, condition):
            found = super().pour(point, condition)
            broken = point.effects and point.effects[0][0] == "air_drag" and point.number % 2
            return replace(found, outcome="jammed") if broken else found

    monkeypatch.setattr(diagnosis, "ModelPours", Half)
    found, said = run(measurement, monkeypatch, (("rolling_resistance", (0.15,)),))
    assert found.verdict.kind == "effect:rolling_resistance", said


def test_a_budget_keeps_its_shares_and_its_least(measurement):
    planned = scaled_budget(400, measurement, NAMES)
    assert planned.planned(12, len(measurement.fit)) <= 400
    with pytest.raises(StatisticsError, match="allowed: at least"):
        scaled_budget(5, measurement, NAMES)
    least = scaled_budget(LEAST.planned(12, len(measurement.fit)), measurement, NAMES)
    assert (least.base, least.screening) == (LEAST.base, LEAST.screening)


def test_whitened_shift_is_the_distance_in_standard_errors(measurement):
    declared = declare(measurement, NAMES)
    rng, width = np.random.default_rng(2), len(declared.conditions[0].summaries)
    step = 3.0 * direction("step", width)

    def pours(number, mean):
        rows = rng.normal(size=(number, width))
        return [[PointPour(tuple(mean + row), "measured")] * len(declared.conditions) for row in rows]

    found = whitened_shift(declared, pours(4000, 0.0), pours(4000, step))
    # Sampling error of 4000 pours: 2 %; the covariance is the unit matrix, shrunk or not.
    assert found == pytest.approx(3.0 * np.sqrt(REPLICATES * len(declared.conditions)), rel=0.05)
    assert whitened_shift(declared, pours(4000, 0.0), pours(4000, 0.0)) < 1.0


def test_the_teacher_says_what_every_effect_was_poured_at(measurement):
    said = []
    declared = declare(measurement, NAMES)
    training = TrainingPours(
        declared, measurement.fit, FormulaPours(measurement.fit, [], None, None), BUDGET, said.append
    )
    assert len(training.ways) == 1 + 1 + 2 + 4 + 4
    assert any(line.startswith("rolling_resistance: up to") for line in said)
    lessons = training.lessons()
    assert lessons.theta.shape[1] == 3
    assert set(lessons.way.tolist()) == set(range(-1, len(training.ways)))


def too_small(declared, direction, base, points, trials):
    """A search that noise ended at a twentieth of the range."""
    yield points(0.05, trials.pours)
    return Level(direction, 0.05, 12.0)


def test_what_all_pours_show_to_be_too_little_is_poured_farther_out(measurement, monkeypatch):
    monkeypatch.setattr(training_pours, "level_of", too_small)
    declared = declare(measurement, NAMES)
    training = TrainingPours(declared, measurement.fit, FormulaPours(measurement.fit, [], None, None), BUDGET, str)
    for level in training.levels:
        # Full amplitudes shift by 22 standard errors in each condition.
        full = 22.0 * math.sqrt(len(measurement.fit))
        assert level.share > 0.2
        # By four pours a shift is known to √(6/4 + 6/24) = 1.3 along itself.
        assert level.shift == pytest.approx(full * level.share, abs=4.0)
    # What had been poured before teaches at its own multiple of the new level.
    lessons = training.lessons()
    for number, (way, level) in enumerate(zip(training.ways, training.levels, strict=True)):
        assert way.unit == level.direction.at(level.share)
        multiples = set(lessons.amplitude[lessons.way == number])
        assert 1.0 in multiples
        if way.name == "rolling_resistance":
            assert min(multiples) == pytest.approx(0.05 / level.share)


def test_pours_that_break_off_farther_out_keep_a_level_below(measurement, monkeypatch):
    monkeypatch.setattr(training_pours, "level_of", too_small)
    whole = FormulaPours.pour

    def broken(self, point, condition):
        pour = whole(self, point, condition)
        far = any(
            name == "rolling_resistance" and a > 0.12 * EFFECTS[name].strongest for name, (a, *_) in point.effects
        )
        return replace(pour, outcome="jammed") if far else pour

    monkeypatch.setattr(FormulaPours, "pour", broken)
    declared = declare(measurement, NAMES)
    training = TrainingPours(declared, measurement.fit, FormulaPours(measurement.fit, [], None, None), BUDGET, str)
    level = next(one for one in training.levels if one.direction.effect == "rolling_resistance")
    assert 0.05 <= level.share <= 0.12
    assert max(one.share for one in training.levels) > 0.1


def test_ranges_fit_the_set_up(measurement):
    declared = declare(measurement, tuple(EFFECTS))
    for effect in declared.effects:
        assert all(low <= 0.0 <= high for low, high in zip(effect.low, effect.high, strict=True))
        assert max(effect.high) <= EFFECTS[effect.name].strongest


def test_the_box_is_three_deviations_about_a_measured_mean(measurement):
    friction = declare(measurement, NAMES).parameters[2]
    assert (friction.low, friction.high) == (pytest.approx(0.73 - 0.12), pytest.approx(0.73 + 0.12))


def test_data_without_a_readable_replicate_have_no_error_row(measurement):
    widths = [len(summary_names(condition)) for condition in measurement.conditions]
    model = CalibratedModel((0.5,) * 3)
    confirmed = diagnosis.Confirmed(model, tuple(np.zeros((0, width)) for width in widths), 12)
    conclusion = diagnosis.Conclusion(confirmed, confirmed, None)
    assert diagnosis.errors_of(measurement.conditions, "holdout", conclusion) == ()


def test_without_held_out_conditions_nothing_is_confirmed_or_taken_back(measurement, monkeypatch):
    measure(monkeypatch, (), seed=1)
    declared = declare(measurement, NAMES[:1])
    training = TrainingPours(declared, measurement.fit, FormulaPours(measurement.fit, (), None, None), BUDGET, print)
    compared = diagnosis.pursued(training, measurement, BUDGET, print, ())
    verdict = diagnosis.verdict_of(compared, declared, training.pours, ())
    conclusion, after = diagnosis.concluded(verdict, compared, declared, (), FormulaPours((), (), None, None), print)
    assert after == verdict
    assert conclusion.held_out is None
    assert diagnosis.errors_of((), "holdout", conclusion) == ()


def test_a_summary_that_the_base_model_does_not_give_leaves_the_shift_as_it_is(measurement):
    declared = declare(measurement, NAMES)
    rng, width = np.random.default_rng(2), len(declared.conditions[0].summaries)

    def pours(rows, last):
        numbers = [(*row[:-1], x) for row, x in zip(rows, last, strict=True)]
        return [[PointPour(one, "measured")] * len(declared.conditions) for one in numbers]

    base, there = rng.normal(size=(24, width)), rng.normal(size=(6, width)) + 2.0
    # That number is the same in all pours, and so says nothing.
    wanted = whitened_shift(declared, pours(base, [0.0] * 24), pours(there, [0.0] * 6))
    for gap, now in ((math.nan, math.nan), (math.nan, 1.0)):
        assert whitened_shift(declared, pours(base, [gap] * 24), pours(there, [now] * 6)) == pytest.approx(wanted)
    one = [0.0, *[math.nan] * 23]
    assert whitened_shift(declared, pours(base, one), pours(there, [math.nan] * 6)) == pytest.approx(wanted)
