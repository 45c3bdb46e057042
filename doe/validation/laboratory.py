"""A made-up laboratory: what it declares, and the folder of data that it hands out.

Its file is written as ``measurement.toml`` (``doe/measurement/load.py``), without data, and with one table more,
``[laboratory]`` (:class:`LaboratoryTable`). Beside the table of numbers it hands out scans of its piles, made by a
scanner of its own.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
import tomlkit

from doe.errors import MeasurementError
from doe.measurement import Measurement, load_measurement
from doe.validation.scanner import Scanner, ScannerRanges, write_scan
from solver import Names, Settings, TomlTable, all_names, asset_path, checked, naming_file, one_of, read_toml

Array = npt.NDArray[np.float64]

TREFOILS = Path(__file__).parent / "laboratories/trefoils/laboratory.toml"
"""The shipped one."""


class LaboratoryTable(TomlTable):
    """``[laboratory]``: what is read off every pour, and by what."""

    readings: Annotated[tuple[str, ...], Names()]
    """Numbers that it reads off every pour."""
    reference: str | None = None
    """Pours that tell how strong an effect is, as ``explorer limit`` writes them: beside the file, or shipped; without
    it the campaign makes them first."""
    scanner: ScannerRanges = ScannerRanges()


Reading = Mapping[str, float]
"""Observable → value of one pour; NaN where it cannot be read."""


@dataclass(frozen=True)
class LaboratoryPour:
    """One pour as the laboratory has it: its readings, and the spheres (m, 3) and (m,) [m] that a scanner sees."""

    reading: Reading
    centre: Array
    radius: Array


@dataclass(frozen=True)
class Laboratory:
    """What a laboratory's file says.

    Attributes
    ----------
    path
        The file.
    table
        Of it all but ``[laboratory]``.
    readings
        Observables that it reads off every pour.
    scanner
        What its scanners may be.
    reference
        File of reference pours, or None.
    """

    path: Path
    table: Settings
    readings: tuple[str, ...]
    scanner: ScannerRanges
    reference: Path | None

    @cached_property
    def declared(self) -> Measurement:
        """The declared model with all its conditions; the values in them are placeholders, which nothing may read."""
        placeholders = [dict.fromkeys(self.readings, 0.0), dict.fromkeys(self.readings, 1.0)]
        with TemporaryDirectory() as folder:
            try:
                self.write(
                    Path(folder), {str(one.get("name")): placeholders for one in self.table.get("condition", [])}
                )
                return load_measurement(Path(folder))
            except MeasurementError as error:
                # What is wrong stands in the laboratory's file, whatever copy of it was read.
                text = str(error).replace(str(Path(folder) / "measurement.toml"), str(self.path))
                raise MeasurementError(text) from None

    def write(self, folder: Path, measured: Mapping[str, Sequence[Reading]], scan: Settings | None = None) -> None:
        """Write a data set into an existing ``folder``.

        ``measured``: condition → readings of its pours. ``scan``: what stands in every condition of its scans.
        """
        conditions: list[dict[str, Any]] = []
        for entry in self.table.get("condition", []):
            if (name := str(entry.get("name"))) in measured:
                conditions.append({**entry, "data": f"{name}.csv"} | ({"scan": scan} if scan else {}))
        table = {**self.table, "material": str(self._material()), "condition": conditions}
        (folder / "measurement.toml").write_text(tomlkit.dumps(table), encoding="utf-8")
        for name, readings in measured.items():
            lines = ["replicate,observable,x,value"]
            for replicate, reading in enumerate(readings, start=1):
                lines += [f"{replicate},{key},,{x!r}" for key, x in reading.items() if math.isfinite(x)]
            (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")

    def hand_out(
        self,
        folder: Path,
        measured: Mapping[str, Sequence[LaboratoryPour]],
        scanner: Scanner | None,
        seed: Sequence[int],
    ) -> None:
        """Write a data set of pours into an existing ``folder``, with scans where there is a ``scanner``."""
        readings = {name: [sample.reading for sample in samples] for name, samples in measured.items()}
        self.write(folder, readings, scanner.table() if scanner else None)
        if scanner is None:
            return
        (folder / "scans").mkdir()
        for c, (name, samples) in enumerate(measured.items()):
            for replicate, sample in enumerate(samples, start=1):
                rng = np.random.default_rng([*seed, c, replicate])
                write_scan(
                    folder / "scans" / f"{name}_{replicate}.npz", scanner.scan(sample.centre, sample.radius, rng)
                )

    def _material(self) -> Path:
        return asset_path("materials", str(self.table.get("material")), relative_to=self.path.parent).resolve()


def read_laboratory(path: Path) -> Laboratory:
    """The laboratory that the file ``path`` describes.

    Raises
    ------
    MeasurementError
        One line naming file, key, value and what is allowed.
    """
    if not path.is_file():
        raise MeasurementError(f"{path}: no such file")
    with naming_file(path, MeasurementError, ValueError, raised=MeasurementError):
        table = read_toml(path)
        own = checked(LaboratoryTable, table.get("laboratory", {}), "laboratory")
        for name in own.readings:
            one_of(name, "laboratory.readings", all_names())
        for entry in table.get("condition", []):
            if "data" in entry:
                raise MeasurementError(
                    f"condition.data: {entry['data']!r}; not allowed, as a laboratory file holds no data"
                )
        _check_ranges(own.scanner)
        reference = None if own.reference is None else asset_path("validation", own.reference, relative_to=path.parent)
    return Laboratory(
        path, {key: value for key, value in table.items() if key != "laboratory"}, own.readings, own.scanner, reference
    )


def _check_ranges(ranges: ScannerRanges) -> None:
    for key, values in dataclasses.asdict(ranges).items():
        if not values or min(values) < 0.0 or (key == "grid" and min(values) == 0.0) or list(values) != sorted(values):
            allowed = "above 0" if key == "grid" else "of 0 or more"
            raise MeasurementError(
                f"laboratory.scanner.{key}: {list(values)}; allowed: lengths {allowed} in ascending order"
            )
