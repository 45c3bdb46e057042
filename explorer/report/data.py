"""Tables of plain data beside a report: every run, every parameter with its origin, every analysis of variance."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from doe.analysis.named_factors import NamedFit
from doe.analysis.random_groups import RandomFit
from doe.analysis.surface_anova import SurfaceAnova
from doe.studies.study_result import StudyResult
from explorer.report.content import DataTable
from explorer.report.set_up import is_assumed
from explorer.units import parameter_units

if TYPE_CHECKING:  # both import this package themselves
    from explorer.design.result import DesignResult
    from explorer.diagnosis.result import DiagnosisResult

SETTING = ("numerics", "contact", "insertion")
"""Parameters of the calculation, which cannot be measured."""


def study_data(result: StudyResult) -> tuple[DataTable, ...]:
    """Runs with their settings and observables (SI), parameters with value and origin, analyses of variance."""
    names = [target.observable for target in result.study.targets]
    anova = _anova(zip(names, result.surface.anova, strict=True))
    return (_study_runs(result), _parameters(result), anova)


def design_data(result: DesignResult) -> tuple[DataTable, ...]:
    """Runs with their levels, and the analysis of variance, in the units of the sheet."""
    model, fitted, named, random = result.analysis.model, result.fitted, result.analysis.named, result.analysis.random
    linear = random if named is None else named
    if linear is not None:
        fit = zip(result.labels, linear.row_of_run, linear.observed.tolist(), linear.predicted.tolist(), strict=True)
        header = ("run", *(one.factor for one in result.factors), result.response.name, "model")
        runs = DataTable(
            "runs", header, tuple((label, *result.levels_of(row), y, fitted) for label, row, y, fitted in fit)
        )
        return runs, _anova([(result.response.name, linear)]) if isinstance(linear, NamedFit) else _random_tests(linear)
    if model is None or fitted is None:
        return ()
    header = ("run", *(f"{one.factor} [{one.unit or '1'}]" for one in result.factors))
    rows = tuple(
        (label, *fitted.design[row].tolist(), observed, predicted)
        for label, row, observed, predicted in zip(
            result.labels,
            model.surface.row_of_run.tolist(),
            model.surface.observed.tolist(),
            model.surface.predicted.tolist(),
            strict=True,
        )
    )
    runs = DataTable("runs", (*header, f"{result.response.name} [{result.response.unit or '1'}]", "model"), rows)
    return runs, _anova([(result.response.name, model.anova)])


def _random_tests(fit: RandomFit) -> DataTable:
    rows = tuple((one.source, one.df, one.df_error, one.f, one.p) for one in fit.tests)
    return DataTable("tests", ("source", "df", "df_error", "f", "p"), rows)


def diagnosis_data(result: DiagnosisResult) -> tuple[DataTable, ...]:
    """Probabilities of the answers, residuals of every feature, and errors before and after."""
    answers = DataTable("answers", ("answer", "probability"), tuple(result.ranked()))
    residuals = DataTable(
        "residuals",
        ("condition", "feature", "z_before", "z_after"),
        tuple((row.condition, row.feature, row.z_before, row.z_after) for row in result.residuals),
    )
    errors = DataTable(
        "errors",
        ("role", "observable", "before", "after", "noise_floor", "unit"),
        tuple(
            (role, row.observable, row.before, row.after, row.noise_floor, row.unit)
            for role, rows in (("fit", result.error.of("fit")), ("holdout", result.error.of("holdout")))
            for row in rows
        ),
    )
    return answers, residuals, errors


def _study_runs(result: StudyResult) -> DataTable:
    stages = [(stage, run) for stage in result.stage_names() for rows in result.runs_of(stage) for run in rows]
    settings = {
        (stage, setting.label): setting.values
        for stage in result.stage_names()
        for setting in result.settings_of(stage)
    }
    observables = sorted({name for _, run in stages for name in run.observables})
    paths = sorted({path for values in settings.values() for path in values})
    rows = tuple(
        (
            *(stage, run.title, run.replicate, run.attempt, run.seed, run.outcome, run.key),
            *(settings.get((stage, run.label), {}).get(path) for path in paths),
            *(run.observables.get(name) for name in observables),
        )
        for stage, run in stages
    )
    header = ("stage", "setting", "replicate", "attempt", "seed", "outcome", "key", *paths, *observables)
    return DataTable("runs", header, rows)


def _parameters(result: StudyResult) -> DataTable:
    """Every parameter at its reference value, and those of the surface within what the target allows (SI)."""
    units, guesses, estimates = parameter_units(), is_assumed(result.study.assumed), result.optimum.estimates
    source = Path(result.study.file).name
    values = dict(result.set_up.values) if result.set_up else {f.path: f.reference for f in result.study.factors}
    rows = []
    for path, reference in values.items():
        head, found = path.partition(".")[0], estimates.get(path)
        origin = "assumed" if path in guesses else "setting" if head in SETTING else "stated"
        row: tuple[str | float | int | None, ...] = (
            path,
            reference,
            units.get(path.rsplit(".", 1)[-1], "1"),
            origin,
            source,
        )
        if found is None:
            rows.append((*row, None, None, None, None))
        else:
            rows.append((*row, found.value, found.low, found.high, "yes" if found.identified else "no"))
    header = ("path", "value", "unit", "origin", "source", "at_optimum", "low", "high", "identified")
    return DataTable("parameters", header, tuple(rows))


def _anova(models: Iterable[tuple[str, SurfaceAnova | NamedFit]]) -> DataTable:
    header = ("response", "source", "sum_of_squares", "df", "mean_square", "f", "p")
    return DataTable(
        "anova", header, tuple((name, *vars(row).values()) for name, model in models for row in model.rows)
    )
