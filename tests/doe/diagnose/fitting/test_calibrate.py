"""Calibration in linear Gaussian worlds: the distribution of T^2, standard errors, priors and edges."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from doe.diagnose.fitting.calibrate import calibrate, fit_with_covariance, gather_evidence
from doe.diagnose.runs import Observed, Parameter
from tests.doe.diagnose.toy import REPLICATES, SIGMA, known_emulator, make_toy

D, AMPLE, SETS = 8, 100_000, 120


def world(seed=0, df=AMPLE):
    toy = make_toy(D, seed)
    return toy, known_emulator(toy, np.random.default_rng(seed), df)


def test_t2_of_the_true_model_is_chi_squared():
    """Known covariance: chi^2 with d - k degrees of freedom (SETS sets, Kolmogorov-Smirnov)."""
    toy, emulator = world()
    generator = np.random.default_rng(1)
    values = [
        calibrate(emulator, (), gather_evidence(emulator, toy.measured(generator, np.zeros(D)))).t2 for _ in range(SETS)
    ]
    assert stats.kstest(values, stats.chi2(D - 3).cdf).pvalue > 0.001


def test_t2_with_an_estimated_covariance_is_hotellings():
    """df = nu = 40: T^2 (nu - m + 1)/(nu m) ~ F(m, nu - m + 1) with m = d - k residual dimensions.

    The minimum over theta is the T^2 of the m combinations of summaries that do not depend on theta, whose estimated
    covariance is Wishart with nu df too (Hotelling 1931; Rao 1959). The 1 % shrinkage is the only difference.
    """
    generator = np.random.default_rng(2)
    values = []
    for seed in range(SETS):
        toy, emulator = world(seed, df=40)
        values.append(calibrate(emulator, (), gather_evidence(emulator, toy.measured(generator, np.zeros(D)))).t2)
    m = D - 3
    scaled = np.array(values) * (40 - m + 1) / (40 * m)
    assert stats.kstest(scaled, stats.f(m, 40 - m + 1).cdf).pvalue > 0.001


def test_t2_under_an_effect_is_noncentral():
    """Shift of 6 sigma off the calibration directions: mean of T^2 = d - k + 36."""
    toy, emulator = world()
    generator = np.random.default_rng(3)
    values = [
        calibrate(emulator, (), gather_evidence(emulator, toy.measured(generator, toy.listed(5, 6.0)))).t2
        for _ in range(SETS)
    ]
    # sd of one value: sqrt(2 (5 + 2 x 36)) = 12.4; four standard errors of the mean.
    assert np.mean(values) == pytest.approx(D - 3 + 36, abs=4 * 12.4 / np.sqrt(SETS))


def test_the_true_effect_is_estimated_with_its_standard_error():
    toy, emulator = world()
    generator = np.random.default_rng(4)
    fits = [
        calibrate(emulator, (5,), gather_evidence(emulator, toy.measured(generator, toy.listed(5, 10.0))))
        for _ in range(SETS)
    ]
    z = [(fit.x[3] - 0.5) / np.sqrt(fit.covariance[3, 3]) for fit in fits]
    assert fits[0].covariance[3, 3] == pytest.approx(1 / 20**2, rel=0.03)
    assert np.mean(z) == pytest.approx(0, abs=4 / np.sqrt(SETS))
    assert np.std(z) == pytest.approx(1, abs=4 / np.sqrt(2 * SETS))


def test_a_prior_counts_as_one_more_measurement():
    """y = 20 sigma theta: combining with mean 0.4 ± 0.05 is the inverse-variance mean, also 0.05 ± from the data."""
    toy, emulator = world()
    parameters = (Parameter("p0", -1.0, 1.0, mean=0.4, sd=0.05), *toy.declared.parameters[1:])
    emulator = replace(emulator, declared=replace(toy.declared, parameters=parameters))
    data = Observed((np.tile(toy.jacobian[:, 0] * 0.2, (REPLICATES, 1)),), (np.zeros(D),))
    evidence = gather_evidence(emulator, data)
    fit = fit_with_covariance(emulator.predictor(()), (), evidence, [SIGMA**2 * np.eye(D)])
    assert fit.x == pytest.approx([0.3, 0.0, 0.0], abs=1e-6)
    assert fit.t2 == pytest.approx(2 * 0.1**2 / 0.05**2)
    assert fit.df == D + 1 - 3
    assert np.sqrt(fit.covariance[0, 0]) == pytest.approx(0.05 / np.sqrt(2))


def test_a_parameter_driven_to_its_edge_is_reported():
    toy, emulator = world()
    data = Observed((np.tile(toy.jacobian[:, 1] * 1.5, (REPLICATES, 1)),), (np.zeros(D),))
    fit = fit_with_covariance(emulator.predictor(()), (), gather_evidence(emulator, data), [SIGMA**2 * np.eye(D)])
    assert fit.at_edge.tolist() == [0, 1, 0]
    # T^2 = (20 (1.5 - theta))^2: at theta = 1 it is 100 and half its slope is -200.
    assert fit.t2 == pytest.approx(100)
    assert fit.slope[1] == pytest.approx(-200)


def test_instrument_error_is_not_averaged_away():
    toy, emulator = world()
    sharp = toy.measured(np.random.default_rng(5), np.zeros(D))
    blunt = Observed(sharp.blocks, (np.full(D, 2.0),))
    sigma = [calibrate(emulator, (), gather_evidence(emulator, data)).sigma[0] for data in (sharp, blunt)]
    assert np.diag(sigma[1] - sigma[0]) == pytest.approx(np.full(D, 4.0))


def test_a_published_mean_of_n_pours_weighs_as_the_n_pours_do():
    """The simulated covariance is taken for both; only the comparison of variances needs the single pours."""
    toy, emulator = world()
    pours = toy.measured(np.random.default_rng(6), np.zeros(D))
    mean = Observed((pours.blocks[0].mean(axis=0)[None],), (np.zeros(D),), (REPLICATES,))
    fits = [calibrate(emulator, (), gather_evidence(emulator, data)) for data in (pours, mean)]
    assert fits[1].t2 == pytest.approx(fits[0].t2)
    assert fits[1].sigma[0] == pytest.approx(fits[0].sigma[0])


def test_means_of_n_pours_are_compared_with_the_scatter_of_such_means():
    _, emulator = world()
    generator = np.random.default_rng(7)
    means = generator.standard_normal((200, D)) / np.sqrt(5)
    (comparison,) = gather_evidence(emulator, Observed((means,), (np.zeros(D),), (5,))).variances
    assert comparison.ratio == pytest.approx(np.ones(D), abs=0.35)
    assert not comparison.differs.any()
