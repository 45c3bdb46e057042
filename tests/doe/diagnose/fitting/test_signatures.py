"""Projection identities: what recalibration absorbs is invisible, what remains is the noncentrality."""

from dataclasses import replace

import numpy as np
import pytest

from doe.diagnose.fitting.calibrate import calibrate, fit_with_covariance, gather_evidence
from doe.diagnose.fitting.signatures import cosine, projected, reach, shift_of, whitening
from doe.diagnose.runs import Observed, Parameter
from tests.doe.diagnose.toy import FULL, SIGMA, estimated_emulator, known_emulator, make_toy

D = 8


def frame_of(emulator, toy):
    data = Observed((np.zeros((6, D)),), (np.zeros(D),))
    evidence = gather_evidence(emulator, data)
    base = fit_with_covariance(emulator.predictor(()), (), evidence, [SIGMA**2 * np.eye(D)])
    return whitening(base, evidence), evidence, base


def test_a_shift_along_a_calibration_direction_is_invisible():
    toy = make_toy(D, 0)
    frame, _, _ = frame_of(known_emulator(toy, np.random.default_rng(0)), toy)
    assert projected(frame, toy.jacobian @ np.array([0.3, -2.0, 1.0])) == pytest.approx(np.zeros(D + 3), abs=1e-9)


def test_the_projector_is_one():
    toy = make_toy(D, 0)
    frame, _, _ = frame_of(known_emulator(toy, np.random.default_rng(0)), toy)
    assert frame.projector @ frame.projector == pytest.approx(frame.projector, abs=1e-12)
    # Rank d - k; the three prior rows carry no weight here and stay.
    assert np.trace(frame.projector) == pytest.approx(D - 3 + 3)


def test_the_norm_is_the_root_of_the_noncentrality():
    """T^2 of noise-free data with the shift, recalibrated, is |z|^2."""
    toy = make_toy(D, 1)
    emulator = known_emulator(toy, np.random.default_rng(0))
    frame, evidence, _ = frame_of(emulator, toy)
    shift = shift_of(emulator, 5, np.zeros(3), np.array([0.3]))
    z = projected(frame, shift)
    shifted = replace(evidence, means=(evidence.means[0] + shift,))
    fit = fit_with_covariance(emulator.predictor(()), (), shifted, [SIGMA**2 * np.eye(D)])
    assert np.linalg.norm(z) == pytest.approx(0.3 * FULL)
    assert fit.t2 == pytest.approx(z @ z, rel=1e-6)


def test_a_prior_makes_a_calibration_direction_partly_visible():
    """Shift of s sigma along a parameter known to s_0 (in sigma): |z|^2 = s^2/(1 + s_0^2)."""
    toy = make_toy(D, 1)
    emulator = known_emulator(toy, np.random.default_rng(0))
    # One coded unit is 20 sigma, so sd = 0.05 is one sigma.
    known = (Parameter("p0", -1.0, 1.0, mean=0.0, sd=0.05), *toy.declared.parameters[1:])
    emulator = replace(emulator, declared=replace(toy.declared, parameters=known))
    frame, _, _ = frame_of(emulator, toy)
    z = projected(frame, toy.jacobian[:, 0] * 3 / FULL)
    assert z @ z == pytest.approx(9 / 2)


def test_reach_is_the_shift_at_the_bound_and_twins_have_their_cosine():
    toy = make_toy(D, 2)
    emulator = known_emulator(toy, np.random.default_rng(0))
    frame, _, _ = frame_of(emulator, toy)
    found = [reach(emulator, e, frame, np.zeros(3)) for e in (0, 1)]
    assert found[0].shift == pytest.approx(FULL)
    assert found[0].amplitude.tolist() == [1.0]
    assert cosine(found[0].signature, found[1].signature) == pytest.approx(0.9)
    assert np.isnan(cosine(np.zeros(3), np.ones(3)))


def test_an_effect_that_does_nothing_reaches_nothing_however_noisy_its_runs():
    """Mean of |z|^2 without what noise adds: over 40 sets of runs, zero within four standard errors."""
    toy = make_toy(D, 3)
    idle = replace(toy, signatures=toy.signatures * (np.arange(8) != 6)[:, None])
    squares, raw = [], []
    for seed in range(40):
        emulator = estimated_emulator(idle, np.random.default_rng(seed), base=40, per_effect=12)
        evidence = gather_evidence(emulator, idle.measured(np.random.default_rng([seed, 1]), np.zeros(D)))
        frame = whitening(calibrate(emulator, (), evidence), evidence)
        found = reach(emulator, 6, frame, np.zeros(3))
        raw.append(found.signature @ found.signature)
        squares.append(found.shift**2)
    assert np.mean(squares) < 0.5 * np.mean(raw)
    assert np.mean(np.sqrt(squares) >= 3) < 0.25
