"""Numbers, units and names as a person reads and enters them: SI inside, MPa, mm, g/s and ° on page and in reports."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from solver import RIGS, load_material, parameters, with_rig
from solver.observables import OBSERVABLES
from solver.params import UNITS, Parameter

READ_IN = {"Pa": "MPa", "m": "mm", "kg": "g", "kg/s": "g/s", "J/m3": "kJ/m3", "J/m2": "mJ/m2", "N/m": "mN/m"}
"""SI unit → the unit that is read instead of it, as files spell it; all others are read as they are."""
ENTERED_IN_SI = ("J/m3", "J/m2", "N/m")
"""Of these the page and the command line show and take SI: amplitudes of effects, which start at 0."""
SYMBOLS = {"deg": "°", "kg/m3": "kg/m³", "m/s2": "m/s²", "kJ/m3": "kJ/m³", "mJ/m2": "mJ/m²", "m3": "m³", "1": ""}
"""Unit as files spell it → its symbol in a report, where that is another."""
MISSING = "–"
"""What stands for a number that could not be computed."""
OWN = "own:"
"""Beginning of the path of a quantity that no scene declares: "own:NAME [UNIT]", its values in that unit already."""
MANY = 1e6
"""From here on a number is written with an exponent."""
UNIT_ENDINGS = ("_deg", "_kg_m3", "_m", "_s", "_kg")
"""What ends the name of an observable, and is no word of its label."""


class InputError(ValueError):
    """A number from the page that cannot be used; one line, fit for a user."""


@dataclass(frozen=True)
class ReadingUnit:
    """A unit for people: its symbol and its size in SI."""

    symbol: str
    size: float

    def of(self, value: float) -> float:
        """SI → this unit."""
        return value / self.size

    def to_screen(self, value: float) -> float:
        """SI → this unit, to six digits: what a number box shows."""
        return float(f"{self.of(value):.6g}")

    def to_si(self, number: float) -> float:
        """This unit → SI."""
        return number * self.size

    def attach(self, text: str) -> str:
        """``text`` with the symbol behind it; a degree sign takes no blank."""
        if text == MISSING or not self.symbol:
            return text
        return f"{text}{self.symbol}" if self.symbol == "°" else f"{text} {self.symbol}"


def reading_unit(si: str) -> ReadingUnit:
    """Unit in which a report writes a number in the SI unit ``si``."""
    name = READ_IN.get(si, si)
    return ReadingUnit(SYMBOLS.get(name, name), UNITS.get(si, {}).get(name, 1.0))


def entry_unit(si: str) -> ReadingUnit:
    """Unit in which page and command line show and take a number in the SI unit ``si``, as files spell it."""
    name = si if si in ENTERED_IN_SI else READ_IN.get(si, si)
    return ReadingUnit("" if name == "1" else name, UNITS.get(si, {}).get(name, 1.0))


def screen_unit(parameter: Parameter) -> ReadingUnit:
    """Unit in which ``parameter`` is shown and entered; no symbol for a plain number."""
    return entry_unit(parameter.unit)


def title(parameter: Parameter) -> str:
    """Name of a parameter for a label: last part of its path, with the unit on the screen."""
    words = parameter.path.split(".")[-1].replace("_", " ").capitalize()
    unit = screen_unit(parameter).symbol
    return f"{words} [{unit}]" if unit else words


def quantity(value: float, si: str) -> str:
    """Short text of a value in SI with the unit of the screen, e.g. 0.03, "kg" → "30 g"."""
    unit = entry_unit(si)
    return unit.attach(f"{unit.of(value):.4g}") if math.isfinite(value) else MISSING


def checked(number: object, low: float, high: float, name: str) -> float:
    """A number that came from a browser, within ``low`` … ``high``.

    viser checks nothing on the server: anything can arrive here. A number outside the range is taken as its
    end; what is no finite number raises InputError.
    """
    if isinstance(number, bool) or not isinstance(number, (int, float)) or not math.isfinite(number):
        raise InputError(f"{name}: {str(number)[:40]!r} is not a finite number")
    return min(max(float(number), low), high)


def own_path(name: str, unit: str) -> str:
    """Path of a quantity of someone's own, read in ``unit``; "" for a plain number."""
    return f"{OWN}{name} [{unit}]"


def _own(path: str) -> tuple[str, str]:
    """Words and unit of a quantity of someone's own."""
    name, _, unit = path.removeprefix(OWN).rpartition(" [")
    return name.replace("_", " "), unit.removesuffix("]")


@cache
def parameter_units() -> dict[str, str]:
    """Last part of a parameter's path → its SI unit, as the solver declares it in any rig."""
    scene = load_material("sunflower_extract")
    declared = [one for name in RIGS for one in parameters(with_rig(scene, name)).values()]
    return {parameter.path.rsplit(".", 1)[-1]: parameter.unit for parameter in declared}


def unit_of_parameter(path: str) -> ReadingUnit:
    """Unit in which the parameter ``path`` is read; without symbol for a plain number."""
    if path.startswith(OWN):
        return ReadingUnit(_own(path)[1], 1.0)
    return reading_unit(parameter_units().get(path.rsplit(".", 1)[-1], "1"))


def unit_of_observable(name: str) -> ReadingUnit:
    """Unit in which the observable ``name`` is read."""
    if name.startswith(OWN):
        return ReadingUnit(_own(name)[1], 1.0)
    name = name.rpartition("/")[2]
    return reading_unit(OBSERVABLES[name].unit if name in OBSERVABLES else "1")


def parameter_value(path: str, value: float | str | None) -> str:
    """A parameter's value with its unit, e.g. 5.63e7 → "56.3 MPa"; a named choice stays as it is."""
    if isinstance(value, str):
        return value
    unit = unit_of_parameter(path)
    return unit.attach(number(None if value is None else unit.of(value), 4))


def parameter_range(path: str, low: float | str | None, high: float | str | None) -> str:
    """Two values with one unit, e.g. "40.1 … 70.5 MPa"."""
    if isinstance(low, str) or isinstance(high, str):
        return f"{low} … {high}"
    if low is None or high is None or not (math.isfinite(low) and math.isfinite(high)):
        return MISSING
    unit = unit_of_parameter(path)
    return unit.attach(f"{number(unit.of(low), 4)} … {number(unit.of(high), 4)}")


def observed(name: str, value: float | None) -> str:
    """A value of an observable with its unit, e.g. "24.68°"."""
    return unit_of_observable(name).attach(observed_number(name, value))


def observed_number(name: str, value: float | None) -> str:
    """The same without its unit: two places, which suit ° and mm; what they would cut away has three digits, what takes
    an exponent four.
    """
    unit = unit_of_observable(name)
    read = None if value is None else unit.of(value)
    # Nobody knows the size of a quantity of someone's own; plain numbers are shares and ratios.
    least = 1.0 if name.startswith(OWN) or not unit.symbol else 0.01
    if read and abs(read) >= MANY:
        return number(read, 4)
    return number(read) if read and abs(read) < least and unit.symbol != "°" else fixed(read)


def with_sign(text: str) -> str:
    """The text of a number as that of a difference: "0.31°" → "+0.31°"."""
    return text if text == MISSING or text.startswith("−") else f"+{text}"


def parameter_label(path: str) -> str:
    """Words for a path, e.g. "pair.seed.seed.static_friction" → "static friction seed–seed"."""
    if path.startswith(OWN):
        return _own(path)[0]
    kind, *names, last = path.split(".")
    words = last.replace("_", " ")
    if kind == "pair":
        return f"{words} {'–'.join(name.replace('_', ' ') for name in names)}"
    if kind in {"material", "body"} and names:
        return f"{words} {names[0].replace('_', ' ')}"
    return f"insertion {words}" if kind == "insertion" else words


def axis_title(path: str, name: str) -> str:
    """Title of an axis over the parameter ``path`` of the factor ``name``."""
    unit = unit_of_parameter(path).symbol
    return f"{name}: {parameter_label(path)}" + (f" [{unit}]" if unit else "")


def observable_label(name: str) -> str:
    """Words for an observable, with the experiment of a study in which it is read."""
    if name.startswith(OWN):
        return _own(name)[0]
    experiment, _, reading = name.rpartition("/")
    known = OBSERVABLES.get(reading)
    ending = next((one for one in UNIT_ENDINGS if reading.endswith(one)), "")
    label = (known.label if known else "") or reading.removesuffix(ending).replace("_", " ")
    return f"{label}, {experiment.replace('_', ' ')}" if experiment else label


def observable_title(name: str) -> str:
    """Title of an axis over an observable."""
    unit = unit_of_observable(name).symbol
    return observable_label(name) + (f" [{unit}]" if unit else "")


def number(value: float | None, digits: int = 3) -> str:
    """``digits`` significant digits, without exponent between 1e-4 and 1e6."""
    if value is None or not math.isfinite(value):
        return MISSING
    rounded = float(f"{value:.{digits}g}")
    if rounded == 0 or 1e-4 <= abs(rounded) < MANY:
        decimals = 0 if rounded == 0 else max(0, digits - 1 - math.floor(math.log10(abs(rounded))))
        text = f"{rounded:.{decimals}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    else:
        text = f"{rounded:.{digits - 1}e}"
    return text.replace("-", "−")


def fixed(value: float | None, decimals: int = 2) -> str:
    """A number with ``decimals`` places."""
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{value:.{decimals}f}".replace("-", "−")


def signed(value: float | None, decimals: int = 2) -> str:
    """A number with its sign and ``decimals`` places."""
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{value:+.{decimals}f}".replace("-", "−")


def p_value(p: float | None) -> str:
    """A probability with four places; smaller ones as "<0.0001"."""
    if p is None or not math.isfinite(p):
        return MISSING
    return "<0.0001" if p < 1e-4 else f"{p:.4f}"


def percent(share: float | None, decimals: int = 0) -> str:
    """A share as a percentage."""
    return MISSING if share is None or not math.isfinite(share) else f"{fixed(100 * share, decimals)} %"


def duration(seconds: float | None) -> str:
    """A duration in s below two minutes, else in min."""
    if seconds is None or not math.isfinite(seconds):
        return MISSING
    return f"{number(seconds)} s" if seconds < 120 else f"{fixed(seconds / 60, 1)} min"


def code(text: str) -> str:
    """A code span; backticks inside would end it and become apostrophes."""
    return "`" + text.replace("`", "'") + "`"


def term_text(term: str) -> str:
    """A term of a model, or a source of variation, as it is read: "A*B^2" → "A × B²"."""
    return term.replace("*", " × ").replace("^2", "²")


def counted(n: int, what: str) -> str:
    """ "1 factor", "2 factors"; of "degree of freedom" the first word changes."""
    first, of, rest = what.partition(" of ")
    return f"{n} {first}{'' if n == 1 else 's'}{of}{rest}"


def enumeration(items: Sequence[str]) -> str:
    """ "a", "a and b", "a, b and c"; "none" for an empty list."""
    if not items:
        return "none"
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"
