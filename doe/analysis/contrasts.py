"""All contrasts of a two-level design: main effects, interactions, and their aliases.

In a regular design every product of factor columns is either a new column or equal to an earlier one up to its sign;
each distinct column is one contrast, named after its simplest effect. Interactions of three or more factors are assumed
to be noise and serve as error (Montgomery 2017, ch. 6). In a Plackett–Burman design the unused columns of its table
serve as error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.few_terms import main_effect_aliases
from doe.analysis.replicates import row_moments
from doe.designs.plackett_burman import tables
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
MOST_FACTORS = 10
"""Largest number of factors of a regular design for which all products are formed."""


@dataclass(frozen=True)
class Contrasts(Record):
    """Columns to estimate: levels (rows, columns) of -1/+1 with names; dummies are those that serve as error.

    aliases: column → other effects of up to two factors on the same column, with their sign and, for partial aliases,
    the share of them that the column carries.
    """

    levels: IntArray
    names: tuple[str, ...]
    dummies: tuple[str, ...]
    aliases: dict[str, tuple[str, ...]]


@dataclass(frozen=True)
class Curvature(Record):
    """Centre runs against the corners. difference = mean(corners) - mean(centre), unit of the response.

    SS = nF nC difference^2/(nF + nC), 1 degree of freedom, tested against the spread of centre runs and of replicates.
    """

    difference: float
    sum_of_squares: float
    error_mean_square: float
    df_error: int
    f: float
    p: float


def is_regular(levels: IntArray) -> bool:
    """Return whether all products of two columns are orthogonal to, or the same as, every column and every other
    product, in a balanced design.
    """
    rows, k = levels.shape
    if k > MOST_FACTORS or levels.sum(axis=0).any():
        return False
    columns = np.column_stack([levels, *(levels[:, i] * levels[:, j] for i, j in combinations(range(k), 2))])
    shared = np.abs(columns.T @ columns)
    return bool(np.isin(shared, (0, rows)).all())


def regular_contrasts(levels: IntArray, names: Sequence[str]) -> Contrasts:
    """Return every distinct column of a regular design, shape of `levels` (rows, factors); see `is_regular`."""
    rows, k = levels.shape
    kept: list[IntArray] = []
    titles: list[str] = []
    sizes: list[int] = []
    aliases: dict[str, list[str]] = {}
    for size in range(1, k + 1):
        for group in combinations(range(k), size):
            column = levels[:, group].prod(axis=1)
            if abs(int(column.sum())) == rows:
                continue
            name = "*".join(names[i] for i in group)
            same = np.array([int(column @ other) for other in kept]) if kept else np.zeros(0, dtype=np.int64)
            equal = np.flatnonzero(np.abs(same) == rows)
            if equal.size:
                if size <= 2:
                    aliases[titles[equal[0]]].append(("-" if same[equal[0]] < 0 else "") + name)
            elif not same.any():
                kept.append(column)
                titles.append(name)
                sizes.append(size)
                aliases[name] = []
        if len(kept) >= len(np.unique(levels, axis=0)) - 1 and size >= 2:
            break
    return Contrasts(
        levels=np.column_stack(kept),
        names=tuple(titles),
        dummies=tuple(title for title, size in zip(titles, sizes, strict=True) if size > 2),
        aliases={title: tuple(others) for title, others in aliases.items()},
    )


def screening_contrasts(levels: IntArray, names: Sequence[str]) -> Contrasts:
    """Return the factors' columns and, where the rows are those of a Plackett–Burman table or of its fold-over, the
    unused columns of that table as D1, D2, …
    """
    unused = _unused_columns(levels)
    dummies = tuple(f"D{j + 1}" for j in range(unused.shape[1]))
    return Contrasts(np.hstack([levels, unused]), (*names, *dummies), dummies, main_effect_aliases(levels, names))


def curvature(levels: FloatArray, responses: FloatArray) -> Curvature | None:
    """Return the test of the centre runs (all levels 0) against the corners; None without both or without an error.

    levels: (rows, factors) of -1, 0, +1; responses: (rows, replicates), NaN where missing.
    """
    centre = ~levels.any(axis=1)
    corners, middles = (values[~np.isnan(values)] for values in (responses[~centre], responses[centre]))
    if corners.size == 0 or middles.size == 0:
        return None
    _, _, within = row_moments(responses[~centre])
    counts = (~np.isnan(responses[~centre])).sum(axis=1)
    df = int(np.maximum(counts - 1, 0).sum()) + middles.size - 1
    error = float(within.sum() + ((middles - middles.mean()) ** 2).sum())
    if df < 1 or error == 0:
        return None
    difference = float(corners.mean() - middles.mean())
    squares = corners.size * middles.size * difference**2 / (corners.size + middles.size)
    f = squares / (error / df)
    return Curvature(difference, squares, error / df, df, f, float(stats.f.sf(f, 1, df)))


def _unused_columns(levels: IntArray) -> IntArray:
    """Return the columns of a table that are none of `levels`, (rows, unused); none where they come from no table."""
    rows, k = levels.shape
    for folded in (False, True):
        size = rows // 2 if folded else rows
        if size % 4 or not 8 <= size <= 48 or k > size - 1:
            continue
        for table in tables(size):
            whole = np.vstack([table, -table]) if folded else table
            taken = [j for column in levels.T for j in range(size - 1) if np.array_equal(whole[:, j], column)]
            if len(taken) == k:
                return np.delete(whole, taken, axis=1)
    return np.zeros((rows, 0), dtype=np.int64)
