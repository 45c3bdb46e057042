"""Confirmation by fresh pours: both models at their best fits, in the fitted and in the held-out conditions.

The seeds are those of no run that the emulator saw. Both models are poured with the same seeds, so that they begin with
the same places and orientations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.plan import Point
from doe.diagnose.pours import ModelPours
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


@dataclass(frozen=True)
class Confirmed:
    """Summaries of the fresh pours of one model, per condition (n, d_c); pours that broke off are left out."""

    model: Model
    blocks: tuple[FloatArray, ...]
    broken: int


def confirm(model: Model, pours: ModelPours, number: int, widths: Sequence[int]) -> Confirmed:
    """Pour ``model`` ``number`` times in every condition of ``pours``; ``widths``: summaries per condition."""
    points = [Point(f"confirm {number}", k, model.theta, model.effects) for k in range(number)]
    rows = pours.run(f"confirmation of {model.name}", points)
    blocks, broken = [], 0
    for c, width in enumerate(widths):
        valid = [row[c].summaries for row in rows if row[c].valid]
        broken += len(rows) - len(valid)
        blocks.append(np.array(valid).reshape(len(valid), width))
    return Confirmed(model, tuple(blocks), broken)
