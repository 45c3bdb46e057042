"""How to run the diagnosis again: command line, time, versions."""

from __future__ import annotations

import shlex

from explorer.report.content import Code, Section, Table, Text
from explorer.report.findings import Plain
from explorer.report.units_for_people import duration


def repeat(result: Plain) -> Section:
    """The command that gives the same answer; pours that are in the store are not run again."""
    pours = result["pours"]
    text = (
        f"{pours['settings']} settings of the declared model and its effects, each poured in every fitted condition; "
        f"{pours['run']} pours were run in {duration(result['timing']['total_s'])}, the others were in the store. The "
        f"bootstrap has seed {result['seed']}; pours have seeds of their own, so that the same order gives the same "
        "answer. `diagnosis.json` holds every number of this report."
    )
    versions = tuple((name, version or "not installed") for name, version in result["versions"].items())
    return Section("How to repeat", (Text(text), Code(command(result)), Table(("program", "version"), versions)))


def command(result: Plain) -> str:
    """The order as a command line."""
    order = result["order"]
    parts = ["explorer", "diagnose", result["data"]["folder"], "--out", order["out"]]
    if order["effects"]:
        parts += ["--effects", ",".join(order["effects"])]
    if order["budget"] is not None:
        parts += ["--budget", str(order["budget"])]
    return shlex.join(parts)
