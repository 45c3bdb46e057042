"""A made-up calibration study whose every printed figure follows from its tables: nothing in it may be called wrong.

A second-order truth with noise, printed to two decimals; everything else is computed from those prints.
"""

import math

import numpy as np
from scipy import stats

from doe.analysis.level_set import nearest_points
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import fit_surface, term_names
from doe.analysis.surface_anova import analyse_surface
from doe.audit.printed import printed
from doe.audit.study import (
    AnovaLine,
    Ascent,
    Derived,
    DesignSteps,
    DropTest,
    Equation,
    Measured,
    Optimum,
    PublishedStudy,
    Quote,
    ScreenedFactor,
    Screening,
    SurfaceStudy,
    Target,
    Total,
    Verified,
)
from doe.designs import box_behnken, plackett_burman

NAMES = tuple(f"F{k}" for k in range(1, 9))
LOW = np.array([10.0, 0.2, 0.3, 1.0, 2.0, 3.0, 4.0, 5.0])
HIGH = np.array([50.0, 0.6, 0.9, 2.0, 4.0, 5.0, 8.0, 9.0])
SURFACE_LOW, SURFACE_HIGH = np.array([20.0, 0.32, 2.7]), np.array([40.0, 0.48, 3.3])
"""Steps 2 and 4 of the ascent, which lowers the third factor."""
CHOSEN = (0, 1, 4)
"""The factors that act."""


def show(value, decimals):
    """A number as printed to so many decimals."""
    return printed(f"{value:.{decimals}f}")


def shown(values, decimals):
    return tuple(show(float(value), decimals) for value in values)


def clean_study(seed=7):
    """The whole study; the seed draws the noise of its runs."""
    rng = np.random.default_rng(seed)
    surface, fitted = _surface(rng)
    measured = shown([29.7, 30.1, 30.4, 29.9, 30.0, 29.8], 1)
    values = np.array([one.value for one in measured])
    target = Target(
        "section 2", "angle of repose", "°", show(values.mean(), 2), show(values.std(ddof=1), 2), 6, measured
    )
    point = nearest_points(fitted.coefficients[None], target.mean.value, np.zeros(3), np.ones(3))[0][0]
    natural = fitted.region.natural(point)
    screening, restitutions = _screening(rng), shown([0.4, 0.55, 0.7], 2)
    return PublishedStudy(
        title="A made-up study",
        source="nowhere",
        target=target,
        derived=(_elastic(),),
        measured=(_density(),),
        totals=(Total("Table 2", "share [%]", shown([71.25, 18.5, 10.25], 2), printed("100.00")),),
        quotes=(_quote(restitutions),),
        drop_test=DropTest("Equation 4", "(vx + vy) / v", 45.0, 0.2, None, restitutions),
        screening=screening,
        ascent=_ascent(rng, target),
        surfaces=(surface,),
        optimum=Optimum("section 5", shown(natural, 5)),
        verified=_verified(target),
    )


def _screening(rng):
    design = plackett_burman(12).astype(float)
    effects = np.zeros(11)
    effects[list(CHOSEN)] = 6.0, 5.0, -4.0
    runs = shown(30 + design @ effects / 2 + rng.normal(0, 0.15, 12), 2)
    y = np.array([one.value for one in runs])
    sums = (design.T @ y) ** 2 / 12
    f = sums[:8] / sums[8:].mean()
    p = stats.f.sf(f, 1, 3)
    return Screening(
        where_runs="Table 4",
        where_anova="Table 5",
        factors=tuple(ScreenedFactor(*row) for row in zip(NAMES, LOW.tolist(), HIGH.tolist(), strict=True)),
        responses=runs,
        design=design[:, :8],
        error_df=3,
        sums=shown(sums[:8], 4),
        f=shown(f, 3),
        p=tuple(show(one, 5) if one >= 1e-4 else printed("<0.0001") for one in p),
        total=show(((y - y.mean()) ** 2).sum(), 2),
        significant=tuple(NAMES[k] for k in CHOSEN),
        level=0.01,
        level_of_others=0.01,
    )


def _truth(x, y, z):
    """The response over the coded cube of the surface."""
    return 30 + 2.0 * x + 1.5 * y - z + 0.6 * x * y - 0.8 * x**2 + 0.5 * z**2


def _ascent(rng, target):
    shares = np.linspace(-1.0, 1.5, 6)[:, None] * np.array([1.0, 0.8, -0.6])
    low, high = LOW[list(CHOSEN)], HIGH[list(CHOSEN)]
    settings = (low + high) / 2 + shares * (high - low) / 2
    coded = (2 * settings - SURFACE_LOW - SURFACE_HIGH) / (SURFACE_HIGH - SURFACE_LOW)
    responses = shown(_truth(*coded.T) + rng.normal(0, 0.1, 6), 2)
    errors = [100 * abs(one.value - target.mean.value) / target.mean.value for one in responses]
    return Ascent(
        where="Table 6",
        factors=tuple(NAMES[k] for k in CHOSEN),
        steps=tuple("123456"),
        settings=settings,
        responses=responses,
        errors=shown(errors, 2),
        best=str(1 + int(np.argmin(errors))),
    )


def _surface(rng):
    design = box_behnken(3).astype(float)
    truth = _truth(*design.T)
    runs = shown(truth + rng.normal(0, 0.3, len(truth)), 2)
    low, high = SURFACE_LOW, SURFACE_HIGH
    names = ("A", "B", "C")
    region = Region(names, (low + high) / 2, (high - low) / 2, ())
    fitted = fit_surface(design, np.array([[one.value] for one in runs]), region)
    anova = analyse_surface(fitted)
    lines = tuple(
        AnovaLine(
            row.source,
            show(row.sum_of_squares, 4),
            show(row.df, 0),
            show(row.mean_square, 4),
            None if math.isnan(row.f) else show(row.f, 2),
            None if math.isnan(row.p) else show(row.p, 4) if row.p >= 1e-4 else printed("<0.0001"),
        )
        for row in anova.rows
    )
    terms = ("1", *term_names(names)[1:])
    coefficients = dict(zip(terms, shown(fitted.coefficients_natural, 5), strict=True))
    study = SurfaceStudy(
        where_runs="Table 7",
        where_anova="Table 8",
        where_statistics="section 4",
        factors=names,
        screened=tuple(NAMES[k] for k in CHOSEN),
        low=low,
        high=high,
        coded=design,
        responses=runs,
        anova=lines,
        statistics={
            "r_squared": show(anova.r_squared, 4),
            "r_squared_adjusted": show(anova.r_squared_adjusted, 4),
            "r_squared_predicted": show(anova.r_squared_predicted, 4),
            "cv_percent": show(anova.cv_percent, 2),
            "adequate_precision": show(anova.adequate_precision, 2),
            "sigma": show(anova.sigma, 3),
        },
        equation=Equation("Equation 5", False, coefficients),
        steps=DesignSteps("2", "3", "4"),
    )
    return study, fitted


def _verified(target):
    runs = shown([30.2, 30.3, 30.35], 2)
    mean = sum(one.value for one in runs) / 3
    p = stats.ttest_ind_from_stats(
        mean, np.std([one.value for one in runs], ddof=1), 3, target.mean.value, target.sd.value, target.n
    ).pvalue
    error = 100 * abs(mean - target.mean.value) / target.mean.value
    return Verified("Table 9", runs, show(mean, 2), show(error, 3), show(p, 3))


def _quote(restitutions):
    said = ("Table 3", "restitution is 0.40", "e", restitutions, ("e of row 1",))
    return Quote("section 4", "restitution", printed("0.40"), restitutions[0], *said)


def _elastic():
    e, g = (147.6, 92.4), (56.3, 35.5)
    return Derived(
        where="Table 1",
        quantity="Poisson's ratio",
        formula="E / (2 * G) - 1",
        rows=("grain", "husk"),
        printed=shown([a / (2 * b) - 1 for a, b in zip(e, g, strict=True)], 2),
        inputs=tuple({"E": show(a, 1), "G": show(b, 1)} for a, b in zip(e, g, strict=True)),
    )


def _density():
    runs = ([1210.0, 1234.0, 1225.0], [345.0, 351.0, 348.0])
    return Measured(
        "Table 1",
        "density",
        "3 tests",
        ("grain", "husk"),
        shown([sum(one) / 3 for one in runs], 0),
        tuple(shown(one, 0) for one in runs),
    )
