"""d' and the choice of an estimator on made-up pilots with a known answer."""

import json

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.meta_analysis import effectsize_smd

from doe.analysis.pilot import choose_estimator, d_prime
from doe.errors import StatisticsError


def pilot(noise, shift=2.0, runs=30, seed=0):
    """Return centre and one change for estimators that add their own noise to the same true piles."""
    generator = np.random.default_rng(seed)
    true_centre, true_changed = generator.normal(24, 0.5, runs), generator.normal(24 + shift, 0.5, runs)
    centre = {name: true_centre + generator.normal(0, s, runs) for name, s in noise.items()}
    changed = {name: true_changed + generator.normal(0, s, runs) for name, s in noise.items()}
    return centre, {"steeper": changed}


def test_d_prime_agrees_with_statsmodels():
    """statsmodels gives Hedges' g = d' (1 - 3/(4 df - 1))."""
    first, second = np.random.default_rng(1).normal(0, 2, 12), np.random.default_rng(2).normal(3, 1, 8)
    hedges, _ = effectsize_smd(second.mean(), second.std(ddof=1), 8, first.mean(), first.std(ddof=1), 12)
    assert d_prime(first, second) * (1 - 3 / (4 * 18 - 1)) == pytest.approx(hedges)


def test_shift_and_pooled_sigma_by_hand():
    """Squares 2 of (1, 2, 3) and 8 of (10, 12, 14) over four degrees of freedom."""
    (found,) = choose_estimator({"one": (1, 2, 3)}, {"steeper": {"one": (10, 12, 14)}}, default="one").separations
    assert (found.shift, found.sigma) == (pytest.approx(10.0), pytest.approx(np.sqrt(2.5)))
    assert found.d_prime == pytest.approx(10.0 / np.sqrt(2.5))


def test_the_interval_of_d_prime_is_that_of_scipy():
    centre, changed = pilot({"one": 2.0})

    def statistic(a, b, axis=-1):
        spread = (a.var(axis=axis, ddof=1) + b.var(axis=axis, ddof=1)) / 2
        return (b.mean(axis=axis) - a.mean(axis=axis)) / np.sqrt(spread)

    (found,) = choose_estimator(centre, changed, default="one", samples=4000).separations
    samples = (centre["one"], changed["steeper"]["one"])
    other = stats.bootstrap(samples, statistic, n_resamples=4000, method="percentile", rng=np.random.default_rng(1))
    # d' scatters by 0.3; 4000 resamples leave 0.013 of a 2.5 % quantile, and a 5 % one is 0.09 away.
    ends = other.confidence_interval
    assert (found.low, found.high) == (pytest.approx(ends.low, abs=0.05), pytest.approx(ends.high, abs=0.05))


def test_changes_in_both_directions_do_not_cancel():
    centre, up = pilot({"loud": 6.0, "quiet": 0.5})
    down = {name: 2 * np.mean(centre[name]) - values for name, values in up["steeper"].items()}
    found = choose_estimator(centre, {**up, "flatter": down}, default="loud")
    assert (found.chosen, found.best) == ("quiet", "quiet")
    for name, mean in zip(found.estimators, found.mean_d_prime, strict=True):
        own = [one.d_prime for one in found.separations if one.estimator == name]
        assert own[0] * own[1] < 0
        assert mean == pytest.approx(abs(own[0] - own[1]) / 2)


def test_an_estimator_that_reads_the_same_is_not_better():
    centre, changed = pilot({"own": 2.0})
    twins = [{"twin": values["own"], **values} for values in (centre, changed["steeper"])]
    found = choose_estimator(twins[0], {"steeper": twins[1]}, default="own")
    assert (found.share_better, found.chosen) == (0.0, "own")


def test_the_quieter_estimator_is_chosen():
    found = choose_estimator(*pilot({"loud": 6.0, "quiet": 0.5}), default="loud")
    assert (found.chosen, found.best) == ("quiet", "quiet")
    assert found.share_better > 0.95
    quiet = found.separations[1]
    assert quiet.low < quiet.d_prime < quiet.high
    assert quiet.shift == pytest.approx(2.0, abs=0.8)
    json.dumps(found.to_dict(), allow_nan=False)


def test_a_shift_downwards_is_as_good_and_keeps_its_sign():
    up, down = (choose_estimator(*pilot({"one": 0.5}, shift=s), default="one").separations[0] for s in (2.0, -2.0))
    assert down.high < 0 < up.low


def test_the_default_stays_where_another_is_better_by_chance():
    found = choose_estimator(*pilot({"one": 2.1, "other": 2.0}), default="one")
    assert found.chosen == "one"
    assert found.share_better < 0.95
    assert "is kept" in found.statement or "the target's own" in found.statement


def test_without_a_change_the_interval_covers_zero_and_the_default_stays():
    """150 pilots of 30 + 30 pours in which the declared change does nothing."""
    names = ("own", "second", "third")
    covered, kept = 0, 0
    for study in range(150):
        found = choose_estimator(*pilot(dict.fromkeys(names, 2.0), shift=0.0, seed=study), default="own", samples=400)
        covered += sum(entry.low <= 0 <= entry.high for entry in found.separations)
        kept += found.chosen == "own"
    # Percentile intervals of 30 runs run a little short of 95 %; the three estimators of a pilot share its piles.
    assert 0.88 <= covered / 450 <= 0.99
    assert kept >= 0.9 * 150


def test_an_estimator_that_misses_however_the_piles_are_made_is_left_out():
    centre, changed = pilot({"loud": 6.0, "quiet": 0.5})
    bias = {"loud": (0.2, 4.0, -1.5), "quiet": (-3.0, 2.0, 9.0)}
    found = choose_estimator(centre, changed, default="loud", bias=bias, bias_limit=1.0)
    assert found.chosen == "loud"
    assert found.excluded == ("quiet",)


def test_one_reading_within_the_limit_keeps_an_estimator():
    bias = {"loud": (0.2,), "quiet": (-0.2, 11.0, 20.9)}
    found = choose_estimator(*pilot({"loud": 6.0, "quiet": 0.5}), default="loud", bias=bias, bias_limit=5.0)
    assert found.excluded == ()
    assert found.chosen == "quiet"


def test_a_default_that_is_left_out_is_replaced_and_that_is_said():
    bias = {"own": (9.0, -9.0)}
    found = choose_estimator(*pilot({"own": 0.5, "other": 0.6}), default="own", bias=bias, bias_limit=5.0)
    assert found.chosen == "other"
    assert "own is biased beyond the limit" in found.statement


def test_a_run_that_one_estimator_could_not_read_is_left_out_for_all():
    centre, changed = pilot({"one": 2.0, "other": 1.0})
    centre["one"][3] = np.nan
    kept = {name: np.delete(values, 3) for name, values in centre.items()}
    assert choose_estimator(centre, changed, "one") == choose_estimator(kept, changed, "one")


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda centre, changed: changed["steeper"].pop("one"), "steeper holds"),
        (lambda centre, changed: centre.update(one=np.ones(2)), "same number of runs"),
        (lambda centre, changed: centre.update(one=np.full(30, np.nan)), "centre holds 0 valid runs"),
        (lambda centre, changed: centre.update(one=[1, 2], other=[1, 2]), "centre holds 2 valid runs; at least 3"),
        (lambda centre, changed: changed.clear(), "at least one entry"),
    ],
)
def test_bad_input_is_named(change, message):
    centre, changed = pilot({"one": 2.0, "other": 1.0})
    change(centre, changed)
    with pytest.raises(StatisticsError, match=message):
        choose_estimator(centre, changed, default="one")


def test_a_default_that_is_no_estimator_is_named():
    with pytest.raises(StatisticsError, match="'none' is not one of one, other"):
        choose_estimator(*pilot({"one": 2.0, "other": 1.0}), default="none")


def test_excluding_everything_is_refused():
    centre, changed = pilot({"one": 2.0})
    with pytest.raises(StatisticsError, match="excludes every estimator"):
        choose_estimator(centre, changed, default="one", bias={"one": (9.0,)}, bias_limit=1.0)


def test_equal_piles_have_no_d_prime():
    assert np.isnan(d_prime(np.ones(3), np.full(3, 2.0)))
