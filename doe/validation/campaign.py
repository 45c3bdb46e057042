"""The blind campaign: laboratories pour, the diagnosis answers, and the answers are kept.

A set takes ``REPLICATES`` pours per condition and is judged twice, by its table of numbers alone and with its scans.
The pours that teach belong to the declared model, so that sets share them through the store. Two processes with
``--shard 1/2`` and ``--shard 2/2`` work on one campaign.
"""

import os
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from doe.declared.model import declare
from doe.declared.pours import ModelPours
from doe.diagnose.budget import Budget
from doe.measurement.features import SCALARS, feature_set
from doe.store import Store, default_store
from doe.validation.answers import Answers
from doe.validation.laboratory import TREFOILS, Laboratory, read_laboratory
from doe.validation.limit import limit_study
from doe.validation.outside import AMPLITUDE, DEVELOPMENT, possible
from doe.validation.reference import ROOT as REFERENCE_ROOT
from doe.validation.reference import extended_to, kept
from doe.validation.sets import Row, append_rows, read_rows
from doe.validation.truth import Case, Strengths, cases, strengths_of
from doe.validation.work_place import OutOfTimeError, WorkPlace
from solver import EFFECTS, PHYSICS

SETS = "sets.jsonl"
ROUNDS = 4
"""Rounds of reference pours for a laboratory that has none: 48 pours of each effect, strengths to some 8 %."""

Say = Callable[[str], None]


@dataclass(frozen=True)
class CampaignOrder:
    """What is asked for.

    minutes: stop after so long, infinite by default; 0: judge nothing. shard: every ``of``-th set from the ``shard``-th
    on. wide: sets of all strengths, for development. follow_up: whether ambiguous answers are followed up, which takes
    most of the time. cases: instead of the schedule's. strengths: instead of those by the laboratory's reference pours.
    """

    out: Path
    number: int
    root: int = 1
    store: Path | None = None
    minutes: float = float("inf")
    workers: int | None = None
    shard: int = 1
    of: int = 1
    wide: bool = False
    follow_up: bool = True
    laboratory: Path = TREFOILS
    effects: tuple[str, ...] = tuple(EFFECTS)
    budget: Budget = Budget()
    cases: tuple[Case, ...] = ()
    strengths: Strengths | None = None

    def asked(self, laboratory: Laboratory) -> tuple[Case, ...]:
        """The data sets."""
        kinds = possible(laboratory.declared.scene, DEVELOPMENT if self.wide else tuple(AMPLITUDE))
        found = self.cases or tuple(cases(self.root, self.number, kinds, self.wide))
        return found[self.shard - 1 :: self.of]


def run_campaign(order: CampaignOrder, say: Say) -> list[Row]:
    """Answer the data sets that ``sets.jsonl`` does not hold yet, until all are there or the time is over."""
    order.out.mkdir(parents=True, exist_ok=True)
    path, laboratory = order.out / SETS, read_laboratory(order.laboratory)
    title, asked = laboratory.declared.title, order.asked(laboratory)
    known = {(row.root, row.number) for row in read_rows(path) if row.laboratory == title}
    todo = [case for case in asked if case.seed not in known]
    say(f"{path}: {len(asked) - len(todo)} of {len(asked)} data sets are there")
    deadline = time.monotonic() + 60.0 * order.minutes
    if todo and order.minutes > 0.0:
        with ExitStack() as stack:
            store = Store(order.store or default_store())
            stack.callback(store.close)
            place = stack.enter_context(WorkPlace(store, order.workers or os.cpu_count() or 1, deadline))
            try:
                strengths = order.strengths or measured_strengths(order, laboratory, place, say)
                answers = Answers(laboratory, strengths, place, order.budget, order.follow_up)
                for case in todo:
                    rows = answers.rows(case)
                    append_rows(path, rows)
                    for row in rows:
                        what = f"{row.kind} {row.label} {row.strength:g}, {row.offer}"
                        say(f"{row.number}: {what}: {row.verdict} ({row.answer}), {row.seconds:.0f} s")
            except OutOfTimeError:
                say(f"{order.minutes:g} min are over; all pours are kept, and the same command goes on")
    wanted = {case.seed for case in asked}
    return [row for row in read_rows(path) if row.laboratory == title and (row.root, row.number) in wanted]


def measured_strengths(order: CampaignOrder, laboratory: Laboratory, place: WorkPlace, say: Say) -> Strengths:
    """Amplitudes of given strengths by the laboratory's reference pours, which are made where it has none."""
    measurement = laboratory.declared
    declared = declare(measurement, order.effects)
    path = laboratory.reference or order.out / f"reference_{measurement.title}.npz"
    found = kept(path, measurement, PHYSICS)
    if laboratory.reference is None:
        paths = [parameter.path for parameter in measurement.parameters]
        pours = ModelPours(measurement.fit, paths, place.store, place.pours, place.look_at_the_clock, REFERENCE_ROOT)
        found = extended_to(found, ROUNDS, declared, pours, path, say)
    numbers = [feature_set(condition).offered(SCALARS) for condition in measurement.fit]
    study = limit_study(found.sample, found.levels, {SCALARS: numbers})
    effects = {one.kind.name: one.kind.effect for one in study.reached}
    cosines: dict[frozenset[str], float] = {}
    for pair in study.confusable:
        both = frozenset((effects[pair.first], effects[pair.second]))
        cosines[both] = max(cosines.get(both, 0.0), abs(pair.cosine))
    return strengths_of(study.reached, declared, cosines)
