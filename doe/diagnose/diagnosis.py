"""The whole loop: simulate the declared model, judge the data, confirm by fresh pours, say what to measure next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from doe.diagnose.decision.decide import diagnose
from doe.diagnose.decision.verdict import Verdict
from doe.diagnose.declare import complete_rows, declare, observe
from doe.diagnose.emulation.fresh_pours import FreshPours
from doe.diagnose.follow_up.closer import LOOKS, MODELS, contenders, lost, near_best, poured, with_new
from doe.diagnose.follow_up.confirm import Confirmed, Model, confirm, fitted
from doe.diagnose.follow_up.held_out import HeldOut, compared, predictions, ruled_out, upheld
from doe.diagnose.follow_up.holdout import HoldoutCondition, HoldoutError, holdout_errors
from doe.diagnose.follow_up.menu import Suggestion, next_experiment
from doe.diagnose.runs import Declared, Observed
from doe.diagnose.simulation.budget import Budget
from doe.diagnose.simulation.pours import ModelPours, OnPour
from doe.diagnose.simulation.screen import Say, Screened, continued, over_wider_ranges, screen
from doe.measurement.measurement import Measurement
from doe.measurement.summaries import summary_names
from doe.runner import Pours
from doe.store import Store

WIDENINGS = 3
"""Times that a range may be doubled before the next look."""
Wanting = Callable[[Verdict, Declared, Declared], tuple[str, ...]]
"""Effects that want more range: from a verdict, the ranges simulated so far, and the widest."""
FRESH = 8
"""Pours per model and condition in the confirmation, or as many as there are replicates if that is more."""


@dataclass(frozen=True)
class Diagnosis:
    """What came out. ``fit_error`` and ``holdout_error`` are by fresh pours; the latter is empty without a holdout."""

    declared: Declared
    verdict: Verdict
    before: Confirmed
    after: Confirmed
    """The same as ``before`` where no effect is named."""
    fit_error: tuple[HoldoutError, ...]
    holdout_error: tuple[HoldoutError, ...]
    held_out: tuple[HeldOut, ...]
    """Contenders beside the named model on held-out data; empty without a name or without such data."""
    suggestions: tuple[Suggestion, ...]
    pours: int
    """Pours that were really run; the others were found in the store."""
    settings: int


def run_diagnosis(
    measurement: Measurement,
    store: Store,
    pours: Pours,
    effects: Sequence[str],
    budget: Budget,
    say: Say,
    on_pour: OnPour | None = None,
) -> Diagnosis:
    """Diagnose ``measurement`` against its declared model, with ``effects`` as candidates."""
    declared, paths = declare(measurement, effects), [p.path for p in measurement.parameters]
    model = ModelPours(measurement.fit, paths, store, pours, on_pour)
    everywhere = ModelPours(measurement.conditions, paths, store, pours, on_pour)
    observed = observe(measurement.fit)
    screened, verdict, fresh = pursued(screen(declared, model, budget, say), declared, observed, model, budget, say)
    say(f"verdict: {verdict.kind}")
    held_out = contenders_held_out(verdict, measurement, everywhere)
    if held_out:
        if gone := ruled_out(verdict, held_out):
            verdict = diagnose(screened.declared, screened.runs, observed, fresh=fresh, ruled_out=gone)
        verdict = upheld(verdict, held_out)
        say(f"with held-out data: {verdict.kind}")
    number = max(FRESH, *(condition.replicates for condition in measurement.conditions))
    widths = [len(summary_names(condition)) for condition in measurement.conditions]
    confirmed = confirm(tuple(dict.fromkeys(models(verdict))), everywhere, number, widths)
    before, after = confirmed[0], confirmed[-1]
    menu = next_experiment(verdict, measurement.fit[0], paths, store, pours, on_pour)
    return Diagnosis(
        declared=screened.declared,
        verdict=verdict,
        before=before,
        after=after,
        fit_error=errors_of(measurement, "fit", before, after),
        holdout_error=errors_of(measurement, "holdout", before, after),
        held_out=held_out,
        suggestions=menu.suggestions,
        pours=model.run_now + everywhere.run_now + menu.run_now,
        settings=len(screened.points),
    )


def pursued(
    screened: Screened, widest: Declared, observed: Observed, model: ModelPours, budget: Budget, say: Say
) -> tuple[Screened, Verdict, tuple[FreshPours, ...]]:
    """The verdict once what is in question has been poured about its fits, over wider ranges where one ends.

    With the runs and the pours that it rests on.
    """
    verdict = diagnose(screened.declared, screened.runs, observed)
    say(f"after screening: {verdict.kind}")

    def widened(find: Wanting, why: str = "", fresh: Sequence[FreshPours] = ()) -> tuple[Screened, Verdict]:
        """Runs and verdict once the effects that ``find`` tells have wider ranges, as long as it tells any."""
        now, found = screened, verdict
        for _ in range(WIDENINGS):
            names = find(found, now.declared, widest)
            if not names:
                break
            now = over_wider_ranges(now, names, widest, model, budget, say)
            found = diagnose(now.declared, now.runs, observed, fresh=fresh)
            say(f"wider range of {', '.join(names)}{why}: {found.kind}")
        return now, found

    screened, verdict = widened(out_of_sight, ", which could not be seen")
    fresh: tuple[FreshPours, ...] = ()
    for look in range(1 + LOOKS):
        screened, verdict = widened(partial(at_edge, fresh=fresh), fresh=fresh)
        closer = contenders(verdict, screened.declared, fresh)
        if look == LOOKS or not closer:
            break
        fresh = with_new(fresh, poured(closer, screened.declared, model, [fresh] * len(closer)))
        verdict = diagnose(screened.declared, screened.runs, observed, fresh=fresh)
        say(f"poured about the best fits of {', '.join(one.label for one in closer)}: {verdict.kind}")
        if names := lost(verdict, [one.label for one in closer]):
            screened = continued(screened, "second look", names, budget.second_look, model, say)
            verdict = diagnose(screened.declared, screened.runs, observed, fresh=fresh)
            say(f"after second look: {verdict.kind}")
    return screened, verdict, fresh


def contenders_held_out(verdict: Verdict, measurement: Measurement, pours: ModelPours) -> tuple[HeldOut, ...]:
    """The named models and their rivals on the held-out conditions of ``pours``."""
    places = [c for c, condition in enumerate(measurement.conditions) if condition.role == "holdout"]
    conditions = [measurement.conditions[c] for c in places]
    data = [complete_rows(condition) for condition in conditions]
    widths = [len(summary_names(condition)) for condition in conditions]
    if not data or min(map(len, data)) < 2:
        return ()
    return compared(verdict, data, predictions(verdict, pours, widths, places))


def out_of_sight(verdict: Verdict, now: Declared, widest: Declared) -> tuple[str, ...]:
    """Effects that these data cannot see over the range simulated so far, with more of it in the literature.

    A range is found by the whole shift of the summaries; what calibration takes up of it is known only now.
    """
    room = with_room(now, widest)
    return tuple(row.name for row in verdict.effects if row.status == "not identifiable here" and row.name in room)


def with_room(now: Declared, widest: Declared) -> set[str]:
    """Effects of which the literature supports more than has been simulated."""
    pairs = zip(now.effects, widest.effects, strict=True)
    return {effect.name for effect, end in pairs if max(effect.high) < max(end.high)}


def at_edge(verdict: Verdict, now: Declared, widest: Declared, fresh: Sequence[FreshPours]) -> tuple[str, ...]:
    """Effects near the best, driven to an end of their range, with more in the literature, that pours have borne out.

    Most of those that an emulator alone drives there fall behind when they are poured, and need no more range.
    """
    room, known = with_room(now, widest), {one.members for one in fresh}
    near = near_best([model for model in verdict.models if len(model.members) == 1], MODELS)
    ends = [m for m in near if m.label in room and any(amplitude.at_edge for amplitude in m.amplitudes)]
    return tuple(m.label for m in ends if m.members in known)


def models(verdict: Verdict) -> tuple[Model, Model]:
    """The calibrated base model, and the best one that the verdict names (the base model where it names none)."""
    before = fitted(verdict, "base")
    return before, fitted(verdict, verdict.names[0]) if verdict.names else before


def errors_of(measurement: Measurement, role: str, before: Confirmed, after: Confirmed) -> tuple[HoldoutError, ...]:
    """Errors over the conditions of ``role``; those with fewer than two readable pours on any side are left out."""
    conditions = []
    for c, condition in enumerate(measurement.conditions):
        rows = complete_rows(condition), before.blocks[c], after.blocks[c]
        if condition.role == role and min(map(len, rows)) >= 2:
            conditions.append(HoldoutCondition(condition.name, summary_names(condition), *rows))
    return holdout_errors(conditions) if conditions else ()
