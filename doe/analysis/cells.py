"""Sum a density over a two-dimensional grid that is refined only where the density needs it.

A cell covers neighbouring nodes along both axes; its middle node stands for it in the sum. Where the density may change
too much across a cell and is not negligible, the cell is split into three by three, down to single nodes.
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
"""Nodes of an initial cell along each axis, and parts into which a cell is split along each axis."""
SMOOTH = 3.0
"""Largest change across a cell for which its middle may stand for it [standard deviations of the density]: a sum of
Gaussian terms with this spacing is within 0.23 of its integral (Poisson's summation formula, 2 exp(−2π²/9))."""
NEGLIGIBLE = 10.0
"""Drop of the log density below its largest value beyond which a cell is negligible."""


@dataclass(frozen=True)
class Cells:
    """Cells that cover a grid.

    Attributes
    ----------
    first, second
        Indices of their middle nodes along the two axes, (n,).
    share
        Log of the share of the counted nodes in each cell, (n,).
    logs
        Log density at their middle nodes, (n,).
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
    """Cells small enough for ``density``; its largest value is in a cell of one node.

    Parameters
    ----------
    density
        Returns the log density (n,) at nodes (n,), (n,) of the two axes, given the number of nodes of a cell along
        each axis.
    changes
        Change of the density from each node of an axis to the next [its standard deviations]. An axis holds a whole
        number of initial cells; from one cell to the next its values may jump back.
    counted
        Which nodes of each axis enter the sum; at least one.
    floor
        Log density up to which nothing matters, because something else is as large: it counts as the largest value
        found so far.
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
        # Elsewhere in the cell a Gaussian's √(2 (largest − log)) may be smaller by half the length of ``across``.
        reach = math.sqrt(2.0 * NEGLIGIBLE) + 0.5 * np.linalg.norm(across, axis=0)
        parted = (logs > largest - 0.5 * reach**2) & ((across.max(axis=0) > SMOOTH) | (logs == largest)) & (size > 1)
        found.append(tuple(one[~parted] for one in (i, j, np.log(held / every), logs)))
        if not parted.any():
            return Cells(*(np.concatenate(column) for column in zip(*found, strict=True)))
        size //= PARTS
        steps = size * np.arange(PARTS)
        first = np.repeat(first[parted][:, None] + steps, PARTS, axis=1).reshape(-1)
        second = np.tile(second[parted][:, None] + steps, PARTS).reshape(-1)
