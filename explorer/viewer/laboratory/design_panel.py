"""A user's own design: the sheet of its runs, to be filled in anywhere."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

import viser

from doe.designs import DESIGNS
from doe.table_file import SUFFIXES
from explorer.design.choices import FEWEST, MOST, Alpha, ModelOrder
from explorer.design.run_plan import DesignOrder
from explorer.errors import CommandError
from explorer.laboratory.command_results import CommandResult, SheetOrder, sheet_result
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.laboratory.inputs import UploadSlot, in_labels, number_or_none, parts_of, whole_or_none
from explorer.viewer.output.send_file import send_file
from explorer.viewer.panel import LABORATORY, PageContext, Panel
from explorer.viewer.view import small_html
from solver.assets import asset_path, shipped_assets

SHEET = (
    "Name your factors in a file (Factors file to edit gives one to start from), upload it, or take the shipped one. "
    "An empty box means: as usual. Then: Make the sheet. It is then chosen under Filled sheet → model and optimum: "
    "fill it in there, or in a spreadsheet."
)
NUMBERS = {
    "runs": ("Size", "Rows of the table or of the fraction, or points; empty: as usual for the design."),
    "fraction": ("Fraction P", "2^(k−P) runs for k factors, of minimum aberration; empty: all combinations."),
    "centre": (
        "Centre runs",
        "With every factor in the middle; with blocks, in each of them. Empty: as the file of factors says.",
    ),
    "lattice": ("Degree of the lattice", "M: all blends in steps of 1/M of the whole; empty: the simplex centroid."),
    "blocks": (
        "Blocks",
        "Days, batches or operators, whose differences take nothing from the model's effects; in any design, of whole "
        "replicates. Empty: none.",
    ),
    "replicates": ("Runs of each row", "Empty: as the file of factors says, else 1."),
    "seed": ("Seed", "Of the order of the runs, and of designs that are drawn; empty: as the file says, else 1."),
}
"""Field of a :class:`DesignOrder` that is a whole number → its label and hint."""
LABELS = {f"--{name}": label for name, (label, _) in NUMBERS.items()} | {
    "--generator": "Generators",
    "--nonregular": "Nonregular",
    "--fold": "Fold over",
    "--alpha": "Axial points",
    "--model": "Model",
    "--constraint": "Constraints",
    "--augment": "Finished runs",
    "--standard-order": "Standard order",
    "--sigma": "Standard deviation of a run",
    "--effect": "Change to be seen",
}
"""Option of the command line → label of its field."""
ANY_DESIGN = ("blocks", "replicates", "seed")
"""Those that every design takes."""
NOTHING_KEPT = "none"
COMMA_TABLE, WORKBOOK_FILE = "CSV with 0,5 and semicolons", "workbook (.xlsx)"
FORMATS = ("CSV", COMMA_TABLE, WORKBOOK_FILE)


class DesignPanel(Panel):
    """Factors → sheet; shows only the inputs that the chosen design takes."""

    name, tab, title = "design", LABORATORY, "Your own design → runs"

    def __init__(self, page: PageContext) -> None:
        server, gui, folder, post = page.server, page.server.gui, page.uploads, page.post
        self._background, self._sheet = page.bench_work, page.sheet
        self._kind = gui.add_dropdown(
            "Design", tuple(DESIGNS), initial_value="box-behnken", hint="Which runs are made."
        )
        self._for = gui.add_html("")
        self._factors = UploadSlot(
            server, "Factors", shipped_assets("designs"), (".toml",), folder, post, "Name, low, high, unit of each."
        )
        edit = gui.add_button(
            "Factors file to edit", hint="The chosen file of factors as a text file of this browser, to begin with."
        )
        self._numbers = {name: gui.add_text(label, "", hint=hint) for name, (label, hint) in NUMBERS.items()}
        self._generators = gui.add_text(
            "Generators",
            "",
            hint="A fraction of your own in place of P or size, as E=ABC; several with spaces between.",
        )
        self._nonregular = gui.add_checkbox(
            "Nonregular", False, hint="16 and 32 runs: no main effect is wholly an interaction of two."
        )
        self._fold = gui.add_checkbox(
            "Fold over", False, hint="The mirror image of every row too, which frees main effects of interactions."
        )
        self._alpha = gui.add_dropdown("Axial points", tuple(one.value for one in Alpha), hint="Where they stand.")
        self._model = gui.add_dropdown(
            "Model",
            tuple(one.value for one in ModelOrder),
            initial_value=ModelOrder.QUADRATIC.value,
            hint="Whose terms are told best.",
        )
        self._constraints = gui.add_text(
            "Constraints", "", hint="In the factors' units, as A + B <= 1; several with ; between."
        )
        self._kept = UploadSlot(
            server,
            "Finished runs",
            (NOTHING_KEPT,),
            SUFFIXES,
            folder,
            post,
            "Sheet whose finished runs are kept; Size is then how many are added to them.",
        )
        self._standard_order = gui.add_checkbox("Standard order", False, hint="The runs are not shuffled.")
        self._sigma = gui.add_text(
            "Standard deviation of a run",
            "",
            hint="In the response's unit; empty: unknown. Gives the smallest change that can be detected.",
        )
        self._effect = gui.add_text(
            "Change to be seen",
            "",
            hint="In the response's unit, or in standard deviations of a run. Gives the power to detect it.",
        )
        self._format = gui.add_dropdown(
            "Sheet as", FORMATS, hint="What spreadsheets open; many languages write 0,5 for 0.5."
        )
        self._fields: dict[str, Any] = {name: box for name, box in self._numbers.items() if name not in ANY_DESIGN} | {
            "generators": self._generators,
            "nonregular": self._nonregular,
            "fold": self._fold,
            "alpha": self._alpha,
            "model": self._model,
            "constraints": self._constraints,
            "kept": self._kept,
        }
        self._follow()
        make = gui.add_button(
            "Make the sheet", hint="Lists which effects are aliased, and how small a change the design can detect."
        )
        self.view = AnswerView(server, SHEET, post)
        self._kind.on_update(lambda event: post(self._follow) if event.client_id is not None else None)
        make.on_click(lambda _: post(self._make))

        @edit.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                client = event.client
                post(lambda: send_file(client, *self._factors_file()))

    def _factors_file(self) -> tuple[str, bytes]:
        """Name and content of the chosen file of factors."""
        path = asset_path("designs", self._factors.chosen)
        return path.name, path.read_bytes()

    def _follow(self) -> None:
        """Say what the chosen design is for, and show the inputs that it takes."""
        kind = str(self._kind.value)
        if kind not in DESIGNS:
            raise CommandError(f"design {kind[:60]!r}; allowed: {', '.join(DESIGNS)}")
        self._for.content = small_html(escape(DESIGNS[kind].doc))
        for name, field in self._fields.items():
            field.visible = name in DESIGNS[kind].options

    def _order(self) -> DesignOrder:
        """The order from the form; hidden inputs have their defaults."""
        numbers = {
            name: whole_or_none(str(box.value), NUMBERS[name][0], FEWEST[name], MOST.get(name))
            for name, box in self._numbers.items()
            if box.visible
        }
        kept = self._kept.chosen
        return DesignOrder(
            str(self._kind.value),
            runs=numbers.get("runs"),
            replicates=numbers["replicates"],
            centre=numbers.get("centre"),
            seed=numbers["seed"],
            fold=self._fold.visible and bool(self._fold.value),
            generators=parts_of(str(self._generators.value), " ") if self._generators.visible else (),
            fraction=numbers.get("fraction") or 0,
            alpha=Alpha(self._alpha.value) if self._alpha.visible else Alpha.ROTATABLE,
            standard_order=bool(self._standard_order.value),
            blocks=numbers["blocks"],
            nonregular=self._nonregular.visible and bool(self._nonregular.value),
            model=ModelOrder(self._model.value) if self._model.visible else None,
            constraints=parts_of(str(self._constraints.value), ";") if self._constraints.visible else (),
            lattice=numbers.get("lattice"),
            augment=Path(kept) if self._kept.visible and kept != NOTHING_KEPT else None,
        )

    def _make(self) -> None:
        order = self._order()
        asked = SheetOrder(
            self._factors.chosen,
            number_or_none(str(self._sigma.value), "standard deviation of a run"),
            number_or_none(str(self._effect.value), "change to be seen"),
            workbook=self._format.value == WORKBOOK_FILE,
            decimal_comma=self._format.value == COMMA_TABLE,
        )
        self._background.start("making the sheet", in_labels(lambda: sheet_result(order, asked), LABELS), self._made)

    def _made(self, answer: CommandResult) -> None:
        """Show the answer; from now on, its sheet is the one to fill in and analyse."""
        self.view.show(answer)
        for name, content in answer.files.items():
            if name.endswith(SUFFIXES):
                self._sheet.take(name, content)
