"""The straight part of a force–displacement curve, by a rule.

1. Only the way up to the largest force counts, at displacements that grow. More than ``MOST_POINTS`` points are
   averaged in neighbouring groups for the search.
2. A window of points is straight if, about its least-squares line, the mean residual of each of its fifths is at most
   ``STRAIGHTNESS`` of the force that the line spans in it, plus 1.5 standard errors of such a mean. The noise is that
   of the points about the chord between their neighbours (median, so that a kink does not count). Fifths, because a
   bend and an S both show there, while single points only show noise.
3. Of the straight windows with at least ``FEWEST_POINTS`` points and ``LEAST_SPAN`` of the largest force, the one that
   spans the most force is taken: a toe is long in displacement but short in force.
4. A tenth of its displacement is cut off at either end, where the bend begins within the tolerance of 2, and the line
   through the remaining points, all of them, gives the slope.

The idea, to search for the straightest stretch of a stated least size, is that of ASTM E3076 (slope of the linear
region of a test record); rule and numbers are ours and are tested on made-up curves with toe and yield. A curve that
follows F ∝ δ^1.5 all the way is a Hertzian contact; its slope grows with the force, and ``hertzian`` says so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError
from doe.record import Record

Array = npt.NDArray[np.float64]

FEWEST_POINTS = 8
LEAST_SPAN = 0.2
PARTS = 5
STRAIGHTNESS = 0.002
NOISE_FACTOR = 1.5
TRIMMED = 0.1
MOST_POINTS = 200
HERTZ_CLOSER = 0.5
"""A curve is Hertzian if F^(2/3) against δ misses it by less than this share of what the best straight line misses."""
HERTZ_MISFIT = 0.01
"""… and by less than this share of the largest force (RMS)."""


@dataclass(frozen=True)
class LinearRange(Record):
    """Slope [N/m] of the straight part, its standard error, and where that part lies [m, N].

    origin: displacement [m] at which the line meets zero force, the length of the toe. share: of the largest force that
    the part spans. noise: standard deviation of a point [N]. hertzian: the whole curve is closer to F ∝ δ^1.5.
    """

    slope: float
    standard_error: float
    r_squared: float
    points: int
    first_displacement: float
    last_displacement: float
    first_force: float
    last_force: float
    origin: float
    share: float
    noise: float
    hertzian: bool

    @property
    def drawn(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The line from zero force to its last point, displacement [m] and force [N]."""
        return (self.origin, self.first_displacement, self.last_displacement), (0.0, self.first_force, self.last_force)


def linear_range(displacement: npt.ArrayLike, force: npt.ArrayLike) -> LinearRange:
    """The straight part of a curve [m], [N] in the order of time; StatisticsError where there is none."""
    x, f = way_up(np.asarray(displacement, dtype=np.float64), np.asarray(force, dtype=np.float64))
    if x.size < FEWEST_POINTS:
        raise StatisticsError(f"{x.size} points up to the largest force; allowed: at least {FEWEST_POINTS}")
    peak = float(f.max())
    if peak <= 0.0:
        raise StatisticsError("no force above zero; allowed: compression counted positive")
    coarse_x, coarse_f = averaged(x, f, MOST_POINTS)
    window = widest_straight_window(coarse_x, coarse_f / peak)
    if window is None:
        why = "; it follows F ∝ δ^1.5, a Hertzian contact" if is_hertzian(x, f) else ""
        raise StatisticsError(
            f"no straight part: every stretch of {LEAST_SPAN:.0%} of the largest force and {FEWEST_POINTS} points "
            f"bends{why}"
        )
    first, last = window
    low, high = _trimmed(coarse_x[first : last + 1])
    used = (x >= low) & (x <= high)
    if used.sum() < 3:
        used = (x >= coarse_x[first]) & (x <= coarse_x[last])
    return _fitted(x[used], f[used], peak, noise_of(x, f), is_hertzian(x, f))


def way_up(displacement: Array, force: Array) -> tuple[Array, Array]:
    """The points up to the largest force whose displacement exceeds all before."""
    if displacement.shape != force.shape or displacement.ndim != 1:
        raise StatisticsError(f"{displacement.size} displacements for {force.size} forces; allowed: equal numbers")
    end = int(force.argmax()) + 1 if force.size else 0
    x, f = displacement[:end], force[:end]
    before = np.concatenate([[-math.inf], np.maximum.accumulate(x)[:-1]])
    return x[x > before], f[x > before]


def averaged(x: Array, f: Array, most: int) -> tuple[Array, Array]:
    """The curve by at most ``most`` means of neighbouring points."""
    if x.size <= most:
        return x, f
    groups = np.array_split(np.arange(x.size), most)
    return np.array([x[g].mean() for g in groups]), np.array([f[g].mean() for g in groups])


def noise_of(x: Array, f: Array) -> float:
    """Standard deviation of a point, from its distance to the chord between its neighbours; unit of ``f``."""
    # The median of |z| of a normal z is 0.6745.
    return float(np.median(_off_chord(x, f))) / 0.6745 if x.size > 2 else 0.0


def relative_noise(x: Array, f: Array) -> float:
    """Standard deviation of a point over its force, of the points above a tenth of the largest force."""
    strong = f[1:-1] > 0.1 * f.max()
    return float(np.median(_off_chord(x, f)[strong] / f[1:-1][strong])) / 0.6745 if strong.any() else 0.0


def _off_chord(x: Array, f: Array) -> Array:
    """|z| of every inner point: its distance to the chord between its neighbours, scaled to that of one point."""
    weight = (x[1:-1] - x[:-2]) / (x[2:] - x[:-2])
    distance = f[1:-1] - (1.0 - weight) * f[:-2] - weight * f[2:]
    return np.asarray(np.abs(distance) / np.sqrt(1.0 + weight**2 + (1.0 - weight) ** 2))


def widest_straight_window(x: Array, f: Array) -> tuple[int, int] | None:
    """First and last point of the straight window that spans the most force; ``f`` relative to its largest value."""
    scale = float(x[-1] - x[0])
    u, noise = (x - x[0]) / scale, noise_of(x, f)
    sums = {
        name: np.concatenate([[0.0], np.cumsum(column)])
        for name, column in {"u": u, "f": f, "uu": u * u, "uf": u * f}.items()
    }
    first, last = np.triu_indices(x.size, FEWEST_POINTS - 1)
    slope, level = _lines(sums, first, last + 1)
    span = slope * (u[last] - u[first])
    number = last + 1 - first
    straight = span >= LEAST_SPAN
    for part in range(PARTS):
        begin, end = first + number * part // PARTS, first + number * (part + 1) // PARTS
        mean_u, mean_f = ((sums[k][end] - sums[k][begin]) / (end - begin) for k in ("u", "f"))
        tolerance = STRAIGHTNESS * span + NOISE_FACTOR * noise / np.sqrt(end - begin)
        straight &= np.abs(mean_f - level - slope * mean_u) <= tolerance
    if not straight.any():
        return None
    best = int(np.where(straight, span, -math.inf).argmax())
    return int(first[best]), int(last[best])


def _lines(sums: dict[str, Array], begin: npt.NDArray[np.int64], end: npt.NDArray[np.int64]) -> tuple[Array, Array]:
    """Slope and level at u = 0 of the least-squares lines through points ``begin`` … ``end`` − 1."""
    n = (end - begin).astype(np.float64)
    u, f, uu, uf = (sums[k][end] - sums[k][begin] for k in ("u", "f", "uu", "uf"))
    slope = (uf - u * f / n) / (uu - u * u / n)
    return slope, (f - slope * u) / n


def _trimmed(x: Array) -> tuple[float, float]:
    """Displacements between which the middle 1 − 2 ``TRIMMED`` of a window lie."""
    cut = TRIMMED * float(x[-1] - x[0])
    return float(x[0]) + cut, float(x[-1]) - cut


def _fitted(x: Array, f: Array, peak: float, noise: float, hertzian: bool) -> LinearRange:
    centred = x - x.mean()
    square = float(centred @ centred)
    slope = float(centred @ f) / square
    level = float(f.mean()) - slope * float(x.mean())
    rest = f - level - slope * x
    total = f - f.mean()
    error = math.sqrt(float(rest @ rest) / (x.size - 2) / square) if x.size > 2 else math.nan
    ends = level + slope * x[[0, -1]]
    return LinearRange(
        slope=slope,
        standard_error=error,
        r_squared=1.0 - float(rest @ rest) / float(total @ total),
        points=int(x.size),
        first_displacement=float(x[0]),
        last_displacement=float(x[-1]),
        first_force=float(ends[0]),
        last_force=float(ends[1]),
        origin=-level / slope,
        share=float(ends[1] - ends[0]) / peak,
        noise=noise,
        hertzian=hertzian,
    )


def is_hertzian(x: Array, f: Array) -> bool:
    """Whether F = c (δ − δ0)^1.5 misses the curve above a tenth of its peak by far less than a straight line does."""
    used = f > 0.1 * f.max()
    if used.sum() < FEWEST_POINTS:
        return False
    x, f = x[used], f[used]
    line = np.polyval(np.polyfit(x, f, 1), x)
    root = np.polyval(np.polyfit(x, np.cbrt(f * f), 1), x)
    straight, hertz = (float(np.sqrt(np.mean((f - model) ** 2))) for model in (line, np.maximum(root, 0.0) ** 1.5))
    return hertz < HERTZ_CLOSER * straight and hertz < HERTZ_MISFIT * float(f.max())
