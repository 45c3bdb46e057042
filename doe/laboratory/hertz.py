"""The modulus of a whole, curved body between flat plates: Hertz's law up to yield.

    one contact    F = 2√2 π/3 · E/(1 − ν²) · δ^1.5/√(K³ S),  S = 1/R + 1/R'
    n alike        each takes δ = ΔL/n of the approach ΔL of the plates
    sphere         K = (π/2)^(2/3) = 1.351, F = 4/3 E/(1 − ν²) √R δ^1.5

R and R' are the body's principal radii at the contact; the plate counts as rigid, and δ as small against R. K of an
elliptic contact, by the complete elliptic integrals K(m) and E(m) of the contact ellipse, 1 − m = (b/a)²:

    K = K(m) ((1 − m)/E(m))^(1/3),  (1 − m)(K(m) − E(m))/(m E(m)) = min(R, R')/(R + R')

Solved for E it is the equation of ASAE S368.4, Compression test of food materials of convex shape, for parallel plates
and for a single one, E = 0.338 F (1 − ν²)/D^1.5 · [Σ K S^(1/3)]^1.5 over the contacts: 0.338 stands for 3/(2√2 π) =
0.3376, so that the standard gives 0.11 % more. It takes F and D at one point before yield, and K, here exact, from
a table. Sources: Hertz 1882, J. reine angew. Math. 92:156; Johnson 1985, Contact Mechanics, section 4.2; ASAE S368.4.

Where a curve follows Hertz, by a rule (the way up, averaging, and noise as in ``linear_range.py``):

1. F = k (ΔL − δ0)^1.5 is fitted to a window from the first point on, k and δ0, the length of the toe, free. It holds if
   the mean residual of each fifth is at most ``STRAIGHTNESS`` of the window's largest force, plus 1.5 standard errors.
2. The longest window that holds counts, if it reaches ``LEAST_SPAN`` of the largest force. Where the curve goes on it
   has yielded there (bio-yield); the last tenth of the displacement since contact is cut off, where the bend begins
   within the tolerance.
3. With the exponent free as well, its 95 % interval (errors of any distribution) must come within ``EXPONENT_MISS`` of
   1.5. Where no window holds, all of the way up is fitted and nothing is Hertzian.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats
from scipy.optimize import brentq, least_squares
from scipy.special import ellipe, ellipkm1

from doe.errors import StatisticsError
from doe.laboratory.linear_range import (
    FEWEST_POINTS,
    LEAST_SPAN,
    NOISE_FACTOR,
    PARTS,
    STRAIGHTNESS,
    TRIMMED,
    Array,
    averaged,
    noise_of,
    way_up,
)
from doe.record import Record

HERTZ = 1.5
"""Exponent of the law."""
EXPONENT_MISS = 0.05
"""… and how far from it the interval of a fitted one may end: a bend of noise alone, or a tolerance of the rule."""
RESOLVED = 0.25
"""Half-width of the exponent's interval up to which it tells Hertz's contact from flat faces."""
SEARCHED = 100
"""Points of the curve for the search; more are averaged in neighbouring groups."""
EXPONENTS = (0.2, 8.0)
"""Between which a free one is sought."""
EXACT, S368 = 3.0 / (2.0 * math.sqrt(2.0) * math.pi), 0.338
"""The constant of the law, and as the standard rounds it."""
DRAWN = 40
"""Points of the law where it is drawn."""


@dataclass(frozen=True)
class CurvedBody:
    """A body between plates: principal radii at the contact [m], Poisson's ratio, and the number of contacts."""

    radius: float
    radius_2: float
    poisson_ratio: float
    contacts: int

    def modulus(self, stiffness: float, constant: float = EXACT) -> float:
        """E [Pa] from k of F = k ΔL^1.5 [N/m^1.5]."""
        term = self.contacts * shape_constant(self.radius, self.radius_2)
        curvature = 1.0 / self.radius + 1.0 / self.radius_2
        return constant * stiffness * (1.0 - self.poisson_ratio**2) * math.sqrt(curvature * term**3)


def shape_constant(radius: float, radius_2: float) -> float:
    """K of a contact with a plate, 1.351 for a sphere and smaller the longer the ellipse."""
    share = min(radius, radius_2) / (radius + radius_2)

    def integrals(rest: float) -> tuple[float, float]:
        return float(ellipkm1(rest)), float(ellipe(1.0 - rest))

    def miss(rest: float) -> float:
        k, e = integrals(rest)
        return rest * (k - e) / ((1.0 - rest) * e) - share

    # Near a circle the quotient is 0/0, and K is that of the circle to the last digits: it has no first-order term.
    nearly = 1.0 - 1e-6
    rest = float(brentq(miss, 1e-15, nearly, xtol=1e-16)) if miss(nearly) > 0.0 else 1.0
    k, e = integrals(rest)
    return k * math.cbrt(rest / e)


@dataclass(frozen=True)
class HertzRange(Record):
    """k [N/m^1.5] of F = k (ΔL − origin)^1.5 before yield, its standard error, and where that part lies [m, N].

    exponent: fitted freely, with its 95 % interval. last_displacement, last_force: the part's last point as measured.
    origin: displacement at contact, the length of the toe. yield_displacement, yield_force: the
    end of the part that holds, NaN where that is the end of the curve. share: of the largest force that the part spans.
    noise: standard deviation of a point [N]. hertzian: whether a part holds, and the exponent is Hertz's.
    """

    stiffness: float
    standard_error: float
    exponent: float
    exponent_low: float
    exponent_high: float
    points: int
    first_displacement: float
    last_displacement: float
    last_force: float
    origin: float
    yield_displacement: float
    yield_force: float
    share: float
    noise: float
    hertzian: bool

    @property
    def resolved(self) -> bool:
        """Whether the exponent's interval is narrow enough to tell Hertz's contact from flat faces."""
        return self.exponent_high - self.exponent_low <= 2.0 * RESOLVED

    @property
    def drawn(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The fitted law from contact to its last point, displacement [m] and force [N]."""
        x = np.linspace(self.origin, self.last_displacement, DRAWN)
        return tuple(x.tolist()), tuple((self.stiffness * (x - self.origin) ** HERTZ).tolist())


def hertz_range(displacement: npt.ArrayLike, force: npt.ArrayLike) -> HertzRange:
    """Where a curve [m], [N] in the order of time follows Hertz's law; StatisticsError where it is no curve."""
    x, f = way_up(np.asarray(displacement, dtype=np.float64), np.asarray(force, dtype=np.float64))
    if x.size < FEWEST_POINTS:
        raise StatisticsError(f"{x.size} points up to the largest force; allowed: at least {FEWEST_POINTS}")
    peak, length = float(f.max()), float(x[-1] - x[0])
    if peak <= 0.0:
        raise StatisticsError("no force above zero; allowed: compression counted positive")
    u, g = averaged((x - x[0]) / length, f / peak, SEARCHED)
    end = next((end for end in range(u.size, FEWEST_POINTS - 1, -1) if _holds(u[:end], g[:end])), 0)
    yielded = 0 < end < u.size
    v, h = (x - x[0]) / length, f / peak
    if yielded:
        contact = _fitted(u[:end], g[:end]).origin
        used = v <= contact + (1.0 - TRIMMED) * (u[end - 1] - contact)
        v, h = (v[used], h[used]) if used.sum() >= FEWEST_POINTS else (u[:end], g[:end])
    law = _fitted(v, h)
    if not (law.stiffness > 0.0 and law.origin < v[-1] and h[-1] > 0.0):
        raise StatisticsError("no contact: the force does not rise from zero")
    free = _fitted(v, h, law)
    half = float(stats.t.ppf(0.975, v.size - 3)) * free.exponent_error
    scale = peak / length**HERTZ
    low, high = free.exponent - half, free.exponent + half
    return HertzRange(
        stiffness=law.stiffness * scale,
        standard_error=law.stiffness_error * scale,
        exponent=free.exponent,
        exponent_low=low,
        exponent_high=high,
        points=int(v.size),
        first_displacement=float(x[0]),
        last_displacement=float(x[0]) + length * float(v[-1]),
        last_force=peak * float(h[-1]),
        origin=float(x[0]) + length * law.origin,
        yield_displacement=float(x[0]) + length * float(u[end - 1]) if yielded else math.nan,
        yield_force=peak * float(g[end - 1]) if yielded else math.nan,
        share=float(h[-1]),
        noise=noise_of(x, f),
        hertzian=end > 0 and low <= HERTZ + EXPONENT_MISS and high >= HERTZ - EXPONENT_MISS,
    )


@dataclass(frozen=True)
class _Law:
    """F = k (u − origin)^exponent, and standard errors of k and the exponent (NaN where it is given)."""

    stiffness: float
    origin: float
    exponent: float
    stiffness_error: float = math.nan
    exponent_error: float = math.nan

    def force(self, u: Array) -> Array:
        return np.asarray(self.stiffness * np.maximum(u - self.origin, 0.0) ** self.exponent)


def _holds(u: Array, g: Array) -> bool:
    """Whether a window is high enough, and Hertz's law misses none of its fifths by more than noise does."""
    if g.max() < LEAST_SPAN:
        return False
    rest, noise = g - _fitted(u, g).force(u), noise_of(u, g)
    for part in np.array_split(np.arange(u.size), PARTS):
        # Where noise grows with the force, that of the whole is too little at the end.
        own = max(noise, noise_of(u[part], g[part]))
        if abs(rest[part].mean()) > STRAIGHTNESS * g.max() + NOISE_FACTOR * own / math.sqrt(part.size):
            return False
    return True


def _fitted(u: Array, g: Array, start: _Law | None = None) -> _Law:
    """The law by least squares, with Hertz's exponent, or from ``start`` on with a free one."""
    free = start is not None
    if start is None:
        # F^(2/3) is a line; a tenth of the force is left out, where that of a toe weighs.
        above = g > 0.1 * g.max()
        slope, level = np.polyfit(u[above], np.cbrt(g[above] ** 2), 1) if above.sum() > 1 else (1.0, 0.0)
        slope = max(float(slope), 1e-3)
        start = _Law(slope**HERTZ, -float(level) / slope, HERTZ)

    def law(at: Array) -> _Law:
        return _Law(float(at[0]), float(at[1]), float(np.clip(at[2], *EXPONENTS)) if free else HERTZ)

    def slopes(at: Array) -> Array:
        k, origin, n = law(at).stiffness, law(at).origin, law(at).exponent
        over = np.maximum(u - origin, 1e-12)
        touching = u > origin
        columns = [over**n, -k * n * over ** (n - 1.0)] + ([k * over**n * np.log(over)] if free else [])
        return np.stack([np.where(touching, column, 0.0) for column in columns], axis=1)

    begin = [start.stiffness, start.origin] + ([start.exponent] if free else [])
    found = least_squares(lambda at: law(at).force(u) - g, begin, jac=slopes, method="lm")
    # White 1980: the errors of the points need not be alike.
    inverse = np.linalg.pinv(found.jac.T @ found.jac)
    weighted = found.jac * found.fun[:, None]
    scale = u.size / max(u.size - len(begin), 1)
    errors = np.sqrt(np.maximum(np.diag(inverse @ (weighted.T @ weighted) @ inverse), 0.0) * scale)
    best = law(found.x)
    return _Law(best.stiffness, best.origin, best.exponent, float(errors[0]), float(errors[2]) if free else math.nan)
