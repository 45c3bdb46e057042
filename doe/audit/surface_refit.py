"""A published response surface refitted from its printed runs: analysis of variance, statistics, equation.

Every refitted number carries the slack that the rounding of the printed responses gives it. The printed equation is
also put to work: rounded coefficients of large natural values can miss the design's own runs.

The setting that a study claims to give the target is held against the model that it was read from.
Prediction: the model refitted from the printed runs, and the equation as printed, at the claimed setting.
Extrapolation: distance from the centre in coded units against the design's farthest run, and leverage
x'(X'X)⁻¹x against the largest of the runs (Myers, Montgomery and Anderson-Cook 2016, ch. 2: hidden extrapolation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations
from typing import cast

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.level_set import nearest_points
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import Surface, fit_surface, second_order_terms, term_names
from doe.analysis.surface_anova import AnovaRow, SurfaceAnova, analyse_surface
from doe.audit.finding import Figure, Finding, Remark, compared, short, unchecked
from doe.audit.printed import Printed, common_half, halves_of, rounding_slack, values_of
from doe.audit.study import Ascent, Equation, Optimum, SurfaceStudy, Target, Verified

FloatArray = npt.NDArray[np.float64]

COLUMNS: dict[str, tuple[str, Callable[[AnovaRow], float]]] = {
    "sum_of_squares": ("sum of squares", lambda row: row.sum_of_squares),
    "df": ("degrees of freedom", lambda row: float(row.df)),
    "mean_square": ("mean square", lambda row: row.mean_square),
    "f": ("F", lambda row: row.f),
    "p": ("p", lambda row: row.p),
}
STATISTICS: dict[str, tuple[str, Callable[[SurfaceAnova], float]]] = {
    "r_squared": ("R²", lambda anova: anova.r_squared),
    "r_squared_adjusted": ("adjusted R²", lambda anova: anova.r_squared_adjusted),
    "r_squared_predicted": ("predicted R²", lambda anova: anova.r_squared_predicted),
    "cv_percent": ("coefficient of variation [%]", lambda anova: anova.cv_percent),
    "adequate_precision": ("adequate precision", lambda anova: anova.adequate_precision),
    "sigma": ("residual standard deviation", lambda anova: anova.sigma),
}
"""Key of a study file → words, and the same number of a refit."""
PREDICTION = "prediction at the claimed optimum"
ON = 1e-6
"""Coded distance within which a setting is on a corner or on a run."""
LEVEL = 0.95


def check_surface(study: SurfaceStudy) -> Iterator[Finding]:
    """All printed figures about a second-order fit, and what its printed equation gives at the design's own runs."""
    yield from _anova(study)
    yield from _adding_up(study)
    yield from _statistics(study)
    if study.equation is not None:
        yield from _coefficients(study, study.equation)
        yield from _own_runs(study, study.equation)


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


def refit(study: SurfaceStudy, responses: FloatArray | None = None) -> Surface:
    """The full second-order model fitted to the printed runs, or to others on the same design.

    Raises StatisticsError where the runs cannot separate its terms.
    """
    region = Region(study.factors, 0.5 * (study.low + study.high), 0.5 * (study.high - study.low), ())
    values = values_of(study.responses) if responses is None else responses
    return fit_surface(study.coded, values[:, None], region)


def equation_terms(equation: Equation, factors: tuple[str, ...]) -> FloatArray:
    """Coefficients of a printed equation in the order of `doe.analysis.surface`; a term that is not printed is zero."""
    names = ("1", *term_names(factors)[1:])
    return np.array([equation.coefficients[name].value if name in equation.coefficients else 0.0 for name in names])


def equation_at(study: SurfaceStudy, equation: Equation, coded: FloatArray) -> FloatArray:
    """The printed equation at coded points, shape (..., k) -> (...)."""
    centre, half = 0.5 * (study.low + study.high), 0.5 * (study.high - study.low)
    points = coded if equation.coded else centre + coded * half
    return np.asarray(second_order_terms(points) @ equation_terms(equation, study.factors))


def coefficient_slack(study: SurfaceStudy, equation: Equation, coded: FloatArray) -> float:
    """How far the rounding of the printed coefficients can move the equation at one coded point."""
    weights = _weights(study, equation, coded)
    total, root = sum(weights.values()), float(np.sqrt(3 * sum(weight**2 for weight in weights.values())))
    return min(total, root)


def source_name(text: str, factors: tuple[str, ...]) -> str:
    """The source of a printed line as our own table names it: "X1X2", "X1 × X2" → "X1*X2"; "X1²" → "X1^2"."""
    plain = text.strip().replace("²", "^2")
    known = {name: name for name in term_names(factors)[1:]}
    for a, b in combinations(factors, 2):
        known |= {form.format(a, b): f"{a}*{b}" for form in ("{}{}", "{}·{}", "{} × {}", "{}×{}", "{}:{}", "{} {}")}
    known |= {f"{name}*{name}": f"{name}^2" for name in factors}
    words = plain.lower().replace(" ", "_").replace("-", "_")
    return known.get(plain, {"sum": "total", "cor_total": "total", "error": "pure_error"}.get(words, words))


def _analysed(study: SurfaceStudy, responses: FloatArray | None = None) -> SurfaceAnova:
    """The analysis of variance of a refit; what a run that nothing can replace leaves undefined is NaN or infinite."""
    return analyse_surface(refit(study, responses))


def _anova(study: SurfaceStudy) -> Iterator[Finding]:
    """Every printed cell against the refit's."""
    cells: list[tuple[str, str, Printed]] = []
    for line in study.anova:
        source = source_name(line.source, study.factors)
        cells += [(source, column, cast(Printed, getattr(line, column))) for column in COLUMNS if getattr(line, column)]
    fitted = {row.source: row for row in _analysed(study).rows}
    known = [(source, column, cell) for source, column, cell in cells if source in fitted]

    def recomputed(responses: FloatArray) -> FloatArray:
        rows = {row.source: row for row in _analysed(study, responses).rows}
        return np.array([COLUMNS[column][1](rows[source]) for source, column, _ in known])

    values, slack = _with_slack(study, recomputed)
    check, how = "analysis of variance from the runs", f"second-order fit to {study.where_runs}"
    for k, (source, column, cell) in enumerate(known):
        quantity = f"{COLUMNS[column][0]} of {source}"
        if not np.isfinite(values[k]):
            yield unchecked(check, study.where_anova, quantity, "the refit tests this line against nothing", cell.text)
        else:
            yield compared(check, study.where_anova, quantity, cell, float(values[k]), how, float(slack[k]))
    for source in dict.fromkeys(source for source, _, _ in cells if source not in fitted):
        yield unchecked(check, study.where_anova, source, "the full second-order model has no such line")


def _adding_up(study: SurfaceStudy) -> Iterator[Finding]:
    """Printed sums of squares and degrees of freedom of the parts against their printed wholes."""
    lines = {source_name(line.source, study.factors): line for line in study.anova}
    for whole, parts in (("total", ("model", "residual")), ("residual", ("lack_of_fit", "pure_error"))):
        if not {whole, *parts} <= lines.keys():
            continue
        for column in ("sum_of_squares", "df"):
            prints = [cast(Printed | None, getattr(lines[name], column)) for name in (*parts, whole)]
            if None in prints:
                continue
            *of_parts, of_whole = cast(list[Printed], prints)
            value = sum(one.value for one in of_parts)
            slack = float(np.sqrt(3 * (halves_of(of_parts) ** 2).sum())) if column != "df" else 0.0
            how = f"sum of {' and '.join(parts)} as printed"
            quantity = f"{COLUMNS[column][0]} of {whole}"
            yield compared("sums of squares add up", study.where_anova, quantity, of_whole, value, how, slack)


def _statistics(study: SurfaceStudy) -> Iterator[Finding]:
    names = [name for name in STATISTICS if name in study.statistics]
    if not names:
        return

    def recomputed(responses: FloatArray) -> FloatArray:
        anova = _analysed(study, responses)
        return np.array([STATISTICS[name][1](anova) for name in names])

    values, slack = _with_slack(study, recomputed)
    how = f"second-order fit to {study.where_runs}"
    for k, name in enumerate(names):
        print_, words = study.statistics[name], STATISTICS[name][0]
        check, where = "statistics of the fit", study.where_statistics
        if np.isfinite(values[k]):
            yield compared(check, where, words, print_, float(values[k]), how, float(slack[k]))
        else:
            yield unchecked(check, where, words, "the refit cannot do without one of the runs", print_.text)


def _coefficients(study: SurfaceStudy, equation: Equation) -> Iterator[Finding]:
    names = ("1", *term_names(study.factors)[1:])
    printed = {name: k for k, name in enumerate(names) if name in equation.coefficients}

    def recomputed(responses: FloatArray) -> FloatArray:
        surface = refit(study, responses)
        return surface.coefficients if equation.coded else surface.coefficients_natural

    values, slack = _with_slack(study, recomputed)
    how = f"second-order fit to {study.where_runs} in {'coded' if equation.coded else 'natural'} units"
    for name, k in printed.items():
        quantity = "constant" if name == "1" else f"coefficient of {name}"
        cell = equation.coefficients[name]
        yield compared("printed equation", equation.where, quantity, cell, float(values[k]), how, float(slack[k]))


def _own_runs(study: SurfaceStudy, equation: Equation) -> Iterator[Finding]:
    """The printed equation against the refit at the design's centre and where it is farthest off.

    A miss counts from one residual sigma on: beyond it, whoever uses the print is misled by more than a run's noise.
    """
    surface = refit(study)
    points = np.unique(study.coded, axis=0)
    off = equation_at(study, equation, points) - surface.predict(points)
    worst = int(np.abs(off).argmax())
    sigma = float(np.sqrt(surface.mse))
    centre = [k for k in range(len(points)) if not points[k].any() and k != worst]
    for k in (*centre, worst):
        yield _own_run(study, equation, surface, points[k], sigma)
    miss = abs(float(off[worst]))
    if miss > sigma and coefficient_slack(study, equation, points[worst]) > miss / 2:
        yield _culprit(study, equation)


def _own_run(study: SurfaceStudy, equation: Equation, surface: Surface, point: FloatArray, sigma: float) -> Figure:
    given, model = float(equation_at(study, equation, point)), float(surface.predict(point))
    runs = (study.coded == point).all(axis=1)
    observed = float(values_of(study.responses)[runs].mean())
    return Figure(
        "printed equation at the design's own runs",
        equation.where,
        f"response at ({', '.join(f'{x:+g}' if x else '0' for x in point)})",
        "differs" if abs(given - model) > sigma else "reproduced",
        short(given),
        model,
        sigma,
        f"as printed it gives {short(given)}, its own unrounded fit {short(model)}; the runs there have the mean "
        f"{short(observed)}, residual σ {short(sigma, 2)}",
    )


def _culprit(study: SurfaceStudy, equation: Equation) -> Remark:
    """The coefficient whose last printed digit moves the response most."""
    weights = _weights(study, equation, np.zeros(len(study.factors)))
    worst = max(weights, key=lambda name: weights[name])
    cell = equation.coefficients[worst]
    return Remark(
        "printed equation at the design's own runs",
        equation.where,
        f"The rounding of its coefficients alone moves the equation: half a unit in the last digit of "
        f"{cell.text} ({worst}) is ± {weights[worst]:.2g} at the centre of the design.",
    )


def _weights(study: SurfaceStudy, equation: Equation, coded: FloatArray) -> dict[str, float]:
    """Term → what half a unit in the last digit of its coefficient is worth at a coded point."""
    names = ("1", *term_names(study.factors)[1:])
    natural = 0.5 * (study.low + study.high) + coded * 0.5 * (study.high - study.low)
    terms = np.abs(second_order_terms(coded if equation.coded else natural))
    return {
        name: equation.coefficients[name].half * float(terms[k])
        for k, name in enumerate(names)
        if name in equation.coefficients
    }


def _with_slack(study: SurfaceStudy, compute: Callable[[FloatArray], FloatArray]) -> tuple[FloatArray, FloatArray]:
    values = values_of(study.responses)
    return compute(values), rounding_slack(compute, values, common_half(study.responses))


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
        PREDICTION,
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
        PREDICTION,
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
    yield Remark(PREDICTION, optimum.where, text)


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
