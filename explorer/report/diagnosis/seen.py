"""What these data could have seen: for every effect the amplitude that would have been found, and its lever.

An effect is found with chance 0.8 where its shift δ [σ] gives the directed test over K effects, level p, that power:

    P(χ'²(m, δ²) > χ²_{1 − p/K}(m)) = 0.8,   amplitude ≈ bound · δ / reach

with m amplitudes and the reach at the bound. Linear in the amplitude, hence "about".
Source: noncentral χ², Patnaik 1949.
"""

from __future__ import annotations

from scipy import optimize, stats

from explorer.report.content import Section, Table, Text
from explorer.report.diagnosis.findings import amplitude_label, amplitude_path, kind_of, raced
from explorer.report.findings import Plain
from explorer.report.units_for_people import MISSING, code, fixed, parameter_value
from solver.effects import EFFECTS

POWER = 0.8


def could_have_seen(result: Plain) -> Section | None:
    """Smallest amplitude of every effect that would have been found; None where something was."""
    if kind_of(result) != "no_missing_effect":
        return None
    shift = {m: visible_shift(m, max(1, len(raced(result))), result["limits"]["detect"]) for m in (1, 2)}
    rows = []
    for row in result["effects"]:
        bounds = next(one for one in result["ranges"] if one["name"] == row["name"])
        wanted = shift[len(bounds["high"])]
        rows.append((code(row["name"]), _reach(row), _visible(row, bounds, wanted), EFFECTS[row["name"]].lever))
    text = (
        f"An effect that shifts the numbers by {fixed(shift[1], 1)} σ after recalibration ({fixed(shift[2], 1)} σ with "
        f"two amplitudes) would have been detected with chance {fixed(POWER, 1)}. Weaker ones may be there."
    )
    caption = (
        "Found from about: by proportion to the shift at the bound. Detected, which is less than told from all others."
    )
    header = ("effect", "reach at its bound", "found from about", "what reveals it")
    return Section("What could have been seen", (Text(text), Table(header, tuple(rows), caption)))


def visible_shift(amplitudes: int, effects: int, level: float) -> float:
    """Shift δ [σ] that the directed test over ``effects`` effects sees with chance ``POWER``."""
    limit = stats.chi2.isf(level / effects, amplitudes)
    return float(optimize.brentq(lambda d: stats.ncx2.sf(limit, amplitudes, d * d) - POWER, 0.1, 40.0))


def _reach(row: Plain) -> str:
    return MISSING if row["reach"] is None else f"{fixed(row['reach'], 1)} σ"


def _visible(row: Plain, bounds: Plain, wanted: float) -> str:
    if row["status"] == "not simulated":
        return "was not simulated"
    share = wanted / row["reach"] if row["reach"] else float("inf")
    if share > 1.0:
        return "not for certain, even at its bound"
    name = row["name"]
    return "; ".join(
        f"{amplitude_label(name, k)} {parameter_value(amplitude_path(name, k), share * max(high, -low))}"
        for k, (low, high) in enumerate(zip(bounds["low"], bounds["high"], strict=True))
    )
