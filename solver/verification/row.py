"""One line of the verification's table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """A number of ours beside its reference."""

    test: str
    """T1 … T8 of Chung & Ooi (2011), or the name of an invariant."""
    quantity: str
    """What is compared, with its unit; the points of one curve share it."""
    at: str
    """Where on the curve, e.g. ``θ = 50°``; empty for a single number."""
    reference: float
    ours: float
    scale: float
    """What 100 % of error are: the reference itself, the span of the tabulated curve, or a natural size."""
    scale_name: str
    limit: float | None
    """Largest error allowed [%]; None: shown for comparison, judged by nothing."""
    source: str
    """Where the reference comes from."""

    @property
    def error(self) -> float:
        """(ours − reference)/scale [%]."""
        return 100.0 * (self.ours - self.reference) / self.scale

    @property
    def passed(self) -> bool:
        """True within the limit, and where there is none; a NaN is not within it."""
        return self.limit is None or abs(self.error) <= self.limit


def of_value(
    test: str, quantity: str, reference: float, ours: float, limit: float | None, source: str, at: str = ""
) -> Row:
    """A row whose error is relative to the reference."""
    return Row(test, quantity, at, float(reference), float(ours), abs(float(reference)), "value", limit, source)


def of_scale(
    test: str,
    quantity: str,
    reference: float,
    ours: float,
    scale: tuple[float, str],
    limit: float | None,
    source: str,
    at: str = "",
) -> Row:
    """A row whose error is relative to ``scale``, a size and its name (the span of a curve, a speed)."""
    return Row(test, quantity, at, float(reference), float(ours), float(scale[0]), scale[1], limit, source)
