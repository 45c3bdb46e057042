"""Confirmation by fresh pours: both models at their best fits, in the fitted and in the held-out conditions.

The seeds are those of no run that the emulator saw. Both models are poured with the same seeds, so that they begin with
the same places and orientations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.decision.verdict import Verdict
from doe.diagnose.simulation.plan import Point
from doe.diagnose.simulation.pours import ModelPours, Pour
from doe.record import Record

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Model(Record):
    """A calibrated model: parameters in natural units and the amplitudes of the effects that are on."""

    theta: tuple[float, ...]
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()

    @property
    def name(self) -> str:
        """ "base", or the effects' names."""
        return "+".join(name for name, _ in self.effects) or "base"


def fitted(verdict: Verdict, label: str) -> Model:
    """The model ``label`` of the race ("base", "a" or "a+b") as it was fitted to the data."""
    found = next(model for model in verdict.models if model.label == label)
    amplitudes: dict[str, tuple[float, ...]] = {}
    for one in sorted(found.amplitudes, key=lambda one: one.index):
        amplitudes[one.effect] = (*amplitudes.get(one.effect, ()), one.value)
    return Model(found.parameters, tuple((name, amplitudes[name]) for name in label.split("+") if name in amplitudes))


@dataclass(frozen=True)
class Confirmed:
    """Summaries of the fresh pours of one model, per condition (n, d_c).

    broken: pours left out because they broke off or left nothing to be read.

    profiles: the height profiles of the same pours, per condition (n, k_c) [m]; k_c = 0 without measured ones.
    """

    model: Model
    blocks: tuple[FloatArray, ...]
    broken: int
    profiles: tuple[FloatArray, ...] = ()


def confirm(
    models: Sequence[Model],
    pours: ModelPours,
    number: int,
    widths: Sequence[int],
    where: Sequence[int] | None = None,
    sequence: str = "confirm",
) -> tuple[Confirmed, ...]:
    """Pour each model ``number`` times in every condition of ``pours``, or ``where``; ``widths``: summaries of each.

    Pours of another ``sequence`` have other seeds.
    """
    points = [Point(f"{sequence} {number}", k, model.theta, model.effects) for model in models for k in range(number)]
    # All of them at once, so that no worker waits for the last pour of a model.
    rows = iter(pours.run(f"{sequence}: {', '.join(model.name for model in models)}", points, where))
    return tuple(_confirmed(model, [next(rows) for _ in range(number)], widths) for model in models)


def _confirmed(model: Model, rows: Sequence[Sequence[Pour]], widths: Sequence[int]) -> Confirmed:
    blocks, profiles, broken = [], [], 0
    for c, width in enumerate(widths):
        valid = [row[c] for row in rows if row[c].valid and np.isfinite(row[c].summaries).all()]
        broken += len(rows) - len(valid)
        blocks.append(np.array([pour.summaries for pour in valid]).reshape(len(valid), width))
        profiles.append(np.array([pour.profile for pour in valid]).reshape(len(valid), -1 if valid else 0))
    return Confirmed(model, tuple(blocks), broken, tuple(profiles))
