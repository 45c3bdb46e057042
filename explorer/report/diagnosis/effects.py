"""Every effect that was considered: how much of it the data want, what that gains, and why it is named or not."""

from __future__ import annotations

from explorer.report.content import Section, Table, Text
from explorer.report.diagnosis.findings import (
    amplitudes_of,
    gate_named,
    literature_bound,
    members,
    named,
    simulated_range,
)
from explorer.report.findings import Plain
from explorer.report.units_for_people import MISSING, code, fixed, p_value, percent, signed
from solver.effects import EFFECTS


def effects(result: Plain) -> Section:
    """The race, and beside it the range, literature and lever of every effect."""
    text = (
        "Every effect is calibrated with the parameters on equal footing. Reach: the largest shift that it can cause "
        f"within its range, in σ of these data after recalibration; below {fixed(result['limits']['reach'], 1)} it is "
        "not identifiable here and does not race. T² and ΔB: misfit, and distance to the best (ΔB charges for "
        "parameters and for uncertainty that an effect brings). Drop: fall of T² under the declared model's own noise, "
        "with its chance p where nothing is missing. Cosine: likeness of its pattern to that of the best."
    )
    return Section("Effects", (Text(text), _race(result), _bounds(result)))


def effect_verdict(result: Plain, row: Plain) -> str:
    """Why an effect is named or not, in a few words."""
    limits = result["limits"]
    if row["status"] == "not simulated":
        return "not simulated"
    if row["status"] == "not identifiable here":
        return f"not identifiable here: reach below {fixed(limits['reach'], 1)} σ"
    if any(row["name"] in members(label) for label in named(result)):
        return "named"
    if row["delta"] is None:
        return "no residual to explain"
    if row["delta"] > 0.0:
        distance = (
            f"ΔB {fixed(row['delta'], 1)} {'<' if row['delta'] < limits['gap'] else '≥'} {fixed(limits['gap'], 0)}"
        )
        return f"behind the best: {distance}" if row["delta"] >= limits["gap"] else f"close to the best: {distance}"
    gate = gate_named(result, f"adequate: {row['name']}")
    return "best single effect" if gate is None else f"best, but not adequate (p = {p_value(gate['p'])})"


def _race(result: Plain) -> Table:
    rows = []
    for row in sorted(result["effects"], key=_order):
        rows.append(
            (
                code(row["name"]),
                effect_verdict(result, row),
                amplitudes_of(row["amplitudes"]) or MISSING,
                _sigma(row["reach"]),
                fixed(row["t2"], 1),
                fixed(row["drop"], 1),
                p_value(row["p_drop"]),
                fixed(row["delta"], 1),
                percent(row["weight"]),
                signed(row["cosine"]),
            )
        )
    header = ("effect", "verdict", "amplitude", "reach", "T²", "drop", "p", "ΔB", "weight", "cosine")
    caption = (
        "Amplitudes by the standard error of the fit; the winner's interval in the first section is by bootstrap. "
        "Weight: exp(−B/2), shared out among the single effects in the race; it is no probability that an effect is "
        "there."
    )
    return Table(header, tuple(rows), caption)


def _bounds(result: Plain) -> Table:
    rows = tuple(
        (
            code(row["name"]),
            simulated_range(result, row["name"]),
            literature_bound(row["name"]),
            EFFECTS[row["name"]].literature,
            EFFECTS[row["name"]].lever,
        )
        for row in result["effects"]
    )
    header = ("effect", "simulated", "strongest supported", "by", "what reveals it")
    return Table(
        header, rows, "A range ends where the effect shifts the numbers far enough to be told, or at that bound."
    )


def _order(row: Plain) -> tuple[bool, float, float]:
    delta = row["delta"] if row["delta"] is not None else -(row["drop"] or 0.0)
    return row["status"] != "raced", delta, -(row["reach"] or 0.0)


def _sigma(shift: float | None) -> str:
    return MISSING if shift is None else f"{fixed(shift, 1)} σ"
