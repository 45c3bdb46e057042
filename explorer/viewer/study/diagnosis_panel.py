"""The diagnosis on the page: choose measured data, start, watch, pause, resume; the answer, its charts, others."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from pathlib import Path

import viser

from doe.record import RecordError
from explorer.background.result_file import ResultFile
from explorer.diagnosis.process import RESULT, DiagnosisProcess, Question
from explorer.diagnosis.result import DiagnosisResult
from explorer.files.uploads import kept_measurements
from explorer.report.diagnosis.answer import verdict_sentence
from explorer.report.diagnosis.charts import likely
from explorer.report.diagnosis.wording import chance, feature_label, feature_value, spelled
from explorer.report.diagnosis_plots import diagnosis_plots
from explorer.viewer.actions import Post
from explorer.viewer.study.candidates import Candidates
from explorer.viewer.study.plot_view import PlotView
from explorer.viewer.study.process_view import ProcessView, escaped, waiting_markdown
from explorer.viewer.study.result_chooser import ResultChooser
from explorer.viewer.study.stage_table import stages_markdown

FIRST = "trefoil_2"
"""Chosen at first, where it is shipped: the data set of `make diagnose`."""
OWN = "folder below"
"""Choice of the list that takes the folder in the text field."""
ANSWERS = 5
"""Of the most probable ones, that stand beside the verdict."""
PRESENT = "present or newest diagnosis"
EMPTY = (
    "No charts yet: they come with the answer of a diagnosis. Choose measured data above and press *Start*, or add a "
    "folder with a finished diagnosis below."
)


class DiagnosisPanel:
    """Talks to a :class:`DiagnosisProcess`; ``shipped``: names of data sets to choose from; ``uploads``: the others."""

    def __init__(
        self,
        server: viser.ViserServer,
        diagnosis: DiagnosisProcess,
        shipped: Sequence[str],
        uploads: Path,
        post: Post,
        dark: bool = True,
    ) -> None:
        gui = server.gui
        self._diagnosis, self._file = diagnosis, ResultFile(RESULT)
        self._shipped, self._uploads = tuple(shipped), uploads
        self._shown: Hashable = None
        gui.add_markdown(
            "Which physical effect do measured data ask for that the declared model lacks, and how sure is that? With "
            "nothing in the store all effects take about 150 to 400 pours, for the shipped data some 15 to 40 min on "
            "two cores; a second data set of the same model takes minutes."
        )
        self._data = gui.add_dropdown(
            "Measured data",
            self._offered(),
            initial_value=FIRST if FIRST in shipped else OWN,
            hint="Data sets that come with the program, those uploaded in the tab Pour, or a folder of your own.",
        )
        self._folder = gui.add_text(
            "Folder", "", hint="Folder with measurement.toml, on the machine that serves this page."
        )
        with gui.add_folder("Effects in question, and how much is poured", expand_by_default=False):
            self._candidates = Candidates(server)
        acts = {"Start": self._start, "Pause / go on": self._pause, "Cancel": diagnosis.cancel}
        more = {"Resume": self._resume, "Queue": self._queue, "Clear queue": diagnosis.clear_queue}
        self._view = ProcessView(server, "Diagnosis", acts, post, more)
        self._answer = gui.add_markdown("")
        self._plots = PlotView(server, "Chart", EMPTY, post, dark)
        self._chooser = ResultChooser(server, "Result", PRESENT, RESULT, post, self._follow)

    @property
    def dark(self) -> bool:
        """Whether the charts are for a dark page."""
        return self._plots.dark

    @dark.setter
    def dark(self, dark: bool) -> None:
        self._plots.dark = dark

    def _start(self) -> None:
        self._diagnosis.start(self._question())

    def _resume(self) -> None:
        self._diagnosis.resume(self._question())

    def _queue(self) -> None:
        self._diagnosis.queue(self._question())

    def _pause(self) -> None:
        if self._diagnosis.status().state == "paused":
            self._diagnosis.go_on()
        else:
            self._diagnosis.pause()

    def _offered(self) -> tuple[str, ...]:
        """What the list of data sets holds now."""
        return (*self._shipped, *kept_measurements(self._uploads), OWN)

    def _question(self) -> Question:
        chosen = str(self._folder.value if self._data.value == OWN else self._data.value)
        data = str(kept_measurements(self._uploads).get(chosen, chosen))
        return Question(data, self._candidates.effects, self._candidates.budget)

    def show(self, notice: str) -> None:
        """Ask the diagnosis how far it is; ``notice`` is the page's own last message, such as a refused click.

        Call it inside ``server.atomic()``, about twice a second.
        """
        offered = self._offered()
        if tuple(self._data.options) != offered:
            self._data.options = offered
        status = self._diagnosis.status()
        # How much more is poured, in this stage and after it, is decided by what comes out.
        text = stages_markdown(status, "diagnosis", "Pours", notice, counted="Known of this stage")
        self._view.show(status, text + waiting_markdown(self._diagnosis.waiting()))
        self._chooser.offer(self._diagnosis.finished())
        self._follow()

    def _follow(self) -> None:
        """Show the chosen result where it is another one than before."""
        folder = self._chooser.folder
        if folder is None:
            folder = self._diagnosis.out or next(iter(self._diagnosis.finished()), None)
        content = self._file.read(folder)
        now = (folder, self._file.version)
        if now == self._shown:
            return
        self._shown = now
        try:
            result = None if content is None else DiagnosisResult.from_dict(content)
            answer = "" if result is None else answer_markdown(result)
            plots = {} if result is None else diagnosis_plots(result)
        except RecordError as error:
            answer, plots = escaped(f"{folder}: {error}"), {}
        except (AssertionError, LookupError, ValueError) as error:
            # A folder that somebody named may hold names of effects, answers and conditions that are none.
            answer, plots = f"{escaped(str(folder))}: cannot be shown ({escaped(repr(error))})", {}
        self._answer.content = answer
        self._plots.offer(plots, now)


def answer_markdown(result: DiagnosisResult) -> str:
    """The verdict in a sentence, the likely answers, and the errors before, after, and by noise alone."""
    verdict, sentence = escaped(result.verdict), escaped(verdict_sentence(result).replace("`", ""))
    odds = "\n".join(
        f"| {escaped(spelled(one).replace('`', ''))} | {escaped(chance(p))} |" for one, p in _first(result)
    )
    errors, words = result.error.told()
    rows = "\n".join(
        f"| {escaped(feature_label(row.observable))} | "
        + " | ".join(
            escaped(feature_value(result, row.observable, one)) for one in (row.before, row.after, row.noise_floor)
        )
        + " |"
        for row in errors
    )
    head = f"| Error on {words} data | Before | After | Noise floor |\n|:--|--:|--:|--:|"
    return f"**{verdict}** — {sentence}\n\n| Answer | Probability |\n|:--|--:|\n{odds}\n\n{head}\n{rows}"


def _first(result: DiagnosisResult) -> list[tuple[str, float]]:
    return likely(result)[:ANSWERS]
