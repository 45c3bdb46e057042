"""Errors and intervals over many rendered photographs: a small sample each time, a campaign when asked for.

Nominal 95 %; asked for 90 %. On 2026-11-22, of the first 108 solids 99 % of the flanks' intervals held, of the
first 126 piles of bodies 91 %.
"""

import pytest

from tests.solver.photograph.coverage import bodies_trial, solid_trial, summary

SMALL = (400, 500)


def test_a_few_solids():
    found = summary([solid_trial(seed, SMALL) for seed in range(1000, 1008)])
    assert found["refused"] <= 1
    assert found["largest"] <= 0.5
    # Sixteen flanks at 95 %: at most three outside with probability 0.99.
    assert found["flanks_held"] >= 13 / 16


@pytest.mark.slow
def test_solids_campaign():
    """Every error within 0.5°, intervals hold in 90 % and more."""
    found = summary([solid_trial(seed, (400, 640, 1000, 1600, 4000)) for seed in range(200)])
    print(found)
    assert found["refused"] <= 6
    assert found["largest"] <= 0.5
    assert found["flanks_held"] >= 0.9
    assert found["mean_held"] >= 0.9


@pytest.mark.slow
def test_bodies_campaign():
    """Against the fit of the noise-free silhouette: intervals hold in 90 % and more."""
    found = summary([bodies_trial(seed, (500, 800, 1200, 2400)) for seed in range(200)])
    print(found)
    assert found["refused"] <= 12  # since 2026-11-26 flanks whose thirds lie far apart are refused as bent: two more
    assert found["flanks_held"] >= 0.9
    assert found["mean_held"] >= 0.9
