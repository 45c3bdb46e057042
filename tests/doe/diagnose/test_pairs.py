"""The evidence of two effects at once, where data fix one of them far more closely than amplitudes are first tried."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp

from doe.analysis.cells import CELL
from doe.diagnose import posterior
from doe.diagnose.posterior import SECOND, Data
from tests.doe.diagnose.test_posterior import emulator
from tests.doe.validation.test_limit_ruler import unit


def over_every_node(taught, data, first, second, least=SECOND):
    """Log evidence of a pair by all amplitudes of both that shift the data by ``least`` or more."""
    weigher = posterior._Weigher(taught, data)
    one, other = (posterior._nodes_of(taught, name) for name in (first, second))
    i, j = (np.flatnonzero(weigher.lengths(nodes.rows - weigher.base.rows) >= least) for nodes in (one, other))
    rows = (one.rows[i][:, None] + other.rows[j][None] - weigher.base.rows).reshape(-1, one.rows.shape[1])
    unknown = np.zeros((1, taught.parameters)), np.eye(taught.parameters)
    return float(logsumexp(weigher.log_t(*weigher.at(rows), *unknown))) - math.log(len(rows))


def test_a_strong_effect_s_amplitude_is_summed_finely_enough_beside_a_weak_one():
    """Of 20 deviations of a pour: means of six tell its amplitude to 2 per cent; a first cell is 1.55 times wide."""
    shifts = {"strong": 20.0 * unit(0), "weak": 4.0 * unit(3), "turn": 4.0 * unit(5)}
    taught = emulator(shifts, variance=25.0, pours=400)
    off, chances = [], []
    for amplitude in np.geomspace(0.8, 1.24, 8):
        data = Data(amplitude * shifts["strong"] + 0.8 * shifts["weak"], 6)
        found = posterior.posterior(taught, data, temperature=1.0)
        wanted = over_every_node(taught, data, "strong", "weak")
        assert found.fits["strong+weak"].log_evidence == pytest.approx(wanted, abs=0.3)
        chances.append(found.effects["strong+weak"])
        coarse = posterior._pairs(
            posterior._Weigher(taught, data),
            {name: posterior._nodes_of(taught, name) for name in ("strong", "weak")},
            SECOND,
            math.inf,
        )
        off.append(coarse["strong+weak"].log_evidence - wanted)
    assert min(chances) > 0.95
    # What the middles of the first cells alone would make of it.
    assert min(off) < -10.0


def test_a_curved_response_is_summed_by_how_fast_it_changes():
    """2 a + 10 (a² − a) shifts by 2 at the reference amplitude, but changes six times as fast there as 2 a does."""
    taught = emulator({"curved": 2.0 * unit(0), "weak": 4.0 * unit(3)}, variance=25.0, pours=4000)
    mean = taught.mean.copy()
    mean[:, 4] = 10.0 * unit(0)
    bent, off = replace(taught, mean=mean), []
    for amplitude in np.geomspace(1.0, 1.5, 10):
        data = Data((2.0 * amplitude + 10.0 * (amplitude**2 - amplitude)) * unit(0) + 3.2 * unit(3), 6)
        found = posterior.fitted(bent, data, "curved+weak").log_evidence
        off.append(found - over_every_node(bent, data, "curved", "weak", least=0.0))
    # 0.76 if the change is taken from the shift.
    assert np.abs(off).max() < 0.1


def test_amplitudes_come_in_whole_cells():
    for top in (0.1, 0.12, 0.3, 1.6, 16.0):
        found = posterior.multiples(top)
        assert len(found) % CELL == 0
        assert found[-1] == pytest.approx(top)
        assert found[0] == pytest.approx(min(posterior.LEAST, top))
