"""What a benchmark case tells about one engine."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Measurement:
    """One engine on one case. Contacts are those that touch at the end; rates are over the stepping loop."""

    case: str
    engine: str
    bodies: int
    spheres: int
    steps: int
    wall_s: float
    simulated_s: float
    contacts: float
    """Touching contacts at the end; NaN where the engine does not tell."""
    mean_contacts: float
    """The same over the run, sampled; NaN where the engine does not tell."""
    timed_out: bool = False
    """The engine was stopped at its time limit, ``wall_s``, before it said how many steps it had made."""

    @property
    def steps_per_s(self) -> float:
        """Steps per second of wall time; NaN if it timed out."""
        return float("nan") if self.timed_out else self.steps / self.wall_s

    @property
    def sphere_steps_per_s(self) -> float:
        """Member spheres times steps per second."""
        return self.spheres * self.steps_per_s

    @property
    def ns_per_contact(self) -> float:
        """Wall time per step and touching contact [ns], everything included."""
        return 1e9 / self.steps_per_s / self.mean_contacts if self.mean_contacts > 0.0 else float("nan")
