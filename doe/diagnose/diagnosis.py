"""The whole loop: make training pours, weigh the models by the data, confirm by fresh pours, suggest the next step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from doe.declared.bodies import body_evidence, wanted_bodies
from doe.declared.budget import Budget
from doe.declared.model import Declared, declare
from doe.declared.pour_end import OnPour
from doe.declared.pours import ROOT, ModelPours
from doe.diagnose.candidate_experiments import CandidateExperiments, acting_in, checked_by_bodies, next_experiment
from doe.diagnose.compared_features import Compared, measured, weighed
from doe.diagnose.confirm import Confirmed, confirm, model_of, residual_maps
from doe.diagnose.emulator import Lessons
from doe.diagnose.posterior import Posterior, gain_by_pours, holds
from doe.diagnose.result import BASE, NO_EFFECT, Level, Offered, Suggestion
from doe.diagnose.training_pours import Say, TrainingPours
from doe.diagnose.verdict import NOTHING_FROM, THRESHOLD, Verdict, candidate, read_in, taken_back, verdict_of
from doe.errors import MeasurementError
from doe.holdout import CONTRADICTED, HeldOut, HoldoutCondition, HoldoutError, held_out, holdout_errors
from doe.measurement.bodies import MeasuredBody
from doe.measurement.features import SCAN, feature_set
from doe.measurement.measurement import Condition, Measurement
from doe.measurement.residual_map import ResidualMap
from doe.measurement.summaries import replicates_of, summary_names
from doe.pour_runner import Pours
from doe.store import Store

FloatArray = npt.NDArray[np.float64]
PoursAt = Callable[[Sequence[Condition], int | None], ModelPours]
"""Returns the pours of the declared model in conditions; second argument: place in the data where they may be added."""

FRESH = 8
"""Pours per model and condition in the confirmation, or the number of replicates if that is larger."""
SETTLED, QUIET = 0.95, 0.8
"""Probabilities of an effect that has had a closer look, and of nothing missing, from which no further look is taken.
If the most probable effect has had one, ``NOTHING_FROM`` of nothing suffices: more pours add nothing to the data."""
HELD = 2
"""Successive closer looks that leave an effect at ``THRESHOLD`` or more after which no further one is taken."""
LITTLE = 0.1
"""Negligible rise of a log evidence: it changes the odds by a tenth, before ``TEMPERATURE``."""
FIRST_OTHER_ROOT = 100
"""First root of other seeds; those below belong to laboratories and reference pours."""
MOST_RIVALS = 4
"""Largest number of answers for which the next experiment is chosen."""


@dataclass(frozen=True)
class Diagnosis:
    """The result. ``fit_error`` and ``holdout_error`` are from fresh pours; the latter is empty without a holdout."""

    declared: Declared
    conditions: tuple[Condition, ...]
    """Conditions of the data and of a follow-up, in the order of the blocks below."""
    levels: tuple[Level, ...]
    offered: tuple[Offered, ...]
    verdict: Verdict
    before: Confirmed
    after: Confirmed
    """By ``verdict.final``: the same as ``before`` where that is the base model."""
    fit_error: tuple[HoldoutError, ...]
    holdout_error: tuple[HoldoutError, ...]
    held_out: HeldOut | None
    """What the held-out data say about the final model; None without such data."""
    maps: tuple[ResidualMap, ...]
    """Where in the scanned piles the residual is, before and after."""
    suggestions: tuple[Suggestion, ...]
    pours: int
    """Number of pours that were really run; the others were found in the store."""
    settings: int
    bodies: tuple[MeasuredBody, ...] = ()


@dataclass(frozen=True)
class Conclusion:
    """Fresh pours of the calibrated base model and the final one, and what held-out data say about the latter."""

    before: Confirmed
    after: Confirmed
    held_out: HeldOut | None


def run_diagnosis(
    measurement: Measurement,
    store: Store,
    pours: Pours,
    effects: Sequence[str],
    budget: Budget,
    say: Say,
    on_pour: OnPour | None = None,
    seed: int = 0,
    follow_ups: Sequence[Measurement] = (),
    plan_next: bool = True,
) -> Diagnosis:
    """Diagnose ``measurement`` against its declared model, with ``effects`` as candidates.

    Data sets of one model share their pours; another ``seed`` gives other pours. ``follow_ups`` are fitted as well, in
    the order in which they were asked for. ``plan_next``: whether to look for what could be measured next.
    """
    declared, paths = declare(measurement, effects), [p.path for p in measurement.parameters]
    measurement = joined(measurement, *follow_ups)
    root = ROOT if seed == 0 else FIRST_OTHER_ROOT + seed

    def pours_in(conditions: Sequence[Condition], place: int | None = None) -> ModelPours:
        return ModelPours(conditions, paths, store, pours, on_pour, root, place)

    model, everywhere = pours_in(measurement.fit), pours_in(measurement.conditions)
    training = TrainingPours(declared, measurement.fit, model, budget, say)
    compared = pursued(training, measurement, budget, say, follow_ups)
    verdict = verdict_of(compared, declared, training.pours, follow_ups)
    say(f"verdict: {verdict.kind}")
    confirmed, verdict = concluded(verdict, compared, declared, measurement.conditions, everywhere, say)
    candidates = CandidateExperiments((), 0)
    if plan_next:
        say("looking for what single bodies would tell, and what to measure next")
        candidates = suggested(verdict, compared.posterior, training, measurement, pours_in)
    return Diagnosis(
        declared=declared,
        conditions=measurement.conditions,
        bodies=measurement.bodies,
        levels=training.levels,
        offered=tuple(offered(condition, c, compared) for c, condition in enumerate(measurement.fit)),
        verdict=verdict,
        before=confirmed.before,
        after=confirmed.after,
        fit_error=errors_of(measurement.conditions, "fit", confirmed),
        holdout_error=errors_of(measurement.conditions, "holdout", confirmed),
        held_out=confirmed.held_out,
        maps=residual_maps(
            measurement.conditions, confirmed.before, confirmed.after, everywhere, fresh_pours(measurement.conditions)
        ),
        suggestions=candidates.suggestions,
        pours=model.run_now + everywhere.run_now + candidates.run_now,
        settings=training.settings,
    )


def joined(measurement: Measurement, *follow_ups: Measurement) -> Measurement:
    """Return ``measurement`` with the fitted conditions and the single bodies of ``follow_ups``, in their order.

    Raises MeasurementError if a follow-up has other parameters, or a condition whose name is already used.
    """
    for one in follow_ups:
        if one.conditions and one.parameters != measurement.parameters:
            raise MeasurementError(f"{one.folder}: its [parameters] differ from those of {measurement.folder}")
        known = {condition.name for condition in measurement.conditions}
        for name in (condition.name for condition in one.fit):
            if name in known:
                raise MeasurementError(f"{one.folder}: condition {name!r} is already in {measurement.folder}")
        conditions = (*measurement.fit, *one.fit, *measurement.holdout)
        measurement = replace(measurement, conditions=conditions, bodies=(*measurement.bodies, *one.bodies))
    return measurement


def pursued(
    training: TrainingPours, measurement: Measurement, budget: Budget, say: Say, follow_ups: Sequence[Measurement]
) -> Compared:
    """Models and data after closer looks at what is in question; ``measurement`` already contains ``follow_ups``."""
    data = [measured(condition) for condition in measurement.fit]
    instruments, looked = training.instruments(data), set[str]()
    parts = [(len(data), measurement)]
    for one in reversed(follow_ups):
        # Data that settle the question need no look, but the looks before a follow-up are made in its set-up too.
        number, known = parts[0]
        bodies = known.bodies[: len(known.bodies) - len(one.bodies)]
        parts.insert(0, (number - len(one.fit), replace(known, bodies=bodies)))
    for number, part in parts:
        by_bodies = partial(weighed, ways=training.ways, bodies=body_evidence(part, training.declared))
        weigh = partial(by_bodies, conditions=data[:number], instruments=instruments[:number])
        compared = _settled(training, weigh, budget, say, looked)
        label, sure = candidate(compared.posterior, bool(follow_ups))
        if sure >= THRESHOLD:
            training.refine(compared.posterior, label)
            compared = weigh(training.lessons())
            say(f"with pours on both sides of its best fit: {odds(compared.posterior)}")
            compared = compared.refitted(("base", compared.posterior.best[0]))
    return compared.asked_of_typical(read_in(compared.posterior))


def _settled(
    training: TrainingPours, weigh: Callable[[Lessons], Compared], budget: Budget, say: Say, looked: set[str]
) -> Compared:
    """Models and data after closer looks. ``looked``: effects that have had one; new ones are added."""
    compared = weigh(training.lessons())
    say(f"after screening: {odds(compared.posterior)}")
    held, before = 0, ""
    for _ in range(budget.looks):
        found = compared.posterior
        name, p = found.best if found.effects else ("", 0.0)
        named = set(name.split("+"))
        seen = named <= looked
        held = (held if name == before else 0) + 1 if p >= THRESHOLD and seen else 0
        before = name
        settled = found.nothing >= (NOTHING_FROM if seen else QUIET) or (held > 0 and p >= SETTLED) or held >= HELD
        if not any(training.ways[way].effect in named for way, _ in training.at_end(found)):
            if settled:
                break
            if seen and (rival := inseparable(compared, name)):
                say(f"no pours can tell {name} from {rival}: they differ by less than the noise of the data")
                break
        if not (poured := training.look(found)):
            break
        looked |= set(poured)
        compared = weigh(training.lessons())
        say(f"after a closer look at {', '.join(poured)}: {odds(compared.posterior)}")
    return compared


def inseparable(compared: Compared, name: str) -> str:
    """An answer that no number of pours tells from the effect ``name`` and that keeps it from being named; "" for none.

    A name needs ``THRESHOLD``, which it cannot reach while another answer without it alone holds more than the rest.
    """
    found = compared.posterior
    everything = {**found.effects, "base": found.nothing}
    rivals = [label for label, p in everything.items() if not holds(label, name) and p > 1.0 - THRESHOLD]
    for label in rivals:
        if gain_by_pours(found.fits[name], found.fits[label], compared.emulator, compared.data) < LITTLE:
            return "nothing missing" if label == "base" else label
    return ""


def concluded(
    verdict: Verdict,
    compared: Compared,
    declared: Declared,
    conditions: Sequence[Condition],
    pours: ModelPours,
    say: Say,
) -> tuple[Conclusion, Verdict]:
    """Fresh pours of the final and the base model in ``conditions``, those of ``pours``, and the verdict after them."""
    fits = compared.posterior.fits
    asked = [model_of(fits[label], declared) for label in dict.fromkeys(("base", verdict.final))]
    confirmed = confirm(
        asked, pours, fresh_pours(conditions), [len(summary_names(condition)) for condition in conditions]
    )
    before, after = confirmed[0], confirmed[-1]
    places = [c for c, condition in enumerate(conditions) if condition.role == "holdout"]
    data = [replicates_of(conditions[c]) for c in places]
    fit = 1.0 if verdict.kind.startswith("ambiguous") else fits[verdict.final].p
    told = held_out(verdict.final, data, [after.blocks[c] for c in places], fit)
    if told is not None and verdict.kind.startswith("ambiguous") and NO_EFFECT in verdict.kind:
        # "Nothing missing" is left as well, and stands as long as they do not contradict it.
        nothing = held_out(BASE, data, [before.blocks[c] for c in places])
        told = told if nothing is None else max(told, nothing, key=lambda one: one.together)
    if told is not None and told.together < CONTRADICTED and (verdict.names or verdict.kind == NO_EFFECT):
        verdict = taken_back(verdict, f"{told.summary} of {told.condition} is {told.farthest:.1f} standard errors off")
        say(f"with held-out data: {verdict.kind}")
    return Conclusion(before, after, told), verdict


def fresh_pours(conditions: Sequence[Condition]) -> int:
    """Number of pours per model and condition in the confirmation."""
    return max([FRESH, *(condition.replicates for condition in conditions)])


def odds(found: Posterior) -> str:
    """The most probable answers as text."""
    everything = {**found.effects, "nothing missing": found.nothing, "something else": found.outside}
    first = sorted(everything, key=lambda one: -everything[one])[:3]
    return ", ".join(f"{one} {100.0 * everything[one]:.0f} %" for one in first if everything[one] >= 0.005)


def suggested(
    verdict: Verdict, found: Posterior, training: TrainingPours, measurement: Measurement, pours_in: PoursAt
) -> CandidateExperiments:
    """What to measure next: a changed set-up and bodies if the verdict is ambiguous, otherwise bodies alone."""
    if not verdict.kind.startswith("ambiguous"):
        return CandidateExperiments(checked_by_bodies(verdict, found, training.declared, measurement), 0)
    weights = {label: found.effects[label] for label in verdict.names[:MOST_RIVALS]}
    if any("+" in label and p >= THRESHOLD for label, p in weights.items()):
        # Their probability rests on the sum of two effects, which is what another set-up has to show: all count alike.
        weights = dict.fromkeys(weights, 1.0 / len(weights))
    if NO_EFFECT in verdict.kind or len(weights) < 2:
        weights[BASE] = found.nothing
    answers = [acting_in(found, label) for label in dict.fromkeys((*verdict.names, *weights))]
    bodies, place = wanted_bodies(measurement, training.declared, answers), len(measurement.fit)
    candidates = next_experiment(
        training, found, weights, measurement.fit[0], lambda set_ups: pours_in(set_ups, place), bodies
    )
    # The experiment is chosen for the likeliest answers; its rivals are all that remain.
    left = (*verdict.names, *(label for label in weights if label == BASE))
    return CandidateExperiments(tuple(replace(one, rivals=left) for one in candidates.suggestions), candidates.run_now)


def offered(condition: Condition, c: int, compared: Compared) -> Offered:
    """What the data of a fitted condition offer."""
    names = feature_set(condition)
    data = measured(condition)
    return Offered(condition.name, data.offer, len(compared.names[c]), names.offered(SCAN) - len(data.names))


def errors_of(conditions: Sequence[Condition], role: str, found: Conclusion) -> tuple[HoldoutError, ...]:
    """Errors over the conditions of ``role``, except those without a measured replicate or two pours of each model."""
    compared = []
    for c, condition in enumerate(conditions):
        measured, poured = replicates_of(condition), (found.before.blocks[c], found.after.blocks[c])
        if condition.role == role and len(measured.values) and min(map(len, poured)) >= 2:
            compared.append(HoldoutCondition(measured, *poured))
    return holdout_errors(compared) if compared else ()
