"""The bias of the estimators is a range: it hangs on what "bodies fill a cone" means."""

import pytest

from solver.observables.made_up import REACHES, estimator_bias

NAMES = ("angle_of_repose_deg", "angle_of_repose_mass_cone_deg", "bulk_density_kg_m3", "discharge_time_s")


@pytest.fixture(scope="module")
def bias():
    return estimator_bias(NAMES, piles=4)


def test_every_reading_of_a_full_cone_has_a_mean_and_an_error(bias):
    assert all(len(readings) == len(REACHES) == 3 for readings in bias.values())
    assert all(error > 0 for readings in bias.values() for _, error in readings)


def test_what_is_no_angle_has_no_bias_on_a_cone_of_known_angle(bias):
    assert set(bias) == set(NAMES[:2])


def test_readings_differ_as_in_the_table_of_the_cone_estimators(bias):
    """solver.observables.pile gives −0.2°, +11.3° and +20.9° for the centre-of-mass cone, to 0.9° over 60 piles."""
    means = [mean for mean, _ in bias["angle_of_repose_mass_cone_deg"]]
    # Four piles: three standard errors of about 1.5° each.
    assert means == pytest.approx([-0.2, 11.3, 20.9], abs=4.5)
