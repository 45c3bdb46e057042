"""Bootstrap refits of a surface: the same model fitted to many resampled copies of the runs, in one solve.

Source: Davison and Hinkley 1997, Bootstrap Methods and their Application, ch. 6.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from doe.surface import Surface, fitted_coefficients, second_order_terms

FloatArray = npt.NDArray[np.float64]
Resampling = Literal["replicates within points", "residuals"]


def bootstrap_coefficients(surface: Surface, refits: int, seed: int) -> tuple[FloatArray, Resampling]:
    """Return coefficients of `refits` resampled fits, shape (refits, p), and what was resampled.

    With two or more runs at every distinct point the replicates are drawn within their point; deviations from
    the point's mean are scaled by sqrt(n/(n - 1)), because n values underestimate their variance by that
    factor. Otherwise residuals are drawn over all runs, scaled by 1/sqrt(1 - leverage) and centred.
    """
    generator = np.random.default_rng(seed)
    if np.bincount(surface.point_of_run).min() >= 2:
        resampled, method = _within_points(surface, refits, generator), "replicates within points"
    else:
        resampled, method = _residuals(surface, refits, generator), "residuals"
    coefficients = np.zeros((refits, surface.coefficients.size))
    model = second_order_terms(surface.points)[:, surface.included]
    coefficients[:, surface.included] = fitted_coefficients(model, resampled).T
    return coefficients, method  # type: ignore[return-value]


def _within_points(surface: Surface, refits: int, generator: np.random.Generator) -> FloatArray:
    """Return resampled responses, shape (runs, refits)."""
    resampled = np.empty((surface.observed.size, refits))
    for point in range(int(surface.point_of_run.max()) + 1):
        runs = np.flatnonzero(surface.point_of_run == point)
        mean = surface.observed[runs].mean()
        deviations = (surface.observed[runs] - mean) * np.sqrt(runs.size / (runs.size - 1))
        resampled[runs] = mean + generator.choice(deviations, size=(runs.size, refits))
    return resampled


def _residuals(surface: Surface, refits: int, generator: np.random.Generator) -> FloatArray:
    """Return resampled responses, shape (runs, refits); runs of leverage one carry no residual."""
    free = surface.leverage < 1 - 1e-9
    scaled = (surface.observed - surface.predicted)[free] / np.sqrt(1 - surface.leverage[free])
    draws = generator.choice(scaled - scaled.mean(), size=(surface.observed.size, refits))
    return np.asarray(surface.predicted[:, None] + draws)
