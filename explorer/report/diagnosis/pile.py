"""The pile as measured, and by the models before and after."""

from __future__ import annotations

from explorer.report.content import Block, Figure, Section, Text
from explorer.report.diagnosis.charts import pile_chart
from explorer.report.diagnosis.findings import named
from explorer.report.findings import Plain


def pile(result: Plain) -> Section | None:
    """A picture per condition that has profiles, held-out ones first; None where none has."""
    pictures = sorted(result["piles"], key=lambda row: row["role"] != "holdout")
    if not pictures:
        return None
    text = (
        "Mean height over the distance from the pile's own middle, mirrored; a band is one standard deviation between "
        "pours. Heights and radii have one scale."
    )
    if not named(result):
        text += " Before and after are the same model here."
    blocks: list[Block] = [Text(text)]
    for k, picture in enumerate(pictures, start=1):
        words = "held out" if picture["role"] == "holdout" else "fitted"
        blocks.append(Figure(f"pile-{k}", pile_chart(picture), f"Condition {picture['condition']}, {words}."))
    return Section("The pile", tuple(blocks))
