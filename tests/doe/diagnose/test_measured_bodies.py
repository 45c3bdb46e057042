"""What single bodies say joins what pours say: a posterior, and the chance of a follow-up that asks for them."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from scipy.interpolate import PchipInterpolator
from scipy.linalg import block_diag

from doe.declared.bodies import ActingModel, BodyEvidence, body_evidence, wanted_bodies
from doe.declared.budget import Budget
from doe.declared.model import declare
from doe.diagnose import diagnosis
from doe.diagnose.candidate_experiments import MAGNIFIED, acting_in, checked_by_bodies, with_bodies
from doe.diagnose.compared_features import MeasuredFeatures, weighed
from doe.diagnose.emulator import Lessons, Way
from doe.diagnose.next_experiment import DRAWS, CandidateExperiment, Prediction, chance_of_an_answer
from doe.diagnose.posterior import TEMPERATURE, Data, Posterior, posterior
from doe.diagnose.result import BODIES_ALONE, Amplitude
from doe.diagnose.verdict import THRESHOLD
from doe.measurement import load_measurement
from doe.measurement.bodies import MeasuredBody
from solver import EFFECTS
from tests.doe.diagnose.test_posterior import SIZE, emulator
from tests.doe.measurement.folders import write

MASS = 2500.0 * math.pi / 6.0 * 12e-3**3
ALIKE = ("density_error", "rolling_resistance")
pytestmark = pytest.mark.usefixtures("plates")
WAYS = tuple(Way(name, name, (0.1,), 2.0) for name in ALIKE)


@pytest.fixture
def data(tmp_path):
    return load_measurement(write(tmp_path))


def compared(bodies: BodyEvidence | None):
    """Six pours shifted by what each of two effects does alike: by pours alone nobody can tell which it is."""
    rng = np.random.default_rng(0)
    way = np.repeat([-1, 0, 1], 100)
    block = rng.standard_normal((300, 4))
    block[way >= 0] += 2.0 * np.eye(4)[0]
    theta = np.where(np.arange(300) % 2, 1.0, -1.0)[:, None]
    taught = Lessons(theta, way, (way >= 0).astype(float), np.arange(300), (block,))
    values = rng.standard_normal((6, 4))
    values += 2.0 * np.eye(4)[0] - values.mean(axis=0)
    features = MeasuredFeatures("low", "scalars", ("a", "b", "c", "d"), values, np.zeros(4), scalars=4)
    return weighed(taught, WAYS, [features], (), bodies)


def weighed_bodies(data, factor):
    rows = (MeasuredBody("bead", "mass", factor * MASS, 0.01 * factor * MASS),)
    return body_evidence(replace(data, bodies=rows), declare(data, tuple(EFFECTS)))


def test_a_balance_tells_what_pours_cannot(data):
    by_pours = compared(None).posterior
    assert 0.3 < by_pours.effects["density_error"] / by_pours.effects["rolling_resistance"] < 3.0
    heavier, as_declared = (compared(weighed_bodies(data, factor)).posterior for factor in (1.1, 1.0))
    assert heavier.effects["density_error"] > 0.99
    assert heavier.fits["density_error"].amplitudes[0].value == pytest.approx(0.1, abs=0.015)
    assert as_declared.effects["rolling_resistance"] > 0.9
    assert as_declared.effects["density_error"] < 0.05


def test_the_evidence_is_that_of_pours_and_bodies_together(data):
    by_pours, both = compared(None).posterior, compared(weighed_bodies(data, 1.02)).posterior
    off = math.log(1.02) / 0.01
    for name in ("base", "rolling_resistance"):
        gained = both.fits[name].log_evidence - by_pours.fits[name].log_evidence
        assert gained == pytest.approx(-0.5 * off**2), name
    assert both.log_outside - by_pours.log_outside == pytest.approx(-0.5 * off**2)


def test_a_parameter_that_is_off_counts_once_for_piles_and_bodies():
    """Both have linear answers to it, so their joint density is one normal density (ν is large)."""
    rng = np.random.default_rng(3)
    slope, slopes = 2.0 * rng.standard_normal(SIZE), np.array([[3.0], [-1.0]])
    taught = emulator({}, freedom=10**8, sensitivity=slope)
    factor = np.linalg.cholesky(np.eye(2) + slopes @ slopes.T)

    def of(z, y):
        bodies = BodyEvidence(None, (None, None), np.linalg.solve(factor, y), slopes, np.eye(2), factor, ())
        return posterior(taught, Data(z, 6, bodies=bodies), temperature=1.0, pairs=False).fits["base"]

    answers = np.concatenate([slope, slopes[:, 0]])
    found = [
        (one, of(one[:SIZE], one[SIZE:]))
        for theta in (0.0, 1.5, -2.0)
        for one in [theta * answers + np.concatenate([0.4 * rng.standard_normal(SIZE), rng.standard_normal(2)])]
    ]
    noise = np.concatenate([found[0][1].variance, np.ones(2)])
    both = stats.multivariate_normal(cov=np.diag(noise) + np.outer(answers, answers))
    expected = np.array([both.logpdf(one) for one, _ in found])
    evidence = np.array([fit.log_evidence for _, fit in found])
    assert evidence - evidence[0] == pytest.approx(expected - expected[0], abs=1e-4)
    for one, fit in found:
        precision = 1.0 + answers @ (answers / noise)
        assert fit.theta == pytest.approx([answers @ (one / noise) / precision], abs=1e-4)
        assert fit.theta_covariance == pytest.approx(np.array([[1.0 / precision]]), rel=1e-4)
        square = one @ np.linalg.solve(both.cov, one)
        assert fit.p == pytest.approx(stats.chi2.sf(square, len(one)), rel=1e-3)


def test_a_model_that_bodies_contradict_does_not_fit(data):
    """One more number among those that F is of."""
    by_pours, both = compared(None), compared(weighed_bodies(data, 1.05))
    freedom = by_pours.emulator.freedom
    square = 4.0 * stats.f.isf(by_pours.posterior.fits["rolling_resistance"].p, 4, freedom)
    wanted = stats.f.sf((square + (math.log(1.05) / 0.01) ** 2) / 5.0, 5, freedom)
    assert both.posterior.fits["rolling_resistance"].p == pytest.approx(wanted)
    assert wanted < 0.001


def test_a_follow_up_that_asks_for_bodies_knows_what_they_will_tell(data):
    """Pours that say nothing, and a mass ten standard errors off by one answer: a balance nearly always finds it."""
    nothing = Prediction(np.zeros(1), np.zeros((1, 1)))
    declared = declare(data, tuple(EFFECTS))
    k = len(declared.parameters)
    answers = [ActingModel([(name, 0.1, 1e-6)], np.zeros(k), np.eye(k)) for name in ALIKE]
    bodies = wanted_bodies(data, declared, answers)
    found = known(compared(None).posterior)
    weights, by_pile = dict.fromkeys(ALIKE, 0.5), np.zeros((1, k + 1))
    for some, low, high in ((None, 0.0, 0.0), (bodies, 0.99, 1.0)):
        predictions = {name: with_bodies(nothing, by_pile, acting_in(found, name), some) for name in ALIKE}
        assert low <= chance_of_an_answer(CandidateExperiment("as it is", predictions), weights, 6) <= high


def test_a_pile_and_bodies_are_predicted_together(data):
    """Two parameters and a negative amplitude move both: Cov = diag(V, N) + (J, K) C (J, K)ᵀ + S Sᵀ."""
    slopes, noise = np.array([[3.0, 1.0], [-1.0, 2.0]]), np.diag([1.0, 2.0])
    unsure, theta = np.array([[0.3, -0.2], [-0.2, 0.4]]), np.array([1.2, -0.5])
    factor, by_effect = np.linalg.cholesky(noise + slopes @ slopes.T), np.array([20.0, -5.0])
    at = np.array([-1.0, 0.0, 1.0])
    shifts = {"density_error": PchipInterpolator(at, np.outer(at, by_effect))}
    bodies = BodyEvidence(None, (None, None), np.zeros(2), slopes, noise, factor, (), shifts)
    pile, of_pile = np.array([[2.0, 0.0], [0.5, -1.0], [0.0, 1.0]]), 0.1 * np.eye(3)
    acts = ActingModel([("density_error", -0.1, 0.05)], theta, unsure)
    # Away from zero: to a more negative amplitude.
    more = -0.05 * np.append([7.0, 0.0, 3.0], np.linalg.solve(factor, by_effect))
    loadings = np.column_stack([pile @ np.linalg.cholesky(unsure), more[:3]])
    found = with_bodies(Prediction(np.zeros(3), of_pile), loadings, acts, bodies)
    both = np.concatenate([pile, np.linalg.solve(factor, slopes)])
    white = np.linalg.solve(factor, np.linalg.solve(factor, noise).T)
    covariance = block_diag(of_pile, white) + both @ unsure @ both.T + np.outer(more, more)
    unit = np.array([1.0, 1.0, 1.0, MAGNIFIED, MAGNIFIED])
    told = np.linalg.solve(factor, slopes @ theta - 0.1 * by_effect)
    assert found.mean == pytest.approx(unit * np.append(np.zeros(3), told))
    assert found.covariance == pytest.approx(np.outer(unit, unit) * covariance)
    alone = with_bodies(Prediction(np.zeros(3), of_pile), loadings, acts, None)
    assert alone.covariance == pytest.approx(found.covariance[:3, :3])


def test_numbers_are_predicted_where_nothing_is_calibrated(data):
    bodies = BodyEvidence(None, (None,), np.zeros(1), np.zeros((1, 0)), np.eye(1), np.eye(1), ())
    acts = ActingModel([], np.zeros(0), np.zeros((0, 0)))
    found = with_bodies(Prediction(np.zeros(2), np.eye(2)), np.zeros((2, 0)), acts, bodies)
    assert found.covariance == pytest.approx(np.diag([1.0, 1.0, MAGNIFIED**2]))
    declared = declare(replace(data, parameters=()), tuple(EFFECTS))
    nothing = known(compared(None).posterior)
    still = {
        name: replace(fit, theta=np.zeros(0), theta_covariance=np.zeros((0, 0))) for name, fit in nothing.fits.items()
    }
    named = SimpleNamespace(kind="effect:density_error", names=("density_error",))
    (check,) = checked_by_bodies(named, replace(nothing, fits=still), declared, replace(data, parameters=()))
    assert check.bodies == (("bead", "mass"),)


def test_an_unsure_slope_counts_as_far_as_a_parameter_may_be_off():
    """Var J Σ E θ²: bodies that leave θ ~ N(c, C) make it c² + C of what N(0, 1) makes it."""
    taught, bend = emulator({}, sensitivity=np.ones(SIZE), moved=1.0), 0.1
    taught.mean[:, -1] = bend
    bare = posterior(taught, Data(np.zeros(SIZE), 6), pairs=False).fits["base"]
    loose = taught.covariance[:, 1, 1]
    for off, slope in ((0.0, 3.0), (6.0, 3.0), (0.0, 0.0)):
        slopes = np.array([[slope]])
        factor = np.linalg.cholesky(np.eye(1) + slopes @ slopes.T)
        bodies = BodyEvidence(None, (None,), np.array([off]) / factor[0], slopes, np.eye(1), factor, ())
        fit = posterior(taught, Data(np.zeros(SIZE), 6, bodies=bodies), pairs=False).fits["base"]
        left = 1.0 / (1.0 + slope**2)
        square = (slope * off * left) ** 2 + left
        assert fit.variance - bare.variance == pytest.approx(loose * (square - 1.0), rel=1e-6)
        # Before the piles are seen the model predicts what bodies say of the parameter.
        assert fit.still - bare.still == pytest.approx(taught.slopes[:, 0] * slope * off * left + bend * (square - 1.0))


def known(found):
    """``found`` with bodies heavier by a tenth as what a density error comes to."""
    amplitude = Amplitude("density_error", 0, 0.1, 0.1 - 1e-6, 0.1 + 1e-6, False)
    return replace(
        found, fits=found.fits | {"density_error": replace(found.fits["density_error"], amplitudes=(amplitude,))}
    )


def test_numbers_without_a_pour_find_the_answer_as_often_as_the_normal_distribution_has_it():
    """Two answers d standard errors apart: odds exp(T (d²/2 + d z)) for the true one, z ~ N(0, 1)."""
    for d in (1.5, 3.0, 5.0):
        places = {"a": np.zeros(1), "b": np.array([d])}
        item = CandidateExperiment(BODIES_ALONE, {name: Prediction(x, np.eye(1)) for name, x in places.items()})
        needed = math.log(THRESHOLD / (1.0 - THRESHOLD))
        wanted = stats.norm.cdf(0.5 * d - needed / (TEMPERATURE * d))
        found = chance_of_an_answer(item, dict.fromkeys(places, 0.5), math.inf)
        assert found == pytest.approx(wanted, abs=4.0 * math.sqrt(0.25 / (2 * DRAWS))), d


@pytest.mark.parametrize(
    ("kind", "rivals"),
    [
        ("effect:density_error", ("density_error", "rolling_resistance", "base")),
        ("effect:rolling_resistance", ("rolling_resistance", "density_error", "base")),
        ("no_missing_effect", ("base", "density_error", "rolling_resistance")),
    ],
)
def test_an_answer_that_is_given_is_checked_by_the_bodies_in_which_it_differs(data, kind, rivals):
    found, declared = known(compared(None).posterior), declare(data, tuple(EFFECTS))
    names = () if kind == "no_missing_effect" else (kind.partition(":")[2],)
    checks = checked_by_bodies(SimpleNamespace(kind=kind, names=names), found, declared, data)
    (check,) = checks
    assert (check.bodies, check.pours, check.values) == ((("bead", "mass"),), 0, {})
    assert check.rivals[0] == rivals[0]
    assert set(check.rivals) == set(rivals)
    rows = weighed_bodies(data, 1.0).rows
    assert checked_by_bodies(SimpleNamespace(kind=kind, names=names), found, declared, replace(data, bodies=rows)) == ()


def test_no_body_checks_what_no_number_shows_nor_what_nothing_explains(data):
    found, declared = known(compared(None).posterior), declare(data, tuple(EFFECTS))
    alone = replace(found, effects={"rolling_resistance": 0.99, "density_error": 0.005})
    for kind, names in (("effect:rolling_resistance", ("rolling_resistance",)), ("unexplained", ())):
        checks = checked_by_bodies(SimpleNamespace(kind=kind, names=names), alone, declared, data)
        assert checks == ()


class Taught:
    """Training pours that count the looks taken."""

    ways, declared, looks = (), None, 0

    def look(self, found):
        self.looks += 1
        return ("a",)

    def lessons(self): ...
    def instruments(self, data):
        return []

    def refine(self, found, label): ...
    def at_end(self, found):
        return []


@pytest.mark.parametrize("poured", [False, True])
def test_a_follow_up_begins_with_what_taught_the_answers_before_it(data, monkeypatch, poured):
    """Piles need two looks until they name "a"; with the follow-up it is sure at once, and one look is taken at it."""
    weighed_with = []

    def made_up(lessons, ways, conditions, instruments, bodies):
        weighed_with.append((len(conditions), bodies))
        p = 0.99 if bodies else (0.5, 0.8, 0.97)[training.looks]
        fit = SimpleNamespace(p=0.5)
        found = Posterior(1.0 - p, 0.0, {"a": p}, {"base": fit, "a": fit}, (), 0.0)
        compared = SimpleNamespace(posterior=found, bodies=bodies)
        compared.refitted = compared.asked_of_typical = lambda labels: compared
        return compared

    training = Taught()
    monkeypatch.setattr(diagnosis, "weighed", made_up)
    monkeypatch.setattr(diagnosis, "inseparable", lambda compared, name: "")
    monkeypatch.setattr(diagnosis, "body_evidence", lambda part, declared: part.bodies or None)
    rows = (MeasuredBody("bead", "mass", MASS, 0.01 * MASS),)
    follow_up = replace(data, conditions=data.fit if poured else (), bodies=rows)
    both = replace(data, conditions=(*data.fit, *follow_up.fit), bodies=rows)
    assert diagnosis.pursued(training, both, Budget(), print, [follow_up]).bodies == rows
    assert training.looks == 2
    assert weighed_with[0] == (len(data.fit), None)
    assert weighed_with[-1] == (len(both.fit), rows)
