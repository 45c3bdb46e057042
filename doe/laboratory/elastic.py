"""Moduli from force and displacement, and Poisson's ratio from the two moduli.

    compression   E = (F/A)/(ΔL/T₁)          Equation (1) of Processes 2022, 10, 185
    shear         G = τ/γ = (F/A)/(ΔL/T₁)    Equation (2), T₁ the height over which the displacement is spread
    Poisson       ν = E/(2G) − 1             Equation (3), which holds for an isotropic solid

A replicate of one row is a single reading, one of many rows a curve: there F/ΔL is the slope of its straight part
(``linear_range.py``), so that a toe does not count. The two moduli come from different specimens, so that the standard
error of ν is (1 + ν) √((s_E/E)² + (s_G/G)²), with the degrees of freedom of Welch and Satterthwaite.
"""

from __future__ import annotations

import math

from scipy import stats

from doe.errors import StatisticsError
from doe.laboratory.linear_range import FEWEST_POINTS, linear_range
from doe.laboratory.result import CurveFit, Derived, Estimate, derived
from doe.laboratory.tables import Reading, Table

MODULI = {"compression": ("youngs_modulus", "E = (F/A)/(ΔL/T)"), "shear": ("shear_modulus", "G = (F/A)/(ΔL/T)")}
"""Name and formula of what a test measures."""
ISOTROPIC = (0.0, 0.5)
"""ν outside of this is no isotropic solid's, but an error of E or G."""
HERTZIAN = (
    "the curves follow F ∝ δ^1.5, a Hertzian contact: the formula gives no constant of the material, but a number that "
    "falls with the depth of pressing (--bias)"
)


def moduli(table: Table, test: str) -> tuple[tuple[Derived, ...], tuple[CurveFit, ...]]:
    """The modulus of every component, and the curves that it was taken from."""
    name, formula = MODULI[test]
    found, curves = [], []
    for of, rows in table.groups().items():
        by_replicate: dict[str, list[Reading]] = {}
        for row in rows:
            by_replicate.setdefault(row.replicate, []).append(row)
        own: list[CurveFit] = []
        values = []
        for replicate in by_replicate.values():
            if len(replicate) == 1:
                values.append(_reading(table, replicate[0]))
            else:
                own.append(_curve(table, replicate, name))
                values.append(own[-1].modulus)
        notes = (HERTZIAN,) if own and sum(curve.fit.hertzian for curve in own) > len(own) / 2 else ()
        found.append(
            derived(table, name, "Pa", of, formula, list(by_replicate), values, f"materials.{of[0]}.{name}", notes)
        )
        curves += own
    return tuple(found), tuple(curves)


def _reading(table: Table, row: Reading) -> float:
    value = row.values
    if value["displacement"] <= 0.0 or value["force"] <= 0.0:
        column = "displacement" if value["displacement"] <= 0.0 else "force"
        raise table.wrong(row, column, "not above zero; a single reading needs a force and a displacement")
    return value["force"] / value["area"] / (value["displacement"] / value["thickness"])


def _curve(table: Table, rows: list[Reading], quantity: str) -> CurveFit:
    first = rows[0]
    for row in rows:
        for column in ("thickness", "area"):
            if row.values[column] != first.values[column]:
                raise table.wrong(row, column, f"differs from row {first.line} of the same replicate")
    if len(rows) < FEWEST_POINTS:
        raise table.wrong(
            first, "replicate", f"{len(rows)} rows; allowed: one reading, or a curve of at least {FEWEST_POINTS} points"
        )
    displacement, force = (tuple(row.values[column] for row in rows) for column in ("displacement", "force"))
    try:
        fit = linear_range(displacement, force)
    except StatisticsError as error:
        raise table.wrong(first, "force", f"curve of replicate {first.replicate}: {error}") from None
    modulus = fit.slope * first.values["thickness"] / first.values["area"]
    return CurveFit(quantity, first.of, first.replicate, displacement, force, fit, modulus)


def poisson_ratios(young: tuple[Derived, ...], shear: tuple[Derived, ...]) -> tuple[Estimate, ...]:
    """ν of every component that stands in both."""
    by_component = {one.of: one for one in young}
    return tuple(_poisson_ratio(by_component[one.of], one) for one in shear if one.of in by_component)


def poisson_ratio(youngs_modulus: float, shear_modulus: float) -> float:
    """ν = E/(2G) − 1."""
    return youngs_modulus / (2.0 * shear_modulus) - 1.0


def _poisson_ratio(young: Derived, shear: Derived) -> Estimate:
    e, g = young.summary, shear.summary
    ratio = poisson_ratio(e.mean, g.mean)
    parts = [((1.0 + ratio) * one.standard_error / one.mean) ** 2 for one in (e, g)]
    error = math.sqrt(sum(parts))
    df = math.nan
    if error > 0.0:
        df = sum(parts) ** 2 / sum(part**2 / (one.n - 1) for part, one in zip(parts, (e, g), strict=True))
    half = float(stats.t.ppf(0.975, df)) * error if df > 0.0 else error
    notes = []
    if not ISOTROPIC[0] <= ratio < ISOTROPIC[1]:
        notes.append(f"ν = {ratio:.3g} is outside 0 … 0.5: no isotropic solid has it, so E or G is off")
    elif ratio - half < ISOTROPIC[0] or ratio + half > ISOTROPIC[1]:
        notes.append("the interval leaves 0 … 0.5: E and G do not fix ν")
    return Estimate(
        name="poisson_ratio",
        unit="1",
        of=shear.of,
        formula="ν = E/(2G) − 1",
        files=(young.file, shear.file),
        value=ratio,
        standard_error=error,
        df=df,
        low=ratio - half,
        high=ratio + half,
        parameter=f"materials.{shear.of[0]}.poisson_ratio",
        notes=tuple(notes),
    )
