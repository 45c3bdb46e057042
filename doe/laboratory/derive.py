"""From rows to a derived quantity: one value per replicate, summed up."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from doe.laboratory.replicates import summarise
from doe.laboratory.result import Derived
from doe.laboratory.tables import Row, Table


def derived(
    table: Table,
    name: str,
    unit: str,
    of: tuple[str, ...],
    formula: str,
    replicates: Sequence[str],
    values: Sequence[float],
    parameter: str = "",
    notes: tuple[str, ...] = (),
) -> Derived:
    """A quantity with the summary of its ``values`` (SI), one per replicate."""
    names, numbers = tuple(replicates), tuple(values)
    return Derived(name, unit, of, formula, table.file, names, numbers, summarise(numbers), parameter, notes)


def per_row(
    table: Table, name: str, unit: str, formula: str, value: Callable[[Row], float], parameter: Callable[..., str]
) -> tuple[Derived, ...]:
    """``value`` of every row, one quantity per component or pair; ``parameter`` makes its path from the names."""
    return tuple(
        derived(table, name, unit, of, formula, [row.replicate for row in rows], list(map(value, rows)), parameter(*of))
        for of, rows in table.groups().items()
    )


def no_parameter(*of: str) -> str:
    """For what is measured and no part of the model."""
    return ""
