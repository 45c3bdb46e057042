"""What "at rest" is worth. Slow: half a minute. Last run 2026-11-21: both passed."""

import numpy as np
import pytest

from solver.pour import Pour
from solver.run import capacity_for
from solver.scene import with_values
from solver.world import Batch
from tests.solver.test_pour import QUICK, apex_of

pytestmark = [pytest.mark.usefixtures("taichi"), pytest.mark.slow]


@pytest.mark.parametrize("seed", [12, 13])
def test_a_pile_at_rest_stays_at_rest(seed):
    scene = with_values(QUICK, {"rig.mass": "20g"})
    pour = Pour(Batch(capacity_for([scene], 1)), 0, scene, seed)
    while n := pour.steps_due():
        pour.after(n, pour.batch.advance(np.array([n], dtype=np.int32))[0])
    pile = pour.record().pile
    apex = apex_of(pour)
    further = int(1.0 / pour.dt)
    pour.batch.advance(np.array([further], dtype=np.int32))
    later = pour.record().pile
    assert apex_of(pour) == pytest.approx(apex, rel=1e-3)
    # Bodies of the pile may settle by a fraction of a millimetre; strays that roll are not among them.
    assert len(later.mass) == len(pile.mass)
    assert np.median(np.linalg.norm(later.position - pile.position, axis=1)) < 1e-4
