"""What was read from the measured data, what was left out, and whether data and model scatter alike."""

from __future__ import annotations

from explorer.report.content import Block, Bullets, Folded, Section, Table, Text
from explorer.report.diagnosis.findings import split_label, summary_label
from explorer.report.findings import Plain
from explorer.report.units_for_people import enumeration, fixed, p_value


def data(result: Plain) -> Section:
    """Conditions, whatever is not used with its reason, and the comparison of variances."""
    rows = tuple(
        (
            row["condition"],
            row["role"],
            row["rig"].replace("_", " "),
            str(row["replicates"]),
            str(len(row["summaries"])),
            enumeration([summary_label(name) for name in row["summaries"]]),
        )
        for row in result["measured"]
    )
    header = ("condition", "role", "rig", "replicates", "numbers", "summaries")
    blocks: list[Block] = [
        Table(
            header, rows, "Summaries are chosen by name before any value is looked at, the same way for data and runs."
        )
    ]
    blocks += _left_out(result)
    blocks.append(Folded("Scatter of measured and simulated pours", (_variances(result),)))
    return Section("Data", tuple(blocks))


def _left_out(result: Plain) -> list[Block]:
    parts = (
        ("Not used:", result["data"]["ignored"]),
        ("Changed in reading:", result["data"]["notes"]),
        ("Left out, because constant and equal in runs and data:", _labels(result["dropped"])),
        ("Constant in the runs but not in the data, compared with an assumed spread:", _labels(result["floored"])),
        ("With heavy tails in the runs, outliers drawn in on both sides:", _labels(result.get("drawn_in", []))),
    )
    blocks: list[Block] = []
    for words, items in parts:
        if items:
            blocks += [Text(words), Bullets(tuple(items))]
    return blocks


def _labels(labels: list[str]) -> list[str]:
    return [f"{summary_label(summary)} ({condition})" for condition, summary in map(split_label, labels)]


def _variances(result: Plain) -> Table:
    labels = iter(row["label"] for row in result["residuals"])
    rows = []
    for comparison in result["variances"]:
        for ratio, p, differs in zip(comparison["ratio"], comparison["p"], comparison["differs"], strict=True):
            condition, summary = split_label(next(labels))
            rows.append(
                (condition, summary_label(summary), fixed(ratio), p_value(p), "differs" if differs else "alike")
            )
    statements = " ".join(
        dict.fromkeys(comparison["statement"].rstrip(".") + "." for comparison in result["variances"])
    )
    header = ("condition", "summary", "measured / simulated variance", "p", "judged")
    return Table(header, tuple(rows), f"F test, corrected for the number of summaries. {statements}")
