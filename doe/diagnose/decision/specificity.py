"""Is a pair of effects specific? Two free amplitudes out of many pairs can follow almost any shift of few summaries.

The chance that a shift in a random direction, as long as the residual of the base model, would be explained by some
pair at least as well as the data are by the best one. Directions are uniform in the whitened space off the calibration
directions; every effect is its signature with an amplitude of the allowed sign.
"""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import numpy.typing as npt

from doe.diagnose.decision.gates import Gate, Limits
from doe.diagnose.decision.verdict import Signature
from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.fitting.calibrate import Fit
from doe.diagnose.fitting.signatures import Whitening

FloatArray = npt.NDArray[np.float64]

DIRECTIONS = 4000


def specific(
    emulator: Emulator,
    base: Fit,
    pair: Fit,
    label: str,
    signatures: Signature,
    frame: Whitening,
    limits: Limits,
    seed: int,
) -> Gate:
    """Return the gate: passed where the chance is at most limits.chance. An effect with two amplitudes counts as one of
    either sign.
    """
    generator = np.random.default_rng(seed)
    size, summaries = len(frame.projector), sum(len(block) for block in frame.factors)
    drawn = np.zeros((DIRECTIONS, size))
    drawn[:, :summaries] = generator.standard_normal((DIRECTIONS, summaries))
    drawn = drawn @ frame.projector
    drawn *= math.sqrt(base.t2) / np.linalg.norm(drawn, axis=1)[:, None]
    bounds = {effect.name: min(effect.low) for effect in emulator.declared.effects}
    two_sided = np.array([bounds[name] < 0 for name in signatures.names])
    along = drawn @ signatures.vectors.T
    explained = best_pair_share(np.where(two_sided, np.abs(along), along), along, signatures.cosines, two_sided)
    chance = float((base.t2 - explained <= pair.t2).mean())
    statement = f"{100 * chance:.1f} % of random shifts of this size are explained as well by some pair"
    return Gate(f"specific: {label}", chance, None, limits.chance, chance <= limits.chance, statement)


def best_pair_share(
    sizes: FloatArray, along: FloatArray, cosines: FloatArray, two_sided: npt.NDArray[np.bool_]
) -> FloatArray:
    """Return the squared length that the best pair explains, (N,), under the signs allowed.

    along: (N, E) components along the unit signatures; sizes: the same, absolute where either sign is allowed.
    Both amplitudes free: (c_i^2 + c_j^2 - 2 g c_i c_j)/(1 - g^2); where one has the wrong sign, the other one alone.
    """
    best = np.zeros(len(along))
    for i, j in combinations(range(along.shape[1]), 2):
        g = cosines[i, j]
        one, other = along[:, i], along[:, j]
        alone = np.maximum(np.maximum(sizes[:, i], sizes[:, j]), 0.0) ** 2
        free = max(1 - g * g, 1e-9)
        allowed = ((one - g * other >= 0) | two_sided[i]) & ((other - g * one >= 0) | two_sided[j])
        both = (one**2 + other**2 - 2 * g * one * other) / free
        best = np.maximum(best, np.where(allowed, both, alone))
    return best
