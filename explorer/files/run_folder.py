"""The folder that a simulation leaves behind. It appears at once and complete, or not at all.

result.json            as in `explorer.files.run_result`
parameters.toml        every parameter, SI
trace_<seed>.csv       curves over time
pile_<seed>.npz        xyz (n, 3) [m], radius (n,) [m], body (n,): the spheres on the plate
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from explorer.files.output_file import check_vacant
from explorer.files.run_result import BenchTestResult, ParameterValue, SimulationResult
from explorer.scene.text import toml_key, toml_value
from solver import Record

TRACE_COLUMNS = {
    "time_s": "time",
    "entered_mass_kg": "entered_mass",
    "discharged_mass_kg": "discharged_mass",
    "kinetic_energy_J": "kinetic_energy",
    "contacts": "contacts",
    "max_overlap": "max_overlap",
    "potential_energy_J": "potential_energy",
    "elastic_energy_J": "elastic_energy",
    "dissipated_energy_J": "dissipated_energy",
    "wall_work_J": "wall_work",
    "taken_out_energy_J": "taken_out_energy",
    "supplied_energy_J": "supplied_energy",
}
"""Columns of a trace file → curves of ``solver.Trace``; ``max_overlap`` is in radii of the sphere."""


@contextmanager
def appearing(folder: Path, option: str = "--out") -> Iterator[Path]:
    """A temporary folder that becomes ``folder`` when the block ends, and is removed when the block fails.

    Raises :class:`CommandError` where ``folder`` is not vacant, OSError where it cannot be made.
    """
    check_vacant(folder, option)
    folder = folder.resolve()
    folder.parent.mkdir(parents=True, exist_ok=True)
    beside = os.access(folder.parent, os.W_OK) or not folder.is_dir()
    temporary = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent if beside else folder))
    try:
        yield temporary
        # mkdtemp gives access to the owner only; a result folder has the rights of any new folder.
        temporary.chmod(0o777 & ~_umask())
        check_vacant(folder, option, own=[temporary])
        if _removed(folder):
            temporary.rename(folder)
        else:
            for made in list(temporary.iterdir()):
                shutil.move(made, folder / made.name)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _removed(folder: Path) -> bool:
    """Whether the place of ``folder``, which is empty or not there, is free now: that of a mounted one cannot be."""
    try:
        if folder.is_dir():
            folder.rmdir()
    except OSError:
        return False
    return True


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def write_result(folder: Path, result: SimulationResult | BenchTestResult) -> None:
    """Write ``result.json`` and ``parameters.toml`` into an existing ``folder``."""
    (folder / "result.json").write_text(json_text(result.to_dict()) + "\n", encoding="utf-8")
    (folder / "parameters.toml").write_text(parameters_text(result.parameters), encoding="utf-8")


def write_run(folder: Path, result: SimulationResult, records: Sequence[Record]) -> None:
    """Write the files of a simulation into an existing ``folder``."""
    write_result(folder, result)
    for record in records:
        _write_trace(folder / f"trace_{record.seed}.csv", record)
        spheres = record.pile.spheres
        np.savez_compressed(
            folder / f"pile_{record.seed}.npz", xyz=spheres.centre, radius=spheres.radius, body=spheres.body
        )


def _write_trace(path: Path, record: Record) -> None:
    columns = [getattr(record.trace, curve).tolist() for curve in TRACE_COLUMNS.values()]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(TRACE_COLUMNS)
        writer.writerows(zip(*columns, strict=True))


def json_text(result: dict[str, Any]) -> str:
    """JSON with numbers that every reader understands: NaN and infinity are refused."""
    return json.dumps(result, indent=2, ensure_ascii=False, allow_nan=False)


def parameters_text(values: dict[str, ParameterValue]) -> str:
    """TOML of parameters: path → value, its SI unit as a comment."""
    lines = ["# Every parameter of the run; SI."]
    for path, entry in values.items():
        unit = "" if entry.unit == "1" else f"   # [{entry.unit}]"
        lines.append(f"{toml_key(path)} = {toml_value(entry.value)}{unit}")
    return "\n".join(lines) + "\n"
