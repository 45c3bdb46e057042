"""A user's measured data: photographs, angles, balance curves and scans of a set-up, made into data for Diagnose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from html import escape
from pathlib import Path

import viser

from doe.measurement.scans import ARRAYS, POINTS, SURFACES
from doe.table_file import SUFFIXES
from explorer.errors import CommandError
from explorer.files.measured_curves import PICTURES
from explorer.files.uploads import kept_file
from explorer.laboratory.command_results import CommandResult, measured_data_result
from explorer.measured.folder import NewCondition, has_data
from explorer.measured.readings import Brought, ScanUnit
from explorer.scene.starter_files import check_name
from explorer.viewer.actions import Post, on_upload
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.laboratory.inputs import in_labels, number_or_none, positive
from explorer.viewer.panel import LABORATORY, PageContext, Panel
from explorer.viewer.view import small_html
from solver.assets import shipped_measurements

WAITING = (
    "Photographs (of piles, or of the face of a turning drum), angles, balance curves or scans from several pours of "
    "one set-up. Add the files of every kind in the same order of pours. Save them, and the data set is in "
    "the list of Diagnose; then change the set-up's name to add another."
)
UNITS: tuple[ScanUnit, ...] = ("m", "cm", "mm", "um")
NOTHING = "No files yet."


@dataclass(frozen=True)
class Kind:
    """A kind of file: its name, the text of its button, and the allowed suffixes."""

    name: str
    label: str
    suffixes: tuple[str, ...]


PHOTOGRAPHS = Kind("photographs", "Add a photograph", PICTURES)
BALANCES = Kind("balance", "Add a balance's curve", SUFFIXES)
SCANS = Kind("scans", "Add a scan", (*SURFACES, *POINTS, *ARRAYS))
KINDS = (PHOTOGRAPHS, BALANCES, SCANS)
LABELS = {
    "--condition": "Set-up's name",
    "--angles": "Angles",
    "--photo": PHOTOGRAPHS.label,
    "--balance": BALANCES.label,
    "--scan": SCANS.label,
    "--scale": "Scale",
    "--scan-unit": "Unit of scans",
    "--starts": "Flow began at",
    "--lag": "Lag of the balance",
    "--set": "Set-up",
    "--uncertainty": "Uncertainty",
}
"""Option of the command line → label of its field."""


class MeasuredDataPanel(Panel):
    """Names, files, set-up; what was read from them and what it can tell."""

    name, tab, title = "measured_data", LABORATORY, "Measured data → Diagnose"

    def __init__(self, page: PageContext) -> None:
        gui, post = page.server.gui, page.post
        self._background, self._uploads, self._study = page.bench_work, page.uploads, page.project.study
        self._files: dict[Kind, list[Path]] = {kind: [] for kind in KINDS}
        self._set = gui.add_text(
            "Data set", "my_data", hint="A new one, or one that was begun here: letters, digits, - _."
        )
        self._condition = gui.add_text(
            "Set-up's name", "A", hint="Another name adds another condition to the data set."
        )
        self._angles = gui.add_text("Angles [°]", "", hint="One for each pour, between commas.")
        self.uploads = {kind: self._offer(gui, kind, post) for kind in KINDS}
        self._kept = gui.add_html(small_html(NOTHING))
        none = gui.add_button("Take the files off", hint="None of those that were added is used.")
        self._scale = gui.add_number(
            "Scale [mm per pixel]",
            0.0,
            min=0.0,
            max=10.0,
            step=0.001,
            hint="Of piles; 0: angles alone.",
        )
        self._unit = gui.add_dropdown(
            "Unit of scans", UNITS, initial_value="mm", hint="Of .ply, .stl, .xyz, .txt, .csv."
        )
        self._starts = gui.add_text(
            "Flow began at [s]", "", hint="On the balance's clock, one or one for each curve, between commas."
        )
        self._lag = gui.add_text(
            "Lag of the balance [s]",
            "",
            hint="Subtracted from the balance's times. If empty, a lag seen in the data is only reported.",
        )
        self._changes = gui.add_text(
            "Set-up", "", hint="What was otherwise than in the study: rig.outlet_height=90mm insertion.rate=0.2"
        )
        self._spread = gui.add_text(
            "Uncertainty", "", hint="Of one value, where one pour has no scatter: angle_of_repose_deg=1.5"
        )
        save = gui.add_button(
            "Save the data", hint="Reads the data, reports what they can show, and keeps them for Diagnose."
        )
        self.view = AnswerView(page.server, WAITING, post)
        none.on_click(lambda _: post(self._forget))
        save.on_click(lambda _: post(self._save))

    def _offer(self, gui: viser.GuiApi, kind: Kind, post: Post) -> viser.GuiUploadButtonHandle:
        button = gui.add_upload_button(
            kind.label, mime_type=",".join(kind.suffixes), hint=f"A file ending in {', '.join(kind.suffixes)}."
        )
        on_upload(button, lambda name, content: self._take(kind, name, content), post)
        return button

    def _take(self, kind: Kind, name: str, content: bytes) -> None:
        self._files[kind].append(kept_file(name, content, self._uploads, kind.suffixes))
        self._tell()

    def _forget(self) -> None:
        for files in self._files.values():
            files.clear()
        self._tell()

    def _tell(self) -> None:
        lines = [
            f"{kind.name}: {', '.join(file.name for file in files)}" for kind, files in self._files.items() if files
        ]
        self._kept.content = small_html("<br>".join(map(escape, lines)) or NOTHING)

    def _save(self) -> None:
        name = check_name(str(self._set.value).strip())
        if name in shipped_measurements():
            raise CommandError(f"Data set: {name} is shipped with the program; choose another name")
        folder = self._uploads / name
        changes = tuple(str(self._changes.value).split())
        if any(change.startswith("rig.mesh") for change in changes):
            # A browser may not name a file of this machine.
            raise CommandError("Set-up: rig.mesh: allowed here: the study's own; use the command line for another")
        asked = NewCondition(
            name=str(self._condition.value).strip(),
            study=None if has_data(folder) else str(self._study),
            settings=changes,
            uncertainty=tuple(str(self._spread.value).split()),
        )
        brought = self._brought()
        read = in_labels(lambda: measured_data_result(folder, asked, brought), LABELS)
        self._background.start("reading the data", read, partial(self._done, brought))

    def _brought(self) -> Brought:
        starts = [number_or_none(part, "Flow began at") for part in str(self._starts.value).split(",")]
        angles = str(self._angles.value).replace(" ", "")
        if not angles and not any(self._files.values()):
            raise CommandError(f"nothing was measured: give Angles, or {', '.join(kind.label for kind in KINDS)}")
        scale = positive(self._scale.value) if self._files[PHOTOGRAPHS] else None
        if ".csv" in angles or ".xlsx" in angles:
            raise CommandError("Angles: allowed: numbers separated by commas; use the command line for a file")
        return Brought(
            photographs=tuple(self._files[PHOTOGRAPHS]),
            pixel=None if scale is None else 1e-3 * scale,
            angles=angles or None,
            balances=tuple(self._files[BALANCES]),
            starts=tuple(start for start in starts if start is not None),
            lag=number_or_none(str(self._lag.value), "Lag of the balance"),
            scans=tuple(self._files[SCANS]),
            scan_unit=next(unit for unit in UNITS if unit == self._unit.value),
        )

    def _done(self, brought: Brought, answer: CommandResult) -> None:
        """What was brought is in the data set now; other files, also those added meanwhile, are of the next one."""
        read = {*brought.photographs, *brought.balances, *brought.scans}
        self._files = {kind: [file for file in files if file not in read] for kind, files in self._files.items()}
        self._tell()
        self.view.show(answer)
