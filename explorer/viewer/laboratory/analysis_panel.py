"""Analysis of the completed sheet of a designed experiment."""

from __future__ import annotations

from doe.table_file import SUFFIXES
from explorer.design.analysis import AnalyseOrder
from explorer.design.choices import ModelOrder, Reduction, Surrogate
from explorer.laboratory.command_results import analysis_result
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.laboratory.inputs import UploadSlot, in_labels, number_or_none, parts_of
from explorer.viewer.panel import LABORATORY, PageContext, Panel
from explorer.viewer.tables.sheet_page import sheet_page
from explorer.viewer.tables.table_server import link_html
from explorer.viewer.view import small_html
from solver.assets import shipped_assets

FILLED = "Fill in the results here or in a file of your own, which you upload, then: Analyse."
HIGHEST = "highest that the runs bear"
REDUCTIONS = {
    "no": None,
    "by AICc": Reduction.AICC,
    "while p > 0.05": Reduction.P,
}
"""Choice → rule for dropping terms."""
FILL_IN = "Fill in this sheet in a table"
NO_FACTORS = "as the sheet says"
LABELS = {
    "--response NAME": "Response",
    "--response": "Response",
    "--target": "Target",
    "--target-error": "Standard error of the target",
    "--block": "Block",
    "--random": "Groups at random",
    "--model": "Model",
    "--terms": "Terms",
    "--reduce": "Drop terms",
    "--surrogate gp": "Gaussian process beside it",
    "--only": "Only",
    "--factors FILE": "Factors of the sheet",
    "--factors": "Factors of the sheet",
}
"""Option of the command line → label of its field."""


class AnalysisPanel(Panel):
    """Completed sheet → effects, model, optimum."""

    name, tab, title = "analysis", LABORATORY, "Filled sheet → model and optimum"

    def __init__(self, page: PageContext) -> None:
        server, gui, folder, post = page.server, page.server.gui, page.uploads, page.post
        self._background = page.bench_work
        self._filled = UploadSlot(
            server, "Sheet", shipped_assets("runs"), SUFFIXES, folder, post, "From any laboratory or engine."
        )
        page.sheet.slot = self._filled
        gui.add_html(small_html(link_html(page.tables.publish(sheet_page(page.sheet, post)), FILL_IN)))
        self._response = gui.add_text("Response", "", hint="Column to analyse; empty where there is only one.")
        self._target = gui.add_text("Target", "", hint="Value that the response should have; empty: none.")
        self._target_error = gui.add_text("Standard error of the target", "", hint="In its unit; empty: 0.")
        self._block = gui.add_text(
            "Block", "", hint="Column of days, batches or operators; empty: none. Each has an effect of its own."
        )
        self._random = gui.add_text(
            "Groups at random", "", hint="Column of days, whole plots or seeds drawn from many: a variance component."
        )
        with gui.add_folder("Model and factors", expand_by_default=False):
            self._model = gui.add_dropdown(
                "Model", (HIGHEST, *(one.value for one in ModelOrder)), hint="Polynomial that is fitted."
            )
            self._terms = gui.add_text(
                "Terms", "", hint="In place of a model, as A,B,A*B,A^2, or by names; what they need is added."
            )
            self._reduce = gui.add_dropdown(
                "Drop terms",
                tuple(REDUCTIONS),
                hint="One by one, a factor after its products; intervals of what is left are then too narrow.",
            )
            self._surrogate = gui.add_checkbox(
                "Gaussian process beside it", False, hint="Which predicts better? The target is answered by it."
            )
            self._only = gui.add_text("Only", "", hint="Only these factors, commas between; others count as scatter.")
            self._factors = UploadSlot(
                server,
                "Factors of the sheet",
                (NO_FACTORS, *shipped_assets("designs")),
                (".toml",),
                folder,
                post,
                "File of factors, for a sheet that declares none.",
            )
        analyse = gui.add_button("Analyse", hint="Effects, equations, ANOVA, diagnostics, canonical analysis.")
        self.view = AnswerView(server, FILLED, post, charts=True, reports=page.project.laboratory)
        analyse.on_click(lambda _: post(self._analyse))

    def set_dark(self, dark: bool) -> None:
        """Draw the charts for a dark or a light page."""
        self.view.set_dark(dark)

    def _analyse(self) -> None:
        factors = self._factors.chosen
        order = AnalyseOrder(
            sheet=self._filled.chosen,
            response=str(self._response.value).strip(),
            target=number_or_none(str(self._target.value), "target"),
            target_error=number_or_none(str(self._target_error.value), "standard error of the target") or 0.0,
            factors=None if factors == NO_FACTORS else factors,
            order=None if self._model.value == HIGHEST else ModelOrder(self._model.value),
            terms=parts_of(str(self._terms.value), ","),
            only=parts_of(str(self._only.value), ","),
            block=str(self._block.value).strip(),
            random=str(self._random.value).strip(),
            reduction=REDUCTIONS.get(str(self._reduce.value)),
            surrogate=Surrogate.GP if self._surrogate.value else None,
        )
        self._background.start("analysing the sheet", in_labels(lambda: analysis_result(order), LABELS), self.view.show)
