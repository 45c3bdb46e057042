"""A calibration from its order to its files: read the study, run it, and write result.json and reports.

While it runs, ``partial.json`` holds what it has found so far (`doe.studies.study_result.PartialStudy`). Stages that
have ended stand there as in ``result.json``. ``partial`` names the stage that is running; the key of that stage, if
present, holds its analysis of the runs so far, and ``line`` says it in words. The file is removed once ``result.json``
is written.
"""

from __future__ import annotations

import functools
import json
import re
import shlex
from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from doe.pour_runner import PourRunner
from doe.provenance import About, PouredPile
from doe.run_records import Run
from doe.stages import planned_runs
from doe.store import Store, StoredRun, default_store
from doe.studies.campaign import Campaign, PartialStages, run_campaign
from doe.studies.profile import Profile
from doe.studies.study import TRIES, Study, load_study, with_profile
from doe.studies.study_result import (
    PartialStudy,
    PouredBody,
    RunCounts,
    StageResult,
    Stages,
    StudyDescription,
    StudyResult,
    Timing,
)
from explorer.background.output_folder import ResultFile, kept_for_one, read_result
from explorer.background.progress import RunProgress, told_of_pauses
from explorer.background.reporter import Reporter
from explorer.errors import CommandError
from explorer.files.output_file import check_new_file, check_vacant, write_whole
from explorer.files.run_result import made_today, versions
from explorer.photograph.result import PhotographResult
from explorer.photograph.target import FOLDER, PhotographedTarget, load_target
from explorer.report import write_report
from explorer.report.set_up import set_up_of
from explorer.study.duration import duration_text
from explorer.study.process import PARTIAL, RESULT
from solver import Executor, RawPourError, executor, pour_rig, run_queue, unpacked
from solver.arch import chosen
from solver.observables.made_up import estimator_bias
from solver.observables.repose import AZIMUTHS_DEG, flank_feet, outline
from solver.rigs.rig import PILE

if TYPE_CHECKING:
    from explorer.recordings.pour_recorder import StudyRecorder

NOBODY = About()
SILHOUETTE_POINTS = 161
FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class StudyOrder:
    """What a user asked for."""

    study: str
    profile: str
    out: Path
    _: KW_ONLY
    resume: bool = False
    store: Path | None = None
    record: Path | None = None
    threads: int | None = None
    tries: int = TRIES
    author: str = ""
    notes: str = ""
    target: Path | None = None
    """Folder of photographs that replace the study's own angle of repose (`explorer.photograph.target`)."""
    beyond_reach: bool = False
    """Leave out the stage that stops a study if no setting comes near its target."""
    piles: Path | None = None
    """New file for the answer as a recording; ``record``: folder for all pours of the verification."""
    scheduler: str = ""
    """Address of a Dask scheduler whose workers pour; "" for processes of this machine."""


def run_study(order: StudyOrder, reporter: Reporter) -> StudyResult:
    """Run the whole chain and write the files; returns the content of ``result.json``.

    Finished runs are kept in the store, so an interrupted study continues where it stopped. With ``piles``, a result
    that is already in the folder is only recorded.
    """
    study, profile = with_profile(load_study(order.study), order.profile)
    if order.beyond_reach:
        profile = replace(profile, reach_runs=0)
    if order.piles is not None:
        check_new_file(order.piles, suffix=".rrd")
        if (finished := None if order.resume else _finished(order.out, study.file, profile.name)) is not None:
            reporter.say(f"{order.out}: finished already; only recorded")
            _record_piles(order.piles, finished, reporter.say)
            reporter.result = order.out / RESULT
            return finished
    photographed = given_target(order)
    if photographed is not None:
        study = replace(study, targets=photographed.of_study(study.targets))
    # The page puts these files there before the start.
    own = [study.file, *([order.target] if order.target else [])]
    check_vacant(order.out, own=own, resume=order.resume)
    _check_same(order.out, study, profile)
    if order.record is not None:
        from explorer.recordings.pour_recorder import check_recordings

        check_recordings(order.record, order.resume)
    # A recorder watches pours from within this process; otherwise pours run in processes of their own.
    apart = order.record is None and chosen() == "cpu"
    # Both come before writing to the folder: a stage may refuse its table, and perhaps no scheduler answers.
    planned = planned_runs(study, profile)
    with kept_for_one(order.out), executor(order.threads, order.scheduler) if apart else nullcontext() as pool:
        reporter.begin(order.out, order.resume)
        return _run(order, study, profile, planned, photographed, pool, reporter)


def _run(
    order: StudyOrder,
    study: Study,
    profile: Profile,
    planned: dict[str, int],
    photographed: PhotographedTarget | None,
    pool: Executor | None,
    reporter: Reporter,
) -> StudyResult:
    """Pour, analyse and write into ``order.out``, which exists and is reserved for this command.

    ``planned`` is the number of runs that each stage will make.
    """
    say = reporter.say
    path = order.store or default_store()
    store = Store(path)
    if photographed is not None:
        photographed.copied(order.out / FOLDER)
        say(f"target: {photographed.line}")
    grams = "" if profile.mass is None else f" of {1e3 * profile.mass:g} g"
    for line in study.replaced:
        say(f"note: {line}")
    say(f"{study.name}, profile {profile.name}: {sum(planned.values())} runs{grams}; store {path}")
    if not order.scheduler:  # how many cores those workers have is not known beforehand
        say(duration_text(study, profile, path, order.threads))
    progress = RunProgress(reporter, planned)
    progress.compiling()
    partial = PartialResult(order.out, StudyDescription.of(study, profile, order.tries))
    follower = PartialStages(partial.show)

    def ended(stage: str, run: Run, remaining: int) -> None:
        progress.run(stage, run, remaining)
        follower.add(stage, run)

    with ExitStack() as stack:
        stack.enter_context(told_of_pauses(progress.went_on))
        stack.callback(store.close)
        recorder = stack.enter_context(_recorder(order.record)) if order.record else None
        pours = pool.run_queue if pool else functools.partial(run_queue, threads=order.threads)
        runner = PourRunner(
            study.scene,
            store,
            study.name,
            study.seed,
            order.threads,
            on_run=ended,
            observer=recorder,
            pours=None if recorder else pours,
            tries=order.tries,
            experiments=study.experiments,
            watched=reporter.watched,
        )
        bias = estimator_bias(study.estimators)
        found = run_campaign(study, profile, runner, bias, progress.stage, follower.begin, partial.keep)
        piles = poured_piles(found.stages, store) if PILE in pour_rig(study.scene).gives else ()
    about = made_today(order.author, order.notes)
    result = replace(result_of(study, profile, found, reporter.elapsed, order.tries, about), piles=piles)
    text = json.dumps(result.to_dict(), ensure_ascii=False, allow_nan=False, indent=1)
    # Written first, by itself: if a report cannot be written, the study is not lost.
    write_whole(order.out / RESULT, text + "\n")
    reporter.result = order.out / RESULT
    missing = write_report(result, order.out, {"result.json": text + "\n"})
    partial.remove()
    say(f"{order.out}/report.html, report.md, result.json")
    if missing:
        say(missing)
    if order.piles is not None:
        _record_piles(order.piles, result, say)
    return result


def poured_piles(stages: Stages, store: Store) -> tuple[PouredPile, ...]:
    """Mean silhouettes at the reference setting and at the optimum, read off the stored pours.

    Lost or damaged pours are skipped: their numbers are in the result, which must not be lost with them.
    """
    chosen = (
        ("reference", stages.reference_runs()),
        ("optimum", stages.own_runs_of("verification")),
    )
    seen = [
        (name, [views for run in runs if run.valid and (views := _silhouettes(store.find(run.key)))])
        for name, runs in chosen
    ]
    reach = max((float(np.abs(u).max()) for _, pours in seen for views in pours for u, _ in views), default=0.0)
    grid = np.linspace(-reach, reach, SILHOUETTE_POINTS)
    found = []
    for name, pours in seen:
        if len(pours) > 1:
            tops = np.array([np.mean([np.interp(grid, u, z, 0.0, 0.0) for u, z in views], axis=0) for views in pours])
            mean, sd = tops.mean(axis=0), tops.std(axis=0, ddof=1)
            found.append(PouredPile(name, len(pours), *(tuple(one.round(6).tolist()) for one in (grid, mean, sd))))
    return tuple(found)


def _silhouettes(run: StoredRun | None) -> list[tuple[FloatArray, FloatArray]]:
    """Outlines (u, z) [m] of a stored pile from several sides, u = 0 between the feet of its flanks."""
    if run is None or not run.raw:
        return []
    try:
        spheres = unpacked(run.raw).pile.spheres
    except RawPourError:
        return []
    found = []
    for azimuth in AZIMUTHS_DEG[::3]:
        view = outline(spheres, azimuth)
        left, right = view.flanks
        if left is not None and right is not None and left.slope > 0.0 < right.slope:
            inside = view.top > 0.0
            found.append(((view.u - 0.5 * sum(flank_feet((left, right))))[inside], view.top[inside]))
    return found


def given_target(order: StudyOrder) -> PhotographedTarget | None:
    """The photographs that ``order`` names, or with which the study that it continues was started; None if none.

    Raises CommandError in one line if the named folder holds none.
    """
    named = order.target
    if named is None:
        return load_target(order.out / FOLDER) if order.resume else None
    found = load_target(named)
    if found is None:
        raise CommandError(
            f"--target {named}: holds no {PhotographResult.NAME}; `explorer measure PHOTO --target {named}` makes it"
        )
    return found


def _recorder(folder: Path) -> StudyRecorder:
    # rerun takes a second to import, so it is imported only for recording.
    from explorer.recordings.pour_recorder import StudyRecorder

    return StudyRecorder(folder)


def _record_piles(path: Path, result: StudyResult, say: Callable[[str], None]) -> None:
    from explorer.recordings.answer_recording import record_study

    record_study(path, result, say)


def _finished(out: Path, file: Path, profile: str) -> StudyResult | None:
    """The result in the folder; None if there is none. Raises CommandError if it is of another study or profile."""
    result = read_result(StudyResult, out, RESULT)
    if result is None:
        return None
    found = result.study
    if (Path(found.file).absolute(), found.profile.name) != (file.absolute(), profile):
        raise CommandError(
            f"--out {out}: holds the result of {found.file}, profile {found.profile.name}; name another folder"
        )
    return result


def _check_same(out: Path, study: Study, profile: Profile) -> None:
    """Raise CommandError if ``out`` holds the findings of another study or profile, which continuing would overwrite.

    This holds for results of any version of the program, whatever was changed in the study since.
    """
    described = (ResultFile(RESULT, PARTIAL).read(out) or {}).get("study")
    if not isinstance(described, dict):
        return
    name, size = described.get("name"), described.get("profile")
    if isinstance(name, str) and name != study.name:
        raise CommandError(f"--out {out}: holds the study {name}, not {study.name}; name another folder")
    other = size.get("name") if isinstance(size, dict) else None
    if isinstance(other, str) and other != profile.name:
        raise CommandError(
            f"--out {out}: holds the profile {other} of {study.name}, not {profile.name}; name another folder, or "
            f"continue with --profile {shlex.quote(other)}"
        )


class PartialResult:
    """The file ``partial.json`` in the output folder of one study."""

    def __init__(self, folder: Path, study: StudyDescription) -> None:
        self._file, self._found = folder / PARTIAL, PartialStudy(study=study)
        self.remove()

    def show(self, stage: str, result: StageResult) -> None:
        """Write ``result``, which ``stage`` has found so far."""
        # A mean without any run yet is not a finding.
        line = "" if re.search(r"\bnan\b", result.line) else result.line
        self._write(replace(self._found.with_result(stage, result), partial=stage, line=line))

    def keep(self, stage: str, result: StageResult | None) -> None:
        """Keep ``result``, with which ``stage`` has ended; None if the study has no such stage."""
        self._found = self._found.with_result(stage, result)
        self._write(self._found)

    def remove(self) -> None:
        """Remove the file."""
        self._file.unlink(missing_ok=True)

    def _write(self, content: PartialStudy) -> None:
        write_whole(self._file, json.dumps(content.to_dict(), ensure_ascii=False, allow_nan=False) + "\n")


def result_of(
    study: Study, profile: Profile, found: Campaign, total_s: float, tries: int = TRIES, about: About = NOBODY
) -> StudyResult:
    """The content of ``result.json``."""
    runs = list(found.stages.all_runs())
    return StudyResult(
        study=StudyDescription.of(study, profile, tries),
        **vars(found.stages),
        runs=RunCounts.of(found.stages),
        timing=Timing(
            total_s=total_s,
            stage_s=found.seconds,
            runs_per_minute=60.0 * len(runs) / max(total_s, 1e-9),
            reused_runs=sum(run.reused for _, run in runs),
        ),
        versions=versions(),
        shapes=tuple(PouredBody(body.name, body.mass, body.spheres, body.clump.fit) for body in study.scene.bodies),
        about=about,
        set_up=set_up_of(study.scene),
        experiments={name: set_up_of(scene) for name, scene in study.experiments.items()},
    )
