"""Moduli from force and displacement, and Poisson's ratio from the two moduli.

    compression   E = (F/A)/(ΔL/T₁)          Equation (1) of Processes 2022, 10, 185: flat faces of area A
                  E by Hertz and ASAE S368   a whole, curved body, whose radii the table has (``hertz.py``)
    shear         G = τ/γ = (F/A)/(ΔL/T₁)    Equation (2), T₁ the height over which the displacement is spread
    Poisson       ν = E/(2G) − 1             Equation (3), which holds for an isotropic solid

A replicate of one row is a single reading, one of many rows a curve: there F/ΔL is the slope of its straight part
(``linear_range.py``), so that a toe does not count, and by Hertz F/ΔL^1.5 is that before yield. The two moduli come
from different specimens, so that the standard error of ν is (1 + ν) √((s_E/E)² + (s_G/G)²), with the degrees of freedom
of Welch and Satterthwaite.
"""

from __future__ import annotations

import math

from scipy import stats

from doe.errors import StatisticsError
from doe.laboratory.caveats import NEEDS_RADIUS, caveats
from doe.laboratory.hertz import HERTZ, S368, CurvedBody, HertzRange, hertz_range
from doe.laboratory.linear_range import FEWEST_POINTS, LinearRange, linear_range
from doe.laboratory.result import CurveFit, Derived, Estimate, derived
from doe.laboratory.tables import LaboratoryError, Reading, Table, by_replicate

MODULI = {"compression": ("youngs_modulus", "E = (F/A)/(ΔL/T)"), "shear": ("shear_modulus", "G = (F/A)/(ΔL/T)")}
"""Name and formula of what a test measures."""
BY_HERTZ = "Hertz, F = 2√2π/3 · E/(1 − ν²) · δ^1.5/√(K³(1/R + 1/R'))"
BY_S368 = "ASAE S368, E = 0.338 F(1 − ν²)/D^1.5 · [Σ K(1/R + 1/R')^(1/3)]^1.5"
SPECIMEN = ("thickness", "area", "radius", "radius_2", "poisson_ratio", "contacts")
"""Columns that belong to the replicate, not to the point of its curve."""
ISOTROPIC = (0.0, 0.5)
"""ν outside of this is no isotropic solid's, but an error of E or G."""


def moduli(table: Table, test: str) -> tuple[tuple[Derived, ...], tuple[CurveFit, ...]]:
    """The modulus of every component, and the curves that it was taken from."""
    name, formula = MODULI[test]
    found, curves = [], []
    for of, rows in table.groups().items():
        samples = by_replicate(rows)
        own: list[CurveFit] = []
        values, by_standard = [], []
        for points in samples.values():
            _check(table, points, rows[0])
            body = _curved_body(points[0])
            fit: LinearRange | HertzRange | None
            if body:
                value, standard, fit = _curved(table, points, body)
                by_standard.append(standard)
            else:
                value, fit = _flat(table, points, test)
            values.append(value)
            if fit:
                x, f = _columns(points)
                own.append(CurveFit(name, of, points[0].replicate, x, f, fit, value))
        names, notes = list(samples), caveats(test, of[0], list(samples), own)
        parameter, used = f"materials.{of[0]}.{name}", BY_HERTZ if by_standard else formula
        found.append(derived(table, name, "Pa", of, used, names, values, parameter, notes))
        if by_standard:
            found.append(derived(table, f"{name}_asae_s368", "Pa", of, BY_S368, names, by_standard, "", notes))
        curves += own
    return tuple(found), tuple(curves)


def _check(table: Table, points: list[Reading], head: Reading) -> None:
    """A specimen is the same in all of its rows, and has an area or radii, as all of the component have (``head``)."""
    first = points[0]
    for row in points:
        for column in SPECIMEN:
            if row.values.get(column) != first.values.get(column):
                raise table.wrong(row, column, f"differs from row {first.line} of the same replicate")
    curved = "radius" in first.values
    if curved != ("radius" in head.values):
        raise table.wrong(first, "radius", f"allowed: a radius in every replicate of {first.of[0]}, or in none")
    for column in ("poisson_ratio", "contacts") if curved else ("thickness", "area"):
        if column not in first.values:
            raise table.wrong(
                first, column, "is missing; allowed: thickness and area of a body with flat faces, or radius, "
                "poisson_ratio and contacts of a curved one"
            )  # fmt: skip
    if curved and first.values["contacts"] not in (1.0, 2.0):
        raise table.wrong(first, "contacts", f"{first.values['contacts']:g}; allowed: 1, or 2 (between two plates)")
    if 1 < len(points) < FEWEST_POINTS:
        raise table.wrong(
            first,
            "replicate",
            f"{len(points)} rows; allowed: one reading, or a curve of at least {FEWEST_POINTS} points",
        )


def _curved_body(row: Reading) -> CurvedBody | None:
    """The body of a row that has a radius; one alone means a sphere's."""
    value = row.values
    if "radius" not in value:
        return None
    radius = value["radius"]
    return CurvedBody(radius, value.get("radius_2", radius), value["poisson_ratio"], int(value["contacts"]))


def _flat(table: Table, points: list[Reading], test: str) -> tuple[float, LinearRange | None]:
    """The modulus of flat faces, and the straight part of a curve."""
    value = points[0].values
    if len(points) == 1:
        _check_single(table, points[0])
        return value["force"] / value["area"] / (value["displacement"] / value["thickness"]), None
    try:
        fit = linear_range(*_columns(points))
    except StatisticsError as error:
        advice = f"; {NEEDS_RADIUS}" if test == "compression" and "Hertzian" in str(error) else ""
        raise _no_curve(table, points[0], f"{error}{advice}") from None
    return fit.slope * value["thickness"] / value["area"], fit


def _curved(table: Table, points: list[Reading], body: CurvedBody) -> tuple[float, float, HertzRange | None]:
    """E by Hertz, E by the standard at the last point before yield, and the part of a curve that counts."""
    if len(points) == 1:
        _check_single(table, points[0])
        stiffness = points[0].values["force"] / points[0].values["displacement"] ** HERTZ
        return body.modulus(stiffness), body.modulus(stiffness, S368), None
    try:
        fit = hertz_range(*_columns(points))
    except StatisticsError as error:
        raise _no_curve(table, points[0], str(error)) from None
    at_last = fit.last_force / (fit.last_displacement - fit.origin) ** HERTZ
    return body.modulus(fit.stiffness), body.modulus(at_last, S368), fit


def _check_single(table: Table, row: Reading) -> None:
    for column in ("displacement", "force"):
        if row.values[column] <= 0.0:
            raise table.wrong(
                row, column, "is not above zero; allowed in a single reading: force and displacement above zero"
            )


def _no_curve(table: Table, first: Reading, why: str) -> LaboratoryError:
    return table.wrong(first, "force", f"curve of replicate {first.replicate}: {why}")


def _columns(points: list[Reading]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Displacements and forces of a curve, in the order of the file."""
    return tuple(row.values["displacement"] for row in points), tuple(row.values["force"] for row in points)


def poisson_ratios(young: tuple[Derived, ...], shear: tuple[Derived, ...]) -> tuple[Estimate, ...]:
    """ν of every component that stands in both."""
    by_component = {one.of: one for one in young if one.name == "youngs_modulus"}
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
