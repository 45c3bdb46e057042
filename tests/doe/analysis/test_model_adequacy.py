"""Diagnostics against statsmodels' influence measures; a planted outlier; runs that decide their own fit."""

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from scipy import stats

from doe.analysis.model_adequacy import diagnose_fit
from doe.analysis.surface import fit_surface
from doe.analysis.surface_anova import analyse_surface
from doe.designs import box_behnken
from tests.doe.analysis.textbook import YIELD, YIELD_POINTS, YIELD_REGION, region


def diagnosed(points, values, where):
    surface = fit_surface(points, values, where)
    return diagnose_fit(surface, analyse_surface(surface))


def test_every_measure_agrees_with_statsmodels():
    found = diagnosed(YIELD_POINTS, YIELD, YIELD_REGION)
    data = pd.DataFrame(YIELD_POINTS, columns=["A", "B"]).assign(y=YIELD)
    influence = smf.ols("y ~ A + B + A:B + I(A**2) + I(B**2)", data).fit().get_influence()
    assert found.leverage == pytest.approx(influence.hat_matrix_diag, rel=1e-9)
    assert found.internal == pytest.approx(influence.resid_studentized_internal, rel=1e-9)
    assert found.external == pytest.approx(influence.resid_studentized_external, rel=1e-9)
    assert found.cooks_distance == pytest.approx(influence.cooks_distance[0], rel=1e-9)
    assert found.dffits == pytest.approx(influence.dffits[0], rel=1e-9)
    # At the limit p of the largest of all runs is 0.05, by t with one degree of freedom less than the error's.
    df = len(YIELD) - 6 - 1
    assert 2 * len(YIELD) * stats.t.sf(found.outlier_limit, df) == pytest.approx(0.05)
    assert found.shapiro_p == pytest.approx(stats.shapiro(found.internal).pvalue)


def test_a_run_far_from_the_others_has_leverage():
    """A line: h = 1/n + (x − x̄)²/Σ(x − x̄)²; of twelve runs 2p/n is 0.333, and half of all is not reached."""
    x = np.append(np.linspace(-0.4, 0.4, 11), 0.7)
    y = x + 0.1 * np.random.default_rng(2).standard_normal(12)
    surface = fit_surface(x[:, None], y, region("A"), ["A"])
    found = diagnose_fit(surface, analyse_surface(surface))
    h = 1 / 12 + (x - x.mean()) ** 2 / ((x - x.mean()) ** 2).sum()
    assert found.leverage == pytest.approx(h)
    assert 2 * 2 / 12 < h[11] < 3 * 2 / 12
    assert found.leverage_limit == pytest.approx(2 * 2 / 12)
    assert found.leveraged == (11,)


def test_a_wrong_run_is_found_and_only_that():
    design = box_behnken(3, 5).astype(float)
    values = 5 + design[:, 0] + 0.1 * np.random.default_rng(8).standard_normal(17)
    clean = diagnosed(design, values, region("ABC"))
    assert clean.outliers == ()
    values[14] += 4.0
    found = diagnosed(design, values, region("ABC"))
    assert found.outliers == (14,)
    assert abs(found.external[14]) > found.outlier_limit


def test_a_run_that_decides_its_own_fit_is_not_judged():
    """One centre run: it alone carries the squares' common level, its leverage is one."""
    design = box_behnken(3, 1).astype(float)
    values = np.random.default_rng(8).standard_normal(13) + 10
    found = diagnosed(design, values, region("ABC"))
    assert found.leverage[-1] == pytest.approx(1.0, abs=1e-9)
    assert np.isnan(found.external[-1])
    assert np.isnan(found.cooks_distance[-1])
    assert np.isfinite(found.external[:-1]).all()


def test_a_constant_response_has_no_residuals_to_judge():
    found = diagnosed(box_behnken(3, 5).astype(float), np.full(17, 3.0), region("ABC"))
    assert found.outliers == found.influential == ()
    assert np.isnan(found.internal).all()
    assert np.isnan(found.shapiro_p)
