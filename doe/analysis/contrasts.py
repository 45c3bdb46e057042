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
Mask = npt.NDArray[np.bool_]
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
    """Centre runs against the corners. difference = d, what the corners' model has at the centre less the mean there.

    With c_r the weight of row r in that model's intercept, SS = d^2/(sum c_r^2/n_r + 1/nC), 1 degree of freedom, tested
    against the spread of centre runs and of replicates; nF nC d^2/(nF + nC) where all corners are run equally often.
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


def separable_contrasts(whole: Contrasts, levels: IntArray, names: Sequence[str], valid: Mask) -> Contrasts:
    """Return the columns that the ``valid`` rows of a design separate by least squares: those of the factors, then
    those of two-factor interactions as long as the rank grows. Larger interactions and unused columns are left out.
    """
    kept, titles = [*levels.T], list(names)
    for title, column in zip(whole.names, whole.levels.T, strict=True):
        if title in names or title in whole.dummies:
            continue
        model = np.column_stack([np.ones(len(levels)), *kept, column])[valid]
        if np.linalg.matrix_rank(model) == model.shape[1]:
            kept.append(column)
            titles.append(title)
    if len(titles) > len(names):
        aliases = {title: whole.aliases[title] for title in titles}
    else:
        aliases = main_effect_aliases(levels[valid], names)
    return Contrasts(np.column_stack(kept), tuple(titles), (), aliases)


def curvature(levels: IntArray, corners: FloatArray, centre: FloatArray) -> Curvature | None:
    """Return the test of the centre runs against the corners; None without both or without an error.

    levels: columns of the model of the corners, (rows, columns) of -1/+1; corners, centre: responses, (rows,
    replicates), NaN where missing.
    """
    middles = centre[~np.isnan(centre)]
    means, counts, within = row_moments(corners)
    valid = counts > 0
    if not valid.any() or middles.size == 0:
        return None
    df = int((counts[valid] - 1).sum()) + middles.size - 1
    error = float(within.sum() + ((middles - middles.mean()) ** 2).sum())
    if df < 1 or error == 0:
        return None
    # Weights of the row means in the intercept.
    weights = np.linalg.pinv(np.column_stack([np.ones(int(valid.sum())), levels[valid]]))[0]
    difference = float(weights @ means[valid] - middles.mean())
    squares = difference**2 / float((weights**2 / counts[valid]).sum() + 1 / middles.size)
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
