"""The design of experiments on the page: order, run, watch; charts, profiler, runs and comparison of its result."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path

from doe.record import RecordError
from doe.stages import planned_runs
from doe.studies.study import Study, load_study
from doe.studies.study_result import AnyStudy, PartialStudy, study_from
from explorer.background.output_folder import ResultFile
from explorer.report.study_charts import study_plots
from explorer.session import Session
from explorer.study.process import PARTIAL, RESULT
from explorer.viewer.panel import CALIBRATE, SELDOM, Now, PageContext, Panel
from explorer.viewer.study.comparison_panel import ComparisonPanel
from explorer.viewer.study.order_panel import OrderPanel
from explorer.viewer.study.plot_view import PlotView
from explorer.viewer.study.process_view import ProcessView, escaped, stages_markdown, waiting_markdown
from explorer.viewer.study.profiler_panel import ProfilerPanel
from explorer.viewer.study.result_chooser import ResultChooser, title
from explorer.viewer.study.run_chooser import RunChooser
from explorer.viewer.tour import Stop
from solver import Scene, canonical, parameters, with_values

PRESENT = "present or newest study"
NONE = "(the study cannot be read)"
EMPTY = (
    "No charts yet: they come as soon as a stage can be analysed. Press *Start*, or add a "
    "folder with a finished study below."
)


class StudyPanel(Panel):
    """Talks to a :class:`StudyProcess`; what a result says is read and drawn by `explorer.report`."""

    name, tab, every = "study", CALIBRATE, SELDOM
    stop = Stop(
        "Calibrate",
        "The tab **Calibrate** runs a whole study in the background: screening, steepest ascent, response surface, "
        "optimum, verification. The pour goes on meanwhile, and a cancelled study resumes where it stopped.",
    )

    def __init__(self, page: PageContext) -> None:
        server, gui, study, post = page.server, page.server.gui, page.study, page.post
        self._study, self._session = study, page.session
        loaded = _loaded(study.study_file)
        self._alive, self._over = ResultFile(PARTIAL, RESULT), ResultFile(RESULT, PARTIAL)
        self._shown: Hashable = None
        self._trouble = ""
        self._so_far = ("", "")
        name = escaped(study.study_file.stem)
        gui.add_markdown(f"**{name}** — screening, steepest ascent, response surface, optimum, verification.")
        self._profile = gui.add_dropdown(
            "Profile",
            (NONE,) if loaded is None else tuple(loaded.profiles),
            hint=None if loaded is None else "; ".join(profile_text(loaded, name) for name in loaded.profiles),
        )
        with gui.add_folder("Ranges and target of the next study", expand_by_default=False):
            self._order = OrderPanel(server, study.study_file, loaded, post)
        acts = {"Start": self._start, "Pause / go on": self._pause, "Cancel": study.cancel}
        more = {"Resume": study.resume, "Retry": study.retry, "Queue": self._queue, "Clear queue": study.clear_queue}
        self._view = ProcessView(server, "Study", acts, post, more)
        self._plots = PlotView(server, "Chart", EMPTY, post)
        self._chooser = ResultChooser(server, "Result", PRESENT, RESULT, post, self._follow)
        with gui.add_folder("Profiler", expand_by_default=False):
            self._profiler = ProfilerPanel(server, post, self._plots.show_anew, self._set_live)
        with gui.add_folder("Runs, poured again", expand_by_default=False):
            self._runs = RunChooser(server, page.session, post)
        with gui.add_folder("Compare two studies", expand_by_default=False):
            self._comparison = ComparisonPanel(server, post)

    def set_dark(self, dark: bool) -> None:
        """Charts for a dark page, or a light one."""
        self._plots.dark = dark

    def show(self, now: Now) -> None:
        """Ask the study how far it is."""
        status = self._study.status()
        stage, line = self._so_far
        text = stages_markdown(status, "study", "Runs", now.notice, line if stage == status.stage else "")
        text += waiting_markdown(self._study.waiting())
        if self._trouble:
            text += f"\n\n{escaped(self._trouble)}"
        self._view.show(status, text)
        folders = self._study.finished()
        self._chooser.offer(folders)
        self._comparison.offer(folders)
        self._follow()

    def _start(self) -> None:
        self._study.start(str(self._profile.value), self._order.edits)

    def _queue(self) -> None:
        self._study.queue(str(self._profile.value), self._order.edits)

    def _pause(self) -> None:
        if self._study.status().state == "paused":
            self._study.go_on()
        else:
            self._study.pause()

    def _follow(self) -> None:
        """Show the chosen result where it is another one than before."""
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
            if present:
                self._so_far = (result.partial or "", result.line) if isinstance(result, PartialStudy) else ("", "")
            self._show_result(result, "" if folder is None else title(folder), shown)
        except RecordError as error:
            # A folder that somebody named may hold any JSON, also that of another version.
            self._trouble = f"{folder}: cannot be shown ({error})"
            self._show_result(None, "", None)

    def _show_result(self, result: AnyStudy | None, name: str, version: Hashable) -> None:
        self._profiler.show(result)
        plots = {} if result is None else study_plots(result) | self._profiler.plots()
        self._plots.offer(plots, version)
        self._runs.show(result)
        self._comparison.show(result, name, version)

    def _present(self) -> Path | None:
        """Folder of the study that was started last, or before any the newest finished one."""
        return self._study.out or next(iter(self._study.finished()), None)

    def _set_live(self, values: Mapping[str, float | str]) -> None:
        set_live(self._session, values)


def profile_text(study: Study, name: str) -> str:
    """What a profile of the study spends, e.g. "quick: coarse shapes, 83 runs"."""
    profile = study.profiles[name]
    runs = "as many runs as the pilot asks for"
    if profile.resolution_deg is None:
        runs = f"{sum(planned_runs(study, profile).values())} runs"
    return f"{name}: {profile.spheres} shapes, {runs}"


def set_live(session: Session, values: Mapping[str, float | str]) -> None:
    """Give the live pour ``values`` (by path, SI): at once if all of them can act on a running pour, else anew."""
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
