"""The lines of an analysis of variance recomputed from the runs, with their whole range over the rounding of these.

A line is a projection of the responses: its sum of squares is y'My with M = M² of rank df. For terms T it is what they
add to other terms, and which these are makes the type: all others of the model (partial, Type III), those that stand
before them in the table (sequential, Type I), or all that do not contain one of them (Type II). In an orthogonal design
they are the same. Partial sums of linear terms are other ones in natural units than in coded ones if the model has
products or squares, because these are then centred elsewhere.

Responses printed to ± h lie in a box around the print. Over this box, with d the unknown rest,
y'My + 2 d'My + d'Md stays within y'My − 2h Σ|My|ᵢ and y'My + 2h Σ|My|ᵢ + h²n, and √(y'My) within ± h√n. Both bounds
hold for certain; the tighter one is taken. F and p are bounded by those of the two mean squares in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite, nan, sqrt

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.surface import Surface, second_order_terms
from doe.analysis.surface_anova import SurfaceAnova, analyse_surface
from doe.audit.anova_table import Column, Line, Role
from doe.audit.printed import Interval

FloatArray = npt.NDArray[np.float64]

KINDS = {
    "partial": "partial sums of squares (Type III)",
    "sequential": "sequential sums of squares (Type I), in the order of the table",
    "marginal": "sums of squares adjusted for all terms that do not contain the term (Type II)",
    "natural": "partial sums of squares in natural units",
}
"""How the sums of squares of terms may have been taken, the usual one first."""


@dataclass(frozen=True)
class Bounded:
    """A recomputed number and the interval in which it stays whatever the responses were before rounding."""

    value: float
    interval: Interval

    @property
    def slack(self) -> float:
        """How far it can move."""
        return max(self.value - self.interval[0], self.interval[1] - self.value)


class TableRefit:
    """A model fitted to the printed runs; ``half``: half a unit of the last digit of the responses."""

    def __init__(self, surface: Surface, half: float) -> None:
        self.surface, self._half = surface, half
        self._y = surface.observed - surface.observed.mean()
        self._names = tuple(np.array(surface.terms)[surface.included])
        self._coded = second_order_terms(surface.points)[:, surface.included]

    @cached_property
    def anova(self) -> SurfaceAnova:
        """Statistics of the fit; what a run that nothing can replace leaves undefined is NaN or infinite."""
        return analyse_surface(self.surface)

    def rows(self, lines: Sequence[Line], order: Sequence[str], kind: str, error: Role) -> list[dict[Column, Bounded]]:
        """Every line that the model has, its figures tested against ``error``; order: of the terms in the table."""
        errors = {role: self._mean_square(role) for role in ("residual", "pure_error")}
        found = []
        for line in lines:
            tested = {"lack_of_fit": errors["pure_error"], "residual": None, "pure_error": None, "total": None}
            found.append(self._row(line, order, kind, tested.get(line.role, errors[error])))
        return found

    def statistics(self) -> dict[str, Bounded]:
        """R² and what else is printed of a fit, by the key of a study file."""
        anova, surface, n = self.anova, self.surface, self._y.size
        sse, sst = (self._sum(role) for role in ("residual", "total"))
        df = surface.df_residual
        mean = abs(anova.mean)
        press = Bounded(anova.press, (anova.press, anova.press))
        if isfinite(anova.press):
            # |D(I − H)y|² with D = 1/(1 − h): the same bound, with the largest D² on the rest.
            leave = 1 / (1 - surface.leverage)
            part = self._rest(leave**2 * self._rest(self._y))
            press = _square(anova.press, part, self._half, n * float(leave.max()) ** 2)
        sigma = Bounded(anova.sigma, (sqrt(sse.interval[0] / df), sqrt(sse.interval[1] / df)))
        reach = 2 * self._half * sqrt(n * float(surface.leverage.max()))
        spread = float(np.ptp(surface.predicted))
        noise = sqrt((surface.included.sum()) / n)
        cv = (100 * sigma.interval[0] / (mean + self._half), 100 * _over(sigma.interval[1], mean - self._half))
        ratio = (
            _over(max(0.0, spread - reach), sigma.interval[1] * noise),
            _over(spread + reach, sigma.interval[0] * noise),
        )
        return {
            "r_squared": _share(anova.r_squared, sse, sst, 1.0),
            "r_squared_adjusted": _share(anova.r_squared_adjusted, sse, sst, (n - 1) / df),
            "r_squared_predicted": _share(anova.r_squared_predicted, press, sst, 1.0),
            "cv_percent": Bounded(anova.cv_percent, cv),
            "adequate_precision": Bounded(anova.adequate_precision, ratio),
            "sigma": sigma,
        }

    def degrees(self, role: Role) -> int:
        """Degrees of freedom of a line that is no term."""
        n, points = int(self._y.size), int(self.surface.point_of_run.max()) + 1
        p = len(self._names)
        known = {"model": p - 1, "residual": n - p, "lack_of_fit": points - p, "pure_error": n - points, "total": n - 1}
        return known.get(role, 0)

    def _row(
        self, line: Line, order: Sequence[str], kind: str, error: tuple[Bounded, int] | None
    ) -> dict[Column, Bounded]:
        if line.role in ("term", "group"):
            df, sum_ = len(line.terms), self._of_terms(line.terms, order, kind)
        else:
            df = self.degrees(line.role)
            if df == 0:
                return {}
            sum_ = self._sum(line.role)
        row: dict[Column, Bounded] = {"df": Bounded(float(df), (df, df)), "sum_of_squares": sum_}
        row["sequential"] = self._of_terms(line.terms, order, "sequential") if line.terms else sum_
        row["mean_square"] = mean = Bounded(sum_.value / df, (sum_.interval[0] / df, sum_.interval[1] / df))
        if error is not None:
            below, df_error = error
            value = mean.value / below.value if below.value > 0 else nan
            low, high = _over(mean.interval[0], below.interval[1]), _over(mean.interval[1], below.interval[0])
            row["f"] = Bounded(value, (low, high))
            tail, most, least = (float(stats.f.sf(f, df, df_error)) for f in (value, low, high))
            row["p"] = Bounded(tail, (least, most))
        return row

    def _mean_square(self, role: Role) -> tuple[Bounded, int] | None:
        df = self.degrees(role)
        if df == 0:
            return None
        sum_ = self._sum(role)
        return Bounded(sum_.value / df, (sum_.interval[0] / df, sum_.interval[1] / df)), df

    def _sum(self, role: Role) -> Bounded:
        """Sum of squares of a line that is no term."""
        surface, y = self.surface, self._y
        within = (
            y - (np.bincount(surface.point_of_run, weights=y) / np.bincount(surface.point_of_run))[surface.point_of_run]
        )
        within[np.abs(within) <= 8 * np.finfo(np.float64).eps * np.abs(surface.observed)] = 0.0
        rest = self._rest(y)
        part = {"total": y, "residual": rest, "pure_error": within, "lack_of_fit": rest - within}.get(role, y - rest)
        return _square(float(part @ part), part, self._half, part.size)

    def _of_terms(self, terms: Sequence[str], order: Sequence[str], kind: str) -> Bounded:
        """Sum of squares of terms beside the others that the kind names."""
        if kind == "sequential":
            others = list(order[: min(order.index(term) for term in terms)])
        elif kind == "marginal":
            others = [name for name in order if name not in terms and not any(_contains(name, term) for term in terms)]
        else:
            others = [name for name in order if name not in terms]
        model = self._coded
        if kind == "natural":
            model = second_order_terms(self.surface.region.natural(self.surface.points))[:, self.surface.included]
        before = _basis(self._columns(model, ["intercept", *others]))
        added = self._columns(model, terms)
        for _ in range(2):  # twice: what is left of a column close to the others is then orthogonal to them
            added = added - before @ (before.T @ added)
        basis = _basis(added)
        part = basis @ (basis.T @ self._y)
        return _square(float(part @ part), part, self._half, self._y.size)

    def _columns(self, model: FloatArray, names: Sequence[str]) -> FloatArray:
        columns = model[:, [self._names.index(name) for name in names]]
        return np.asarray(columns / np.linalg.norm(columns, axis=0))

    def _rest(self, y: FloatArray) -> FloatArray:
        """(I − H) y."""
        return np.asarray(y - self._hat @ (self._hat.T @ y))

    @cached_property
    def _hat(self) -> FloatArray:
        return _basis(self._columns(self._coded, self._names))


def _basis(columns: FloatArray) -> FloatArray:
    """Orthonormal columns that span the same space."""
    return np.asarray(np.linalg.qr(columns)[0])


def _contains(larger: str, term: str) -> bool:
    """Whether a product or square contains a factor."""
    return larger != term and (larger == f"{term}^2" or term in larger.split("*"))


def _square(value: float, part: FloatArray, half: float, room: float) -> Bounded:
    """|Ay|² over the box; part: A'Ay, room: n times the largest eigenvalue of A'A."""
    move, root, reach = 2 * half * float(np.abs(part).sum()), sqrt(value), half * sqrt(room)
    low = max(0.0, value - move, max(0.0, root - reach) ** 2)
    return Bounded(value, (low, min(value + move + half**2 * room, (root + reach) ** 2)))


def _share(value: float, part: Bounded, whole: Bounded, factor: float) -> Bounded:
    """1 − factor part/whole."""
    (least, most), (small, large) = part.interval, whole.interval
    return Bounded(value, (1 - factor * _over(most, small), 1 - factor * _over(least, large)))


def _over(above: float, below: float) -> float:
    return above / below if below > 0 else inf
