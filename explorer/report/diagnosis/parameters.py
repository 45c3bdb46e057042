"""The calibrated parameters before and after, and which of them the data push against their measured range."""

from __future__ import annotations

from explorer.report.content import Block, Caution, Section, Table, Text
from explorer.report.diagnosis.findings import EDGE, edges, fall_beyond, final_model
from explorer.report.findings import Plain
from explorer.report.units_for_people import MISSING, fixed, parameter_label, parameter_range, parameter_value


def parameters(result: Plain) -> Section:
    """Table of all parameters; a sentence for each one at an edge."""
    rows = []
    for row in result["parameters"]:
        name = row["name"]
        cells = []
        for when in ("before", "after"):
            error = parameter_value(name, row[f"{when}_standard_error"])
            held = EDGE[row[f"edge_{when}"]]
            cells += [parameter_value(name, row[when]), f"± {error}", _held(held, row[f"pull_{when}"])]
        rows.append((parameter_label(name), parameter_range(name, row["low"], row["high"]), *cells))
    header = (
        "parameter",
        "measured range",
        "before",
        "standard error",
        "held at",
        "after",
        "standard error",
        "held at",
    )
    blocks: list[Block] = [
        Text(
            "Calibrated within their measured ranges, and to their measured means where there are some. After: "
            f"{final_model(result)}."
        ),
        Table(
            header,
            tuple(rows),
            "Held at: the end of the range that stops the fit, and the fall of T² if it were not there.",
        ),
    ]
    blocks += [Caution(text) for text in edges(result)]
    return Section("Parameters", tuple(blocks))


def _held(end: str, pull: float) -> str:
    return f"{end} (T² −{fixed(fall_beyond(pull), 1)})" if end else MISSING
