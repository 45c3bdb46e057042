"""Optimal designs: the runs that estimate the terms of a model most precisely.

They exist for any number of runs, with constraints on the region, with categorical factors, and beside finished runs.

X is the model matrix of N runs, p the number of its terms, f(x) a row of it. A D-optimal design has the largest
det(X'X), so that the joint confidence region of the coefficients is smallest; an I-optimal one has the smallest
variance of the prediction, f'(X'X)^-1 f in units of sigma^2, averaged over the region. Both are found by coordinate
exchange from several random starts: each level of each run in turn is set to the value that is best for the criterion,
until nothing changes. The result is the best design found, not a proven optimum. Source: Meyer and Nachtsheim 1995,
Technometrics 37:60; Atkinson, Donev and Tobias 2007, Optimum Experimental Designs.

A term is a product of functions of single factors: for a numeric factor 1, x, x^2 on -1 … +1; for a categorical factor
of c names (its levels) 1 and c - 1 contrasts, orthogonal over the names and with mean square 1; for 2 names, -1 and +1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from doe.designs.design import Design, DesignOptions, Efficiency, FloatArray, Model, Points, factor_letters
from doe.errors import StatisticsError

IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
SPARE_RUNS = 3
"""Default number of runs in excess of the number of terms."""
FEWEST_STARTS, MOST_STARTS = 6, 40
LEVELS_TO_SET = 1500
"""Approximate number of levels in all starts together: large designs get fewer starts."""
MOST_PASSES = 100
GRID = {"linear": (-1.0, 1.0), "interactions": (-1.0, 1.0), "quadratic": (-1.0, -0.5, 0.0, 0.5, 1.0)}
"""Model → levels that a numeric factor may take, besides the ends of its range under the constraints."""
RIDGE = 1e-6
"""Times N, added to the diagonal of X'X: X'X is then invertible even while there are too few runs, and runs that add
missing information are preferred."""
REGION_POINTS = 4096
"""Number of points drawn in the cube; those within the constraints represent the region."""
MOST_CANDIDATES = 3000
FEWEST_IN_REGION = 20
SLACK = 1e-9
"""Tolerance of a constraint, in coded units."""


@dataclass(frozen=True)
class Region:
    """The allowed runs: number of names per factor (0: numeric, on -1 … +1), constraints a x <= b as rows (a, b)."""

    levels: tuple[int, ...]
    constraints: FloatArray

    def allowed(self, points: FloatArray) -> BoolArray:
        """Whether each point, shape (n, factors), is within the constraints."""
        return np.asarray((points @ self.constraints[:, :-1].T <= self.constraints[:, -1] + SLACK).all(axis=1))

    def choices(self, point: FloatArray, factor: int, grid: Sequence[float]) -> FloatArray:
        """The levels that one factor may take with the others fixed: its names, or the grid and ends of its range."""
        if self.levels[factor]:
            return codes(self.levels[factor])
        low, high = -1.0, 1.0
        for *weights, bound in self.constraints:
            if weights[factor]:
                end = (bound - np.dot(weights, point)) / weights[factor] + point[factor]
                low, high = (low, min(high, end)) if weights[factor] > 0 else (max(low, end), high)
        inside = [one for one in grid if low < one < high]
        return np.array([low, *inside, high]) if low < high else np.array([point[factor]])

    def candidates(self, grid: Sequence[float]) -> FloatArray:
        """Points from which a search starts, shape (n, factors): combinations of low, middle, high and names, and at
        each of them the ends of every constrained factor's range; if none of these is allowed, the sample.
        """
        corners = [one for one in grid if one in (-1.0, 0.0, 1.0)]
        levels = [codes(names) if names else np.array(corners) for names in self.levels]
        if np.prod([len(one) for one in levels], dtype=np.float64) <= MOST_CANDIDATES:
            points = np.array(list(product(*levels)))
        else:
            random = np.random.default_rng(0)
            points = np.stack([random.choice(one, MOST_CANDIDATES) for one in levels], axis=1)
        cut = np.flatnonzero(self.constraints[:, :-1].any(axis=0)).tolist()
        ends = []
        for point in points:
            for factor in cut:
                for level in self.choices(point, factor, ())[[0, -1]]:
                    ends.append([*point[:factor], level, *point[factor + 1 :]])
        every = np.vstack([points, *ends]) if ends else points
        found = np.unique(every[self.allowed(every)].round(12), axis=0)
        return found if len(found) else self.sample

    @cached_property
    def sample(self) -> FloatArray:
        """Points spread over the region, shape (n, factors); raises StatisticsError if the region is too small."""
        drawn = 2 * qmc.Sobol(len(self.levels), rng=np.random.default_rng(0)).random(REGION_POINTS) - 1
        for factor, names in enumerate(self.levels):
            if names:
                place = np.minimum((drawn[:, factor] + 1) / 2 * names, names - 1).astype(np.int64)
                drawn[:, factor] = codes(names)[place]
        within = drawn[self.allowed(drawn)]
        if len(within) < FEWEST_IN_REGION:
            raise StatisticsError(
                f"constraints: only {len(within)} of {REGION_POINTS} random points between low and high satisfy them; "
                f"allowed: at least {FEWEST_IN_REGION}"
            )
        return within


@dataclass(frozen=True)
class Terms:
    """Terms of a model: for each term the index of the function of each factor, shape (p, factors), and its name."""

    functions: IntArray
    names: tuple[str, ...]
    levels: tuple[int, ...]

    def matrix(self, points: FloatArray) -> FloatArray:
        """The model matrix at points, shape (n, factors) -> (n, p)."""
        columns = np.ones((len(points), len(self.names)))
        for factor, names in enumerate(self.levels):
            columns *= _functions(points[:, factor], names)[:, self.functions[:, factor]]
        return columns

    def moments(self, region: Region) -> FloatArray:
        """The mean of f f' over the region, shape (p, p): exact for the cube, over the sample if constrained."""
        if len(region.constraints):
            rows = self.matrix(region.sample)
            return np.asarray(rows.T @ rows / len(rows))
        found = np.ones((len(self.names), len(self.names)))
        for factor, names in enumerate(self.levels):
            # For 1, x and x² on -1 … +1: the mean of x² is 1/3, of x⁴ 1/5. The functions of names are orthonormal.
            mean = np.eye(names) if names else np.array([[1, 0, 1 / 3], [0, 1 / 3, 0], [1 / 3, 0, 1 / 5]])
            found *= mean[np.ix_(self.functions[:, factor], self.functions[:, factor])]
        return found

    def estimable(self, points: FloatArray) -> BoolArray:
        """Whether the runs at points can estimate each term separately from all others, shape (p,)."""
        if not len(points):
            return np.zeros(len(self.names), dtype=np.bool_)
        _, singular, vectors = np.linalg.svd(self.matrix(points), full_matrices=True)
        rank = int((singular > 1e-9 * singular.max(initial=0.0)).sum())
        return np.asarray(np.abs(vectors[rank:]).max(axis=0, initial=0.0) < 1e-7)


def codes(names: int) -> FloatArray:
    """Return the coded levels of a categorical factor with this number of names: -1 … +1 in equal steps."""
    return np.linspace(-1.0, 1.0, names)


def model_terms(levels: Sequence[int], model: Model) -> Terms:
    """Return the terms of a model; a categorical factor has one main effect fewer than names, and no square."""
    letters, k = factor_letters(len(levels)), len(levels)
    rows, names = [np.zeros(k, dtype=np.int64)], ["intercept"]

    def functions(factor: int) -> list[tuple[int, str]]:
        contrasts = levels[factor] - 1
        if contrasts < 2:
            return [(1, letters[factor])]
        return [(one, f"{letters[factor]}[{one}]") for one in range(1, contrasts + 1)]

    def add(parts: dict[int, int], name: str) -> None:
        row = np.zeros(k, dtype=np.int64)
        row[list(parts)] = list(parts.values())
        rows.append(row)
        names.append(name)

    for factor in range(k):
        for number, name in functions(factor):
            add({factor: number}, name)
    if model != "linear":
        for one, other in combinations(range(k), 2):
            for number, name in functions(one):
                for number_2, name_2 in functions(other):
                    add({one: number, other: number_2}, f"{name}*{name_2}")
    if model == "quadratic":
        for factor in range(k):
            if not levels[factor]:
                add({factor: 2}, f"{letters[factor]}^2")
    return Terms(np.array(rows), tuple(names), tuple(levels))


def optimal_design(
    terms: Terms, region: Region, runs: int, grid: Sequence[float], kept: FloatArray, mean_variance: bool, seed: int
) -> FloatArray:
    """Return `runs` points to be added to those kept, shape (runs, factors): the best result of several starts.

    mean_variance: whether to minimise the mean variance of the prediction (I) or to maximise det(X'X) (D).
    """
    random = np.random.default_rng(seed)
    moments = terms.moments(region)
    fixed = terms.matrix(kept).T @ terms.matrix(kept) + RIDGE * (runs + len(kept)) * np.eye(len(terms.names))
    candidates = region.candidates(grid)
    # On an edge that is parallel to no axis, no single level can change alone; a whole run can be replaced.
    others = candidates if len(region.constraints) else np.zeros((0, len(region.levels)))
    best: tuple[float, FloatArray] | None = None
    for start in range(_starts(runs, len(region.levels))):
        points = candidates[random.integers(len(candidates), size=runs)]
        # Every second I-optimal search starts from a D-optimal result.
        for criterion in (None, moments) if mean_variance and start % 2 else (moments if mean_variance else None,):
            _exchange(points, terms, region, grid, fixed, criterion, others)
        information = fixed + terms.matrix(points).T @ terms.matrix(points)
        if mean_variance:
            worth = -float(np.trace(np.linalg.solve(information, moments)))
        else:
            worth = float(np.linalg.slogdet(information)[1])
        if best is None or worth > best[0] + 1e-9 * abs(best[0]):
            best = worth, points
    assert best is not None, "no start was made"
    return best[1]


def _starts(runs: int, factors: int) -> int:
    return min(max(LEVELS_TO_SET // (runs * factors), FEWEST_STARTS), MOST_STARTS)


def _exchange(
    points: FloatArray,
    terms: Terms,
    region: Region,
    grid: Sequence[float],
    fixed: FloatArray,
    moments: FloatArray | None,
    candidates: FloatArray,
) -> None:
    """Improve points in place: change one level of one run at a time, or replace a whole run by a candidate.

    With A the inverse of X'X without the run, adding a run with the row f multiplies det(X'X) by 1 + f'Af and reduces
    the mean variance by f'A M A f/(1 + f'Af) (M: moments of the region).
    """
    rows, candidate_rows = terms.matrix(points), terms.matrix(candidates)
    for _ in range(MOST_PASSES):
        changed = False
        for run in range(len(points)):
            others = np.delete(rows, run, axis=0)
            inverse = np.linalg.inv(fixed + others.T @ others)
            spread = None if moments is None else inverse @ moments @ inverse
            for factor in range(-1 if len(candidates) else 0, points.shape[1]):
                if factor < 0:
                    offered, f = np.vstack([points[[run]], candidates]), np.vstack([rows[[run]], candidate_rows])
                else:
                    levels = region.choices(points[run], factor, grid)
                    offered = np.repeat(points[[run]], 1 + len(levels), axis=0)
                    offered[1:, factor] = levels
                    f = terms.matrix(offered)
                gain = np.einsum("ni,ij,nj->n", f, inverse, f)
                if spread is not None:
                    gain = np.einsum("ni,ij,nj->n", f, spread, f) / (1 + gain)
                chosen = int(np.argmax(gain))
                if gain[chosen] > gain[0] * (1 + 1e-9):
                    points[run], rows[run], changed = offered[chosen], f[chosen], True
        if not changed:
            return


def efficiency(terms: Terms, region: Region, points: FloatArray, grid: Sequence[float]) -> Efficiency:
    """Return the efficiency of the runs at points, shape (N, factors), for a model.

    The largest variance is searched for from every run and some points of the region, by changing one level at a time.
    """
    rows = terms.matrix(points)
    n, p = rows.shape
    inverse = np.linalg.inv(rows.T @ rows)
    largest = 0.0
    for start in np.vstack([points, region.sample[:50]]):
        point, before = start.copy(), -1.0
        while True:
            for factor in range(len(point)):
                levels = region.choices(point, factor, grid)
                offered = np.repeat(point[None], len(levels), axis=0)
                offered[:, factor] = levels
                f = terms.matrix(offered)
                variance = np.einsum("ni,ij,nj->n", f, inverse, f)
                point = offered[int(np.argmax(variance))]
            if variance.max() <= before * (1 + 1e-9):
                break
            before = float(variance.max())
        largest = max(largest, before)
    return Efficiency(
        d=100 * float(np.exp(np.linalg.slogdet(rows.T @ rows)[1] / p)) / n,
        a=100 * p / (n * float(np.trace(inverse))),
        g=100 * p / (n * largest),
        mean_variance=float(np.trace(inverse @ terms.moments(region))),
    )


class OptimalDesign(Design):
    """Runs that estimate a given model most precisely."""

    title = "optimal"
    options = ("runs", "model", "constraints", "levels", "kept")
    mean_variance: ClassVar[bool]

    def points(self, factors: int, options: DesignOptions) -> Points:
        """The kept runs, then the new ones; by default there are at least three more runs than terms in all."""
        levels = options.levels or (0,) * factors
        constraints = np.array(options.constraints, dtype=np.float64).reshape(-1, factors + 1)
        terms, region = model_terms(levels, options.model), Region(levels, constraints)
        kept = np.array(options.kept, dtype=np.float64).reshape(-1, factors)
        p, rank = len(terms.names), int(np.linalg.matrix_rank(terms.matrix(kept))) if len(kept) else 0
        runs = max(p + SPARE_RUNS - len(kept), p - rank, 1) if options.runs is None else options.runs
        if runs < p - rank:
            beside = f" beside {len(kept)} finished runs, which determine {rank} of them" if len(kept) else ""
            raise StatisticsError(
                f"runs = {runs}: too few for the {p} terms of the {options.model} model{beside}; "
                f"allowed: at least {p - rank}"
            )
        grid = GRID[options.model]
        added = optimal_design(terms, region, runs, grid, kept, self.mean_variance, options.seed)
        design = np.vstack([kept, added])
        told = terms.estimable(design)
        if not told.all():
            lost = ", ".join(name for name, known in zip(terms.names, told, strict=True) if not known)
            raise StatisticsError(f"model {options.model}: no runs within the constraints can separate {lost}")
        found = efficiency(terms, region, design, grid)
        notes = [
            f"D-efficiency {found.d:.1f} %, A-efficiency {found.a:.1f} %, G-efficiency {found.g:.1f} % (100 %: "
            f"orthogonal{', which a quadratic model cannot be' if options.model == 'quadratic' else ''}); "
            f"variance of the prediction in the mean over the region {found.mean_variance:.3g} σ². The best of "
            f"{_starts(runs, factors)} starts, not proved to be the best."
        ]
        before = terms.estimable(kept)
        gained = tuple(name for name, was in zip(terms.names, before, strict=True) if not was)
        if len(kept):
            notes.append(
                f"The {len(kept)} finished runs could not tell apart {', '.join(gained)}; with the {runs} added runs "
                "they are told."
                if gained
                else f"The {len(kept)} finished runs tell every term already; the {runs} added runs tell them better."
            )
        return Points(
            design,
            traits=(f"{options.model} model of {p} terms", *([f"{len(kept)} runs kept"] if len(kept) else [])),
            notes=tuple(notes),
            efficiency=found,
            gained=gained if len(kept) else (),
        )


class DOptimal(OptimalDesign):
    """The largest det(X'X): the coefficients together are estimated most precisely."""

    name = "d-optimal"
    title = "D-optimal"
    doc = "Any number of runs for a given model, within constraints or added to finished runs: precise coefficients."
    mean_variance = False


class IOptimal(OptimalDesign):
    """The smallest mean variance of the prediction over the region."""

    name = "i-optimal"
    title = "I-optimal"
    doc = "As d-optimal, but for the smallest mean variance of the prediction over the region."
    mean_variance = True


def _functions(levels: FloatArray, names: int) -> FloatArray:
    """The functions of one factor at its levels, shape (n,) -> (n, functions)."""
    if not names:
        return np.stack([np.ones_like(levels), levels, levels**2], axis=1)
    place = np.rint((levels + 1) / 2 * (names - 1)).astype(np.int64)
    contrasts, _ = np.linalg.qr(np.vander(codes(names), increasing=True))
    return np.asarray(contrasts[place] * np.sqrt(names) * np.sign(contrasts[-1]))
