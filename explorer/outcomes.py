"""How a pour ended, in words: as a sentence, in a word or two, and with its message."""

from __future__ import annotations

from solver.pours.record import Outcome

OUTCOME_SENTENCES = {
    Outcome.RUNNING: "still running",
    Outcome.AT_REST: "at rest: a valid pile",
    Outcome.MEASURED: "measured: the run lasted its time",
    Outcome.NO_HEAP: "at rest: no heap, a flat layer or a few grains",
    Outcome.JAMMED: "jammed: material stays in the rig",
    Outcome.OBSTRUCTED: "obstructed: a body lies across the outlet",
    Outcome.TIME_LIMIT: "cut off: still moving at the time limit",
    Outcome.LOST_BODY: "lost a body through the plate",
    Outcome.NON_FINITE: "diverged: a number is not finite",
    Outcome.OVERLAP_LIMIT: "stopped: bodies overlap too far",
    Outcome.BUFFER_OVERFLOW: "stopped: the contact list is full",
}
OUTCOME_WORDS = {
    Outcome.AT_REST: "at rest",
    Outcome.NO_HEAP: "no heap",
    Outcome.JAMMED: "jammed",
    Outcome.OBSTRUCTED: "obstructed",
    Outcome.NON_FINITE: "unstable",
    Outcome.OVERLAP_LIMIT: "unstable",
}
"""Those that are said beside what the solver does."""
WARNINGS = tuple(word for outcome, word in OUTCOME_WORDS.items() if outcome != Outcome.AT_REST)
"""Of these words, what a person has to see."""


def outcome_text(outcome: str, message: str = "") -> str:
    """E.g. "jammed: 4.1 g stay in the funnel"; the outcome alone where there is no message."""
    words = str(outcome).replace("_", " ")
    return f"{words}: {message}" if message else words
