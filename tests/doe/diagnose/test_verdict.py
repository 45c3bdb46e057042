"""The rules that turn probabilities into an answer."""

from dataclasses import replace

import numpy as np
import pytest

from doe.declared.bodies import BodyEvidence
from doe.declared.model import CalibratedParameter, Declared, DeclaredCondition
from doe.diagnose.compared_features import MeasuredFeatures, weighed
from doe.diagnose.emulator import Lessons, Way
from doe.diagnose.posterior import FITS, Fit, Posterior
from doe.diagnose.result import NO_EFFECT, UNEXPLAINED
from doe.diagnose.verdict import DOUBTED, MOST_PAIRS, NOTHING_AT_ONCE, NOTHING_FROM, answer, read_in, verdict_of


def posterior(nothing, outside, effects, badly=(), base=DOUBTED / 2.0, off=3.0):
    """Probabilities, with models that fit but for those of ``badly``.

    ``base``: how probable data as far off it are; ``off``: its one parameter, in standard deviations.
    """
    none = np.zeros(0)
    likely = {"base": base} | dict.fromkeys(effects, 0.5) | dict.fromkeys(badly, 0.1 * FITS)
    theta = np.array([off])
    fits = {label: Fit(label, (), theta, *[none] * 9, 0.0, likely[label]) for label in ("base", *effects)}
    return Posterior(nothing, outside, effects, fits, (), 0.0)


@pytest.mark.parametrize(
    ("found", "kind"),
    [
        (posterior(0.02, 0.01, {"a": 0.95, "b": 0.02}), "effect:a"),
        (posterior(0.02, 0.01, {"a+b": 0.95, "b": 0.02}), "effects:a+b"),
        (posterior(0.6, 0.1, {"a": 0.3}), NO_EFFECT),
        (posterior(0.05, 0.5, {"a": 0.45}), UNEXPLAINED),
        (posterior(0.01, 0.01, {"a": 0.6, "b": 0.38}), "ambiguous:a,b"),
    ],
)
def test_the_rules(found, kind):
    assert answer(found, followed_up=True)[0] == kind


ALONE = {"a": 0.5, "a+b": 0.25, "a+c": 0.2}


@pytest.mark.parametrize(
    ("found", "kind", "at_once"),
    [
        (posterior(0.02, 0.01, ALONE), "effect:a", "ambiguous:a,a+b,a+c"),
        # The pair is the more probable: a alone is no answer.
        (posterior(0.02, 0.01, {"a": 0.1, "a+b": 0.6, "a+c": 0.27}), "ambiguous:a+b,a+c,a", "ambiguous:a+b,a+c,a"),
        (posterior(0.02, 0.01, {"a": 0.5, "a+b": 0.2, "b+c": 0.27}), "ambiguous:a,b+c,a+b", "ambiguous:a,b+c,a+b"),
        # Alone it does not fit, and the pairs do.
        (posterior(0.02, 0.01, ALONE, "a"), "ambiguous:a,a+b,a+c", "ambiguous:a,a+b,a+c"),
        (
            posterior(0.02, 0.01, ALONE, base=1.01 * DOUBTED),
            f"ambiguous:a,a+b,a+c,{NO_EFFECT}",
            "ambiguous:a,a+b,a+c",
        ),
    ],
)
def test_after_a_follow_up_what_is_in_all_answers_is_named(found, kind, at_once):
    assert answer(found, followed_up=True)[0] == kind
    assert answer(found, followed_up=False)[0] == at_once


@pytest.mark.parametrize("effects", [{"a+b": 0.97, "a+c": 0.01, "b": 0.005}, {"a+b": 0.97, "b": 0.005, "a+c": 0.001}])
def test_two_effects_are_named_where_pours_of_a_follow_up_have_shown_the_same(effects):
    """At once their sum may come nearest to two others (root 6, set 6): the next most probable answer is left too."""
    found, (pair, next_one, _) = posterior(0.005, 0.005, effects), effects
    kind, names, text = answer(found, followed_up=False)
    assert (kind, names) == (f"ambiguous:{pair},{next_one}", (pair, next_one))
    assert text == "a with b would explain the data (97 %); pours of a follow-up have to show the same."
    assert answer(found, followed_up=True, by_bodies=True) == (kind, names, text)
    assert answer(found, followed_up=True)[:2] == ("effects:a+b", ("a+b",))
    badly = posterior(0.005, 0.005, effects, ["a+b"])
    assert answer(badly, followed_up=False)[0] == answer(badly, followed_up=True)[0] == UNEXPLAINED


def test_a_name_says_whether_it_is_alone():
    assert answer(posterior(0.02, 0.01, ALONE), followed_up=True)[2] == (
        "a explains what the declared model cannot, with probability 95 %, alone (50 %) or with another effect."
    )
    assert "alone" not in answer(posterior(0.02, 0.01, {"a": 0.92, "a+b": 0.05}), followed_up=True)[2]


@pytest.mark.parametrize(
    ("found", "kind"),
    [
        (posterior(0.02, 0.01, {"a": 0.95, "b": 0.02}, "a"), UNEXPLAINED),
        (posterior(0.6, 0.1, {"a": 0.3}, ("base",)), UNEXPLAINED),
        # Nothing that is left fits: there is nothing to choose between.
        (posterior(0.01, 0.01, {"a": 0.6, "b": 0.38}, "ab"), UNEXPLAINED),
        (posterior(0.01, 0.3, {"a": 0.4, "b": 0.29}, "ab"), UNEXPLAINED),
        # One of those that are left fits: the follow-up may tell.
        (posterior(0.01, 0.01, {"a": 0.6, "b": 0.38}, "a"), "ambiguous:a,b"),
        (posterior(0.4, 0.01, {"a": 0.59}, "a"), f"ambiguous:a,{NO_EFFECT}"),
    ],
)
def test_a_model_that_does_not_fit_is_no_answer(found, kind):
    assert answer(found, followed_up=True)[0] == kind


@pytest.mark.parametrize(("nothing", "kind"), [(0.65, f"ambiguous:{NO_EFFECT},a,{UNEXPLAINED}"), (0.7, NO_EFFECT)])
def test_what_is_half_sure_that_nothing_is_missing_asks_for_more(nothing, kind):
    found = posterior(nothing, 0.1, {"a": 0.9 - nothing})
    assert NOTHING_FROM < 0.65 < NOTHING_AT_ONCE <= 0.7
    assert answer(found, followed_up=False)[0] == kind
    assert answer(found, followed_up=True)[0] == NO_EFFECT


@pytest.mark.parametrize("effects", [{"a": 0.95, "b": 0.02}, {"a+b": 0.97}])
def test_nothing_is_named_beside_a_declared_model_that_fits(effects):
    name = next(iter(effects))
    found = posterior(0.02, 0.01, effects, base=1.01 * DOUBTED)
    assert answer(found, followed_up=True)[:2] == (f"ambiguous:{name},{NO_EFFECT}", (name,))
    assert answer(posterior(0.02, 0.01, effects, base=0.99 * DOUBTED), followed_up=True)[1] == (name,)


@pytest.mark.parametrize(
    ("nothing", "off", "named"),
    [(2e-4, 0.0, True), (2e-4, 2.0, True), (2e-4, 2.3, False), (1e-5, 3.0, True), (0.0041, 0.0, False)],
)
def test_a_name_stands_beside_a_model_that_fits_at_odds_that_no_parameter_far_off_makes(nothing, off, named):
    """At T = 0.7, 2·10⁻⁴ becomes 2·10⁻⁴ exp(0.35 θ²): below 10⁻³ up to θ = 2.14."""
    found = posterior(nothing, 0.001, {"a": 0.99, "b": 0.0}, base=0.9, off=off)
    assert answer(found, followed_up=False)[0] == ("effect:a" if named else f"ambiguous:a,{NO_EFFECT}")


PAIRS = [f"{a}+{b}" for a in "abcdef" for b in "ghijkl"]


@pytest.mark.parametrize("followed_up", [False, True])
@pytest.mark.parametrize(
    "effects",
    [
        {"a": 0.4} | dict.fromkeys(PAIRS, 0.5 / len(PAIRS)),
        {"a": 0.001, PAIRS[20]: 0.94} | dict.fromkeys(PAIRS[:20], 0.001),
        {"a": 0.001} | dict.fromkeys(PAIRS, 0.0001),
    ],
)
def test_an_answer_reads_no_fit_but_those_that_are_asked_of_typical_replicates(effects, followed_up):
    nothing = 0.98 - sum(effects.values())
    found = posterior(nothing, 0.02, effects)
    asked = read_in(found)
    assert {"base", "a"} <= set(asked)
    assert len([label for label in asked if "+" in label]) >= MOST_PAIRS
    only = replace(found, fits={label: found.fits[label] for label in asked})
    assert answer(only, followed_up) == answer(found, followed_up)


def test_a_sure_answer_asks_few_pairs():
    found = posterior(0.001, 0.001, {"a": 0.99} | dict.fromkeys(PAIRS, 1e-5))
    assert len(read_in(found)) == 2 + MOST_PAIRS


def test_the_reason_is_told():
    assert (
        "as far off a or b come up" in answer(posterior(0.01, 0.01, {"a": 0.6, "b": 0.38}, "ab"), followed_up=True)[2]
    )


def test_the_tables_of_a_verdict_by_closed_form():
    """Unit noise, one slope and one effect, six pours of data: a parameter two deviations up, "lean" three too high."""
    rng = np.random.default_rng(0)
    names, way = ("height", "width", "area", "lean"), np.repeat([-1, 0], 200)
    theta = np.where(np.arange(400) % 2, 1.0, -1.0)[:, None]
    block = rng.standard_normal((400, 4)) + theta * np.eye(4)[1]
    block[way == 0] += np.eye(4)[0]
    taught = Lessons(theta, way, (way == 0).astype(float), np.arange(400), (block,))
    # Of the mean of these replicates each feature is what it is said to be.
    values = rng.standard_normal((6, 4))
    values += np.array([0.0, 2.0, 0.0, 3.0]) - values.mean(axis=0)
    data = MeasuredFeatures("low", "scan", names, values, np.zeros(4), scalars=1)
    compared = weighed(taught, (Way("push", "push"),), [data])
    parameter = CalibratedParameter("friction", 0.0, 1.0, 0.3, 0.05)
    declared = Declared((parameter,), (), (DeclaredCondition("low", names),))
    found = verdict_of(compared, declared, (200,), ())

    # Far features are drawn in, 2 asinh(x/2); the mean of six has a variance of r/6, and θ ~ N(0, 1) beforehand.
    noise = compared.data.scatter / 6.0
    (row,) = found.parameters
    assert (row.mean, row.sd) == (0.3, 0.05)
    assert row.before_sd == pytest.approx(0.05 * np.sqrt(noise / (1.0 + noise)), rel=0.1)
    assert row.before == pytest.approx(0.3 + 0.05 * 2.0 * np.arcsinh(1.0) / (1.0 + noise), abs=0.05 * 0.25)
    residuals = {one.feature: one for one in found.residuals}
    assert residuals["lean"].z_before == pytest.approx(2.0 * np.arcsinh(1.5) / np.sqrt(noise), rel=0.2)
    assert residuals["lean"].measured - residuals["lean"].before == pytest.approx(3.0, rel=0.2)
    # All that is known of the parameter is this feature, which it follows: what is left is as unlikely as the whole.
    assert residuals["width"].z_before == pytest.approx(2.0 * np.arcsinh(1.0) / np.sqrt(1.0 + noise), rel=0.1)
    assert abs(residuals["area"].z_before) < 1.0
    (place,) = found.where
    assert (place.condition, place.share, place.feature) == ("low", 1.0, "lean")
    (effect,) = found.effects
    # A shift by one deviation; the means of 200 pours leave 0.1 of it.
    assert effect.strength == pytest.approx(1.0 / np.sqrt(noise), rel=0.25)
    assert effect.pours == 200


def test_strengths_know_what_bodies_say_of_the_parameters():
    """An effect that shifts what a parameter shifts: recalibration absorbs all but 1/√(noise + Θ) of it."""
    rng = np.random.default_rng(2)
    way = np.repeat([-1, 0], 200)
    theta = np.where(np.arange(400) % 2, 1.0, -1.0)[:, None]
    block = rng.standard_normal((400, 4)) + (theta + (way == 0)[:, None]) * np.eye(4)[1]
    taught = Lessons(theta, way, (way == 0).astype(float), np.arange(400), (block,))
    values = rng.standard_normal((6, 4))
    values += np.eye(4)[1] - values.mean(axis=0)
    data = MeasuredFeatures("low", "scan", ("height", "width", "area", "lean"), values, np.zeros(4), scalars=1)
    parameter = CalibratedParameter("friction", 0.0, 1.0, 0.3, 0.05)
    declared = Declared((parameter,), (), (DeclaredCondition("low", data.names),))
    for slope in (None, 1.0, 100.0):
        bodies, left = None, 1.0
        if slope is not None:
            slopes, left = np.array([[slope]]), 1.0 / (1.0 + slope**2)
            factor = np.linalg.cholesky(np.eye(1) + slopes @ slopes.T)
            bodies = BodyEvidence(None, (None,), np.zeros(1), slopes, np.eye(1), factor, (), {"twisting": None})
        compared = weighed(taught, (Way("twisting", "twisting"),), [data], (), bodies)
        (effect,) = verdict_of(compared, declared, (200,), ()).effects
        noise = compared.data.scatter / 6.0
        assert effect.strength == pytest.approx(1.0 / np.sqrt(noise + left), rel=0.15), slope
        # Another emulator's prediction of the base model is no shift by an effect.
        (again,) = verdict_of(compared.refitted(["base"]), declared, (200,), ()).effects
        assert again.fitted_strength == effect.fitted_strength
