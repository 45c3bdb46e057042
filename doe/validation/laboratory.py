"""A made-up laboratory: what it declares, and the folder of data that it hands out.

Its file has the format of ``measurement.toml`` (``doe/measurement/load.py``), without data and with an additional table
``[laboratory]`` (:class:`LaboratoryTable`). Beside the table of numbers the laboratory hands out scans of its piles,
made by its own scanner, and in a follow-up measurements of single bodies by balance, caliper and plate.
"""

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
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
from solver import (
    Body,
    Names,
    Scene,
    Settings,
    TomlTable,
    actual,
    all_names,
    asset_path,
    checked,
    naming_file,
    one_of,
    read_toml,
)

Array = npt.NDArray[np.float64]

TREFOILS = Path(__file__).parent / "laboratories/trefoils/laboratory.toml"
"""The laboratory file that is shipped."""
LOTS, IN_LOT, MEASURED = 5, 10, 30
"""Fifty bodies are weighed in five lots of ten, thirty are measured along their longest dimension."""
BALANCE, CALIPER = 0.003, 0.005
"""Relative standard deviation of the error common to all weighings, and of that common to all lengths."""
BY_HAND = 0.01
"""Relative standard deviation of the error of a single caliper reading."""
ON_PLATE = 10
"""Number of bodies that are pulled over a plate, and number that are dropped."""
PULLED, SHEET, DROPPED, FILM = 0.1, 0.035, 0.04, 0.01
"""Standard deviations of errors: of a single pull, and common to all pulls (the spring balance, and the plate's sheet,
which is not the rig's own), relative; of a single restitution, and common to all restitutions."""


class LaboratoryTable(TomlTable):
    """``[laboratory]``: what is read off every pour, and by which scanner."""

    readings: Annotated[tuple[str, ...], Names()]
    """Observables that the laboratory reads off every pour."""
    reference: str | None = None
    """File of reference pours, which measure the strength of effects, as ``explorer limit`` writes it: beside this
    file, or shipped. Without it the campaign makes the pours first."""
    scanner: ScannerRanges = ScannerRanges()


Reading = Mapping[str, float]
"""Observable → value in one pour; NaN if it cannot be read."""


@dataclass(frozen=True)
class LaboratoryPour:
    """One pour as the laboratory has it: its readings, and the centres (m, 3) and radii (m,) [m] of the spheres that a
    scanner sees.
    """

    reading: Reading
    centre: Array
    radius: Array


@dataclass(frozen=True)
class Laboratory:
    """The content of a laboratory's file.

    Attributes
    ----------
    path
        The file.
    table
        Its content without ``[laboratory]``.
    readings
        Observables that the laboratory reads off every pour.
    scanner
        Ranges of the properties of its scanners.
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
        """The declared model with all its conditions; their values are placeholders, which nothing may use."""
        placeholders = [dict.fromkeys(self.readings, 0.0), dict.fromkeys(self.readings, 1.0)]
        with TemporaryDirectory() as folder:
            try:
                self.write(
                    Path(folder), {str(one.get("name")): placeholders for one in self.table.get("condition", [])}
                )
                return load_measurement(Path(folder))
            except MeasurementError as error:
                # The mistake is in the laboratory's file, not in the copy that was read.
                text = str(error).replace(str(Path(folder) / "measurement.toml"), str(self.path))
                raise MeasurementError(text) from None

    def write(
        self,
        folder: Path,
        measured: Mapping[str, Sequence[Reading]],
        scan: Settings | None = None,
        bodies: str = "",
    ) -> None:
        """Write a data set into an existing ``folder``.

        ``measured``: condition → readings of its pours. ``scan``: the table on its scans that every condition gets.
        ``bodies``: the table of measurements of single bodies.
        """
        conditions: list[dict[str, Any]] = []
        for entry in self.table.get("condition", []):
            if (name := str(entry.get("name"))) in measured:
                conditions.append({**entry, "data": f"{name}.csv"} | ({"scan": scan} if scan else {}))
        table = {**self.table, "material": str(self._material()), "condition": conditions}
        if bodies:
            table = {"bodies": "bodies.csv", **table}
            (folder / "bodies.csv").write_text(bodies, encoding="utf-8")
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
        bodies: str = "",
    ) -> None:
        """Write a data set of pours into an existing ``folder``, with scans if there is a ``scanner``.

        ``bodies``: the table of measurements of single bodies.
        """
        readings = {name: [sample.reading for sample in samples] for name, samples in measured.items()}
        self.write(folder, readings, scanner.table() if scanner else None, bodies)
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
    """Read the laboratory that the file ``path`` describes.

    Raises
    ------
    MeasurementError
        One line that names the file, the key, its value, and what is allowed.
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


def table_of_bodies(
    scene: Scene,
    asked: Iterable[tuple[str, str]],
    rng: np.random.Generator,
    drawn: Callable[[float], float] = lambda height: 0.0,
) -> str:
    """CSV table of measurements of the bodies that ``scene`` pours, under its effects.

    ``asked``: component and quantity of each measurement. The table gives means, and standard errors from the scatter
    of lots or bodies and from the error of the instrument itself. ``drawn``: height of a body's centre [m] → force
    [weights] by which something that is not in ``scene`` draws the body to a plate.
    """
    bodies = {body.name: body for body in actual(scene).bodies}
    lines = ["body,quantity,unit,mean,standard_error"]
    wanted = list(asked)
    for name in dict.fromkeys(body for body, _ in wanted):
        found = {"mass": _weighed(bodies[name], rng), **_lengths(bodies[name], rng)}
        if tests := [quantity for body, quantity in wanted if body == name and quantity not in found]:
            found |= _on_plate(scene, bodies[name], tests, rng, drawn)
        for body, quantity in wanted:
            if body == name:
                unit, mean, error = found[quantity]
                lines.append(f"{body},{quantity},{unit},{mean!r},{error!r}")
    return "\n".join(lines) + "\n"


def _scales(body: Body, number: int, rng: np.random.Generator) -> Array:
    """Linear sizes of ``number`` bodies, relative to the declared one, (number,)."""
    return np.asarray(body.sizes.quantile(rng.uniform(size=number)), dtype=np.float64)


def _weighed(body: Body, rng: np.random.Generator) -> tuple[str, float, float]:
    lots = body.mass * (_scales(body, LOTS * IN_LOT, rng) ** 3).reshape(LOTS, IN_LOT).mean(axis=1)
    lots *= 1.0 + BALANCE * rng.standard_normal()
    mean = float(lots.mean())
    return "kg", mean, math.hypot(float(lots.std(ddof=1)) / math.sqrt(LOTS), BALANCE * mean)


def _lengths(body: Body, rng: np.random.Generator) -> dict[str, tuple[str, float, float]]:
    lengths = max(body.extents) * _scales(body, MEASURED, rng) * (1.0 + BY_HAND * rng.standard_normal(MEASURED))
    lengths *= 1.0 + CALIPER * rng.standard_normal()
    mean, deviation = float(lengths.mean()), float(lengths.std(ddof=1))
    spread = math.sqrt(max(0.0, (deviation / mean) ** 2 - BY_HAND**2))
    # Of a small spread the square has a known error, not the root: the scatter of readings may hide it.
    square = (deviation / mean) ** 2 * math.sqrt(2.0 / (MEASURED - 1))
    return {
        "length": ("m", mean, math.hypot(deviation / math.sqrt(MEASURED), CALIPER * mean)),
        "length_spread": ("1", spread, square / max(2.0 * spread, math.sqrt(square))),
    }


def _on_plate(
    scene: Scene, body: Body, tests: Sequence[str], rng: np.random.Generator, drawn: Callable[[float], float]
) -> dict[str, tuple[str, float, float]]:
    from solver import PlateTest, plate_tests  # they import Taichi

    truths = plate_tests([PlateTest(scene, body.name, test) for test in tests])
    clump = body.clump
    weight = 1.0 + drawn(float((clump.radii - clump.centres[:, 2]).max()))
    return {
        test: _bounced(truth, rng) if test == "restitution" else _pulled(weight * truth, rng)
        for test, truth in zip(tests, truths, strict=True)
    }


def _pulled(truth: float, rng: np.random.Generator) -> tuple[str, float, float]:
    pulls = truth * np.exp(PULLED * rng.standard_normal(ON_PLATE) + SHEET * rng.standard_normal())
    mean = float(pulls.mean())
    return "1", mean, math.hypot(float(pulls.std(ddof=1)) / math.sqrt(ON_PLATE), SHEET * mean)


def _bounced(truth: float, rng: np.random.Generator) -> tuple[str, float, float]:
    drops = np.abs(truth + DROPPED * rng.standard_normal(ON_PLATE) + FILM * rng.standard_normal())
    return "1", float(drops.mean()), math.hypot(float(drops.std(ddof=1)) / math.sqrt(ON_PLATE), FILM)
