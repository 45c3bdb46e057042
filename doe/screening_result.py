"""What a screening found: effects, their tests against two errors, and what each error can see."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from doe.multiple_tests import Lenth
from doe.record import Record

Adjustment = Literal["none", "holm"]
ErrorSource = Literal["replicates", "dummies"]

SIGNIFICANT = "significant"
FALLBACK = "fallback: not significant"


@dataclass(frozen=True)
class EffectTest(Record):
    """One effect against one error: t = effect/standard_error, f = t^2; p values raw and corrected for all
    factors.
    """

    standard_error: float
    t: float
    f: float
    p: float
    p_holm: float
    p_bonferroni: float


@dataclass(frozen=True)
class Effect(Record):
    """One column of the design: effect in the unit of the response, partial sum of squares, share of the
    total.
    """

    name: str
    is_dummy: bool
    effect: float
    sum_of_squares: float
    contribution_percent: float
    by_dummies: EffectTest | None
    by_replicates: EffectTest | None

    def test_by(self, source: ErrorSource) -> EffectTest | None:
        """Return the test against an error; None where there is none."""
        return self.by_replicates if source == "replicates" else self.by_dummies


@dataclass(frozen=True)
class ErrorEstimate(Record):
    """An error and what it can see. Margins and detectable effects are in the unit of the response.

    `sigma` is the standard deviation of a row mean (source "dummies") or of one run (source "replicates");
    `margin` is the |effect| at which p = alpha, `margin_bonferroni` the same for all factors at once;
    `smallest_detectable_effect` is found with chance 0.8. Unbalanced data give every effect its own standard
    error; `standard_error` is then the median.
    """

    source: ErrorSource
    sigma: float
    df: int
    standard_error: float
    t_limit: float
    t_limit_bonferroni: float
    margin: float
    margin_bonferroni: float
    smallest_detectable_effect: float
    smallest_detectable_effect_bonferroni: float


@dataclass(frozen=True)
class Screening(Record):
    """Effects of a two-level design. `missing_rows` are row indices without a valid run; `notes` are
    sentences.
    """

    effects: tuple[Effect, ...]
    mean: float
    rows: int
    missing_rows: tuple[int, ...]
    runs: int
    total_sum_of_squares: float
    dummy_error: ErrorEstimate | None
    pure_error: ErrorEstimate | None
    lenth: Lenth
    unexplained_f: float
    unexplained_p: float
    notes: tuple[str, ...]

    @property
    def error_source(self) -> ErrorSource | None:
        """Return which error decides: the replicates where there are any, else the dummies, None without either."""
        return None if self.deciding_error is None else self.deciding_error.source

    @property
    def deciding_error(self) -> ErrorEstimate | None:
        """Return the error that decides; None without replicates and dummies."""
        return self.pure_error or self.dummy_error

    def error(self, source: ErrorSource) -> ErrorEstimate | None:
        """Return the estimate of an error; None where the design gives none."""
        return self.pure_error if source == "replicates" else self.dummy_error

    def half_width(self, effect: Effect) -> float:
        """Return half the 95 % interval of `effect`: t limit × its standard error, NaN where it was not tested."""
        error, test = self.deciding_error, self.deciding_test(effect)
        return math.nan if error is None or test is None else error.t_limit * test.standard_error

    def factor_effects(self) -> tuple[Effect, ...]:
        """Return the effects of the factors that could be estimated, by falling size."""
        known = [effect for effect in self.effects if not effect.is_dummy and math.isfinite(effect.effect)]
        return tuple(sorted(known, key=lambda effect: -abs(effect.effect)))

    def deciding_test(self, effect: Effect) -> EffectTest | None:
        """Return the test of `effect` against the error that decides."""
        return effect.by_replicates if self.pure_error is not None else effect.by_dummies

    def ranked(self) -> tuple[Effect, ...]:
        """Return the factors (no dummies) by falling |t|; without any error, by falling |effect|."""

        def size(effect: Effect) -> float:
            test = self.deciding_test(effect)
            value = abs(effect.effect) if test is None else abs(test.t)
            return value if math.isfinite(value) else (math.inf if value > 0 else -1.0)

        return tuple(sorted((e for e in self.effects if not e.is_dummy), key=size, reverse=True))

    def significant(
        self, alpha: float = 0.05, adjust: Adjustment = "holm", error: ErrorSource | None = None
    ) -> tuple[str, ...]:
        """Return the factors with p < alpha by falling |t|, against the error that decides unless one is named.

        The default corrects for the number of factors (Holm 1979), so that `alpha` is the chance of any false
        find; "none" is the paper's way, with one false find expected per 1/alpha factors.
        """
        found = []
        for effect in self.ranked():
            test = self.deciding_test(effect) if error is None else effect.test_by(error)
            if test is not None and (test.p_holm if adjust == "holm" else test.p) < alpha:
                found.append(effect.name)
        return tuple(found)


@dataclass(frozen=True)
class Selected(Record):
    """A factor taken to the next stage and why: "significant" or "fallback: not significant"."""

    name: str
    reason: str
