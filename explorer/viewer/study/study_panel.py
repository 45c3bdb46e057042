"""The design of experiments on the page: order, run and watch a study; its charts, profiler, runs and comparison."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path

from doe.record import RecordError
from doe.stages import planned_runs
from doe.store import default_store
from doe.studies.exclusion import ExcludedRun
from doe.studies.study import Study, load_study
from doe.studies.study_result import AnyStudy, StudyResult, study_from
from doe.target import Target
from explorer.background.command_process import CommandStatus
from explorer.background.output_folder import ResultFile
from explorer.errors import CommandError
from explorer.live.session import Session
from explorer.photograph.target import PhotographedTarget
from explorer.scene.source import study_source
from explorer.study.duration import duration_text
from explorer.study.excluded_runs import keep_excluded, load_excluded
from explorer.study.process import PARTIAL, RESULT, QueuedStudy
from explorer.study.run_scene import scene_of
from explorer.units import observable_label, observed
from explorer.viewer.board.board_view import BoardView
from explorer.viewer.board.study_board import listed_runs, photographed_of, study_board
from explorer.viewer.output.pile_recording import PileRecording
from explorer.viewer.panel import CALIBRATE, SELDOM, Now, PageContext, Panel
from explorer.viewer.study.comparison_panel import ComparisonPanel
from explorer.viewer.study.order_panel import OrderPanel
from explorer.viewer.study.plot_view import PlotView
from explorer.viewer.study.process_view import (
    RETRY,
    PlaceChoice,
    ProcessView,
    escaped,
    orders,
    state_markdown,
    waiting_markdown,
)
from explorer.viewer.study.profiler_panel import ProfilerPanel
from explorer.viewer.study.result_chooser import ResultChooser
from explorer.viewer.tables.ranges_page import RangesInHand, ranges_page
from explorer.viewer.tables.runs_page import RunsInHand, runs_page
from explorer.viewer.tables.table_server import link_html
from explorer.viewer.view import small_html
from solver import Scene, canonical, parameters, with_values

PRESENT = "present or newest study"
NONE = "(the study cannot be read)"
FROM_FILE = " From the study's file; photographs can take its place (*Laboratory*)."
LEAVE_OUT = "Leave runs of the surface out"
IN_A_TABLE = "All ranges in a table"
PROFILED = "Move a slider: the charts follow."


class StudyPanel(Panel):
    """Talks to a :class:`StudyProcess`; `explorer.report` reads and draws the results."""

    name, tab, every = "study", CALIBRATE, SELDOM

    def __init__(self, page: PageContext) -> None:
        server, gui, study, post = page.server, page.server.gui, page.study, page.post
        self._study, self._session = study, page.session
        loaded = _loaded(study.study_file)
        self._alive, self._over = ResultFile(PARTIAL, RESULT), ResultFile(RESULT, PARTIAL)
        self._shown: Hashable = None
        self._result: AnyStudy | None = None
        self._trouble = ""
        self._profile = gui.add_dropdown(
            "Profile",
            (NONE,) if loaded is None else tuple(loaded.profiles),
            hint=None if loaded is None else "; ".join(profile_text(loaded, name) for name in loaded.profiles),
        )
        self._loaded, self._store = loaded, page.diagnosis.store or default_store()
        self._asked: Hashable = None
        self._state, self._stopped = "", False
        self._takes = ""
        self._targets, self._kept = () if loaded is None else loaded.targets, page.target
        self._target = gui.add_markdown("")
        with gui.add_folder("Ranges and target of the next study", expand_by_default=False):
            in_hand = RangesInHand(lambda: self._order.ranges(), lambda ranges: self._order.take_ranges(ranges))
            gui.add_html(small_html(link_html(page.tables.publish(ranges_page(in_hand, post)), IN_A_TABLE)))
            self._order = OrderPanel(server, study.study_file, loaded, post)
        self._place = PlaceChoice(server, page.place, "study", post)
        acts = orders(study, self._start, study.resume, self._queue) | {RETRY: study.retry}
        self._view = ProcessView(server, "Study", acts, post)
        with gui.add_folder("Other results", expand_by_default=False):
            self._chooser = ResultChooser(server, "Result", PRESENT, RESULT, post, self._follow)
        self._recording = PileRecording(page, self._record_order)
        self._recording.offer(False)
        self._left_out: tuple[ExcludedRun, ...] = ()
        shown = RunsInHand(self._finished, lambda: self._left_out, self._leave_out)
        gui.add_html(small_html(link_html(page.tables.publish(runs_page(shown, post)), LEAVE_OUT)))
        self._channel = page.channel
        self._board = BoardView(server, page.pages, "/study/page.json", "Study")
        self._channel.offer("open_run", lambda asked: post(lambda: self._open_run(asked)))
        with gui.add_folder("Profiler", expand_by_default=False):
            self._plots = PlotView(server, "Chart", PROFILED, post)
            self._profiler = ProfilerPanel(server, post, self._plots.show_anew, self._set_live)
        with gui.add_folder("Compare two studies", expand_by_default=False):
            self._comparison = ComparisonPanel(server, post)

    def set_dark(self, dark: bool) -> None:
        """Draw charts for a dark page, or for a light one."""
        self._plots.dark = dark

    def show(self, now: Now) -> None:
        """Show how far the study is."""
        photographed = self._kept.now
        status = self._study.status()
        present = self._study.present if status.alive else None
        target = target_markdown(self._targets, photographed) if present is None else running_markdown(present)
        if self._target.content != target:
            self._target.content = target
        self._order.follow(photographed is not None)
        self._place.show()
        waiting = self._study.waiting()
        known = "" if self._result is not None else "study"
        resumable = self._resumable(status)
        text = state_markdown(status, known, "runs", now.notice, goes_on=resumable) + waiting_markdown(waiting)
        if not status.alive or (present is not None and status.eta_s is None):
            text = f"{self._expected(status.state, present)}\n\n{text}"
        if self._trouble:
            text += f"\n\n{escaped(self._trouble)}"
        self._view.show(status, text, waiting, resumable)
        folders = self._study.finished()
        self._chooser.offer(folders)
        self._comparison.offer(folders)
        self._follow()
        self._recording.show()
        self._show_board()

    def _expected(self, state: str, present: QueuedStudy | None) -> str:
        """Duration of the running study or the chosen profile; updated for another one and when a study ends."""
        study = self._loaded if present is None else present.study
        name = str(self._profile.value) if present is None else present.profile
        if (asked := (name, state, id(study))) != self._asked:
            self._asked = asked
            profile = study.profiles.get(name) if study else None
            self._takes = duration_text(study, profile, self._store) if study and profile else ""
        return self._takes

    def _resumable(self, status: CommandStatus) -> bool:
        """Whether a study can be resumed; looked up only when a study changes state, because it reads folders."""
        if status.state != self._state:
            self._state, self._stopped = status.state, self._study.resumable()
        return self._stopped

    def _start(self) -> None:
        self._study.start(str(self._profile.value), self._order.edits)

    def _queue(self) -> None:
        self._study.queue(str(self._profile.value), self._order.edits)

    def _follow(self) -> None:
        """Show the chosen result if it has changed."""
        folder = self._chooser.folder
        present = folder is None
        file = self._alive if present and self._study.status().alive else self._over
        folder = self._present() if folder is None else folder
        content = file.read(folder)
        shown = (folder, file.version)
        if shown == self._shown:
            return
        self._shown, self._trouble = shown, ""
        try:
            result = None if content is None else study_from(content)
            self._left_out = () if folder is None else load_excluded(folder)
            self._show_result(result, folder, shown)
        except (RecordError, CommandError) as error:
            # A folder that a person named may hold any JSON, including that of another version.
            self._trouble = f"{folder}: cannot be shown ({error})"
            self._show_result(None, None, None)

    def _show_result(self, result: AnyStudy | None, folder: Path | None, version: Hashable) -> None:
        self._result = result
        self._recording.offer(isinstance(result, StudyResult))
        self._profiler.show(result)
        self._plots.offer(self._profiler.plots(), version)
        self._comparison.show(result, folder, version)

    def _show_board(self) -> None:
        """Show the board of the chosen result."""
        chosen, result = self._chooser.folder, self._result
        status = self._study.status() if chosen is None else None
        folder = chosen or self._present()
        left_out = self._left_out
        self._board.show(
            (self._shown, left_out),
            folder,
            status,
            lambda status, report: study_board(result, status, report, photographed_of(folder), left_out),
        )

    def _finished(self) -> StudyResult | None:
        return self._result if isinstance(self._result, StudyResult) else None

    def _leave_out(self, result: StudyResult, excluded: Sequence[ExcludedRun]) -> None:
        """Leave runs out of ``result``, which must be the result that is shown."""
        folder = self._chooser.folder or self._present()
        if result is not self._result or folder is None:
            raise CommandError("another study is now shown; open the table again")
        keep_excluded(folder, result, excluded)
        self._left_out = tuple(excluded)

    def _open_run(self, asked: Mapping[str, object]) -> None:
        """Pour one run of the result in the scene, when a click on its row of the board asks for it."""
        result = self._result
        runs = [] if result is None else listed_runs(result)
        wanted = (asked.get("stage"), asked.get("label"), asked.get("seed"))
        found = next(((stage, run) for stage, run in runs if (stage, run.label, run.seed) == wanted), None)
        if result is None or found is None:
            raise CommandError("this run is not in the study that is shown")
        scene, same = scene_of(result, *found)
        self._session.start(scene, found[1].seed, study_source(Path(result.study.file)))
        if not same:
            raise CommandError("program, study file or material has changed since that run: this pour may differ")

    def _record_order(self) -> tuple[Path, list[str]]:
        """Folder of the study that is shown, and its command line."""
        result, folder = self._result, self._chooser.folder or self._present()
        if not isinstance(result, StudyResult) or folder is None:
            raise CommandError("there is no finished study yet: start one, or choose one under Other results")
        study = result.study
        return folder, ["calibrate", "--headless", "--study", study.file, "--profile", study.profile.name]

    def _present(self) -> Path | None:
        """Folder of the study that was started last; if none was started, that of the newest finished one."""
        return self._study.out or next(iter(self._study.finished()), None)

    def _set_live(self, values: Mapping[str, float | str]) -> None:
        set_live(self._session, values)


def profile_text(study: Study, name: str) -> str:
    """What a profile of the study costs, e.g. "quick: coarse shapes, 83 runs"."""
    profile = study.profiles[name]
    runs = "as many runs as the pilot asks for"
    if profile.resolution_deg is None:
        runs = f"{sum(planned_runs(study, profile).values())} runs"
    return f"{name}: {profile.spheres} shapes, {runs}"


def running_markdown(order: QueuedStudy) -> str:
    """Material, profile and target of the running study, which may differ from the one on the page."""
    target = target_markdown(order.study.targets, order.photographed).replace(FROM_FILE, "")
    return f"**At work:** {escaped(order.study.scene.title)}, profile {escaped(order.profile)}. {target}"


def target_markdown(targets: Sequence[Target], photographed: PhotographedTarget | None) -> str:
    """The target of the next study, and its origin."""
    if photographed is not None:
        return f"**Target:** {escaped(photographed.line)}"
    if not targets:
        return ""
    first, *others = (_target_text(target) for target in targets)
    also = f" Also: {escaped('; '.join(others))}." if others else ""
    return f"**Target:** {escaped(first)}.{FROM_FILE}{also}"


def _target_text(target: Target) -> str:
    spread = "" if target.sd is None else f" ± {observed(target.observable, target.sd)} SD"
    whence = [] if target.sd is None else [target.sd_source]
    whence += [] if target.n is None else [f"n = {target.n}"]
    told = f" ({', '.join(whence)})" if whence else ""
    return f"{observable_label(target.observable)}: {observed(target.observable, target.mean)}{spread}{told}"


def set_live(session: Session, values: Mapping[str, float | str]) -> None:
    """Give the live pour ``values`` (by path, SI): at once if all can act on a running pour, else in a new pour."""
    scene: Scene = session.status().scene
    known = parameters(scene)
    if all(known[canonical(scene, path)].live for path in values):
        session.set_parameters(values)
    else:
        session.restart(with_values(scene, dict(values)))


def _loaded(file: Path) -> Study | None:
    try:
        return load_study(str(file))
    except ValueError:
        return None
