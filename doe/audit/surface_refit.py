"""A published response surface refitted from its printed runs: analysis of variance, statistics, equation.

The model has the terms that the table names. What is recomputed is held against the print as it is first. Only what
differs then gets the slack of responses that were rounded, the worst case over the box around their prints, and says
so. Of each figure of the analysis of variance the others of its table are asked before the runs (`anova_table.py`).
The printed equation is also put to work: rounded coefficients of large natural values can miss the design's own runs.

The setting that a study claims to give the target is held against the model that it was read from.
Prediction: the model refitted from the printed runs, and the equation as printed, at the claimed setting.
Extrapolation: distance from the centre in coded units against the design's farthest run, and leverage
x'(X'X)⁻¹x against the largest of the runs (Myers, Montgomery and Anderson-Cook 2016, ch. 2: hidden extrapolation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import isfinite
from typing import cast

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.level_set import nearest_points
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import Surface, fit_surface, second_order_terms, term_names
from doe.audit.anova_table import (
    WORDS,
    Cell,
    Column,
    Judged,
    Line,
    Role,
    consistency,
    named_terms,
    read_lines,
    require_degrees,
)
from doe.audit.finding import Figure, Finding, Remark, Status, compared, short, unchecked, within
from doe.audit.printed import Printed, common_half, halves_of, printed, rounding_slack, values_of, worst_case
from doe.audit.study import Ascent, Equation, Optimum, SurfaceStudy, Target, Verified
from doe.audit.table_refit import KINDS, Bounded, TableRefit
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]

STATISTICS = {
    "r_squared": "R²",
    "r_squared_adjusted": "adjusted R²",
    "r_squared_predicted": "predicted R²",
    "cv_percent": "coefficient of variation [%]",
    "adequate_precision": "adequate precision",
    "sigma": "residual standard deviation",
}
"""Key of a study file → words."""
BY_ITSELF, FROM_RUNS = "analysis of variance in itself", "analysis of variance from the runs"
PREDICTION = "prediction at the claimed optimum"
ON = 1e-6
"""Coded distance within which a setting is on a corner or on a run."""
LEVEL = 0.95
AXIAL = 0.005
"""How far two decimals move a coded distance."""


def check_surface(study: SurfaceStudy) -> Iterator[Finding]:
    """All printed figures about a fit, and what its printed equation gives at the design's own runs.

    The figures of the analysis of variance are held against one another first, which needs no runs. Axial points that
    are printed with few digits (1.68) count as what they are rounded from (2^(3/4)) if more follows from that.
    """
    found, design = list(_checked(study)), _unrounded_axes(study)
    if design is not None:
        other = list(_checked(replace(study, coded=design)))
        if _misses(other) < _misses(found):
            axes = f"axial points at ± {float(np.abs(design).max()):.4f}; {study.where_runs} prints fewer digits"
            found = [*other, Remark(FROM_RUNS, study.where_anova, f"Its figures follow from {axes}.")]
    yield from found


def _misses(found: list[Finding]) -> tuple[int, int]:
    """How many figures differ, and how many come out only with a slack."""
    statuses = [one.status for one in found if isinstance(one, Figure)]
    return statuses.count("differs"), statuses.count("only if rounded")


def _unrounded_axes(study: SurfaceStudy) -> FloatArray | None:
    """The design with the distance of a rotatable or spherical one, where its own is that but for the rounding."""
    outside = np.abs(study.coded) > 1 + AXIAL
    if not outside.any():
        return None
    k = len(study.factors)
    known = [2.0 ** (corners / 4) for corners in range(2, k + 1)] + [k**0.5]
    for distance in known:
        off = np.abs(np.abs(study.coded[outside]) - distance)
        if 0 < off.max() <= AXIAL:
            return np.where(outside, np.sign(study.coded) * distance, study.coded)
    return None


def _checked(study: SurfaceStudy) -> Iterator[Finding]:
    lines = read_lines(study.anova, study.factors)
    judged, error = consistency(lines)
    try:
        fit = TableRefit(refit(study), _half(study))
    except StatisticsError as why:
        yield from _without_refit(study, lines, judged, str(why))
        return
    yield from _anova(study, fit, lines, judged, error)
    yield from _adding_up(study, lines)
    yield from _statistics(study, fit)
    if study.equation is not None:
        yield from _coefficients(study, study.equation)
        yield from _own_runs(study, study.equation)


def check_optimum(optimum: Optimum, study: SurfaceStudy, target: Target | None) -> Iterator[Finding]:
    """Prediction at the claimed optimum, and whether it lies where the design had runs."""
    surface = refit(study)
    point = surface.region.coded(values_of(optimum.values))
    printed = optimum.predicted if target is None else optimum.predicted or target.mean
    if printed is None:
        yield unchecked(PREDICTION, optimum.where, "response", "neither a prediction nor a target is stated")
    else:
        yield _by_refit(optimum, study, surface, point, printed)
        if study.equation is not None:
            yield _by_equation(optimum, study, study.equation, point, printed, float(np.sqrt(surface.mse)))
    yield from _extrapolation(optimum, surface, point)
    if target is not None:
        yield from _where_the_target_is(optimum, surface, point, target)


def check_runs_against_model(
    study: SurfaceStudy, ascent: Ascent | None, optimum: Optimum | None, verified: Verified | None
) -> Iterator[Finding]:
    """Runs outside the design, at settings that the model covers, against its prediction intervals."""
    try:
        surface = refit(study)
    except StatisticsError:
        return  # `check_surface` has said why
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


def refit(study: SurfaceStudy, responses: FloatArray | None = None, terms: tuple[str, ...] | None = None) -> Surface:
    """The model of the study (or these terms) fitted to the printed runs, or to others on the same design.

    Its terms are those that the analysis of variance names; where it names none those of the printed equation, and
    without one all of second order. Raises StatisticsError where there are no runs, where the runs cannot separate the
    terms, or where the printed degrees of freedom are not those of such a model.
    """
    if not study.responses:
        raise StatisticsError("the runs are not printed")
    lines = read_lines(study.anova, study.factors)
    equation = () if study.equation is None else _terms_of(study.equation)
    model = terms or named_terms(lines) or equation or term_names(study.factors)[1:]
    region = Region(study.factors, 0.5 * (study.low + study.high), 0.5 * (study.high - study.low), ())
    values = values_of(study.responses) if responses is None else responses
    surface = fit_surface(study.coded, values[:, None], region, model)
    if terms is None:
        require_degrees(lines, model, study.factors, values.size)
    return surface


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


def _half(study: SurfaceStudy) -> float:
    """Half a unit of the last digit of the responses: the finest one, because trailing zeros get lost."""
    return float(common_half(study.responses)[0])


def _rounded(study: SurfaceStudy) -> str:
    """What has to have been rounded where a refit gives the print only so."""
    return f"responses were rounded by up to ± {_half(study):g}"


def _terms_of(equation: Equation) -> tuple[str, ...]:
    return tuple(name for name in equation.coefficients if name != "1")


def _fit_words(study: SurfaceStudy, surface: Surface) -> str:
    """The model in words."""
    terms = [name for name, there in zip(surface.terms[1:], surface.included[1:], strict=True) if there]
    model = "second-order fit" if surface.included.all() else f"fit of {', '.join(terms)}"
    return f"{model} to {study.where_runs}"


def _cells(lines: tuple[Line, ...]) -> list[tuple[Cell, Printed]]:
    """All printed figures of a table."""
    cells = (((k, column), line.cell(column)) for k, line in enumerate(lines) for column in WORDS)
    return [(at, cell) for at, cell in cells if cell is not None]


def _named(lines: tuple[Line, ...], at: Cell) -> str:
    return f"{WORDS[at[1]]} of {lines[at[0]].source}"


def _against_itself(study: SurfaceStudy, lines: tuple[Line, ...], at: Cell, cell: Printed, by: Judged) -> Figure:
    """A figure against others of its table."""
    low, high = by.interval
    how = f"{by.how}, which allow {short(low, 5)} … {short(high, 5)}"
    found = within(BY_ITSELF, study.where_anova, _named(lines, at), cell, by.value, by.interval, how)
    if by.agrees:
        return replace(found, status="reproduced exactly")
    # Some programs, and people, cut a figure off or round it up: less than a whole unit of the last digit is no fault.
    if replace(cell, half=2.0 * cell.half).meets(by.interval):
        return replace(
            found, status="only if rounded", how=f"{how}; only if it was cut off or rounded up at its last digit"
        )
    return replace(found, status="differs")


def _anova(
    study: SurfaceStudy, fit: TableRefit, lines: tuple[Line, ...], judged: dict[Cell, Judged], error: Role
) -> Iterator[Finding]:
    """Every printed figure: against the others of its table, then against the runs, then against rounded runs."""
    cells = dict(_cells(lines))
    broken = {at for at in cells if at in judged and not judged[at].agrees}
    kind, rows = _kind(fit, lines, {at: cell for at, cell in cells.items() if at not in broken}, error)
    refitted = {at: rows[at[0]][at[1]] for at in cells if at[1] in rows[at[0]] and isfinite(rows[at[0]][at[1]].value)}
    exact = {at for at, value in refitted.items() if cells[at].agrees(value.value)}
    # Where figures exclude each other, runs that give one of them exactly say that the other is wrong.
    wrong = {at for at in broken if at not in exact}
    for k, column in broken & exact:
        wrong |= {at for at in ((k, name) for name in judged[k, column].partners) if at in cells and at not in exact}
    how = _fit_words(study, fit.surface) + ("" if kind == "partial" else f", {KINDS[kind]}")
    lost: dict[int, str] = {}
    for at, cell in cells.items():
        if at in wrong and at in broken:
            yield _against_itself(study, lines, at, cell, judged[at])
        elif _misfit(fit, lines[at[0]]) or at not in refitted:
            if at in judged:
                yield _against_itself(study, lines, at, cell, judged[at])
            elif rows[at[0]].get(at[1]) is not None:
                why = "the refit tests this line against nothing"
                yield unchecked(FROM_RUNS, study.where_anova, _named(lines, at), why, cell.text)
            else:
                lost[at[0]] = _misfit(fit, lines[at[0]]) or "the model has no such line"
        else:
            value = refitted[at]
            slack = 0.0 if at in wrong else _within(cell, value)
            quantity = _named(lines, at)
            yield compared(FROM_RUNS, study.where_anova, quantity, cell, value.value, how, slack, _rounded(study))
    for k, why in lost.items():
        yield unchecked(FROM_RUNS, study.where_anova, lines[k].source, why)
    if kind != "partial":
        yield Remark(
            FROM_RUNS, study.where_anova, f"Its lines are {KINDS[kind]}: these are the ones that the runs give."
        )


def _within(cell: Printed, value: Bounded) -> float:
    """The slack of a recomputed number on the side of the print, which is what counts where the other is wider."""
    low, high = value.interval
    side = high - value.value if cell.value > value.value else value.value - low
    return side if isfinite(side) else value.slack


def _kind(
    fit: TableRefit, lines: tuple[Line, ...], cells: dict[Cell, Printed], error: Role
) -> tuple[str, list[dict[Column, Bounded]]]:
    """How the sums of squares were taken: the first kind that gives most figures exactly, then within rounding."""
    order = named_terms(lines)
    if not order:
        return "partial", fit.rows(lines, order, "partial", error)
    tried = {kind: fit.rows(lines, order, kind, error) for kind in KINDS}

    def right(kind: str) -> tuple[int, int]:
        pairs = [(cell, tried[kind][k][column]) for (k, column), cell in cells.items() if column in tried[kind][k]]
        exact = sum(cell.agrees(value.value) for cell, value in pairs)
        return sum(cell.agrees(value.value, _within(cell, value)) for cell, value in pairs), exact

    best = max(tried, key=right)
    return best, tried[best]


def _misfit(fit: TableRefit, line: Line) -> str:
    """Why a lack of fit or pure error cannot be checked; "" where it can."""
    df = fit.degrees(line.role)
    if line.role not in ("lack_of_fit", "pure_error") or line.df is None or line.df == df:
        return ""
    return f"its {line.df:g} degrees of freedom are not those of the replicates in the runs, {df}"


def _without_refit(
    study: SurfaceStudy, lines: tuple[Line, ...], judged: dict[Cell, Judged], why: str
) -> Iterator[Finding]:
    """What a table says of itself, and how many of its figures would need the runs."""
    cells = _cells(lines)
    for at, cell in cells:
        if at in judged:
            yield _against_itself(study, lines, at, cell, judged[at])
    left = sum(at not in judged for at, _ in cells)
    if left:
        yield unchecked(FROM_RUNS, study.where_anova, f"{left} figures that only the runs can give", why)
    yield from _adding_up(study, lines)
    for name, cell in study.statistics.items():
        yield unchecked("statistics of the fit", study.where_statistics, STATISTICS[name], why, cell.text)
    if study.equation is not None:
        quantity = f"{len(study.equation.coefficients)} coefficients"
        yield unchecked("printed equation", study.equation.where, quantity, why)


def _adding_up(study: SurfaceStudy, lines: tuple[Line, ...]) -> Iterator[Finding]:
    """Printed sums of squares and degrees of freedom of the parts against their printed wholes."""
    known = {line.source: line for line in reversed(lines)}
    columns: tuple[Column, ...] = ("sum_of_squares", "df")
    for whole, parts in (("total", ("model", "residual")), ("residual", ("lack_of_fit", "pure_error"))):
        if not {whole, *parts} <= known.keys():
            continue
        for column in columns:
            prints = [known[name].cell(column) for name in (*parts, whole)]
            if None in prints:
                continue
            *of_parts, of_whole = cast(list[Printed], prints)
            value = sum(one.value for one in of_parts)
            slack = float(halves_of(of_parts).sum()) if column != "df" else 0.0
            how, quantity = f"sum of {' and '.join(parts)} as printed", f"{WORDS[column]} of {whole}"
            interval = value - slack, value + slack
            yield within("sums of squares add up", study.where_anova, quantity, of_whole, value, interval, how)


def _statistics(study: SurfaceStudy, fit: TableRefit) -> Iterator[Finding]:
    names = [name for name in STATISTICS if name in study.statistics]
    found = fit.statistics() if names else {}
    how, check, where = _fit_words(study, fit.surface), "statistics of the fit", study.where_statistics
    for name in names:
        cell, value = study.statistics[name], found[name]
        if isfinite(value.value):
            slack = _within(cell, value)
            yield compared(check, where, STATISTICS[name], cell, value.value, how, slack, _rounded(study))
        else:
            yield unchecked(check, where, STATISTICS[name], "the refit cannot do without one of the runs", cell.text)


def _coefficients(study: SurfaceStudy, equation: Equation) -> Iterator[Finding]:
    """Every coefficient by the model of the analysis of variance or, if they fit it better, by its own terms alone."""
    names = ("1", *term_names(study.factors)[1:])
    printed = {name: k for k, name in enumerate(names) if name in equation.coefficients}
    candidates = [_equation_figures(study, equation, printed, None)]
    if any(figure.status == "differs" for figure in candidates[0]) and _terms_of(equation):
        candidates.append(_equation_figures(study, equation, printed, _terms_of(equation)))
    yield from min(candidates, key=lambda figures: sum(figure.status == "differs" for figure in figures))


def _equation_figures(
    study: SurfaceStudy, equation: Equation, printed: dict[str, int], terms: tuple[str, ...] | None
) -> list[Figure]:
    def recomputed(responses: FloatArray) -> FloatArray:
        surface = refit(study, responses, terms)
        return surface.coefficients if equation.coded else surface.coefficients_natural

    values = values_of(study.responses)
    found, slack = recomputed(values), worst_case(recomputed, values, common_half(study.responses))
    how = f"{_fit_words(study, refit(study, None, terms))} in {'coded' if equation.coded else 'natural'} units"
    return [
        compared(
            "printed equation",
            equation.where,
            "constant" if name == "1" else f"coefficient of {name}",
            equation.coefficients[name],
            float(found[k]),
            how,
            float(slack[k]),
            _rounded(study),
        )
        for name, k in printed.items()
    ]


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
    same: Status = "reproduced exactly" if printed(short(given)).agrees(model) else "only if rounded"
    return Figure(
        "printed equation at the design's own runs",
        equation.where,
        f"response at ({', '.join(f'{x:+g}' if x else '0' for x in point)})",
        "differs" if abs(given - model) > sigma else same,
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


def _by_refit(optimum: Optimum, study: SurfaceStudy, surface: Surface, point: FloatArray, printed: Printed) -> Figure:
    value, error = float(surface.predict(point)), float(surface.standard_error(point))
    slack = _slack_of_setting(optimum, study, surface.predict)
    of_runs = worst_case(
        lambda y: np.array([float(refit(study, y).predict(point))]),
        values_of(study.responses),
        common_half(study.responses),
    )
    slack += float(of_runs[0])
    how = f"{_fit_words(study, surface)} at {_setting(optimum)}: {value:.1f} ± {error:.1f} (standard error)"
    rounded = "responses and setting were rounded"
    return compared(PREDICTION, optimum.where, "refitted model at the optimum", printed, value, how, slack, rounded)


def _by_equation(
    optimum: Optimum, study: SurfaceStudy, equation: Equation, point: FloatArray, printed: Printed, sigma: float
) -> Figure:
    value = float(equation_at(study, equation, point))
    slack = _slack_of_setting(optimum, study, lambda coded: equation_at(study, equation, coded))
    # Rounded coefficients are forgiven up to the noise of one run: beyond it, whoever uses the print is misled.
    slack += min(coefficient_slack(study, equation, point), sigma)
    how = f"{equation.where} with the coefficients as printed at {_setting(optimum)}: {value:.1f}"
    rounded, quantity = "coefficients and setting were rounded", f"{equation.where} as printed at the optimum"
    return compared(PREDICTION, optimum.where, quantity, printed, value, how, slack, rounded)


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
