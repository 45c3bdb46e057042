"""If one independent measurement were wrong: where the data alone would put each parameter, and what T^2 is left.

The base model's fit is taken as linear about its minimum. Parameter i loses its measured mean and its range, the others
keep theirs:

    minimise (r - J s)' W (r - J s) + sum_{j != i} w_j (x_j + s_j - m_j)^2   over steps s, others within their bounds

It answers "how far would friction have to leave its measured range to absorb the residual?", a rival of every effect.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from doe.diagnose.decision.verdict import FreedParameter
from doe.diagnose.fitting.calibrate import Evidence, Fit
from doe.diagnose.runs import Declared

FloatArray = npt.NDArray[np.float64]

SINGULAR = 1e-9
"""Share of a parameter's own curvature that is left once the others have followed, below which it has no value."""


def freed_parameters(declared: Declared, base: Fit, evidence: Evidence) -> tuple[FreedParameter, ...]:
    """Return one row per parameter, in declared order."""
    jacobian = base.predictor.jacobian(base.x)
    cuts = np.cumsum([mean.size for mean in evidence.means])[:-1]
    slopes = np.split(jacobian, cuts)
    weights = [np.linalg.inv(block) for block in base.sigma]
    curvature = np.sum([slope.T @ w @ slope for slope, w in zip(slopes, weights, strict=True)], axis=0)
    pull = np.sum([s.T @ w @ r for s, w, r in zip(slopes, weights, base.residual, strict=True)], axis=0)
    square = float(sum(r @ w @ r for w, r in zip(weights, base.residual, strict=True)))
    rows = []
    for i, parameter in enumerate(declared.parameters):
        prior = evidence.prior_weight.copy()
        prior[i] = 0.0
        step, error = _freed_step(i, curvature, pull, prior, base, evidence)
        x = base.x + step
        off = prior * (x - evidence.prior_mean) ** 2
        half = (parameter.high - parameter.low) / 2
        value = parameter.natural(float(x[i]))
        rows.append(
            FreedParameter(
                name=parameter.name,
                value=value,
                standard_error=error * half,
                sds=math.nan
                if parameter.mean is None or parameter.sd is None
                else (value - parameter.mean) / parameter.sd,
                outside=not parameter.low <= value <= parameter.high,
                t2=float(np.maximum(square - 2 * step @ pull + step @ curvature @ step + off.sum(), 0.0)),
            )
        )
    return tuple(rows)


def _freed_step(
    i: int, curvature: FloatArray, pull: FloatArray, prior: FloatArray, base: Fit, evidence: Evidence
) -> tuple[FloatArray, float]:
    """Return the step (k,) and the standard error of entry i; NaN where the data do not see parameter i."""
    matrix = curvature + np.diag(prior)
    right = pull + prior * (evidence.prior_mean - base.x)
    step = np.zeros(len(right))
    free = np.ones(len(right), dtype=bool)
    while True:
        held = right - matrix[:, ~free] @ step[~free]
        inverse = np.linalg.pinv(matrix[np.ix_(free, free)], hermitian=True)
        step[free] = inverse @ held[free]
        ahead = base.x + step
        outside = free & ((ahead < base.predictor.low - 1e-12) | (ahead > base.predictor.high + 1e-12))
        outside[i] = False
        if not outside.any():
            break
        free &= ~outside
        step[outside] = np.clip(ahead, base.predictor.low, base.predictor.high)[outside] - base.x[outside]
    own = float(inverse[int(free[:i].sum()), int(free[:i].sum())])
    if matrix[i, i] <= 0 or own <= 0 or 1.0 / own < SINGULAR * matrix[i, i]:
        step[i] = math.nan
        return step, math.nan
    return step, math.sqrt(own)
