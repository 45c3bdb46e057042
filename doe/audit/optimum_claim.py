"""The setting that a study claims to give the target, held against the model that it was read from.

Prediction: the model refitted from the printed runs, and the equation as printed, at the claimed setting.
Extrapolation: distance from the centre in coded units against the design's farthest run, and leverage
x'(X'X)⁻¹x against the largest of the runs (Myers, Montgomery and Anderson-Cook 2016, ch. 2: hidden extrapolation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.audit.finding import Figure, Finding, Remark, short
from doe.audit.printed import Printed
from doe.audit.rounding import common_half, halves_of, rounding_slack, values_of
from doe.audit.study import Ascent, Equation, Optimum, SurfaceStudy, Target, Verified
from doe.audit.surface_refit import coefficient_slack, equation_at, refit
from doe.level_set import nearest_points
from doe.surface import Surface, second_order_terms

FloatArray = npt.NDArray[np.float64]
CHECK = "prediction at the claimed optimum"
ON = 1e-6
"""Coded distance within which a setting is on a corner or on a run."""
LEVEL = 0.95


def check_optimum(optimum: Optimum, study: SurfaceStudy, target: Target) -> Iterator[Finding]:
    """Prediction at the claimed optimum, and whether it lies where the design had runs."""
    surface = refit(study)
    point = surface.region.coded(values_of(optimum.values))
    printed = optimum.predicted or target.mean
    yield _by_refit(optimum, study, surface, point, printed)
    if study.equation is not None:
        yield _by_equation(optimum, study, study.equation, point, printed, float(np.sqrt(surface.mse)))
    yield from _extrapolation(optimum, surface, point)
    yield from _where_the_target_is(optimum, surface, point, target)


def check_runs_against_model(
    study: SurfaceStudy, ascent: Ascent | None, optimum: Optimum | None, verified: Verified | None
) -> Iterator[Finding]:
    """Runs outside the design, at settings that the model covers, against its prediction intervals."""
    surface = refit(study)
    if ascent is not None and set(study.screened) <= set(ascent.factors):
        order = [ascent.factors.index(name) for name in study.screened]
        for step, setting, response in zip(ascent.steps, ascent.settings, ascent.responses, strict=True):
            point = surface.region.coded(setting[order])
            if (np.abs(point) <= 1 + ON).all():
                yield from _run_off_the_model(surface, point, response.value, 1, ascent.where, f"step {step}")
    if optimum is not None and verified is not None:
        point = surface.region.coded(values_of(optimum.values))
        values = values_of(verified.responses)
        words = f"the mean of {values.size} runs at the claimed optimum"
        yield from _run_off_the_model(surface, point, float(values.mean()), values.size, verified.where, words)


def _by_refit(optimum: Optimum, study: SurfaceStudy, surface: Surface, point: FloatArray, printed: Printed) -> Figure:
    value, error = float(surface.predict(point)), float(surface.standard_error(point))
    slack = _slack_of_setting(optimum, study, surface.predict)
    of_runs = rounding_slack(
        lambda y: np.array([float(refit(study, y).predict(point))]),
        values_of(study.responses),
        common_half(study.responses),
    )
    slack += float(of_runs[0])
    return Figure(
        CHECK,
        optimum.where,
        "refitted model at the optimum",
        "reproduced" if printed.agrees(value, slack) else "differs",
        printed.text,
        value,
        slack,
        f"second-order fit to {study.where_runs} at {_setting(optimum)}: {value:.1f} ± {error:.1f} (standard error)",
    )


def _by_equation(
    optimum: Optimum, study: SurfaceStudy, equation: Equation, point: FloatArray, printed: Printed, sigma: float
) -> Figure:
    value = float(equation_at(study, equation, point))
    slack = _slack_of_setting(optimum, study, lambda coded: equation_at(study, equation, coded))
    # Rounded coefficients are forgiven up to the noise of one run: beyond it, whoever uses the print is misled.
    slack += min(coefficient_slack(study, equation, point), sigma)
    return Figure(
        CHECK,
        optimum.where,
        f"{equation.where} as printed at the optimum",
        "reproduced" if printed.agrees(value, slack) else "differs",
        printed.text,
        value,
        slack,
        f"{equation.where} with the coefficients as printed at {_setting(optimum)}: {value:.1f}",
    )


def _slack_of_setting(optimum: Optimum, study: SurfaceStudy, predict: Callable[[FloatArray], FloatArray]) -> float:
    """How far the rounding of the printed setting moves a prediction."""
    centre, half = 0.5 * (study.low + study.high), 0.5 * (study.high - study.low)
    slack = rounding_slack(
        lambda x: np.array([float(predict((x - centre) / half))]),
        values_of(optimum.values),
        halves_of(optimum.values),
    )
    return float(slack[0])


def _extrapolation(optimum: Optimum, surface: Surface, point: FloatArray) -> Iterator[Finding]:
    """A remark where the setting lies farther out than any run, by distance or by leverage."""
    terms = second_order_terms(point)
    leverage, highest = float(terms @ surface.information_inverse @ terms), float(surface.leverage.max())
    radius = float(np.linalg.norm(point))
    farthest = float(np.linalg.norm(surface.points, axis=1).max())
    coded = ", ".join(f"{x:+.2f}" for x in point)
    if (np.abs(np.abs(point) - 1) <= ON).all():
        signs = ", ".join("+1" if x > 0 else "−1" for x in point)
        place = f"It is the design's ({signs}) corner"
        run = (np.abs(surface.points - point) <= ON).all(axis=1).any()
        place += ", where the design has a run." if run else ", where the design has no run."
    else:
        place = f"Its coded setting is ({coded})."
    if radius > farthest + ON or leverage > highest + ON:
        yield Remark(
            "extrapolation",
            optimum.where,
            f"{place} Distance from the centre {radius:.2f} against {farthest:.2f} of the farthest run, leverage "
            f"{leverage:.2f} against at most {highest:.2f}: the model is extrapolated there.",
        )


def _where_the_target_is(optimum: Optimum, surface: Surface, point: FloatArray, target: Target) -> Iterator[Finding]:
    """A remark on the nearest setting that gives the target, where the claimed one does not."""
    value = float(surface.predict(point))
    slack = _slack_limit(surface, point)
    if abs(value - target.mean.value) <= slack:
        return
    k = point.size
    found, reached = nearest_points(surface.coefficients[None], target.mean.value, point, np.ones(k))
    if not reached[0]:
        text = f"Nowhere in the design's cube does the refitted model give {target.mean.text}."
    else:
        natural = ", ".join(short(x) for x in surface.region.natural(found[0]))
        text = (
            f"The refitted model gives {target.mean.text} on a whole surface of settings; the nearest to the claimed "
            f"one is ({natural}), coded ({', '.join(f'{x:+.2f}' for x in found[0])})."
        )
    yield Remark(CHECK, optimum.where, text)


def _slack_limit(surface: Surface, point: FloatArray) -> float:
    """Half the 95 % interval of the mean response at a point."""
    return float(stats.t.ppf(0.5 * (1 + LEVEL), surface.df_residual)) * float(surface.standard_error(point))


def _run_off_the_model(
    surface: Surface, point: FloatArray, observed: float, n: int, where: str, words: str
) -> Iterator[Finding]:
    """A remark where the mean of n runs lies outside the model's 95 % prediction interval."""
    predicted, error = float(surface.predict(point)), float(surface.standard_error(point))
    half = float(stats.t.ppf(0.5 * (1 + LEVEL), surface.df_residual)) * float(np.sqrt(surface.mse / n + error**2))
    if abs(observed - predicted) > half:
        coded = ", ".join(f"{x:+.3g}" for x in point)
        yield Remark(
            "runs against the model",
            where,
            f"At ({coded}) the refitted model predicts {predicted:.2f} ± {half:.2f} (95 % for {n} new "
            f"run{'s' if n > 1 else ''}); {words} gave {observed:.2f}.",
        )


def _setting(optimum: Optimum) -> str:
    return f"({', '.join(one.text for one in optimum.values)})"
