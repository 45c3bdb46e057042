"""Equivalence of piles with and without an economy, on made-up responses whose truth is known."""

import numpy as np
import pytest
from scipy import stats

from doe.run_records import Run
from doe.studies.economy import COMPARED, ECONOMIES, compare, judged, pours_needed, rows_of, settings_of
from doe.studies.study import load_study
from solver import value, with_values
from solver.scenes.time_step import time_step

STUDY = load_study("sunflower_extract")
LARGER = ECONOMIES["larger_steps"]


class Normal:
    """Every observable is normal with SD 2; the economy shifts its mean, and loses a share of the pours."""

    def __init__(self, shift=0.0, lost=0.0):
        self._shift, self._lost, self.stages = shift, lost, []

    def run(self, stage, settings):
        self.stages.append((stage, settings[0].replicates))
        return [[self._one(k, setting, r) for r in range(setting.replicates)] for k, setting in enumerate(settings)]

    def _one(self, k, setting, replicate):
        rng = np.random.default_rng([k, replicate])
        cheap = LARGER.name in setting.label
        found = {name: float(rng.normal(20.0 + self._shift * cheap, 2.0)) for name in COMPARED}
        outcome = "time_limit" if cheap and rng.random() < self._lost else "at_rest"
        return Run(setting.label, replicate, 0, replicate, outcome, "", found, 2.0 if cheap else 3.0, "")


def test_pours_for_a_margin_of_three_tenths():
    # 2 (1.645 + 1.645)²/0.3² = 240.5, by hand.
    assert pours_needed() == 241


def test_the_economy_takes_larger_steps_at_three_settings_and_changes_nothing_else():
    rows = rows_of(STUDY, LARGER, 7)
    assert [row.replicates for row in rows] == [7] * 6
    for full, cheap in zip(rows[::2], rows[1::2], strict=True):
        one, two = (with_values(STUDY.scene, row.values) for row in (full, cheap))
        assert time_step(two) == pytest.approx(1.5 * time_step(one))
        assert set(cheap.values) - set(full.values) == {"numerics.rayleigh_fraction", "numerics.impact_fraction"}
    moduli = [float(with_values(STUDY.scene, row.values).material("seed").shear_modulus) for row in rows[::2]]
    assert moduli[1] == moduli[2] == 40.1e6 < moduli[0]


def test_softer_grains_are_softer_than_the_corner_they_stand_at():
    softer = ECONOMIES["softer_grains"]
    for full, cheap in zip(*(rows_of(STUDY, softer, 2)[k::2] for k in (0, 1)), strict=True):
        one, two = (with_values(STUDY.scene, row.values) for row in (full, cheap))
        assert value(two, "material.seed.shear_modulus") == 0.5 * value(one, "material.seed.shear_modulus")


def test_piles_that_are_alike_are_accepted_and_told_tenth_by_tenth():
    told, runner = [], Normal()
    found = compare(STUDY, LARGER, runner, 1000, told.append)
    assert found.accepted
    assert len(found.compared) == 3 * len(COMPARED)
    assert found.cost == pytest.approx(2.0 / 3.0)
    assert [one.pours for one in told] == [100 * k for k in range(1, 11)]
    assert {stage for stage, _ in runner.stages} == {"economy larger_steps"}


def test_a_shift_of_half_a_standard_deviation_is_not_accepted():
    found = compare(STUDY, LARGER, Normal(shift=1.0), 1000)
    assert not any(one.equivalent for one in found.compared)
    assert not found.accepted


def test_the_margin_is_that_of_the_full_settings_scatter():
    """Pours 18 and 22 in turns, and 14 and 26: three tenths of 2 √(n/(n − 1)), whatever the economy scatters by."""
    rows = []
    for row in rows_of(STUDY, LARGER, 10):
        half = 6.0 if LARGER.name in row.label else 2.0
        found = [dict.fromkeys(COMPARED, 20.0 + half * (-1) ** k) for k in range(10)]
        rows.append([Run(row.label, k, 0, k, "at_rest", "", one, 1.0, "") for k, one in enumerate(found)])
    for one in judged(STUDY, LARGER, rows, 10).compared:
        assert one.margin == pytest.approx(0.3 * 2.0 * np.sqrt(10 / 9))
        # Welch, 90 %: standard error √((4 + 36)/9), degrees of freedom 9 (4 + 36)²/(4² + 36²).
        half = stats.t.ppf(0.95, 9 * 40**2 / (4**2 + 36**2)) * np.sqrt(40 / 9)
        assert (one.low, one.high) == (pytest.approx(-half), pytest.approx(half))


def test_few_pours_prove_nothing():
    assert not compare(STUDY, LARGER, Normal(), 20).accepted


def test_lost_pours_are_not_accepted_whatever_the_others_say():
    found = compare(STUDY, LARGER, Normal(lost=0.1), 1000)
    assert all(one.equivalent for one in found.compared)
    assert not found.accepted


def test_a_share_of_false_acceptances_is_at_most_alpha():
    """The mean differs by exactly the margin: each observable passes in at most 5 % of the repetitions."""
    rng, passed, repetitions = np.random.default_rng(5), 0, 60
    rows = rows_of(STUDY, LARGER, 50)
    for _ in range(repetitions):
        runs = []
        for row in rows:
            shift = 0.6 if LARGER.name in row.label else 0.0
            draws = rng.normal(20.0 + shift, 2.0, (50, len(COMPARED))).tolist()
            found = [dict(zip(COMPARED, line, strict=True)) for line in draws]
            runs.append([Run(row.label, k, 0, k, "at_rest", "", one, 1.0, "") for k, one in enumerate(found)])
        passed += sum(one.equivalent for one in judged(STUDY, LARGER, runs, 50).compared)
    # 1080 independent tests at the margin, 5 % each: 54 ± 7; four standard deviations and the margin's own noise.
    assert passed / (repetitions * 3 * len(COMPARED)) < 0.08


def test_settings_are_the_centre_and_the_two_softest_corners():
    found = settings_of(STUDY)
    assert list(found) == ["centre", "soft, least friction", "soft, most friction"]
    assert found["centre"] == {}
    assert found["soft, least friction"]["pair.seed.seed.static_friction"] == 0.47
    assert found["soft, most friction"]["pair.seed.seed.static_friction"] == 0.72


@pytest.mark.parametrize("outcomes", [("jammed", "jammed"), ("at_rest", "jammed")])
def test_pours_that_cannot_be_compared_prove_nothing(outcomes):
    rows = [
        [Run(row.label, k, 0, k, outcome, "", dict.fromkeys(COMPARED, 20.0 + k), 1.0, "") for k in range(4)]
        for row, outcome in zip(rows_of(STUDY, LARGER, 4), outcomes * 3, strict=True)
    ]
    found = judged(STUDY, LARGER, rows, 4)
    assert len(found.compared) == 3 * len(COMPARED)
    assert not any(one.equivalent for one in found.compared)
    assert not found.accepted


def test_without_any_scatter_nothing_is_shown():
    rows = [
        [Run(row.label, k, 0, k, "at_rest", "", dict.fromkeys(COMPARED, 30.0), 1.0, "") for k in range(4)]
        for row in rows_of(STUDY, LARGER, 4)
    ]
    assert not judged(STUDY, LARGER, rows, 4).accepted
