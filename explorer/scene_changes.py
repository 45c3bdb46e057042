"""What differs between two scenes, as lines for a person."""

from __future__ import annotations

from collections.abc import Iterator

from explorer.screen_units import quantity
from solver.scene import Scene, parameters, value


def changes(before: Scene, now: Scene) -> Iterator[str]:
    """Parameters that differ between two scenes of the same materials and bodies, with both values and their unit."""
    for path, parameter in parameters(now).items():
        old, new = value(before, path), value(now, path)
        if old != new:
            yield f"{path}: {_shown(old, parameter.unit)} → {_shown(new, parameter.unit)}"


def _shown(number: float | str, unit: str) -> str:
    return number if isinstance(number, str) else quantity(number, unit)
