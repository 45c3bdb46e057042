"""Digests of a few pours, to be compared between processes: ``python -m tests.solver.pour_digests THREADS``.

Taichi takes its number of threads once per process.
"""

import hashlib
import json
import sys

from solver import backend
from solver.pours.record import Record
from solver.pours.run import Job, run_pours
from solver.scenes.scene import with_values
from tests.solver.pours.test_pour import QUICK

HEAP = with_values(QUICK, {"rig.mass": "8g"})
SHUT = with_values(HEAP, {"insertion.protocol": "fill_then_open"})
WORLDS = 3
JOBS = [Job(HEAP, 1), Job(SHUT, 2), Job(HEAP, 3), Job(SHUT, 4), Job(HEAP, 5), Job(HEAP, 6)]


def digest(record: Record) -> str:
    """Of all bits that a pour leaves: state of the bodies, curves, outcome."""
    state = record.bodies
    parts = [state.position, state.quaternion, state.velocity, *vars(record.trace).values()]
    bits = hashlib.sha256(b"".join(part.tobytes() for part in parts))
    bits.update(f"{record.outcome} {record.steps} {record.gate_opened.hex()}".encode())
    return bits.hexdigest()


def digests(threads: int) -> list[str]:
    """Of the pours ``JOBS``, three side by side; a slot that is free takes the next."""
    backend.init(threads=threads)
    records = dict(run_pours(JOBS, worlds=WORLDS))
    return [digest(records[k]) for k in range(len(JOBS))]


if __name__ == "__main__":
    print(json.dumps(digests(int(sys.argv[1]))))
