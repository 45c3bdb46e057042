"""Reference pours of a declared model: so many of every effect that its shift of a pile is known, not estimated.

The ruler and the limit of any diagnosis (both in ``limit.py``) are computed from them. All pours have the calibrated
parameters at their measured means, except pours ``SIDE`` deviations to either side, which measure each parameter's
effect.

Pours come in rounds with the same number of each kind, so that a reference can be made in pieces and stopped after any
round. First a pilot finds, for every direction of an effect, the amplitude that shifts the summaries of a data set by
about 12 standard errors (``training_amplitudes.py``).
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from doe.declared.model import CandidateEffect, Declared
from doe.declared.points import Direction, Point, directions_of, middle
from doe.declared.pours import ModelPours
from doe.diagnose.result import Level
from doe.diagnose.training_amplitudes import Trials, level_of
from doe.errors import StatisticsError
from doe.measurement.features import feature_set
from doe.measurement.measurement import Measurement
from doe.record import plain
from doe.store import READINGS
from solver import npz_arrays

FloatArray = npt.NDArray[np.float64]

Blocks = tuple[FloatArray, ...]
"""Features of the pours in each fitted condition, (n_c, d_c)."""
Say = Callable[[str], None]

CONSTANT = 1e-9
"""Standard deviation of a feature, relative to its size, below which the feature counts as constant."""
ROOT = 2
"""Root of the seeds, different from those of a diagnosis (0) and of the made-up laboratories (1)."""
TRIALS = Trials(pours=6, most=5, enough=10.0, too_much=15.0)
SIDE = 1.5
"""Standard deviations (``CalibratedParameter.deviation``) by which a parameter is moved."""

FIRST_BASE = 48
"""Pours of the base model from which the pilot estimates the covariance."""
PER_ROUND = {"strong": 8, "weak": 4, "other": 4, "base": 24, "parameter": 4}
"""Pours of each kind in a round: of each effect at either amplitude, of its other directions, of the base model, and of
each parameter on either side of its mean."""


@dataclass(frozen=True)
class ReferencePours:
    """Reference pours: what acts → blocks of complete pours; ``parameters``: names of the calibrated parameters."""

    pours: Mapping[str, Blocks]
    parameters: tuple[str, ...]

    def first(self, numbers: Sequence[int]) -> ReferencePours:
        """The same pours with the first ``numbers[c]`` features of each condition."""
        return ReferencePours(
            {
                name: tuple(block[:, :number] for block, number in zip(blocks, numbers, strict=True))
                for name, blocks in self.pours.items()
            },
            self.parameters,
        )

    def varying(self) -> ReferencePours:
        """The same pours without features that are constant in the base model's pours."""
        return self.only(self.vary())

    def vary(self) -> tuple[npt.NDArray[np.bool_], ...]:
        """Masks (d_c,) of the features that vary in the base model's pours, per condition."""
        found = []
        for block in self.pours["base"]:
            size = np.maximum(np.abs(block).max(axis=0), np.finfo(float).tiny)
            found.append(np.asarray(block.std(axis=0) > CONSTANT * size))
        return tuple(found)

    def only(self, keep: Sequence[npt.NDArray[np.bool_]]) -> ReferencePours:
        """The same pours with the features that the masks ``keep`` select in each condition."""
        pours = {
            name: tuple(block[:, kept] for block, kept in zip(blocks, keep, strict=True))
            for name, blocks in self.pours.items()
        }
        return ReferencePours(pours, self.parameters)


@dataclass(frozen=True)
class Reference:
    """Reference pours of a declared model, after a number of rounds."""

    title: str
    """Title of the measurement that declares the model."""
    physics: int
    readings: int
    """``physics`` and ``readings``: versions of what was poured and of what was read off."""
    features: tuple[tuple[str, ...], ...]
    """Names of the columns, per fitted condition."""
    levels: tuple[Level, ...]
    rounds: int = 0
    sample: ReferencePours = ReferencePours({}, ())


def reference_directions(effect: CandidateEffect) -> list[Direction]:
    """Up and, if the range goes below zero, down; with two amplitudes, x and y (the rest follows by symmetry)."""
    found = directions_of(effect)
    if effect.amplitudes == 1:
        return found
    along_x, along_y = effect.high
    return [
        Direction(effect.name, f"{effect.name} x", (along_x, 0.0)),
        Direction(effect.name, f"{effect.name} y", (0.0, along_y)),
    ]


def reference_base(declared: Declared, number: int) -> list[Point]:
    """The first ``number`` pours of the base model."""
    return [Point("reference base", k, middle(declared.parameters)) for k in range(number)]


def reference_effect(declared: Declared, direction: Direction, share: float, number: int) -> list[Point]:
    """The first ``number`` pours of an effect at ``share`` of its range."""
    amplitude = direction.at(share)
    name = f"reference {direction.effect}@{'_'.join(f'{one:.6g}' for one in amplitude)}"
    effects = ((direction.effect, amplitude),)
    return [Point(name, k, middle(declared.parameters), effects) for k in range(number)]


def reference_parameters(declared: Declared, number: int) -> list[list[Point]]:
    """The first ``number`` pours with each parameter moved: one list below its mean, then one above it."""
    found = []
    for j, parameter in enumerate(declared.parameters):
        step = SIDE * parameter.deviation
        for sign in (-1.0, 1.0):
            theta = list(middle(declared.parameters))
            theta[j] += sign * step
            name = f"reference {parameter.name} {sign * SIDE:+g}"
            found.append([Point(name, k, tuple(theta)) for k in range(number)])
    return found


def find_levels(declared: Declared, pours: ModelPours) -> list[Level]:
    """Reference amplitudes of every direction of every effect."""
    base = pours.run("reference: base model", reference_base(declared, FIRST_BASE))
    directions = [direction for effect in declared.effects for direction in reference_directions(effect)]
    searches = [
        level_of(declared, direction, base, partial(reference_effect, declared, direction), TRIALS)
        for direction in directions
    ]
    widest = [point for direction in directions for point in reference_effect(declared, direction, 1.0, 1)]
    return pours.answered("reference: amplitudes", searches, widest=widest)


def extended(found: Reference, declared: Declared, pours: ModelPours) -> Reference:
    """``found`` with one more round; pours that came to no valid end, or that cannot be read whole, are left out."""
    before = points_of(declared, found.levels, found.rounds) if found.rounds else {}
    kinds = points_of(declared, found.levels, found.rounds + 1)
    new = {kind: points[len(before.get(kind, ())) :] for kind, points in kinds.items()}
    what = f"reference: round {found.rounds + 1}"
    rows = iter(pours.run(what, [point for points in new.values() for point in points]))
    sample: dict[str, Blocks] = {}
    for kind, points in new.items():
        poured = [next(rows) for _ in points]
        blocks = []
        for c in range(len(declared.conditions)):
            features = [(*row[c].summaries, *row[c].surface) for row in poured if row[c].valid]
            complete = [one for one in features if np.isfinite(one).all()]
            known = found.sample.pours[kind][c : c + 1] if kind in found.sample.pours else ()
            # Kept in single precision, so that a reference is the same whether it was made at once or in pieces.
            shape = len(complete), len(found.features[c])
            rounded = np.array(complete, dtype=np.float32).astype(np.float64).reshape(shape)
            blocks.append(np.concatenate([*known, rounded]))
        sample[kind] = tuple(blocks)
    parameters = tuple(parameter.name for parameter in declared.parameters)
    return replace(found, rounds=found.rounds + 1, sample=ReferencePours(sample, parameters))


def kept(path: Path, measurement: Measurement, physics: int) -> Reference:
    """The reference in ``path`` for the fitted conditions of ``measurement``; one without pours if there is no file.

    Raises StatisticsError if the file is of another model, physics, or readings.
    """
    features = tuple(feature_set(condition).names for condition in measurement.fit)
    now = Reference(measurement.title, physics, READINGS, features, ())
    if not path.exists():
        return now
    found = load(path)
    for name in ("title", "physics", "readings", "features"):
        if getattr(found, name) != getattr(now, name):
            there = repr(getattr(found, name)) if name != "features" else "of its pours"
            raise StatisticsError(f"{path}: {name} {there} is out of date; name another file")
    return found


def extended_to(
    found: Reference, rounds: int, declared: Declared, pours: ModelPours, path: Path, say: Say
) -> Reference:
    """``found`` extended to ``rounds`` rounds, written to ``path`` after each new round."""
    if not found.levels and rounds:
        found = replace(found, levels=tuple(find_levels(declared, pours)))
    while found.rounds < rounds:
        found = extended(found, declared, pours)
        save(found, path)
        say(f"{path}: {found.rounds} of {rounds} rounds")
    return found


def save(found: Reference, path: Path) -> None:
    """Write ``found`` to ``path`` as a compressed NumPy archive: a JSON head, and one array per kind and condition."""
    head = {
        **{name: getattr(found, name) for name in ("title", "physics", "readings", "features", "rounds")},
        "levels": plain(found.levels),
        "parameters": found.sample.parameters,
        "kinds": {kind: len(blocks) for kind, blocks in found.sample.pours.items()},
    }
    arrays: dict[str, npt.NDArray[Any]] = {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)}
    for k, blocks in enumerate(found.sample.pours.values()):
        arrays |= {f"{k}_{c}": block.astype(np.float32) for c, block in enumerate(blocks)}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    # Two shards of a campaign may write at once.
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    part.write_bytes(buffer.getvalue())
    part.replace(path)


def load(path: Path) -> Reference:
    """Read a file that :func:`save` wrote; raises StatisticsError with a one-line message for any other."""
    try:
        file = npz_arrays(path)
        head = json.loads(bytes(file["head"]))
        pours = {
            kind: tuple(file[f"{k}_{c}"].astype(np.float64) for c in range(conditions))
            for k, (kind, conditions) in enumerate(head["kinds"].items())
        }
        levels = tuple(
            Level(
                Direction(one["direction"]["effect"], one["direction"]["name"], tuple(one["direction"]["full"])),
                one["share"],
                one["shift"],
            )
            for one in head["levels"]
        )
        features = tuple(tuple(names) for names in head["features"])
        return Reference(
            head["title"],
            head["physics"],
            head["readings"],
            features,
            levels,
            head["rounds"],
            ReferencePours(pours, tuple(head["parameters"])),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StatisticsError(f"{path}: not a file of reference pours ({' '.join(str(error).split())[:100]})") from None


def points_of(declared: Declared, levels: Sequence[Level], rounds: int) -> Mapping[str, list[Point]]:
    """All pours of ``rounds`` rounds, by what acts in them.

    Keys: "base", "<direction> strong", "<direction> weak" (first directions only), "<parameter> -", "<parameter> +".
    """
    found = {"base": reference_base(declared, FIRST_BASE + rounds * PER_ROUND["base"])}
    known: set[str] = set()
    for level in levels:
        direction = level.direction
        first = direction.effect not in known
        known.add(direction.effect)
        number = rounds * PER_ROUND["strong" if first else "other"]
        found[f"{direction.name} strong"] = reference_effect(declared, direction, level.share, number)
        if first:
            weak = rounds * PER_ROUND["weak"]
            found[f"{direction.name} weak"] = reference_effect(declared, direction, 0.5 * level.share, weak)
    sides = iter(reference_parameters(declared, rounds * PER_ROUND["parameter"]))
    for parameter in declared.parameters:
        found[f"{parameter.name} -"], found[f"{parameter.name} +"] = next(sides), next(sides)
    return found
