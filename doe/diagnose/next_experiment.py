"""Which experiment of a menu tells the surviving models apart, and how often it must be repeated.

    score(x) = sum_{i<j} w_i w_j [(mu_i - mu_j)' V_ij^-1 (mu_i - mu_j) + tr(2 V V_ij^-1) - d],  V_ij = 2 V + W_i + W_j

with V the covariance of the measured mean, W_i that of model i's prediction, d summaries. The menu (menu.py) predicts
by pours at the best fits: W_i is that of their mean, and what the fit leaves open is not in it.
The -d makes set-ups with different numbers of summaries comparable: zero says that nothing is to be learnt. One more
rival stands for a model outside the list, with a wide prediction: it marks down set-ups that no model can predict, so
that repeating a known one is sometimes the answer. Source: Buzzi-Ferraris and Forzatti 1983, Chem. Eng. Sci. 38:225.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

OUTSIDE_WEIGHT = 0.1
OUTSIDE_WIDTH = 3.0
"""Standard deviation of the outside rival's prediction in those of one pour, beside the spread of the models."""

MAX_REPLICATES = 100
SURE, DRAWS = 0.9, 400
"""Probability that is an answer, and made-up data sets of each model."""


@dataclass(frozen=True)
class Prediction:
    """What one model, fitted to the data, expects: mean (d,) of its pours and the covariance (d, d) of that mean."""

    mean: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class MenuItem:
    """A feasible set-up: prediction by every surviving model, and the covariance of one pour, (d, d)."""

    name: str
    predictions: Mapping[str, Prediction]
    pour: FloatArray


@dataclass(frozen=True)
class RankedExperiment(Record):
    """score as above; replicates for the asked odds between every two models, None where MAX_REPLICATES do not give
    them; separation: least distance between two models in sigma of one pour and their own uncertainty; chance: of
    ending with the right model at `SURE` after the planned pours.
    """

    name: str
    score: float
    replicates: int | None
    separation: float
    chance: float


def rank_experiments(
    menu: Sequence[MenuItem], weights: Mapping[str, float], replicates: int, odds: float = 20.0
) -> tuple[RankedExperiment, ...]:
    """Return the menu, the best chance of an answer first (in steps of a tenth), then the best score.

    weights: of the surviving models; replicates: planned pours, for V.

    Raises StatisticsError with fewer than two models, an empty menu, or a set-up that some model does not predict.
    """
    if len(weights) < 2 or not menu:
        raise StatisticsError(f"{len(weights)} models and {len(menu)} set-ups; allowed are at least 2 and 1")
    for item in menu:
        missing = sorted(set(weights) - set(item.predictions))
        if missing:
            raise StatisticsError(f"{item.name}: no prediction by {', '.join(missing)}")
    rows = [
        RankedExperiment(
            item.name,
            discrimination(item, weights, replicates),
            replicates_for_odds(item, tuple(weights), odds),
            _least_separation(item, tuple(weights)),
            chance_of_an_answer(item, weights, replicates),
        )
        for item in menu
    ]
    return tuple(sorted(rows, key=lambda row: (-math.floor(10.0 * row.chance), -row.score)))


def chance_of_an_answer(item: MenuItem, weights: Mapping[str, float], replicates: int, seed: int = 0) -> float:
    """Return how often the true model ends with a probability of `SURE`, by `DRAWS` made-up means of each model's data.

    The truth is drawn by ``weights``; means are Gaussian about its prediction, of covariance V + W_i.
    """
    names, rng = tuple(weights), np.random.default_rng(seed)
    share = np.array([weights[name] for name in names]) / sum(weights.values())
    noise = item.pour / replicates
    factors = [np.linalg.cholesky(noise + item.predictions[name].covariance) for name in names]
    right = 0.0
    for k, name in enumerate(names):
        drawn = item.predictions[name].mean + rng.standard_normal((DRAWS, len(item.pour))) @ factors[k].T
        logs = []
        for j, other in enumerate(names):
            white = np.linalg.solve(factors[j], (drawn - item.predictions[other].mean).T)
            logs.append(np.log(share[j]) - np.log(np.diag(factors[j])).sum() - 0.5 * (white**2).sum(axis=0))
        stacked = np.stack(logs)
        posterior = np.exp(stacked - stacked.max(axis=0))
        right += share[k] * float((posterior[k] / posterior.sum(axis=0) >= SURE).mean())
    return right


def discrimination(item: MenuItem, weights: Mapping[str, float], replicates: int) -> float:
    """Return the score of one set-up."""
    noise, d = item.pour / replicates, len(item.pour)
    total = sum(weights.values())
    share = {name: (1 - OUTSIDE_WEIGHT) * weight / total for name, weight in weights.items()}
    rivals = [(share[name], item.predictions[name]) for name in weights]
    rivals.append((OUTSIDE_WEIGHT, _outside(item, weights)))
    score = 0.0
    for (w_i, one), (w_j, other) in combinations(rivals, 2):
        inverse = np.linalg.inv(2 * noise + one.covariance + other.covariance)
        gap = one.mean - other.mean
        score += w_i * w_j * (float(gap @ inverse @ gap) + 2 * float(np.trace(noise @ inverse)) - d)
    return score


def replicates_for_odds(item: MenuItem, names: Sequence[str], odds: float = 20.0) -> int | None:
    """Return the least n for which the expected log odds of a true model over every other reach ln(odds).

    E_i ln(p_i/p_j) = Kullback-Leibler divergence of N(mu_i, W_i + V/n) from N(mu_j, W_j + V/n).
    """
    for n in range(1, MAX_REPLICATES + 1):
        noise = item.pour / n
        divergences = [
            gaussian_divergence(
                item.predictions[i].mean,
                item.predictions[i].covariance + noise,
                item.predictions[j].mean,
                item.predictions[j].covariance + noise,
            )
            for i, j in permutations(names, 2)
        ]
        if min(divergences) >= math.log(odds):
            return n
    return None


def gaussian_divergence(mean: FloatArray, covariance: FloatArray, other_mean: FloatArray, other: FloatArray) -> float:
    """Return KL(N(mean, covariance) || N(other_mean, other)) in nats."""
    inverse = np.linalg.inv(other)
    gap = other_mean - mean
    ratio = np.linalg.slogdet(other)[1] - np.linalg.slogdet(covariance)[1]
    return float(np.trace(inverse @ covariance) - len(mean) + gap @ inverse @ gap + ratio) / 2


def _outside(item: MenuItem, weights: Mapping[str, float]) -> Prediction:
    """Return the wide rival: the weighted mean of the models, and their spread on top of OUTSIDE_WIDTH^2 V."""
    share = np.array(list(weights.values())) / sum(weights.values())
    means = np.stack([item.predictions[name].mean for name in weights])
    centre = share @ means
    spread = (means - centre).T @ ((means - centre) * share[:, None])
    return Prediction(centre, OUTSIDE_WIDTH**2 * item.pour + spread)


def _least_separation(item: MenuItem, names: Sequence[str]) -> float:
    distances = []
    for i, j in combinations(names, 2):
        one, other = item.predictions[i], item.predictions[j]
        gap = one.mean - other.mean
        distances.append(float(gap @ np.linalg.solve(item.pour + one.covariance + other.covariance, gap)))
    return math.sqrt(min(distances))
