"""What is true of one made-up laboratory, drawn by its number: parameters within their measured uncertainty, and what
acts that the declared model lacks.

A truth's strength is the length of its projected, whitened shift of the summaries (`fitting/signatures.py`), in
standard errors of a data set of ``REPLICATES`` pours. The emulator's own error is no part of that standard error, so
that a strength means the same however much was simulated. Where an effect's own pours stray (`emulation/block.py`),
that is noise, for nobody can say beforehand how far they go in one data set.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulation.emulator import Emulator, fit_emulator
from doe.diagnose.fitting.calibrate import priors
from doe.diagnose.fitting.signatures import Whitening, cosine, noise_square, projected, shift_of, whitening_at
from doe.diagnose.runs import BASE, Declared, Effect, Observed, Runs, select_summaries
from doe.diagnose.simulation.plan import directions
from doe.validation.schedule import Case

FloatArray = npt.NDArray[np.float64]

REPLICATES = 6
ROOT = 1
"""Root of every random number of the laboratories; that of the emulator's pours is 0."""
DISTINCT = 0.9
"""Cosine of their signatures up to which two effects are made a pair: two that look alike are one to any data."""


@dataclass(frozen=True)
class Truth:
    """``case``: what was asked for. ``theta`` and the amplitudes of ``effects`` in natural units.

    ``missing``: why there is no such truth (``effects`` is empty then), else "".
    """

    case: Case
    theta: tuple[float, ...]
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()
    missing: str = ""


@dataclass(frozen=True)
class Ruler:
    """Measures shifts in standard errors of a data set. ``declared``: with the ranges that were simulated.

    ``widest``: the effects as far as the literature goes.
    """

    emulator: Emulator
    declared: Declared
    widest: tuple[Effect, ...]

    def frame(self, theta: FloatArray, stray: Sequence[FloatArray] | None = None) -> Whitening:
        """Whitening by the noise of ``REPLICATES`` pours, and projection, at coded parameters (k,).

        ``stray``: per condition (d_c,), variance beyond noise.
        """
        noise = [block.noise.covariance / REPLICATES for block in self.emulator.blocks]
        if stray is not None:
            noise = [covariance + np.diag(more) for covariance, more in zip(noise, stray, strict=True)]
        return whitening_at(self.emulator.predictor(()), theta, noise, priors(self.declared)[1])

    def coded(self, theta: Sequence[float]) -> FloatArray:
        """Parameters in natural units → coded, within the sampled box."""
        return np.clip(self.declared.coded(np.array(theta)), self.emulator.theta_low, self.emulator.theta_high)

    def within(self, effect: int, amplitude: FloatArray) -> FloatArray:
        """Coded amplitudes (m,) within what was simulated."""
        return np.clip(amplitude, self.emulator.low[effect], self.emulator.high[effect])

    def shift(self, effect: int, theta: FloatArray, amplitude: FloatArray) -> float:
        """Shift [σ] by an effect at coded amplitudes (m,), freed from what the emulator's error adds on average."""
        level = float(amplitude @ amplitude)
        stray = [level * np.where(b.straying[effect], b.excess[effect], 0.0) for b in self.emulator.blocks]
        frame = self.frame(theta, stray)
        z = projected(frame, shift_of(self.emulator, effect, theta, amplitude))
        square = float(z @ z) - noise_square(self.emulator, effect, frame, theta, amplitude)
        return math.sqrt(max(0.0, square))

    def seen(self, theta: Sequence[float], means: FloatArray) -> float:
        """Shift [σ] of the measured means (D,) off the base model at the true parameters, freed from noise."""
        x = self.coded(theta)
        frame, predictor = self.frame(x), self.emulator.predictor(())
        z = projected(frame, means - predictor.mean(x))
        size, first = len(frame.projector), 0
        covariance = np.zeros((size, size))
        for factor, error in zip(frame.factors, predictor.mean_covariance(x), strict=True):
            last = first + len(factor)
            covariance[first:last, first:last] = np.eye(len(factor)) + factor @ error @ factor.T
            first = last
        return float(np.sqrt(max(0.0, z @ z - np.trace(frame.projector @ covariance))))


def ruler(declared: Declared, runs: Runs, widest: tuple[Effect, ...]) -> Ruler:
    """The ruler of the emulator's runs. Summaries that never vary in the base model are left out."""
    base = [block[(runs.effect == BASE) & runs.simulated(c)][:REPLICATES] for c, block in enumerate(runs.blocks)]
    chosen = select_summaries(declared, runs, Observed(tuple(base), tuple(np.zeros(b.shape[1]) for b in base)))
    return Ruler(fit_emulator(chosen.declared, chosen.runs, chosen.floors), declared, widest)


def truth_of(case: Case, ruler: Ruler) -> Truth:
    """The truth of a case; with ``missing`` where an effect's range does not reach its strength."""
    rng = np.random.default_rng([ROOT, case.number])
    theta = drawn_theta(ruler.declared, rng)
    if case.kind in ("null", "outside"):
        return Truth(case, theta)
    coded = ruler.coded(theta)
    names = [effect.name for effect in ruler.declared.effects]
    if case.kind == "effect":
        found = amplitude_for(ruler, names.index(case.label), coded, case.strength, rng)
        if isinstance(found, str):
            return Truth(case, theta, missing=found)
        return Truth(case, theta, ((case.label, found),))
    return drawn_pair(case, theta, ruler, rng)


def drawn_theta(declared: Declared, rng: np.random.Generator) -> tuple[float, ...]:
    """Parameters drawn from their independent measurement, or over their range, within what is simulated."""
    return tuple(
        rng.uniform(p.low, p.high)
        if p.mean is None or p.sd is None
        else float(np.clip(rng.normal(p.mean, p.sd), p.low, p.high))
        for p in declared.parameters
    )


def amplitude_for(
    ruler: Ruler, e: int, theta: FloatArray, strength: float, rng: np.random.Generator
) -> tuple[float, ...] | str:
    """Amplitudes [natural units] at which effect ``e`` shifts by ``strength`` σ, in a direction drawn at random.

    The first crossing along the direction, by steps of a fiftieth and then by bisection. Where no direction reaches
    the strength, the reason: the literature's bounds, or the range that was simulated.
    """
    effect = ruler.declared.effects[e]
    if e not in ruler.emulator.simulated_effects:
        return "not simulated" if effect.unseen is None else "bounds"
    ways = directions(effect)
    for k in rng.permutation(len(ways)):
        direction = ruler.within(e, np.array(ways[k]) / effect.scale)
        shares = np.linspace(0.0, 1.0, 51)[1:]
        reached = [s for s in shares if ruler.shift(e, theta, s * direction) >= strength]
        if reached:
            low, high = reached[0] - shares[0], reached[0]
            for _ in range(30):
                middle = 0.5 * (low + high)
                enough = ruler.shift(e, theta, middle * direction) >= strength
                low, high = (low, middle) if enough else (middle, high)
            return tuple(float(x) for x in high * direction * effect.scale)
    return "bounds" if np.allclose(effect.high, ruler.widest[e].high) else "range"


def drawn_pair(case: Case, theta: tuple[float, ...], ruler: Ruler, rng: np.random.Generator) -> Truth:
    """Two effects of ``case.strength`` each, whose signatures differ."""
    coded = ruler.coded(theta)
    frame = ruler.frame(coded)
    found: list[tuple[str, tuple[float, ...], FloatArray]] = []
    for e in rng.permutation(len(ruler.declared.effects)):
        effect = ruler.declared.effects[e]
        amplitude = amplitude_for(ruler, int(e), coded, case.strength, rng)
        if isinstance(amplitude, str):
            continue
        z = projected(frame, shift_of(ruler.emulator, int(e), coded, np.array(amplitude) / effect.scale))
        if not found or abs(cosine(found[0][2], z)) <= DISTINCT:
            found.append((effect.name, amplitude, z))
        if len(found) == 2:
            return Truth(case, theta, tuple((name, a) for name, a, _ in found))
    return Truth(case, theta, missing="bounds")
