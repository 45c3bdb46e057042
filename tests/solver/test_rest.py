"""What "at rest" is worth, and that sleeping changes no result. Slow: five minutes on one core.

Last run in full on 2026-11-21, before the last change of the damping law: with all bodies awake 48 small piles drifted
by at most 0.06 % in 2 s.
"""

import numpy as np
import pytest

from solver.material_file import load_material
from solver.observables import observe
from solver.pour import Pour
from solver.record import Outcome
from solver.run import Job, capacity_for, run_pours
from solver.scene import with_values
from solver.world import Batch
from tests.solver.test_pour import QUICK, apex_of

pytestmark = [pytest.mark.usefixtures("taichi"), pytest.mark.slow]

SMALL = with_values(QUICK, {"rig.mass": "20g"})
STANDARD = load_material("sunflower_extract")
LIMIT = 1e-3
"""Drift of the apex and of the angle in 2 s, as a fraction."""


@pytest.mark.parametrize(
    ("scene", "seed"),
    # Small piles 8, 13, 14, 18 and 23 drifted by 0.2 to 7 % while slow petioles could roll on and falling seeds were
    # taken for strays.
    [*((SMALL, seed) for seed in (1, 2, 3, 8, 9, 13, 14, 18, 23)), *((STANDARD, seed) for seed in (1, 2, 3))],
    ids=lambda value: value if isinstance(value, int) else f"{1e3 * value.rig.mass:.0f}g",
)
def test_a_pile_at_rest_stays_at_rest(scene, seed):
    """Sleeping off and all bodies woken, apex and angle drift by less than LIMIT in 2 s after the rest criterion."""
    pour = Pour(Batch(capacity_for([scene], 1)), 0, scene, seed)
    while n := pour.steps_due():
        pour.after(n, pour.batch.advance(np.array([n], dtype=np.int32))[0])
    assert pour.outcome == Outcome.AT_REST
    before, apex = pour.record(), apex_of(pour)
    pour.batch.set_sleep(0, 0.0, 1.0)
    assert pour.batch.bodies(0, pour.entered)[:, 15].sum() == 0
    pour.batch.advance(np.array([round(2.0 / pour.dt)], dtype=np.int32))
    after = pour.record()
    assert apex_of(pour) == pytest.approx(apex, rel=LIMIT)
    assert angle_of(after) == pytest.approx(angle_of(before), rel=LIMIT)
    assert len(after.pile.mass) == len(before.pile.mass)


def angle_of(record):
    return observe(record)["angle_of_repose_deg"].value


def test_sleeping_changes_no_result_beyond_noise():
    """24 pours with and without: how many come to rest, and the height of the centre of mass within its standard error.

    Measured over 48: 46 and 46 at rest, 4.805 ± 0.086 mm and 4.808 ± 0.087 mm.
    """
    heap, seeds = with_values(QUICK, {"rig.mass": "12g"}), range(24)
    outcomes, heights = {}, {}
    for awake in (False, True):
        scene = with_values(heap, {"numerics.sleep_speed": 0.0} if awake else {})
        records = [record for _, record in run_pours([Job(scene, seed) for seed in seeds], worlds=8)]
        outcomes[awake] = sum(record.outcome == Outcome.AT_REST for record in records)
        heights[awake] = np.array([height_of(r.pile) for r in records if r.outcome == Outcome.AT_REST])
    # One in 24 meets the time limit, with or without: a petiole that rolls inside the feed opening's radius just faster
    # than rest_speed. Two binomial standard errors of the difference are 3.
    assert min(outcomes.values()) >= 20
    assert abs(outcomes[False] - outcomes[True]) <= 3
    error = np.sqrt(sum(each.var(ddof=1) / len(each) for each in heights.values()))
    assert abs(heights[False].mean() - heights[True].mean()) < error
    assert error < 0.05 * heights[True].mean()  # else anything would pass


def height_of(pile):
    return float(pile.position[:, 2] @ pile.mass / pile.mass.sum())
