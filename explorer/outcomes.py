"""How a pour ended, in words."""

from __future__ import annotations

from solver.pours.record import Outcome


def outcome_text(outcome: Outcome, message: str) -> str:
    """E.g. "jammed: 4.1 g stay in the funnel"; the outcome alone where there is no message."""
    words = outcome.value.replace("_", " ")
    return f"{words}: {message}" if message else words
