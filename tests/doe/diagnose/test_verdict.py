"""The rules that turn probabilities into an answer."""

import numpy as np
import pytest

from doe.diagnose.posterior import FITS, Fit, Posterior
from doe.diagnose.result import NO_EFFECT, UNEXPLAINED
from doe.diagnose.verdict import NOTHING_AT_ONCE, NOTHING_FROM, answer


def posterior(nothing, outside, effects, badly=()):
    """Probabilities, with models that fit but for those of ``badly``."""
    none = np.zeros(0)
    fits = {
        label: Fit(label, (), none, np.zeros((0, 0)), none, none, none, 0.0, 0.1 * FITS if label in badly else 0.5)
        for label in ("base", *effects)
    }
    return Posterior(nothing, outside, effects, fits, (), 0.0)


@pytest.mark.parametrize(
    ("found", "kind"),
    [
        (posterior(0.02, 0.01, {"a": 0.95, "b": 0.02}), "effect:a"),
        (posterior(0.02, 0.01, {"a+b": 0.95, "b": 0.02}), "effects:a+b"),
        (posterior(0.6, 0.1, {"a": 0.3}), NO_EFFECT),
        (posterior(0.05, 0.5, {"a": 0.45}), UNEXPLAINED),
        (posterior(0.01, 0.01, {"a": 0.6, "b": 0.38}), "ambiguous:a,b"),
    ],
)
def test_the_rules(found, kind):
    assert answer(found)[0] == kind


@pytest.mark.parametrize(
    ("found", "kind"),
    [
        (posterior(0.02, 0.01, {"a": 0.95, "b": 0.02}, "a"), UNEXPLAINED),
        (posterior(0.6, 0.1, {"a": 0.3}, ("base",)), UNEXPLAINED),
        # Nothing that is left fits: there is nothing to choose between.
        (posterior(0.01, 0.01, {"a": 0.6, "b": 0.38}, "ab"), UNEXPLAINED),
        (posterior(0.01, 0.3, {"a": 0.4, "b": 0.29}, "ab"), UNEXPLAINED),
        # One of those that are left fits: the follow-up may tell.
        (posterior(0.01, 0.01, {"a": 0.6, "b": 0.38}, "a"), "ambiguous:a,b"),
        (posterior(0.4, 0.01, {"a": 0.59}, "a"), f"ambiguous:a,{NO_EFFECT}"),
    ],
)
def test_a_model_that_does_not_fit_is_no_answer(found, kind):
    assert answer(found)[0] == kind


@pytest.mark.parametrize(("nothing", "kind"), [(0.65, f"ambiguous:{NO_EFFECT},a,{UNEXPLAINED}"), (0.7, NO_EFFECT)])
def test_what_is_half_sure_that_nothing_is_missing_asks_for_more(nothing, kind):
    found = posterior(nothing, 0.1, {"a": 0.9 - nothing})
    assert answer(found, NOTHING_AT_ONCE)[0] == kind
    assert answer(found, NOTHING_FROM)[0] == NO_EFFECT


def test_the_reason_is_told():
    assert "as far off a or b as these" in answer(posterior(0.01, 0.01, {"a": 0.6, "b": 0.38}, "ab"))[2]
