"""Polynomials as exponents: term_j(x) = prod_i x_i^E_ji, with their slopes, for any number of points at once.

Base terms are in the k coded parameters. Terms of an effect are in (parameters, its amplitudes) and all vanish at
amplitude zero.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


def monomials(x: FloatArray, exponents: IntArray) -> FloatArray:
    """Return the terms at points x, shape (..., q) with exponents (p, q) -> (..., p)."""
    powers = _powers(x, exponents)
    return np.stack([_product(powers, row, x.shape[:-1]) for row in exponents], axis=-1)


def slopes(x: FloatArray, exponents: IntArray) -> FloatArray:
    """Return d term_j/d x_i, shape (..., q) with exponents (p, q) -> (..., q, p)."""
    powers = _powers(x, exponents)
    result = np.zeros((*x.shape, len(exponents)))
    for j, row in enumerate(exponents):
        for i in np.flatnonzero(row):
            lower = row.copy()
            lower[i] -= 1
            result[..., i, j] = row[i] * _product(powers, lower, x.shape[:-1])
    return result


def base_candidates(k: int) -> tuple[IntArray, ...]:
    """Return exponents of the linear, the linear + squares and the full quadratic polynomial of k parameters."""
    unit = np.eye(k, dtype=np.int64)
    constant = np.zeros((1, k), dtype=np.int64)
    products = np.array([unit[i] + unit[j] for i, j in combinations(range(k), 2)], dtype=np.int64).reshape(-1, k)
    linear = np.concatenate([constant, unit])
    candidates = [linear, np.concatenate([linear, 2 * unit]), np.concatenate([linear, 2 * unit, products])]
    return tuple(candidates[:1] if k == 0 else candidates[:2] if k == 1 else candidates)


def effect_candidates(k: int, amplitudes: int) -> tuple[IntArray, ...]:
    """Return exponents, shape (terms, k + amplitudes), from a straight line to a cubic with amplitude x parameter."""
    q = k + amplitudes
    unit = np.eye(q, dtype=np.int64)
    a, t = unit[k:], unit[:k]
    square = (
        np.concatenate([2 * a, [a[i] + a[j] for i, j in combinations(range(amplitudes), 2)]])
        if amplitudes > 1
        else 2 * a
    )
    mixed = np.array([one + other for one in a for other in t], dtype=np.int64).reshape(-1, q)
    quadratic = np.concatenate([a, square])
    cubic = np.concatenate([quadratic, 3 * a])
    plain = [a, quadratic, cubic]
    return tuple(plain if k == 0 else [*plain, *(np.concatenate([one, mixed]) for one in plain)])


def _powers(x: FloatArray, exponents: IntArray) -> list[list[FloatArray]]:
    """Return x_i^e as [i][e], e = 0 … the largest exponent of x_i."""
    result = []
    for i in range(exponents.shape[1]):
        column = [np.ones(x.shape[:-1])]
        for _ in range(int(exponents[:, i].max(initial=0))):
            column.append(column[-1] * x[..., i])
        result.append(column)
    return result


def _product(powers: list[list[FloatArray]], row: IntArray, shape: tuple[int, ...]) -> FloatArray:
    result = np.ones(shape)
    for i in np.flatnonzero(row):
        result = result * powers[i][row[i]]
    return result
