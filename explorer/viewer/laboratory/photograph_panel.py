"""The angle of repose on photographs, with the readings drawn in, and as the target of the page's study."""

from __future__ import annotations

from collections.abc import Callable
from html import escape

from doe.studies.study import load_study
from explorer.errors import CommandError
from explorer.files.measured_curves import PICTURES
from explorer.laboratory.command_results import (
    CommandResult,
    PhotographReading,
    Ruler,
    compared_result,
    example_rulers,
    measured_target,
    photograph_reading,
    photograph_result,
)
from explorer.photograph.marks import UNMARKED, Marks
from explorer.photograph.target import PhotographedTarget, remove_target
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.laboratory.inputs import UploadSlot, positive
from explorer.viewer.panel import LABORATORY, SELDOM, Now, PageContext, Panel
from explorer.viewer.tables.marks_page import PhotographInHand, marks_page
from explorer.viewer.tables.table_server import link_html
from explorer.viewer.view import small_html
from solver.assets import shipped_assets

WAITING = "Camera level, the plate's edge in view. Choose a shipped picture or upload one, then: Read the angle."
NO_RULER = (
    "Give the length of a pixel, or of a straight bar in the picture; without either, lengths stay in pixels. Angles "
    "need neither."
)
MARK = "Mark base line or a known length in it"
NOTHING_MARKED = "Nothing is marked: the program finds the base line."
NO_BOARD = "none: estimate lens distortion from the base line"
OWN = "The study's target is that of its file. What is read off a photograph can take its place."


class PhotographPanel(Panel):
    """Picture, scale, lens, answer, target; uploads are kept, and so are the pours compared with pictures."""

    name, tab, title, every = "photograph", LABORATORY, "Photograph → angle of repose", SELDOM

    def __init__(self, page: PageContext) -> None:
        server, gui, folder, post = page.server, page.server.gui, page.uploads, page.post
        self._session, self._folder, self._background = page.session, folder, page.bench_work
        self._target, self._study = page.target, page.project.study
        self._shown: PhotographReading | None = None
        self._rulers, examples = example_rulers(), shipped_assets("photographs")
        self._photo = UploadSlot(
            server, "Photograph", examples, PICTURES, folder, post, "One pile, from the side.", self._follow
        )
        self._ruler_said = gui.add_html("")
        self._scale = gui.add_number(
            "Scale [mm per pixel]", 0.0, min=0.0, max=10.0, step=0.001, hint="0: lengths stay in pixels."
        )
        self._bar = gui.add_number(
            "Reference bar [mm]",
            0.0,
            min=0.0,
            max=10_000.0,
            step=0.1,
            hint="Length of the one straight bar in the picture, in place of the scale; 0: there is none.",
        )
        self._board = UploadSlot(
            server,
            "Checkerboard",
            (NO_BOARD,),
            PICTURES,
            folder,
            post,
            "A printed one, by the same camera at the same distance: its corners tell how far the lens bends pictures.",
        )
        self._marked: tuple[str, Marks] = ("", UNMARKED)
        in_hand = PhotographInHand(lambda: self._photo.chosen, self._take_marks)
        gui.add_html(small_html(link_html(page.tables.publish(marks_page(in_hand, post)), MARK)))
        self._marks_said = gui.add_html("")
        self._unmark = gui.add_button("Remove the marks", visible=False, hint="The program finds the base line again.")
        self._given = Ruler()
        self._follow(examples[0])
        read = gui.add_button("Read the angle", hint="By the estimator of the simulated piles.")
        beside = gui.add_button(
            "Read it beside a pour",
            hint="Pours what is on the screen once more, in the background, and reads both piles by the same fit.",
        )
        self.view = AnswerView(server, WAITING, post)
        self._told = gui.add_html(small_html(escape(OWN)))
        self._use = gui.add_button(
            "Use as target",
            disabled=True,
            hint="What was read is what Calibrate aims at, in place of the study's own angle, also after a restart.",
        )
        self._add = gui.add_button(
            "Add to the target",
            disabled=True,
            hint="Another pile of the same material: mean over all of them, and the standard deviation between them.",
        )
        self._remove = gui.add_button("Remove the target", disabled=True, hint="The study's own holds again.")
        self._unmark.on_click(lambda _: post(lambda: self._take_marks("", UNMARKED)))
        read.on_click(lambda _: post(self._read))
        beside.on_click(lambda _: post(self._compare))
        self._use.on_click(lambda _: post(lambda: self._keep(anew=True)))
        self._add.on_click(lambda _: post(lambda: self._keep(anew=False)))
        self._remove.on_click(lambda _: post(self._forget))

    def show(self, now: Now) -> None:
        """Show the target, and enable the buttons that apply now."""
        target = self._target.now
        kept = "" if target is None else f"Target of the study: {target.line} Kept in {target.folder}."
        text = small_html(escape(kept or OWN))
        if self._told.content != text:
            self._told.content = text
        offered = (
            (self._use, self._shown is not None),
            (self._add, self._shown is not None and target is not None),
            (self._remove, self._target.there),
        )
        for button, able in offered:
            if button.disabled == able:
                button.disabled = not able

    def _follow(self, chosen: str) -> None:
        """Show the scale of an example; the user's own entries stay for the user's photographs."""
        ruler = self._rulers.get(chosen, Ruler())
        if chosen in self._rulers or self._ruler() == self._given:
            self._scale.value = ruler.scale_mm or 0.0  # type: ignore[misc]
            self._bar.value = ruler.reference_mm or 0.0  # type: ignore[misc]
        self._given = ruler
        self._ruler_said.content = small_html(escape(ruler_words(ruler)))
        self._tell_marks()

    @property
    def _marks(self) -> Marks:
        """Marks in the chosen photograph; those in another one do not count."""
        photo, marks = self._marked
        return marks if photo == self._photo.chosen else UNMARKED

    def _take_marks(self, photo: str, marks: Marks) -> None:
        self._marked = (photo, marks)
        self._tell_marks()

    def _tell_marks(self) -> None:
        self._marks_said.content = small_html(escape(marks_words(self._marks)))
        self._unmark.visible = bool(self._marks)

    def _read(self) -> None:
        self._answer("reading the photograph", photograph_result)

    def _compare(self) -> None:
        scene, folder = self._session.status().scene, self._folder
        self._answer("pouring beside the photograph", lambda read: compared_result(read, scene, folder))

    def _answer(self, what: str, result_of: Callable[[PhotographReading], CommandResult]) -> None:
        """Read the photograph and show the result; the reading is kept for the target."""
        photo, ruler, marks = self._photo.chosen, self._ruler(), self._marks
        board = None if self._board.chosen == NO_BOARD else self._board.chosen

        def find() -> tuple[PhotographReading, CommandResult]:
            read = photograph_reading(photo, ruler, board, marks)
            return read, result_of(read)

        def done(found: tuple[PhotographReading, CommandResult]) -> None:
            self._shown, answer = found
            self.view.show(answer)

        self._background.start(what, find, done)

    def _keep(self, anew: bool) -> None:
        """Make the shown photograph the target, or one of the target's photographs."""
        if self._shown is None:
            raise CommandError("read a photograph first; its angle of repose becomes the target")
        read, folder, study = self._shown, self._target.folder, self._study

        def keep() -> PhotographedTarget:
            return measured_target(read, folder, load_study(str(study)).targets, anew)

        self._background.start("keeping the photograph", keep, lambda _: None)

    def _forget(self) -> None:
        remove_target(self._target.folder)

    def _ruler(self) -> Ruler:
        return Ruler(positive(self._scale.value), positive(self._bar.value))


def ruler_words(ruler: Ruler) -> str:
    """What gives the scale of a photograph, in a sentence."""
    if ruler.reference_mm is not None:
        return f"An example: its bar is {ruler.reference_mm:g} mm long, as entered below."
    if ruler.scale_mm is not None:
        return f"An example: a pixel of it is {ruler.scale_mm:g} mm, as entered below."
    return NO_RULER


def marks_words(marks: Marks) -> str:
    """What the user marked, in a sentence."""
    said = []
    if marks.base_line is not None:
        left, right = marks.base_line
        said.append(f"the base line, {left:.1f} px below the top at the left edge and {right:.1f} px at the right")
    if marks.length_mm is not None:
        said.append(f"a length of {marks.length_mm:g} mm, which stands in place of scale and bar")
    return f"Marked: {', and '.join(said)}." if said else NOTHING_MARKED
