"""Numbers that a person enters, or leaves out."""

from __future__ import annotations

import math

from explorer.errors import CommandError


def positive(entered: object) -> float | None:
    """A number above zero; None for 0, which stands for none, and for what is no number."""
    number = float(entered) if isinstance(entered, int | float) else math.nan
    return number if math.isfinite(number) and number > 0.0 else None


def number_or_none(text: str, what: str) -> float | None:
    """A number that a person typed, None for nothing; CommandError for anything else."""
    if not text.strip():
        return None
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise CommandError(f"{what} {text.strip()[:40]!r}: allowed is a number, or nothing")
    return number
