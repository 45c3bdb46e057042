"""Candidates for the next measurement: feasible changes of the rig, each poured with every remaining answer.

The points of the training pours (``training_pours.py``) are poured in the changed rig, so data sets of one declared
model share these pours, and those of the chosen set-up serve again when its data are weighed. In each set-up a separate
regression predicts every answer at its best fit, in all features that the data offer. The covariance includes the
uncertainty of the fit, of the regression and of the axis of a scan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from doe.analysis.covariance import shrunk_means
from doe.declared.bodies import ActingModel, BodyEvidence, wanted_bodies
from doe.declared.model import Declared
from doe.declared.points import AS_IT_IS
from doe.declared.pours import ModelPours
from doe.declared.set_ups import changed, feasible
from doe.diagnose.compared_features import usable
from doe.diagnose.emulator import Emulator, Lessons, emulated, planar_weights
from doe.diagnose.next_experiment import GIVEN_UP, CandidateExperiment, Prediction, fewest_pours, rank_experiments
from doe.diagnose.posterior import Posterior, holds
from doe.diagnose.result import BASE, BODIES_ALONE, UNEXPLAINED, RankedExperiment, Suggestion
from doe.diagnose.training_pours import TrainingPours, acting
from doe.diagnose.verdict import THRESHOLD, Verdict
from doe.errors import StatisticsError
from doe.measurement.features import feature_set, offer_of
from doe.measurement.measurement import Condition, Measurement
from solver import EFFECTS

FloatArray = npt.NDArray[np.float64]
PoursIn = Callable[[Sequence[Condition]], ModelPours]

BASE_POURS, POURS, TAUGHT = 12, 4, 14
"""Pours of the base model, and of every direction of a remaining effect, in each candidate set-up; and pours of a
direction when the data of the chosen one are weighed (six, and a look of eight, at least)."""
MISTAKEN = 0.01
"""Probability from which an answer counts among those that the given answer may be mistaken for."""
INTERVAL = 2.0 * 1.96
"""Width of a 95 % interval [standard deviations]."""
MAGNIFIED = 1e3
"""Factor by which numbers of single bodies are multiplied beside features with the noise of a pour."""


@dataclass(frozen=True)
class CandidateExperiments:
    """Ranked set-ups, and how many pours had to be run for them."""

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
    """Rank the candidates for telling answers apart, the most discriminating set-up first.

    Parameters
    ----------
    training, found
        The training pours, and the posterior that follows from them.
    weights
        Probability of every remaining answer, "base" for nothing missing; with fewer than two there are no candidates.
    condition
        The fitted condition that is changed.
    pours_in
        Gives the pours of the declared model in set-ups.
    bodies
        Single-body measurements to be made with any of the set-ups, with their expected standard errors.
    """
    if len(weights) < 2:
        return CandidateExperiments((), 0)
    directed = {way.effect for way in training.ways if way.angle is not None}
    turned = any(name in directed for label in weights for name in label.split("+"))
    changes = {change.named(turned): values for change, values in feasible(condition.scene, training.calibrated)}
    set_ups = [changed(condition, name, values, turned) for name, values in changes.items()]
    # Data from a set-up are weighed by all effects, so all must be possible in it.
    set_ups = [one for one in set_ups if training.possible_in(one.scene)]
    asked = dict.fromkeys(name for label in weights if label != "base" for name in label.split("+"))
    levers = tuple(f"{name}: {EFFECTS[name].lever}" for name in asked)
    asked_of = () if bodies is None else bodies.asked
    ranked: tuple[RankedExperiment, ...] = ()
    planned = run_now = 0
    # If single bodies tell all answers apart, no other set-up can do better.
    for some in (set_ups,) if bodies is None else (set_ups[:1], set_ups):
        items, more = _items(training, found, weights, some, pours_in, bodies)
        run_now += more
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
    """Single-body measurements that tell a given answer from those it may be mistaken for; empty if there are none."""
    if verdict.kind == UNEXPLAINED:
        return ()
    (answer,), odds = verdict.names or (BASE,), {**found.effects, BASE: found.nothing}
    # A name that may be alone or with others is not mistaken for itself with others.
    own = {answer, *(label for label in odds if odds[answer] < THRESHOLD and holds(label, answer))}
    others = [label for label, p in odds.items() if label not in own and (p >= MISTAKEN or label == BASE)]
    weights = {label: odds[label] for label in (answer, *sorted(others, key=lambda one: -odds[one]))}
    acts = {label: acting_in(found, label) for label in weights}
    if (bodies := wanted_bodies(measurement, declared, list(acts.values()))) is None:
        return ()
    nothing = Prediction(np.zeros(0), np.zeros((0, 0)))
    predictions = {
        label: with_bodies(nothing, np.zeros((0, len(one.theta) + len(one.effects))), one, bodies)
        for label, one in acts.items()
    }
    (ranked,) = rank_experiments([CandidateExperiment(BODIES_ALONE, predictions)], weights, math.inf)
    return (Suggestion(ranked, {}, measurement.fit[0].name, tuple(weights), (), 0, bodies=bodies.asked),)


def _items(
    training: TrainingPours,
    found: Posterior,
    weights: Mapping[str, float],
    set_ups: Sequence[Condition],
    pours_in: PoursIn,
    bodies: BodyEvidence | None,
) -> tuple[list[CandidateExperiment], int]:
    """Predictions of every answer in each of ``set_ups``, and how many pours had to be run for them."""
    model = pours_in(set_ups)
    probes = training.base(BASE_POURS) + training.probes(found, tuple(weights), POURS)
    # Run all set-ups together, so that no core idles at the end of one; views of these pours follow.
    plain = dict.fromkeys(probe.point.seen(AS_IT_IS) for probe in probes)
    model.run("what to measure next", list(plain))
    rows = model.run("what to measure next", [probe.point for probe in probes])
    items = []
    for c, set_up in enumerate(set_ups):
        lessons = training.told(probes, [[row[c]] for row in rows])
        with suppress(StatisticsError):  # a set-up that jams tells nothing
            items.append(_item(training, found, weights, lessons, model, c, set_up, bodies))
    return items, model.run_now


def _item(
    training: TrainingPours,
    found: Posterior,
    weights: Mapping[str, float],
    lessons: Lessons,
    pours: ModelPours,
    c: int,
    set_up: Condition,
    bodies: BodyEvidence | None,
) -> CandidateExperiment:
    """Predictions of every answer in a set-up, by a separate regression; StatisticsError if too few pours ended."""
    offered = feature_set(set_up).offered(offer_of(set_up))
    taught, (columns,) = usable(lessons, [np.arange(offered)])
    if columns.size == 0:
        raise StatisticsError(f"{set_up.name}: no number varies in the pours and can be read")
    used = sorted(set(taught.way[taught.way >= 0].tolist()))
    if missing := set(lessons.way.tolist()) - {-1, *used}:
        raise StatisticsError(f"{training.ways[missing.pop()].name}: none of its pours is valid")
    taught = replace(taught, way=np.array([used.index(way) if way >= 0 else -1 for way in taught.way]))
    emulator = emulated(taught, [training.ways[way] for way in used])
    # Scans of the new pours have an axis error as well.
    shared = np.zeros((len(columns), 0))
    axis_error = max((one.axis_error for one in set_up.surfaces.values()), default=0.0)
    if axis_error > 0.0:
        axis = training.axis_in(pours, c, len(feature_set(set_up).scalars), axis_error)[:, columns]
        shared = emulator.whitening @ (axis * emulator.squashes[0].slope(emulator.squashes[0].centre)).T
    rows = [_rows(emulator, training, found, label) for label in weights]
    best, fits = np.array([some[0] for some in rows]), [found.fits[label] for label in weights]
    theta, spread = np.array([fit.theta for fit in fits]), np.array([np.diag(fit.theta_covariance) for fit in fits])
    _, loose, slopes = emulator.moved(theta, theta**2 + spread)
    # The error of a regression on few pours is no property of an answer and does not last, so all answers get the same;
    # and differences between answers that its noise explains are removed, because they tell nothing apart.
    unsure = np.diag((emulator.at(best)[1] + loose).mean(axis=0)) * POURS / TAUGHT
    placed = emulator.placed(best, theta)
    means = shrunk_means(emulator.at(placed)[0], emulator.scatter(placed), np.array(list(weights.values())))
    predictions = {}
    for label, mean, some, slope in zip(weights, means, rows, slopes, strict=True):
        acts, beside = acting_in(found, label), emulator.at(some[1:])[0] - emulator.at(some[:1])[0]
        loadings = np.concatenate([slope @ np.linalg.cholesky(acts.unsure), beside.T], axis=1)
        of_pile = Prediction(mean, unsure + shared @ shared.T)
        predictions[label] = with_bodies(of_pile, loadings, acts, bodies)
    return CandidateExperiment(set_up.name, predictions)


def acting_in(found: Posterior, label: str) -> ActingModel:
    """The best fit of ``label``."""
    fit = found.fits[label]
    effects = [(a.effect, a.value, (a.high - a.low) / INTERVAL) for a in fit.amplitudes]
    return ActingModel(effects, fit.theta, fit.theta_covariance)


def with_bodies(one: Prediction, loadings: FloatArray, acts: ActingModel, bodies: BodyEvidence | None) -> Prediction:
    """Prediction of a pile and of the numbers of single bodies, which depend on the same parameters and amplitudes.

    ``loadings``: shifts of the pile by one standard deviation of each, (d, k + p), not contained in ``one``.
    """
    if bodies is not None:
        # In a unit so small that the noise of a pour, which is added to every number, is none.
        mean, noise, more = bodies.predicted(acts)
        one = Prediction(np.append(one.mean, MAGNIFIED * mean), block_diag(one.covariance, MAGNIFIED**2 * noise))
        loadings = np.concatenate([loadings, MAGNIFIED * more])
    return Prediction(one.mean, one.covariance + loadings @ loadings.T)


def _rows(emulator: Emulator, training: TrainingPours, found: Posterior, label: str) -> FloatArray:
    """Rows of the regression at the best fit of ``label``, and with each amplitude moved by one standard deviation."""
    base, here = emulator.row(), emulator.row()
    beside = []
    number = {way.name: k for k, way in enumerate(emulator.ways)}
    for way, amplitude in acting(found, label, training.ways):
        effect = training.ways[way].effect
        size = math.hypot(*training.ways[way].unit)
        own = [one for one in found.fits[label].amplitudes if one.effect == effect]
        spread = [(one.high - one.low) / INTERVAL / size for one in own]
        if len(own) == 1:
            # A wide step would leave what was poured: the slope over a short one counts for all of it.
            acts, step = {number[training.ways[way].name]: 1.0}, min(spread[0], amplitude) or 1.0
            first, more = (emulator.weighted_row([(acts, a)]) - base for a in (amplitude, amplitude + step))
            others = [first + (more - first) * spread[0] / step]
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
    """``condition`` with the change that ``asked`` suggests, under the name of its experiment."""
    return changed(condition, asked.experiment.name, asked.values, asked.turned)
