"""Confirmation by fresh pours: both models at their best fits, in the fitted and in the held-out conditions.

The seeds are those of no training pour. Held-out data never choose an answer: they report the error, and they may
withdraw an answer (``doe/holdout.py``).

For scanned piles the same pours show where on the plate the residual is. No decision depends on that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.declared.model import Declared
from doe.declared.points import Point
from doe.declared.pours import ModelPours, PointPour
from doe.diagnose.posterior import Fit
from doe.diagnose.result import CalibratedModel
from doe.measurement.features import coarse_map
from doe.measurement.measurement import Condition
from doe.measurement.piles import PileSurface
from doe.measurement.residual_map import ResidualMap, height_difference

FloatArray = npt.NDArray[np.float64]


def model_of(fit: Fit, declared: Declared) -> CalibratedModel:
    """Calibrated model of ``fit``, with parameters and amplitudes limited to their ranges."""
    amplitudes: dict[str, tuple[float, ...]] = {}
    ranges = {effect.name: effect for effect in declared.effects}
    for one in fit.amplitudes:
        own = ranges[one.effect]
        value = min(own.high[one.index], max(own.low[one.index], one.value))
        amplitudes[one.effect] = (*amplitudes.get(one.effect, ()), value)
    return CalibratedModel(declared.natural(fit.theta), tuple(amplitudes.items()))


@dataclass(frozen=True)
class Confirmed:
    """Summaries of the fresh pours of one model, per condition (n, d_c).

    broken: number of pours left out because they broke off or could not be read.
    profiles: height profiles of the same pours, per condition (n, k_c) [m]; k_c = 0 if none were measured.
    """

    model: CalibratedModel
    blocks: tuple[FloatArray, ...]
    broken: int
    profiles: tuple[FloatArray, ...] = ()


def confirm(
    models: Sequence[CalibratedModel],
    pours: ModelPours,
    number: int,
    widths: Sequence[int],
    where: Sequence[int] | None = None,
    sequence: str = "confirm",
) -> tuple[Confirmed, ...]:
    """Pour each model ``number`` times in every condition of ``pours``, or only in ``where``.

    ``widths``: number of summaries in each condition. Another ``sequence`` has other seeds.
    """
    points = [point for model in models for point in confirming(model, number, sequence)]
    # Run all together, so that no worker idles at the end of one model.
    rows = iter(pours.run(f"{sequence}: {', '.join(model.name for model in models)}", points, where))
    return tuple(_confirmed(model, [next(rows) for _ in range(number)], widths) for model in models)


def confirming(model: CalibratedModel, number: int, sequence: str = "confirm") -> list[Point]:
    """Points of the ``number`` pours that confirm ``model``."""
    return [Point(f"{sequence} {number}", k, model.theta, model.effects) for k in range(number)]


def _confirmed(model: CalibratedModel, rows: Sequence[Sequence[PointPour]], widths: Sequence[int]) -> Confirmed:
    blocks, profiles, broken = [], [], 0
    for c, width in enumerate(widths):
        valid = [row[c] for row in rows if row[c].valid and np.isfinite(row[c].summaries).all()]
        broken += len(rows) - len(valid)
        blocks.append(np.array([pour.summaries for pour in valid]).reshape(len(valid), width))
        profiles.append(np.array([pour.profile for pour in valid]).reshape(len(valid), -1 if valid else 0))
    return Confirmed(model, tuple(blocks), broken, tuple(profiles))


def residual_maps(
    conditions: Sequence[Condition], before: Confirmed, after: Confirmed, pours: ModelPours, number: int
) -> tuple[ResidualMap, ...]:
    """Residual maps of those ``conditions`` that have scans of at least two piles.

    ``conditions`` are those of ``pours``. ``number``: pours of each model that were asked for.
    """
    found = []
    for c, condition in enumerate(conditions):
        if len(condition.surfaces) < 2:
            continue
        scans = [coarse_map(surface, condition) for surface in condition.surfaces.values()]
        measured = np.array([scan.height for scan in scans])
        differences = {}
        for model in dict.fromkeys((before.model, after.model)):
            records = pours.records(confirming(model, number), c)
            poured = [coarse_map(PileSurface(record.pile.spheres), condition).height for record in records]
            if len(poured) > 1:
                differences[model] = height_difference(measured, np.array(poured))
        if {before.model, after.model} <= differences.keys():
            both = (differences[one.model] for one in (before, after))
            found.append(ResidualMap(condition.name, condition.role, scans[0].pixel, measured.mean(axis=0), *both))
    return tuple(found)
