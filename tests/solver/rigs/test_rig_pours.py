"""Whole runs in the rigs other than the funnel, few bodies each: phases, masses, motion of the surfaces, repeatable
bits."""

import dataclasses

import numpy as np
import pytest

from solver.engine.world import Batch
from solver.observables import observables_in, observe
from solver.pours.pour import Pour
from solver.pours.record import Outcome, Phase
from solver.pours.run import Job, capacity_for, run_pours
from solver.scenes.material_file import load_material, with_settings
from solver.scenes.scene import with_values
from tests.explorer.beads import bead_scene

pytestmark = pytest.mark.usefixtures("taichi")

SUNFLOWER = load_material("sunflower_extract")
SEEDS = with_values(
    dataclasses.replace(SUNFLOWER, bodies=(dataclasses.replace(SUNFLOWER.bodies[0], mass_fraction=1.0),)),
    {"body.spheres": "coarse"},
)
"""Flat bodies: they come to rest quickly."""
CYLINDER = with_settings(
    SEEDS,
    {
        "rig.name": "lifting_cylinder",
        "rig.mass": "6g",
        "rig.lift_speed": 0.1,
        "rig.lift_height": "60mm",
        "insertion.rate": "100g/s",
    },
)
BOX = with_settings(
    SEEDS,
    {
        "rig.name": "draw_down_box",
        "rig.width": "160mm",
        "rig.depth": "40mm",
        "rig.box_height": "80mm",
        "rig.shelf_height": "60mm",
        "rig.slot_width": "50mm",
        "rig.mass": "14g",
    },
)
DRUM = with_settings(
    bead_scene(),
    {
        "rig.name": "rotating_drum",
        "rig.diameter": "120mm",
        "rig.axial_length": "30mm",
        "rig.filled_volume": "70mL",
        "rig.speed_rpm": 60,
        "rig.transient_turns": 0.5,
        "rig.averaging_turns": 0.5,
        "pair.bead.bead.static_friction": 0.6,
        "pair.bead.steel.static_friction": 0.6,
    },
)


DENSE = with_settings(DRUM, {"rig.filled_volume": "150mL", "rig.packing": 1.0})
"""More than fits in."""
LOW = with_settings(BOX, {"rig.box_height": "10mm", "rig.mass": "40g"})


@dataclasses.dataclass
class Run:
    """A pour in the second of two worlds, and the phases it went through."""

    pour: Pour
    phases: list

    def on(self, chunk=None, until=lambda pour: False):
        """Go on in launches of at most ``chunk`` steps until ``until`` holds or the pour is over."""
        while (n := self.pour.steps_due(chunk)) and not until(self.pour):
            self.pour.after(n, self.pour.batch.advance(np.array([0, n], dtype=np.int32))[1])
            if self.pour.phase not in self.phases:
                self.phases.append(self.pour.phase)
        return self


def run(scene, seed=1):
    # One capacity for all, so that kernels are compiled once.
    room = capacity_for([CYLINDER, BOX, DRUM, DENSE, LOW], 2)
    return Run(Pour(Batch(room), 1, scene, seed), [])


@pytest.fixture(scope="module")
def lifted():
    from solver import backend

    backend.init(threads=2)
    done = run(CYLINDER, 3).on()
    return done.pour.record(), done.phases


def test_a_lifted_cylinder_leaves_a_pile_and_loses_no_mass(lifted):
    record, phases = lifted
    assert record.outcome == Outcome.AT_REST
    assert phases == [Phase.FILL, Phase.DISCHARGE, Phase.PILE, Phase.AT_REST]
    assert record.trace.entered_mass[-1] == pytest.approx(record.poured_mass)
    assert record.trace.discharged_mass[-1] == pytest.approx(record.poured_mass)
    assert record.pile.mass.sum() == pytest.approx(record.poured_mass)  # flat seeds do not roll away
    lowest = (record.pile.spheres.centre[:, 2] - record.pile.spheres.radius).min()
    assert -1e-4 < lowest < 1e-4
    before = record.trace.time < record.gate_opened
    assert before.any()
    assert record.trace.discharged_mass[before].max() == 0.0
    seen = observe(record)
    assert set(observables_in(CYLINDER.rig)) <= set(seen)
    # All of it lay within the cylinder's radius; it spreads when the wall goes.
    assert seen["footprint_r90_m"].value > 0.02
    assert 5.0 < seen["angle_of_repose_cone_deg"].value < 60.0


def test_a_moving_rig_repeats_its_bits_whatever_the_launches(lifted):
    again = run(CYLINDER, 3).on(chunk=37).pour.record()
    record = lifted[0]
    assert again.steps == record.steps
    assert np.array_equal(again.bodies.position, record.bodies.position)
    assert np.array_equal(again.trace.discharged_mass, record.trace.discharged_mass)


def test_the_cylinder_rises_at_its_speed_and_stops():
    lifting = run(CYLINDER, 3).on(until=lambda pour: not pour.gate_shut and pour.time - pour.gate_opened > 0.3)
    pour = lifting.pour
    interval = CYLINDER.numerics.sample_interval
    since = pour.time - pour.gate_opened
    height = pour.surface_poses()[1, 2]
    # It is set in motion at a moment of decision, exactly then.
    assert height == pytest.approx(0.1 * since, abs=1e-9)
    assert pour.container.height == pytest.approx(height, abs=1e-9)
    lifting.on(until=lambda pour: pour.time - pour.gate_opened > 0.8)
    # It stops at the first moment of decision after 0.6 s.
    assert 0.06 - 1e-9 <= pour.surface_poses()[1, 2] <= 0.06 + 0.1 * 2 * interval


def test_a_rig_that_cannot_take_all_bodies_is_a_jam():
    over = run(LOW).on().pour
    assert over.outcome == Outcome.JAMMED
    assert "the rig overflows" in over.message
    full = run(DENSE).on().pour
    assert full.outcome == Outcome.JAMMED
    assert "bodies find no place" in full.message


def test_what_stays_in_a_draw_down_box_and_what_falls_add_up():
    done = run(BOX).on()
    record = done.pour.record()
    assert record.outcome == Outcome.AT_REST
    assert done.phases == [Phase.FILL, Phase.DISCHARGE, Phase.AT_REST]
    seen = observe(record)
    stays = seen["residual_mass_kg"].value
    falls = record.trace.discharged_mass[-1]
    assert stays > 0.0
    assert falls > 0.0
    assert stays + falls == pytest.approx(record.poured_mass)
    upper = record.bodies.position[:, 2] > BOX.rig.floor
    assert record.bodies.mass[upper & record.bodies.inside].sum() == pytest.approx(stays)
    # Nothing went through a wall: y within the depth, and x within the width while above the shelf.
    assert np.abs(record.bodies.position[:, 1]).max() < BOX.rig.depth / 2
    assert np.abs(record.bodies.position[upper, 0]).max() < BOX.rig.width / 2
    assert set(seen) == set(observables_in(BOX.rig))


def test_seeds_across_a_slot_that_is_narrower_than_they_are_long_obstruct_it():
    record = run(with_settings(BOX, {"rig.slot_width": "12mm", "rig.mass": "8g"})).on().pour
    assert record.outcome == Outcome.OBSTRUCTED
    assert "one seed (0.346 g) lies across the outlet of the draw down box and holds up" in record.message


@pytest.fixture(scope="module")
def turned():
    from solver import backend

    backend.init(threads=2)
    done = run(DRUM).on()
    return done.pour.record(), done.phases


def test_a_drum_runs_for_its_time_and_keeps_all_bodies(turned):
    record, phases = turned
    assert record.outcome == Outcome.MEASURED
    assert record.outcome.valid
    assert phases == [Phase.FILL, Phase.RUN]
    interval = DRUM.numerics.sample_interval
    # One turn at 60 rpm takes 1 s; decided at a moment of decision.
    assert record.trace.time[-1] - record.gate_opened == pytest.approx(1.0, abs=1.01 * interval)
    assert record.trace.entered_mass[-1] == pytest.approx(record.poured_mass)
    assert record.trace.discharged_mass[-1] == 0.0
    centre = np.array([0.0, 0.0, DRUM.rig.radius])
    out = np.hypot(*(record.bodies.position - centre)[:, [0, 2]].T)
    assert out.max() < DRUM.rig.radius
    assert np.abs(record.bodies.position[:, 1]).max() < DRUM.rig.axial_length / 2
    assert set(observe(record)) == {"dynamic_angle_deg", "slope_deg", "slope_core_deg"}


def test_the_bed_lies_higher_where_the_drum_carries_it(turned):
    """The bottom moves towards −x, so does the centre of mass, and the free surface rises to that side."""
    record = turned[0]
    assert observe(record)["dynamic_angle_deg"].value > 10.0
    assert record.bodies.mass @ record.bodies.position[:, 0] < 0.0
    surface = record.free_surface
    assert surface.time[0] - record.gate_opened == pytest.approx(0.5, abs=1.01 * DRUM.numerics.sample_interval)
    assert len(surface.time) == pytest.approx(0.5 / DRUM.numerics.sample_interval, abs=2)


def test_without_friction_a_drum_carries_nothing():
    """Smooth beads feel no turning wall: the free surface stays level (its bumps are beads of 12 mm)."""
    smooth = with_settings(DRUM, {"pair.bead.bead.static_friction": 0.0, "pair.bead.steel.static_friction": 0.0})
    record = run(smooth).on().pour.record()
    assert record.outcome == Outcome.MEASURED
    assert observe(record)["dynamic_angle_deg"].value == pytest.approx(0.0, abs=4.0)
    assert np.abs(record.bodies.mass @ record.bodies.position[:, 0]) / record.poured_mass < 3e-3


def test_end_plates_turn_or_stand():
    for plates, turning in (("turning", 3), ("standing", 1)):
        scene = with_settings(DRUM, {"rig.end_plates": plates})
        pour = run(scene).on(until=lambda pour: not pour.gate_shut).pour
        velocity = pour.batch.surface_state(1)[:, 10:13]
        moving = [k for k in range(3) if np.allclose(velocity[k], (0.0, 2.0 * np.pi, 0.0), rtol=1e-12)]
        assert len(moving) == turning


@pytest.mark.slow
@pytest.mark.parametrize("length", ["26mm", "120mm"])
def test_friction_and_speed_steepen_a_drum_s_bed(length):
    """Thin (two beads between the end plates) and long. A bed of some 150 or 700 beads, two turns each."""
    volume = float(length.removesuffix("mm")) * 1e-3 * np.pi * 0.1**2 * 0.3

    def angle(friction, speed):
        both = {f"pair.bead.{other}.static_friction": friction for other in ("bead", "steel")}
        size = {"rig.diameter": "200mm", "rig.axial_length": length, "rig.filled_volume": volume}
        turns = {"rig.speed_rpm": speed, "rig.transient_turns": 0.5, "rig.averaging_turns": 1.5}
        ((_, record),) = run_pours([Job(with_settings(DRUM, size | both | turns), 1)])
        assert record.outcome == Outcome.MEASURED
        return observe(record)["dynamic_angle_deg"]

    smooth, rough, fast = angle(0.1, 20.0), angle(0.6, 20.0), angle(0.6, 60.0)
    for flatter, steeper in ((smooth, rough), (rough, fast)):
        # more than the spread between parts of the time
        assert steeper.value > flatter.value + flatter.spread
