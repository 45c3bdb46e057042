"""What differs between two scenes, as lines for a person."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from explorer.screen_units import quantity
from solver.scenes.scene import Scene, parameters, values


@dataclass(frozen=True)
class Difference:
    """A parameter that has two values, SI or the names of choices."""

    path: str
    before: float | str
    now: float | str
    unit: str
    live: bool
    """Whether a running pour takes a new value at once."""

    def __str__(self) -> str:
        """``path: before → now`` with the units of the screen."""
        before, now = shown(self.before, self.unit), shown(self.now, self.unit)
        if before == now:  # alike to the digits of the screen
            before, now = str(self.before), f"{self.now} {'' if self.unit == '1' else self.unit}".strip()
        return f"{self.path}: {before} → {now}"


def differences(before: Scene, now: Scene) -> Iterator[Difference]:
    """Parameters that both scenes have and that differ, in the order of ``now``."""
    old = values(before)
    declared = parameters(now)
    for path, new in values(now).items():
        if path in old and old[path] != new:
            yield Difference(path, old[path], new, declared[path].unit, declared[path].live)


def changes(before: Scene, now: Scene) -> Iterator[str]:
    """Parameters that differ between two scenes of the same materials and bodies, with both values and their unit."""
    return map(str, differences(before, now))


def shown(number: float | str, unit: str) -> str:
    """A value with the unit of the screen, or the name of a choice."""
    return number if isinstance(number, str) else quantity(number, unit)
