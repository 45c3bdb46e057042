"""The charts that a diagnosis' result has something for."""

from __future__ import annotations

from functools import partial

from doe.measurement.measurement import Role
from explorer.diagnosis.result import DiagnosisResult
from explorer.report.diagnosis.charts import error_chart, pile_chart, probability_chart, residual_chart
from explorer.report.plot import Plot, Plots

ROLES: dict[Role, str] = {"holdout": "held-out", "fit": "fitted"}


def diagnosis_plots(result: DiagnosisResult) -> Plots:
    """Title → plot: probabilities of the answers, residuals before and after, errors, piles."""
    caption = "Dashed: from here on an effect is named."
    plots: Plots = {"Probability of each answer": Plot(partial(probability_chart, result), caption, 0.8)}
    if result.residuals:
        caption = "Dashed: 95 % for one feature; solid: for all of them. The farthest off, where there are many."
        plots["Residuals before and after"] = Plot(partial(residual_chart, result), caption, 1.5)
    for role, words in ROLES.items():
        if any(row.noise_floor > 0.0 for row in result.error.of(role)):
            caption = "Errors over what noise alone would leave; dashed: no worse than noise."
            plots[f"Error on {words} data"] = Plot(partial(error_chart, result, role), caption, 1.0)
    for picture in sorted(result.piles, key=lambda row: row.role != "holdout"):
        words = ROLES[picture.role]
        caption = "Mean height from the pile's own middle, mirrored; a band is one standard deviation between pours."
        plots[f"Pile, {picture.condition} ({words})"] = Plot(partial(pile_chart, picture), caption, 0.6)
    return plots
