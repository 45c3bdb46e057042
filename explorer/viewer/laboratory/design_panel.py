"""A design of one's own: the sheet of its runs, and what the filled sheet says."""

from __future__ import annotations

from doe.designs import DESIGNS
from doe.table_file import SUFFIXES
from explorer.design.analysis import AnalyseOrder
from explorer.design.choices import ModelOrder
from explorer.design.run_plan import DesignOrder
from explorer.laboratory.command_results import analysis_result, sheet_result
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.laboratory.inputs import UploadSlot, number_or_none, positive
from explorer.viewer.panel import LABORATORY, PageContext, Panel
from solver.assets import shipped_assets

SHEET = "Name the factors in a TOML file (explorer/design/README.md), or take the shipped one, then: Make the sheet."
FILLED = "Fill the responses into the sheet, upload it, then: Analyse."


class DesignPanel(Panel):
    """Factors → sheet, and filled sheet → effects, model, optimum."""

    name, tab = "design", LABORATORY

    def __init__(self, page: PageContext) -> None:
        server, gui, folder, post = page.server, page.server.gui, page.uploads, page.post
        self._background = page.bench_work
        with gui.add_folder("Your own design → runs", expand_by_default=False):
            self._kind = gui.add_dropdown(
                "Design", tuple(DESIGNS), initial_value="box-behnken", hint="Which runs are made."
            )
            self._factors = UploadSlot(
                server, "Factors", shipped_assets("designs"), (".toml",), folder, post, "Name, low, high, unit of each."
            )
            self._replicates = gui.add_number("Runs of each row", 1, min=1, max=1000, step=1)
            self._size = gui.add_number(
                "Size",
                0,
                min=0,
                max=20_000,
                step=1,
                hint="Rows of a table or fraction, or points; 0: as usual.",
            )
            self._blocks = gui.add_number(
                "Blocks",
                0,
                min=0,
                max=512,
                step=1,
                hint="Days or batches, clear of the model's effects; 0: none.",
            )
            self._nonregular = gui.add_checkbox(
                "Nonregular", False, hint="plackett-burman, 16 and 32 runs: no main effect is wholly an interaction."
            )
            self._fold = gui.add_checkbox(
                "Fold over", False, hint="plackett-burman: the mirror image of every row too, which frees main effects."
            )
            self._generators = gui.add_text(
                "Generators", "", hint="factorial: a fraction, as E=ABC; several with spaces between."
            )
            self._model = gui.add_dropdown(
                "Model", tuple(one.value for one in ModelOrder), initial_value="quadratic", hint="Whose terms are told."
            )
            self._constraints = gui.add_text(
                "Constraints", "", hint="In the factors' units, as A + B <= 1; several with ; between."
            )
            self._sigma = gui.add_number(
                "Standard deviation of a run", 0.0, min=0.0, hint="In the response's unit; 0: unknown. For the power."
            )
            self._follow()
            make = gui.add_button("Make the sheet", hint="Says what is confused with what, and what it will see.")
            self.sheet = AnswerView(server, SHEET, post)
        with gui.add_folder("Filled sheet → model and optimum", expand_by_default=False):
            self._filled = UploadSlot(
                server, "Sheet", shipped_assets("runs"), SUFFIXES, folder, post, "From any laboratory or engine."
            )
            self._response = gui.add_text("Response", "", hint="Column to analyse; empty where there is only one.")
            self._target = gui.add_text("Target", "", hint="Value that the response should have; empty: none.")
            self._block = gui.add_text(
                "Block", "", hint="Column of days, batches or operators; empty: none. Each has an effect of its own."
            )
            analyse = gui.add_button("Analyse", hint="Effects, equations, ANOVA, diagnostics, canonical analysis.")
            self.analysis = AnswerView(server, FILLED, post, charts=True, reports=page.project.laboratory)
        self._kind.on_update(lambda event: post(self._follow) if event.client_id is not None else None)
        make.on_click(lambda _: post(self._make))
        analyse.on_click(lambda _: post(self._analyse))

    def set_dark(self, dark: bool) -> None:
        """Charts for a dark page, or a light one."""
        self.analysis.set_dark(dark)

    def _follow(self) -> None:
        """Ask for what the chosen kind of design takes."""
        kind = DESIGNS.get(str(self._kind.value))
        fields = {
            "runs": self._size,
            "blocks": self._blocks,
            "nonregular": self._nonregular,
            "fold": self._fold,
            "generators": self._generators,
            "model": self._model,
            "constraints": self._constraints,
        }
        for name, handle in fields.items():
            handle.visible = kind is not None and name in kind.options

    def _make(self) -> None:
        order = DesignOrder(
            str(self._kind.value),
            runs=(int(self._size.value) or None) if self._size.visible else None,
            replicates=int(self._replicates.value),
            fold=self._fold.visible and bool(self._fold.value),
            generators=tuple(str(self._generators.value).split()) if self._generators.visible else (),
            blocks=(int(self._blocks.value) or None) if self._blocks.visible else None,
            nonregular=self._nonregular.visible and bool(self._nonregular.value),
            model=ModelOrder(self._model.value) if self._model.visible else None,
            constraints=tuple(one.strip() for one in str(self._constraints.value).split(";") if one.strip())
            if self._constraints.visible
            else (),
        )
        factors = self._factors.chosen
        known = positive(self._sigma.value)
        self._background.start("making the sheet", lambda: sheet_result(order, factors, known), self.sheet.show)

    def _analyse(self) -> None:
        target = number_or_none(str(self._target.value), "target")
        response, block = (str(one.value).strip() for one in (self._response, self._block))
        order = AnalyseOrder(self._filled.chosen, response, target, block=block)
        self._background.start("analysing the sheet", lambda: analysis_result(order), self.analysis.show)
