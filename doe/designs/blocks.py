"""Which products of factor columns split a two-level design into blocks (days, batches, operators).

Differences between blocks then do not bias the effects that matter. The signs of q products (block generators) assign
each run to a block. The generators and all their products, 2^q - 1 block contrasts for 2^q blocks, are confounded with
the blocks, and so is every effect that is aliased with one of them. A column of a design with 2^m runs is a number
1 … 2^m - 1 whose bits are the basic factors in its product, so that the product of two columns is the exclusive or of
their numbers. The search confounds no main effect, then the fewest interactions of two, of three and of four factors.
Source: Montgomery 2017, Design and Analysis of Experiments, ch. 7; Box, Hunter and Hunter 2005, Statistics for
Experimenters, ch. 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError

IntArray = npt.NDArray[np.int64]
MOST_TRIALS = 30_000
"""Columns tried in one search: all of them with up to 32 runs; with more runs, the most promising ones come first."""


def block_generators(columns: Sequence[int], blocks: int, clear: int = 1) -> tuple[int, ...]:
    """Return the q columns whose signs split a design into `blocks` = 2^q blocks of equal size.

    columns: those of the factors. clear: effects of up to this number of factors are kept clear of the blocks, 1 or 2.
    Raises StatisticsError, which lists the possible numbers of blocks, if there is no such split.
    """
    basic = max(columns).bit_length()
    lost = _effects_on_columns(columns, basic)
    splits = {2**q: q for q in range(1, basic)}
    found = _search(lost, splits[blocks], clear, first=False) if blocks in splits else None
    if found is not None:
        return found
    possible = [str(number) for number in possible_blocks(columns, clear)]
    what = "main effects" if clear == 1 else "main effects and two-factor interactions"
    raise StatisticsError(
        f"blocks = {blocks}: would be aliased with {what} in {2**basic} runs of {len(columns)} factors; "
        f"allowed: {', '.join(possible) or 'no blocks'}"
    )


def possible_blocks(columns: Sequence[int], clear: int = 1) -> tuple[int, ...]:
    """Return the numbers of blocks for which `block_generators` finds a split."""
    basic = max(columns).bit_length()
    lost = _effects_on_columns(columns, basic)
    return tuple(2**q for q in range(1, basic) if _search(lost, q, clear, first=True) is not None)


def spanned(generators: Sequence[int]) -> tuple[int, ...]:
    """Return the block contrasts: every product of the generators except the empty one."""
    span = [0]
    for generator in generators:
        span += [generator ^ one for one in span]
    return tuple(span[1:])


def _effects_on_columns(columns: Sequence[int], basic: int) -> IntArray:
    """Return the number of effects of one to four factors in each column, shape (2^basic, 4)."""
    found = np.zeros((2**basic, 4), dtype=np.int64)
    for size in (1, 2, 3, 4):
        for group in combinations(columns, size):
            column = 0
            for one in group:
                column ^= one
            found[column, size - 1] += 1
    return found


def _search(lost: IntArray, q: int, clear: int, first: bool) -> tuple[int, ...] | None:
    """Return the best q generators, or the first allowed ones; None if there are none.

    Every set of contrasts is visited once: a generator must have a higher rank than those before it and the lowest rank
    of the contrasts that it adds.
    """
    allowed = np.asarray(lost[:, :clear].sum(axis=1) == 0)
    free = [column for column in np.flatnonzero(allowed).tolist() if column]
    ranked = sorted(free, key=lambda column: (*lost[column, :3], column.bit_count() % 2, column))
    rank = np.full(len(lost), len(lost))
    rank[ranked] = np.arange(len(ranked))
    best: tuple[tuple[int, ...], tuple[int, ...]] | None = None
    trials = 0

    def extend(chosen: tuple[int, ...], span: IntArray, cost: tuple[int, ...], start: int) -> None:
        nonlocal best, trials
        if len(chosen) == q:
            if best is None or cost < best[0]:
                best = cost, chosen
            return
        for position in range(start, len(ranked)):
            if trials >= MOST_TRIALS or (best is not None and (first or not any(best[0]))):
                return
            trials += 1
            column = ranked[position]
            added = span ^ column
            if rank[added].min() < position or not allowed[added].all():
                continue
            total = tuple(int(one) for one in np.add(cost, lost[added].sum(axis=0)))
            if best is None or total < best[0]:
                extend((*chosen, column), np.concatenate([span, added]), total, position + 1)

    extend((), np.zeros(1, dtype=np.int64), (0, 0, 0, 0), 0)
    return None if best is None else best[1]
