"""What is read off a few kept raw pours: their outcomes, every observable of their rigs, and what a diagnosis reads.

``golden_readings.json`` holds the numbers with the version of the readings. ``python -m tests.doe.golden_readings``
(``make golden``) records what is new, and refuses numbers that changed under the same version. The raw pours in
``raw_pours`` are poured once and kept, whatever becomes of the physics.
"""

import json
import math
import sys
from pathlib import Path

from doe.declared.pours import reader
from doe.measurement.load import load_measurement
from doe.store import READINGS, observables_of, read_off
from solver import Scene, load_material, packed, run_pour, unpacked, with_values
from solver.assets import measurement_folder
from tests.solver.beans import two_layers
from tests.solver.golden.cases import FEW, TREFOIL, pours
from tests.solver.golden.golden_file import at_odds

FILE = Path(__file__).with_name("golden_readings.json")
RAW_POURS = Path(__file__).with_name("raw_pours")
TOLERANCE = 1e-9
"""Relative: sums in another order on another processor, and angles near a pixel's edge are not among them."""
DIAGNOSED = {"trefoils": "trefoil_1", "drum": "granudrum_mcc"}
"""Raw pour → data set for which a diagnosis reads it."""

Numbers = dict[str, float | str | None]
OUTCOME = "outcome"


def scenes() -> dict[str, Scene]:
    """What was poured, by the name of the raw pour."""
    poured = pours()
    mixture = with_values(load_material("sunflower_extract"), {"body.spheres": "coarse", "rig.mass": "12g"})
    return {
        "trefoils": with_values(TREFOIL, {"rig.mass": 8e-3, "insertion.rate": 0.1}),
        "mixture": mixture,
        "box": with_values(poured["pour, draw_down_box, fill_then_open"], {"rig.mass": 12e-3}),
        "layer": two_layers(),
        "drum": with_values(
            poured["pour, rotating_drum, fill_then_open"], FEW["rotating_drum"] | {"rig.averaging_turns": 0.1}
        ),
    }


def numbers() -> Numbers:
    """The outcome and every number of every raw pour, as "<raw pour>: <name>"."""
    found: Numbers = {}
    for name in sorted(path.stem for path in RAW_POURS.glob("*.npz")):
        raw = (RAW_POURS / f"{name}.npz").read_bytes()
        seen: Numbers = {OUTCOME: str(unpacked(raw).outcome), **read_off(raw, observables_of)}
        if name in DIAGNOSED:
            condition = load_measurement(measurement_folder(DIAGNOSED[name])).conditions[0]
            seen |= read_off(raw, reader(condition))
        found |= {f"{name}: {one}": value for one, value in seen.items()}
    return found


def differing(one: Numbers, other: Numbers) -> list[str]:
    """Names in both whose values differ."""
    return [name for name in one if name in other and not _equal(one[name], other[name])]


def _equal(one: float | str | None, other: float | str | None) -> bool:
    if not isinstance(one, float) or not isinstance(other, float):
        return one == other
    return math.isclose(one, other, rel_tol=TOLERANCE, abs_tol=1e-3 * TOLERANCE)


def main() -> int:
    """Record today's numbers; 1 where that is refused."""
    RAW_POURS.mkdir(exist_ok=True)
    for name, scene in scenes().items():
        path = RAW_POURS / f"{name}.npz"
        if not path.exists():
            path.write_bytes(packed(run_pour(scene, 3)))
            print(f"{path.name}: {path.stat().st_size} bytes, {unpacked(path.read_bytes()).outcome}")
    now = numbers()
    kept = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {"readings": READINGS, "numbers": {}}
    line = at_odds("READINGS", kept["readings"], READINGS, differing(kept["numbers"], now), "readings")
    if line is not None:
        print(line, file=sys.stderr)
        return 1
    FILE.write_text(json.dumps({"readings": READINGS, "numbers": now}, indent=1) + "\n", encoding="utf-8")
    print(f"{FILE.name}: readings {READINGS}, {len(now)} numbers")
    return 0


if __name__ == "__main__":
    sys.exit(main())
