"""How many pours a diagnosis spends on its models. Imports nothing that compiles, because the page uses it too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from doe.declared.model import declare
from doe.declared.points import directions_of
from doe.errors import StatisticsError
from doe.measurement.measurement import Measurement


@dataclass(frozen=True)
class Budget:
    """Pours that a diagnosis spends on its models in each condition."""

    base: int = 24
    screening: int = 6
    """For each direction of an effect."""
    more: int = 8
    """At each look, for what stays in question."""
    looks: int = 4

    def planned(self, directions: int, conditions: int) -> int:
        """Pours before the first look, if every amplitude is found at once."""
        return conditions * (self.base + directions * self.screening)

    def scaled(self, runs: int, directions: int, conditions: int) -> Budget:
        """The same proportions in at most ``runs`` pours. Raises StatisticsError if ``LEAST`` needs more."""
        least = LEAST.planned(directions, conditions)
        if runs < least:
            raise StatisticsError(
                f"budget: {runs} pours; allowed: at least {least} for {directions} directions of effects in "
                f"{conditions} fitted conditions"
            )
        share = runs / self.planned(directions, conditions)
        # Numbers held at their minimum are paid for by the others.
        while (found := self._shares(share)).planned(directions, conditions) > runs:
            share *= 0.99
        return found

    def _shares(self, share: float) -> Budget:
        own = {name: getattr(self, name) for name in ("base", "screening", "more")}
        return replace(self, **{key: max(getattr(LEAST, key), round(share * value)) for key, value in own.items()})


LEAST = Budget(base=12, screening=2, more=4)
"""With fewer pours no covariance can be estimated."""


def scaled_budget(runs: int, measurement: Measurement, effects: Sequence[str]) -> Budget:
    """The budget of about ``runs`` pours before the first closer look. Raises StatisticsError for too few."""
    directions = sum(len(directions_of(effect)) for effect in declare(measurement, effects).effects)
    return Budget().scaled(runs, directions, len(measurement.fit))
