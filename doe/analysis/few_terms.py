"""Models of few main effects and interactions for a two-level design whose effects are partially aliased.

In a Plackett–Burman design every main effect carries a part (1/3 in 12 runs) of every interaction that does not involve
it, so that a single large interaction is spread over many small apparent main effects. All models of at most
`MOST_TERMS` terms are fitted in which every interaction is accompanied by at least one of its factors (weak effect
heredity). Models are ranked by AICc = n ln(RSS/n) + 2 q + 2 q (q + 1)/(n - q - 1) with q = terms + 2. Because a search
always finds something, it is repeated on permuted responses; p is the share of these whose best model of the same size
has at least the same R². Source: Hamada and Wu 1992, J. Qual. Technol. 24:130 (heredity, partial aliasing); Hurvich and
Tsai 1989, Biometrika 76:297 (AICc).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations

import numpy as np
import numpy.typing as npt

from doe.analysis.surface import with_intercept
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
MOST_TERMS, MOST_FACTORS = 3, 11
SHOWN, WITHIN = 5, 4.0
"""Most models kept, and their largest distance in AICc from the lowest (Burnham and Anderson 2002, ch. 2)."""
PERMUTATIONS, SEED = 499, 1
DUST = 1e-9
"""Rounding error of a share."""


@dataclass(frozen=True)
class FewTermsModel(Record):
    """A model with an intercept and `terms` ("F", "F*G"); p by permutation, among models of as many terms."""

    terms: tuple[str, ...]
    coefficients: FloatArray
    """Of the intercept and of `terms`, coded; an effect is twice its coefficient."""
    r_squared: float
    r_squared_adjusted: float
    aicc: float
    p: float


def few_terms(levels: IntArray, names: Sequence[str], means: FloatArray) -> tuple[FewTermsModel, ...]:
    """Return the best models, lowest AICc first; none where there are too many factors or too few rows.

    levels: (rows, factors) of -1/+1 by `names`. means: of the valid runs of each row, shape (rows,); rows with NaN are
    left out.
    """
    valid = np.isfinite(means)
    y, n = means[valid], int(valid.sum())
    if len(names) > MOST_FACTORS or n < MOST_TERMS + 5 or np.ptp(y) == 0:
        return ()
    columns, titles = _columns(levels[valid].astype(np.float64), names)
    permuted = np.random.default_rng(SEED).permuted(np.tile(y, (PERMUTATIONS, 1)), axis=1).T
    values = np.column_stack([y, permuted]) - y.mean()
    total = float(values[:, 0] @ values[:, 0])
    found: list[tuple[float, tuple[int, ...], float]] = []
    best = np.zeros((MOST_TERMS + 1, PERMUTATIONS))
    for size in range(1, MOST_TERMS + 1):
        for group in _with_heredity(size, len(names), titles, names):
            model = columns[:, group] - columns[:, group].mean(axis=0)
            basis, scale = np.linalg.qr(model)
            if np.abs(np.diag(scale)).min() < 1e-9:
                continue
            explained = ((basis.T @ values) ** 2).sum(axis=0) / total
            best[size] = np.maximum(best[size], explained[1:])
            found.append((_aicc(n, size, total * (1 - explained[0])), group, float(explained[0])))
    found.sort(key=lambda one: one[0])
    return tuple(
        _fitted(columns[:, group], tuple(titles[k] for k in group), y, r2, aicc, best[len(group)])
        for aicc, group, r2 in found[:SHOWN]
        if aicc <= found[0][0] + WITHIN
    )


def main_effect_aliases(levels: IntArray, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return for every factor the interactions of two that its effect holds, wholly or in part: "-B*C", "1/3 B*D".

    Of the columns Z of the interactions the least squares of the intercept and the factors X hold (X'X)^-1 X'Z.
    """
    columns, titles = _columns(levels.astype(np.float64), names)
    model, pairs = with_intercept(columns[:, : len(names)]), columns[:, len(names) :]
    shares = np.linalg.solve(model.T @ model, model.T @ pairs)[1:]
    return {
        name: tuple(
            _part(share, len(levels)) + title
            for share, title in zip(own.tolist(), titles[len(names) :], strict=True)
            if abs(share) > DUST
        )
        for name, own in zip(names, shares, strict=True)
    }


def _part(share: float, rows: int) -> str:
    """A share in words before an interaction: nothing or a minus for the whole, a fraction of the rows if it is one."""
    fraction = Fraction(share).limit_denominator(rows)
    if abs(fraction - share) > DUST:
        return f"{share:.3g} "
    return {"1": "", "-1": "-"}.get(str(fraction), f"{fraction} ")


def _columns(levels: FloatArray, names: Sequence[str]) -> tuple[FloatArray, list[str]]:
    pairs = list(combinations(range(len(names)), 2))
    products = [levels[:, i] * levels[:, j] for i, j in pairs]
    return np.column_stack([levels, *products]), [*names, *(f"{names[i]}*{names[j]}" for i, j in pairs)]


def _with_heredity(size: int, k: int, titles: Sequence[str], names: Sequence[str]) -> list[tuple[int, ...]]:
    """Groups of `size` columns in which every interaction is accompanied by one of its factors."""
    number = {name: i for i, name in enumerate(names)}
    parents = [set() if at < k else {number[part] for part in title.split("*")} for at, title in enumerate(titles)]
    return [
        group
        for group in combinations(range(len(titles)), size)
        if all(at < k or parents[at] & set(group) for at in group)
    ]


def _aicc(n: int, terms: int, residual: float) -> float:
    q = terms + 2
    return n * math.log(max(residual, 1e-300) / n) + 2 * q + 2 * q * (q + 1) / (n - q - 1)


def _fitted(
    columns: FloatArray, terms: tuple[str, ...], y: FloatArray, r2: float, aicc: float, permuted: FloatArray
) -> FewTermsModel:
    model, n = np.column_stack([np.ones(len(y)), columns]), len(y)
    # The response itself is one of the permutations (Phipson and Smyth 2010, Stat. Appl. Genet. Mol. Biol. 9:39).
    p = (1 + int((permuted >= r2 - 1e-12).sum())) / (PERMUTATIONS + 1)
    adjusted = 1 - (1 - r2) * (n - 1) / (n - 1 - len(terms))
    coefficients: FloatArray = np.linalg.lstsq(model, y, rcond=None)[0].astype(np.float64)
    return FewTermsModel(terms, coefficients, r2, adjusted, aicc, p)
