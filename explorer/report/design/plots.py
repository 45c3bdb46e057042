"""The charts of an analysed design, one at a time, as the page offers them."""

from __future__ import annotations

from functools import partial

from explorer.report.design.charts import box_cox_profile, ridge, single_runs
from explorer.report.figures.style import stacked
from explorer.report.findings import Plain
from explorer.report.plot import Plot, Plots
from explorer.report.study_plots import study_plots


def design_plots(result: Plain) -> Plots:
    """Those of a study's surface, then single runs, Box–Cox profile and ridge; none where there is no model."""
    if result["surface"] is None:
        return {}
    plots = study_plots({key: result[key] for key in ("study", "surface", "optimum")})
    if result["model"] is None:
        return plots
    limits = "Dashed: limits beyond which a run stands out."
    plots["Single runs"] = Plot(partial(stacked, single_runs(result)), limits, 2.0)
    if box_cox_profile(result) is not None:
        plots["Power of the response"] = Plot(partial(box_cox_profile, result), "Band: 95 % interval of the power.")
    caption = "Highest and lowest response at a distance from the centre, 95 % bands; below: where the highest is."
    plots["Ridge"] = Plot(partial(stacked, ridge(result)), caption, 1.6)
    return plots
