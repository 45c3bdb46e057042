"""Analysis of variance of a second-order surface, with the fit statistics that published calibrations report.

Sums of squares are partial (Type III): SS_j = b_j^2/[(X'X)^-1]_jj. Lack of fit compares the residual between
distinct points with the replicates within them (pure error). PRESS = sum (e_i/(1 - h_i))^2 leaves out one run
at a time; where a point has replicates this is optimistic, so `r_squared_predicted_by_row` leaves out a
design row with all its replicates. Source: Myers, Montgomery and Anderson-Cook 2016, ch. 2 and 6; Allen 1974,
Technometrics 16:125 (PRESS).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.surface import Surface, least_squares
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
FULL = 1 - 1e-9
"""A leverage above this counts as one: the run is fitted exactly and cannot be tested."""
CONSTANT = "The response is the same in every run; there is nothing to fit."


@dataclass(frozen=True)
class AnovaRow(Record):
    """One source of variation; f and p are NaN if it is not tested."""

    source: str
    sum_of_squares: float
    df: int
    mean_square: float
    f: float
    p: float


@dataclass(frozen=True)
class SurfaceAnova(Record):
    """ANOVA table and fit statistics of a surface.

    rows: block if there are any, model (without blocks), every term, residual, lack of fit, pure error, total. R^2
    includes the variation explained by blocks. sigma = sqrt(MSE), unit of the response. studentized_residuals:
    external, shape (runs,). better_than_noise: model p < 0.05 and predicted R^2 > 0; by p alone if a run is
    indispensable to the fit, because predicted R^2 is then undefined (NaN).
    """

    rows: tuple[AnovaRow, ...]
    mean: float
    sigma: float
    cv_percent: float
    r_squared: float
    r_squared_adjusted: float
    r_squared_predicted: float
    r_squared_predicted_by_row: float
    press: float
    adequate_precision: float
    coefficient_standard_errors: FloatArray
    studentized_residuals: FloatArray
    better_than_noise: bool
    notes: tuple[str, ...]

    def row(self, source: str) -> AnovaRow:
        """Return the row named `source`; KeyError if there is none."""
        for row in self.rows:
            if row.source == source:
                return row
        raise KeyError(source)


def analyse_surface(surface: Surface) -> SurfaceAnova:
    """Return the ANOVA and fit statistics of a fitted surface.

    A response without variation gives NaN for every ratio, and a note.
    """
    model = surface.model_matrix
    found = least_squares(model, surface.observed)
    residuals = surface.observed - surface.predicted
    n, p = model.shape
    mean = float(surface.observed.mean())
    residual_ss = float(found.ssr)
    total_ss = total_sum_of_squares(surface.observed)
    block_rows = block_row(surface.observed, surface.block_of_run, total_ss) if surface.block_names else ()
    explained_ss = max(0.0, total_ss - residual_ss)
    model_ss = max(0.0, explained_ss - sum(row.sum_of_squares for row in block_rows))
    mse = surface.mse if total_ss > 0 else 0.0
    chosen = np.flatnonzero(surface.included)[1:]
    model_row = tested("model", model_ss, len(chosen), mse, surface.df_residual)
    of_terms = slice(1, 1 + len(chosen))
    term_ss = found.params[of_terms] ** 2 / np.diag(found.normalized_cov_params)[of_terms]
    term_rows = [
        tested(surface.terms[k], float(ss) if total_ss > 0 else 0.0, 1, mse, surface.df_residual)
        for k, ss in zip(chosen, term_ss, strict=True)
    ]
    influence = found.get_influence()
    # A run that is indispensable to the fit cannot be predicted from the others.
    indispensable = bool((surface.leverage > FULL).any())
    press = math.inf if indispensable else float((influence.resid_press**2).sum())
    predicted_r2 = math.nan if indispensable else ratio(total_ss - press, total_ss)
    rows = (
        *block_rows,
        model_row,
        *term_rows,
        AnovaRow("residual", residual_ss, surface.df_residual, mse, math.nan, math.nan),
        *lack_of_fit(surface.observed, surface.point_of_run, residual_ss, surface.df_residual),
        AnovaRow("total", total_ss, n - 1, total_ss / (n - 1), math.nan, math.nan),
    )
    better = bool(model_row.p < 0.05 and (indispensable or predicted_r2 > 0))
    return SurfaceAnova(
        rows=rows,
        mean=mean,
        sigma=math.sqrt(mse),
        cv_percent=ratio(100 * math.sqrt(mse), abs(mean)),
        r_squared=ratio(explained_ss, total_ss),
        r_squared_adjusted=1 - ratio(mse * (n - 1), total_ss),
        r_squared_predicted=predicted_r2,
        r_squared_predicted_by_row=1 - ratio(_press_by_row(surface, residuals), total_ss),
        press=press,
        adequate_precision=ratio(float(np.ptp(surface.predicted)), math.sqrt(p * mse / n)),
        coefficient_standard_errors=np.sqrt(mse * np.diag(surface.information_inverse)),
        studentized_residuals=externally_studentized(influence, mse, surface.df_residual),
        better_than_noise=better,
        notes=_notes(rows, total_ss, predicted_r2, better, bool(surface.included.all())),
    )


def total_sum_of_squares(observed: FloatArray) -> float:
    """Return the sum of squares about the mean, exactly zero if values differ only by rounding."""
    dust = 8 * np.finfo(np.float64).eps * float(np.abs(observed).max())
    return 0.0 if np.ptp(observed) <= dust else float(((observed - observed.mean()) ** 2).sum())


def ratio(numerator: float, denominator: float) -> float:
    """Return a ratio; NaN for a denominator that is not positive."""
    return numerator / denominator if denominator > 0 else math.nan


def tested(source: str, sum_of_squares: float, df: int, error_ms: float, error_df: int) -> AnovaRow:
    """Return a row tested by F against an error mean square; NaN when that error is zero."""
    f = ratio(sum_of_squares / df, error_ms)
    return AnovaRow(source, sum_of_squares, df, sum_of_squares / df, f, float(stats.f.sf(f, df, error_df)))


def block_row(observed: FloatArray, block: npt.NDArray[np.int64], total_ss: float) -> tuple[AnovaRow, ...]:
    """Return the row "block", the variation between block means before all terms; it is not tested, because blocks were
    not drawn at random (Box, Hunter and Hunter 2005, ch. 4).
    """
    counts = np.bincount(block)
    means = np.bincount(block, weights=observed) / counts
    between = float(counts @ (means - observed.mean()) ** 2) if total_ss > 0 else 0.0
    df = counts.size - 1
    return (AnovaRow("block", between, df, between / df, math.nan, math.nan),)


def lack_of_fit(
    observed: FloatArray, point_of_run: npt.NDArray[np.int64], residual_ss: float, df_residual: int
) -> tuple[AnovaRow, ...]:
    """Return the rows "lack_of_fit" and "pure_error" as far as they have degrees of freedom.

    Computed here rather than by a library, so that rounding in exact replicates does not become an error.
    """
    counts = np.bincount(point_of_run)
    means = np.bincount(point_of_run, weights=observed) / counts
    within = observed - means[point_of_run]
    within[np.abs(within) <= 8 * np.finfo(np.float64).eps * np.abs(observed)] = 0.0
    pure_ss, pure_df = float(within @ within), int(observed.size - counts.size)
    lack_ss, lack_df = max(0.0, residual_ss - pure_ss), int(df_residual - pure_df)
    rows = []
    if lack_df > 0 and pure_df > 0:
        rows.append(tested("lack_of_fit", lack_ss, lack_df, pure_ss / pure_df, pure_df))
    if pure_df > 0:
        rows.append(AnovaRow("pure_error", pure_ss, pure_df, pure_ss / pure_df, math.nan, math.nan))
    return tuple(rows)


def _press_by_row(surface: Surface, residuals: FloatArray) -> float:
    """Return the sum of squared errors when each row of the design is predicted from all others.

    With H the hat matrix of the runs of a row, their left-out residuals are (I - H)^-1 e. NaN when a row is
    indispensable to the fit.
    """
    model = surface.model_matrix
    inverse = np.linalg.inv(model.T @ model)
    total = 0.0
    for row in np.unique(surface.row_of_run):
        runs = surface.row_of_run == row
        kept = np.eye(int(runs.sum())) - model[runs] @ inverse @ model[runs].T
        if np.linalg.matrix_rank(kept, tol=1e-9) < kept.shape[0]:
            return math.nan
        left_out = np.linalg.solve(kept, residuals[runs])
        total += float(left_out @ left_out)
    return total


def externally_studentized(influence: Any, mse: float, df: int) -> FloatArray:
    """Return r_i sqrt((df - 1)/(df - r_i^2)), the residuals studentised by an error estimated without run i.

    The same as statsmodels' `resid_studentized_external`, which refits the model for every run. NaN where undefined.
    """
    if mse == 0 or df < 2:
        return np.full(influence.nobs, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        internal = influence.resid_studentized_internal
        return np.asarray(internal * np.sqrt((df - 1) / (df - internal**2)))


def _notes(
    rows: tuple[AnovaRow, ...], total_ss: float, predicted_r2: float, better_than_noise: bool, is_quadratic: bool
) -> tuple[str, ...]:
    """Return what a reader of the table must know, as sentences."""
    by_source = {row.source: row for row in rows}
    notes = []
    if total_ss == 0:
        return (CONSTANT,)
    if not better_than_noise:
        predicted = "" if math.isnan(predicted_r2) else f", predicted R² = {predicted_r2:.3g}"
        notes.append(
            f"The surface is not better than noise (model p = {by_source['model'].p:.3g}{predicted}); nothing may be "
            "read from its shape."
        )
    if "pure_error" not in by_source:
        notes.append("No point has two valid runs; lack of fit cannot be tested.")
    elif by_source["pure_error"].sum_of_squares == 0:
        notes.append("All replicates agree exactly (was the seed varied?); lack of fit cannot be tested.")
    elif "lack_of_fit" in by_source and by_source["lack_of_fit"].p < 0.05:
        form = "quadratic" if is_quadratic else "of the form of this model"
        notes.append(
            f"Lack of fit is significant (p = {by_source['lack_of_fit'].p:.3g}); the true surface is not {form}."
        )
    return tuple(notes)
