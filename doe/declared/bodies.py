"""Evidence of measured bodies for effects: a wrong density, size or shape, and effects at a contact with a plate.

On the scales of ``doe/measurement/bodies.py``, in standard errors, a model whose effects act at amplitudes a predicts
the measured numbers

    y = y₀ + Σ_e s_e(a_e) + K θ + ε,    θ ~ N(0, 1),    ε ~ N(0, N)

y₀ and the shifts s_e follow from the declared scene, by geometry or by simulated plate tests, without any pour. K holds
the changes per standard deviation of each calibrated parameter θ. N is 1 and what the line K θ misses where a number is
no linear function of a parameter. Piles are weighed with what the numbers say of the parameters (``parameters``), so a
parameter that is off counts once.
An apparent friction μ (1 + F/(m g)) grows with the adhesive load F on a contact, and the loads of two effects add up,
but only approximately: simplified JKR adhesion grows with the load itself, and a body may be heavier (``TOGETHER``).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator
from scipy.linalg import solve_triangular

from doe.declared.model import CandidateEffect, Declared, effect_values
from doe.measurement.bodies import QUANTITIES, MeasuredBody, bodies_of, body_numbers
from doe.measurement.measurement import Measurement
from doe.record import Record
from solver import EFFECTS, Scene, with_values

FloatArray = npt.NDArray[np.float64]
PLACES = 14
"""Number of amplitudes of each sign at which an effect is set up. They are closer together towards zero, because the
friction of an adhering body grows as 1 + c a; between them a monotone cubic interpolates (Fritsch and Butland 1984)."""
NEGLIGIBLE = 0.1
"""Shift at the end of an effect's range [standard errors] below which the effect is taken not to move a number."""
TOGETHER = 0.2
"""Relative standard error of an apparent friction that two effects both move: of fifteen pairs that were tested on the
trefoil none is further off the sum of loads, but simplified JKR adhesion by 0.2 beside another effect."""
LIKELY = 2.0
"""Half width of the interval about its best fit in which an amplitude may lie [standard deviations]."""
FINE = 9
"""Amplitudes within the cell of each weighed one: a balance may resolve differences smaller than a cell."""


@dataclass(frozen=True, eq=False)
class ActingModel:
    """A model fitted to piles.

    ``effects``: name, amplitude and standard deviation of the amplitude of each. ``theta``, ``unsure``: parameters
    [standard deviations of their measurements], (k,), and their covariance, (k, k).
    """

    effects: Sequence[tuple[str, float, float]]
    theta: FloatArray
    unsure: FloatArray


@dataclass(frozen=True, eq=False)
class BodyEvidence:
    """The measured numbers ``rows``, and their differences ``off`` from those of the declared ``scene``.

    ``slopes``: K (q, k). ``noise``: N (q, q). ``factor``: Cholesky factor (q, q) of N + K Kᵀ. ``off``: (q,), whitened
    by it. ``effects``: the candidates.
    """

    scene: Scene
    rows: tuple[MeasuredBody, ...]
    off: FloatArray
    slopes: FloatArray
    noise: FloatArray
    factor: FloatArray
    effects: tuple[CandidateEffect, ...]
    _shifts: dict[str, PchipInterpolator | None] = field(default_factory=dict)

    @property
    def asked(self) -> tuple[tuple[str, str], ...]:
        """Component and quantity of each row."""
        return tuple((row.body, row.quantity) for row in self.rows)

    def log_density(self, label: str, amplitudes: FloatArray, cell: float) -> FloatArray:
        """Log densities (n,) of the numbers under "base", an effect, or "a+b", relative to numbers that agree exactly.

        Densities are averaged over a cell about each of ``amplitudes`` (n, p) [natural units], from 1/√``cell`` to
        √``cell`` times the amplitude; the columns are the amplitudes of the effects in turn.
        """
        left, noise = self._left(label, amplitudes, cell ** ((np.arange(FINE) + 0.5) / FINE - 0.5))
        factor = np.asarray(np.linalg.cholesky(noise + self.slopes @ self.slopes.T), dtype=np.float64)
        logs = -0.5 * (_white(factor, left) ** 2).sum(axis=2)
        logs -= np.log(np.diag(factor) / np.diag(self.factor)).sum()
        return np.asarray(np.logaddexp.reduce(logs, axis=0) - np.log(len(logs)))

    def parameters(self, label: str, amplitudes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Means (n, k) and covariance (k, k) of the parameters [standard deviations], given the numbers.

        For N(0, 1) before, θ | y ~ N(C Kᵀ N⁻¹ (y − y₀ − s), C) with C⁻¹ = 1 + Kᵀ N⁻¹ K and the covariance N of ε.
        """
        left, noise = self._left(label, amplitudes, np.ones(1))
        gained = np.linalg.solve(noise, self.slopes)
        covariance = np.linalg.inv(np.eye(self.slopes.shape[1]) + self.slopes.T @ gained)
        return np.asarray(left[0] @ gained @ covariance), np.asarray(covariance)

    def moved_by(self, name: str) -> bool:
        """Whether the effect ``name`` moves any of the numbers."""
        return self._shift(name) is not None

    def shift(self, name: str, amplitudes: FloatArray) -> FloatArray:
        """Shifts (..., q) of the numbers [standard errors] by an effect with one amplitude, at ``amplitudes`` (...)."""
        if (known := self._shift(name)) is None:
            return np.zeros((*amplitudes.shape, len(self.rows)))
        return np.asarray(known(np.clip(amplitudes, known.x[0], known.x[-1])))

    def predicted(self, model: ActingModel) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Mean (q,), covariance of the noise (q, q) and loadings (q, k + p) of the whitened numbers under ``model``.

        Loadings: shifts by one standard deviation of what piles depend on as well, the k parameters (by a Cholesky
        factor of their covariance) and the amplitudes of the p effects, away from zero.
        """
        shifts = [(p, *one, self._shift(one[0])) for p, one in enumerate(model.effects)]
        moved = [(p, name, a, deviation, known) for p, name, a, deviation, known in shifts if known is not None]
        still = [self.shift(name, np.array(amplitude)) for _, name, amplitude, _, _ in moved]
        mean = self._together(still, (len(self.rows),))
        by_effects = np.zeros((len(self.rows), len(model.effects)))
        for k, (p, name, amplitude, deviation, known) in enumerate(moved):
            step = math.copysign(deviation, amplitude)
            # At the end of the range the step back stands for the one beyond it.
            sign = 1.0 if known.x[0] <= amplitude + step <= known.x[-1] else -1.0
            more = self.shift(name, np.array(amplitude + sign * step))
            by_effects[:, p] = sign * (self._together([*still[:k], more, *still[k + 1 :]], mean.shape) - mean)
        loadings = np.concatenate([self.slopes @ np.linalg.cholesky(model.unsure), by_effects], axis=1)
        noise = _white(self.factor, _white(self.factor, self._noise_of(still)).T)
        return _white(self.factor, mean + self.slopes @ model.theta), noise, _white(self.factor, loadings.T).T

    def told_apart(self, answers: Sequence[ActingModel]) -> npt.NDArray[np.bool_]:
        """Whether ``answers`` may differ by more than a standard deviation, parameters included, in each number (q,).

        Amplitudes range over ``LIKELY`` standard deviations: an effect that hardly shows in piles fits best near zero.
        """
        self.set_up(name for model in answers for name, _, _ in model.effects)
        means, variances = [], []
        for model in answers:
            for off in (-LIKELY, 0.0, LIKELY):
                effects = [self.shift(name, np.array(a + off * deviation)) for name, a, deviation in model.effects]
                means.append(self._together(effects, (len(self.rows),)) + self.slopes @ model.theta)
            variances.append(np.diag(self.noise + self.slopes @ model.unsure @ self.slopes.T))
        return np.asarray(np.ptp(means, axis=0) ** 2 > np.max(variances, axis=0))

    def _left(self, label: str, amplitudes: FloatArray, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The numbers less their shift by ``label`` at ``steps`` of ``amplitudes``, (s or s², n, q), and N, (q, q)."""
        moved, column = [], 0
        for name in [] if label == "base" else label.split("+"):
            if self.moved_by(name):
                moved.append(self.shift(name, np.outer(steps, amplitudes[:, column])))
            column += len(EFFECTS[name].amplitudes)
        if len(moved) == 2:
            moved = [moved[0][:, None], moved[1][None]]
        shift = self._together(moved, (len(amplitudes), len(self.rows))).reshape(-1, len(amplitudes), len(self.rows))
        return self.factor @ self.off - shift, self._noise_of(moved)

    def _together(self, shifts: Sequence[FloatArray], shape: tuple[int, ...]) -> FloatArray:
        """Shift of the numbers by effects that act together; ``shape``: shape of the result without effects."""
        total = np.asarray(sum(shifts, np.zeros(shape)))
        for q, row in enumerate(self.rows):
            if len(shifts) > 1 and QUANTITIES[row.quantity].loads:
                factors = [np.exp(one[..., q] * row.deviation) for one in shifts]
                load = 1.0 + sum(np.maximum(one - 1.0, 0.0) for one in factors)
                total[..., q] = np.log(load * math.prod(np.minimum(one, 1.0) for one in factors)) / row.deviation
        return total

    def _noise_of(self, shifts: Sequence[FloatArray]) -> FloatArray:
        """N (q, q) under these shifts; two together are known less well (``TOGETHER``)."""
        more = np.zeros(len(self.rows))
        for q, row in enumerate(self.rows):
            both = len(shifts) > 1 and all(np.abs(one[..., q]).max(initial=0.0) > NEGLIGIBLE for one in shifts)
            if both and QUANTITIES[row.quantity].loads:
                more[q] = TOGETHER / row.deviation
        return np.asarray(self.noise + np.diag(more**2))

    def _shift(self, name: str) -> PchipInterpolator | None:
        """Shift of the numbers as a function of the effect's amplitude; None if the effect moves none of them."""
        if name not in self._shifts:
            self.set_up([name])
        return self._shifts[name]

    def set_up(self, names: Iterable[str]) -> None:
        """Compute the shifts by the effects ``names``, all in one batch so that no core waits."""
        known = {one.name: one for one in self.effects}
        effects = [known[name] for name in dict.fromkeys(names) if name not in self._shifts]
        ends = {one.name: [end for end in (one.low[0], one.high[0]) if end] for one in effects if one.amplitudes == 1}
        shares = (np.arange(1, PLACES + 1) / PLACES) ** 3
        places = {
            name: np.sort(np.concatenate([np.zeros(1), *(end * shares for end in ends[name])]))
            for name, moved in self._moved(ends).items()
            if (np.abs(moved) > NEGLIGIBLE).any()
        }
        self._shifts.update({one.name: None for one in effects})
        self._shifts.update({name: PchipInterpolator(places[name], y) for name, y in self._moved(places).items()})

    def _moved(self, amplitudes: Mapping[str, Sequence[float] | FloatArray]) -> dict[str, FloatArray]:
        """Shifts (n, q) of the numbers [standard errors] by each effect at its ``amplitudes``."""
        if not amplitudes:
            return {}
        scenes = [
            with_values(self.scene, effect_values(name, (float(a),))) for name, some in amplitudes.items() for a in some
        ]
        still, *moved = body_numbers([self.scene, *scenes], self.rows)
        shifts = np.array(moved).reshape(-1, len(self.rows)) - still
        shifts /= [one.deviation for one in self.rows]
        last = np.cumsum([len(some) for some in amplitudes.values()])
        return dict(zip(amplitudes, np.split(shifts, last[:-1]), strict=True))


def _white(factor: FloatArray, shift: FloatArray) -> FloatArray:
    """``shift`` (..., q), with each row whitened by ``factor``."""
    flat = shift.reshape(-1, len(factor)).T
    return np.asarray(solve_triangular(factor, flat, lower=True).T.reshape(shift.shape))


def body_evidence(measurement: Measurement, declared: Declared) -> BodyEvidence | None:
    """Evidence of the measured bodies of ``measurement``; None if it has none."""
    if not measurement.bodies:
        return None
    found = _evidence(measurement, declared, measurement.bodies)
    found.set_up(one.name for one in declared.effects)
    return found


def wanted_bodies(measurement: Measurement, declared: Declared, answers: Sequence[ActingModel]) -> BodyEvidence | None:
    """Measurements of single bodies, not made yet, in which ``answers`` differ; None if there are none.

    Standard errors are the usual ones of each quantity.
    """
    known = {(one.body, one.quantity) for one in measurement.bodies}
    # With a mean of one the relative error equals the error.
    rows = [
        MeasuredBody(body.name, name, 1.0, quantity.usual)
        for body in measurement.fit[0].scene.bodies
        for name, quantity in QUANTITIES.items()
        if (body.name, name) not in known
    ]
    if not rows:
        return None
    full = _evidence(measurement, declared, rows)
    kept = [row for row, tells in zip(rows, full.told_apart(answers), strict=True) if tells]
    return replace(_evidence(measurement, declared, kept), off=np.zeros(len(kept))) if kept else None


def _evidence(measurement: Measurement, declared: Declared, rows: Sequence[MeasuredBody]) -> BodyEvidence:
    scene = measurement.fit[0].scene
    errors = np.array([one.deviation for one in rows])
    levels = [(p, p.within(p.middle - p.deviation), p.within(p.middle + p.deviation)) for p in declared.parameters]
    sides = [with_values(scene, {p.name: level}) for p, *both in levels for level in both]
    still, *moved = body_numbers([scene, *sides], rows)
    shifts = (np.array(moved).reshape(-1, 2, len(rows)) - still) / errors
    slopes, bends = (np.zeros((len(rows), len(levels))) for _ in range(2))
    for k, ((p, low, high), (below, above)) in enumerate(zip(levels, shifts, strict=True)):
        slopes[:, k], bends[:, k] = _parabola(
            (p.middle - low) / p.deviation, below, (high - p.middle) / p.deviation, above
        )
    # The line misses κ θ² of y = K θ + κ θ², whose mean square is Σᵢⱼ κᵢ κⱼᵀ + 2 Σᵢ κᵢ κᵢᵀ.
    noise = np.eye(len(rows)) + np.outer(bends.sum(axis=1), bends.sum(axis=1)) + 2.0 * bends @ bends.T
    factor = np.asarray(np.linalg.cholesky(noise + slopes @ slopes.T), dtype=np.float64)
    off = solve_triangular(factor, (np.array([one.value for one in rows]) - still) / errors, lower=True)
    return BodyEvidence(scene, tuple(rows), off, slopes, noise, factor, declared.effects)


def _parabola(a: float, below: FloatArray, b: float, above: FloatArray) -> tuple[FloatArray, FloatArray]:
    """K and κ of y = K θ + κ θ² through y(−a) = ``below`` and y(b) = ``above``; a line where a side is cut off."""
    if min(a, b) <= 0.0:
        return (above / b if b > 0.0 else -below / a), np.zeros_like(below)
    return (above * a**2 - below * b**2) / (a * b * (a + b)), (above * a + below * b) / (a * b * (a + b))


@dataclass(frozen=True)
class BodyRow(Record):
    """A number of single bodies, SI: as measured, in the declared model, and in the final model."""

    body: str
    quantity: str
    unit: str
    mean: float
    standard_error: float
    declared: float
    final: float


def body_rows(scene: Scene, measured: Sequence[MeasuredBody], acting: Mapping[str, Sequence[float]]) -> list[BodyRow]:
    """``measured`` compared with the declared ``scene``, and with that scene under effects ``acting`` (amplitudes)."""
    final = with_values(
        scene, {path: x for name, one in acting.items() for path, x in effect_values(name, one).items()}
    )
    both = zip(measured, *bodies_of([scene, final], measured).tolist(), strict=True)
    return [
        BodyRow(
            one.body, one.quantity, QUANTITIES[one.quantity].unit, one.mean, one.standard_error, declared, with_effects
        )
        for one, declared, with_effects in both
    ]
