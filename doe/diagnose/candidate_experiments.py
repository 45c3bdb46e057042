"""What to measure next: the feasible changes of the rig, each poured with every answer that is left.

The pours are those that teach the models (``training_pours.py``), made in the changed rig, so that data sets of one
declared model share them, and those of the chosen set-up serve again when its data are weighed. In each set-up a
regression of its own says what every answer predicts at its best fit, in all features that the data offer; what fit,
regression and the axis of a scan leave open is in the covariance.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from doe.analysis.covariance import shrunk_means
from doe.declared.bodies import Acting, BodyEvidence, wanted_bodies
from doe.declared.model import Declared
from doe.declared.points import AS_IT_IS
from doe.declared.pours import ModelPours
from doe.declared.set_ups import changed, feasible
from doe.diagnose.compared_features import usable
from doe.diagnose.emulator import Emulator, Lessons, emulated, planar_weights
from doe.diagnose.next_experiment import GIVEN_UP, CandidateExperiment, Prediction, fewest_pours, rank_experiments
from doe.diagnose.posterior import Posterior
from doe.diagnose.result import BASE, BODIES_ALONE, UNEXPLAINED, RankedExperiment, Suggestion
from doe.diagnose.training_pours import TrainingPours, acting
from doe.diagnose.verdict import Verdict
from doe.errors import StatisticsError
from doe.measurement.features import feature_set, offer_of
from doe.measurement.measurement import Condition, Measurement
from solver import EFFECTS

FloatArray = npt.NDArray[np.float64]
PoursIn = Callable[[Sequence[Condition]], ModelPours]

BASE_POURS, POURS, TAUGHT = 12, 4, 14
"""Pours of the base model, and of every direction of an effect that is left, in each set-up of the candidates; and of a
direction when the data of the chosen one are weighed (six, and a look of eight, at least)."""
MISTAKEN = 0.01
"""Probability from which on an answer counts among those that the one given may be mistaken for."""
INTERVAL = 2.0 * 1.96
"""Standard deviations in a 95 % interval."""


@dataclass(frozen=True)
class CandidateExperiments:
    """Set-ups in order, and how many pours had to be run for them."""

    suggestions: tuple[Suggestion, ...]
    run_now: int


def next_experiment(
    training: TrainingPours,
    found: Posterior,
    weights: Mapping[str, float],
    condition: Condition,
    pours_in: PoursIn,
    bodies: BodyEvidence | None = None,
) -> CandidateExperiments:
    """The candidates for telling answers apart, the most discriminating set-up first.

    Parameters
    ----------
    training, found
        What taught the models, and the posterior that leaves them.
    weights
        Probability of every answer that is left, "base" for nothing missing; no candidates with fewer than two.
    condition
        The fitted condition that is changed.
    pours_in
        The pours of the declared model in set-ups.
    bodies
        What is to be measured of single bodies beside any of them, with the standard errors that are expected.
    """
    if len(weights) < 2:
        return CandidateExperiments((), 0)
    directed = {way.effect for way in training.ways if way.angle is not None}
    turned = any(name in directed for label in weights for name in label.split("+"))
    changes = {change.named(turned): values for change, values in feasible(condition.scene, training.calibrated)}
    set_ups = [changed(condition, name, values, turned) for name, values in changes.items()]
    # What is measured there is weighed by all effects.
    set_ups = [one for one in set_ups if training.possible_in(one.scene)]
    asked = dict.fromkeys(name for label in weights if label != "base" for name in label.split("+"))
    levers = tuple(f"{name}: {EFFECTS[name].lever}" for name in asked)
    asked_of = () if bodies is None else bodies.asked
    ranked: tuple[RankedExperiment, ...] = ()
    planned = run_now = 0
    # Where bodies tell all, no other set-up can gain.
    for some in (set_ups,) if bodies is None else (set_ups[:1], set_ups):
        items, more = _items(training, found, weights, some, pours_in)
        run_now += more
        if bodies is not None:
            items = [_with_bodies(one, found, bodies) for one in items]
        if items:
            planned, ranked = fewest_pours(items, weights)
            if ranked[0].chance >= sum(weights.values()) - GIVEN_UP:
                break
    suggestions = (
        Suggestion(one, changes[one.name], condition.name, tuple(weights), levers, planned, turned, asked_of)
        for one in ranked
    )
    return CandidateExperiments(tuple(suggestions), run_now)


def checked_by_bodies(
    verdict: Verdict, found: Posterior, declared: Declared, measurement: Measurement
) -> tuple[Suggestion, ...]:
    """What of single bodies tells an answer that is given from what it may be mistaken for; nothing if it is none."""
    if verdict.kind == UNEXPLAINED:
        return ()
    (answer,) = verdict.names or (BASE,)
    odds = {**found.effects, BASE: max(found.nothing, sys.float_info.min)}
    others = [label for label, p in odds.items() if label != answer and (p >= MISTAKEN or label == BASE)]
    weights = {label: odds[label] for label in (answer, *sorted(others, key=lambda one: -odds[one]))}
    acts = {label: acting_in(found, label) for label in weights}
    if (bodies := wanted_bodies(measurement, declared, list(acts.values()))) is None:
        return ()
    predictions = {label: Prediction(*bodies.predicted(acts[label])) for label in weights}
    # All noise is in the predictions.
    (ranked,) = rank_experiments([CandidateExperiment(BODIES_ALONE, predictions)], weights, math.inf)
    return (Suggestion(ranked, {}, measurement.fit[0].name, tuple(weights), (), 0, bodies=bodies.asked),)


def _items(
    training: TrainingPours,
    found: Posterior,
    weights: Mapping[str, float],
    set_ups: Sequence[Condition],
    pours_in: PoursIn,
) -> tuple[list[CandidateExperiment], int]:
    """What every answer predicts in each of ``set_ups``, and how many pours had to be run for it."""
    model = pours_in(set_ups)
    probes = training.base(BASE_POURS) + training.probes(found, tuple(weights), POURS)
    # All set-ups at once, so that no core waits for the last pour of one of them; what is only looked at after that.
    plain = dict.fromkeys(probe.point.seen(AS_IT_IS) for probe in probes)
    model.run("what to measure next", list(plain))
    rows = model.run("what to measure next", [probe.point for probe in probes])
    items = []
    for c, set_up in enumerate(set_ups):
        lessons = training.told(probes, [[row[c]] for row in rows])
        with suppress(StatisticsError):  # a set-up that jams tells nothing
            items.append(_item(training, found, weights, lessons, model, c, set_up))
    return items, model.run_now


def _item(
    training: TrainingPours,
    found: Posterior,
    weights: Mapping[str, float],
    lessons: Lessons,
    pours: ModelPours,
    c: int,
    set_up: Condition,
) -> CandidateExperiment:
    """What every answer predicts in a set-up, by a regression of its own; StatisticsError if too few pours ended."""
    offered = feature_set(set_up).offered(offer_of(set_up))
    taught, (columns,) = usable(lessons, [np.arange(offered)])
    used = sorted(set(taught.way[taught.way >= 0].tolist()))
    if missing := set(lessons.way.tolist()) - {-1, *used}:
        raise StatisticsError(f"{training.ways[missing.pop()].name}: none of its pours is valid")
    taught = replace(taught, way=np.array([used.index(way) if way >= 0 else -1 for way in taught.way]))
    emulator = emulated(taught, [training.ways[way] for way in used])
    # The axis of a scan is off in the new pours as well.
    shared = np.zeros((len(columns), 0))
    axis_error = max((one.axis_error for one in set_up.surfaces.values()), default=0.0)
    if axis_error > 0.0:
        axis = training.axis_in(pours, c, len(feature_set(set_up).scalars), axis_error)[:, columns]
        shared = emulator.whitening @ (axis * emulator.squashes[0].slope(emulator.squashes[0].centre)).T
    rows = [_rows(emulator, training, found, label) for label in weights]
    best, theta = np.array([some[0] for some in rows]), np.array([found.fits[label].theta for label in weights])
    _, loose, slopes = emulator.moved(theta)
    # How well a regression of few pours knows an answer is no property of it that would give it away, nor does it stay;
    # and what its noise sets between two answers tells nothing apart.
    unsure = np.diag((emulator.at(best)[1] + loose).mean(axis=0)) * POURS / TAUGHT
    placed = emulator.placed(best, theta)
    means = shrunk_means(emulator.at(placed)[0], emulator.scatter(placed), np.array(list(weights.values())))
    predictions = {}
    for label, mean, some, slope in zip(weights, means, rows, slopes, strict=True):
        beside = emulator.at(some[1:])[0] - emulator.at(some[:1])[0]
        covariance = unsure + slope @ found.fits[label].theta_covariance @ slope.T + beside.T @ beside
        predictions[label] = Prediction(mean, covariance + shared @ shared.T)
    return CandidateExperiment(set_up.name, predictions)


def acting_in(found: Posterior, label: str) -> Acting:
    """What acts in the best fit of ``label``."""
    return [(a.effect, a.value, (a.high - a.low) / INTERVAL) for a in found.fits[label].amplitudes]


def _with_bodies(item: CandidateExperiment, found: Posterior, bodies: BodyEvidence) -> CandidateExperiment:
    """``item`` with the numbers of single bodies among what is predicted; a pour's noise on top is a little much."""
    predictions = {}
    for label, one in item.predictions.items():
        mean, covariance = bodies.predicted(acting_in(found, label))
        predictions[label] = Prediction(np.append(one.mean, mean), block_diag(one.covariance, covariance))
    return replace(item, predictions=predictions)


def _rows(emulator: Emulator, training: TrainingPours, found: Posterior, label: str) -> FloatArray:
    """Rows of the regression: at the best fit of ``label``, and with each amplitude a standard deviation beside it."""
    base, here = emulator.row(), emulator.row()
    beside = []
    number = {way.name: k for k, way in enumerate(emulator.ways)}
    for way, amplitude in acting(found, label, training.ways):
        effect = training.ways[way].effect
        size = math.hypot(*training.ways[way].unit)
        own = [one for one in found.fits[label].amplitudes if one.effect == effect]
        spread = [(one.high - one.low) / INTERVAL / size for one in own]
        if len(own) == 1:
            acts = {number[training.ways[way].name]: 1.0}
            first, *others = (
                emulator.weighted_row([(acts, a)]) - base for a in (amplitude, amplitude + min(spread[0], amplitude))
            )
        else:
            planar = {one.angle: k for k, one in enumerate(emulator.ways) if one.effect == effect}
            x, y = (one.value / size for one in own)
            first, *others = (
                emulator.weighted_row(
                    [({planar[a]: w for a, w in planar_weights(math.atan2(q, p)).items()}, math.hypot(p, q))]
                )
                - base
                for p, q in ((x, y), (x + spread[0], y), (x, y + spread[1]))
            )
        here = here + first
        beside += [one - first for one in others]
    return np.array([here, *(here + one for one in beside)])


def as_suggested(condition: Condition, asked: Suggestion) -> Condition:
    """``condition`` with the change of a suggestion, under its name."""
    return changed(condition, asked.experiment.name, asked.values, asked.turned)
