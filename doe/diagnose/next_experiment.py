"""Which experiment of the candidates tells the answers that are left apart, and with which chance.

The chance of a set-up is how often the right answer ends with a probability of ``SURE`` once n pours of it are there: a
truth is drawn by the probabilities that the answers have now, the mean of its n pours by what it predicts, and the
answers are weighed by Bayes's theorem,

    data of i ~ N(m_i, V/n + W_i),    p_j ∝ w_j N(data; m_j, V/n + W_j)ᵀ

with V the covariance of one pour, W_i that of what i predicts and T the temperature at which all data are weighed
(``posterior.py``). This is the expected posterior of Box and Hill 1967
(doi 10.1080/00401706.1967.10490441) counted as a laboratory would: an answer, or none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from doe.diagnose.posterior import TEMPERATURE
from doe.diagnose.result import RankedExperiment
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]

SURE, DRAWS = 0.9, 400
"""Probability that is an answer, and made-up data sets of each answer."""
PLANNED, GIVEN_UP = (6, 12, 24), 0.05
"""Pours that may be asked of a laboratory, and the chance that is given up for fewer. By the fewest with a chance of
80 %, as until 2026-11-28, 15 of 23 follow-ups of single effects (root 1) ended right."""


@dataclass(frozen=True)
class Prediction:
    """What one answer, fitted to the data, expects: mean (d,) of its pours and the covariance (d, d) of that mean."""

    mean: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class CandidateExperiment:
    """A feasible set-up: prediction by every answer that is left, and the covariance of one pour, (d, d)."""

    name: str
    predictions: Mapping[str, Prediction]
    pour: FloatArray


def rank_experiments(
    candidates: Sequence[CandidateExperiment], weights: Mapping[str, float], replicates: int
) -> tuple[RankedExperiment, ...]:
    """Return the candidates, the best chance of an answer first, the larger separation first among equals.

    weights: of the answers that are left; replicates: pours that are asked for.

    Raises StatisticsError with fewer than two answers, no candidate, or a set-up that some answer does not predict.
    """
    if len(weights) < 2 or not candidates:
        raise StatisticsError(f"{len(weights)} answers and {len(candidates)} set-ups; allowed are at least 2 and 1")
    for item in candidates:
        missing = sorted(set(weights) - set(item.predictions))
        if missing:
            raise StatisticsError(f"{item.name}: no prediction by {', '.join(missing)}")
    rows = [
        RankedExperiment(
            item.name, chance_of_an_answer(item, weights, replicates), _least_separation(item, tuple(weights))
        )
        for item in candidates
    ]
    return tuple(sorted(rows, key=lambda row: (-row.chance, -row.separation)))


def fewest_pours(
    candidates: Sequence[CandidateExperiment], weights: Mapping[str, float]
) -> tuple[int, tuple[RankedExperiment, ...]]:
    """Return how many pours to ask for, the fewest that do nearly as well as the most, and the ranks by them."""
    ranked = {n: rank_experiments(candidates, weights, n) for n in PLANNED}
    pours = min(n for n in PLANNED if ranked[n][0].chance >= ranked[max(PLANNED)][0].chance - GIVEN_UP)
    return pours, ranked[pours]


def chance_of_an_answer(
    item: CandidateExperiment, weights: Mapping[str, float], replicates: int, seed: int = 0
) -> float:
    """Return how often the true answer ends with a probability of `SURE`, by `DRAWS` made-up data sets of each."""
    names, rng = tuple(weights), np.random.default_rng(seed)
    share = np.array([weights[name] for name in names]) / sum(weights.values())
    factors = [np.linalg.cholesky(item.pour / replicates + item.predictions[name].covariance) for name in names]
    right = 0.0
    for k, name in enumerate(names):
        drawn = item.predictions[name].mean + rng.standard_normal((DRAWS, len(item.pour))) @ factors[k].T
        logs = []
        for j, other in enumerate(names):
            white = np.linalg.solve(factors[j], (drawn - item.predictions[other].mean).T)
            log_likelihood = -np.log(np.diag(factors[j])).sum() - 0.5 * (white**2).sum(axis=0)
            logs.append(np.log(share[j]) + TEMPERATURE * log_likelihood)
        stacked = np.stack(logs)
        posterior = np.exp(stacked - stacked.max(axis=0))
        right += float(share[k]) * float((posterior[k] / posterior.sum(axis=0) >= SURE).mean())
    return right


def _least_separation(item: CandidateExperiment, names: Sequence[str]) -> float:
    distances = []
    for i, j in combinations(names, 2):
        one, other = item.predictions[i], item.predictions[j]
        gap = one.mean - other.mean
        distances.append(float(gap @ np.linalg.solve(item.pour + one.covariance + other.covariance, gap)))
    return math.sqrt(min(distances))
