"""What ``explorer simulate`` prints and keeps of a bench test: the measured value beside the one that was put in.

Plain data: ``test``, ``body``, ``wall``, ``note``; ``quantities`` name → value, reference, error (value/reference − 1),
spread, unit; ``series`` and ``table`` name → list of numbers; ``parameters`` path → value in SI, unit; ``versions``. A
number that could not be measured is null.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from explorer.files.run_folder import json_text, parameters_text
from explorer.files.run_result import parameter_values, versions
from explorer.tables.text_table import text_table
from solver import Scene

if TYPE_CHECKING:  # it loads Taichi, and the page reads tables without
    from solver.single_body import BenchResult


def bench_data(scene: Scene, result: BenchResult) -> dict[str, Any]:
    """All about one bench test as plain data."""
    return {
        "title": scene.title,
        "test": result.test,
        "body": result.body,
        "wall": result.wall,
        "note": result.note,
        "quantities": {
            quantity.name: {
                "value": _finite(quantity.value),
                "reference": _finite(quantity.reference),
                "error": _finite(quantity.error),
                "spread": _finite(quantity.spread),
                "unit": quantity.unit,
            }
            for quantity in result.quantities
        },
        "series": {name: [_finite(number) for number in numbers] for name, numbers in result.series},
        "table": {name: [_finite(number) for number in numbers] for name, numbers in result.table},
        "parameters": parameter_values(scene),
        "versions": versions(),
    }


def bench_text(data: dict[str, Any]) -> str:
    """The same for people: quantities, then the table where there is one."""
    rows = [
        (name, _number(entry["value"]), _number(entry["reference"]), _percent(entry["error"]), entry["unit"])
        for name, entry in data["quantities"].items()
    ]
    parts = [
        f"{data['test']}: {data['body']} on {data['wall']}",
        text_table(("quantity", "measured", "put in", "error %", "unit"), rows),
    ]
    if data["table"]:
        columns = data["table"]
        lines = [tuple(_number(number) for number in row) for row in zip(*columns.values(), strict=True)]
        parts.append(text_table(tuple(columns), lines))
    return "\n\n".join([*parts, data["note"]] if data["note"] else parts)


def write_bench(folder: Path, data: dict[str, Any]) -> None:
    """Write ``result.json`` and ``parameters.toml`` into an existing ``folder``."""
    (folder / "result.json").write_text(json_text(data) + "\n", encoding="utf-8")
    (folder / "parameters.toml").write_text(parameters_text(data["parameters"]), encoding="utf-8")


def _finite(number: float | None) -> float | None:
    return None if number is None or not math.isfinite(number) else float(number)


def _number(number: float | None) -> str:
    return "-" if number is None else f"{number:.5g}"


def _percent(error: float | None) -> str:
    return "-" if error is None else f"{100.0 * error:+.3f}"
