"""The Bayes limit against its closed form for two effects, and the study made of reference pours."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import norm

from doe.declared.model import CalibratedParameter, CandidateEffect, Declared, DeclaredCondition
from doe.declared.points import Direction, base_points, effect_points
from doe.declared.pours import PointPour
from doe.diagnose.result import Level
from doe.diagnose.training_amplitudes import STRONG, Trials, level_of
from doe.validation.limit import (
    RISK,
    RISKS,
    DataKind,
    Signatures,
    Strength,
    alike,
    confused,
    limit_of,
    limit_study,
    nearest_correlation,
)
from doe.validation.reference import ReferencePours
from tests.doe.validation.test_limit_ruler import sample_of, unit

SETS = 20_000


def two(cosine, gain=1.0):
    names = ("a", "b")
    ruler = (Strength(10.0, 0.1),) * 2
    return Signatures(names, ruler, (Strength(10.0 * gain, 0.1),) * 2, np.array([[1.0, cosine], [cosine, 1.0]]))


KINDS = [DataKind("a", "a", False), DataKind("b", "b", False)]


def limit(found, strength, kinds=KINDS):
    return limit_of(found, kinds, strength, np.random.default_rng(0), SETS)


@pytest.mark.parametrize("cosine", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("strength", [2.0, 4.0])
def test_two_effects_are_confused_as_often_as_chance_has_it(cosine, strength):
    """The larger of two evidences is that of the larger t: wrong with Φ(−s √((1 − c)/2)). Four binomial deviations."""
    wrong = 1.0 - limit(two(cosine), strength).right
    expected = confused(cosine, strength)
    assert expected == pytest.approx(norm.cdf(-strength * np.sqrt((1.0 - cosine) / 2.0)))
    assert abs(wrong - expected) < 4.0 * np.sqrt(expected * (1.0 - expected) / (2 * SETS))


def test_features_in_which_an_effect_is_stronger_tell_more():
    """A gain of two is twice the strength."""
    assert limit(two(0.9, gain=2.0), 3.0).right == pytest.approx(limit(two(0.9), 6.0).right, abs=0.01)


def test_names_are_given_within_the_risk():
    """No more is named than is most probable, at 3 % wrong at most; all of it where nothing is confused."""
    for strength in (3.0, 6.0):
        found = limit(two(0.8), strength)
        assert list(found.named) == sorted(found.named)
        assert found.named[-1] <= found.right
    assert limit(two(0.0), 12.0).named == pytest.approx([1.0] * len(RISKS), abs=1e-3)
    risky = limit(two(0.98), 4.0)
    assert risky.right > 0.6
    assert risky.named[RISKS.index(RISK)] < 0.3
    assert np.mean(list(risky.by_effect.values())) == pytest.approx(risky.named[RISKS.index(RISK)], abs=1e-3)


def test_the_risk_coverage_curve_is_that_of_a_ranking_by_margin():
    """Two effects alike in strength are ranked by |t₁ − t₂|, D = t₁ − t₂ ~ N(s (1 − c), 2 (1 − c)).

    Wrong is P(D < −m), right P(D > m). Evidence grows with the larger t as well, so that the ranking is not exactly by
    the margin, and the smallest risk rests on 120 wrong sets of 40 000: 0.02.
    """
    cosine, strength = 0.9, 8.0
    mean, sd = strength * (1.0 - cosine), np.sqrt(2.0 * (1.0 - cosine))
    found = limit(two(cosine), strength)
    for risk, named in zip(RISKS, found.named, strict=True):
        margin = max(0.0, -norm.ppf(risk) * sd - mean)
        assert named == pytest.approx(norm.sf(margin, mean, sd), abs=0.02)


def test_an_effect_that_the_ruler_does_not_see_takes_no_part():
    found = two(0.0)
    unseen = Signatures(found.names, (found.ruler[0], Strength(0.1, 0.2)), found.strength, found.cosines)
    assert set(limit(unseen, 6.0).by_effect) == {"a"}


def test_where_no_effect_is_seen_there_is_no_limit():
    found, unseen = two(0.0), (Strength(0.1, 0.2),) * 2
    assert limit(Signatures(found.names, unseen, found.strength, found.cosines), 6.0) is None
    nothing = {f"{name} {level}": 0.0 * unit(0) for name in "ab" for level in ("strong", "weak")}
    levels = [Level(Direction(name, name, (0.5,)), 0.5, 12.0) for name in "ab"]
    study = limit_study(sample_of(np.random.default_rng(2), nothing), levels, {"scalars": [3, 3]})
    assert [one.kind.name for one in study.reached] == ["a", "b"]
    assert study.rows == ()


def test_two_directions_of_one_effect_are_one_name():
    """However alike: taking one for the other is no error."""
    kinds = [DataKind("tilt", "tilt x", True), DataKind("tilt", "tilt y", True)]
    assert limit(two(0.99), 4.0, kinds).right == 1.0


def test_an_estimated_matrix_of_cosines_becomes_one():
    estimated = np.array([[1.0, 0.95, 0.1], [0.95, 1.0, 0.9], [0.1, 0.9, 1.0]])
    found = nearest_correlation(estimated)
    assert np.linalg.eigvalsh(found).min() > -1e-9
    assert np.diag(found) == pytest.approx(1.0)
    assert nearest_correlation(np.eye(3)) == pytest.approx(np.eye(3))


def test_effects_are_one_class_where_no_set_up_tells_them_apart():
    assert alike([two(0.97), two(0.99)]) == [("b", "a")]
    assert alike([two(0.97), two(0.5)]) == []


def test_a_study_of_made_up_pours():
    """Two effects at right angles, the second of which more features show: strengths and limits follow.

    Tolerances are three standard errors.
    """
    shifts = {
        "a strong": 4.0 * unit(0),
        "a weak": 2.0 * unit(0),
        "b strong": 2.0 * unit(1) + 4.0 * unit(5),
        "b weak": 1.0 * unit(1) + 2.0 * unit(5),
    }
    sample = sample_of(np.random.default_rng(2), shifts)
    levels = [Level(Direction(name, name, (0.5,)), 0.5, 12.0) for name in "ab"]
    found = limit_study(sample, levels, {"scalars": [3, 3], "scan": [6, 6]})
    a, b = found.reached
    assert a.amplitude == (0.25,)
    assert a.ruler.value == pytest.approx(4.0 * np.sqrt(6.0), rel=0.1)
    assert a.weak is not None
    assert a.weak.value == pytest.approx(0.5 * a.ruler.value, rel=0.15)
    assert b.ruler.value == pytest.approx(2.0 * np.sqrt(6.0), rel=0.15)
    assert b.strength["scan"].value == pytest.approx(np.sqrt(20.0 * 6.0), rel=0.15)
    rows = {(row.data, row.replicates, row.limit.strength): row.limit for row in found.rows}
    assert rows["scan", 6, 4.0].right >= rows["scalars", 6, 4.0].right
    assert rows["scalars", 12, 4.0].right >= rows["scalars", 6, 4.0].right
    assert found.pours["a strong"] == 192


def leaves(study):
    """Numbers and words of a study, in order."""
    if isinstance(study, dict):
        return [leaf for key, one in study.items() for leaf in (key, *leaves(one))]
    return [leaf for one in study for leaf in leaves(one)] if isinstance(study, list) else [study]


def test_features_that_never_vary_change_no_number_of_a_study():
    """But for the rounding of sums over more features, which is the processor's."""
    shifts = {
        f"{name} {level}": share * unit(k)
        for k, name in enumerate("ab")
        for level, share in (("strong", 4.0), ("weak", 2.0))
    }
    sample = sample_of(np.random.default_rng(2), shifts)
    blocks = {
        kind: tuple(np.insert(block, [0, 2, *[3] * 40], 3.0, axis=1) for block in both)
        for kind, both in sample.pours.items()
    }
    levels = [Level(Direction(name, name, (0.5,)), 0.5, 12.0) for name in "ab"]
    padded = limit_study(ReferencePours(blocks, sample.parameters), levels, {"scan": [48, 48]})
    both = leaves(padded.to_dict()), leaves(limit_study(sample, levels, {"scan": [6, 6]}).to_dict())
    for one, other in zip(*both, strict=True):
        assert one == (pytest.approx(other, rel=1e-9, abs=1e-12) if isinstance(other, float) else other)


def test_the_amplitude_is_sought_that_shifts_by_as_much_as_wanted():
    """A made-up effect shifts a feature by ten pours' deviations at its full range: the search ends near ``STRONG``."""
    declared = Declared(
        (CalibratedParameter("friction", 0.1, 0.9, 0.5, 0.05),),
        (CandidateEffect("push", (0.0,), (2.0,)),),
        (DeclaredCondition("low", ("height", "width")),),
    )
    rng = np.random.default_rng(4)

    def poured(points):
        share = [dict(point.effects).get("push", (0.0,))[0] / 2.0 for point in points]
        return [[PointPour((15.0 * s + rng.standard_normal(), rng.standard_normal()), "at_rest")] for s in share]

    base = poured(base_points(declared, 48))
    direction = Direction("push", "push", (2.0,))
    search = level_of(declared, direction, base, partial(effect_points, declared, direction), Trials(6, 5, 10.0, 15.0))
    level = ended(search, poured)
    assert level.share * 15.0 * np.sqrt(6.0) == pytest.approx(STRONG, rel=0.35)


def ended(search, poured):
    """What a search ends with."""
    asked = next(search)
    try:
        while True:
            asked = search.send(poured(asked))
    except StopIteration as end:
        return end.value
