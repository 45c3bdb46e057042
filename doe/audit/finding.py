"""What an audit says: of every figure whether it is reproduced, and remarks on what is no figure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from doe.audit.printed import Interval, Printed
from doe.record import Record

Status = Literal["reproduced exactly", "only if rounded", "differs", "cannot be checked"]


@dataclass(frozen=True)
class Figure(Record):
    """One printed figure, or one group of figures that cannot be checked.

    check: the general check that was made. where: table, equation or section. printed: as printed. recomputed: a
    number in the unit of the print, words, or None. slack: how far rounding of what went in can move it. how: from
    what it was recomputed, or why it cannot be. status: "reproduced exactly" where the recomputed value rounds to the
    print, or a value that the prints of its own table allow; "only if rounded" where it does so within the slack.
    """

    check: str
    where: str
    quantity: str
    status: Status
    printed: str
    recomputed: float | str | None
    slack: float
    how: str


@dataclass(frozen=True)
class Remark(Record):
    """Something that a check found which is no figure: a sentence with its numbers."""

    check: str
    where: str
    text: str


Finding = Figure | Remark


@dataclass(frozen=True)
class Audit(Record):
    """All findings about one study."""

    title: str
    source: str
    figures: tuple[Figure, ...]
    remarks: tuple[Remark, ...]

    def having(self, *statuses: Status) -> tuple[Figure, ...]:
        """The figures with one of these."""
        return tuple(figure for figure in self.figures if figure.status in statuses)


def compared(
    check: str,
    where: str,
    quantity: str,
    print_: Printed,
    value: float,
    how: str,
    slack: float = 0.0,
    rounded: str = "what it is computed from was rounded",
) -> Figure:
    """A figure held against what was recomputed, first as it is, then with the slack that rounding of its inputs gives.

    rounded: what has to have been rounded for that. Where nothing finite comes out, the figure cannot be checked.
    """
    if not math.isfinite(value):
        return unchecked(check, where, quantity, f"{how}: not defined for the printed numbers", print_.text)
    status: Status = "differs"
    if print_.agrees(value):
        status = "reproduced exactly"
    elif print_.agrees(value, slack):
        status, how = "only if rounded", f"{how}; only if {rounded}, which moves it by up to ± {slack:.2g}"
    return Figure(check, where, quantity, status, print_.text, value, slack, how)


def within(
    check: str, where: str, quantity: str, print_: Printed, value: float, interval: Interval, how: str
) -> Figure:
    """A figure held against all that the prints of its own table, each within its rounding, can give."""
    status: Status = "reproduced exactly" if print_.meets(interval) else "differs"
    slack = max(value - interval[0], interval[1] - value)
    return Figure(check, where, quantity, status, print_.text, value, slack, how)


def unchecked(check: str, where: str, quantity: str, why: str, print_: str = "") -> Figure:
    """A figure that nothing in the publication can be held against."""
    return Figure(check, where, quantity, "cannot be checked", print_, None, 0.0, why)


def short(value: float, digits: int = 4) -> str:
    """A number inside a sentence."""
    return f"{value:.{digits}g}"


def like(value: float, print_: Printed) -> str:
    """A number with the decimals of a print."""
    return f"{value:.{print_.decimals}f}"
