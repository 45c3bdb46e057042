"""Grubbs's test and the generalised extreme studentised deviate against published worked examples."""

import numpy as np
import pytest

from doe.laboratory.replicates import critical_deviate, deviates, most_outliers, outliers, summarise

ROSNER = [
    -0.25, 0.68, 0.94, 1.15, 1.20, 1.26, 1.26, 1.34, 1.38, 1.43, 1.49, 1.49, 1.55, 1.56, 1.58, 1.65, 1.69, 1.70, 1.76,
    1.77, 1.81, 1.91, 1.94, 1.96, 1.99, 2.06, 2.09, 2.10, 2.14, 2.15, 2.23, 2.24, 2.26, 2.35, 2.37, 2.40, 2.47, 2.54,
    2.62, 2.64, 2.90, 2.92, 2.92, 2.93, 3.21, 3.26, 3.30, 3.59, 3.68, 4.30, 4.64, 5.34, 5.42, 6.01,
]  # fmt: skip
"""Rosner 1983, also in the NIST/SEMATECH handbook of statistical methods, 1.3.5.17.3: three outliers."""
URANIUM = [199.31, 199.53, 200.19, 200.82, 201.92, 201.95, 202.18, 245.57]
"""Tietjen and Moore 1972, also in the NIST handbook, 1.3.5.17.1: G = 2.4687, one outlier."""


def test_rosner_s_example():
    found = deviates(ROSNER, 10)
    # Printed with three digits behind the point, cut off.
    assert [deviate for _, deviate in found[:4]] == pytest.approx([3.118, 2.942, 3.179, 2.810], abs=1e-3)
    critical = [critical_deviate(54, removed) for removed in range(4)]
    assert critical == pytest.approx([3.158, 3.151, 3.143, 3.136], abs=1.1e-3)
    # The first two are below their critical values, the third is not: three outliers.
    assert [ROSNER[k] for k in outliers(ROSNER)] == [6.01, 5.42, 5.34]


def test_grubbs_s_test_on_the_uranium_data():
    ((index, deviate),) = deviates(URANIUM, 1)
    assert (index, deviate) == (7, pytest.approx(2.4687, abs=1e-4))
    # Two-sided 5 % point for eight values, in Grubbs's own table 2.126.
    assert critical_deviate(8, 0) == pytest.approx(2.126, abs=1e-3)
    assert outliers(URANIUM) == (7,)


@pytest.mark.parametrize("values", [[28.5, 28.5, 29.0], [7.0, 7.0, 7.0, 7.1], [1.0, 1.0, 1.0]])
def test_two_different_values_name_no_outlier(values):
    """Rounding makes the two equal; by Grubbs's limit the third is then an outlier at any distance."""
    found = summarise(values)
    assert found.outliers == ()
    assert np.isnan(found.shapiro_p)


def test_a_slip_of_the_pen_among_many_equal_readings_is_named():
    assert summarise([28.5] * 5 + [285.0]).outliers == (5,)


def test_all_of_several_outliers_are_named():
    """Each is beyond its own critical value: 3.17 > 2.71 of twenty, 3.92 > 2.68 of nineteen; 1.59 < 2.65 is not."""
    values = [*np.linspace(-1.0, 1.0, 18), 9.0, -8.0]
    over = [deviate > critical_deviate(20, removed) for removed, (_, deviate) in enumerate(deviates(values, 4))]
    assert over == [True, True, False, False]
    assert outliers(values) == (18, 19)


def test_how_many_may_be_named():
    assert [most_outliers(n) for n in (0, 2, 3, 10, 14, 15, 50)] == [0, 0, 1, 1, 1, 3, 10]


def test_a_clean_sample_is_accused_as_often_as_the_level_says():
    rng = np.random.default_rng(11)
    accused = np.mean([bool(outliers(rng.standard_normal(10))) for _ in range(2000)])
    # Binomial with p = 0.05: standard error 0.5 %; z = 4.
    assert accused == pytest.approx(0.05, abs=0.02)


@pytest.mark.parametrize("values", [[1.0, 1.0, 1.0, 1.0], [0.0] * 5, [1.0, 2.0], [1.0]])
def test_nothing_stands_out_where_nothing_spreads(values):
    assert outliers(values) == ()
