"""The steepest ascent: the walk along the fitted effects and where it passes the target."""

from __future__ import annotations

from doe.run_records import valid_values
from doe.stages.ascent import AscentResult
from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Bullets, Figure, Section, Table, Text
from explorer.report.figures.walks import ascent_path
from explorer.units import fixed, observable_label, observed, parameter_label, parameter_value


def ascent(result: StudyResult) -> Section:
    """Steps, means, errors and the bracket."""
    walk = result.ascent
    observable = walk.observable
    blocks: list[Block] = [
        Text(
            "Direction and steps follow the effects on the target's own observable; base factor "
            f"{walk.path.base}. {walk.bracket.statement} Two steps have to differ by "
            f"{observed(observable, walk.smallest_difference)} to be told apart with chance 0.8."
        ),
        Figure(
            "ascent",
            ascent_path(walk, result.study.targets[0]),
            "Intervals use the pilot's σ and the number of valid pours of a step.",
        ),
        _steps(walk),
    ]
    notes = (*walk.notes, *(f"Region of the surface, SI units: {note}" for note in walk.region.notes))
    if notes:
        blocks.append(Bullets(notes))
    return Section("Steepest ascent", tuple(blocks))


def _steps(walk: AscentResult) -> Table:
    observable, factors = walk.observable, walk.factors
    rows = []
    for k, natural in enumerate(walk.path.natural.tolist()):
        rows.append(
            (
                str(k + 1),
                *(parameter_value(f.path, value) for f, value in zip(factors, natural, strict=True)),
                str(len(valid_values(walk.runs[k], observable))),
                observed(observable, walk.means[k]),
                observed(observable, walk.sd[k]),
                observed(observable, walk.standard_error[k]),
                fixed(walk.relative_error_percent[k]),
            )
        )
    header = (
        "step",
        *(f"{factor.name} {parameter_label(factor.path)}" for factor in factors),
        *("valid pours", "mean", "sd", "standard error", "relative error [%]"),
    )
    return Table(header, tuple(rows), f"{observable_label(observable)}; valid pours only.")
