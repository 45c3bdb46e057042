"""A pour that is interrupted and gone on with ends in the same bits as one that is not."""

import dataclasses
from collections import deque

import numpy as np
import pytest

from solver.engine.world import Batch
from solver.params import ParameterError
from solver.pours.checkpoint import checkpoint_bytes, checkpoint_of, read_checkpoint, resumed
from solver.pours.pour import Pour
from solver.pours.run import Job, capacity_for, run_queue
from solver.scenes.material_file import load_material
from solver.scenes.scene import with_values

pytestmark = pytest.mark.usefixtures("taichi")

HEAP = with_values(
    load_material("sunflower_extract"),
    {"body.spheres": "coarse", "rig.mass": "6g", "insertion.rate": "60g/s", "rig.outlet_diameter": "60mm"},
)
GATED = with_values(HEAP, {"insertion.protocol": "fill_then_open"})


def drive(pour, until=np.inf):
    while pour.time < until and (steps := pour.steps_due()):
        pour.after(steps, pour.batch.advance(np.array([steps], dtype=np.int32))[0])
    return pour


def same(one, other):
    assert (one.outcome, one.steps, one.message) == (other.outcome, other.steps, other.message)
    assert np.array_equal(one.bodies.position, other.bodies.position)
    assert np.array_equal(one.bodies.quaternion, other.bodies.quaternion)
    for field in dataclasses.fields(one.trace):
        assert np.array_equal(getattr(one.trace, field.name), getattr(other.trace, field.name)), field.name
    assert np.array_equal(one.entries.position, other.entries.position)


@pytest.mark.parametrize("scene", [HEAP, GATED], ids=["pour_through", "fill_then_open"])
def test_a_file_in_between_changes_no_bit(scene, tmp_path):
    """Interrupted twice: while bodies enter, so that the random numbers matter, and while they pile up."""
    batch = Batch(capacity_for([scene], 1))
    whole = drive(Pour(batch, 0, scene, 5)).record()
    path = tmp_path / "pour.npz"
    path.write_bytes(checkpoint_bytes(checkpoint_of(drive(Pour(batch, 0, scene, 5), until=0.06))))
    second = drive(resumed(batch, 0, scene, read_checkpoint(path)), until=0.4)
    path.write_bytes(checkpoint_bytes(checkpoint_of(second)))
    assert len(read_checkpoint(path).world["contact.radius"]) > 0
    same(drive(resumed(batch, 0, scene, read_checkpoint(path))).record(), whole)


def test_a_change_of_stiffness_goes_on_where_it_was():
    batch = Batch(capacity_for([HEAP], 1))
    stiffer = with_values(HEAP, {"material.seed.shear_modulus": 2 * HEAP.material("seed").shear_modulus})

    def retuned():
        pour = drive(Pour(batch, 0, HEAP, 5), until=0.3)
        pour.ramp_to(stiffer)
        return drive(pour, until=0.31)

    whole = drive(retuned()).record()
    kept = checkpoint_of(retuned())
    assert kept.decided["ramp"] is not None
    same(drive(resumed(batch, 0, stiffer, kept)).record(), whole)


def test_a_pour_that_was_disturbed_stays_so():
    batch = Batch(capacity_for([HEAP], 1))
    pour = drive(Pour(batch, 0, HEAP, 5), until=0.1)
    assert not resumed(batch, 0, HEAP, checkpoint_of(pour)).disturbed
    pour.disturbed = True
    assert resumed(batch, 0, HEAP, checkpoint_of(pour)).disturbed


def test_a_pour_that_was_interrupted_after_its_end_gives_its_record():
    batch = Batch(capacity_for([HEAP], 1))
    pour = drive(Pour(batch, 0, HEAP, 5))
    whole, kept = pour.record(), checkpoint_of(pour)
    ((job, record),) = run_queue(deque([Job(HEAP, 5, interrupted=kept)]), [HEAP], worlds=1)
    assert job.seed == 5
    same(record, whole)


@pytest.mark.slow
def test_in_another_slot_among_other_pours():
    batch = Batch(capacity_for([HEAP], 1))
    whole = drive(Pour(batch, 0, HEAP, 5)).record()
    kept = checkpoint_of(drive(Pour(batch, 0, HEAP, 5), until=0.3))
    queue = deque([Job(HEAP, 1), Job(HEAP, 2), Job(HEAP, kept.seed, tag=7, interrupted=kept)])
    records = {job.tag: record for job, record in run_queue(queue, [HEAP], threads=2, worlds=3)}
    same(records[7], whole)


def test_another_scene_is_refused():
    batch = Batch(capacity_for([HEAP], 1))
    kept = checkpoint_of(drive(Pour(batch, 0, HEAP, 5), until=0.05))
    with pytest.raises(ParameterError, match="another scene"):
        resumed(batch, 0, GATED, kept)


@pytest.mark.parametrize("contents", [b"", b"PK\x03\x04 cut short", b"\x93NUMPY"])
def test_a_file_that_is_no_checkpoint_is_named(tmp_path, contents):
    path = tmp_path / "broken.npz"
    path.write_bytes(contents)
    with pytest.raises(ParameterError, match=r"broken\.npz: not a checkpoint"):
        read_checkpoint(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ParameterError, match=r"gone\.npz: no such file"):
        read_checkpoint(tmp_path / "gone.npz")
