"""Readings of a bench test become parameters with which the pile is poured."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import viser

from doe.laboratory import TESTS
from doe.laboratory.bias import BIASED
from doe.table_file import SUFFIXES
from explorer.background.command_output import kept_scene
from explorer.laboratory.command_results import CommandResult, bench_result, examples_of, template_file, twin_result
from explorer.laboratory.part import measured_source
from explorer.laboratory.run import LabOrder, analysed
from explorer.laboratory.twin_row import RIGS
from explorer.scene.source import SceneSource
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.laboratory.inputs import UploadSlot, parts_of
from explorer.viewer.output.send_file import send_file
from explorer.viewer.panel import LABORATORY, PageContext, Panel

NO_COMPRESSION = "none"
WAITING = "Choose a test; its readings are those of the shipped example until you upload yours. Then: Evaluate."


class BenchPanel(Panel):
    """Test, readings, answer."""

    name, tab, title = "bench", LABORATORY, "Bench test → parameters"

    def __init__(self, page: PageContext) -> None:
        server, gui, folder, post = page.server, page.server.gui, page.uploads, page.post
        self._session, self._folder, self._background = page.session, folder, page.bench_work
        tests = tuple(TESTS)
        self._test = gui.add_dropdown("Test", tests, hint="What was measured; its columns: Sheet to fill in.")
        sheet = gui.add_button(
            "Sheet to fill in", hint="Columns, units, what to write, how many replicates; then upload it as readings."
        )
        self._readings = UploadSlot(
            server,
            "Readings",
            examples_of(tests[0]),
            SUFFIXES,
            folder,
            post,
            "One row per replicate or point of a curve.",
        )
        self._compression = UploadSlot(
            server,
            "Compression readings",
            (NO_COMPRESSION, "compression"),
            SUFFIXES,
            folder,
            post,
            "Of the same components, for Poisson's ratio.",
        )
        self._left_out = gui.add_text(
            "Leave out", "", hint="Components that are not poured, commas between; the rest is scaled to one."
        )
        self._twin = gui.add_checkbox(
            "Repeat it on the solver",
            False,
            hint="The same test with the parameters just found, in the background: does it give them back?",
        )
        self._bias = gui.add_checkbox(
            "Where the formula misses",
            False,
            hint="Compares the result of the usual formula with known inputs over a range.",
        )
        evaluate = gui.add_button("Evaluate", hint="Mean, spread, interval, normality, outliers, parameters.")
        pour = gui.add_button(
            "Pour with these parameters", hint="The present material with what was measured, as a file of its own."
        )
        self.view = AnswerView(server, WAITING, post, charts=True, reports=page.project.laboratory)
        self._follow(tests[0])
        evaluate.on_click(lambda _: post(self._evaluate))
        pour.on_click(lambda _: post(self._pour))

        @self._test.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                test = str(event.target.value)
                post(lambda: self._choose(test))

        @sheet.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                client = event.client
                post(lambda: send_file(client, *template_file(str(self._test.value))))

    def set_dark(self, dark: bool) -> None:
        """Draw the charts for a dark or a light page."""
        self.view.set_dark(dark)

    def _choose(self, test: str) -> None:
        self._readings.offer(examples_of(test))
        self._follow(test)

    def _follow(self, test: str) -> None:
        """Show the inputs that the test takes."""
        self._compression.visible = test == "shear"
        self._left_out.visible = test == "composition"
        self._twin.visible = test in RIGS
        self._bias.visible = test in BIASED

    def _order(self) -> LabOrder:
        test, beside = str(self._test.value), self._compression.chosen
        given = beside if self._compression.visible and beside != NO_COMPRESSION else None
        left_out = parts_of(str(self._left_out.value), ",") if self._left_out.visible else ()
        return LabOrder(test, self._readings.chosen, given, left_out)

    def _evaluate(self) -> None:
        order, twin, bias = self._order(), *(box.visible and bool(box.value) for box in (self._twin, self._bias))
        if not (twin or bias):
            self._background.start("evaluating the readings", lambda: bench_result(order), self.view.show)
            return
        present, folder = self._session.status().scene, self._folder

        def on_the_solver() -> CommandResult:
            material = str(kept_scene(present, folder)) if twin else None
            return twin_result(replace(order, simulate=twin, bias=bias, material=material))

        self._background.start("running the test on the solver", on_the_solver, self.view.show)

    def _pour(self) -> None:
        order, present, folder = self._order(), self._session.status().scene, self._folder
        material = self._session.source.material
        self._background.start(
            "making a material of the readings",
            lambda: measured_source(present, analysed(order), folder, material),
            self._start,
        )

    def _start(self, source: SceneSource) -> None:
        self._session.start(source.scene, self._session.status().seed, source)
