"""Every stage of a full profile gets the pours that its own rows, comparison and noise ask for."""

import dataclasses

import pytest

from doe.analysis.power import smallest_difference, smallest_effect, smallest_main_effect
from doe.stages.pilot import sized
from doe.studies.profile import Profile
from doe.studies.study import load_study

STUDY = load_study("sunflower_extract")
WANTED = Profile("full", resolution_deg=1.0, max_replicates=1000)
ESTIMATOR_SIGMA, TARGET_SIGMA = 1.2, 2.0


def by_stage(profile=WANTED, study=STUDY):
    after, sizes = sized(study, profile, ESTIMATOR_SIGMA, TARGET_SIGMA)
    return after, {size.stage: size for size in sizes}


def linear_effect(n):
    """Box–Behnken for three factors: Var(b) = σ²/(8 n), 17 n − 10 degrees of freedom."""
    return smallest_effect(2 * TARGET_SIGMA / (8 * n) ** 0.5, 17 * n - 10)


@pytest.mark.parametrize(
    ("stage", "resolved"),
    [
        ("screening", lambda n: smallest_main_effect(ESTIMATOR_SIGMA, n, 28, comparisons=24)),
        ("assumptions", lambda n: smallest_main_effect(ESTIMATOR_SIGMA, n, 12, comparisons=6)),
        ("ascent", lambda n: smallest_difference(TARGET_SIGMA, n)),
        ("scan", lambda n: smallest_difference(TARGET_SIGMA, n)),
        ("surface", linear_effect),
    ],
)
def test_a_stage_takes_the_least_replicates_that_resolve_what_is_wanted(stage, resolved):
    size = by_stage()[1][stage]
    assert size.needed == size.taken
    assert size.resolved == pytest.approx(resolved(size.taken))
    assert resolved(size.taken) <= 1.0 < resolved(size.taken - 1)


def test_stages_differ():
    """12 rows resolve less than 28, and a difference of two means less than an effect over 17 points."""
    after, _ = by_stage()
    assert after.screening_replicates < after.assumption_replicates
    assert after.surface_replicates < after.ascent_replicates == after.scan_replicates == 64
    assert after.verification_runs == WANTED.verification_runs


def test_the_limit_is_kept_and_what_it_costs_is_said():
    after, sizes = by_stage(dataclasses.replace(WANTED, max_replicates=12))
    assert after.ascent_replicates == 12
    assert sizes["ascent"].needed == 64
    assert sizes["ascent"].resolved == pytest.approx(smallest_difference(TARGET_SIGMA, 12))
    expected = f"takes 64 pours per row; the profile allows 12, which resolve {smallest_difference(2.0, 12):.2f}°"
    assert expected in sizes["ascent"].statement


def test_without_a_resolution_the_profile_stays():
    assert sized(STUDY, Profile("standard"), 1.0, 2.0) == (Profile("standard"), ())


def test_stages_that_are_not_declared_are_not_sized():
    bare = dataclasses.replace(STUDY, assumptions=(), scan_path=None, scan_values=())
    assert set(by_stage(study=bare)[1]) == {"screening", "ascent", "surface"}


def test_pours_that_all_agree_need_two():
    after, sizes = sized(STUDY, WANTED, 0.0, 0.0)
    assert {size.taken for size in sizes} == {2}
    assert after.screening_replicates == 2
