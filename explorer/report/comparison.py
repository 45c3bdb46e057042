"""Two studies side by side: what was asked, what each found, and the effects of the factors of either."""

from __future__ import annotations

import math

from doe.studies.study_result import StudyResult
from explorer.report.content import Table
from explorer.report.identified import settings
from explorer.units import (
    MISSING,
    enumeration,
    fixed,
    observable_label,
    observed,
    observed_number,
    parameter_label,
    unit_of_observable,
    with_sign,
)

EFFECTS_SHOWN = 12


def comparison(one: StudyResult, other: StudyResult, names: tuple[str, str]) -> tuple[Table, Table, Table]:
    """Tables of findings, of what the target says about each factor, and of effects with 95 % intervals."""
    return _findings(one, other, names), _optima(one, other, names), _effects(one, other, names)


def _findings(one: StudyResult, other: StudyResult, names: tuple[str, str]) -> Table:
    both = (one, other)
    observables = list(dict.fromkeys(target.observable for result in both for target in result.study.targets))
    rows = [
        ("study, profile", *(f"{r.study.name}, {r.study.profile.name}" for r in both)),
        ("pours", *(f"{r.runs.total}, {r.runs.valid} valid" for r in both)),
        ("significant (Holm)", *(enumeration(r.screening.analysis.significant()) for r in both)),
    ]
    for observable in observables:
        found = [_of_target(result, observable) for result in both]
        of = f"{observable_label(observable)}: " if len(observables) > 1 else ""
        rows += [
            (f"{of}{title}", *(cells.get(title, MISSING) for cells in found))
            for title in dict.fromkeys(title for cells in found for title in cells)
        ]
    return Table(("", *names), tuple(rows), "95 % intervals.")


def _of_target(result: StudyResult, observable: str) -> dict[str, str]:
    """Title → what ``result`` says about its target ``observable``; empty if it has no such target."""
    order = [target.observable for target in result.study.targets]
    if observable not in order:
        return {}
    k = order.index(observable)
    target, anova, test = result.study.targets[k], result.surface.anova[k], result.verification.tests[k]
    noise, sample, unit = result.pilot.noise.get(observable), test.simulated, unit_of_observable(observable)
    cells = {
        "target": f"{observable_label(observable)} {observed(observable, target.mean)}, margin "
        f"{observed(observable, target.margin)}",
        "σ of one pour": MISSING if noise is None else observed(observable, noise.sigma),
        "R², predicted R²": f"{fixed(anova.r_squared)}, {fixed(anova.r_squared_predicted)}",
    }
    compromise, single = result.optimum.compromise, result.optimum.single
    if compromise is not None:
        cells["predicted at the optimum"] = observed(observable, float(compromise.predicted[k]))
    else:
        ends = " … ".join(observed(observable, end) for end in (single.predicted_low, single.predicted_high))
        cells["predicted at the optimum"] = f"{observed(observable, single.predicted)} ({ends})"
    cells["better than noise"] = "yes" if anova.better_than_noise else "no"
    cells["verification"] = (
        f"{observed(observable, sample.mean)} ± {observed(observable, sample.sd)} (sd), {sample.n} pours"
    )
    if test.deciding is not None:
        middle, low, high = (
            with_sign(observed_number(observable, value))
            for value in (test.deciding.difference, test.deciding.low, test.deciding.high)
        )
        cells["difference from the target"] = f"{unit.attach(middle)} ({low} … {high})"
    return cells | {"verdict": test.verdict}


def _optima(one: StudyResult, other: StudyResult, names: tuple[str, str]) -> Table:
    found = [_optimum(result) for result in (one, other)]
    order = list(dict.fromkeys(path for cells in found for path in cells))
    rows = tuple((parameter_label(path), *(cells.get(path, MISSING) for cells in found)) for path in order)
    caption = (
        "Value, in brackets its 95 % set; where the target does not identify it, the range that gives the target, in "
        "brackets the value chosen by rule."
    )
    return Table(("optimum", *names), rows, caption)


def _effects(one: StudyResult, other: StudyResult, names: tuple[str, str]) -> Table:
    found = [_effects_of(result) for result in (one, other)]
    size = {path: max(abs(cells[path][0]) for cells in found if path in cells) for cells in found for path in cells}
    order = sorted(size, key=lambda path: -size[path])[:EFFECTS_SHOWN]
    rows = tuple(
        (parameter_label(path), *(cells[path][1] if path in cells else MISSING for cells in found)) for path in order
    )
    caption = "Low → high, each over its own range, which may differ between the two; the largest ones."
    return Table(("effect", *names), rows, caption)


def _optimum(result: StudyResult) -> dict[str, str]:
    pairs = zip(result.optimum.factors, settings(result.optimum), strict=True)
    return {factor.path: setting.answer for factor, setting in pairs}


def _effects_of(result: StudyResult) -> dict[str, tuple[float, str]]:
    """Path → (effect, effect with its interval)."""
    part = result.screening
    paths = {f.name: f.path for f in part.factors}
    found = {}
    for effect in part.analysis.factor_effects():
        half = part.analysis.half_width(effect)
        text = with_sign(observed(part.response, effect.effect))
        text += "" if math.isnan(half) else f" ± {observed_number(part.response, half)}"
        found[paths[effect.name]] = (effect.effect, text)
    return found
