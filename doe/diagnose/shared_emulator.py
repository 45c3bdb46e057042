"""What the features of a pour would be under any effect at any amplitude: one Bayesian regression taught by all pours.

Features are whitened, z = W y with W Σ Wᵀ = I for the covariance Σ of one pour, and turned onto the principal axes of
the signatures. There the mean of k pours of effect e at a times its reference amplitude is, feature by feature,

    z = b + β_e a + γ_e (a² − a) + ε,    ε ~ N(0, 1/k)
    b flat,    β_e ~ N(0, v),    γ_e ~ N(0, (CURVATURE² v))

b is the base model, β_e a signature, γ_e how far the answer is from proportional. All pours are in one regression: the
base model is known better by what the effects do not move, and the errors that two models share are in both. What a
signature may be is learned from all of them (v, one variance along each principal axis): effects of a granular pour
move its features along few directions, and what a handful of pours shows in the others is mostly their scatter
(empirical Bayes; Efron & Morris 1973, doi 10.1080/01621459.1973.10481350). Of an eigenvalue of the signatures' scatter
only what exceeds the largest that noise alone makes, n (1 + √(D/m))² for m signatures of noise n in D features, counts
(Marchenko & Pastur 1967, doi 10.1070/SM1967v001n04ABEH001994).

Before all this each feature x of a pour becomes  s asinh((x − x̄)/(s σ)),  s = ``SQUASH``: counts and masses that are
zero in most pours of the base model reach hundreds of its variances under an effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.reference import SIDE, Blocks
from doe.diagnose.ruler import shrunk_covariance
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]

CURVATURE = 0.5
"""Expected share by which the answer at twice an amplitude is off twice the answer; of the reference pours of
``docs/limit.md`` half an amplitude gives 0.2 to 0.65 of a shift (mean 0.45)."""
SQUASH = 2.0
"""Standard deviations of a pour up to which a feature counts in full."""
FLOOR = 0.3
"""Share of the signatures' variance off the leading axes, where noise hides it, that is believed there."""
LEAST_VARIANCE = 1e-3
"""Of a signature along an axis, where its estimate comes out at nothing."""


@dataclass(frozen=True)
class Way:
    """One direction in which an effect can act. ``two_sided``: its mirror image is possible as well."""

    effect: str
    name: str
    two_sided: bool


@dataclass(frozen=True)
class Group:
    """Pours of the way numbered ``way`` at ``amplitude`` times its reference amplitude, by condition (n_c, d_c)."""

    way: int
    amplitude: float
    blocks: Blocks

    @property
    def pours(self) -> int:
        """The least number in a condition."""
        return min(map(len, self.blocks))


@dataclass(frozen=True)
class Squash:
    """Centre and standard deviation of the features of a condition, (d_c,)."""

    centre: FloatArray
    deviation: FloatArray

    def __call__(self, pours: FloatArray) -> FloatArray:
        """Features of pours, (n, d_c), with their far tails drawn in."""
        return np.asarray(SQUASH * np.arcsinh((pours - self.centre) / (SQUASH * self.deviation)), dtype=np.float64)


@dataclass(frozen=True)
class Emulator:
    """All models of a declared scene; D features in all conditions together, m ways.

    Attributes
    ----------
    ways
        Directions of effects.
    mean, covariance
        Of the coefficients (b, β_1 … β_m, γ_1 … γ_m) of every feature: (D, 1 + 2m) and (D, 1 + 2m, 1 + 2m).
    parameters
        Shift per standard deviation of each parameter's measurement, (D, k).
    freedom
        Degrees of freedom of Σ.
    squashes, whitening
        From the features of pours to z: by condition, and W (D, D) with its turn.
    """

    ways: tuple[Way, ...]
    mean: FloatArray
    covariance: FloatArray
    parameters: FloatArray
    freedom: int
    squashes: tuple[Squash, ...]
    whitening: FloatArray

    def seen(self, pours: Blocks) -> FloatArray:
        """Mean of ``pours``, z (D,)."""
        return _whitened(self.whitening, [squash(block) for squash, block in zip(self.squashes, pours, strict=True)])

    def base(self) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (D,) of what the base model gives."""
        return self.mean[:, 0], self.covariance[:, 0, 0]

    def at(self, way: int, amplitudes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Means and variances (n, D) of ``way`` at ``amplitudes`` (n,); of its mirror image at negative ones."""
        places = [0, 1 + way, 1 + len(self.ways) + way]
        curved = np.sign(amplitudes) * (amplitudes**2 - np.abs(amplitudes))
        rows = np.column_stack([np.ones_like(amplitudes), amplitudes, curved])
        covariance = self.covariance[:, places][:, :, places]
        return rows @ self.mean[:, places].T, np.einsum("ni,dij,nj->nd", rows, covariance, rows, optimize=True)


def emulated(
    base: Blocks, moved: Sequence[tuple[Blocks, Blocks]], ways: Sequence[Way], groups: Sequence[Group]
) -> Emulator:
    """The emulator taught by pours.

    Parameters
    ----------
    base
        Pours of the base model.
    moved
        Of each parameter, pours with it ``SIDE`` standard deviations below and above its mean.
    ways
        Directions of effects.
    groups
        Their pours, at least one group of every way.

    Returns
    -------
    The emulator.

    Raises
    ------
    StatisticsError
        Where a way has no pours, or a group or the base fewer than two in a condition.
    """
    for name, blocks in (("base", base), *((ways[group.way].name, group.blocks) for group in groups)):
        if (least := min(map(len, blocks))) < 2:
            raise StatisticsError(f"{name}: {least} pours in a condition that count; allowed: at least 2")
    missing = [way.name for number, way in enumerate(ways) if all(group.way != number for group in groups)]
    if missing:
        raise StatisticsError(f"{missing[0]}: no pours; allowed: at least 2 of every direction of an effect")
    squashes = tuple(_squash([base[c], *(group.blocks[c] for group in groups)]) for c in range(len(base)))

    def drawn_in(blocks: Blocks) -> Blocks:
        return tuple(squash(block) for squash, block in zip(squashes, blocks, strict=True))

    base, groups = drawn_in(base), [Group(one.way, one.amplitude, drawn_in(one.blocks)) for one in groups]
    whitening, freedom = _whitening([base, *(group.blocks for group in groups)])
    ground = _whitened(whitening, base)
    shifts = np.stack([_whitened(whitening, group.blocks) - ground for group in groups])
    numbers = np.array([group.pours for group in groups], dtype=np.float64)
    amplitudes = np.array([group.amplitude for group in groups])
    base_pours = min(map(len, base))
    first = [next(g for g, group in enumerate(groups) if group.way == number) for number in range(len(ways))]
    variances, axes = signature_prior(
        shifts[first] / amplitudes[first, None], (1.0 / numbers[first] + 1.0 / base_pours) / amplitudes[first] ** 2
    )
    whitening, shifts, ground = axes.T @ whitening, shifts @ axes, axes.T @ ground
    slopes = [
        (_whitened(whitening, drawn_in(high)) - _whitened(whitening, drawn_in(low))) / (2.0 * SIDE)
        for low, high in moved
    ]
    mean, covariance = regression(
        np.array([group.way for group in groups], dtype=np.int64),
        amplitudes,
        np.concatenate([[base_pours], numbers]),
        np.concatenate([ground[None], shifts + ground]),
        variances,
        len(ways),
    )
    sensitivity = np.column_stack(slopes) if slopes else np.zeros((len(ground), 0))
    return Emulator(tuple(ways), mean, covariance, sensitivity, freedom, squashes, whitening)


def signature_prior(signatures: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Prior variances v (D,) of ``signatures`` (m, D) of ``noise`` variance (m,) along their principal axes, and these.

    Axes are columns (D, D).
    """
    m, size = signatures.shape if signatures.size else (1, signatures.shape[1])
    level = float(noise.mean()) if noise.size else 0.0
    values, axes = np.linalg.eigh(signatures.T @ signatures / m)
    leading = np.maximum(values - level * (1.0 + np.sqrt(size / m)) ** 2, 0.0)
    rest = max(LEAST_VARIANCE, (float(values.sum()) - size * level - float(leading.sum())) / size)
    return leading + FLOOR * rest, axes


def regression(
    ways: npt.NDArray[np.int64],
    amplitudes: FloatArray,
    pours: FloatArray,
    means: FloatArray,
    variances: FloatArray,
    number: int,
) -> tuple[FloatArray, FloatArray]:
    """Mean (D, 1 + 2m) and covariance (D, 1 + 2m, 1 + 2m) of the coefficients of m = ``number`` ways.

    Parameters
    ----------
    ways, amplitudes
        Of each group, (g,).
    pours, means
        Of the base model and of each group: how many, (1 + g,), and the mean of their z, (1 + g, D).
    variances
        v, (D,).
    number
        m.
    """
    rows = np.zeros((len(pours), 1 + 2 * number))
    rows[:, 0] = 1.0
    groups = np.arange(len(ways))
    rows[1 + groups, 1 + ways] = amplitudes
    rows[1 + groups, 1 + number + ways] = amplitudes**2 - amplitudes
    precision = np.zeros((len(variances), 1 + 2 * number))
    precision[:, 1 : 1 + number] = 1.0 / variances[:, None]
    precision[:, 1 + number :] = 1.0 / (CURVATURE**2 * variances[:, None])
    weighted = rows.T * pours
    covariance = np.linalg.inv(weighted @ rows + precision[:, :, None] * np.eye(1 + 2 * number))
    mean = np.einsum("dij,jd->di", covariance, weighted @ means)
    return np.asarray(mean, dtype=np.float64), np.asarray(covariance, dtype=np.float64)


def _squash(groups: Sequence[FloatArray]) -> Squash:
    """By the mean of the first group, the base model's, and the deviations within all of them."""
    deviation = np.sqrt((_residuals(groups) ** 2).mean(axis=0))
    return Squash(groups[0].mean(axis=0), np.where(deviation > 0.0, deviation, 1.0))


def _whitening(groups: Sequence[Blocks]) -> tuple[FloatArray, int]:
    """W (D, D), block by condition, of pours of separate means, and the degrees of freedom."""
    sizes = [block.shape[1] for block in groups[0]]
    white = np.zeros((sum(sizes), sum(sizes)))
    first, freedom = 0, 1 << 30
    for c, size in enumerate(sizes):
        residuals = _residuals([blocks[c] for blocks in groups])
        covariance = shrunk_covariance(residuals)
        white[first : first + size, first : first + size] = np.linalg.inv(np.linalg.cholesky(covariance))
        first, freedom = first + size, min(freedom, len(residuals) - len(groups))
    return white, freedom


def _residuals(groups: Sequence[FloatArray]) -> FloatArray:
    # Each group's mean takes a degree of freedom.
    return np.concatenate([(g - g.mean(axis=0)) * np.sqrt(len(g) / (len(g) - 1)) for g in groups])


def _whitened(whitening: FloatArray, blocks: Sequence[FloatArray]) -> FloatArray:
    return np.asarray(whitening @ np.concatenate([block.mean(axis=0) for block in blocks]), dtype=np.float64)
