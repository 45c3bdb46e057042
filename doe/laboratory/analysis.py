"""The tests of a bench by name: how the table of each looks, and what follows from it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from doe.laboratory import bulk, contact, tables, weighing
from doe.laboratory.contact import friction, restitution
from doe.laboratory.dimensions import FLAT, SHAPES, dimensions, size_spreads
from doe.laboratory.elastic import moduli, poisson_ratios
from doe.laboratory.result import Derived, LabResult
from doe.laboratory.sieve import SIEVE, sieve
from doe.laboratory.tables import LaboratoryError, Layout, Table, read_table, template

Analysis = Callable[[Table], LabResult]


@dataclass(frozen=True)
class BenchTest:
    """How the readings of a test are laid out, and the analysis of such a table."""

    layout: Layout
    analyse: Analysis


def _compression(table: Table) -> LabResult:
    return _elastic("compression", table)


def _shear(table: Table) -> LabResult:
    return _elastic("shear", table)


def _elastic(test: str, table: Table) -> LabResult:
    derived, curves = moduli(table, test)
    return LabResult(test, table.file, derived, curves=curves)


def _inclined_plane(table: Table) -> LabResult:
    return LabResult("inclined_plane", table.file, friction(table))


def _noted(test: str, analyse: Callable[[Table], tuple[tuple[Derived, ...], tuple[str, ...]]]) -> Analysis:
    """The analysis of a test that gives quantities, and notes on all of them."""

    def result(table: Table) -> LabResult:
        derived, notes = analyse(table)
        return LabResult(test, table.file, derived, notes=notes)

    return result


def _moisture(table: Table) -> LabResult:
    return LabResult("moisture", table.file, weighing.moisture(table))


def _density(table: Table) -> LabResult:
    return LabResult("density", table.file, weighing.density(table))


def _composition(table: Table) -> LabResult:
    return LabResult("composition", table.file, weighing.composition(table), notes=(weighing.FRACTIONS,))


def _dimensions(table: Table) -> LabResult:
    derived = dimensions(table)
    measured = {one.of[0] for one in derived if one.name == "geometric_mean_diameter"}
    flat = dict.fromkeys(one.of[0] for one in derived if one.of[0] not in measured)
    notes = (*(f"{name}: {FLAT}" for name in flat), SHAPES)
    return LabResult("dimensions", table.file, derived, size_spreads(derived), notes=notes)


TESTS: dict[str, BenchTest] = {
    "compression": BenchTest(tables.COMPRESSION, _compression),
    "shear": BenchTest(tables.FORCE_DISPLACEMENT, _shear),
    "inclined_plane": BenchTest(tables.INCLINED_PLANE, _inclined_plane),
    "drop": BenchTest(tables.DROP, _noted("drop", restitution)),
    "rebound": BenchTest(contact.REBOUND, _noted("rebound", contact.rebound)),
    "rolling": BenchTest(contact.ROLLING, _noted("rolling", contact.rolling)),
    "moisture": BenchTest(tables.MOISTURE, _moisture),
    "density": BenchTest(tables.IMMERSION, _density),
    "composition": BenchTest(tables.COMPOSITION, _composition),
    "dimensions": BenchTest(tables.DIMENSIONS, _dimensions),
    "sieve": BenchTest(SIEVE, _noted("sieve", sieve)),
    "bulk_density": BenchTest(bulk.BULK_DENSITY, _noted("bulk_density", bulk.bulk_density)),
    "drum": BenchTest(bulk.DRUM, _noted("drum", bulk.drum)),
    "draw_down": BenchTest(bulk.DRAW_DOWN, _noted("draw_down", bulk.draw_down)),
}


def template_of(test: str) -> str:
    """A sheet of ``test`` to fill in, with what to write in each column; :func:`analyse` reads it."""
    return template(test, TESTS[test].layout)


def analyse(test: str, path: Path) -> LabResult:
    """What the readings in ``path`` give; LaboratoryError in one line for a bad file."""
    if test not in TESTS:
        raise LaboratoryError(f"test {test!r}; allowed: {', '.join(TESTS)}")
    return TESTS[test].analyse(read_table(path, TESTS[test].layout))


def analyse_elastic(shear: Path, compression: Path) -> LabResult:
    """Shear tests with the compression tests of the same components: G, E and ν."""
    by_shear, by_compression = analyse("shear", shear), analyse("compression", compression)
    ratios = poisson_ratios(by_compression.derived, by_shear.derived)
    if not ratios:
        raise LaboratoryError(f"{shear} and {compression}: no component is in both; allowed: at least one")
    return LabResult(
        test="shear",
        file=by_shear.file,
        derived=by_shear.derived + by_compression.derived,
        estimates=ratios,
        curves=by_shear.curves + by_compression.curves,
    )


def analyse_composition(path: Path, left_out: Collection[str]) -> LabResult:
    """Composition without the components ``left_out``, such as impurities that are blown away."""
    table = read_table(path, TESTS["composition"].layout)
    note = f"left out: {', '.join(left_out)}; the others were scaled to add up to one"
    notes = (weighing.FRACTIONS, note) if left_out else (weighing.FRACTIONS,)
    return LabResult("composition", table.file, weighing.composition(table, left_out), notes=notes)
