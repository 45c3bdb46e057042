"""The version of the readings and what is read off stored pours belong together: neither changes without the other."""

import json

from doe.store import READINGS
from tests.doe.golden_readings import FILE, differing, numbers, scenes
from tests.solver.golden.golden_file import at_odds


def test_the_readings_of_today_are_those_of_this_version():
    kept, now = json.loads(FILE.read_text(encoding="utf-8")), numbers()
    assert at_odds("READINGS", kept["readings"], READINGS, differing(kept["numbers"], now), "readings") is None
    assert set(kept["numbers"]) == set(now), "record them: make golden"
    assert kept["readings"] == READINGS, "record them: make golden"


def test_every_kind_of_rig_and_a_mixture_is_read():
    kept = json.loads(FILE.read_text(encoding="utf-8"))["numbers"]
    assert {name.split(":")[0] for name in kept} == set(scenes())
    read = {name.split(": ")[1].split(".")[0].split("(")[0] for name, value in kept.items() if value is not None}
    assert {"angle_of_repose_deg", "segregation_index", "draw_down_angle_deg", "slope_deg"} <= read
    assert {"height_profile_m", "surface_profile_m", "flank_asymmetry_deg"} <= read


def test_a_changed_number_under_the_same_version_is_named():
    kept = json.loads(FILE.read_text(encoding="utf-8"))["numbers"]
    moved = kept | {"trefoils: apex_height_m": kept["trefoils: apex_height_m"] * (1.0 + 1e-8)}
    moved |= {"drum: slope_deg": None, "box: draw_down_angle_deg": 1.0}
    assert differing(kept, moved) == ["box: draw_down_angle_deg", "drum: slope_deg", "trefoils: apex_height_m"]
    assert "readings changed under the same READINGS = 1" in at_odds(
        "READINGS", 1, 1, differing(kept, moved), "readings"
    )
    assert "put it back" in at_odds("READINGS", 1, 2, differing(kept, kept), "readings")
