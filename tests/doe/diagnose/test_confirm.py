"""Where in the pile the residual sits: differences by hand, and of piles that are known."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from doe.declared.model import CalibratedParameter, CandidateEffect, Declared
from doe.diagnose.confirm import Confirmed, confirming, model_of, residual_maps
from doe.diagnose.result import Amplitude, CalibratedModel
from doe.holdout import CONTRADICTED, HeldOut, MeasuredReplicates, held_out
from doe.measurement import load_measurement
from doe.measurement.piles import PileSurface
from doe.measurement.residual_map import LEAST_ERROR, height_difference
from solver import Spheres
from solver.assets import measurement_folder


def test_a_difference_in_standard_errors_by_hand():
    measured, poured = np.zeros((2, 1, 2)), np.zeros((3, 1, 2))
    measured[:, 0, 0], poured[:, 0, 0] = (3.0, 5.0), (1.0, 2.0, 3.0)
    found = height_difference(measured, poured)
    # Squares (2 + 2) over 3 degrees of freedom, of means of 2 and 3.
    assert found.height[0] == pytest.approx([2.0, 0.0])
    assert found.z[0] == pytest.approx([2.0 / np.sqrt(4.0 / 3.0 * (1.0 / 2.0 + 1.0 / 3.0)), 0.0])


def test_a_bare_plate_differs_by_nothing():
    assert np.all(height_difference(np.zeros((2, 3, 3)), np.zeros((4, 3, 3))).z == 0.0)
    step = height_difference(np.full((2, 1, 1), 2.0 * LEAST_ERROR), np.zeros((2, 1, 1)))
    assert step.z[0, 0] == pytest.approx(2.0)


def heap(x):
    """A pile of one big sphere at ``x`` [m] along x."""
    one = np.array([[x, 0.0, 0.02]])
    return Spheres(one, np.array([0.02]), np.zeros(1, dtype=np.int64))


def test_a_pile_that_stands_elsewhere_shows_where():
    condition = load_measurement(Path(measurement_folder("trefoil_1"))).fit[0]
    scans = {k: PileSurface(heap(0.03 + 1e-4 * k)) for k in (1, 2)}
    scanned = replace(condition, surfaces=scans)
    places = {(): -0.03, (("plate_tilt", (1.0, 0.0)),): 0.03}
    asked = []

    def records(points, c):
        asked.append((c, [point.number for point in points]))
        return [
            SimpleNamespace(pile=SimpleNamespace(spheres=heap(places[one.effects] + 1e-4 * one.number)))
            for one in points
        ]

    before, after = (Confirmed(CalibratedModel((), effects), (), 0) for effects in places)
    (found,) = residual_maps(
        [condition, scanned] if not condition.surfaces else [scanned],
        before,
        after,
        SimpleNamespace(records=records),
        3,
    )
    assert {numbers for _, one in asked for numbers in [tuple(one)]} == {(0, 1, 2)}
    n = len(found.measured)
    x = found.pixel * (np.arange(n) + 0.5 - n / 2)
    highest = np.unravel_index(found.before.height.argmax(), (n, n))
    lowest = np.unravel_index(found.before.height.argmin(), (n, n))
    assert x[highest[0]] == pytest.approx(0.03, abs=found.pixel)
    assert x[lowest[0]] == pytest.approx(-0.03, abs=found.pixel)
    assert x[highest[1]] == pytest.approx(0.0, abs=found.pixel)
    assert np.abs(found.after.height).max() < 0.1 * found.before.height.max()


def test_without_scans_there_is_no_map():
    condition = replace(load_measurement(Path(measurement_folder("trefoil_1"))).fit[0], surfaces={})
    model = Confirmed(CalibratedModel(()), (), 0)
    assert residual_maps([condition], model, model, SimpleNamespace(records=None), 3) == ()


def test_a_model_is_poured_within_its_ranges():
    """θ = 3 deviations of 0.2 above 0.5 is beyond 1; so are amplitudes beyond what the literature supports."""
    effects = (CandidateEffect("air_drag", (0.0,), (2.0,)), CandidateEffect("plate_tilt", (-1.5, -1.5), (1.5, 1.5)))
    declared = Declared((CalibratedParameter("friction", 0.0, 1.0, 0.5, 0.2),), effects, ())
    values = (("plate_tilt", 0, -1.8), ("plate_tilt", 1, 0.7), ("air_drag", 0, 2.6))
    amplitudes = tuple(Amplitude(name, index, value, value, value, False) for name, index, value in values)
    fit = SimpleNamespace(amplitudes=amplitudes, theta=np.array([3.0]))
    assert model_of(fit, declared) == CalibratedModel((1.0,), (("plate_tilt", (-1.5, 0.7)), ("air_drag", (2.0,))))


def test_the_points_that_confirm_are_those_that_were_poured():
    points = confirming(CalibratedModel((1.0,), (("air_drag", (0.5,)),)), 2)
    assert [(one.sequence, one.number, one.theta, one.effects) for one in points] == [
        ("confirm 2", k, (1.0,), (("air_drag", (0.5,)),)) for k in range(2)
    ]


def test_held_out_numbers_that_are_zero_in_every_pour_contradict_nothing():
    empty = MeasuredReplicates("empty", ("residual_mass_kg",), np.zeros((3, 1)), np.zeros(1))
    assert held_out("base", [empty], [np.zeros((8, 1))]) is None
    off = MeasuredReplicates("off", ("height",), np.array([[5.0], [5.1], [4.9]]), np.zeros(1))
    found = held_out("base", [empty, off], [np.zeros((8, 1)), np.linspace(-0.1, 0.1, 8)[:, None]])
    assert found is not None
    assert found.condition == "off"
    assert found.p < CONTRADICTED


def test_a_single_held_out_reading_is_held_against_its_instrument_and_the_scatter_of_pours():
    """By hand: s = 1 of five pours, u = 2, and the mean of four: (1/4 + 1/5) + 4 = 4.45, f = 4 (4.45/0.45)² = 391."""
    poured = np.array([[-1.0], [-1.0], [0.0], [1.0], [1.0]])
    one = MeasuredReplicates("curve", ("mass",), np.array([[6.0]]), np.array([2.0]), 4)
    found = held_out("base", [one], [poured])
    assert found is not None
    assert found.farthest == pytest.approx(6.0 / np.sqrt(4.45))
    assert found.p == pytest.approx(2.0 * stats.t.sf(6.0 / np.sqrt(4.45), 4.0 * (4.45 / 0.45) ** 2))
    # Without a statement its scatter is that of the pours: t with four degrees of freedom.
    plain = held_out("base", [replace(one, stated=np.zeros(1), mean_of=1)], [poured])
    assert plain is not None
    assert plain.p == pytest.approx(2.0 * stats.t.sf(6.0 / np.sqrt(1.2), 4))


@pytest.mark.parametrize(("replicates", "mean_of"), [(3, 1), (3, 10), (2, 4)])
def test_a_right_model_is_contradicted_as_often_by_means_of_several_pours(replicates, mean_of):
    rng = np.random.default_rng(6)
    below = 0
    for _ in range(1000):
        values = rng.standard_normal((replicates, 1)) / np.sqrt(mean_of)
        found = held_out(
            "base", [MeasuredReplicates("mean", ("mass",), values, np.zeros(1), mean_of)], [rng.standard_normal((8, 1))]
        )
        assert found is not None
        below += found.p < 0.1
    # A tenth is below p = 0.1: three binomial standard errors.
    assert below / 1000 == pytest.approx(0.1, abs=0.03)


def test_several_readings_by_hand():
    """Means 4 and 6 of two pours each, squares 2 · 2, and pours 0 and 2, squares 2: s² = 6/2, 3 (1/4 + 1/2) = 9/4."""
    one = MeasuredReplicates("mean", ("mass",), np.array([[4.0], [6.0]]), np.zeros(1), 2)
    found = held_out("base", [one], [np.array([[0.0], [2.0]])])
    assert found is not None
    assert found.farthest == pytest.approx(4.0 / 1.5)
    assert found.p == pytest.approx(2.0 * stats.t.sf(4.0 / 1.5, 2))


def test_an_instrument_errs_equally_in_all_replicates():
    """As above with u = 2: 9/4 + 4 = 25/4, f = 2 (25/9)²."""
    one = MeasuredReplicates("mean", ("mass",), np.array([[4.0], [6.0]]), np.array([2.0]), 2)
    found = held_out("base", [one], [np.array([[0.0], [2.0]])])
    assert found is not None
    assert found.farthest == pytest.approx(4.0 / 2.5)
    assert found.p == pytest.approx(2.0 * stats.t.sf(1.6, 2.0 * (25.0 / 9.0) ** 2))


def test_the_p_of_the_farthest_counts_all_that_were_asked():
    """Three numbers of two conditions, equal pours: the farthest by t with four degrees of freedom, times three."""
    pours = np.array([[-1.0, -1.0], [0.0, 0.0], [1.0, 1.0]])
    near = MeasuredReplicates("near", ("a", "b"), pours + np.array([1.0, -2.0]), np.zeros(2))
    far = MeasuredReplicates("far", ("c",), pours[:, :1] + 3.0, np.zeros(1))
    for order in ([near, far], [far, near]):
        found = held_out("base", order, [pours[:, : len(one.summaries)] for one in order])
        assert found is not None
        assert (found.condition, found.summary) == ("far", "c")
        assert found.farthest == pytest.approx(3.0 / np.sqrt(2.0 / 3.0))
        assert found.p == pytest.approx(3.0 * 2.0 * stats.t.sf(3.0 / np.sqrt(2.0 / 3.0), 4))


def test_a_right_model_is_seldom_contradicted_by_single_readings():
    """A tenth of the answers is below p = 0.1, for readings with an instrument of 0, 1 and 5 deviations of a pour."""
    rng = np.random.default_rng(5)
    for stated in (0.0, 1.0, 5.0):
        below = 0
        for _ in range(2000):
            value = np.hypot(1.0, stated) * rng.standard_normal((1, 1))
            one = MeasuredReplicates("curve", ("mass",), value, np.array([stated]))
            found = held_out("base", [one], [rng.standard_normal((8, 1))])
            assert found is not None
            below += found.p < 0.1
        # Three binomial standard errors; Welch and Satterthwaite are approximate within that.
        assert below / 2000 == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("fit", [1.0, 0.3, 0.02])
def test_fitted_and_held_out_data_speak_together_as_fisher_says(fit):
    one = MeasuredReplicates("holdout", ("a",), np.array([[2.0], [2.5], [3.0]]), np.zeros(1))
    found = held_out("base", [one], [np.linspace(0.0, 2.0, 8)[:, None]], fit)
    assert found.together == pytest.approx(stats.combine_pvalues([found.p, fit], method="fisher").pvalue)


def test_a_model_that_is_somewhat_off_in_both_is_contradicted_and_one_that_is_off_in_one_is_not():
    off = HeldOut("plastic_contact", "holdout", "apex_height_m", 5.0, 0.005)
    assert replace(off, fit=0.05).together < CONTRADICTED < off.together
    assert replace(off, p=1.0, fit=0.01).together > CONTRADICTED
    assert replace(off, p=0.0).together == 0.0
    # The chance that a right model is taken back, of as many data sets as there are in a whole test.
    p, fit = np.random.default_rng(5).uniform(size=(2, 100_000))
    share = np.mean([replace(off, p=a, fit=b).together < CONTRADICTED for a, b in zip(p, fit, strict=True)])
    assert share == pytest.approx(CONTRADICTED, abs=4.0 * np.sqrt(CONTRADICTED / 100_000))
