"""The law of propagation against closed forms, and what it adds to the scatter of replicates."""

import json
import math

import numpy as np
import pytest
from scipy import stats

from doe.laboratory import LabResult, analyse
from doe.laboratory.reading_error import propagated, reading_error
from doe.laboratory.replicates import summarise
from doe.laboratory.tables import LaboratoryError, Reading
from tests.doe.laboratory.readings import assert_one_line, written


def row(**values):
    return Reading(1, ("x",), "1", values)


def test_a_product_of_powers_has_the_relative_errors_in_quadrature():
    """y = a b²/c: (u/y)² = (u_a/a)² + (2 u_b/b)² + (u_c/c)², u = half/√3."""
    reading = row(a=2.0, a_error=0.004, b=3.0, b_error=0.009, c=5.0, c_error=0.005)
    u = propagated((reading,), lambda rows: rows[0].values["a"] * rows[0].values["b"] ** 2 / rows[0].values["c"])
    relative = math.sqrt(0.002**2 + (2 * 0.003) ** 2 + 0.001**2) / math.sqrt(3.0)
    # the third order of 1/c: 1e-6 of it
    assert u == pytest.approx(3.6 * relative, rel=1e-5)


def test_a_sum_over_rows_adds_the_errors_of_each_row():
    rows = [row(m=value, m_error=0.3) for value in (1.0, 2.0, 5.0, 7.0)]
    # four times 0.3²/3
    assert propagated(rows, lambda rows: sum(one.values["m"] for one in rows)) == pytest.approx(math.sqrt(4 * 0.03))


def test_no_declared_error_is_no_error_of_nought():
    assert math.isnan(propagated((row(a=1.0),), lambda rows: rows[0].values["a"]))
    assert propagated((row(a=1.0, a_error=0.0),), lambda rows: rows[0].values["a"]) == 0.0


def test_on_the_edge_of_a_formula_the_other_side_counts():
    """√h at h = 0: the one end that there is, √u."""
    u = propagated((row(h=0.0, h_error=0.03),), lambda rows: _root(rows[0].values["h"]))
    assert u == pytest.approx(math.sqrt(0.03 / math.sqrt(3.0)))


def _root(x):
    return math.sqrt(x) if x >= 0.0 else math.nan


def test_propagation_is_what_a_draw_of_the_readings_scatters_by(tmp_path):
    """e = √(h2/h1), 200000 draws: the deviation of the draws is known to 0.2 %, the interval here to 1 %."""
    path = written(
        tmp_path,
        "a,b,replicate,drop_height_mm,drop_height_error_mm,rebound_height_mm,rebound_height_error_mm\n"
        "s,w,1,300,2,120,3\n",
    )
    reading = analyse("rebound", path).derived[0].reading
    rng = np.random.default_rng(2)
    drawn = np.sqrt(rng.uniform(117, 123, 200_000) / rng.uniform(298, 302, 200_000))
    assert reading.values[0] == pytest.approx(drawn.std(), rel=0.01)
    # One replicate has no scatter: ± 1.96 u.
    assert reading.high - reading.low == pytest.approx(2 * stats.norm.ppf(0.975) * reading.standard)


@pytest.mark.parametrize(
    ("test", "head", "row"),
    [
        ("drop", "a,b,replicate,drop_height_mm,drop_height_error_mm,v_x_m_s,v_z_m_s", "s,w,1,1,5,0.05,0.02"),
        ("rebound", "a,b,replicate,drop_height_mm,drop_height_error_cm,rebound_height_mm", "s,w,1,10,1,5"),
    ],
)
def test_an_error_as_large_as_a_reading_above_nought_is_refused(test, head, row, tmp_path):
    path = written(tmp_path, f"{head}\n{row}\n")
    with pytest.raises(LaboratoryError) as caught:
        analyse(test, path)
    assert_one_line(caught.value, path, ["row 2", "column drop_height_error_", "keeps the reading within"])


def test_an_error_may_take_a_reading_to_nought_where_nought_is_allowed(tmp_path):
    text = "a,b,replicate,drop_height_mm,rebound_height_mm,rebound_height_error_mm\ns,w,1,300,1,2\n"
    assert analyse("rebound", written(tmp_path, text)).derived[0].reading.standard > 0.0


def test_errors_and_scatter_together_by_hand():
    """n = 4, s/√n = 0.3, u = 0.4: u_c = 0.5, ν = 3 (0.5/0.3)⁴ = 23.15."""
    values = [10.0 + 0.6 * x for x in (-1.0, 1.0, -1.0, 1.0)]
    scale = 0.3 / summarise(values).standard_error
    summary = summarise([10.0 + scale * (value - 10.0) for value in values])
    found = reading_error([0.4] * 4, summary)
    assert (found.standard, found.combined) == pytest.approx((0.4, 0.5))
    assert found.df == pytest.approx(3 * (5 / 3) ** 4)
    assert (found.low, found.high) == pytest.approx((10.0 - 1.0340, 10.0 + 1.0340), abs=1e-4)  # t = 2.0679
    assert reading_error([math.nan] * 4, summary) is None
    # Replicates whose sheet declares none are taken to be read as well as the others.
    assert reading_error([0.4, math.nan, 0.4, math.nan], summary).standard == pytest.approx(0.4)
    # The column beside a reading that the quantity does not hang on.
    assert reading_error([0.0] * 4, summary) is None


@pytest.mark.parametrize("test", ["moisture", "density", "dimensions", "drop", "inclined_plane"])
def test_a_test_without_declared_errors_is_as_it_was(test):
    from solver.assets import asset_path

    assert all(one.reading is None for one in analyse(test, asset_path("laboratory", test)).derived)


def test_errors_are_plain_data_and_back():
    from solver.assets import asset_path

    result = analyse("rebound", asset_path("laboratory", "rebound"))
    assert LabResult.from_dict(json.loads(json.dumps(result.to_dict()))) == result
