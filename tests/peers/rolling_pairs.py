"""Is it the data, or this solver? The fitted condition of trefoil_2 with its true rolling friction, by both engines.

``make rolling``: every pour of this solver is repeated by LIGGGHTS with the same bodies at the same places, and what
lies on the plate is read by the same code. Rows (SI) are in ``assets/validation/foreign/rolling_pairs.jsonl``; ten
pairs take about 9 min on one core.
"""

import json
import sys
from collections import deque
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from doe.measurement.load import load_measurement
from explorer.export.deck import deck_of
from explorer.export.liggghts import write_liggghts
from explorer.export.run import run_liggghts
from solver import Job, WorkerPool, observe_scan, scanned_pile, with_values
from solver.assets import measurement_folder
from tests.peers.foreign_sets import OUT, on_the_plate

TRUE_FRICTION, SEED = 0.2, 7000
READ = (
    "angle_of_repose_deg",
    "apex_height_m",
    "centre_height_m",
    "footprint_r50_m",
    "footprint_r90_m",
    "stray_fraction",
)


def pair(pool, scene, seed):
    """One pour by both engines: engine → readings."""
    ((_, record),) = pool.run_queue(deque([Job(scene, seed)]), [scene])
    spheres = record.pile.spheres
    deck = deck_of(record, scene.numerics.duration)
    with TemporaryDirectory() as folder:
        write_liggghts(Path(folder), deck)
        frame = run_liggghts(Path(folder)).final
    piles = {
        "ours": scanned_pile(scene, spheres.centre, spheres.radius, spheres.body),
        "liggghts": scanned_pile(scene, *on_the_plate(scene, deck, frame)),
    }
    return {name: dict(observe_scan(pile, scene, dict.fromkeys(READ))) for name, pile in piles.items()}


def main(number):
    """Pour and print ``number`` pairs, and their means with standard errors."""
    condition = load_measurement(measurement_folder("trefoil_2")).fit[0]
    scene = with_values(condition.scene, {"effect.rolling_resistance.rolling_friction": TRUE_FRICTION})
    rows = []
    with WorkerPool(1) as pool, (OUT / "rolling_pairs.jsonl").open("w") as file:
        for k in range(number):
            rows.append({"seed": SEED + k} | pair(pool, scene, SEED + k))
            file.write(json.dumps(rows[-1], default=float) + "\n")
            print(f"{k + 1} of {number}", flush=True)
    for name in READ:
        ours, theirs = (np.array([row[engine][name] for row in rows]) for engine in ("ours", "liggghts"))
        told = (f"{x.mean():.4g} ± {x.std(ddof=1) / len(x) ** 0.5:.2g}" for x in (ours, theirs, ours - theirs))
        print(f"{name}: ours, LIGGGHTS, ours − LIGGGHTS: {', '.join(told)}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
