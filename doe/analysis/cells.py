"""Sum a density over a grid of two sizes that is fine only where the density needs it.

Neighbouring nodes along either axis make a cell, which is summed by its middle. Where the density may change too much
across a cell and is not negligible, the cell is parted into three by three, down to single nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Places = npt.NDArray[np.int64]

CELL, PARTS = 9, 3
"""Nodes along an axis in a first cell, and parts of a cell along either axis."""
SMOOTH = 3.0
"""Change across a cell up to which its middle stands for it [standard deviations of the density]: Gaussian terms that
are as far apart add up to within 0.23 of their integral (Poisson's summation formula, 2 exp(−2π²/9))."""
NEGLIGIBLE = 10.0
"""Log density below the largest from which on nothing matters."""


@dataclass(frozen=True)
class Cells:
    """Cells that cover a grid.

    Attributes
    ----------
    first, second
        Nodes in their middles, (n,).
    share
        Log of the share of the counted nodes that each holds, (n,).
    logs
        Log density in their middles, (n,).
    """

    first: Places
    second: Places
    share: FloatArray
    logs: FloatArray


def parted_cells(
    density: Callable[[Places, Places, int], FloatArray],
    changes: Sequence[FloatArray],
    counted: Sequence[npt.NDArray[np.bool_]],
    floor: float = -math.inf,
) -> Cells:
    """Cells that are small enough for ``density``; the largest is in a cell of one node.

    Parameters
    ----------
    density
        Log density (n,) at nodes (n,) of both axes, for cells of so many nodes along either.
    changes
        By how many of its standard deviations the density changes from each node of an axis to the next. An axis has a
        whole number of cells; from one of these to the next it may go back.
    counted
        Which nodes of each axis are summed at all; at least one.
    floor
        Log density up to which nothing matters, for something else is as large: no cell is parted below it.
    """
    before = [np.concatenate([[0], np.cumsum(some)]) for some in counted]
    every, size, largest = before[0][-1] * before[1][-1], CELL, floor
    first, second = (grid.reshape(-1) for grid in np.meshgrid(*(np.arange(0, len(one), CELL) for one in counted)))
    found: list[tuple[npt.NDArray[np.generic], ...]] = []
    while True:
        held = np.prod([b[at + size] - b[at] for b, at in zip(before, (first, second), strict=True)], axis=0)
        first, second, held = (one[held > 0] for one in (first, second, held))
        i, j = first + size // 2, second + size // 2
        logs = density(i, j, size)
        largest = max(largest, float(logs.max()))
        across = size * np.stack([changes[0][i], changes[1][j]])
        # A Gaussian's √(2 (largest − log)) may be less by half of this elsewhere in the cell.
        reach = math.sqrt(2.0 * NEGLIGIBLE) + 0.5 * np.linalg.norm(across, axis=0)
        parted = (logs > largest - 0.5 * reach**2) & ((across.max(axis=0) > SMOOTH) | (logs == largest)) & (size > 1)
        found.append(tuple(one[~parted] for one in (i, j, np.log(held / every), logs)))
        if not parted.any():
            return Cells(*(np.concatenate(column) for column in zip(*found, strict=True)))
        size //= PARTS
        steps = size * np.arange(PARTS)
        first = np.repeat(first[parted][:, None] + steps, PARTS, axis=1).reshape(-1)
        second = np.tile(second[parted][:, None] + steps, PARTS).reshape(-1)
