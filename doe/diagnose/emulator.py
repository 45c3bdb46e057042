"""Emulator: one Bayesian regression on all pours predicts the features of a pour under any effect at any amplitude.

Features are whitened, z = W y with W Σ Wᵀ = I for the covariance Σ of one pour, and rotated onto the principal axes of
the signatures. There, for a pour with parameters θ [standard deviations of their measurements] and effect e at a times
its reference amplitude, each feature is

    z = b + J θ + Q (θ² − 1) + β_e a + γ_e (a² − a) + ε,    ε ~ N(0, n (1 + x_e a))
    b, J flat,    Q ~ N(0, BEND² J²),    β_e ~ N(0, v),    γ_e ~ N(0, CURVATURE² v)

b is the base model, J the linear response to the parameters and Q its departure from linearity; β_e is the signature of
the effect, γ_e the departure of its response from proportionality, and x_e the excess scatter of pours under the effect
(one number for all features; bodies that stick come down in lumps). All pours enter one regression: parameters vary in
every pour, the base model is known better through features that the effects do not move, and errors that two models
share appear in both. The prior variance v of a signature is learned from all signatures, one variance along each
principal axis (``doe/analysis/empirical_bayes.py``): effects of a granular pour move its features along few directions,
and along the others a handful of pours shows mostly scatter. A condition with more measured pours than the others has
more weight in z, and its pours more variance: that of a pour along an axis is n = Σ w_i A_i² for weights w and axis A.
Views of one pour, displaced or turned, share part of its noise (``doe/analysis/clusters.py``).

Before all this each feature x of a pour becomes  s asinh((x − x̄)/(s σ)),  s = ``SQUASH``, because counts and masses
that are zero in most pours of the base model reach hundreds of its variances under an effect.

An effect with a direction in the plane is poured along +x, +y, −x and −y. Between these its coefficients are found by
trigonometric interpolation, exact for responses in 1, cos φ, sin φ and cos 2φ (``planar_weights``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from doe.analysis.clusters import decorrelated, intraclass_correlation
from doe.analysis.covariance import pooled_slopes, residuals_within, shrunk_covariance
from doe.analysis.empirical_bayes import LEAST_VARIANCE, prior_along_axes, relative_sizes
from doe.analysis.squash import Squash, squash_of
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]

CURVATURE = 0.5
"""Expected relative departure of the response at twice an amplitude from twice the response. In the reference pours of
``docs/limit.md`` half an amplitude gives 0.2 to 0.65 of a shift (mean 0.45)."""
BEND = 0.25
"""The same for a parameter. In the reference pours it is 0.2 for restitution, and too small to be measured for the
frictions."""
FEW_POURS = 2.0
"""Weight of the prior belief that an effect leaves the scatter unchanged [pours at the reference amplitude]."""
SCATTERS = (0.5, 4.0)
"""Range of the ratio of a pour's variance under an effect to that of a base-model pour."""
FLAT = 1e-9
"""Prior precision of coefficients with a flat prior."""
FAR = 1.6
"""Distance of a parameter from its mean [standard deviations] beyond which a pour shares no mean with nearer ones."""
ANGLES = (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)
"""Directions [rad] in the plane in which an effect with two amplitudes is poured."""


@dataclass(frozen=True)
class Way:
    """One direction in which an effect can act.

    Attributes
    ----------
    effect, name
        The effect's name, and the same with its sign or axis.
    unit
        Reference amplitude [natural units].
    most
        Largest multiple of ``unit`` that the literature supports.
    angle
        Direction in the plane, one of ``ANGLES``; None for an effect with one amplitude.
    """

    effect: str
    name: str
    unit: tuple[float, ...] = (1.0,)
    most: float = math.inf
    angle: float | None = None


@dataclass(frozen=True)
class Lessons:
    """Training pours that came to a valid end and could be read in every condition.

    Attributes
    ----------
    theta
        Parameters [standard deviations from their means], (n, k).
    way, amplitude
        Index of the way that acts, −1 for the base model, and multiple of its reference amplitude, (n,).
    pour
        Number of the pour, (n,); equal for views of one pour.
    blocks
        Features by condition, (n, d_c).
    """

    theta: FloatArray
    way: npt.NDArray[np.int64]
    amplitude: FloatArray
    pour: npt.NDArray[np.int64]
    blocks: tuple[FloatArray, ...]

    def __len__(self) -> int:
        return len(self.way)

    def only(self, columns: Sequence[npt.NDArray[np.int64]]) -> Lessons:
        """Return the pours with only the features ``columns`` of each condition."""
        kept = tuple(block[:, some] for block, some in zip(self.blocks, columns, strict=True))
        return replace(self, blocks=kept)

    def where(self, rows: npt.NDArray[np.bool_]) -> Lessons:
        """Return the pours selected by ``rows``."""
        blocks = tuple(block[rows] for block in self.blocks)
        return Lessons(self.theta[rows], self.way[rows], self.amplitude[rows], self.pour[rows], blocks)

    @property
    def own(self) -> npt.NDArray[np.bool_]:
        """Whether a pour is not another view of an earlier one, (n,)."""
        return np.asarray(np.isin(np.arange(len(self)), np.unique(self.pour, return_index=True)[1]))

    @property
    def near(self) -> npt.NDArray[np.bool_]:
        """Whether a pour is of the base model with no parameter far off, (n,)."""
        return np.asarray((self.way == -1) & (np.abs(self.theta) <= FAR).all(axis=1))

    def groups(self) -> npt.NDArray[np.int64]:
        """Index of each pour's group, (n,): pours of one way at one amplitude, with the same parameters far off."""
        keys = np.column_stack([self.way, self.amplitude, np.sign(self.theta) * (np.abs(self.theta) > FAR)])
        return np.asarray(np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1), dtype=np.int64)


@dataclass(frozen=True)
class Emulator:
    """All models of a declared scene, with D features in all conditions together, k parameters and m ways.

    Attributes
    ----------
    ways
        Directions of effects.
    parameters
        k.
    mean, covariance
        Of the c coefficients (b, J, β_1 … β_m, γ_1 … γ_m, Q) of every feature: (D, c = 1 + 2k + 2m) and (D, c, c).
    information
        Xᵀ X of the training pours with independent noise, (D, c, c).
    pour
        Variance of a base-model pour in every feature, (D,); 1 if all conditions have the same weight.
    freedom
        Degrees of freedom of Σ.
    squashes, whitening
        Map from the features of pours to z: tail compression by condition, then W (D, D) including the rotation.
    reached
        Largest multiple of its reference amplitude at which each way was poured.
    excess
        x, growth of the variance of a pour per reference amplitude of each way, (m,).
    """

    ways: tuple[Way, ...]
    parameters: int
    mean: FloatArray
    covariance: FloatArray
    information: FloatArray
    pour: FloatArray
    freedom: int
    squashes: tuple[Squash, ...]
    whitening: FloatArray
    reached: tuple[float, ...]
    excess: FloatArray

    def seen(self, pours: Sequence[FloatArray], weights: Sequence[FloatArray] | None = None) -> FloatArray:
        """Mean of ``pours`` as z (D,); ``weights`` of the pours in each condition are equal by default."""
        weights = [np.ones(len(block)) for block in pours] if weights is None else weights
        of_all = zip(self.squashes, pours, weights, strict=True)
        means = [np.average(squash(block), axis=0, weights=some) for squash, block, some in of_all]
        return np.asarray(self.whitening @ np.concatenate(means), dtype=np.float64)

    def whitened(self, condition: int, pours: FloatArray) -> FloatArray:
        """Contribution of ``pours`` (n, d_c) in one condition to z, (n, D)."""
        sizes = [len(squash.centre) for squash in self.squashes]
        first = sum(sizes[:condition])
        return np.asarray(self.squashes[condition](pours) @ self.whitening[:, first : first + sizes[condition]].T)

    def features(self, z: FloatArray) -> FloatArray:
        """Features (..., D) of all conditions, natural units, that correspond to ``z`` (..., D)."""
        drawn_in = np.asarray(np.linalg.solve(self.whitening, np.atleast_2d(z).T).T, dtype=np.float64)
        centre = np.concatenate([squash.centre for squash in self.squashes])
        deviation = np.concatenate([squash.deviation for squash in self.squashes])
        return Squash(centre, deviation).undone(drawn_in).reshape(z.shape)

    @property
    def slopes(self) -> FloatArray:
        """J, response to each parameter per standard deviation of its measurement, (D, k)."""
        return self.mean[:, 1 : 1 + self.parameters]

    @property
    def bends(self) -> FloatArray:
        """Q, departure of the response to each parameter from linearity, (D, k)."""
        return self.mean[:, 1 + self.parameters + 2 * len(self.ways) :]

    def moved(self, theta: FloatArray, square: FloatArray | float = 1.0) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Shift by parameters ``theta`` (n, k) and its variance, (n, D) each, and the slopes there, (n, D, k).

        ``square``: expected θ² (n, k), which the variance of J is multiplied by, so that no model gains by a small θ.
        """
        own, first = np.diagonal(self.covariance, axis1=1, axis2=2), 1 + self.parameters + 2 * len(self.ways)
        expected = np.broadcast_to(square, theta.shape)
        variance = expected @ own[:, 1 : 1 + self.parameters].T + (theta**2 - 1.0) ** 2 @ own[:, first:].T
        slopes = self.slopes + 2.0 * theta[:, None, :] * self.bends
        return theta @ self.slopes.T + (theta**2 - 1.0) @ self.bends.T, variance, slopes

    def row(self, acting: Mapping[int, float] | None = None) -> FloatArray:
        """Row of the regression for ways acting at the amplitudes ``acting``, with parameters at their means."""
        return self.weighted_row([({way: 1.0}, amplitude) for way, amplitude in (acting or {}).items()])

    def weighted_row(self, acting: Sequence[tuple[Mapping[int, float], float]]) -> FloatArray:
        """Row of the regression for weighted means of ways, each mean acting at its own amplitude."""
        first, m = 1 + self.parameters, len(self.ways)
        row = np.zeros(self.mean.shape[1])
        row[0] = 1.0
        for weights, a in acting:
            for way, weight in weights.items():
                row[first + way] += weight * a
                row[first + m + way] += weight * (a**2 - a)
        return row

    def placed(self, rows: FloatArray, theta: FloatArray) -> FloatArray:
        """``rows`` with the parameters set to ``theta`` (n, k)."""
        first, last = 1 + self.parameters, 1 + self.parameters + 2 * len(self.ways)
        return np.concatenate([rows[:, :1], theta, rows[:, first:last], theta**2 - 1.0], axis=1)

    def at(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Means and variances of z, (n, D) each, for ``rows`` of the regression."""
        used = np.flatnonzero(np.any(rows != 0.0, axis=0))
        first, second = np.triu_indices(len(used))
        # Cᵢⱼ and Cⱼᵢ together, in one matrix product.
        both = self.covariance[:, used[first], used[second]] * np.where(first == second, 1.0, 2.0)
        some = rows[:, used]
        return some @ self.mean[:, used].T, (some[:, first] * some[:, second]) @ both.T

    def scatter(self, rows: FloatArray) -> FloatArray:
        """Covariance (n, n) of the means for ``rows`` over repeated sets of as many training pours, summed over z."""
        gained = rows @ self.covariance / np.sqrt(self.pour)[:, None, None]
        return np.einsum("dni,dij,dmj->nm", gained, self.information, gained, optimize=True)

    def noise(self, rows: FloatArray) -> FloatArray:
        """Variance of a pour over that of the base model's, (n,), for ``rows`` of the regression."""
        return noise_of(rows[:, 1 + self.parameters : 1 + self.parameters + len(self.ways)], self.excess)


def planar_weights(angle: float) -> dict[float, float]:
    """Weights of the directions ``ANGLES`` for an effect that acts towards ``angle`` [rad]."""
    c, s, second = math.cos(angle), math.sin(angle), 0.25 * math.cos(2.0 * angle)
    weights = (0.25 + 0.5 * c + second, 0.25 + 0.5 * s - second, 0.25 - 0.5 * c + second, 0.25 - 0.5 * s - second)
    return dict(zip(ANGLES, weights, strict=True))


def emulated(
    lessons: Lessons, ways: Sequence[Way], weights: Sequence[float] | None = None, shrunk: bool = True
) -> Emulator:
    """Fit the emulator to training pours.

    Parameters
    ----------
    lessons
        Pours of the base model and at least two of every way.
    ways
        Directions of effects.
    weights
        By condition, the number of measured pours over its mean over the conditions; by default equal numbers (1). A
        condition with more measured pours counts for more.
    shrunk
        Whether v is estimated axis by axis. This separates effects best but underestimates the size of each. Otherwise
        v is the total variance of the signatures along every axis, which suits an effect with many training pours.

    Returns
    -------
    The emulator.

    Raises
    ------
    StatisticsError
        If the base model or a way has fewer than two pours.
    """
    names = ["base", *(way.name for way in ways)]
    for number, name in enumerate(names, start=-1):
        if (count := int((lessons.way == number).sum())) < 2:
            raise StatisticsError(f"{name}: {count} pours valid in every condition; allowed: at least 2")
    k, m = lessons.theta.shape[1], len(ways)
    base, own = lessons.way == -1, lessons.where(lessons.own)
    squashes = tuple(squash_of(block, own.groups(), own.theta, own.near) for block in own.blocks)
    drawn_in = [squash(block) for squash, block in zip(squashes, lessons.blocks, strict=True)]
    whitening, freedom = _whitening([block[lessons.own] for block in drawn_in], own)
    # Only the mean over the pours of a condition gets unit covariance (over their mean number) by its weight.
    unturned = np.repeat(weights or [1.0] * len(drawn_in), [block.shape[1] for block in drawn_in])
    whitening = np.sqrt(unturned)[:, None] * whitening
    z = np.concatenate(drawn_in, axis=1) @ whitening.T
    slopes = pooled_slopes(z, lessons.groups(), lessons.theta)
    shift = z - lessons.theta @ slopes
    shift -= shift[lessons.near].mean(axis=0)
    # β_e by least squares through the origin, way by way, and the variance of its noise.
    square = np.array([(lessons.amplitude[lessons.way == w] ** 2).sum() for w in range(m)])
    told = [lessons.amplitude[lessons.way == w] @ shift[lessons.way == w] / square[w] for w in range(m)]
    signatures = np.stack(told or [0.0 * z[0]])
    noise = 1.0 / square + 1.0 / lessons.near.sum() if m else np.ones(1)
    variances, axes = prior_along_axes(signatures, noise, unturned)
    pour = unturned @ axes**2
    scales = relative_sizes(signatures @ axes, noise[:, None] * pour, variances) if m else np.zeros(0)
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
    rows, z = rows / spread, z @ axes / spread
    alike = _alike(z, lessons)
    rows, z = (decorrelated(one, lessons.pour, alike) for one in (rows, z.T[:, :, None]))
    mean, covariance = regression(rows, z[:, :, 0], (slopes**2).mean(axis=1), variances, scales, pour)
    reached = tuple(float(lessons.amplitude[lessons.way == w].max()) for w in range(m))
    turned = axes.T @ whitening
    return Emulator(
        tuple(ways), k, mean, covariance, rows.swapaxes(1, 2) @ rows, pour, freedom, squashes, turned, reached, excess
    )


def noise_of(amplitudes: FloatArray, excess: FloatArray) -> FloatArray:
    """Variance of a pour, (n,), for ways acting at ``amplitudes`` (n, m)."""
    return np.asarray(np.clip(1.0 + amplitudes @ excess, *SCATTERS), dtype=np.float64)


def _excess(z: FloatArray, lessons: Lessons, ways: int) -> FloatArray:
    """x (m,) by least squares on the pours' squared deviations within their groups, shrunk towards 0."""
    group = lessons.groups()
    several = (np.bincount(group) > 1)[group]
    square = (residuals_within(z, group, lessons.theta) ** 2).mean(axis=1)
    way, amplitude = lessons.way[several], lessons.amplitude[several]
    more = square / square[way == -1].mean() - 1.0
    by_way = [(amplitude[way == number], more[way == number]) for number in range(ways)]
    return np.array([float(a @ some) / (float(a @ a) + FEW_POURS) for a, some in by_way])


def regression(
    rows: FloatArray, z: FloatArray, slopes: FloatArray, variances: FloatArray, scales: FloatArray, pour: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Posterior mean (D, c) and covariance (D, c, c) of the c = 1 + 2k + 2m coefficients of every feature.

    Parameters
    ----------
    rows, z
        Regressors and value of every feature in each pour, (D, n, c) and (D, n).
    slopes
        Mean square of J over the features, (k,).
    variances, scales
        v (D,) and s (m,).
    pour
        Variance of a pour in every feature, (D,).
    """
    columns, m, first = rows.shape[2], len(scales), 1 + len(slopes)
    precision = np.full((len(variances), columns), FLAT)
    own = 1.0 / (variances[:, None] * scales)
    precision[:, first : first + m] = own
    precision[:, first + m : first + 2 * m] = own / CURVATURE**2
    precision[:, first + 2 * m :] = 1.0 / (BEND**2 * np.maximum(slopes, LEAST_VARIANCE))
    turned = rows.swapaxes(1, 2) / pour[:, None, None]
    covariance = np.linalg.inv(turned @ rows + precision[:, :, None] * np.eye(columns))
    mean = (covariance @ (turned @ z[:, :, None]))[:, :, 0]
    return np.asarray(mean, dtype=np.float64), np.asarray(covariance, dtype=np.float64)


def _alike(z: FloatArray, lessons: Lessons) -> FloatArray:
    """Correlation (D, n) of the noise of every pour with that of its other views, along each axis of ``z`` (n, D).

    Views of the base model are displaced, and those of effects are turned.
    """
    group = lessons.groups()
    several, noise = (np.bincount(group) > 1)[group], residuals_within(z, group, lessons.theta)
    displaced = np.isin(lessons.pour, lessons.pour[lessons.way == -1])
    alike = np.zeros_like(z)
    for kind in (displaced, ~displaced):
        alike[kind] = intraclass_correlation(noise[kind[several]], lessons.pour[kind & several])
    return np.asarray(alike.T, dtype=np.float64)


def _whitening(drawn_in: Sequence[FloatArray], own: Lessons) -> tuple[FloatArray, int]:
    """W (D, D), block-diagonal by condition, and the degrees of freedom of Σ."""
    group = own.groups()
    covariances = [shrunk_covariance(residuals_within(block, group, own.theta)) for block in drawn_in]
    white = block_diag(*(np.linalg.inv(np.linalg.cholesky(one)) for one in covariances))
    several = np.bincount(group) > 1
    return white, max(1, int(several[group].sum()) - int(several.sum()) - own.theta.shape[1])
