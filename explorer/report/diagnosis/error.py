"""Error before and after on every observable, beside what noise alone gives: the proof of a correction."""

from __future__ import annotations

from explorer.report.content import Block, Caution, Figure, Folded, Section, Table, Text
from explorer.report.diagnosis.charts import error_chart
from explorer.report.diagnosis.findings import OVERALL, final_model, named, summary_label, summary_value
from explorer.report.findings import Plain
from explorer.report.units_for_people import MISSING, fixed, percent

HEADER = (
    "observable",
    "before",
    "after",
    "noise floor",
    "after / floor",
    "skill",
    "95 % interval",
    "inside 90 %, before",
    "after",
)
CAPTION = (
    "Before and after: root mean square over the conditions of (mean of fresh pours − measured mean), of the "
    "calibrated declared model and of the corrected one. Noise floor: what a perfect model would show, from the "
    "standard errors of both means. Skill: 1 − (after² − floor²)/(before² − floor²); 1 is perfect (noise may take it "
    "above), 0 no gain, – where the declared model is within the noise already. Inside 90 %: share of measured pours "
    "in the model's 90 % predictive interval."
)


def error(result: Plain) -> Section:
    """Tables for held-out and fitted conditions; the held-out ones come first and open."""
    blocks: list[Block] = []
    if named(result):
        blocks.append(Text(f"After: {final_model(result)}."))
    else:
        blocks.append(
            Text("No effect was added, so before and after are the same model, and there is no skill to state.")
        )
    if result["error"]["holdout"]:
        blocks += [Text("On held-out conditions, which no fit has seen:"), _table(result, "holdout", CAPTION)]
        blocks.append(
            Figure(
                "error",
                error_chart(result, "holdout"),
                "Errors as multiples of the noise floor; a perfect model lies about 1.",
            )
        )
    else:
        blocks.append(Caution("No condition is held out. The table below is on the data that were fitted."))
    fitted = (_table(result, "fit", "" if result["error"]["holdout"] else CAPTION),)
    if result["error"]["holdout"]:
        blocks.append(Folded("On fitted conditions", fitted))
    else:
        blocks += fitted
    return Section("Error before and after", tuple(blocks))


def _table(result: Plain, role: str, caption: str) -> Table:
    return Table(HEADER, tuple(_row(result, row) for row in result["error"][role]), caption)


def _row(result: Plain, row: Plain) -> tuple[str, ...]:
    name = row["observable"]
    known = named(result) and row["skill_low"] is not None
    interval = f"{fixed(row['skill_low'])} … {fixed(row['skill_high'])}" if known else MISSING
    label = summary_label(name) + (" (in measured σ)" if name == OVERALL else "")
    return (
        label,
        *(summary_value(result, name, row[key]) for key in ("before", "after", "noise_floor")),
        fixed(row["ratio"]),
        fixed(row["skill"]) if named(result) else MISSING,
        interval,
        percent(row["coverage_before"]),
        percent(row["coverage_after"]),
    )
