"""How often the verdict is right, wrong or withheld in the linear toy world, against published rates of the same rule.

The published rates (a linear toy of the same size, N = 400 each, ± 2 points; without a second stage for pairs) must lie
in the 99 % Wilson interval of ours, widened by those 2 points. Not compared: 8 summaries with an effect of 6 sigma
outside the list, published as wrong 0.08. With five residual dimensions an effect that fits by chance is named more
often here (0.13 by a single effect, 150 sets), because adequacy allows for the covariance being estimated.

The slow ones last ran on 2026-11-23, with the present rule: all eight pass (56 min beside a campaign).
"""

from functools import partial

import pytest

from tests.doe.diagnose.toy import OUTCOMES, estimated_emulator, rates, wilson

PUBLISHED_ERROR = 0.02

# summaries, kind of data, strength in sigma: right, wrong, ambiguous, none known, nothing detected
PUBLISHED = {
    (8, "null", 0.0): (0.0, 0.007, 0.005, 0.005, 0.98),
    (8, "listed", 6.0): (0.75, 0.02, 0.18, 0.05, 0.01),
    (12, "null", 0.0): (0.0, 0.013, 0.003, 0.005, 0.98),
    (12, "listed", 6.0): (0.77, 0.02, 0.11, 0.06, 0.05),
    (12, "outside", 10.0): (0.0, 0.0, 0.0, 1.0, 0.0),
}


def compare(row, sets):
    summaries, kind, strength = row
    counts = rates(sets, summaries, strength, kind, seed=11)
    for outcome, published in zip(OUTCOMES, PUBLISHED[row], strict=True):
        low, high = wilson(counts[outcome], sets)
        assert low - PUBLISHED_ERROR <= published <= high + PUBLISHED_ERROR, (outcome, dict(counts))
    return counts


@pytest.mark.parametrize(
    ("row", "sets"), [((8, "listed", 6.0), 12), ((12, "null", 0.0), 20), ((12, "outside", 10.0), 5)]
)
def test_rates_are_the_published_ones(row, sets):
    compare(row, sets)


@pytest.mark.slow
@pytest.mark.parametrize("row", PUBLISHED)
def test_rates_of_many_sets_are_the_published_ones(row):
    counts = compare(row, 400)
    if row[1] == "null":
        assert counts["wrong"] <= 0.02 * 400


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "strength", "least"),
    [("null", 0.0, {"nothing": 0.95}), ("listed", 6.0, {"right": 0.6}), ("outside", 8.0, {"none known": 0.7})],
)
def test_rates_with_signatures_from_noisy_runs(kind, strength, least):
    """60 base runs and 16 per effect, parameters and amplitudes curved by 20 %: the project's targets still hold.

    A wrong name in at most 5 % of the sets with a listed effect or none, and 15 % with one outside the list; limits
    are those of the lower end of the 99 % Wilson interval.
    """
    sets = 100
    emulate = partial(estimated_emulator, base=60, per_effect=16, curvature=0.2)
    counts = rates(sets, 12, strength, kind, emulate=emulate, seed=12)
    assert wilson(counts["wrong"], sets)[0] <= {"null": 0.02, "listed": 0.05, "outside": 0.15}[kind]
    assert all(wilson(counts[outcome], sets)[1] >= rate for outcome, rate in least.items())
