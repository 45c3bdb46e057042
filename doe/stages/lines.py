"""One line per stage of what it found, for the progress of a study."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from doe.stages.ascent import AscentResult
from doe.stages.pilot import PilotResult
from doe.stages.scan import ScanResult
from doe.stages.screening import ScreeningResult
from doe.stages.surface import OptimumResult, SurfaceResult
from doe.stages.verification import VerificationResult
from doe.target import is_angle


def pilot_line(result: PilotResult) -> str:
    """One line of what the pilot found."""
    target, noise = next(iter(result.noise.items()))
    return (
        f"{target} {noise.mean:.1f} ± {noise.sigma:.1f} over {noise.runs} seeds "
        f"(σ 95 % {noise.low:.1f} … {noise.high:.1f}); estimator for screening: {result.estimator}"
    )


def screening_line(result: ScreeningResult) -> str:
    """One line of what a screening found."""
    found = result.analysis.significant()
    text = f"significant: {', '.join(found) if found else 'none'}"
    error = result.analysis.pure_error or result.analysis.dummy_error
    # The factors are judged all at once (Holm); so is the effect that could have been seen.
    if error is not None and math.isfinite(error.smallest_detectable_effect_bonferroni):
        size = _observed(result.response, error.smallest_detectable_effect_bonferroni)
        text += f"; smallest effect seen, all factors at once, {size}"
    lost = result.no_pile_analysis.significant() if result.no_pile_analysis is not None else ()
    if lost:
        text += f"; the share of valid pours depends on {', '.join(lost)}"
    if result.not_testable:
        text += f"; not testable: {', '.join(entry.factor for entry in result.not_testable)}"
    if result.selected:
        text += "; going on: " + ", ".join(f"{s.name} ({s.reason})" for s in result.selected)
    return text


def scan_line(result: ScanResult) -> str:
    """One line of what the scan found."""
    pairs = zip(result.values, result.means, strict=True)
    text = f"{result.path}: " + ", ".join(f"{value:g} → {mean:.1f}" for value, mean in pairs)
    return f"{text}; smallest difference seen {_observed(result.observable, result.smallest_difference)}"


def ascent_line(result: AscentResult) -> str:
    """One line of what the ascent found."""
    means = ", ".join(f"{mean:.1f}" for mean in result.means)
    return f"{means}. {result.bracket.statement}"


def surface_line(result: SurfaceResult) -> str:
    """One line of what the surface found."""
    a = result.anova[0]
    return f"R² {a.r_squared:.2f}, adjusted {a.r_squared_adjusted:.2f}, predicted {a.r_squared_predicted:.2f}"


def optimum_line(result: OptimumResult) -> str:
    """One line of what the optimum is."""
    values = ", ".join(f"{path} = {value:.4g}" for path, value in result.values.items())
    return f"{'chosen by rule: ' if result.single.unidentified else ''}{values}. {result.single.statement}"


def verification_line(result: VerificationResult) -> str:
    """One line of what the verification found."""
    test = result.tests[0]
    line = f"{test.statement} Relative error {test.relative_error_percent:.2f} %."
    for target, found in zip(result.targets, result.tests, strict=True):
        if target.before_mean is not None:
            name = target.observable
            errors = [abs(mean - target.mean) for mean in (target.before_mean, found.simulated.mean)]
            before, after = (_observed(name, error) for error in errors)
            line += f" {name} off by {before} before and {after} after."
    return line


LINES: Mapping[str, Callable[[Any], str]] = {
    "pilot": pilot_line,
    "screening": screening_line,
    "assumptions": screening_line,
    "scan": scan_line,
    "ascent": ascent_line,
    "surface": surface_line,
    "optimum": optimum_line,
    "verification": verification_line,
}
"""Stage → its line, from its result or from what there is of it so far."""


def _observed(observable: str, value: float) -> str:
    """A value of an observable; only degrees have a unit that goes without saying."""
    return f"{value:.1f}°" if is_angle(observable) else f"{value:.3g}"
