"""A low lip keeps the lowest layer of a heap of round grains, which roll away from a bare plate."""

import numpy as np
import pytest

from solver.params import ParameterError
from solver.pours.run import Job, run_pours
from solver.rigs.lipped_plate import LippedPlate
from solver.scenes.material_file import load_material, with_settings

pytestmark = pytest.mark.usefixtures("taichi")

BEADS = with_settings(
    load_material("glass_beads"),
    {
        "rig.mass": "8g",
        "rig.diameter": "30mm",
        "rig.cylinder_height": "40mm",
        "rig.lip_diameter": "46mm",
        "rig.lip_height": "4mm",
        "rig.lift_speed": 0.2,
        "insertion.region_radius": "10mm",
        "insertion.rate": "200g/s",
        "numerics.max_time": 1.4,
    },
)


@pytest.mark.slow
def test_a_lip_keeps_what_rolls_away_from_a_bare_plate():
    """Beads of 3 mm: over a lip of 4 mm a few jump, over one of 0.1 mm most roll."""
    bare = with_settings(BEADS, {"rig.lip_height": "0.1mm"})
    assert isinstance(BEADS.rig, LippedPlate)
    beyond = {}
    for index, record in run_pours([Job(BEADS, 1), Job(bare, 1)], threads=2):
        distance = np.hypot(*record.bodies.position[:, :2].T)
        beyond["bare" if index else "lipped"] = np.mean(distance > 0.5 * BEADS.rig.lip_diameter)
    assert beyond["lipped"] < 0.05
    assert beyond["bare"] > 0.3


def test_a_lip_beyond_the_domain_is_refused():
    """Bodies would be taken out before they come to it."""
    with pytest.raises(ParameterError, match=r"^rig\.lip_diameter: 0\.2 m reaches rig\.domain_half_width"):
        with_settings(BEADS, {"rig.lip_diameter": 0.2, "rig.domain_half_width": 0.1})
