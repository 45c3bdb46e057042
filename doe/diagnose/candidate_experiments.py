"""What to measure next: the feasible changes of the rig, each poured with every answer that is left.

The pours are those that teach the models (``training_pours.py``), made in the changed rig, so that data sets of one
declared model share them, and those of the chosen set-up serve again when its data are weighed. In each set-up a
regression of its own says what every answer predicts at its best fit, in all features that the data offer; what fit,
regression and the axis of a scan leave open is in the covariance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from doe.analysis.covariance import shrunk_means
from doe.declared.bodies import Acting, BodyEvidence
from doe.declared.points import AS_IT_IS
from doe.declared.pours import ModelPours
from doe.diagnose.compared_features import usable
from doe.diagnose.emulator import Emulator, Lessons, emulated, planar_weights
from doe.diagnose.next_experiment import CandidateExperiment, Prediction, fewest_pours
from doe.diagnose.posterior import Posterior
from doe.diagnose.result import Suggestion
from doe.diagnose.training_pours import TrainingPours, acting
from doe.errors import StatisticsError
from doe.measurement.condition_table import turned as turned_scene
from doe.measurement.features import feature_set, offer_of
from doe.measurement.measurement import Condition
from doe.record import Record
from solver import EFFECTS, ParameterError, Scene, parameters, pour_rig, value, with_values

FloatArray = npt.NDArray[np.float64]
PoursIn = Callable[[Sequence[Condition]], ModelPours]

BASE_POURS, POURS, TAUGHT = 12, 4, 14
"""Pours of the base model, and of every direction of an effect that is left, in each set-up of the candidates; and of a
direction when the data of the chosen one are weighed (six, and a look of eight, at least)."""
INTERVAL = 2.0 * 1.96
"""Standard deviations in a 95 % interval."""


@dataclass(frozen=True)
class Change(Record):
    """A change of the first fitted condition that a laboratory can make in minutes.

    ``factors`` multiply its parameters, ``choices`` replace settings.
    """

    name: str
    factors: Mapping[str, float] = field(default_factory=dict)
    choices: Mapping[str, str] = field(default_factory=dict)

    def named(self, turned: bool) -> str:
        """Its name, with the rig ``turned`` by 180° on its bench or not."""
        if not turned:
            return self.name
        return f"{self.name}, {TURNED}" if self.factors or self.choices else TURNED


TURNED = "rig turned by 180° on its bench"
"""What any change is made with where an effect with a direction is left: it costs no pours, for all else is the same in
a turned rig, and tells what stays with the bench from what turns with the rig."""
CHANGES = (
    Change("as it is, poured again"),
    Change("half the mass", {"rig.mass": 0.5}),
    Change("half as much mass again", {"rig.mass": 1.5}),
    Change("fed four times as fast", {"insertion.rate": 4.0}),
    Change("fed at 0.4 times the rate", {"insertion.rate": 0.4}),
    Change("dropped four times as fast", {"insertion.drop_speed": 4.0}),
    Change("filled with the outlet closed, then opened", choices={"insertion.protocol": "fill_then_open"}),
)
"""Of any rig but for what it ``forgets``; each has its own beside them (``PourRig.quick_changes``)."""


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
    if not items:
        return CandidateExperiments((), model.run_now)
    asked = dict.fromkeys(name for label in weights if label != "base" for name in label.split("+"))
    levers = tuple(f"{name}: {EFFECTS[name].lever}" for name in asked)
    if bodies is not None:
        items = [_with_bodies(one, found, bodies) for one in items]
    asked_of = () if bodies is None else tuple((row.body, row.quantity) for row in bodies.rows)
    planned, ranked = fewest_pours(items, weights)
    suggestions = [
        Suggestion(one, changes[one.name], condition.name, tuple(weights), levers, planned, turned, asked_of)
        for one in ranked
    ]
    return CandidateExperiments(tuple(suggestions), model.run_now)


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


def changed(condition: Condition, name: str, values: Mapping[str, float | str], about: bool) -> Condition:
    """``condition`` under another name, with ``values`` set and the rig turned ``about`` on its bench."""
    scene = turned_scene(condition.scene) if about else condition.scene
    return replace(condition, name=name, scene=with_values(scene, dict(values)), turned=condition.turned != about)


def as_suggested(condition: Condition, asked: Suggestion) -> Condition:
    """``condition`` with the change of a suggestion, under its name."""
    return changed(condition, asked.experiment.name, asked.values, asked.turned)


def feasible(scene: Scene, calibrated: Collection[str] = ()) -> list[tuple[Change, dict[str, float | str]]]:
    """The changes that the rig of ``scene`` can do, with the values [SI] that they come to.

    None of what is ``calibrated``: every pour sets that by itself.
    """
    found = []
    known = set(parameters(scene)) - set(calibrated) - set(pour_rig(scene).forgets)
    for change in (*CHANGES, *(Change(*own) for own in pour_rig(scene).quick_changes.items())):
        if "insertion.protocol" in change.choices and scene.numerics.duration > 0.0:
            continue  # filled first, it would be read before it has run out
        if not set(change.factors) | set(change.choices) <= known:
            continue
        values: dict[str, float | str] = {path: f * float(value(scene, path)) for path, f in change.factors.items()}
        values |= change.choices
        if values and all(value(scene, path) == new for path, new in values.items()):
            continue  # as it is already
        with suppress(ParameterError):  # beyond what the rig allows
            with_values(scene, dict(values))
            found.append((change, values))
    return found
