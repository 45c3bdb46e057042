"""A diagnosis as three piles: the measured one, the calibrated declared model's, and the final model's."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.declared.given import with_given
from doe.declared.model import effect_values, in_rig_frame
from doe.diagnose.result import CalibratedModel
from doe.measurement.load import load_measurement
from doe.measurement.measurement import Condition, Measurement
from explorer.diagnosis.result import DiagnosisResult, PouredModel
from explorer.errors import CommandError
from solver import Scene, with_values
from solver.assets import AssetNotFoundError, measurement_folder

ANGLE = "angle_of_repose_deg"
LEAST_HEIGHT = 3e-4
"""Height [m] below which a measured surface is not drawn."""
SECTORS = 72
"""Sectors of a surface of revolution."""


@dataclass(frozen=True, eq=False)
class HeightSurface:
    """A surface over the plate [m]: vertices (v, 3) and triangles (t, 3)."""

    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int64]
    of_revolution: bool
    """Whether it was made from a mean profile, because no scan was measured."""


@dataclass(frozen=True, eq=False)
class AnswerPiles:
    """What is drawn side by side in one condition of the data."""

    condition: Condition
    before: Scene
    """The calibrated declared model."""
    after: Scene
    """The final model; the same as ``before`` if no effect was added."""
    measured: HeightSurface | None
    """None if the data hold neither scans nor profiles of this condition."""
    angle: tuple[float, float]
    """Mean and standard deviation of the measured angles of repose [°]; NaN if there are too few."""
    poured: tuple[tuple[float, float, int], tuple[float, float, int]]
    """The same for the diagnosis's fresh pours of both models, and the number of pours."""


def answer_piles(result: DiagnosisResult) -> AnswerPiles:
    """The piles of the first fitted condition. Raises a ValueError if the data no longer exist."""
    try:
        measurement = with_given(load_measurement(measurement_folder(result.data.folder)), result.given)
    except AssetNotFoundError:
        text = f"{result.data.folder}: the measured data of this diagnosis are not there any more"
        raise CommandError(text) from None
    condition = measurement.fit[0]
    return AnswerPiles(
        condition,
        model_scene(measurement, condition, result.confirmation.before),
        model_scene(measurement, condition, result.confirmation.after),
        measured_surface(result, condition.name),
        measured_angle(condition),
        (
            poured_angle(result, result.confirmation.before, condition.name),
            poured_angle(result, result.confirmation.after, condition.name),
        ),
    )


def measured_angle(condition: Condition) -> tuple[float, float]:
    """Mean and standard deviation of the angles of repose measured in ``condition`` [°]; NaN without angles."""
    found = condition.offered.get(ANGLE)
    known = np.empty(0) if found is None else np.asarray(found.values, dtype=float)
    known = known[np.isfinite(known)]
    return (
        float(known.mean()) if known.size else math.nan,
        float(known.std(ddof=1)) if known.size > 1 else math.nan,
    )


def poured_angle(result: DiagnosisResult, model: PouredModel, condition: str) -> tuple[float, float, int]:
    """Mean and standard deviation of the angle of repose [°] over the fresh pours of ``model``, and their number."""
    names = next(one.summaries for one in result.measured if one.condition == condition)
    found = next((one for one in model.conditions if one.condition == condition), None)
    if found is None or ANGLE not in names:
        return math.nan, math.nan, 0
    k = names.index(ANGLE)
    return float(found.mean[k]), float(found.sd[k]), found.pours


def model_scene(measurement: Measurement, condition: Condition, model: CalibratedModel) -> Scene:
    """``model`` in the set-up of ``condition``."""
    values = {
        one.path: in_rig_frame(one.path, theta, condition.turned)
        for one, theta in zip(measurement.parameters, model.theta, strict=True)
    }
    for effect, amplitudes in model.effects:
        values |= effect_values(effect, amplitudes, condition.turned)
    return with_values(condition.scene, dict(values))


def measured_surface(result: DiagnosisResult, condition: str) -> HeightSurface | None:
    """The measured mean pile: from its scans, or from its mean profile turned about the axis."""
    for one in result.maps:
        if one.condition == condition:
            n = len(one.measured)
            at = np.asarray(one.pixel * (np.arange(n) + 0.5 - n / 2), dtype=np.float64)
            return grid_surface(at, at, one.measured)
    for profile in result.piles:
        if profile.condition == condition:
            return surface_of_revolution(profile.radius, profile.measured.mean)
    return None


def grid_surface(
    x: npt.NDArray[np.float64], y: npt.NDArray[np.float64], height: npt.NDArray[np.float64]
) -> HeightSurface:
    """Heights (n, m) over the places ``x`` (n,) and ``y`` (m,); cells that are bare plate are left out."""
    n, m = height.shape
    vertices = np.column_stack([np.repeat(x, m), np.tile(y, n), np.nan_to_num(height).ravel()])
    return HeightSurface(vertices, _covered(vertices, n, m), False)


def surface_of_revolution(radius: npt.NDArray[np.float64], height: npt.NDArray[np.float64]) -> HeightSurface:
    """The profile ``height`` (k,) over ``radius`` (k,) turned about the axis."""
    known = np.isfinite(height)
    r = np.concatenate([[0.0], radius[known]])
    z = np.concatenate([height[known][:1], height[known]])
    angle = np.linspace(0.0, 2.0 * np.pi, SECTORS + 1)
    x, y = np.outer(np.cos(angle), r), np.outer(np.sin(angle), r)
    vertices = np.column_stack([x.ravel(), y.ravel(), np.tile(z, SECTORS + 1)])
    return HeightSurface(vertices, _covered(vertices, SECTORS + 1, len(r)), True)


def _covered(vertices: npt.NDArray[np.float64], n: int, m: int) -> npt.NDArray[np.int64]:
    """Triangles (t, 3) between ``vertices`` of a grid of n rows and m columns, except those of bare plate."""
    number = np.arange(n * m).reshape(n, m)
    corners = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    cells = np.stack([corner.ravel() for corner in corners], axis=1)
    cells = cells[vertices[cells, 2].max(axis=1) > LEAST_HEIGHT]
    return np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
