"""The diagnosis on the page: choose data and effects, start, watch, pause, resume; the answer, its charts, others."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from contextlib import suppress
from functools import partial
from pathlib import Path

import viser

from doe.declared.budget import Budget
from doe.measurement.scans import SUFFIXES
from doe.record import RecordError
from explorer.background.command_process import CommandStatus
from explorer.background.output_folder import ResultFile
from explorer.diagnosis.follow_up_tables import add_scan, packed, read_follow_up, take_filled
from explorer.diagnosis.next_folder import NEXT, ORDER, measured_so_far
from explorer.diagnosis.piles import AnswerPiles, answer_piles
from explorer.diagnosis.process import RESULT, Question
from explorer.diagnosis.result import CORRECTED_STUDY, SHORT_PROFILE, DiagnosisResult
from explorer.errors import CommandError
from explorer.files.uploads import kept_measurements
from explorer.report.diagnosis.answer import follow_up_text
from explorer.scene.source import SceneSource
from explorer.units import checked, code, enumeration, parameter_label, parameter_value
from explorer.viewer.actions import button_group, on_upload
from explorer.viewer.board.board_view import BoardView
from explorer.viewer.board.diagnosis_board import (
    ASK_FURTHER,
    CALIBRATE_CORRECTED,
    FURTHER_ACT,
    POUR_CORRECTED,
    SIDE_BY_SIDE,
    SIDE_BY_SIDE_ACT,
    diagnosis_board,
)
from explorer.viewer.output.pile_recording import PileRecording
from explorer.viewer.output.send_file import send_file
from explorer.viewer.panel import DIAGNOSE, SELDOM, Now, PageContext, Panel
from explorer.viewer.study.process_view import (
    PlaceChoice,
    ProcessView,
    escaped,
    orders,
    state_markdown,
    waiting_markdown,
)
from explorer.viewer.study.result_chooser import ResultChooser
from explorer.viewer.tables.follow_up_page import follow_up_page
from explorer.viewer.tables.table_server import link_html
from explorer.viewer.view import small_html
from solver import EFFECTS, Scene
from solver.assets import shipped_measurements

MOST_POURS = 100_000
AUTOMATIC = (
    f"Automatic: {Budget().base} pours of the declared model, {Budget().screening} for each direction of an effect, "
    f"then {Budget().more} at a time for effects still undecided."
)
FIRST = "trefoil_2"
"""Chosen at first, if it is shipped: the data set of `make diagnose`."""
OWN = "folder below"
"""Choice of the list that takes the folder in the text field."""
PRESENT = "present or newest diagnosis"
FILL_IN = "Fill it in, in a table"
NARROW = 900
"""Width [px] of a picture in which three piles are too close to be told apart."""


class DiagnosisPanel(Panel):
    """Controls a :class:`DiagnosisProcess`; the data sets to choose from are shipped or uploaded."""

    name, tab, every = "diagnosis", DIAGNOSE, SELDOM

    def __init__(self, page: PageContext) -> None:
        server, gui, diagnosis, post = page.server, page.server.gui, page.diagnosis, page.post
        self._diagnosis, self._file = diagnosis, ResultFile(RESULT)
        self._shipped, self._uploads, self._measured = shipped_measurements(), page.uploads, page.project.measured
        self._shown: Hashable = None
        self._looked: tuple[str, str] = ("", "")
        self._stopped: Path | None = None
        self._data = gui.add_dropdown(
            "Measured data",
            self._offered(),
            initial_value=next(iter(self._of_project()), FIRST if FIRST in self._shipped else OWN),
            hint="The project's data set, those that come with the program, those uploaded under Pour or saved under "
            "Laboratory, or a folder of your own. With nothing in the store all effects take some 150 to 400 pours: 15 "
            "to 40 min on two cores for the shipped data, minutes for a second set of the same model.",
        )
        self._folder = gui.add_text(
            "Folder", "", hint="Folder with measurement.toml, on the machine that serves this page."
        )
        with gui.add_folder("Effects in question, and how much is poured", expand_by_default=False):
            self._candidates = CandidateEffects(server)
        self._place = PlaceChoice(server, page.place, "diagnosis", post)
        acts = orders(diagnosis, self._start, self._resume, self._queue)
        self._view = ProcessView(server, "Diagnosis", acts, post)
        with gui.add_folder("Other results", expand_by_default=False):
            self._chooser = ResultChooser(server, "Result", PRESENT, RESULT, post, self._follow)
        self._trouble = gui.add_markdown("")
        self._result: DiagnosisResult | None = None
        self._former: tuple[Scene, int, SceneSource] | None = None
        self._answer: SceneSource | None = None
        self._page = page
        self._piles = button_group(
            gui,
            "Piles",
            {
                SIDE_BY_SIDE_ACT.label: self._show_piles,
                "Back to my pour": self._back,
            },
            post,
            hint="Measured pile, calibrated model and corrected model in the scene, with one clock and one camera. "
            "They take the place of your own pour; *Back to my pour* pours that again, with its seed.",
        )
        self._corrected = button_group(
            gui,
            "Corrected model",
            {
                "Pour it": self._pour_corrected,
                "Calibrate it": self._calibrate_corrected,
                FURTHER_ACT.label: self._ask_further,
            },
            post,
            hint="The corrected model alone, as the pour that the controls act on; or a study of it in the background "
            "(*Calibrate*), with its quick profile; or another diagnosis of the same data, with the effect in the "
            "model: it takes about as long as the first.",
        )
        for name, act in {
            SIDE_BY_SIDE: self._show_piles,
            POUR_CORRECTED: self._pour_corrected,
            CALIBRATE_CORRECTED: self._calibrate_corrected,
            ASK_FURTHER: self._ask_further,
        }.items():
            page.channel.offer(name, lambda _, act=act: post(act))  # type: ignore[misc]
        self._follow_up = FollowUp(page, self._begin_follow_up)
        self._recording = PileRecording(page, self._record_order)
        self._offer_piles()
        self._board = BoardView(server, page.pages, "/diagnosis/page.json", "Diagnosis")

    def _to_resume(self, status: CommandStatus) -> Path | None:
        """Folder in which to continue, looked up again only for other data or when a diagnosis begins or ends."""
        chosen = self._chosen_data()
        if (status.state, chosen) != self._looked:
            self._looked, self._stopped = (status.state, chosen), self._diagnosis.stopped(Question(chosen))
        return self._stopped

    def _start(self) -> None:
        self._diagnosis.start(self._question())

    def _resume(self) -> None:
        self._diagnosis.resume(self._question())

    def _queue(self) -> None:
        self._diagnosis.queue(self._question())

    def _offered(self) -> tuple[str, ...]:
        """Present entries of the list of data sets."""
        return (*self._of_project(), *self._shipped, *self._kept(), OWN)

    def _of_project(self) -> dict[str, Path]:
        """The project's own data set, by its title in the list, if it names one."""
        return {} if self._measured is None else {f"{self._measured.name} (project)": self._measured}

    def _kept(self) -> dict[str, Path]:
        """Data sets of this server's user, by their titles in the list, none of which is a shipped one's."""
        kept = kept_measurements(self._uploads).items()
        return {f"{name} (own)" if name in self._shipped else name: folder for name, folder in kept}

    def _chosen_data(self) -> str:
        if self._data.value == OWN:
            return str(self._folder.value)
        chosen = str(self._data.value)
        return str((self._kept() | self._of_project()).get(chosen, chosen))

    def _question(self) -> Question:
        return Question(self._chosen_data(), self._candidates.effects, self._candidates.budget)

    def show(self, now: Now) -> None:
        """Show the progress of the diagnosis."""
        offered = self._offered()
        if tuple(self._data.options) != offered:
            self._data.options = offered
        if self._folder.visible != (self._data.value == OWN):
            self._folder.visible = self._data.value == OWN
        self._place.show()
        status = self._diagnosis.status()
        # How much more is poured, in this stage and later, depends on the results.
        waiting = self._diagnosis.waiting()
        stopped = self._to_resume(status)
        goes_on = stopped is not None and stopped == self._diagnosis.out
        text = state_markdown(status, "diagnosis", "pours", now.notice, counted="known of this stage", goes_on=goes_on)
        self._view.show(status, text + waiting_markdown(waiting), waiting, stopped is not None)
        self._chooser.offer(self._diagnosis.finished())
        self._follow()
        self._offer_piles()
        self._recording.show()
        self._show_board()

    def _follow(self) -> None:
        """Show the chosen result if it has changed."""
        folder = self._chooser.folder or self._present()
        content = self._file.read(folder)
        shown = (folder, self._file.version)
        if shown == self._shown:
            return
        self._shown = shown
        trouble = ""
        try:
            self._result = None if content is None else DiagnosisResult.from_dict(content)
        except RecordError as error:
            # A folder named by the user may hold any JSON, also that of another version.
            self._result, trouble = None, escaped(f"{folder}: {error}")
        self._trouble.content = trouble

    def _offer_piles(self) -> None:
        """Enable what the answer allows, and the way back from it."""
        found = self._result is not None
        for buttons, visible in (
            (self._piles, found or self._former is not None),
            (self._corrected, self._result is not None and bool(self._result.added)),
        ):
            if buttons.visible != visible:
                buttons.visible = visible
        self._recording.offer(found)
        self._follow_up.offer(self._result, self._chooser.folder or self._present())

    def _begin_follow_up(self, result: DiagnosisResult, folder: Path) -> None:
        """Ask the same question again, with what was measured in ``folder``."""
        order = result.order
        question = Question(result.data.folder, order.effects, order.budget, order.given or "", str(folder))
        self._diagnosis.start(question)

    def _show_piles(self) -> None:
        """Measured pile, calibrated and corrected model side by side; the middle one is the page's own pour."""
        result = self._found()
        self._page.background.start("reading the measured data", lambda: answer_piles(result), self._place_piles)

    def _place_piles(self, piles: AnswerPiles) -> None:
        fold_beside_narrow(self._page)
        before, after = piles.poured
        names = poured_sign("calibrated model", *before), poured_sign("corrected model", *after)
        self._page.beside.pour(piles.after, self._pour(piles.before), names)
        self._page.beside.show_measured(piles.measured, measured_sign(piles), piles.before)

    def _pour_corrected(self) -> None:
        """Pour the corrected model as the page's own pour."""
        result = self._found()

        def begin(piles: AnswerPiles) -> None:
            self._pour(piles.after)

        self._page.background.start("reading the measured data", lambda: answer_piles(result), begin)

    def _calibrate_corrected(self) -> None:
        """Start the study of the corrected model that the diagnosis has written."""
        result, folder = self._found(), self._chooser.folder or self._present()
        assert folder is not None
        file = folder / CORRECTED_STUDY
        if not file.is_file():
            why = f"{folder} holds no {CORRECTED_STUDY}: a diagnosis that is started here writes it"
            why = why if result.added else "nothing is added"
            raise CommandError(f"there is no corrected model to calibrate: {why}")
        self._page.study.start(SHORT_PROFILE, file=file)

    def _ask_further(self) -> None:
        """Start another diagnosis of the same data, with the effect found by this one in the model."""
        result, folder = self._found(), self._chooser.folder or self._present()
        if not result.handed_on():
            raise CommandError("no effect here is probable enough to be named, so there is none to continue from")
        budget = self._candidates.budget
        self._diagnosis.start(Question(result.data.folder, self._candidates.effects, budget, str(folder)))

    def _record_order(self) -> tuple[Path, list[str]]:
        """Folder of the shown diagnosis, and its command line."""
        result, folder = self._found(), self._chooser.folder or self._present()
        assert folder is not None
        return folder, ["diagnose", result.data.folder]

    def _pour(self, scene: Scene) -> int:
        """Pour a scene of the answer with the seed on the screen, and remember the user's own pour; return the seed."""
        session = self._page.session
        status = session.status()
        if session.source != self._answer:
            self._former = status.scene, status.seed, session.source
        self._answer = SceneSource((), scene)
        session.start(scene, status.seed, self._answer)
        return status.seed

    def _back(self) -> None:
        """Pour again what was on the screen before an answer replaced it."""
        if self._former is None:
            raise CommandError("your own pour is on the screen")
        self._page.beside.close()
        self._page.study_panel.expand()
        self._page.session.start(*self._former)
        self._former = None

    def _present(self) -> Path | None:
        """Folder of the diagnosis that was started last; before the first start, the newest finished one."""
        return self._diagnosis.out or next(iter(self._diagnosis.finished()), None)

    def _found(self) -> DiagnosisResult:
        if self._result is None:
            raise CommandError("there is no finished diagnosis yet: start one, or choose one under Other results")
        return self._result

    def _show_board(self) -> None:
        """Show the board of the chosen result."""
        chosen, result = self._chooser.folder, self._result
        status = self._diagnosis.status() if chosen is None else None
        self._board.show(
            self._shown,
            chosen or self._present(),
            status,
            # While it runs, its earlier finding is not an answer to the present question.
            lambda status, report: diagnosis_board(None if status and status.alive else result, status, report),
        )


def fold_beside_narrow(page: PageContext) -> None:
    """Collapse the study panel if it leaves a browser too little width for three piles."""
    widths = [client.camera.image_width for client in page.server.get_clients().values()]
    if any(0 < width < NARROW for width in widths):
        page.study_panel.minimize()


def measured_sign(piles: AnswerPiles) -> str:
    """Text above the measured pile: its condition and its angle, mean ± standard deviation over pours."""
    shown = "measured, mean profile" if piles.measured and piles.measured.of_revolution else "measured"
    return f"{shown} ({piles.condition.name}){angle_line(*piles.angle)}"


def poured_sign(model: str, mean: float, sd: float, pours: int) -> str:
    """Text above a model's pile: the result of all its fresh pours, as a single pour may say the opposite."""
    angle = angle_line(mean, sd) if pours > 1 else ""
    return f"{model}{angle} over {pours} pours" if angle else model


def angle_line(mean: float, sd: float) -> str:
    """A further line of a sign: mean ± standard deviation [°], as far as they are known."""
    spread = f" ± {sd:.1f}° SD" if math.isfinite(sd) else ""
    return f"\n{mean:.1f}°{spread}" if math.isfinite(mean) else ""


class FollowUp:
    """The follow-up of an answer that is open or can be checked: downloaded, filled in, and used for a new answer."""

    def __init__(self, page: PageContext, begin: Callable[[DiagnosisResult, Path], None]) -> None:
        gui, post = page.server.gui, page.post
        self._page, self._begin = page, begin
        self._result: DiagnosisResult | None = None
        self._folder: Path | None = None
        self._known: Hashable = None
        self._place = gui.add_folder("Follow-up", expand_by_default=True)
        with self._place:
            self._told = gui.add_markdown("")
            where = page.tables.publish(follow_up_page(lambda: self._folder, post))
            gui.add_html(small_html(link_html(where, FILL_IN)))
            taken = gui.add_button(
                "Take the folder along (.zip)",
                hint="What to set and to measure (README.md, a drawing), and the tables to fill in.",
            )
            filled = gui.add_upload_button(
                "Upload it filled in", mime_type=".zip", hint="The folder as .zip, its tables filled in, scans added."
            )
            # In a folder of its own, because viser's client shows an upload button whether it is visible or not.
            self._scans = gui.add_folder(None)
            with self._scans:
                scan = gui.add_upload_button(
                    "Add a scan",
                    mime_type=",".join(SUFFIXES),
                    hint="Of the first pile that has none yet; unit and axis as in the first data.",
                )
            answer = gui.add_button(
                "Answer with the follow-up", hint="Weighs all answers again, with these pours beside the others."
            )
        taken.on_click(lambda event: post(partial(self._send, event.client)))
        answer.on_click(lambda _: post(self._answer))
        on_upload(filled, self._take, post)
        on_upload(scan, self._add_scan, post)

    def offer(self, result: DiagnosisResult | None, folder: Path | None) -> None:
        """Show what ``result`` in ``folder`` asks for, and how much of it is filled in."""
        asked = None if folder is None or result is None or not result.next_experiment else folder / NEXT
        self._result, self._folder = result, asked if asked and (asked / ORDER).is_file() else None
        if self._place.visible != (self._folder is not None):
            self._place.visible = self._folder is not None
        if self._folder is None or result is None:
            return
        known = result, self._folder, _written(self._folder)
        if known != self._known:
            self._known = known
            self._told.content = _follow_up_markdown(result, self._folder)
            scanned = (self._folder / "scans").is_dir()
            if self._scans.visible != scanned:
                self._scans.visible = scanned

    def _send(self, client: viser.ClientHandle | None) -> None:
        _, folder = self._asked()
        if client is not None:
            send_file(client, f"{folder.parent.name}_follow_up.zip", packed(folder))

    def _take(self, name: str, content: bytes) -> None:
        result, folder = self._asked()
        take_filled(folder, result.next_experiment[0], name, content, self._page.uploads)

    def _add_scan(self, name: str, content: bytes) -> None:
        add_scan(self._asked()[1], name, content)

    def _answer(self) -> None:
        result, folder = self._asked()
        # Read here first: missing or wrong data are reported at once, not by a process that has failed.
        self._page.background.start(
            "reading the follow-up", lambda: measured_so_far(folder), lambda _: self._begin(result, folder)
        )

    def _asked(self) -> tuple[DiagnosisResult, Path]:
        if self._result is None or self._folder is None:
            raise CommandError("the answer that is shown asks for no follow-up")
        return self._result, self._folder


def _written(folder: Path) -> tuple[int, ...]:
    """Times at which tables and scans in ``folder`` were written."""
    written = []
    for file in sorted((*folder.iterdir(), *folder.glob("scans/*"))):
        with suppress(FileNotFoundError):  # another program may be at work in it
            written.append(file.stat().st_mtime_ns)
    return tuple(written)


def _follow_up_markdown(result: DiagnosisResult, folder: Path) -> str:
    """What to measure, why, and how much of it there is."""
    asked = result.next_experiment[0]
    try:
        tables = read_follow_up(folder)
    except (ValueError, OSError) as error:
        return escaped(str(error))
    cells = tables.cells
    scans = f", {len(tables.scanned)} of {asked.pours} scans" if (folder / "scans").is_dir() else ""
    done = f"Filled in: {sum(map(bool, cells))} of {len(cells)} values{scans}."
    if not asked.pours:
        return f"{follow_up_text(result)}\n\n{done}"
    changes = [f"{parameter_label(path)} **{parameter_value(path, new)}**" for path, new in asked.values.items()]
    if asked.turned:
        changes.append("the whole rig **turned by 180° on its bench**")
    return (
        f"{follow_up_text(result)}\n\n"
        f"Otherwise than in condition {code(asked.condition)}: {enumeration(changes) or 'nothing'}. "
        f"All else as before.\n\n{done}"
    )


class CandidateEffects:
    """A check box per effect, all set at first, and the number of pours; both are read when a diagnosis starts."""

    def __init__(self, server: viser.ViserServer) -> None:
        gui = server.gui
        gui.add_markdown(
            "An effect that is not asked about can never be the answer, and another one may take its place: leave out "
            "only what your set-up cannot have."
        )
        self._boxes = {
            name: gui.add_checkbox(name.replace("_", " "), True, hint=f"What reveals it: {kind.lever}.")
            for name, kind in EFFECTS.items()
        }
        self._pours = gui.add_number("Pours (0: automatic)", 0, min=0, max=MOST_POURS, step=10, hint=AUTOMATIC)

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects that are asked about, () for all. Raises ValueError if none is left."""
        chosen = tuple(name for name, box in self._boxes.items() if box.value)
        if not chosen:
            raise ValueError("effects: none is chosen; at least one is needed")
        return () if len(chosen) == len(self._boxes) else chosen

    @property
    def budget(self) -> int | None:
        """Approximate number of pours before the first closer look; None: the program's own choice."""
        pours = checked(self._pours.value, 0, MOST_POURS, "pours")
        return round(pours) or None
