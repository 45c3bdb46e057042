"""The charts of an analysed design, one at a time, as the page offers them."""

from __future__ import annotations

from functools import partial

from explorer.design.result import DesignResult
from explorer.report.design.charts import box_cox_profile, ridge, single_runs
from explorer.report.figures.style import stacked
from explorer.report.study_charts import Plot, Plots, optimum_plots, surface_plots


def design_plots(result: DesignResult) -> Plots:
    """Those of a study's surface, then single runs, Box–Cox profile and ridge; none where there is no model."""
    model, fitted = result.analysis.model, result.fitted
    if model is None or fitted is None:
        return {}
    plots = dict(surface_plots(fitted))
    if fitted.optimum is not None:
        plots |= optimum_plots(fitted, fitted.optimum)
    limits = "Dashed: limits beyond which a run stands out."
    plots["Single runs"] = Plot(partial(stacked, single_runs(model.diagnostics, result.labels)), limits, 2.0)
    if box_cox_profile(model.box_cox) is not None:
        caption = "Band: 95 % interval of the power."
        plots["Power of the response"] = Plot(partial(box_cox_profile, model.box_cox), caption)
    caption = "Highest and lowest response at a distance from the centre, 95 % bands; below: where the highest is."
    plots["Ridge"] = Plot(partial(stacked, ridge(result, model)), caption, 1.6)
    return plots
