"""The blind campaign, from cases to rows: laboratories pour, the diagnosis answers, and the answers are kept.

Truths are drawn, poured, diagnosed with and without scans, and tested on held-out data. A data set takes ``REPLICATES``
pours per condition and is judged twice, by its table of numbers alone and with its scans. The teaching pours belong to
the declared model, so data sets share them through the store. Two processes with ``--shard 1/2`` and ``--shard 2/2``
share one campaign.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from doe.declared.budget import Budget
from doe.declared.model import declare
from doe.declared.points import Point
from doe.declared.pours import ModelPours, room_of
from doe.diagnose.candidate_experiments import as_suggested
from doe.diagnose.diagnosis import concluded, errors_of, joined, pursued, suggested
from doe.diagnose.result import Suggestion
from doe.diagnose.training_pours import TrainingPours
from doe.diagnose.verdict import verdict_of
from doe.measurement import Condition, Measurement, load_measurement
from doe.measurement.features import SCALARS, SCAN, feature_set
from doe.store import Store, default_store
from doe.validation.laboratory import TREFOILS, Laboratory, LaboratoryPour, read_laboratory, table_of_bodies
from doe.validation.limit import limit_study
from doe.validation.outside import possible_outside
from doe.validation.reference import ROOT as REFERENCE_ROOT
from doe.validation.reference import extended_to, kept
from doe.validation.scanner import Scanner
from doe.validation.sets import NONE, OUT_OF_REACH, SetRow, append_rows, read_rows
from doe.validation.truth import REPLICATES, ROOT, Case, Strengths, Truth, cases, strengths_of, truth_of
from doe.validation.work_place import CampaignListener, OutOfTimeError, PourOrder, WorkPlace, complete
from solver import EFFECTS, PHYSICS, available_cores

Data = dict[str, list[LaboratoryPour]]
"""Pours per condition."""
Say = Callable[[str], None]

TRIES = 3
"""Batches of ``REPLICATES`` pours that a laboratory tries at most, to replace pours that jammed."""
OFFERS = (SCALARS, SCAN)
"""Kinds of data by which every data set is judged."""
NAN = float("nan")
SETS = "sets.jsonl"
ROUNDS = 4
"""Rounds of reference pours for a laboratory that has none: 48 pours of each effect, strengths known to some 8 %."""


@dataclass(frozen=True)
class CampaignOrder:
    """Settings of a campaign.

    minutes: time limit, infinite by default; 0: judge nothing. scheduler: address of the Dask scheduler whose workers
    pour. shard: take every ``of``-th set, starting with the ``shard``-th. only: numbers of the sets to judge, all if
    empty. wide: sets of all strengths, for development.
    follow_up: whether the measurements that an answer asks for are made, which takes most of the time. cases: replace
    the scheduled ones. strengths: replace those measured by the laboratory's reference pours.
    """

    out: Path
    number: int
    root: int = 1
    store: Path | None = None
    minutes: float = float("inf")
    workers: int | None = None
    scheduler: str = ""
    shard: int = 1
    of: int = 1
    only: tuple[int, ...] = ()
    wide: bool = False
    follow_up: bool = True
    laboratory: Path = TREFOILS
    effects: tuple[str, ...] = tuple(EFFECTS)
    budget: Budget = Budget()
    cases: tuple[Case, ...] = ()
    strengths: Strengths | None = None

    def asked(self, laboratory: Laboratory) -> tuple[Case, ...]:
        """The cases of this shard, or those of them that are asked for."""
        scenes = [condition.scene for condition in laboratory.declared.conditions]
        kinds = possible_outside(scenes, development=self.wide)
        found = self.cases or tuple(cases(self.root, self.number, kinds, self.wide))
        return tuple(case for case in found[self.shard - 1 :: self.of] if not self.only or case.number in self.only)


@dataclass(frozen=True)
class Judged:
    """The row of a data set, and what to measure next if the answer is ambiguous."""

    row: SetRow
    suggestion: Suggestion | None


def run_campaign(order: CampaignOrder, say: Say, listener: CampaignListener | None = None) -> list[SetRow]:
    """Judge the data sets that ``sets.jsonl`` does not hold yet, until all are judged or the time is over."""
    order.out.mkdir(parents=True, exist_ok=True)
    path, laboratory = order.out / SETS, read_laboratory(order.laboratory)
    title, asked = laboratory.declared.title, order.asked(laboratory)
    known = {(row.root, row.number, row.offer) for row in read_rows(path) if row.laboratory == title}
    todo = [case for case in asked if not known.issuperset((*case.seed, offer) for offer in OFFERS)]
    say(f"{path}: {len(asked) - len(todo)} of {len(asked)} data sets are done")
    deadline = time.monotonic() + 60.0 * order.minutes
    if todo and order.minutes > 0.0:
        with ExitStack() as stack:
            store = Store(order.store or default_store())
            stack.callback(store.close)
            place = stack.enter_context(
                WorkPlace(store, order.workers or available_cores(), deadline, order.scheduler, listener)
            )
            try:
                strengths = order.strengths or measured_strengths(order, laboratory, place, say)
                answers = Answers(laboratory, strengths, place, order.budget, order.follow_up)
                for judged_now, case in enumerate(todo, start=1):
                    rows = answers.rows(case)
                    append_rows(path, rows)
                    for row in rows:
                        what = f"{row.kind} {row.label} {row.strength:g}, {row.offer}"
                        say(f"{row.number}: {what}: {row.verdict} ({row.answer}), {row.seconds:.0f} s")
                    if listener is not None:
                        done = len(asked) - len(todo) + judged_now
                        listener.judged(done, len(asked), judged_now, f"{case.number}: {rows[-1].verdict}")
            except OutOfTimeError:
                say(f"{order.minutes:g} min are over; all pours are kept, and the same command continues")
    wanted = {case.seed for case in asked}
    return [row for row in read_rows(path) if row.laboratory == title and (row.root, row.number) in wanted]


def measured_strengths(order: CampaignOrder, laboratory: Laboratory, place: WorkPlace, say: Say) -> Strengths:
    """Amplitudes of given strengths, from the laboratory's reference pours, which are made first if it has none."""
    measurement = laboratory.declared
    declared = declare(measurement, order.effects)
    path = laboratory.reference or order.out / f"reference_{measurement.title}.npz"
    found = kept(path, measurement, PHYSICS)
    if laboratory.reference is None:
        paths = [parameter.path for parameter in measurement.parameters]
        pours = ModelPours(measurement.fit, paths, place.store, place.pours, place.ended, REFERENCE_ROOT)
        found = extended_to(found, ROUNDS, declared, pours, path, say)
    numbers = [feature_set(condition).offered(SCALARS) for condition in measurement.fit]
    study = limit_study(found.sample, found.levels, {SCALARS: numbers})
    effects = {one.kind.name: one.kind.effect for one in study.reached}
    cosines: dict[frozenset[str], float] = {}
    for pair in study.confusable:
        both = frozenset((effects[pair.first], effects[pair.second]))
        cosines[both] = max(cosines.get(both, 0.0), abs(pair.cosine))
    return strengths_of(study.reached, declared, cosines)


@dataclass(frozen=True, eq=False)
class Answers:
    """Answers cases: the laboratory, the strengths that its truths are drawn from, and the place that pours."""

    laboratory: Laboratory
    strengths: Strengths
    place: WorkPlace
    budget: Budget
    follow_up: bool = True
    """Whether the measurements that an answer asks for are made."""

    @property
    def measurement(self) -> Measurement:
        """The declared model."""
        return self.laboratory.declared

    def rows(self, case: Case) -> list[SetRow]:
        """Rows of ``case``, one for each kind of data."""
        began = time.monotonic()
        truth = truth_of(case, self.strengths)
        data = self.measured(truth, self.measurement.conditions)
        if data is None:
            return [self.out_of_reach(truth, offer) for offer in OFFERS]
        poured = (time.monotonic() - began) / len(OFFERS)
        rows = []
        for offer in OFFERS:
            began = time.monotonic()
            rows.append(self.judged(truth, data, offer))
            rows[-1] = replace(rows[-1], seconds=poured + time.monotonic() - began)
        return rows

    def judged(self, truth: Truth, data: Data, offer: str) -> SetRow:
        """The row of a data set, written to a folder and read like any other, after the follow-up if one is due."""
        seed = (ROOT, *truth.case.seed)
        rng = np.random.default_rng([*seed, 1])
        scanner = Scanner.drawn(rng, self.laboratory.scanner) if offer == SCAN else None
        with TemporaryDirectory() as folder:
            self.laboratory.hand_out(Path(folder), data, scanner, seed)
            measurement = load_measurement(Path(folder))
            first = self.judged_data(measurement, truth, offer)
            if first.suggestion is None:
                return first.row
            found = self.followed_up(truth, first.suggestion, scanner)
            if found is None:
                return first.row
            last = self.judged_data(measurement, truth, offer, (found,))
        return replace(
            last.row,
            first=first.row.verdict,
            follow_up=first.suggestion.experiment.name,
            asked=first.suggestion.pours,
            chance=first.suggestion.experiment.chance,
            pours=first.row.pours + last.row.pours,
        )

    def judged_data(
        self, measurement: Measurement, truth: Truth, offer: str, follow_ups: Sequence[Measurement] = ()
    ) -> Judged:
        """The row of a data set, and what to measure next.

        The diagnosis does not see ``truth``, which only fills and scores the row.
        """
        declared, say = self.strengths.declared, _silent
        measurement = joined(measurement, *follow_ups)
        fitted, held = self.model_pours(measurement.fit), self.model_pours(measurement.holdout)
        training = TrainingPours(declared, measurement.fit, fitted, self.budget, say)
        compared = pursued(training, measurement, self.budget, say, follow_ups)
        verdict = verdict_of(compared, declared, training.pours, follow_ups)
        conclusion, verdict = concluded(verdict, compared, declared, measurement.holdout, held, say)
        found = compared.posterior
        suggestion, more = None, 0
        if self.follow_up and not follow_ups:
            candidates = suggested(verdict, found, training, measurement, self.model_pours)
            suggestion, more = next(iter(candidates.suggestions), None), candidates.run_now
        best, best_p = found.best
        label = label_of(truth)
        true, named = frozenset(label.split("+")), {frozenset(name.split("+")) for name in verdict.names}
        right = verdict.kind.startswith("effect") and named == {true}
        errors = errors_of(measurement.holdout, "holdout", conclusion) if right else ()
        before, after = (errors[-1].before / errors[-1].noise_floor, errors[-1].ratio) if errors else (NAN, NAN)
        theta = declared.theta(truth.theta)
        off = [found.fits[one].theta - theta for one in ("base", verdict.final)] if right else []
        bias_before, bias_after = (float(np.sqrt((d**2).mean())) for d in off) if off else (NAN, NAN)
        told = conclusion.held_out
        row = SetRow(
            laboratory=self.measurement.title,
            root=truth.case.root,
            number=truth.case.number,
            kind=truth.case.kind,
            label=label,
            strength=truth.case.strength,
            amplitude=amplitude_text(truth),
            offer=offer,
            verdict=verdict.kind,
            nothing=found.nothing,
            outside=found.outside,
            best=best,
            best_p=best_p,
            truth_p=next((p for name, p in found.effects.items() if frozenset(name.split("+")) == true), NAN),
            evidence={name: fit.log_evidence for name, fit in found.fits.items() if "+" not in name or name == best}
            | {"outside": found.log_outside},
            fits={name: found.fits[name].p for name in dict.fromkeys(("base", best))},
            held_out_p=told.p if told else NAN,
            before=before,
            after=after,
            bias_before=bias_before,
            bias_after=bias_after,
            pours=fitted.run_now + held.run_now + more,
            physics=PHYSICS,
        )
        return Judged(row, suggestion)

    def followed_up(
        self, truth: Truth, asked: Suggestion, scanner: Scanner | None, occasion: str = "next"
    ) -> Measurement | None:
        """The laboratory's measurements in the set-up that is asked for, and of single bodies; None if its pours keep
        breaking off.
        """
        place = next(c for c, one in enumerate(self.measurement.conditions) if one.name == asked.condition)
        condition = self.measurement.conditions[place]
        changed = replace(as_suggested(condition, asked), name=condition.name)
        data: Data | None = {}
        if asked.pours:
            data = self.measured(truth, [changed], f" {occasion} {asked.experiment.name}", asked.pours)
        if data is None:
            return None
        bodies = ""
        if asked.bodies:
            (order, *_) = self.orders(truth, changed, range(1))
            rng = np.random.default_rng([ROOT, *truth.case.seed, 3])
            bodies = table_of_bodies(order.scene, asked.bodies, rng, order.drawn)
        with TemporaryDirectory() as folder:
            # The table of a changed condition has the format of the condition's own; only the set-up differs.
            own = scanner.of_turned_rig() if scanner is not None and asked.turned else scanner
            self.laboratory.hand_out(Path(folder), data, own, (ROOT, *truth.case.seed, 2), bodies)
            measurement = load_measurement(Path(folder), follow_up=True)
        return replace(measurement, conditions=tuple(as_suggested(read, asked) for read in measurement.fit))

    def measured(
        self, truth: Truth, conditions: Sequence[Condition], occasion: str = "", pours: int = REPLICATES
    ) -> Data | None:
        """A laboratory's ``pours`` in each condition; None if there is no such truth, or if pours keep breaking off.

        ``occasion``: each has its own seeds.
        """
        if truth.missing:
            return None
        for attempt in range(TRIES):
            numbers = range(pours * (attempt + 1))
            orders = [order for c in conditions for order in self.orders(truth, c, numbers, occasion)]
            samples = iter(self.place.pour(orders, room_of(conditions)))
            data = {c.name: complete(next(samples) for _ in numbers)[:pours] for c in conditions}
            if all(len(one) == pours for one in data.values()):
                return data
        return None

    def orders(self, truth: Truth, condition: Condition, numbers: Sequence[int], occasion: str = "") -> list[PourOrder]:
        """Orders of a laboratory's pours ``numbers`` in a condition; seeds follow from the set's root and number."""
        paths = [parameter.path for parameter in self.measurement.parameters]
        laboratory = ModelPours([condition], paths, self.place.store, self.place.pours, root=ROOT)
        name = f"set {truth.case.root}.{truth.case.number} {condition.name}{occasion}"
        points = [Point(name, k, truth.theta, truth.effects) for k in numbers]
        outside = truth.case.label if truth.case.kind == "outside" else ""
        return [PourOrder(laboratory.scene(p, 0), laboratory.seed(p, 0), condition, outside) for p in points]

    def out_of_reach(self, truth: Truth, offer: str) -> SetRow:
        """The row of a truth that is impossible, or whose pours keep breaking off."""
        verdict = OUT_OF_REACH + (truth.missing or "pours break off")
        case, title = truth.case, self.measurement.title
        return SetRow(
            laboratory=title,
            root=case.root,
            number=case.number,
            kind=case.kind,
            label=label_of(truth),
            strength=case.strength,
            amplitude=amplitude_text(truth),
            offer=offer,
            verdict=verdict,
            physics=PHYSICS,
        )

    def model_pours(self, conditions: Sequence[Condition], place: int | None = None) -> ModelPours:
        """Pours of the declared model, as a diagnosis makes them."""
        paths = [parameter.path for parameter in self.measurement.parameters]
        return ModelPours(conditions, paths, self.place.store, self.place.pours, self.place.ended, place=place)


def label_of(truth: Truth) -> str:
    """The name that a right answer gives, the name of the outside effect, or "none"."""
    names = sorted(name for name, _ in truth.effects)
    return "+".join(names) or truth.case.label or NONE


def amplitude_text(truth: Truth) -> str:
    """Amplitudes of the truth's effects as text, natural units."""
    return " ".join(f"{name}={'/'.join(f'{x:.4g}' for x in a)}" for name, a in truth.effects)


def _silent(line: str) -> None:
    """Say nothing."""
