"""What is left of every fitted number, in units of its own uncertainty."""

from __future__ import annotations

from scipy import stats

from explorer.report.content import Figure, Folded, Section, Table, Text
from explorer.report.diagnosis.charts import residual_chart
from explorer.report.diagnosis.findings import final_model, split_label, summary_label, summary_value
from explorer.report.findings import Plain
from explorer.report.units_for_people import fixed, signed


def residuals(result: Plain) -> Section:
    """Bar chart with the bands, and the numbers behind it."""
    one, every = bands(len(result["residuals"]))
    text = (
        "Measured mean minus model in units of σ, which holds the noise of the measured mean, that of the model and "
        f"the instrument's. A correct model leaves one number within ± {fixed(one)} in 95 % of cases, and all "
        f"{len(result['residuals'])} within ± {fixed(every)}. Neighbours are correlated: T² counts that, single bars "
        "do not."
    )
    after = f"After: {final_model(result)}."
    return Section(
        "Residual of every number",
        (
            Text(text),
            Text(after),
            Figure(
                "residuals", residual_chart(result, one, every), "Dashed: 95 % for one number; solid: for all of them."
            ),
            Folded("The numbers", (_table(result),)),
        ),
    )


def bands(numbers: int) -> tuple[float, float]:
    """Half widths [σ] that a correct model keeps to with chance 0.95: one number, and all (Bonferroni)."""
    return float(stats.norm.isf(0.025)), float(stats.norm.isf(0.025 / numbers))


def _table(result: Plain) -> Table:
    rows = []
    for row in result["residuals"]:
        condition, name = split_label(row["label"])
        values = (summary_value(result, name, row[key], 4) for key in ("measured", "before", "after"))
        rows.append((condition, summary_label(name), *values, signed(row["z_before"]), signed(row["z_after"])))
    header = ("condition", "summary", "measured", "before", "after", "residual before [σ]", "after [σ]")
    return Table(header, tuple(rows), "Models as emulated at their best fits.")
