"""A published calibration study as plain data: what its tables and its text print, part by part.

Every part may be missing; a check is made where its part is there. `where` names the place in the
publication ("Table 7"). Printed numbers keep their digits (`Printed`); levels of a design, which were set and not
measured, are exact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.audit.printed import Printed

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Target:
    """The measured mean that the study calibrates against; sd, n and the single values as far as they are printed."""

    where: str
    quantity: str
    unit: str
    mean: Printed
    sd: Printed | None = None
    n: int | None = None
    replicates: tuple[Printed, ...] | None = None


@dataclass(frozen=True)
class Derived:
    """A column that follows from other columns by a stated formula; one entry per row."""

    where: str
    quantity: str
    formula: str
    rows: tuple[str, ...]
    printed: tuple[Printed, ...]
    inputs: tuple[Mapping[str, Printed], ...]


@dataclass(frozen=True)
class Measured:
    """A column of means of `made_from` ("10 tests"); replicates per row where they are printed, else None."""

    where: str
    quantity: str
    made_from: str
    rows: tuple[str, ...]
    printed: tuple[Printed, ...]
    replicates: tuple[tuple[Printed, ...], ...] | None = None


@dataclass(frozen=True)
class Total:
    """Parts that are said to add up: shares to 100 %, sums of squares to their total."""

    where: str
    quantity: str
    parts: tuple[Printed, ...]
    total: Printed


@dataclass(frozen=True)
class Quote:
    """A value of a table said again elsewhere.

    original: the value in the table, None where the text does not say which one it means. kind: the column of the table
    that the text names all the same, "" where it names none. among: all values in that column. elsewhere: what else the
    table prints with this number, in words.
    """

    where: str
    quantity: str
    value: Printed
    original: Printed | None
    original_where: str
    text: str = ""
    kind: str = ""
    among: tuple[Printed, ...] = ()
    elsewhere: tuple[str, ...] = ()


@dataclass(frozen=True)
class DropTest:
    """A restitution test: a body falls freely on an inclined plate and lands beside it.

    formula: restitution from what was measured (see `doe.audit.restitution_formula`). fall: height above the plate [m];
    landing: height of the plate above the floor [m], equal to fall if None.
    """

    where: str
    formula: str
    plate_angle_deg: float
    fall: float
    landing: float | None
    restitutions: tuple[Printed, ...]


@dataclass(frozen=True)
class ScreenedFactor:
    """A factor of the screening with its range, in its own unit."""

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class Screening:
    """A two-level screening: runs, and the analysis of variance as printed.

    design: coded levels, shape (runs, factors), None if not printed. error_df: degrees of freedom of the error that
    F is tested against (dummy columns). sums, f, p: per factor; f and p are empty if not printed. total: printed total
    sum of squares. significant: names claimed to be so at `level`, None without a claim; of all others p is said to be
    above `level_of_others`.
    """

    where_runs: str
    where_anova: str
    factors: tuple[ScreenedFactor, ...]
    responses: tuple[Printed, ...]
    design: FloatArray | None
    error_df: int
    sums: tuple[Printed, ...]
    f: tuple[Printed, ...]
    p: tuple[Printed, ...]
    total: Printed | None
    significant: tuple[str, ...] | None
    level: float
    level_of_others: float


@dataclass(frozen=True)
class Ascent:
    """A walk through the ranges; settings in natural units, shape (steps, factors).

    factors: names as in the screening. errors: printed relative errors [%], empty if not printed. best: label of the
    step said to be nearest to the target.
    """

    where: str
    factors: tuple[str, ...]
    steps: tuple[str, ...]
    settings: FloatArray
    responses: tuple[Printed, ...]
    errors: tuple[Printed, ...]
    best: str | None


@dataclass(frozen=True)
class AnovaLine:
    """One line of a printed analysis of variance, as far as it is printed.

    sequential: the sequential sum of squares, where it is printed beside another one.
    """

    source: str
    sum_of_squares: Printed | None = None
    df: Printed | None = None
    mean_square: Printed | None = None
    f: Printed | None = None
    p: Printed | None = None
    sequential: Printed | None = None


@dataclass(frozen=True)
class Equation:
    """The fitted polynomial as printed: term ("1", "X1", "X1*X2", "X1^2") → coefficient, in natural or coded units."""

    where: str
    coded: bool
    coefficients: Mapping[str, Printed]


@dataclass(frozen=True)
class DesignSteps:
    """The steps of the ascent that a design's levels −1, 0 and +1 are said to be."""

    low: str
    centre: str
    high: str


@dataclass(frozen=True)
class SurfaceStudy:
    """A second-order design with its runs, coded, shape (runs, factors), and what was printed about its fit.

    low, high: natural values of −1 and +1, shape (factors,). screened: names of the factors in the screening and the
    ascent, which may number them otherwise. statistics: "r_squared", "r_squared_adjusted",
    "r_squared_predicted", "cv_percent", "adequate_precision", "sigma" → as printed. steps: None where nothing is said
    of steps of the ascent. Without printed runs, coded and responses are empty.
    """

    where_runs: str
    where_anova: str
    where_statistics: str
    factors: tuple[str, ...]
    screened: tuple[str, ...]
    low: FloatArray
    high: FloatArray
    coded: FloatArray
    responses: tuple[Printed, ...]
    anova: tuple[AnovaLine, ...]
    statistics: Mapping[str, Printed]
    equation: Equation | None
    steps: DesignSteps | None = None


@dataclass(frozen=True)
class Optimum:
    """The setting claimed to give the target, in natural units and the order of the surface's factors.

    surface: position of the surface that it was read from.
    """

    where: str
    values: tuple[Printed, ...]
    predicted: Printed | None = None
    surface: int = 0


@dataclass(frozen=True)
class Verified:
    """Fresh runs at the claimed optimum and what was printed about them."""

    where: str
    responses: tuple[Printed, ...]
    mean: Printed | None
    relative_error_percent: Printed | None
    p_two_sample: Printed | None


@dataclass(frozen=True)
class PublishedStudy:
    """A study as far as it was published."""

    title: str
    source: str
    target: Target | None = None
    derived: tuple[Derived, ...] = ()
    measured: tuple[Measured, ...] = ()
    totals: tuple[Total, ...] = ()
    quotes: tuple[Quote, ...] = ()
    drop_test: DropTest | None = None
    screening: Screening | None = None
    ascent: Ascent | None = None
    surfaces: tuple[SurfaceStudy, ...] = ()
    optimum: Optimum | None = None
    verified: Verified | None = None

    @property
    def surface(self) -> SurfaceStudy | None:
        """The surface of the response that was walked, optimised and verified: the only one, or the optimum's."""
        if self.optimum is not None:
            return self.surfaces[self.optimum.surface]
        return self.surfaces[0] if len(self.surfaces) == 1 else None
