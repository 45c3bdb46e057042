"""Two studies side by side: what was asked, what each found, and the effects of the factors that either has."""

from __future__ import annotations

import math
from collections.abc import Callable

from doe.studies.study_result import StudyResult
from explorer.report.content import Table
from explorer.report.identified import settings
from explorer.units import (
    MISSING,
    enumeration,
    fixed,
    observable_label,
    observed,
    parameter_label,
    signed,
    unit_of_observable,
)

EFFECTS_SHOWN = 12
Cell = Callable[[StudyResult], str]


def comparison(one: StudyResult, other: StudyResult, names: tuple[str, str]) -> tuple[Table, Table, Table]:
    """Tables of findings, of what the target says of each factor, and of effects with 95 % intervals."""
    return _findings(one, other, names), _optima(one, other, names), _effects(one, other, names)


def _findings(one: StudyResult, other: StudyResult, names: tuple[str, str]) -> Table:
    rows: tuple[tuple[str, Cell], ...] = (
        ("study, profile", lambda r: f"{r.study.name}, {r.study.profile.name}"),
        ("target", _target),
        ("pours", lambda r: f"{r.runs.total}, {r.runs.valid} valid"),
        ("σ of one pour", lambda r: observed(_of(r), r.pilot.noise[_of(r)].sigma)),
        ("significant (Holm)", lambda r: enumeration(r.screening.analysis.significant())),
        ("R², predicted R²", _fit),
        ("predicted at the optimum", _predicted),
        ("better than noise", lambda r: "yes" if r.optimum.single.better_than_noise else "no"),
        ("verification", _verified),
        ("difference from the target", _difference),
        ("verdict", lambda r: r.verification.tests[0].verdict),
    )
    return Table(("", *names), tuple((title, cell(one), cell(other)) for title, cell in rows), "95 % intervals.")


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


def _of(result: StudyResult) -> str:
    return result.study.targets[0].observable


def _target(result: StudyResult) -> str:
    target = result.study.targets[0]
    mean, margin = (observed(target.observable, value) for value in (target.mean, target.margin))
    return f"{observable_label(target.observable)} {mean}, margin {margin}"


def _fit(result: StudyResult) -> str:
    anova = result.surface.anova[0]
    return f"{fixed(anova.r_squared)}, {fixed(anova.r_squared_predicted)}"


def _predicted(result: StudyResult) -> str:
    found = result.optimum.single
    low, high = (observed(_of(result), end) for end in (found.predicted_low, found.predicted_high))
    return f"{observed(_of(result), found.predicted)} ({low} … {high})"


def _verified(result: StudyResult) -> str:
    sample = result.verification.tests[0].simulated
    return f"{observed(_of(result), sample.mean)} ± {observed(_of(result), sample.sd)} (sd), {sample.n} pours"


def _difference(result: StudyResult) -> str:
    test, unit = result.verification.tests[0].deciding, unit_of_observable(_of(result))
    if test is None:
        return MISSING
    middle, low, high = (unit.of(value) for value in (test.difference, test.low, test.high))
    return f"{unit.attach(signed(middle))} ({signed(low)} … {signed(high)})"


def _optimum(result: StudyResult) -> dict[str, str]:
    pairs = zip(result.optimum.factors, settings(result.optimum), strict=True)
    return {factor.path: setting.answer for factor, setting in pairs}


def _effects_of(result: StudyResult) -> dict[str, tuple[float, str]]:
    """Path → (effect, effect with its interval)."""
    part = result.screening
    paths, unit = {f.name: f.path for f in part.factors}, unit_of_observable(part.response)
    found = {}
    for effect in part.analysis.factor_effects():
        half = part.analysis.half_width(effect)
        text = unit.attach(signed(unit.of(effect.effect)))
        text += "" if math.isnan(half) else f" ± {fixed(unit.of(half))}"
        found[paths[effect.name]] = (effect.effect, text)
    return found
