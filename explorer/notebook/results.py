"""Studies and diagnoses from scripts and notebooks: run one, load a finished one, draw what its report draws."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from html import escape
from itertools import groupby
from pathlib import Path
from typing import Any, TypeVar

from doe.record import Document
from doe.studies.study import TRIES
from doe.studies.study_result import StudyResult
from explorer.background.output_folder import checked_folder, read_result
from explorer.background.reporter import Reporter
from explorer.diagnosis import run as diagnosis_run
from explorer.diagnosis.result import DiagnosisResult
from explorer.errors import CommandError
from explorer.notebook.pours import checked_seed
from explorer.report import study_report
from explorer.report.content import Figure, Report, Section, shown_in
from explorer.report.diagnosis import diagnosis_report
from explorer.report.figures.style import CONFIG
from explorer.report.html import page
from explorer.study import run as study_run
from explorer.study.process import RESULT
from solver.assets import measurement_folder

Say = Callable[[str], None]
"""Takes a line about how far it is; ``lambda line: None`` for silence."""
Read = TypeVar("Read", bound=Document)

MOST_HEIGHT = 800
"""Height [px] from which on charts are scrolled."""
MOST_TRIES = 20
"""As of ``explorer calibrate --tries``."""
AROUND_CHART, AROUND_CHARTS = 170, 190
"""What headings and captions take [px], of each chart and of all."""


def run_study(
    study: str | Path,
    out: str | Path,
    *,
    profile: str = "standard",
    resume: bool = False,
    store: str | Path | None = None,
    workers: int | None = None,
    tries: int = TRIES,
    say: Say = print,
) -> StudyResult:
    """Calibrate as ``explorer calibrate`` does, and write the same files.

    Parameters
    ----------
    study
        Shipped name or file.
    out
        Folder for ``result.json``, ``report.html``, ``report.md``.
    profile
        Size of the study: a ``[profile.NAME]`` of its file.
    resume
        Go on in a folder that is not empty; pours that are in the store are not repeated.
    store, workers
        As in :func:`explorer.sweep`.
    tries
        Seeds tried for one replicate that gives no valid pour.
    say
        Takes lines about how far it is.

    Returns
    -------
    doe.studies.study_result.StudyResult
        Every stage: ``result.screening``, ``result.optimum``, ``result.verification``, …

    Raises
    ------
    ValueError
        One line about the study, the profile or the folder.
    doe.errors.StudyStopped
        What the runs of a stage gave cannot be analysed.
    """
    if isinstance(tries, bool) or not isinstance(tries, int) or not 1 <= tries <= MOST_TRIES:
        raise CommandError(f"tries {tries!r}: allowed: a whole number from 1 to {MOST_TRIES}")
    kept = None if store is None else Path(store)
    order = study_run.StudyOrder(
        str(study), profile, Path(out), resume=resume, store=kept, threads=workers, tries=tries
    )
    with Reporter("calibrate", say) as reporter:
        return study_run.run_study(order, reporter)


def load_study(folder: str | Path) -> StudyResult:
    """Result of a finished study, from the folder that `run_study` or ``explorer calibrate`` wrote.

    Raises ValueError, in one line, where there is none, or one of another version of the program.
    """
    return _read(StudyResult, folder, RESULT)


def diagnose(
    measurement: str | Path,
    out: str | Path,
    *,
    effects: Iterable[str] = (),
    budget: int | None = None,
    resume: bool = False,
    store: str | Path | None = None,
    workers: int | None = None,
    seed: int = 0,
    follow_up: str | Path | None = None,
    given: str | Path | None = None,
    plan_next: bool = True,
    apply: bool = False,
    say: Say = print,
) -> DiagnosisResult:
    """Ask which effect measured data need that the declared model lacks, as ``explorer diagnose`` does.

    Parameters
    ----------
    measurement
        Folder with ``measurement.toml``, or the name of a shipped data set.
    out
        Folder for ``diagnosis.json``, ``report.html``, ``report.md``.
    effects
        Candidates; all if none is given.
    budget
        About so many pours teach the emulator.
    resume, store, workers, say
        As in :func:`run_study`.
    seed
        Of the pours.
    follow_up
        The folder ``next`` that an answer left in its ``out``, filled in; taken with the follow-ups before it.
    given
        The ``out`` of a finished diagnosis: with its effect in the model, what else is missing?
    plan_next
        Whether what could be measured next is looked for, and poured if the answer is ambiguous.
    apply
        Also write the corrected material, ``corrected.toml``.

    Returns
    -------
    explorer.diagnosis.result.DiagnosisResult
        ``verdict``, ``statement``, ``probabilities``, ``effects``, …

    Raises
    ------
    ValueError
        One line about the data, an effect or the folder.
    """
    order = diagnosis_run.DiagnoseOrder(
        folder=measurement_folder(str(measurement)),
        out=Path(out),
        effects=(effects,) if isinstance(effects, str) else tuple(effects),
        budget=budget,
        resume=resume,
        store=None if store is None else Path(store),
        threads=workers,
        apply=apply,
        seed=checked_seed(seed),
        follow_up=None if follow_up is None else Path(follow_up),
        given=None if given is None else Path(given),
        plan_next=plan_next,
    )
    with Reporter("diagnose", say) as reporter:
        return diagnosis_run.run_diagnose(order, reporter)


def load_diagnosis(folder: str | Path) -> DiagnosisResult:
    """Result of a finished diagnosis, from the folder that `diagnose` or ``explorer diagnose`` wrote.

    Raises ValueError, in one line, where there is none, or one of another version of the program.
    """
    return _read(DiagnosisResult, folder, DiagnosisResult.NAME)


@dataclass(frozen=True, repr=False)
class Chart:
    """One chart of a report. A notebook shows it with its caption, and nothing of it leaves the machine.

    Attributes
    ----------
    report, section
        Titles of the report and of the section that it stands in.
    drawn : explorer.report.content.Figure
        Its name, its traces and layout as plotly reads them (``drawn.spec``), and its caption.
    """

    report: str
    section: str
    drawn: Figure

    @property
    def figure(self) -> Any:
        """The same as a ``plotly.graph_objects.Figure``, to be changed or written to a file.

        plotly's own display has a button that uploads the data: ``figure.show(config=chart.config)`` leaves it out.
        """
        from plotly import graph_objects  # half a second, for those who change a chart

        return graph_objects.Figure(self.drawn.spec)

    @property
    def config(self) -> dict[str, Any]:
        """plotly's options for the display of :attr:`figure`, with every way out to the network off."""
        return dict(CONFIG)

    def __repr__(self) -> str:
        """Its name and its section."""
        return f"<Chart {self.drawn.name!r}: {self.section}>"

    def _repr_html_(self) -> str:
        return _inline([self])


class Charts(dict[str, Chart]):
    """Charts by name, in the order of the report; a notebook shows them all."""

    def __repr__(self) -> str:
        """Their names."""
        return f"<Charts {', '.join(self)}>"

    def _repr_html_(self) -> str:
        return _inline(self.values())


def charts(result: StudyResult | DiagnosisResult) -> Charts:
    """The charts that the report of a study or of a diagnosis draws.

    Parameters
    ----------
    result
        From :func:`run_study`, :func:`load_study`, :func:`diagnose` or :func:`load_diagnosis`.

    Returns
    -------
    Charts
        Name ("pareto", "ascent", "contours-1", …) → :class:`Chart`; those that the result has something for.
    """
    report = study_report(result) if isinstance(result, StudyResult) else diagnosis_report(result)
    found = (
        Chart(report.title, section.title, one)
        for section in report.sections
        for one in shown_in(section.blocks)
        if isinstance(one, Figure)
    )
    return Charts({chart.drawn.name: chart for chart in found})


def _inline(drawn: Iterable[Chart]) -> str:
    """A page of charts as a report has it, in a frame: style and script are its own, and it may load nothing."""
    shown = list(drawn)
    sections = [
        Section(title, tuple(chart.drawn for chart in several))
        for title, several in groupby(shown, lambda chart: chart.section)
    ]
    height = AROUND_CHARTS + sum(chart.drawn.spec["layout"]["height"] + AROUND_CHART for chart in shown)
    content = escape(page(Report(shown[0].report if shown else "", "", None, tuple(sections))))
    return (
        f'<iframe srcdoc="{content}" sandbox="allow-scripts allow-downloads" '
        f'style="width:100%; height:{min(height, MOST_HEIGHT)}px; border:0"></iframe>'
    )


def _read(kind: type[Read], folder: str | Path, name: str) -> Read:
    place = checked_folder(str(folder), name)
    found = read_result(kind, place, name)
    if found is None:  # taken away a moment ago
        raise CommandError(f"{place}: holds no {name}")
    return found
