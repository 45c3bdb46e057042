"""The blind campaign: laboratories pour, the diagnosis answers, and the answers are kept.

The declared model is screened once, six times as far as in a diagnosis; each data set is judged from those runs and
from pours at the best fits of its own contenders. A set takes ``REPLICATES`` pours per fitted condition. Where
something is named, the held-out condition is measured too and predicted by the contenders; where the name is right,
also by fresh pours of the calibrated base model and of the named one.
"""

import os
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from doe.diagnose.declare import declare
from doe.diagnose.runs import Declared
from doe.diagnose.simulation.budget import Budget
from doe.diagnose.simulation.plan import directions
from doe.diagnose.simulation.pours import Ended, ModelPours
from doe.diagnose.simulation.screen import Screened, over_wider_ranges, screen
from doe.measurement import Measurement
from doe.store import Store, default_store
from doe.validation.answers import Answers
from doe.validation.laboratory import MODEL, declared_model
from doe.validation.outside import AMPLITUDE
from doe.validation.schedule import STRENGTHS, Case, cases
from doe.validation.sets import Row, append_row, read_rows
from doe.validation.truth import ruler
from doe.validation.work_place import OutOfTimeError, WorkPlace
from solver import EFFECTS

SETS = "sets.csv"
CHUNK = 6
"""Data sets that are poured, judged and written together."""
SAID_EVERY = 100
"""Pours of the emulator between two lines of progress."""

BUDGET = Budget(base=160, middle=32, scaling=2, screening=60, widened=60)
"""The runs belong to the declared model and are made once for all its data sets: a campaign affords about twice those
of one diagnosis per effect, and three times those of the base model."""

Say = Callable[[str], None]


@dataclass(frozen=True)
class CampaignOrder:
    """What is asked for.

    minutes: stop after so long, infinite by default; 0: judge nothing. cases: instead of the schedule's.
    """

    out: Path
    number: int
    store: Path | None = None
    minutes: float = float("inf")
    workers: int | None = None
    model: Path = MODEL
    effects: tuple[str, ...] = tuple(EFFECTS)
    budget: Budget = BUDGET
    cases: tuple[Case, ...] = ()

    @cached_property
    def asked(self) -> tuple[Case, ...]:
        """The data sets."""
        return self.cases or tuple(cases(self.number, self.effects, tuple(AMPLITUDE)))


def run_campaign(order: CampaignOrder, say: Say) -> list[Row]:
    """Answer the data sets that ``sets.csv`` does not hold yet, until all are there or the time is over."""
    order.out.mkdir(parents=True, exist_ok=True)
    path = order.out / SETS
    known = {row.number for row in read_rows(path)}
    todo = [case for case in order.asked if case.number not in known]
    say(f"{path}: {len(known)} data sets are there, {len(todo)} to come")
    deadline = time.monotonic() + 60.0 * order.minutes
    if todo and order.minutes > 0.0:
        with ExitStack() as stack:
            store = Store(order.store or default_store())
            stack.callback(store.close)
            place = stack.enter_context(WorkPlace(store, order.workers or os.cpu_count() or 1, deadline))
            try:
                _answer(order, todo, place, path, say)
            except OutOfTimeError:
                say(f"{order.minutes:g} min are over; all pours are kept, and the same command goes on")
    asked = {case.number for case in order.asked}
    return [row for row in read_rows(path) if row.number in asked]


def emulated(order: CampaignOrder, measurement: Measurement, place: WorkPlace, say: Say) -> Screened:
    """The declared model with every effect screened; from the store where it is there."""
    paths = [parameter.path for parameter in measurement.parameters]

    def on_pour(what: str, left: int, _: Ended) -> None:
        place.look_at_the_clock()
        if left > 0 and left % SAID_EVERY == 0:
            say(f"{what}: {left} pours to come")

    model = ModelPours(measurement.fit, paths, place.store, place.crew.run_queue, on_pour)
    widest = declare(measurement, order.effects)
    screened = screen(widest, model, order.budget, say)
    weak = short_of(max(STRENGTHS), screened, widest)
    return over_wider_ranges(screened, weak, widest, model, order.budget, say) if weak else screened


def short_of(strength: float, screened: Screened, widest: Declared) -> list[str]:
    """Effects that do not shift by ``strength`` σ in the middle of the box, where the literature supports more."""
    measure = ruler(screened.declared, screened.runs, widest.effects)
    middle = np.zeros(len(widest.parameters))
    names = []
    for e, (effect, end) in enumerate(zip(screened.declared.effects, widest.effects, strict=True)):
        if e in measure.emulator.simulated_effects and max(effect.high) < max(end.high):
            full = [measure.within(e, np.array(way) / effect.scale) for way in directions(effect)]
            if max(measure.shift(e, middle, amplitude) for amplitude in full) < strength:
                names.append(effect.name)
    return names


def _answer(order: CampaignOrder, todo: Sequence[Case], place: WorkPlace, path: Path, say: Say) -> None:
    measurement = declared_model(order.model)
    screened = emulated(order, measurement, place, say)
    widest = declare(measurement, order.effects).effects
    answers = Answers(order.model, measurement, screened, ruler(screened.declared, screened.runs, widest), place)
    for first in range(0, len(todo), CHUNK):
        for row in answers.rows(todo[first : first + CHUNK]):
            append_row(path, row)
            say(f"{row.number}: {row.kind} {row.label} {row.strength:g}: {row.verdict} ({row.answer})")
        place.look_at_the_clock()
