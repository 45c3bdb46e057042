"""A pour interrupted and resumed, or brought back to an earlier moment: the same bits as one that ran through.

A checkpoint file (``.npz``) holds the world's arrays (``solver/engine/snapshot.py``) and what the pour has decided so
far. The pour can be resumed elsewhere. A checkpoint belongs to one scene, seed and version of the solver, and is
refused for any other.

A kept moment (:class:`Kept`) is put back into the batch that it was taken from, while the pour runs. It holds only what
moves (``solver/engine/moving_state.py``), so keeping one and going back to it are quicker than with a checkpoint.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from solver.engine.moving_state import Moving
from solver.engine.snapshot import NAMES, Arrays
from solver.engine.world import Batch
from solver.npz import npz_arrays
from solver.params import ParameterError
from solver.pours.parameter_ramp import Ramp
from solver.pours.pour import Pour
from solver.pours.pour_key import pour_key
from solver.pours.record import Outcome
from solver.pours.supply import Entry
from solver.scenes.insertion import Pose
from solver.scenes.scene import Scene, actual

PLAIN = (
    "dt",
    "energy_put_in",
    "_supplied",
    "steps",
    "_time_base",
    "_steps_base",
    "samples",
    "_moving",
    "_quiet_samples",
    "_began",
    "_left",
    "_ramp_left",
    "disturbed",
)
"""Parts of a pour that are numbers, text, or lists of them."""
HEAD = "pour.json"
DISTURBED = ("_motion", "_motion_left", "_pull")
DECIDED = (
    *(name for name in PLAIN if name != "samples"),
    *("ended", "outcome", "message", "_table", "_ramp", "_inside"),
    *DISTURBED,
)
"""What a pour has decided, in values that it replaces and never changes."""


@dataclass(frozen=True)
class Checkpoint:
    """One interrupted pour."""

    seed: int
    fingerprint: str
    """Fingerprint of scene and solver."""
    decided: dict[str, Any]
    """What the pour has decided so far, in JSON types."""
    world: Arrays


@dataclass(frozen=True)
class Kept:
    """One moment of a pour."""

    time: float
    """[s]"""
    scene: Scene
    """The scene with the parameters in force at that moment."""
    decided: Mapping[str, Any]
    lengths: tuple[int, ...]
    to_do: tuple[Any, ...]
    random: Mapping[str, Any]
    world: Moving

    @property
    def nbytes(self) -> int:
        """Memory that it takes [B], except for a few hundred."""
        return self.world.nbytes


def checkpoint_of(pour: Pour) -> Checkpoint:
    """The present state of ``pour``, between two launches. Raises ParameterError while a person is disturbing it."""
    if pour.disturbance:
        raise ParameterError(f"no checkpoint while {pour.disturbance}")
    decided: dict[str, Any] = {name: getattr(pour, name) for name in PLAIN}
    decided["ended"], decided["told"] = pour.ended, (pour.outcome, pour.message)
    decided["random"] = pour.supply.random.bit_generator.state
    decided["done"] = len(pour.rig.actions()) - len(pour._to_do)
    decided["table"] = pour._table.tolist()
    decided["ramp"] = None
    if pour._ramp is not None:
        decided["ramp"] = [pour._ramp.before.tolist(), pour._ramp.after.tolist(), pour._ramp.start]
    decided["entries"] = [
        [time, step, pose.position.tolist(), pose.quaternion.tolist(), velocity.tolist()]
        for time, step, pose, velocity in pour.supply.entries
    ]
    decided["free_surface"] = [[time, heights.tolist()] for time, heights in pour._free_surface]
    # With a round trip an unfit value fails here, and what is restored is the same as what is read from a file.
    decided = json.loads(json.dumps(decided))
    return Checkpoint(pour.seed, fingerprint(pour.scene), decided, pour.batch.take(pour.w))


def resumed(batch: Batch, w: int, scene: Scene, kept: Checkpoint) -> Pour:
    """The pour of ``kept`` in world ``w``, ready to go on.

    Raises ParameterError if ``scene`` or the solver differs from that of the interrupted pour.
    """
    if kept.fingerprint != fingerprint(actual(scene)):
        raise ParameterError("the checkpoint belongs to another scene or another version of the solver")
    pour = Pour(batch, w, scene, kept.seed)
    decided = kept.decided
    for name in PLAIN:
        setattr(pour, name, decided[name])
    (ended, why), (told, message) = decided["ended"], decided["told"]
    pour.ended, pour.outcome, pour.message = (Outcome(ended), why), Outcome(told), message
    pour.supply.random.bit_generator.state = decided["random"]
    pour._to_do = list(pour.rig.actions())[decided["done"] :]
    pour._inside = pour.container
    pour._table = np.array(decided["table"])
    if decided["ramp"] is not None:
        before, after, start = decided["ramp"]
        pour._ramp = Ramp(pour._law, np.array(before), np.array(after), start)
    pour.supply.entries = [
        Entry(time, step, Pose(np.array(position), np.array(quaternion)), np.array(velocity))
        for time, step, position, quaternion, velocity in decided["entries"]
    ]
    pour._free_surface = [(time, np.array(heights)) for time, heights in decided["free_surface"]]
    batch.set_law(w, pour._table)
    batch.put(w, kept.world)
    return pour


def checkpoint_bytes(kept: Checkpoint) -> bytes:
    """Contents of a checkpoint file."""
    head = {"seed": kept.seed, "fingerprint": kept.fingerprint, "decided": kept.decided}
    buffer = io.BytesIO()
    text = np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)
    np.savez_compressed(buffer, allow_pickle=False, **{HEAD: text, **kept.world})
    return buffer.getvalue()


def read_checkpoint(path: Path) -> Checkpoint:
    """A checkpoint from its file; ParameterError naming the file if it is not a checkpoint."""
    try:
        world = npz_arrays(path)
        head = json.loads(bytes(world.pop(HEAD)))
        return Checkpoint(head["seed"], head["fingerprint"], head["decided"], world)
    except FileNotFoundError:
        raise ParameterError(f"{path}: no such file") from None
    except (OSError, TypeError, ValueError, KeyError) as error:
        raise ParameterError(f"{path}: not a checkpoint, or damaged ({error})") from error


def fingerprint(scene: Scene) -> str:
    """Equal for pours of one key (mesh files by their contents) whose checkpoints hold the same arrays."""
    return hashlib.sha256(f"{pour_key(scene, seed=0)} {PLAIN} {NAMES}".encode()).hexdigest()


def keep(pour: Pour) -> Kept:
    """The present moment of ``pour``, between two launches."""
    places = pour.supply.layout
    return Kept(
        time=pour.time,
        scene=pour.scene,
        decided={name: getattr(pour, name) for name in DECIDED},
        lengths=tuple(map(len, growing(pour))),
        to_do=tuple(pour._to_do),
        random=pour.supply.random.bit_generator.state,
        world=pour.batch.take_moving(pour.w, len(places.numbers), len(places.spheres)),
    )


def put_back(pour: Pour, kept: Kept) -> None:
    """Bring ``pour`` back to ``kept``, one of its earlier moments; what came after is forgotten."""
    for name, found in kept.decided.items():
        setattr(pour, name, found)
    for rows, length in zip(growing(pour), kept.lengths, strict=True):
        del rows[length:]
    pour.scene = kept.scene
    pour._to_do = list(kept.to_do)
    pour.supply.random.bit_generator.state = kept.random
    # These wake every body; put_moving puts the sleepers back to sleep.
    pour.batch.set_law(pour.w, pour._table)
    pour.batch.set_effects(pour.w, kept.scene)
    pour.apply_pull()
    pour.batch.put_moving(pour.w, kept.world)


def growing(pour: Pour) -> tuple[list[Any], ...]:
    """Lists that only grow, so that their lengths are enough to restore them."""
    return pour.samples, pour.supply.entries, pour._free_surface
