"""The race: every effect that this data set can see, calibrated on equal footing; pairs where no single one will do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from doe.diagnose.decision.gates import criterion
from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.fitting.calibrate import Evidence, Fit, calibrate, fit_with_covariance
from doe.diagnose.runs import Declared

FINALISTS = 6
"""Pairs that are calibrated with their own Sigma, chosen by their fit under the Sigma of the best single effect."""


@dataclass(frozen=True)
class Race:
    """Fits by label ("a" or "a+b") with their criterion B (gates.py), smaller is better."""

    fits: dict[str, Fit]
    criteria: dict[str, float]

    @property
    def best(self) -> str:
        """Return the label of the least criterion."""
        return min(self.criteria, key=lambda name: self.criteria[name])

    def without(self, names: Sequence[str]) -> Race:
        """Return the race without some of its models."""
        left = [name for name in self.fits if name not in names]
        return Race({name: self.fits[name] for name in left}, {name: self.criteria[name] for name in left})


def label_of(declared: Declared, members: Sequence[int]) -> str:
    """Return "a", "a+b" or "base"."""
    return "+".join(declared.effects[e].name for e in members) or "base"


def race_singles(emulator: Emulator, evidence: Evidence, base: Fit, effects: Sequence[int]) -> Race:
    """Calibrate the model with each effect."""
    return _race(emulator, evidence, base, [(e,) for e in effects])


def race_pairs(emulator: Emulator, evidence: Evidence, base: Fit, best_single: Fit, effects: Sequence[int]) -> Race:
    """Calibrate the FINALISTS of all pairs of effects."""
    scored = []
    for members in combinations(effects, 2):
        fit = fit_with_covariance(emulator.predictor(members), members, evidence, best_single.sigma)
        scored.append((criterion(fit, base, evidence), members))
    return _race(emulator, evidence, base, [members for _, members in sorted(scored)[:FINALISTS]])


def _race(emulator: Emulator, evidence: Evidence, base: Fit, entries: Sequence[tuple[int, ...]]) -> Race:
    fits = {label_of(emulator.declared, members): calibrate(emulator, members, evidence) for members in entries}
    return Race(fits, {name: criterion(fit, base, evidence) for name, fit in fits.items()})
