"""Plackett–Burman two-level screening designs with 8, 12, 16, … 48 runs.

Source: Plackett and Burman 1946, Biometrika 33:305. Cyclic shifts of one printed row, except for 28 runs (nine
generator rows in three blocks A | B | C; R's FrF2 package and the transcription
github.com/paulo-raca/plackett-burman print the same) and 40 (the 20-run table doubled). Every column is orthogonal to
every other and sums to zero, so N runs estimate N - 1 main effects independently of each other. Main effects are not
free of two-factor interactions: see `interaction_aliases`.

The printed tables of 8, 16 and 32 runs are regular fractions of a factorial, in which main effects are fully aliased
with two-factor interactions. There is no other table of 8 runs. For 16 and 32 runs ``nonregular_table`` gives one in
which no main effect is fully aliased with a two-factor interaction, so that any three factors occur in all combinations
(projectivity 3: Box and Tyssedal 1996, Biometrika 83:950). The last column of 40 runs tells the halves apart: with 39
factors it is fully aliased with 19 interactions, and every other main effect with one; with up to 38 factors none is.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import numpy.typing as npt

from doe.designs.design import Design, DesignOptions, Points, factor_letters, with_centre
from doe.errors import StatisticsError

IntArray = npt.NDArray[np.int64]
FloatArray = npt.NDArray[np.float64]

GENERATORS = {
    8: "+++-+--",
    12: "++-+++---+-",
    16: "++++-+-++--+---",
    20: "++--++++-+-+----++-",
    24: "+++++-+-++--++--+-+----",
    32: "----+-+-+++-++---+++++--++-+--+",
    36: "-+-+++---+++++-+++--+----+-+-++--+-",
    44: "++--+-+--+++-+++++---+-+++-----+---++-+-++-",
    48: "+++++-++++--+-+-+++--+--++-++---+-+-++----+----",
}
"""Number of runs → first row of the cyclic designs."""
GENERATOR_ROWS_28 = (
    "+-++++----+---+--+++-+-++-+",
    "++-+++-----++--+---++++-++-",
    "-+++++---+---+--+-+-+-++-++",
    "---+-++++--+-+---++-+++-+-+",
    "---++-++++----++--++--++++-",
    "----+++++-+-+---+--+++-+-++",
    "+++---+-+--+--+-+-+-++-+++-",
    "+++---++-+--+----+++-++--++",
    "+++----++-+--+-+---++-+++-+",
)
SIZES = tuple(range(8, 49, 4))
"""Numbers of runs that have a table."""
PALEY_32 = "+++-++-++++---+-+-+++----+--+--"
"""First row of the cyclic design of 32 runs: + at 0 and the squares modulo 31 (Paley 1933, J. Math. Phys. 12:311)."""
TURNED_8 = (0, 1, 2, 4, 5, 6, 3)
"""Order of the columns of the table of 8 runs in which none of the seven triples of positions with the column product
±1 keeps this product."""
ORDER_16 = (11, 13, 10, 6, 9, 12, 8, 7, 5, 2, 3, 4, 1, 0, 14)
"""Order of the columns of the nonregular table of 16 runs: with up to 8 factors, two-factor interactions are not
fully aliased with each other either."""
MOST_NONREGULAR = {16: 14, 32: 31}
"""Runs → largest number of factors without a main effect that is fully aliased with a two-factor interaction."""
MOST_ALIASES = 12
"""Interactions listed per factor; of the others only the number is given."""


def plackett_burman(runs: int) -> IntArray:
    """Return the Plackett–Burman design as levels -1 and +1, shape (runs, runs - 1), last row all -1.

    Raises StatisticsError unless runs is a multiple of 4 from 8 to 48.
    """
    if runs in GENERATORS:
        return _cyclic(_levels(GENERATORS[runs]))
    if runs == 28:
        return _block_cyclic(np.array([_levels(row) for row in GENERATOR_ROWS_28]))
    if runs == 40:
        return _doubled(plackett_burman(20))
    raise StatisticsError(f"runs = {runs} has no Plackett–Burman table here; allowed are {', '.join(map(str, SIZES))}")


def nonregular_table(runs: int) -> IntArray:
    """Return a table of 16 or 32 runs like `plackett_burman`'s that is not a regular fraction.

    With 16 runs: columns (h, k) and (h, -k) with h and k from two tables of 8 runs, and last the column that separates
    the halves, (1, -1). The last column is fully aliased with seven two-factor interactions, as is at least one column
    of every table of 16 runs made by doubling. Among the other 14 columns, alias coefficients are at most a half; among
    the 31 of 32 runs, a quarter.
    Raises StatisticsError for other numbers of runs.
    """
    if runs == 32:
        return _cyclic(_levels(PALEY_32))
    if runs == 16:
        upper = plackett_burman(8)
        lower, apart = upper[:, TURNED_8], np.ones((8, 1), dtype=np.int64)
        return np.vstack([np.hstack([upper, upper, apart]), np.hstack([lower, -lower, -apart])])[:, ORDER_16]
    only = ": every table of 8 runs is a regular fraction" if runs == 8 else ""
    raise StatisticsError(f"nonregular: no such table of {runs} runs{only}; allowed: 16 and 32 runs")


def tables(runs: int) -> tuple[IntArray, ...]:
    """Return every table with this number of runs; raises StatisticsError if there is none."""
    return plackett_burman(runs), *([nonregular_table(runs)] if runs in MOST_NONREGULAR else [])


def smallest_size(factors: int) -> int:
    """Return the least number of runs whose table has a column for each of `factors`.

    Raises StatisticsError outside 1..47 factors.
    """
    if not 1 <= factors < SIZES[-1]:
        raise StatisticsError(f"{factors} factors; allowed in a Plackett–Burman design: 1 to {SIZES[-1] - 1}")
    return next(size for size in SIZES if size > factors)


def fold_over(design: IntArray) -> IntArray:
    """Return the design followed by its mirror image, shape (2 x runs, columns).

    Frees every main effect from every two-factor interaction (Box and Wilson 1951).
    """
    return np.vstack([design, -design])


def interaction_aliases(design: IntArray) -> tuple[FloatArray, tuple[tuple[int, int], ...]]:
    """Return the alias matrix: how much of each two-factor interaction biases each main effect.

    The alias matrix is A = X'Z/runs with Z the products of column pairs: the estimate of effect j has the
    expectation effect_j + sum over pairs of A[j, pair] x effect_pair. Returns A, shape (columns, pairs), and
    the pairs of column indices.
    """
    products, pairs = _interactions(design)
    return (design.T @ products) / design.shape[0], pairs


def interaction_overlap(design: IntArray) -> float:
    """Return the largest |correlation| between two-factor interactions, 0 … 1; 0 with fewer than three columns."""
    if design.shape[1] < 3:
        return 0.0
    products, _ = _interactions(design)
    shared = np.abs(products.T @ products) / len(design)
    return float(np.max(shared - np.eye(len(shared)), initial=0.0))


def _interactions(design: IntArray) -> tuple[IntArray, tuple[tuple[int, int], ...]]:
    """Return the columns of all two-factor interactions, shape (runs, pairs), and the pairs of column indices."""
    pairs = tuple(combinations(range(design.shape[1]), 2))
    one, other = np.array(pairs, dtype=np.int64).reshape(-1, 2).T  # one column has no pairs
    return design[:, one] * design[:, other], pairs


def _levels(signs: str) -> IntArray:
    return np.array([1 if sign == "+" else -1 for sign in signs], dtype=np.int64)


def _cyclic(generator: IntArray) -> IntArray:
    """Return the generator, its successive right shifts and a row of -1."""
    rows = [np.roll(generator, shift) for shift in range(generator.size)]
    return np.vstack([*rows, -np.ones_like(generator)])


def _doubled(design: IntArray) -> IntArray:
    """Return the design of twice the runs, with one more column that separates the halves: [X X -1], [X -X +1].

    The second half comes first, so that the row of all -1 is the last.
    """
    apart = np.ones((design.shape[0], 1), dtype=np.int64)
    upper, lower = np.hstack([design, design, -apart]), np.hstack([design, -design, apart])
    return np.vstack([lower, upper])


def _block_cyclic(generators: IntArray) -> IntArray:
    """Return the rows [A B C], [C A B], [B C A] and a row of -1."""
    width = generators.shape[1] // 3
    blocks = [np.roll(generators, shift * width, axis=1) for shift in range(3)]
    return np.vstack([*blocks, -np.ones((1, generators.shape[1]), dtype=np.int64)])


class PlackettBurman(Design):
    """Two levels, with at least one run more than factors."""

    name = "plackett-burman"
    title = "Plackett–Burman"
    doc = "Main effects of up to 47 factors in 8 to 48 runs; folded over, clear of two-factor interactions."
    options = ("runs", "centre", "fold", "nonregular")
    main_effects_only = True

    def points(self, factors: int, options: DesignOptions) -> Points:
        """The smallest table with a column for each factor, or that of ``options.runs`` rows; then its mirror image, if
        folded; then centre runs.
        """
        least = smallest_size(factors)
        if options.nonregular:
            least = next((size for size, most in MOST_NONREGULAR.items() if most >= factors), least)
        size = least if options.runs is None else options.runs
        table = nonregular_table(size) if options.nonregular else plackett_burman(size)
        most = MOST_NONREGULAR[size] if options.nonregular else size - 1
        if factors > most:
            raise StatisticsError(f"runs = {size}: has {most} columns for {factors} factors; allowed: at least {least}")
        levels = fold_over(table) if options.fold else table
        rows = with_centre(levels, options.centre)
        traits = [f"{size} runs, {size - 1 - factors} columns without a factor"]
        traits += ["nonregular"] if options.nonregular else []
        lines = alias_lines(levels[:, :factors])
        return Points(
            rows[:, :factors],
            rows[:, factors:],
            traits=(*traits, "folded over") if options.fold else tuple(traits),
            aliases=lines,
            notes=_confused(levels[:, :factors], size) if lines else _clear_of_interactions(levels[:, :factors]),
        )


def _confused(design: IntArray, size: int) -> tuple[str, ...]:
    """If a two-factor interaction is fully aliased with a main effect, a sentence on what would separate them."""
    shares, _ = interaction_aliases(design)
    if np.abs(shares).max() < 1 - 1e-9:
        return ()
    other = "no other table of 8 runs is better; " if size == 8 else ""
    if design.shape[1] <= MOST_NONREGULAR.get(size, 0):
        other = "--nonregular gives as many runs in which none is; "
    return (
        "Some interactions of two factors are one main effect wholly, and nothing in these runs tells them apart: "
        f"{other}--fold frees the main effects.",
    )


def alias_lines(design: IntArray) -> tuple[str, ...]:
    """Return a line for each factor that is aliased with two-factor interactions, by letters, largest shares first."""
    letters = factor_letters(design.shape[1])
    shares, pairs = interaction_aliases(design)
    lines = []
    for j, letter in enumerate(letters):
        leaks = [(shares[j, p], "".join(letters[i] for i in pair)) for p, pair in enumerate(pairs)]
        leaks = sorted((leak for leak in leaks if abs(leak[0]) > 1e-9), key=lambda leak: -abs(leak[0]))
        if leaks:
            shown = "".join(
                f" {'−' if share < 0 else '+'} {_share(share)}{name}" for share, name in leaks[:MOST_ALIASES]
            )
            more = len(leaks) - MOST_ALIASES
            lines.append(f"{letter}{shown}" + (f" and {more} more" if more > 0 else ""))
    return tuple(lines)


def _clear_of_interactions(design: IntArray) -> tuple[str, ...]:
    """For clear main effects, a sentence on two-factor interactions that are aliased with each other, if any are."""
    shared = interaction_overlap(design)
    if shared < 1e-9:
        return ()
    return (
        "Main effects are clear of interactions of two factors; those share columns with each other, "
        f"up to {_share(shared) or 'the whole '}of one. Three-factor interactions are not looked at.",
    )


def _share(value: float) -> str:
    """An alias coefficient as a fraction: these designs have thirds, fifths and sevenths."""
    size = abs(float(value))
    if abs(size - 1) < 1e-9:
        return ""
    for denominator in range(2, 13):
        numerator = size * denominator
        if abs(numerator - round(numerator)) < 1e-9:
            return f"{round(numerator)}/{denominator} "
    return f"{size:.3f} "
