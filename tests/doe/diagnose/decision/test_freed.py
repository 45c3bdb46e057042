"""Where the data alone would put a parameter, against the exact solution of the linear Gaussian world.

There every parameter moves the summaries by 20 standard errors per half range, along directions at right angles.
"""

from dataclasses import replace

import numpy as np
import pytest

from doe.diagnose.decision.freed import freed_parameters
from doe.diagnose.fitting.calibrate import fit_with_covariance, gather_evidence
from doe.diagnose.runs import Observed, Parameter
from tests.doe.diagnose.toy import REPLICATES, SIGMA, known_emulator, make_toy

D = 8


def freed(shift, parameters=None):
    """Rows for data without noise, whose mean lies ``shift`` (D,) off the middle of the model."""
    toy = make_toy(D, 0)
    emulator = known_emulator(toy, np.random.default_rng(0), 100_000)
    declared = replace(toy.declared, parameters=parameters or toy.declared.parameters)
    emulator = replace(emulator, declared=declared)
    data = Observed((np.tile(shift(toy), (REPLICATES, 1)),), (np.zeros(D),))
    evidence = gather_evidence(emulator, data)
    base = fit_with_covariance(emulator.predictor(()), (), evidence, [SIGMA**2 * np.eye(D)])
    return base, freed_parameters(declared, base, evidence)


def test_a_parameter_beyond_its_range_is_found_where_it_is():
    base, rows = freed(lambda toy: toy.jacobian[:, 1] * 1.5)
    assert base.t2 == pytest.approx(100)  # (20 × 0.5)²: held at its end
    assert rows[1].value == pytest.approx(1.5)
    assert rows[1].standard_error == pytest.approx(1 / 20)
    assert rows[1].t2 == pytest.approx(0.0, abs=1e-6)
    assert rows[1].outside
    assert np.isnan(rows[1].sds)


def test_freeing_another_parameter_does_not_help():
    base, rows = freed(lambda toy: toy.jacobian[:, 1] * 1.5)
    for k in (0, 2):
        assert rows[k].value == pytest.approx(0.0, abs=1e-6)
        assert rows[k].t2 == pytest.approx(base.t2)
        assert not rows[k].outside


def test_the_distance_is_counted_in_the_measurement_s_own_deviations():
    """Measured 0.4 ± 0.05 (20 SE per unit: as sharp as the data), the data say 0.2: freed it goes there, 4 sd away."""
    toy = make_toy(D, 0)
    parameters = (Parameter("p0", -1.0, 1.0, mean=0.4, sd=0.05), *toy.declared.parameters[1:])
    base, rows = freed(lambda toy: toy.jacobian[:, 0] * 0.2, parameters)
    assert base.x[0] == pytest.approx(0.3, abs=1e-6)
    assert rows[0].value == pytest.approx(0.2)
    assert rows[0].sds == pytest.approx(-4.0)
    assert rows[0].t2 == pytest.approx(0.0, abs=1e-6)


def test_a_parameter_that_the_data_do_not_see_gets_no_value():
    toy = make_toy(D, 0)
    toy.jacobian[:, 2] = 0.0
    emulator = known_emulator(toy, np.random.default_rng(0), 100_000)
    data = Observed((np.tile(toy.jacobian[:, 0] * 0.2, (REPLICATES, 1)),), (np.zeros(D),))
    evidence = gather_evidence(emulator, data)
    base = fit_with_covariance(emulator.predictor(()), (), evidence, [SIGMA**2 * np.eye(D)])
    rows = freed_parameters(toy.declared, base, evidence)
    assert np.isnan(rows[2].value)
    assert rows[0].value == pytest.approx(0.2)
