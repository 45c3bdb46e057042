"""A diagnosis from its order to its files: read the data, run the loop, and write the answer."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from doe.declared.bodies import body_rows
from doe.declared.budget import Budget, scaled_budget
from doe.declared.given import Given, with_given
from doe.declared.model import effect_values
from doe.declared.pours import measured_profile
from doe.diagnose.confirm import Confirmed
from doe.diagnose.diagnosis import Diagnosis, joined, run_diagnosis
from doe.diagnose.posterior import FITS, NOTHING, OUTSIDE, PAIRS
from doe.diagnose.training_amplitudes import STRONG
from doe.diagnose.verdict import CREDIBLE, DOUBTED, HIDDEN, NOTHING_AT_ONCE, NOTHING_FROM
from doe.holdout import CONTRADICTED, HoldoutError
from doe.measurement.load import load_measurement
from doe.measurement.measurement import Condition, Measurement
from doe.measurement.summaries import summaries
from doe.store import Store, default_store
from explorer.background.output_folder import kept_for_one, read_result
from explorer.background.progress import PourProgress
from explorer.background.reporter import Reporter
from explorer.diagnosis.corrected import corrected_toml, study_toml
from explorer.diagnosis.next_folder import NEXT, ORDER, asks_for, measured_so_far, write_next
from explorer.diagnosis.result import (
    CORRECTED,
    CORRECTED_STUDY,
    BeforeAndAfter,
    DataRead,
    DiagnosisOrder,
    DiagnosisResult,
    Duration,
    ErrorRow,
    Errors,
    MeanAndDeviation,
    MeasuredCondition,
    PileProfiles,
    PourCounts,
    PouredCondition,
    PouredModel,
    Probabilities,
    Rule,
)
from explorer.errors import CommandError
from explorer.files.output_file import check_new_file, check_vacant, write_whole
from explorer.files.run_result import made_today, versions
from explorer.report.diagnosis import diagnosis_report
from explorer.report.folder import write_report
from explorer.scene.pour_cost import large_pour_text
from solver import EFFECTS, Executor, executor, value

RULE = Rule(
    prior_nothing=NOTHING,
    prior_outside=OUTSIDE,
    prior_pairs=PAIRS,
    fits=FITS,
    nothing_at_once=NOTHING_AT_ONCE,
    nothing_from=NOTHING_FROM,
    credible=CREDIBLE,
    contradicted=CONTRADICTED,
    strong=STRONG,
    doubted=DOUBTED,
    hidden=HIDDEN,
    together=True,
    pairs_at_once=False,
)


@dataclass(frozen=True)
class DiagnoseOrder:
    """What a user asked for."""

    folder: Path
    out: Path
    effects: tuple[str, ...] = ()
    budget: int | None = None
    resume: bool = False
    store: Path | None = None
    threads: int | None = None
    apply: bool = False
    seed: int = 0
    follow_up: Path | None = None
    given: Path | None = None
    """Folder of a finished diagnosis whose effect is in the model."""
    author: str = ""
    notes: str = ""
    record: Path | None = None
    """New file for the answer as a recording."""
    plan_next: bool = True
    """Whether to look for what could be measured next."""
    scheduler: str = ""
    """Address of a Dask scheduler whose workers pour; "" for processes of this machine."""


@dataclass(frozen=True)
class Earlier:
    """An earlier answer that a diagnosis continues.

    given: effects with their amplitudes. follow_ups: what was measured for the earlier answers.
    """

    given: Given
    follow_ups: tuple[Measurement, ...] = ()

    def carried_into(
        self, measurement: Measurement, follow_ups: Sequence[Measurement]
    ) -> tuple[Measurement, tuple[Measurement, ...]]:
        """``measurement`` with the earlier follow-ups among its fitted conditions, and the effects in its model.

        New ``follow_ups`` also have the effects in their models, within the same ranges: those that all rigs allow.
        """
        measurement = joined(measurement, *self.follow_ups)
        if not self.given:
            return measurement, tuple(follow_ups)
        everything = with_given(joined(measurement, *follow_ups), self.given)
        made = {one.name: one for one in everything.conditions}

        def own(part: Measurement) -> Measurement:
            conditions = tuple(made[one.name] for one in part.conditions if one.name in made)
            return replace(everything, folder=part.folder, conditions=conditions, bodies=part.bodies)

        return own(measurement), tuple(own(one) for one in follow_ups)


NOTHING_BEFORE = Earlier({})


def run_diagnose(order: DiagnoseOrder, reporter: Reporter) -> DiagnosisResult:
    """Run the loop and write the files; returns the content of ``diagnosis.json``.

    Finished pours are kept in the store, so an interrupted diagnosis can be continued. With ``record``, an answer that
    is already in the folder is only recorded.
    """
    if order.record is not None:
        check_new_file(order.record, suffix=".rrd")
        if (finished := None if order.resume else _finished(order)) is not None:
            reporter.say(f"{order.out}: finished already; only recorded")
            _recorded(order.record, finished, reporter.say)
            reporter.result = order.out / finished.NAME
            return finished
    unknown = [name for name in order.effects if name not in EFFECTS]
    if unknown:
        raise CommandError(f"--effects: {unknown[0]!r} is not one of {', '.join(EFFECTS)}")
    measurement = load_measurement(order.folder)
    check_vacant(order.out, resume=order.resume)
    if order.follow_up and order.follow_up.resolve() == (order.out / NEXT).resolve():
        raise CommandError(
            f"--follow-up {order.follow_up}: lies in --out, which holds the answer before it; allowed: another --out"
        )
    follow_ups = measured_so_far(order.follow_up) if order.follow_up else ()
    earlier = NOTHING_BEFORE
    if order.given is not None:
        if order.given.resolve() == order.out.resolve():
            raise CommandError(f"--given {order.given}: is the same folder as --out; allowed: another one")
        earlier = earlier_answer(order.given, order.folder)
    if set(order.effects or EFFECTS) <= set(earlier.given):
        raise CommandError("--effects: all of them are already in the model by --given; allowed: at least one other")
    known = {one.folder.resolve() for one in earlier.follow_ups}
    follow_ups = tuple(one for one in follow_ups if one.folder.resolve() not in known)
    budget = Budget()
    if order.budget is not None:
        carried, _ = earlier.carried_into(measurement, follow_ups)
        budget = scaled_budget(order.budget, carried, order.effects or tuple(EFFECTS))
    # Start the executor before writing to the folder: perhaps no scheduler answers.
    with kept_for_one(order.out), executor(order.threads, order.scheduler) as pool:
        reporter.begin(order.out, order.resume)
        return _run(order, measurement, follow_ups, earlier, budget, pool, reporter)


def _run(
    order: DiagnoseOrder,
    measurement: Measurement,
    follow_ups: Sequence[Measurement],
    earlier: Earlier,
    budget: Budget,
    pool: Executor,
    reporter: Reporter,
) -> DiagnosisResult:
    """Pour, judge and write into ``order.out``, which exists and is reserved for this command."""
    say, names = reporter.say, order.effects or tuple(EFFECTS)
    path, as_declared = order.store or default_store(), measurement
    measurement, follow_ups = earlier.carried_into(measurement, follow_ups)
    say(
        f"{order.folder}: {len(measurement.fit)} fitted and {len(measurement.holdout)} held-out conditions; store "
        f"{path}"
    )
    for condition in measurement.conditions:
        if large := large_pour_text(condition.scene):
            say(f"{condition.name}: {large}")
    progress = PourProgress(reporter)
    progress.compiling()
    with ExitStack() as stack:
        store = Store(path)
        stack.callback(store.close)
        pours = reporter.watched(pool.run_queue)
        found = run_diagnosis(
            measurement,
            store,
            pours,
            names,
            budget,
            progress.stage,
            progress.pour,
            order.seed,
            follow_ups,
            plan_next=order.plan_next,
        )
    result = result_of(measurement, order, earlier.given, found, reporter.elapsed)
    text = json.dumps(result.to_dict(), ensure_ascii=False, allow_nan=False, indent=1)
    write_whole(order.out / result.NAME, text + "\n")
    reporter.result = order.out / result.NAME
    missing = write_report(diagnosis_report(result), order.out, {result.NAME: text + "\n"})
    say(f"{order.out}/report.html, report.md, {result.NAME}")
    if missing:
        say(missing)
    if result.kind == "ambiguous" and not order.plan_next:
        say(
            "what to measure next: not searched for, as asked; the same command with --resume and without --no-next "
            "adds it"
        )
    if found.suggestions:
        asked, following = found.suggestions[0], order.out / NEXT
        if (following / ORDER).is_file():  # from a run that was stopped after writing it, or one that is continued
            same = "" if asks_for(following, asked) else "; it is not what this answer asks for"
            say(f"{following}: exists already and is not changed, as it may be filled in{same}")
        else:
            names_taken = [condition.name for part in (measurement, *follow_ups) for condition in part.conditions]
            before = [one.folder for one in follow_ups]
            write_next(following, order.folder, as_declared, asked, order.given, names_taken, before)
            what = "what to measure next" if asked.pours else "what of single bodies checks this answer"
            say(f"{following}: {what}, to be filled in; then --follow-up {following}")
    if order.apply:
        write_whole(order.out / CORRECTED, corrected_toml(measurement, found))
        say(f"{order.out}/{CORRECTED}: the corrected model, for every command that takes a material")
        text = study_toml(measurement, found, CORRECTED)
        if text:
            path = order.out / CORRECTED_STUDY
            write_whole(path, text)
            say(f"{path}: its calibration, the effect among the factors: explorer calibrate --headless --study {path}")
    for line in error_lines(result):
        say(line)
    if order.record is not None:
        _recorded(order.record, result, say)
    return result


def _finished(order: DiagnoseOrder) -> DiagnosisResult | None:
    """The answer in the folder; None if there is none. Raises CommandError if it answers another question."""
    result = read_result(DiagnosisResult, order.out, DiagnosisResult.NAME)
    if result is None:
        return None
    asked = DiagnosisOrder(
        result.order.out,
        order.effects,
        order.budget,
        order.seed,
        _absolute(order.follow_up),
        _absolute(order.given),
        order.plan_next,
    )
    usual = DiagnosisOrder(result.order.out, (), None, 0, None)
    known = replace(result.order, follow_up=_absolute(result.order.follow_up), given=_absolute(result.order.given))
    if Path(result.data.folder).absolute() != order.folder.absolute() or asked not in (usual, known):
        raise CommandError(f"--out {order.out}: holds the answer to another question; name another folder")
    return result


def earlier_answer(folder: Path, data: Path) -> Earlier:
    """What the finished diagnosis in ``folder`` hands on to one of ``data``, with the follow-ups of those before it.

    Raises CommandError, in one line, if there is none, no effect in it reaches the threshold for a name, or its
    follow-up belongs to other data.
    """
    result = _earlier_result(folder)
    given = result.handed_on()
    if not given:
        raise CommandError(
            f"--given {folder}: {result.verdict}; allowed: a diagnosis in which one effect has a probability of at "
            f"least {result.threshold:.0%}"
        )
    follow_ups: list[Measurement] = []
    seen = {folder.resolve()}
    while True:
        if result.order.follow_up:
            if Path(result.data.folder).resolve() != data.resolve():
                raise CommandError(f"--given {folder}: has a follow-up of {result.data.folder}; allowed: of {data}")
            follow_ups[:0] = measured_so_far(Path(result.order.follow_up))
        if not result.order.given:
            return Earlier(given, tuple(follow_ups))
        before = Path(result.order.given).resolve()
        if before in seen:
            raise CommandError(f"--given {folder}: continues {before}, which continues itself")
        seen.add(before)
        result = _earlier_result(before)


def _earlier_result(folder: Path) -> DiagnosisResult:
    result = read_result(DiagnosisResult, folder, DiagnosisResult.NAME)
    if result is None:
        raise CommandError(f"--given {folder}: holds no {DiagnosisResult.NAME}; allowed: a finished diagnosis")
    return result


def _absolute(path: Path | str | None) -> str | None:
    """``path`` as an absolute path, valid in any working directory; None for none."""
    return str(Path(path).absolute()) if path else None


def _recorded(path: Path, result: DiagnosisResult, say: Callable[[str], None]) -> None:
    # rerun takes a second to import, so it is imported only for recording.
    from explorer.recordings.answer_recording import record_diagnosis

    record_diagnosis(path, result, say)


def result_of(
    measurement: Measurement, order: DiagnoseOrder, given: Given, found: Diagnosis, total_s: float
) -> DiagnosisResult:
    """The content of ``diagnosis.json``."""
    verdict = found.verdict
    units = {s.name: s.unit for condition in found.conditions for s in summaries(condition)}
    final = next((row for row in verdict.effects if row.name == verdict.final), None)
    acting: dict[str, list[float]] = {}
    for one in final.amplitudes if final is not None else ():
        acting.setdefault(one.effect, []).append(one.value)
    return DiagnosisResult(
        verdict=verdict.kind,
        statement=verdict.statement,
        names=verdict.names,
        probabilities=Probabilities(verdict.nothing, verdict.outside),
        threshold=verdict.threshold,
        rule=RULE,
        temperature=verdict.temperature,
        taken_back=verdict.taken_back,
        final=verdict.final,
        effects=verdict.effects,
        levels=found.levels,
        ranges=found.declared.effects,
        parameters=verdict.parameters,
        residuals=verdict.residuals,
        where=verdict.where,
        similar=verdict.similar,
        scatter=verdict.scatter,
        left_out=verdict.left_out,
        offered=found.offered,
        error=Errors(_errors(found.fit_error, units), _errors(found.holdout_error, units)),
        held_out=found.held_out,
        next_experiment=found.suggestions,
        confirmation=BeforeAndAfter(
            _poured_model(found.conditions, found.before), _poured_model(found.conditions, found.after)
        ),
        measured=tuple(
            MeasuredCondition(
                condition.name,
                condition.role,
                condition.scene.rig.name,
                condition.replicates * condition.mean_of,
                tuple(s.name for s in summaries(condition)),
                condition.mean_of,
            )
            for condition in found.conditions
        ),
        piles=tuple(picture for c in range(len(found.conditions)) for picture in _piles(found, c)),
        maps=found.maps,
        data=DataRead(str(order.folder), measurement.title, measurement.ignored, measurement.notes),
        order=DiagnosisOrder(
            str(order.out),
            order.effects,
            order.budget,
            order.seed,
            _absolute(order.follow_up),
            _absolute(order.given),
            order.plan_next,
        ),
        given={
            name: tuple(float(value(measurement.scene, path)) for path in effect_values(name, amplitude))
            for name, amplitude in given.items()
        },
        bodies=tuple(body_rows(found.conditions[0].scene, found.bodies, acting)),
        units=units,
        pours=PourCounts(found.pours, found.settings),
        timing=Duration(total_s),
        versions=versions(),
        about=made_today(order.author, order.notes),
    )


def error_lines(result: DiagnosisResult) -> list[str]:
    """The table *before | after | noise floor* on held-out data, or on fitted data if none are held out."""
    rows, role = result.error.told()
    lines = [f"error on {role} data", f"{'observable':26} {'before':>10} {'after':>10} {'noise floor':>12}"]
    for row in rows:
        numbers = (row.before, row.after, row.noise_floor)
        before, after, floor = (f"{x:.3g}" if math.isfinite(x) else "–" for x in numbers)
        lines.append(f"{row.observable:26} {before:>10} {after:>10} {floor:>12}")
    return lines


def _errors(rows: Sequence[HoldoutError], units: dict[str, str]) -> tuple[ErrorRow, ...]:
    return tuple(ErrorRow(**vars(row), unit=units.get(row.observable, "σ")) for row in rows)


def _piles(found: Diagnosis, number: int) -> Iterator[PileProfiles]:
    """Height profiles [m] of condition ``number``, measured and by both models; none if the data have none."""
    condition = found.conditions[number]
    profile = measured_profile(condition)
    blocks = [profile.values, *(one.profiles[number] for one in (found.before, found.after))] if profile else []
    if profile is not None and profile.x is not None and min(map(len, blocks)) > 1:
        measured, before, after = (_mean_and_deviation(block) for block in blocks)
        yield PileProfiles(condition.name, condition.role, profile.x, measured, before, after)


def _mean_and_deviation(block: npt.NDArray[np.float64]) -> MeanAndDeviation:
    return MeanAndDeviation(block.mean(axis=0), block.std(axis=0, ddof=1))


def _poured_model(conditions: Sequence[Condition], found: Confirmed) -> PouredModel:
    return PouredModel(
        found.model.theta,
        found.model.effects,
        broken=found.broken,
        conditions=tuple(
            PouredCondition(condition.name, len(block), **vars(_mean_and_deviation(block)))
            for condition, block in zip(conditions, found.blocks, strict=True)
        ),
    )
