"""Which features are compared, and what the data are in them.

A feature is compared if at least two replicates and half of them offer it (or the only one does), if ``READABLE`` of
the base model's pours give it, and if it varies at all in the pours. What the data offer depends on names
(``doe/measurement/features.py``), so no value influences the choice. Whether a model fits is judged by the replicates
without outliers (``Compared.asked_of_typical``); all replicates weigh one model against another.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from doe.analysis.covariance import outlier_weights, scatter_between
from doe.declared.bodies import BodyEvidence
from doe.diagnose.emulator import Emulator, Lessons, Way, emulated
from doe.diagnose.posterior import Data, Fit, Posterior, fitted, posterior
from doe.errors import StatisticsError
from doe.measurement.features import SCAN, feature_set, features_of_data, offer_of, sight_of
from doe.measurement.measurement import Condition
from doe.measurement.sight import PERFECT, Sight
from doe.measurement.summaries import summary_uncertainties

FloatArray = npt.NDArray[np.float64]

READABLE = 0.8
"""Fraction of the base model's pours in which a feature must be readable."""
BIAS_ERROR = 0.3
"""Relative standard deviation of a sight's bias, which is computed for the base model's piles and an assumed camera."""
CONSTANT = 1e-9
"""Scatter within groups of pours, relative to the feature's size, below which a feature carries no information."""


@dataclass(frozen=True)
class MeasuredFeatures:
    """Features that a condition's data offer: names, replicates (r, d) and the stated error of each feature, (d,).

    ``scalars``: number of features that are not read off a surface. ``sight``: what the scans were seen through;
    ``axis``, ``axis_error``: place of the rig's axis in their coordinates, and its error [m]; ``turned``: whether the
    rig was turned on its bench.
    """

    condition: str
    offer: str
    names: tuple[str, ...]
    values: FloatArray
    instrument: FloatArray
    mean_of: int = 1
    scalars: int = 0
    axis: tuple[float, float] | None = None
    axis_error: float = 0.0
    turned: bool = False
    sight: Sight = PERFECT

    def pours(self, columns: npt.NDArray[np.int64]) -> FloatArray:
        """Replicates in which all of ``columns`` could be read."""
        block = self.values[:, columns]
        return np.asarray(block[np.isfinite(block).all(axis=1)], dtype=np.float64)


def measured(condition: Condition, offer: str | None = None) -> MeasuredFeatures:
    """Features that ``condition`` offers, or the subset that data of the kind ``offer`` would contain."""
    names, values = feature_set(condition), features_of_data(condition)
    most = names.offered(offer_of(condition)) if offer is None else min(names.offered(offer), values.shape[1])
    stated = np.zeros(most)
    stated[: len(names.scalars)] = np.nan_to_num(summary_uncertainties(condition))
    found = offer_of(condition) if offer is None else offer
    return MeasuredFeatures(
        condition=condition.name,
        offer=found,
        names=names.names[:most],
        values=values[:, :most],
        instrument=stated,
        mean_of=condition.mean_of,
        scalars=len(names.scalars),
        axis=next((one.axis for one in condition.surfaces.values()), None),
        axis_error=max((one.axis_error for one in condition.surfaces.values()), default=0.0),
        turned=condition.turned,
        sight=sight_of(condition) if found == SCAN else PERFECT,
    )


@dataclass(frozen=True)
class Compared:
    """Data and models in the same features.

    Attributes
    ----------
    conditions, names
        Names of the conditions, and of the features by condition.
    left_out
        "condition: feature" for each feature that the data offer and no pour varies or gives.
    data, emulator, posterior
        The data, the emulator that they are weighed by, and the result.
    typical
        The data of the replicates without outliers; ``data`` itself if there are none.
    blocks
        Measured replicates, by condition (r, d_c).
    plain
        The emulator without what the signatures have in common (``shrunk=False``), in the same coordinates: for the
        amplitude of the named effect.
    """

    conditions: tuple[str, ...]
    names: tuple[tuple[str, ...], ...]
    left_out: tuple[str, ...]
    blocks: tuple[FloatArray, ...]
    data: Data
    typical: Data
    emulator: Emulator
    posterior: Posterior
    plain: Emulator

    def asked_of_typical(self, labels: Sequence[str]) -> Compared:
        """Return the same with the p of ``labels`` from the replicates without outliers.

        A pile that came down in a lump may tell one effect from another, but a model describes piles on average.
        """
        if self.typical is self.data:
            return self
        found = self.posterior.fits
        fits = {one: replace(found[one], p=fitted(self.emulator, self.typical, one).p) for one in labels}
        return self._with(fits)

    def refitted(self, labels: Sequence[str]) -> Compared:
        """Return the same with ``labels`` refitted by the plain emulator; their evidence and p stay as they were."""
        fits = {}
        for label in labels:
            before = self.posterior.fits[label]
            plain = fitted(self.plain, self.data, label)
            fits[label] = replace(plain, log_evidence=before.log_evidence, p=before.p)
        return self._with(fits)

    def _with(self, fits: Mapping[str, Fit]) -> Compared:
        """Return the same with ``fits`` in place of the former ones."""
        return replace(self, posterior=replace(self.posterior, fits={**self.posterior.fits, **fits}))


@dataclass(frozen=True)
class Instrument:
    """Shift of all features of the base model's pours by a condition's scanner, from two views of the same pours.

    ``bias``: by its sight, (d,). ``axis``: by an axis error of one standard deviation along x and along y, (2, d).
    """

    bias: FloatArray
    axis: FloatArray


def weighed(
    lessons: Lessons,
    ways: Sequence[Way],
    conditions: Sequence[MeasuredFeatures],
    instruments: Sequence[Instrument] = (),
    bodies: BodyEvidence | None = None,
) -> Compared:
    """Weigh all models by the data of the fitted ``conditions`` and by the measurements of single bodies.

    ``conditions`` are the first that were poured; the bias of their ``instruments`` is subtracted from the data.

    Raises StatisticsError if a condition has nothing that can be compared.
    """
    if instruments:
        conditions = [
            replace(one, values=one.values - instrument.bias[: one.values.shape[1]])
            for one, instrument in zip(conditions, instruments, strict=True)
        ]
    lessons = replace(lessons, blocks=lessons.blocks[: len(conditions)])
    taught, columns = usable(lessons, [_there(condition) for condition in conditions])
    left_out = [
        f"{condition.condition}: {condition.names[k]}"
        for condition, chosen in zip(conditions, columns, strict=True)
        for k in sorted(set(range(len(condition.names))) - set(chosen.tolist()))
    ]
    for condition, chosen in zip(conditions, columns, strict=True):
        if chosen.size == 0 or len(condition.pours(chosen)) == 0:
            raise StatisticsError(f"{condition.condition}: no measured number varies in the pours and can be read")
    blocks = tuple(condition.pours(chosen) for condition, chosen in zip(conditions, columns, strict=True))
    numbers = np.array([len(b) * one.mean_of for b, one in zip(blocks, conditions, strict=True)], dtype=np.float64)
    weights = numbers / numbers.mean()
    emulator, plain = (emulated(taught, ways, weights.tolist(), shrunk) for shrunk in (True, False))
    white = [
        emulator.whitened(c, block) * math.sqrt(one.mean_of / weight)
        for c, (block, one, weight) in enumerate(zip(blocks, conditions, weights, strict=True))
    ]
    pours = white, [block.shape[1] for block in blocks], emulator.freedom
    data = Data(
        emulator.seen(blocks),
        float(numbers.mean()),
        scatter_between(*pours)[1],
        _loadings(emulator, blocks, conditions, columns, instruments),
        bodies,
    )
    typical, (shares, scatter) = data, outlier_weights(*pours)
    if any(one.min() < 1.0 for one in shares):
        number = data.replicates * float(np.mean([one.mean() for one in shares]))
        typical = replace(data, z=emulator.seen(blocks, shares), replicates=number, scatter=scatter)
    names = tuple(tuple(one.names[k] for k in chosen) for one, chosen in zip(conditions, columns, strict=True))
    labels = tuple(one.condition for one in conditions)
    found = posterior(emulator, data)
    return Compared(labels, names, tuple(left_out), blocks, data, typical, emulator, found, plain)


def usable(lessons: Lessons, offered: Sequence[npt.NDArray[np.int64]]) -> tuple[Lessons, list[npt.NDArray[np.int64]]]:
    """Return the complete pours with those ``offered`` features that they give and that vary, and these columns."""
    columns = [some[_readable(lessons, c)[some]] for c, some in enumerate(offered)]
    taught = _complete(lessons.only(columns))
    columns = [chosen[_varies(taught, c)] for c, chosen in enumerate(columns)]
    return _complete(lessons.only(columns)), columns


def _there(condition: MeasuredFeatures) -> npt.NDArray[np.int64]:
    """Indices of the features that a condition's data give."""
    number = len(condition.values)
    return np.flatnonzero(np.isfinite(condition.values).sum(axis=0) >= max(min(2, number), number / 2))


def _readable(lessons: Lessons, c: int) -> npt.NDArray[np.bool_]:
    """Mask of the features that the base model's pours give."""
    base = lessons.blocks[c][lessons.way == -1]
    # A pour that broke off says nothing about any feature.
    ended = np.isfinite(base).any(axis=1)
    return np.asarray(np.isfinite(base[ended]).sum(axis=0) >= READABLE * max(1, ended.sum()))


def _complete(lessons: Lessons) -> Lessons:
    """Pours that came to a valid end and could be read in every condition."""
    return lessons.where(np.all([np.isfinite(block).all(axis=1) for block in lessons.blocks], axis=0))


def _varies(lessons: Lessons, c: int) -> npt.NDArray[np.bool_]:
    """Mask of the features of a condition that vary within any group of the pours that count for the covariance."""
    own = lessons.where(lessons.own)
    block, groups = own.blocks[c], own.groups()
    size = np.abs(block).max(axis=0, initial=0.0)
    spans = np.array([np.ptp(block[groups == group], axis=0) for group in np.unique(groups)])
    return np.asarray((spans > CONSTANT * size).any(axis=0))


def _loadings(
    emulator: Emulator,
    blocks: Sequence[FloatArray],
    conditions: Sequence[MeasuredFeatures],
    columns: Sequence[npt.NDArray[np.int64]],
    instruments: Sequence[Instrument],
) -> FloatArray:
    """I: response of z to the errors of instruments, which averaging does not reduce, (D, q).

    Stated errors of numbers are independent. The error of an axis, and that of the bias of a sight, move all features
    read off a surface together. An axis is off equally in all conditions whose scans state the same one, by a scanner
    that stayed in place, unless the rig was turned under it.
    """
    size, first, found = len(emulator.whitening), 0, []
    common: dict[tuple[object, ...], FloatArray] = {}
    for c, (squash, block, one, chosen) in enumerate(zip(emulator.squashes, blocks, conditions, columns, strict=True)):
        slope = squash.slope(block.mean(axis=0))
        places = np.arange(first, first + len(chosen))
        first += len(chosen)
        stated = one.instrument[chosen] * slope
        for k in np.flatnonzero(stated > 0.0):
            found.append(stated[k] * np.eye(size)[places[k]])
        if instruments:
            axis = c if one.axis is None else (one.axis, one.turned)
            (x, y), bias = instruments[c].axis, BIAS_ERROR * instruments[c].bias
            for error, change in ((("x", axis), x), (("y", axis), y), (("bias",), bias)):
                common.setdefault(error, np.zeros(size))[places] = change[chosen] * slope
    found += [moved for moved in common.values() if moved.any()]
    return np.asarray(emulator.whitening @ np.array(found).T, dtype=np.float64) if found else np.zeros((size, 0))
