"""The two Markdown pages of a recording: what was poured, and what came out."""

from __future__ import annotations

import math
from collections.abc import Mapping

from explorer.files.run_result import parameter_values, versions
from solver import Scene
from solver.observables import Value


def parameters_document(scene: Scene, seed: int) -> str:
    """Title, seed, versions, and every parameter in SI."""
    made_with = ", ".join(f"{name} {version or '(not installed)'}" for name, version in versions().items())
    lines = [
        f"# {scene.title}",
        "",
        f"Seed {seed}; {made_with}.",
        "",
        "| parameter | value | unit |",
        "|-|-|-|",
    ]
    for path, entry in parameter_values(scene).items():
        number = entry["value"]
        shown = number if isinstance(number, str) else f"{number:.6g}"
        lines.append(f"| {path} | {shown} | {entry['unit']} |")
    return "\n".join(lines)


def outcome_document(text: str, observed: Mapping[str, Value]) -> str:
    """The outcome, and every observable that could be measured; spread: within the pile."""
    lines = [f"# {text}", "", "| observable | value | spread | unit |", "|-|-|-|-|"]
    for name, entry in observed.items():
        if math.isfinite(entry.value):
            spread = "" if entry.spread is None else f"{entry.spread:.3g}"
            lines.append(f"| {name} | {entry.value:.5g} | {spread} | {entry.unit} |")
    return "\n".join(lines)
