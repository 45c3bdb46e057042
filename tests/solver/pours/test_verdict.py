"""How a pour at rest is judged, by what stays in its rig and what lies across the outlet."""

import pytest

from solver.pours.record import Outcome
from solver.pours.verdict import RUNNING, Moment, verdict
from solver.rigs import RIGS
from solver.rigs.outlet import Obstruction
from solver.scenes.numerics import Numerics

SOUND = {"finite": 1.0, "overflow": 0.0, "lost": 0.0, "overlap": 0.0}
ALONE, HOLDING = Obstruction("petiole", 0.4e-3, 0.0), Obstruction("petiole", 0.4e-3, 4.2e-3)
WEDGED = Obstruction("petiole", 0.4e-3, 0.0, 0.04)


def judged(rig, hanging, in_rig, discharged=0.02, across=None, blocked=False, stalled=True, waiting=0):
    """Outcome and message of a quiet pour of 30 g."""
    moment = Moment(
        time=2.0,
        row={**SOUND, "hanging": hanging, "in_funnel": in_rig, "discharged": discharged},
        acting=1.0,
        acted=True,
        missing=0,
        blocked=blocked,
        quiet=True,
        stalled=stalled,
        speed=0.0,
        room=100,
        poured_mass=0.03,
        across=across,
        waiting=waiting,
    )
    return verdict(RIGS[rig](), Numerics(), moment)


@pytest.mark.parametrize("rig", ["funnel", "lifting_cylinder"])
@pytest.mark.parametrize(
    ("hanging", "in_rig", "across", "told"),
    [
        (0, 0.0, None, (Outcome.AT_REST, "")),
        (1, 0.3e-3, None, (Outcome.AT_REST, "0.3 g, 1 % of the charge, hang in the {}")),
        (
            1,
            0.4e-3,
            ALONE,
            (Outcome.AT_REST, "one petiole (0.4 g) lies across the outlet of the {}, with nothing above it"),
        ),
        (
            1,
            0.4e-3,
            WEDGED,
            (Outcome.AT_REST, "one petiole (0.4 g) is wedged in the {} 40 mm above the outlet, with nothing above it"),
        ),
        (20, 6e-3, None, (Outcome.JAMMED, "20 bodies (6 g, 20 % of the charge) stay in the {}")),
        (
            12,
            4.6e-3,
            HOLDING,
            (
                Outcome.OBSTRUCTED,
                "one petiole (0.4 g) lies across the outlet of the {} and holds up 4.2 g, 14 % of the charge",
            ),
        ),
        # Two petioles one beside the other: neither is above the other, and only one may hang.
        (
            2,
            0.8e-3,
            ALONE,
            (Outcome.OBSTRUCTED, "one petiole (0.4 g) lies across the outlet of the {}, with nothing above it"),
        ),
    ],
)
def test_what_stays_in_a_rig_that_is_to_be_empty_has_a_name_and_a_mass(rig, hanging, in_rig, across, told):
    outcome, message = told
    assert judged(rig, hanging, in_rig, across=across) == (outcome, message.format(rig.replace("_", " ")))


def test_what_stays_in_a_box_is_its_result_unless_nothing_passes_or_a_body_lies_across_the_slot():
    assert judged("draw_down_box", 40, 0.01) == (Outcome.AT_REST, "")
    jammed = (Outcome.JAMMED, "nothing passes the outlet: 30 g, 100 % of the charge, stay")
    assert judged("draw_down_box", 90, 0.03, discharged=0.0) == jammed
    assert judged("draw_down_box", 40, 0.01, across=ALONE) == (Outcome.AT_REST, "")
    assert judged("draw_down_box", 40, 0.01, across=HOLDING)[0] == Outcome.OBSTRUCTED
    # Some have come out, then the others formed an arch.
    arch = (Outcome.JAMMED, "25 bodies stay over the outlet of the draw down box")
    assert judged("draw_down_box", 90, 0.029, discharged=0.001, waiting=25) == arch
    assert judged("draw_down_box", 40, 0.01, waiting=1) == (Outcome.AT_REST, "")


def test_a_rig_that_still_lets_something_out_is_not_judged():
    assert judged("funnel", 12, 4.6e-3, across=HOLDING, stalled=False) == RUNNING
