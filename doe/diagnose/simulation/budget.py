"""How many pours a diagnosis takes for its emulator, part by part. Loads nothing of the solver."""

from __future__ import annotations

from dataclasses import dataclass

from doe.errors import StatisticsError


@dataclass(frozen=True)
class Budget:
    """Numbers of points; each is poured once in every condition."""

    base: int = 48
    middle: int = 16
    scaling: int = 1
    """At each end that the search for a range tries; those at the end that it finds count like the screening."""
    screening: int = 4
    """Per effect with one amplitude; half as many again with two."""
    second_look: int = 8
    """More of each that pours about its fit have put out of sight, over its whole range."""
    widened: int = 6
    """Of an effect over a wider range than the first; if it stays near the best, pours about its fit follow."""

    def planned(self, effects: int, conditions: int) -> float:
        """Pours of the emulator for effects of one amplitude, ranges found at once, none ruled out, all in sight."""
        return conditions * (self.base + self.middle + effects * (self.scaling + self.screening))

    def scaled(self, runs: int, effects: int, conditions: int) -> Budget:
        """The same shares in at most ``runs`` pours. Raises StatisticsError for fewer than ``LEAST`` takes."""
        least = LEAST.planned(effects, conditions)
        if runs < least:
            raise StatisticsError(
                f"budget: {runs} pours; {effects} effects in {conditions} fitted conditions take at least {least:.0f}"
            )
        share = runs / self.planned(effects, conditions)
        # What is held at its least is taken from the rest.
        while (found := self._shares(share)).planned(effects, conditions) > runs:
            share *= 0.995
        return found

    def _shares(self, share: float) -> Budget:
        return Budget(**{key: max(getattr(LEAST, key), round(share * value)) for key, value in vars(self).items()})


LEAST = Budget(base=24, middle=10, scaling=1, screening=4, second_look=4, widened=4)
"""Below that there are fewer points than terms, or no covariance."""
