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
    blocks.append(_freed(result))
    return Section("Parameters", tuple(blocks))


def _freed(result: Plain) -> Table:
    """What each parameter would have to be if its own measurement were wrong and nothing else were missing."""
    rows = []
    for row in result["freed"]:
        name, seen = row["name"], row["value"] is not None
        place = f"{parameter_value(name, row['value'])} ± {parameter_value(name, row['standard_error'])}"
        away = MISSING if row["sds"] is None else f"{fixed(row['sds'], 1)} SD"
        where = "outside, extrapolated" if row["outside"] else "inside"
        t2 = fixed(row["t2"], 1) if seen else MISSING
        rows.append((parameter_label(name), *((place, away, where) if seen else ("not seen",) + (MISSING,) * 2), t2))
    return Table(
        ("parameter", "the data alone put it at", "from its measured mean", "simulated range", "T² left"),
        tuple(rows),
        "If one measurement were wrong: the base model with that parameter freed, the others held to theirs. "
        f"T² of the calibrated base model: {fixed(result['t2']['before'][0], 1)}.",
    )


def _held(end: str, pull: float) -> str:
    return f"{end} (T² −{fixed(fall_beyond(pull), 1)})" if end else MISSING
