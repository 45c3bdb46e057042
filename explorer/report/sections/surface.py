"""The steepest ascent, and the response surface around its crossing of the target: equations, ANOVA, fit."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from doe.analysis.canonical import Canonical
from doe.analysis.named_factors import NameGroup
from doe.analysis.steepest_ascent import Approach
from doe.analysis.surface import Surface
from doe.analysis.surface_anova import AnovaRow, SurfaceAnova
from doe.run_records import sample_of, valid_values
from doe.stages.ascent import AscentResult, TargetWalk
from doe.stages.surface import SurfaceResult
from doe.studies.study import Factor
from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Bullets, Facts, Figure, Folded, Section, Table, Text
from explorer.report.figures.model import FittedTarget, fitted_targets
from explorer.report.figures.pours import ascent_path
from explorer.report.figures.surface import contours, fit
from explorer.units import (
    counted,
    enumeration,
    fixed,
    number,
    observable_label,
    observed,
    p_value,
    parameter_label,
    parameter_range,
    parameter_value,
    percent,
    signed,
    term_text,
    unit_of_observable,
    unit_of_parameter,
)


def ascent(result: StudyResult) -> Section:
    """Steps, means, errors and the bracket."""
    walk = result.ascent
    seen = enumeration([observed(one.observable, one.smallest_difference) for one in walk.walks])
    apart = f"Two steps have to differ by {seen} to be told apart with chance 0.8."
    if walk.approach is None:
        direction = "Direction and steps follow the effects on the target's own observable; base factor"
        blocks: list[Block] = [Text(f"{direction} {walk.path.base}. {walk.bracket.statement} {apart}")]
    else:
        labels = [observable_label(one.observable) for one in walk.walks]
        blocks = [
            Text(
                "The walk leads from the centre to where the screening's first-order models miss all targets "
                f"({enumeration(labels)}) least, in the weighted squares of their standard errors by which the optimum "
                f"is chosen; base factor {walk.path.base}. {walk.approach.words(labels)} {apart}"
            )
        ]
    for place, (one, target) in enumerate(zip(walk.walks, result.study.targets, strict=False), start=1):
        blocks += [
            Figure(
                "ascent" if place == 1 else f"ascent-{place}",
                ascent_path(walk, one, target),
                f"n = {sum(len(valid_values(runs, one.observable)) for runs in walk.runs)} valid pours, one faint "
                "point each; means with 95 % intervals (z) from the pilot’s σ and the number of valid pours of a step; "
                "band: the target and its margin.",
            ),
            _steps(walk, one),
        ]
    if walk.approach is not None:
        blocks.append(_joint_steps(walk, walk.approach))
    notes = (*walk.notes, *(f"Region of the surface, SI units: {note}" for note in walk.region.notes))
    if notes:
        blocks.append(Bullets(notes))
    return Section("Steepest ascent", tuple(blocks))


def _joint_steps(walk: AscentResult, found: Approach) -> Table:
    """By how much each step misses the targets taken together."""
    labels = [f"{observable_label(one.observable)} [standard errors]" for one in walk.walks]
    rows = tuple(
        (str(k + 1), *(signed(missed) for missed in misses), fixed(misfit), fixed(desirable))
        for k, (misses, misfit, desirable) in enumerate(
            zip(found.standardised.T.tolist(), found.misfit.tolist(), found.desirability.tolist(), strict=True)
        )
    )
    caption = (
        "All targets: by how many standard errors of mean and target together a step misses them; misfit: their "
        "squares by weight; desirability: 1 at every target, 0 where one is off by its margin (geometric mean by "
        "weight)."
    )
    return Table(("step", *labels, "misfit J", "desirability"), rows, caption)


def _steps(walk: AscentResult, seen: TargetWalk) -> Table:
    observable, factors = seen.observable, walk.factors
    rows = []
    for k, natural in enumerate(walk.path.natural.tolist()):
        rows.append(
            (
                str(k + 1),
                *(parameter_value(f.path, value) for f, value in zip(factors, natural, strict=True)),
                str(len(valid_values(walk.runs[k], observable))),
                observed(observable, seen.means[k]),
                observed(observable, seen.sd[k]),
                observed(observable, seen.standard_error[k]),
                fixed(seen.relative_error_percent[k]),
            )
        )
    header = (
        "step",
        *(f"{factor.name} {parameter_label(factor.path)}" for factor in factors),
        *("valid pours", "mean", "sd", "standard error", "relative error [%]"),
    )
    return Table(header, tuple(rows), f"{observable_label(observable)}; valid pours only.")


def surface(result: StudyResult) -> Section:
    """Model, ANOVA, equations and charts per target."""
    part, name = result.surface, result.study.designs["surface"]
    blocks: list[Block] = [
        Text(
            f"{name[0].upper()}{name[1:]} design of {len(part.design)} points over "
            f"{counted(len(part.factors), 'factor')}, and the full second-order model by least squares on every valid "
            "pour. The first model sees a change of "
            f"{observed(part.observables[0], part.smallest_main_effect[0])} from the low to the high end of a factor "
            "with chance 0.8."
        ),
        Bullets(tuple(_region(part))),
    ]
    for place, (fitted, canonical) in enumerate(zip(fitted_targets(result), part.canonical, strict=True), start=1):
        blocks += _of_target(place, fitted, canonical)
    blocks.append(Folded("All points of the design", (_points(part),)))
    return Section("Response surface", tuple(blocks))


def equation(model: Surface | NameGroup, factors: Sequence[Factor], observable: str) -> tuple[str, str]:
    """The model as text, coded (x from −1 to +1) and in display units."""
    unit = unit_of_observable(observable)
    terms, scales = _terms([factor.name for factor in factors], [unit_of_parameter(f.path).size for f in factors])
    coded = [unit.of(value) for value in model.coefficients.tolist()]
    actual = [unit.of(value) * scale for value, scale in zip(model.coefficients_natural.tolist(), scales, strict=True)]
    kept = np.flatnonzero(model.included)
    names = [terms[k] for k in kept]
    return _sum([coded[k] for k in kept], names, 4), _sum([actual[k] for k in kept], names, 5)


def anova_table(anova: SurfaceAnova) -> Table:
    """Analysis of variance in the form that published calibrations print."""
    return variance_table(anova.rows, "Partial sums of squares.")


def variance_table(sources: Sequence[AnovaRow], caption: str = "One order after the other.") -> Table:
    """Sources of variation with their tests."""
    rows = tuple(
        (
            term_text(row.source.replace("_", " ")),
            number(row.sum_of_squares, 4),
            str(row.df),
            number(row.mean_square, 4),
            number(row.f),
            p_value(row.p),
        )
        for row in sources
    )
    return Table(("source", "sum of squares", "df", "mean square", "F", "p"), rows, caption)


def _of_target(place: int, fitted: FittedTarget, canonical: Canonical) -> list[Block]:
    anova, observable = fitted.anova, fitted.observable
    coded, actual = equation(fitted.model, fitted.factors, observable)
    symbols = {factor.name: unit_of_parameter(factor.path).symbol for factor in fitted.factors}
    units = [f"{name} in {symbol}" for name, symbol in symbols.items() if symbol]
    name = observable_label(observable)
    blocks: list[Block] = [
        Facts(
            (
                ("Model of", f"{name}; valid pours only"),
                ("R²", f"{fixed(anova.r_squared, 3)}; adjusted {fixed(anova.r_squared_adjusted, 3)}; predicted "
                       f"{fixed(anova.r_squared_predicted, 3)}, by whole points "
                       f"{fixed(anova.r_squared_predicted_by_row, 3)}"),
                ("Scatter", f"σ = {observed(observable, anova.sigma)}, coefficient of variation "
                            f"{percent(anova.cv_percent / 100, 2)}"),
                ("Adequate precision", fixed(anova.adequate_precision)),
                ("Shape", _shape(canonical)),
                ("Equation, coded", f"{coded} (each factor from −1 to +1 over the region)"),
                ("Equation, actual", actual + (f" ({', '.join(units)})" if units else "")),
            )
        )
    ]  # fmt: skip
    n = f"n = {len(fitted.model.observed)} valid pours at {len(fitted.design)} points of the design"
    caption = (
        f"{n}; second-order model by least squares, cut through the optimum; the points of the design are projected on "
        "each panel. Thick line: model = target."
    )
    blocks.append(Figure(f"contours-{place}", contours(fitted), caption))
    blocks.append(Figure(f"fit-{place}", fit(fitted), f"{n}, one mark each; residuals are studentized externally."))
    blocks.append(anova_table(anova))
    if anova.notes:
        blocks.append(Bullets(anova.notes))
    return blocks


def _shape(canonical: Canonical) -> str:
    values = ", ".join(number(value) for value in canonical.eigenvalues)
    if canonical.kind == "ridge":
        return f"ridge without a stationary point (eigenvalues {values} in coded units)"
    place = "inside" if canonical.inside else "outside"
    return f"{canonical.kind}, its stationary point {place} the region (eigenvalues {values} in coded units)"


def _region(part: SurfaceResult) -> list[str]:
    centre, half = part.region.centre.tolist(), part.region.half_width.tolist()
    return [
        f"{factor.name} {parameter_label(factor.path)}: {parameter_range(factor.path, c - h, c + h)} of the screened "
        f"{parameter_range(factor.path, factor.low, factor.high)}"
        for factor, c, h in zip(part.factors, centre, half, strict=True)
    ]


def _points(part: SurfaceResult) -> Table:
    rows = []
    for k, (natural, runs, lost) in enumerate(zip(part.natural.tolist(), part.runs, part.no_pile_share, strict=True)):
        means = []
        for observable in part.observables:
            sample = sample_of(runs, observable)
            means += [observed(observable, sample.mean), observed(observable, sample.sd)]
        settings = (parameter_value(f.path, v) for f, v in zip(part.factors, natural, strict=True))
        valid = sum(run.valid for run in runs)
        rows.append((str(k + 1), *settings, str(valid), *means, percent(lost)))
    measured = [word for name in part.observables for word in (f"mean {observable_label(name)}", "sd")]
    header = ("point", *(factor.name for factor in part.factors), "valid pours", *measured, "not valid")
    return Table(header, tuple(rows))


def _terms(names: list[str], sizes: list[float]) -> tuple[list[str], list[float]]:
    """Term names in the order of the model, and the size of each in SI."""
    pairs = list(combinations(range(len(names)), 2))
    terms = ["", *names, *(f"{names[i]}·{names[j]}" for i, j in pairs), *(f"{name}²" for name in names)]
    return terms, [1.0, *sizes, *(sizes[i] * sizes[j] for i, j in pairs), *(size**2 for size in sizes)]


def _sum(coefficients: list[float], terms: list[str], digits: int) -> str:
    text = number(coefficients[0], digits)
    for value, term in zip(coefficients[1:], terms[1:], strict=True):
        text += f" {'−' if value < 0 else '+'} {number(abs(value), digits)} {term}"
    return text
