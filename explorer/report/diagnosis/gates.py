"""The gates in the order in which they were asked: detect, adequate, unambiguous."""

from __future__ import annotations

from explorer.report.content import Section, Table, Text
from explorer.report.findings import Plain
from explorer.report.units_for_people import MISSING, fixed, number, p_value


def gates(result: Plain) -> Section:
    """One row per test, with its statistic, limit and what it decided."""
    limits = result["limits"]
    text = (
        "A residual counts as more than noise if either detection test has p ≤ "
        f"{number(limits['detect'])}; both are calibrated by {result['bootstrap']} data sets made up from the declared "
        f"model and fitted anew, so that no p can be below {number(1 / (1 + result['bootstrap']))}. A model is "
        f"adequate if its own misfit has p ≥ {number(limits['adequate'])}, and unambiguous if the next one is at least "
        f"{fixed(limits['gap'], 0)} behind in B. A pair is asked only where no single effect is adequate, and has to "
        f"gain more than {fixed(limits['pair_gain'], 0)}."
    )
    rows = tuple(
        (
            gate["name"],
            fixed(gate["statistic"], 1),
            MISSING if gate["p"] is None else p_value(gate["p"]),
            _limit(gate),
            outcome(gate),
            gate["statement"],
        )
        for gate in result["gates"]
    )
    return Section("Gates", (Text(text), Table(("gate", "statistic", "p", "limit", "outcome", "in words"), rows)))


def outcome(gate: Plain) -> str:
    """What a gate decided."""
    passed, failed = {
        "detect": ("more than noise", "within the noise"),
        "adequate": ("fits", "does not fit"),
        "unambiguous": ("stands alone", "others come near"),
        "pair gain": ("worth a pair", "not worth a pair"),
    }[_question(gate)]
    return passed if gate["passed"] else failed


def _limit(gate: Plain) -> str:
    sign, of = {
        "detect": ("≤", "p"),
        "adequate": ("≥", "p"),
        "unambiguous": ("≥", "gap"),
        "pair gain": (">", "gain"),
    }[_question(gate)]
    return f"{of} {sign} {number(gate['limit'])}"


def _question(gate: Plain) -> str:
    name: str = gate["name"]
    return next(start for start in ("detect", "adequate", "unambiguous", "pair gain") if name.startswith(start))
