"""What a balance tells: moisture, density and composition, by differences of mass.

    moisture      w = (m_before − m_after)/(m_before − m_container), wet basis; over the dry mass instead: dry basis
    density       ρ = m ρ_l/(m + m_reference − m_with_sample)
    composition   mass fraction of every component in a sample that was sorted and weighed

One formula serves both ways to weigh a volume. Pycnometer: m_reference is the vessel full of liquid, m_with_sample the
same with the sample in it. Hydrostatic: m_reference is the sinker in the liquid (0 without one), m_with_sample sinker
and sample in the liquid. A porous body soaks: m_soaked takes the place of m in the denominator, so that the volume is
that of the soaked body. Sources: Processes 2022, 10, 185, §2.1, §2.2; Archimedes.
"""

from __future__ import annotations

from collections.abc import Collection

from doe.laboratory.result import Derived, derived, no_parameter, per_row
from doe.laboratory.tables import LaboratoryError, Reading, Table

FRACTIONS = "the fractions of a sample add up to one, so that their errors hang together"


def moisture(table: Table) -> tuple[Derived, ...]:
    """Moisture of every component as a fraction, wet and dry basis."""
    for row in table.rows:
        if row.values["mass_after"] > row.values["mass_before"]:
            raise table.wrong(row, "mass_after", "is above mass_before; allowed: up to mass_before")
        if _container(row) >= row.values["mass_after"]:
            raise table.wrong(row, "mass_container", "leaves no dry mass; allowed: below mass_after")
    wet = per_row(table, "moisture_wet_basis", "1", "(m − m_dry)/m", _wet, no_parameter)
    dry = per_row(table, "moisture_dry_basis", "1", "(m − m_dry)/m_dry", _dry, no_parameter)
    return tuple(one for both in zip(wet, dry, strict=True) for one in both)


def density(table: Table) -> tuple[Derived, ...]:
    """Density of every component [kg/m³]."""
    for row in table.rows:
        if _displaced(row) <= 0.0:
            raise table.wrong(
                row, "mass_with_sample", "leaves no displaced liquid; allowed: below mass + mass_reference"
            )
    return per_row(
        table, "density", "kg/m3", "m ρ_l/(m + m_ref − m_with)", _density, lambda of: f"materials.{of}.density"
    )


def composition(table: Table, left_out: Collection[str] = ()) -> tuple[Derived, ...]:
    """Mass fraction of every component that is not ``left_out``, of their sum in each sample."""
    groups = {of[0]: {row.replicate: row for row in rows} for of, rows in table.groups().items()}
    for name in left_out:
        if name not in groups:
            raise LaboratoryError(f"{table.file}: no component {name!r} to leave out; there are {', '.join(groups)}")
    kept = {name: rows for name, rows in groups.items() if name not in left_out}
    samples = list(dict.fromkeys(row.replicate for row in table.rows))
    for name, rows in kept.items():
        for sample in samples:
            if sample not in rows:
                raise LaboratoryError(
                    f"{table.file}: component {name} is missing in replicate {sample}; allowed: every component, with "
                    "mass 0 if absent"
                )
    totals = {sample: sum(rows[sample].values["mass"] for rows in kept.values()) for sample in samples}
    for sample, total in totals.items():
        if total <= 0.0:
            raise LaboratoryError(f"{table.file}: replicate {sample} weighs nothing; allowed: a sample with a mass")
    return tuple(
        derived(
            table,
            "mass_fraction",
            "1",
            (name,),
            "m_i/Σ m",
            samples,
            [rows[sample].values["mass"] / totals[sample] for sample in samples],
            f"body.{name}.mass_fraction",
        )
        for name, rows in kept.items()
    )


def _container(row: Reading) -> float:
    return row.values.get("mass_container", 0.0)


def _wet(row: Reading) -> float:
    return (row.values["mass_before"] - row.values["mass_after"]) / (row.values["mass_before"] - _container(row))


def _dry(row: Reading) -> float:
    return (row.values["mass_before"] - row.values["mass_after"]) / (row.values["mass_after"] - _container(row))


def _displaced(row: Reading) -> float:
    """Mass of the liquid that the sample displaces [kg]."""
    filled = row.values.get("mass_soaked", row.values["mass"])
    return filled + row.values["mass_reference"] - row.values["mass_with_sample"]


def _density(row: Reading) -> float:
    return row.values["mass"] * row.values["liquid_density"] / _displaced(row)
