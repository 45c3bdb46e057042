"""Do LIGGGHTS and our solver pour the same pile? Equivalence of means over 18 pours each; an hour on two cores.

Fixed beforehand, from a pilot of 18 of our pours with other seeds (101 … 118):

- Quantities: the radius that holds half of the mass, and the height of the centre of mass. Margins: one standard
  deviation of a pour, 6.4 mm and 0.50 mm. The angle of repose is given with its interval and not judged.
- Test: two one-sided t tests at 5 % (Welch), that is, the 90 % interval of the difference inside the margins. With
  n = 2 (1.645 + 1.282)² = 17.1 → 18 per engine it succeeds 80 times in 100 if the true means are equal.
- Pours with the same feed, seeds 1 … 18. A pour that jams in either engine has no pile and is left out, counted.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from solver import Job, available_cores, run_pours
from tests.peers.piles import QUANTITIES, compared, of_ours, of_theirs, seed_pour

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("taichi")]

SEEDS = range(1, 19)
MARGINS = {"r50_m": 6.4e-3, "centre_height_m": 0.50e-3}
FEWEST = 15
"""Pours without a jam that are needed for the test to mean anything."""


@pytest.mark.peers("liggghts")
def test_liggghts_pours_the_same_pile(tmp_path):
    check("liggghts", tmp_path)


@pytest.mark.peers("yade")
def test_yade_pours_the_same_pile(tmp_path):
    check("yade", tmp_path)


def check(engine, folder):
    """Pour, read, print the table and judge."""
    scene = seed_pour()
    records = dict(run_pours([Job(scene, seed) for seed in SEEDS]))

    def theirs_of(record):
        place = folder / str(record.seed)
        place.mkdir()
        return of_theirs(record, engine, place)

    ordered = [records[k] for k in sorted(records)]
    ours = [of_ours(record) for record in ordered]
    with ThreadPoolExecutor(available_cores()) as pool:
        theirs = list(pool.map(theirs_of, ordered))
    pairs = [(one, other) for one, other in zip(ours, theirs, strict=True) if not (one.jammed or other.jammed)]
    jams = [sum(reading.jammed for reading in readings) for readings in (ours, theirs)]
    print(f"\n{engine}: {len(pairs)} pours each; jams {jams[0]} in ours, {jams[1]} in theirs")
    found = {}
    for column, name in enumerate(QUANTITIES):
        both = np.array([[one.values[column], other.values[column]] for one, other in pairs])
        one = found[name] = compared(*both[np.isfinite(both).all(axis=1)].T)
        print(
            f"{name}: ours {one.ours[0]:.4g} ± {one.ours[1]:.2g}, theirs {one.theirs[0]:.4g} ± {one.theirs[1]:.2g}, "
            f"difference {one.difference:.3g} [{one.low:.3g}, {one.high:.3g}], margin ± {MARGINS.get(name, np.nan):.2g}"
        )
    assert len(pairs) >= FEWEST
    assert all(found[name].within(margin) for name, margin in MARGINS.items())
