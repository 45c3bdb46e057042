"""What the features of a pour would be under any effect at any amplitude: one Bayesian regression taught by all pours.

Features are whitened, z = W y with W Σ Wᵀ = I for the covariance Σ of one pour, and turned onto the principal axes of
the signatures. There a pour with parameters θ [standard deviations of their measurements] and effect e at a times its
reference amplitude gives, feature by feature,

    z = b + J θ + Q (θ² − 1) + β_e a + γ_e (a² − a) + ε,    ε ~ N(0, 1 + x_e a)
    b, J flat,    Q ~ N(0, BEND² J²),    β_e ~ N(0, v),    γ_e ~ N(0, CURVATURE² v)

b is the base model, J what parameters do and Q how far that is from proportional, β_e a signature, γ_e how far the
answer is from proportional, x_e by how much an effect makes pours scatter more (one number for all features; bodies
that stick come down in lumps). All pours are in one regression: parameters are moved in every one of them, the base
model is known better by what the effects do not move, and the errors that two models share are in both. What a
signature may be is learned from all of them (v, one variance along each principal axis): effects of a granular pour
move its features along few directions, and what a handful of pours shows in the others is mostly their scatter
(empirical Bayes; Efron & Morris 1973, doi 10.1080/01621459.1973.10481350). Of an eigenvalue of the signatures' scatter
only what exceeds the largest that noise alone makes, n (1 + √(D/m))² for m signatures of noise n in D features, counts
(Marchenko & Pastur 1967, doi 10.1070/SM1967v001n04ABEH001994).

Before all this each feature x of a pour becomes  s asinh((x − x̄)/(s σ)),  s = ``SQUASH``: counts and masses that are
zero in most pours of the base model reach hundreds of its variances under an effect.

An effect with a direction in the plane is poured along +x, +y, −x and −y; between these its coefficients are the
trigonometric interpolation, exact for what answers as 1, cos φ, sin φ and cos 2φ (``planar_weights``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from doe.analysis.covariance import pooled_slopes, residuals_within, shrunk_covariance
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]

CURVATURE = 0.5
"""Expected share by which the answer at twice an amplitude is off twice the answer; of the reference pours of
``docs/limit.md`` half an amplitude gives 0.2 to 0.65 of a shift (mean 0.45)."""
BEND = 0.25
"""The same of a parameter. By the reference pours that of restitution is 0.2, and those of frictions are too small to
be told."""
SQUASH = 2.0
"""Standard deviations of a pour up to which a feature counts in full."""
FLOOR = 0.3
"""Share of the signatures' variance off the leading axes, where noise hides it, that is believed there."""
LEAST_VARIANCE = 1e-3
"""Of a signature along an axis, where its estimate comes out at nothing."""
SCALES = np.geomspace(0.003, 3.0, 31)
"""Sizes of a signature's variance beside that of all of them that are tried."""
FEW_POURS = 2.0
"""Pours at the reference amplitude for which the belief counts that an effect leaves the scatter of a pour as it is."""
SCATTERS = (0.5, 4.0)
"""Range of the variance of a pour under an effect over that of the base model's."""
FLAT = 1e-9
"""Prior precision of what nothing is assumed of."""
ANGLES = (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)
"""Directions [rad] in the plane in which an effect with two amplitudes is poured."""


@dataclass(frozen=True)
class Way:
    """One direction in which an effect can act.

    Attributes
    ----------
    effect, name
        The effect's name, and that with its sign or axis.
    unit
        Reference amplitude [natural units].
    most
        Multiple of it up to which the literature supports the effect.
    angle
        Direction in the plane, one of ``ANGLES``; None of an effect with one amplitude.
    """

    effect: str
    name: str
    unit: tuple[float, ...] = (1.0,)
    most: float = math.inf
    angle: float | None = None


@dataclass(frozen=True)
class Lessons:
    """Pours that teach, of which every condition came to a valid end and could be read.

    Attributes
    ----------
    theta
        Parameters [standard deviations from their means], (n, k).
    way, amplitude
        Number of the way that acts, −1 for the base model, and multiple of its reference amplitude, (n,).
    own
        Which of them count for the covariance of a pour, (n,): not another one of them that is looked at otherwise.
    blocks
        Features by condition, (n, d_c).
    """

    theta: FloatArray
    way: npt.NDArray[np.int64]
    amplitude: FloatArray
    own: npt.NDArray[np.bool_]
    blocks: tuple[FloatArray, ...]

    def __len__(self) -> int:
        return len(self.way)

    def joined(self, other: Lessons) -> Lessons:
        """These and ``other``."""
        return Lessons(
            np.concatenate([self.theta, other.theta]),
            np.concatenate([self.way, other.way]),
            np.concatenate([self.amplitude, other.amplitude]),
            np.concatenate([self.own, other.own]),
            tuple(np.concatenate(pair) for pair in zip(self.blocks, other.blocks, strict=True)),
        )

    def only(self, columns: Sequence[npt.NDArray[np.int64]]) -> Lessons:
        """The same with the features ``columns`` of each condition."""
        kept = tuple(block[:, some] for block, some in zip(self.blocks, columns, strict=True))
        return replace(self, blocks=kept)

    def where(self, rows: npt.NDArray[np.bool_]) -> Lessons:
        """Those of the pours."""
        blocks = tuple(block[rows] for block in self.blocks)
        return Lessons(self.theta[rows], self.way[rows], self.amplitude[rows], self.own[rows], blocks)

    def groups(self) -> npt.NDArray[np.int64]:
        """Number of the group, pours of one way at one amplitude, that each pour belongs to, (n,)."""
        pairs = np.column_stack([self.way, self.amplitude])
        return np.asarray(np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1), dtype=np.int64)


@dataclass(frozen=True)
class Squash:
    """Centre and standard deviation of the features of a condition, (d_c,)."""

    centre: FloatArray
    deviation: FloatArray

    def __call__(self, pours: FloatArray) -> FloatArray:
        """Features of pours, (n, d_c), with their far tails drawn in."""
        return np.asarray(SQUASH * np.arcsinh((pours - self.centre) / (SQUASH * self.deviation)), dtype=np.float64)

    def slope(self, pours: FloatArray) -> FloatArray:
        """Derivative at ``pours``."""
        x = (pours - self.centre) / (SQUASH * self.deviation)
        return np.asarray(1.0 / (self.deviation * np.sqrt(1.0 + x**2)), dtype=np.float64)


@dataclass(frozen=True)
class Emulator:
    """All models of a declared scene; D features in all conditions together, k parameters, m ways.

    Attributes
    ----------
    ways
        Directions of effects.
    parameters
        k.
    mean, covariance
        Of the c coefficients (b, J, β_1 … β_m, γ_1 … γ_m, Q) of every feature: (D, c = 1 + 2k + 2m) and (D, c, c).
    information
        Xᵀ X of the pours that taught it, (c, c).
    freedom
        Degrees of freedom of Σ.
    squashes, whitening
        From the features of pours to z: by condition, and W (D, D) with its turn.
    reached
        Largest multiple of its reference amplitude at which each way was poured.
    excess
        x, by how much the variance of a pour grows per reference amplitude of each way, (m,).
    """

    ways: tuple[Way, ...]
    parameters: int
    mean: FloatArray
    covariance: FloatArray
    information: FloatArray
    freedom: int
    squashes: tuple[Squash, ...]
    whitening: FloatArray
    reached: tuple[float, ...]
    excess: FloatArray

    def seen(self, pours: Sequence[FloatArray], weights: Sequence[FloatArray] | None = None) -> FloatArray:
        """Mean of ``pours``, z (D,), of the same weight or of ``weights`` in each condition."""
        weights = [np.ones(len(block)) for block in pours] if weights is None else weights
        of_all = zip(self.squashes, pours, weights, strict=True)
        means = [np.average(squash(block), axis=0, weights=some) for squash, block, some in of_all]
        return np.asarray(self.whitening @ np.concatenate(means), dtype=np.float64)

    def whitened(self, condition: int, pours: FloatArray) -> FloatArray:
        """What ``pours`` (n, d_c) in a condition contribute to z, (n, D)."""
        sizes = [len(squash.centre) for squash in self.squashes]
        first = sum(sizes[:condition])
        return np.asarray(self.squashes[condition](pours) @ self.whitening[:, first : first + sizes[condition]].T)

    def features(self, z: FloatArray) -> FloatArray:
        """Features (..., D) of all conditions, natural units, that ``z`` (..., D) stands for."""
        drawn_in = np.linalg.solve(self.whitening, np.atleast_2d(z).T).T
        centre = np.concatenate([squash.centre for squash in self.squashes])
        deviation = np.concatenate([squash.deviation for squash in self.squashes])
        return np.asarray(centre + SQUASH * deviation * np.sinh(drawn_in / SQUASH)).reshape(z.shape)

    @property
    def slopes(self) -> FloatArray:
        """J, what each parameter does per standard deviation of its measurement, (D, k)."""
        return self.mean[:, 1 : 1 + self.parameters]

    @property
    def bends(self) -> FloatArray:
        """Q, (D, k)."""
        return self.mean[:, 1 + self.parameters + 2 * len(self.ways) :]

    def moved(self, theta: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What parameters ``theta`` (n, k) do and its variance, (n, D), and by which slopes, (n, D, k)."""
        own, first = np.diagonal(self.covariance, axis1=1, axis2=2), 1 + self.parameters + 2 * len(self.ways)
        # Of J that of θ ~ N(0, I), so that no model gains by a small θ.
        variance = own[:, 1 : 1 + self.parameters].sum(axis=1) + (theta**2 - 1.0) ** 2 @ own[:, first:].T
        slopes = self.slopes + 2.0 * theta[:, None, :] * self.bends
        return theta @ self.slopes.T + (theta**2 - 1.0) @ self.bends.T, variance, slopes

    def row(self, acting: Mapping[int, float] | None = None) -> FloatArray:
        """The row of the regression in which ways act at amplitudes ``acting``, parameters at their means."""
        return self.weighted_row([({way: 1.0}, amplitude) for way, amplitude in (acting or {}).items()])

    def weighted_row(self, acting: Sequence[tuple[Mapping[int, float], float]]) -> FloatArray:
        """The row in which weighted means of ways act at an amplitude each."""
        first, m = 1 + self.parameters, len(self.ways)
        row = np.zeros(self.mean.shape[1])
        row[0] = 1.0
        for weights, a in acting:
            for way, weight in weights.items():
                row[first + way] += weight * a
                row[first + m + way] += weight * (a**2 - a)
        return row

    def placed(self, rows: FloatArray, theta: FloatArray) -> FloatArray:
        """``rows`` with the parameters at ``theta`` (n, k)."""
        first, last = 1 + self.parameters, 1 + self.parameters + 2 * len(self.ways)
        return np.concatenate([rows[:, :1], theta, rows[:, first:last], theta**2 - 1.0], axis=1)

    def at(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Means and variances of z, (n, D) each, for ``rows`` of the regression."""
        used = np.flatnonzero(np.any(rows != 0.0, axis=0))
        first, second = np.triu_indices(len(used))
        # Cᵢⱼ and Cⱼᵢ at once, in one product of matrices.
        both = self.covariance[:, used[first], used[second]] * np.where(first == second, 1.0, 2.0)
        some = rows[:, used]
        return some @ self.mean[:, used].T, (some[:, first] * some[:, second]) @ both.T

    def scatter(self, rows: FloatArray) -> FloatArray:
        """Sum over z of the covariance (n, n) of the means for ``rows`` between sets of as many teaching pours."""
        gained = rows @ self.covariance
        return np.einsum("dni,ij,dmj->nm", gained, self.information, gained, optimize=True)

    def noise(self, rows: FloatArray) -> FloatArray:
        """Variance of a pour, (n,), for ``rows`` of the regression; 1 of the base model."""
        return noise_of(rows[:, 1 + self.parameters : 1 + self.parameters + len(self.ways)], self.excess)


def planar_weights(angle: float) -> dict[float, float]:
    """Weights of the directions ``ANGLES`` in an effect that acts towards ``angle`` [rad]."""
    c, s, second = math.cos(angle), math.sin(angle), 0.25 * math.cos(2.0 * angle)
    return dict(
        zip(
            ANGLES,
            (0.25 + 0.5 * c + second, 0.25 + 0.5 * s - second, 0.25 - 0.5 * c + second, 0.25 - 0.5 * s - second),
            strict=True,
        )
    )


def emulated(
    lessons: Lessons, ways: Sequence[Way], weights: Sequence[float] | None = None, shrunk: bool = True
) -> Emulator:
    """The emulator taught by pours.

    Parameters
    ----------
    lessons
        Pours of the base model and at least two of every way.
    ways
        Directions of effects.
    weights
        By condition, pours of the data there over their mean over the conditions; 1 where they are as many everywhere.
        A condition with more pours of data counts for more.
    shrunk
        Whether v is learned axis by axis. That tells effects apart best, and underrates what each does; without it v is
        the whole variance of the signatures along every axis, as becomes an effect that many pours have taught.

    Returns
    -------
    The emulator.

    Raises
    ------
    StatisticsError
        Where the base model or a way has fewer than two pours.
    """
    names = ["base", *(way.name for way in ways)]
    for number, name in enumerate(names, start=-1):
        if (count := int((lessons.way == number).sum())) < 2:
            raise StatisticsError(f"{name}: {count} pours valid in every condition; allowed: at least 2")
    k, m = lessons.theta.shape[1], len(ways)
    base, own = lessons.way == -1, lessons.where(lessons.own)
    squashes = tuple(_squash(own, c) for c in range(len(lessons.blocks)))
    drawn_in = [squash(block) for squash, block in zip(squashes, lessons.blocks, strict=True)]
    whitening, freedom = _whitening([block[lessons.own] for block in drawn_in], own, weights)
    z = np.concatenate(drawn_in, axis=1) @ whitening.T
    slopes = pooled_slopes(z, lessons.groups(), lessons.theta)
    shift = z - lessons.theta @ slopes
    shift -= shift[base].mean(axis=0)
    # a β_e of least squares through the origin, way by way, and the variance of its noise.
    square = np.array([(lessons.amplitude[lessons.way == w] ** 2).sum() for w in range(m)])
    signatures = np.stack([lessons.amplitude[lessons.way == w] @ shift[lessons.way == w] for w in range(m)] or [z[0]])
    noise = 1.0 / square + 1.0 / base.sum() if m else np.ones(1)
    signatures = signatures / square[:, None] if m else 0.0 * signatures
    variances, axes = signature_prior(signatures, noise)
    scales = signature_scales(signatures @ axes, noise, variances) if m else np.zeros(0)
    if not shrunk:
        variances, scales = np.full_like(variances, variances.sum()), np.ones(m)
    rows = np.zeros((len(lessons), 1 + 2 * k + 2 * m))
    rows[:, 0], rows[:, 1 : 1 + k], rows[:, 1 + k + 2 * m :] = 1.0, lessons.theta, lessons.theta**2 - 1.0
    acting = np.flatnonzero(~base)
    a = lessons.amplitude[acting]
    rows[acting, 1 + k + lessons.way[acting]] = a
    rows[acting, 1 + k + m + lessons.way[acting]] = a**2 - a
    excess = _excess(z, lessons, m)
    spread = np.sqrt(noise_of(rows[:, 1 + k : 1 + k + m], excess))[:, None]
    rows = rows / spread
    mean, covariance = regression(rows, z @ axes / spread, (slopes**2).mean(axis=1), variances, scales)
    reached = tuple(float(lessons.amplitude[lessons.way == w].max()) for w in range(m))
    turned = axes.T @ whitening
    return Emulator(tuple(ways), k, mean, covariance, rows.T @ rows, freedom, squashes, turned, reached, excess)


def noise_of(amplitudes: FloatArray, excess: FloatArray) -> FloatArray:
    """Variance of pours, (n,), in which the ways act at ``amplitudes`` (n, m)."""
    return np.asarray(np.clip(1.0 + amplitudes @ excess, *SCATTERS), dtype=np.float64)


def _excess(z: FloatArray, lessons: Lessons, ways: int) -> FloatArray:
    """x (m,) by least squares of the pours' squared deviations within their groups, drawn towards 0."""
    group = lessons.groups()
    several = (np.bincount(group) > 1)[group]
    square = (residuals_within(z, group, lessons.theta) ** 2).mean(axis=1)
    way, amplitude = lessons.way[several], lessons.amplitude[several]
    more = square / square[way == -1].mean() - 1.0
    found = np.zeros(ways)
    for number in range(ways):
        a = amplitude[way == number]
        found[number] = float(a @ more[way == number]) / (float(a @ a) + FEW_POURS)
    return found


def signature_prior(signatures: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Prior variances v (D,) of ``signatures`` (m, D) of ``noise`` variance (m,) along their principal axes, and these.

    Axes are columns (D, D).
    """
    m, size = signatures.shape
    level = float(noise.mean())
    values, axes = np.linalg.eigh(signatures.T @ signatures / m)
    leading = np.maximum(values - level * (1.0 + np.sqrt(size / m)) ** 2, 0.0)
    rest = max(LEAST_VARIANCE, (float(values.sum()) - size * level - float(leading.sum())) / size)
    return leading + FLOOR * rest, axes


def signature_scales(signatures: FloatArray, noise: FloatArray, variances: FloatArray) -> FloatArray:
    """s (m,): how large each of ``signatures`` (m, D), along the axes of ``variances`` (D,), is beside the others.

    That of the largest likelihood of β̂ ~ N(0, s v + noise). What hardly does anything at the end of its range, as
    twisting friction under a pile of small bodies, would else keep the freedom of what does much, and agree with data
    of the base model better than the base model by the noise of its own pours.
    """
    square = signatures[:, None] ** 2
    total = SCALES[None, :, None] * variances + noise[:, None, None]
    likelihood = -0.5 * (np.log(total) + square / total).sum(axis=2)
    return np.asarray(SCALES[likelihood.argmax(axis=1)], dtype=np.float64)


def regression(
    rows: FloatArray, z: FloatArray, slopes: FloatArray, variances: FloatArray, scales: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean (D, c) and covariance (D, c, c) of the c = 1 + 2k + 2m coefficients of every feature.

    Parameters
    ----------
    rows, z
        Of each pour, (n, c) and (n, D).
    slopes
        Mean square of J over the features, (k,).
    variances, scales
        v (D,) and s (m,).
    """
    columns, m, first = rows.shape[1], len(scales), 1 + len(slopes)
    precision = np.full((len(variances), columns), FLAT)
    own = 1.0 / (variances[:, None] * scales)
    precision[:, first : first + m] = own
    precision[:, first + m : first + 2 * m] = own / CURVATURE**2
    precision[:, first + 2 * m :] = 1.0 / (BEND**2 * np.maximum(slopes, LEAST_VARIANCE))
    covariance = np.linalg.inv(rows.T @ rows + precision[:, :, None] * np.eye(columns))
    mean = np.einsum("dij,jd->di", covariance, rows.T @ z, optimize=True)
    return np.asarray(mean, dtype=np.float64), np.asarray(covariance, dtype=np.float64)


def _squash(own: Lessons, condition: int) -> Squash:
    """By the mean of the base model's pours, and the deviations within all groups."""
    block = own.blocks[condition]
    deviation = np.sqrt((residuals_within(block, own.groups(), own.theta) ** 2).mean(axis=0))
    return Squash(block[own.way == -1].mean(axis=0), np.where(deviation > 0.0, deviation, 1.0))


def _whitening(drawn_in: Sequence[FloatArray], own: Lessons, weights: Sequence[float] | None) -> tuple[FloatArray, int]:
    """W (D, D), block by condition, and the degrees of freedom."""
    group = own.groups()
    covariances = [shrunk_covariance(residuals_within(block, group, own.theta)) for block in drawn_in]
    white = block_diag(*(np.linalg.inv(np.linalg.cholesky(one)) for one in covariances))
    if weights:
        white *= np.sqrt(np.repeat(weights, [len(one) for one in covariances]))[:, None]
    several = np.bincount(group) > 1
    return white, max(1, int(several[group].sum()) - int(several.sum()) - own.theta.shape[1])
