"""What measured bodies say of effects that change the bodies: a wrong density, a scatter of sizes, another shape.

On the scales of ``doe/measurement/bodies.py`` the numbers y of a model whose effects act at amplitudes a are

    y = y₀ + Σ_e s_e(a_e) + ε,    ε ~ N(0, diag(standard errors²))

with y₀ and s_e as the declared scene has them: no pour is needed for it. What calibration moves is left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from doe.declared.model import CandidateEffect, Declared, effect_values
from doe.measurement.bodies import QUANTITIES, MeasuredBody, bodies_of, body_numbers
from doe.measurement.measurement import Measurement
from doe.record import Record
from solver import EFFECTS, Scene, SetUpEffect, with_values

FloatArray = npt.NDArray[np.float64]

PLACES = 65
"""Amplitudes at which an effect is set up; between them what it does is a straight line, to a thousandth of it."""
FINE = 9
"""Amplitudes within the cell of one that is weighed: a balance may tell more than one from the next."""


@dataclass(frozen=True, eq=False)
class BodyEvidence:
    """The measured numbers ``rows``, and how far ``off`` those of the declared ``scene`` they are.

    ``off``: (q,) [standard errors]. ``effects``: the candidates.
    """

    scene: Scene
    rows: tuple[MeasuredBody, ...]
    off: FloatArray
    effects: tuple[CandidateEffect, ...]
    _shifts: dict[str, tuple[FloatArray, FloatArray] | None] = field(default_factory=dict)

    def log_density(self, label: str, amplitudes: FloatArray, cell: float) -> FloatArray:
        """Log densities (n,) of the numbers, less those of numbers that agree, under "base", an effect, or "a+b".

        Averaged over the cells of ``amplitudes`` (n, p), those of the effects in turn [natural units]: from 1/√``cell``
        to √``cell`` times each.
        """
        steps = cell ** ((np.arange(FINE) + 0.5) / FINE - 0.5)
        shift, column = np.zeros((1, len(amplitudes), len(self.rows))), 0
        for name in [] if label == "base" else label.split("+"):
            if self.moved_by(name):
                moved = self.shift(name, np.outer(steps, amplitudes[:, column]))
                shift = (shift[:, None] + moved[None]).reshape(-1, *moved.shape[1:])
            column += len(EFFECTS[name].amplitudes)
        logs = -0.5 * ((self.off - shift) ** 2).sum(axis=2)
        return np.asarray(np.logaddexp.reduce(logs, axis=0) - np.log(len(logs)))

    def moved_by(self, name: str) -> bool:
        """Whether the effect ``name`` moves any of the numbers."""
        return self._shift(name) is not None

    def shift(self, name: str, amplitudes: FloatArray) -> FloatArray:
        """By how much an effect with one amplitude moves the numbers at each of ``amplitudes``, (..., q)."""
        if (known := self._shift(name)) is None:
            return np.zeros((*amplitudes.shape, len(self.rows)))
        at, shifts = known
        return np.stack([np.interp(amplitudes, at, shifts[:, q]) for q in range(len(self.rows))], axis=-1)

    def predicted(self, acting: Iterable[tuple[str, float, float]]) -> tuple[FloatArray, FloatArray]:
        """Mean (q,) and covariance (q, q) of the numbers with effects ``acting``: name, amplitude, its deviation."""
        mean, covariance = np.zeros(len(self.rows)), np.eye(len(self.rows))
        for name, amplitude, deviation in acting:
            if self.moved_by(name):
                here, beside = self.shift(name, amplitude + np.array([0.0, deviation]))
                mean, covariance = mean + here, covariance + np.outer(beside - here, beside - here)
        return mean, covariance

    def _shift(self, name: str) -> tuple[FloatArray, FloatArray] | None:
        """Amplitudes, ascending, and by how much they move the numbers; None of an effect that moves none."""
        if name not in self._shifts:
            self._shifts[name] = self._set_up(name)
        return self._shifts[name]

    def _set_up(self, name: str) -> tuple[FloatArray, FloatArray] | None:
        effect = next(one for one in self.effects if one.name == name)
        if effect.amplitudes != 1 or not issubclass(EFFECTS[name], SetUpEffect):
            return None
        places = np.linspace(effect.low[0], effect.high[0], PLACES)
        scenes = [with_values(self.scene, effect_values(name, (float(a),))) for a in places]
        deviations = np.array([one.deviation for one in self.rows])
        still = body_numbers(self.scene, self.rows)
        shifts = (np.array([body_numbers(scene, self.rows) for scene in scenes]) - still) / deviations
        return (places, shifts) if shifts.any() else None


def body_evidence(measurement: Measurement, declared: Declared) -> BodyEvidence | None:
    """What the measured bodies of ``measurement`` say; None where it has none that calibration leaves alone."""
    if not measurement.bodies or not (kept := _beside_calibration(measurement.bodies, measurement)):
        return None
    scene = measurement.fit[0].scene
    off = (np.array([one.value for one in kept]) - body_numbers(scene, kept)) / [one.deviation for one in kept]
    return BodyEvidence(scene, kept, np.asarray(off), declared.effects)


def wanted_bodies(measurement: Measurement, declared: Declared, labels: Sequence[str]) -> BodyEvidence | None:
    """What measuring bodies would say of the effects in ``labels``, with the usual standard errors; None for nothing.

    Only what is not measured yet.
    """
    scene = measurement.fit[0].scene
    known = {(one.body, one.quantity) for one in measurement.bodies}
    rows = []
    for body in scene.bodies:
        for name, quantity in QUANTITIES.items():
            if (body.name, name) not in known:
                mean = quantity.of(body)
                rows.append(MeasuredBody(body.name, name, mean, quantity.usual * (mean if quantity.relative else 1.0)))
    left = _beside_calibration(rows, measurement)
    full = BodyEvidence(scene, left, np.zeros(len(left)), declared.effects)
    asked = {name for label in labels for name in label.split("+")}
    ends = {one.name: np.array([one.low[0], one.high[0]]) for one in declared.effects if one.name in asked}
    told = np.zeros(len(left), bool)
    for name, pair in ends.items():
        told |= (np.abs(full.shift(name, pair)) > 1.0).any(axis=0)
    kept = tuple(row for row, tells in zip(left, told, strict=True) if tells)
    return BodyEvidence(scene, kept, np.zeros(len(kept)), declared.effects) if kept else None


@dataclass(frozen=True)
class BodyRow(Record):
    """A number of single bodies, SI: as measured, of the declared model, and of the final one."""

    body: str
    quantity: str
    unit: str
    mean: float
    standard_error: float
    declared: float
    final: float


def body_rows(scene: Scene, measured: Sequence[MeasuredBody], acting: Mapping[str, Sequence[float]]) -> list[BodyRow]:
    """``measured`` beside the declared ``scene``, and beside it with effects ``acting`` at their amplitudes."""
    final = with_values(
        scene, {path: x for name, one in acting.items() for path, x in effect_values(name, one).items()}
    )
    both = zip(measured, bodies_of(scene, measured), bodies_of(final, measured), strict=True)
    return [
        BodyRow(
            one.body, one.quantity, QUANTITIES[one.quantity].unit, one.mean, one.standard_error, declared, with_effects
        )
        for one, declared, with_effects in both
    ]


def _beside_calibration(rows: Sequence[MeasuredBody], measurement: Measurement) -> tuple[MeasuredBody, ...]:
    """Those that no calibrated parameter changes."""
    scene, moved = measurement.fit[0].scene, np.zeros(len(rows), bool)
    for p in measurement.parameters:
        low, high = (body_numbers(with_values(scene, {p.path: end}), rows) for end in (p.low, p.high))
        moved |= low != high
    return tuple(row for row, is_moved in zip(rows, moved, strict=True) if not is_moved)
