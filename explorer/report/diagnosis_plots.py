"""The charts that a diagnosis' result has something for."""

from __future__ import annotations

from functools import partial

from explorer.report.diagnosis.charts import cosine_chart, error_chart, pile_chart, residual_chart, signature_chart
from explorer.report.diagnosis.residuals import bands
from explorer.report.findings import Plain
from explorer.report.plot import Plot, Plots

ROLES = (("holdout", "held-out"), ("fit", "fitted"))


def diagnosis_plots(result: Plain) -> Plots:
    """Title → plot: errors, residuals before and after, patterns of the effects, piles."""
    plots: Plots = {}
    if result["residuals"]:
        one, every = bands(len(result["residuals"]))
        caption = "Dashed: 95 % for one number; solid: for all of them."
        plots["Residuals before and after"] = Plot(partial(residual_chart, result, one, every), caption, 1.5)
    for role, words in ROLES:
        if any(row["noise_floor"] for row in result["error"][role]):
            caption = "Errors over what noise alone would leave; dashed: no worse than noise."
            plots[f"Error on {words} data"] = Plot(partial(error_chart, result, role), caption, 1.0)
    if result["signatures"]["names"]:
        caption = "Columns of length one: the residual, then what each effect would have done to the numbers."
        plots["Signatures of the effects"] = Plot(partial(signature_chart, result), caption, 1.4)
        caption = (
            "Near ± 1 with the residual: the right pattern. Near ± 1 between two: these data cannot tell them apart."
        )
        plots["Cosines of the signatures"] = Plot(partial(cosine_chart, result), caption, 1.0)
    for picture in sorted(result["piles"], key=lambda row: row["role"] != "holdout"):
        words = dict(ROLES).get(picture["role"], picture["role"])
        caption = "Mean height from the pile's own middle, mirrored; a band is one standard deviation between pours."
        plots[f"Pile, {picture['condition']} ({words})"] = Plot(partial(pile_chart, picture), caption, 0.6)
    return plots
