"""Several targets at once: the setting whose predicted responses miss them least, in units of what is known.

    J(x) = Σ_t w_t (ŷ_t(x) − T_t)² / s_t²

with s_t² = sd_t²/n_t + (standard error of the model at the centre)², so that a target counts by how well it is
known on both sides; ties (a valley of equal J) are broken by the distance to the measured parameters. Weighted least
squares on response surfaces; compare Derringer & Suich 1980, which needs desirability limits that nobody measured.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from doe.record import Record
from doe.surface import Surface
from doe.target import Target

FloatArray = npt.NDArray[np.float64]

TIE = 1e-3
"""Weight of the squared coded distance to the reference: decides only where the misfit does not."""


@dataclass(frozen=True)
class Compromise(Record):
    """The chosen point (natural and coded), the predictions there, and each target's share of the misfit.

    ``misfit`` is J without the tie-breaker; ``standardised`` the signed (ŷ − T)/s per target.
    """

    point: FloatArray
    point_coded: FloatArray
    predicted: FloatArray
    standardised: FloatArray
    misfit: float
    statement: str


def find_compromise(models: Sequence[Surface], targets: Sequence[Target], reference: npt.ArrayLike) -> Compromise:
    """Minimise J over the cube from the 27 points of a 3-level grid (deterministic; L-BFGS-B)."""
    region = models[0].region
    k = len(region.names)
    home = region.coded(np.asarray(reference, dtype=float))
    centre = np.zeros((1, k))
    spread = np.array(
        [math.hypot(t.standard_error, float(m.standard_error(centre)[0])) for m, t in zip(models, targets, strict=True)]
    )
    weight = np.array([t.weight for t in targets])
    goal = np.array([t.mean for t in targets])

    def residuals(x: FloatArray) -> FloatArray:
        predicted = np.array([float(m.predict(x[None])[0]) for m in models])
        return (predicted - goal) / spread

    def cost(x: FloatArray) -> float:
        return float(weight @ residuals(x) ** 2 + TIE * ((x - home) ** 2).sum())

    starts = [np.array(x, dtype=float) for x in product((-0.9, 0.0, 0.9), repeat=k)]
    best = min((minimize(cost, x, bounds=[(-1.0, 1.0)] * k) for x in starts), key=lambda found: found.fun)
    missed = residuals(best.x)
    misfit = float(weight @ missed**2)
    worst = int(np.argmax(np.abs(missed)))
    statement = f"The targets are missed by at most {abs(missed[worst]):.1f} standard errors (target {worst + 1})."
    if abs(missed[worst]) > 2.0:
        statement += " They contradict each other within this model and region."
    statement += " The interval and the width given beside it describe the first target alone."
    return Compromise(
        point=region.natural(best.x),
        point_coded=np.asarray(best.x),
        predicted=missed * spread + goal,
        standardised=missed,
        misfit=misfit,
        statement=statement,
    )
