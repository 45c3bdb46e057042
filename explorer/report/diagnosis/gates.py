"""The gates in the order in which they were asked: detect, adequate, unambiguous."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.report.content import Section, Table, Text
from explorer.report.findings import Plain
from explorer.report.units_for_people import MISSING, fixed, number, p_value


@dataclass(frozen=True)
class Question:
    """What a gate asks of p or of its statistic, and the words for both outcomes."""

    asked: str
    passed: str
    failed: str


QUESTIONS = {
    "detect": Question("p ≤", "more than noise", "within the noise"),
    "adequate": Question("p ≥", "fits", "does not fit"),
    "unambiguous": Question("gap ≥", "stands alone", "others come near"),
    "told apart": Question("p ≤", "every rival rejected", "a rival may be the truth"),
    "held out": Question("gap ≥", "bears the name out", "does not bear the name out"),
    "pair gain": Question("gain >", "worth a pair", "not worth a pair"),
    "specific": Question("chance ≤", "not by chance", "a pair fits almost anything"),
}
"""By the beginning of a gate's name."""


def gates(result: Plain) -> Section:
    """One row per test, with its statistic, limit and what it decided."""
    limits = result["limits"]
    text = (
        "A residual counts as more than noise if either detection test has p ≤ "
        f"{number(limits['detect'])}; both are calibrated by {result['bootstrap']} data sets made up from the declared "
        f"model and fitted anew, so that no p can be below {number(1 / (1 + result['bootstrap']))}. A model is "
        f"adequate if its own misfit has p ≥ {number(limits['adequate'])}, and unambiguous if the next one is at least "
        f"{fixed(limits['gap'], 0)} behind in B and every rival, taken as the truth, would let the best one lead by as "
        f"much in no more than {100 * limits['rival']:.0f} % of made-up data sets. A pair is asked only where no "
        f"single effect is adequate, and has to gain more than {fixed(limits['pair_gain'], 0)}, and be specific: "
        "few random shifts may be explained as well. Held-out data can take a name back: every rival near it predicts "
        "them by its own pours, and has to stay as far behind with them. Of several names they rule out those that are "
        f"{fixed(limits['held_out'], 0)} or more behind the first, with the fitted data and by themselves; and where a "
        f"summary of every name is off at p < {number(limits['contradicted'])}, nothing is named."
    )
    rows = tuple(
        (
            gate["name"],
            number(gate["statistic"]),
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
    question = _question(gate)
    return question.passed if gate["passed"] else question.failed


def _limit(gate: Plain) -> str:
    return f"{_question(gate).asked} {number(gate['limit'])}".strip()


def _question(gate: Plain) -> Question:
    found = (question for start, question in QUESTIONS.items() if gate["name"].startswith(start))
    return next(found, Question("", "passed", "not passed"))
