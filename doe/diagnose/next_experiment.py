"""Rank the candidate experiments by their chance of telling the remaining answers apart.

The chance of a set-up is how often the right answer is given, by the rules of ``verdict.py`` after a follow-up, from n
pours in it. A true answer is drawn with the present probabilities, the mean of its n pours is drawn from its
prediction, and the answers are weighed by Bayes's theorem,

    data of i ~ N(m_i, 1/n + W_i),    p_j ∝ w_j N(data; m_j, 1/n + W_j)ᵀ

in features whitened by the covariance of one pour, with W_i the covariance of the prediction of i and T the temperature
at which all data are weighed (``posterior.py``). This is the expected posterior of Box and Hill 1967 (doi
10.1080/00401706.1967.10490441) counted as a laboratory would: an answer, or none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from doe.diagnose.posterior import TEMPERATURE, holds
from doe.diagnose.result import RankedExperiment
from doe.diagnose.verdict import NOTHING_FROM, THRESHOLD

FloatArray = npt.NDArray[np.float64]

DRAWS = 400
"""Simulated data sets per answer."""
PLANNED, GIVEN_UP = (6, 12, 24), 0.05
"""Numbers of pours that may be asked of a laboratory, and the loss of chance accepted for fewer."""
LEAST_WEIGHT = 1e-300
"""Of an answer, so that its logarithm is finite."""


@dataclass(frozen=True)
class Prediction:
    """Prediction of one answer, fitted to the data: mean (d,) of its pours and the covariance (d, d) of that mean."""

    mean: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class CandidateExperiment:
    """A feasible set-up, and the prediction of every remaining answer there."""

    name: str
    predictions: Mapping[str, Prediction]


def rank_experiments(
    candidates: Sequence[CandidateExperiment], weights: Mapping[str, float], replicates: float
) -> tuple[RankedExperiment, ...]:
    """Return the candidates in descending order of the chance of the right answer, ties by descending separation.

    ``weights``: probabilities of the remaining answers. ``replicates``: pours asked for, infinity if nothing is poured
    and all noise is in the predictions.
    """
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
    """Return the fewest pours whose chance is within ``GIVEN_UP`` of that of the most, and the ranking for them."""
    ranked = {n: rank_experiments(candidates, weights, n) for n in PLANNED}
    pours = min(n for n in PLANNED if ranked[n][0].chance >= ranked[max(PLANNED)][0].chance - GIVEN_UP)
    return pours, ranked[pours]


def chance_of_an_answer(
    item: CandidateExperiment, weights: Mapping[str, float], replicates: float, seed: int = 0
) -> float:
    """Return how often the true answer is given, estimated from ``DRAWS`` simulated data sets per answer.

    Answers outside ``weights``, for which nothing was poured, fare like the wrong ones among them; none is ever found.
    """
    names, rng = tuple(weights), np.random.default_rng(seed)
    # A strong effect leaves nothing of "nothing missing"; it is still what the others fare like.
    prior = np.maximum(list(weights.values()), LEAST_WEIGHT)
    pour = np.eye(len(item.predictions[names[0]].mean))
    factors = [np.linalg.cholesky(pour / replicates + item.predictions[name].covariance) for name in names]
    chance = 0.0
    for k, name in enumerate(names):
        drawn = item.predictions[name].mean + rng.standard_normal((DRAWS, len(pour))) @ factors[k].T
        logs = []
        for j, other in enumerate(names):
            white = np.linalg.solve(factors[j], (drawn - item.predictions[other].mean).T)
            log_likelihood = -np.log(np.diag(factors[j])).sum() - 0.5 * (white**2).sum(axis=0)
            logs.append(np.log(prior[j]) + TEMPERATURE * log_likelihood)
        odds = np.exp(np.stack(logs) - np.max(logs, axis=0))
        without = np.array([not holds(other, name) for other in names])
        right, wrong = odds[~without].sum(axis=0), odds[without].sum(axis=0)
        if without.any():
            wrong *= (1.0 - prior[~without].sum()) / prior[without].sum()
        enough = NOTHING_FROM if name == "base" else THRESHOLD
        given = (right >= enough * (right + wrong)) & (odds.argmax(axis=0) == k)
        chance += float(prior[k]) * float(given.mean())
    return chance


def _least_separation(item: CandidateExperiment, names: Sequence[str]) -> float:
    distances = []
    for i, j in combinations(names, 2):
        one, other = item.predictions[i], item.predictions[j]
        gap = one.mean - other.mean
        distances.append(float(gap @ np.linalg.solve(np.eye(len(gap)) + one.covariance + other.covariance, gap)))
    return math.sqrt(min(distances))
