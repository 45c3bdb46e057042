"""One declaration of a parameter, read by solver, slider, command line and design of experiments.

A parameter is a dataclass field made by :func:`param`; its metadata (unit, range, doc, whether a running pile
can take a new value) travels with it. Values are SI inside; :func:`parse_quantity` accepts a unit suffix at the edge.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from solver.assets import AssetNotFoundError, asset_path, shipped_assets

UNITS: dict[str, dict[str, float]] = {
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6},
    "kg": {"kg": 1.0, "g": 1e-3, "mg": 1e-6},
    "kg/s": {"kg/s": 1.0, "g/s": 1e-3},
    "kg/m3": {"kg/m3": 1.0, "g/cm3": 1e3},
    "m/s": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3},
    "m/s2": {"m/s2": 1.0},
    "m3": {"m3": 1.0, "L": 1e-3, "mL": 1e-6, "cm3": 1e-6},
    "rpm": {"rpm": 1.0},
    "deg/s": {"deg/s": 1.0},
    "deg": {"deg": 1.0, "°": 1.0},
    "rad": {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0},
    "J/m2": {"J/m2": 1.0, "mJ/m2": 1e-3},
    "J/m3": {"J/m3": 1.0, "kJ/m3": 1e3},
    "N/m": {"N/m": 1.0, "mN/m": 1e-3},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6},
    "1": {"": 1.0, "%": 1e-2},
}
"""Unit suffixes understood for each SI unit, with their factor to SI."""

ROUNDING = 1e-12
"""Share of a parameter's range by which a level that was computed may miss its end."""

_QUANTITY = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s]\S*)?\s*$")


class ParameterError(ValueError):
    """A parameter path or value that is not allowed; the message is one line, fit for a user."""


@dataclass(frozen=True)
class Parameter:
    """What is known about one parameter.

    ``live`` says whether a running pile takes a new value at once ("acts now") or only the next pour ("on restart").
    ``choices`` is non-empty for a named choice, ``files`` holds the endings of a mesh file that is named (then ``low``
    and ``high`` mean nothing).
    """

    path: str
    unit: str
    low: float
    high: float
    doc: str
    live: bool = False
    scale: str = "linear"
    choices: tuple[str, ...] = ()
    files: tuple[str, ...] = ()

    @property
    def is_number(self) -> bool:
        """Whether its values are numbers, not names."""
        return not self.choices and not self.files

    def check(self, value: Any) -> float | str:
        """Return ``value`` in SI, or raise :class:`ParameterError` naming path, value and what is allowed."""
        if self.choices:
            if value not in self.choices:
                raise ParameterError(f"{self.path}: {value!r} is not one of {', '.join(self.choices)}")
            return str(value)
        if self.files:
            return self._file(value)
        number = parse_quantity(value, self.unit, self.path)
        nearest = min(max(number, self.low), self.high)
        if number != nearest and abs(number - nearest) <= ROUNDING * (self.high - self.low) < math.inf:
            return nearest
        if not self.low <= number <= self.high:
            unit = "" if self.unit == "1" else f" {self.unit}"
            raise ParameterError(f"{self.path}: {number:g}{unit} is outside {self.low:g} … {self.high:g}{unit}")
        return number

    def _file(self, value: Any) -> str:
        """A shipped mesh's name as it is, the full path of a file of one's own."""
        try:
            path = asset_path("meshes", str(value))
        except AssetNotFoundError as error:
            raise ParameterError(f"{self.path}: {error}") from None
        if path.suffix.lower() not in self.files:
            raise ParameterError(f"{self.path}: {value!r}; allowed are files ending in {', '.join(self.files)}")
        return str(value) if str(value) in shipped_assets("meshes") else str(path.absolute())


def param(
    default: Any,
    *,
    unit: str = "1",
    low: float = -math.inf,
    high: float = math.inf,
    doc: str,
    live: bool = False,
    scale: str = "linear",
    choices: Iterable[str] = (),
    files: tuple[str, ...] = (),
) -> Any:
    """Declare a dataclass field that is a parameter: default (SI), unit, allowed range, one-line doc.

    ``choices`` may be a registry (``solver.plugins``): its names are asked for with the first value that is looked up.
    """
    metadata = {
        "unit": unit,
        "low": low,
        "high": high,
        "doc": doc,
        "live": live,
        "scale": scale,
        "choices": choices,
        "files": files,
    }
    return dataclasses.field(default=default, metadata={"parameter": metadata})


def declared(kind: Any, prefix: str) -> dict[str, Parameter]:
    """Parameters declared in dataclass ``kind``: path ``prefix.field`` → :class:`Parameter`."""
    return dict(_declared(kind if isinstance(kind, type) else type(kind), prefix))


@lru_cache(maxsize=10_000)
def _declared(kind: Any, prefix: str) -> dict[str, Parameter]:
    # Asked for with every value that is looked up, and the same for the life of the program.
    found = {}
    for field in dataclasses.fields(kind):
        if "parameter" in field.metadata:
            path = f"{prefix}.{field.name}"
            known = field.metadata["parameter"]
            found[path] = Parameter(path=path, **known | {"choices": tuple(known["choices"])})
    return found


def parse_quantity(value: Any, unit: str, path: str) -> float:
    """Number in SI from a number or a string with a unit suffix, e.g. ``"56.3MPa"`` → 56.3e6 for unit ``"Pa"``.

    Raises :class:`ParameterError` for text that is no number, a non-finite number, or a suffix of another dimension.
    """
    if isinstance(value, bool):
        raise ParameterError(f"{path}: {value!r} is not a number")
    if isinstance(value, (int, float)):
        number = float(value)
    else:
        match = _QUANTITY.match(str(value))
        if not match:
            raise ParameterError(f"{path}: {value!r} is not a number with an optional unit, such as {_example(unit)}")
        suffix = match[2] or ""
        factors = UNITS.get(unit, {unit: 1.0})
        if suffix and suffix not in factors:
            allowed = ", ".join(name or "(none)" for name in factors)
            raise ParameterError(f"{path}: unit {suffix!r} is not one of {allowed}")
        number = float(match[1]) * (factors[suffix] if suffix else 1.0)
    if not math.isfinite(number):
        raise ParameterError(f"{path}: {value!r} is not a finite number")
    return number


def _example(unit: str) -> str:
    return {"Pa": "56.3MPa", "m": "65mm", "kg": "30g", "kg/s": "20g/s"}.get(unit, "0.5")
