"""The diagnosis on the page: choose measured data, start, watch, cancel, resume, and read the answer."""

from __future__ import annotations

from collections.abc import Sequence

import viser

from explorer.diagnosis_process import DiagnosisProcess
from explorer.report.diagnosis.findings import summary_label, summary_value
from explorer.report.diagnosis.in_short import verdict_sentence
from explorer.report.findings import Plain
from explorer.viewer.actions import Post
from explorer.viewer.process_view import ProcessView, escaped, status_markdown

FIRST = "trefoil_1"
"""Chosen at first, where it is shipped: the data set of `make diagnose`."""
OWN = "folder below"
"""Choice of the list that takes the folder in the text field."""


class DiagnosisPanel:
    """Talks to a :class:`DiagnosisProcess`; ``shipped`` are the names of the data sets to choose from."""

    def __init__(
        self, server: viser.ViserServer, diagnosis: DiagnosisProcess, shipped: Sequence[str], post: Post
    ) -> None:
        gui = server.gui
        self._diagnosis = diagnosis
        gui.add_markdown("Which physical effect do measured data ask for that the declared model lacks?")
        self._data = gui.add_dropdown(
            "Measured data",
            (*shipped, OWN),
            initial_value=FIRST if FIRST in shipped else OWN,
            hint="Data sets that come with the program, or a folder of your own.",
        )
        self._folder = gui.add_text(
            "Folder", "", hint="Folder with measurement.toml, on the machine that serves this page."
        )
        acts = {"Start": self._start, "Cancel": diagnosis.cancel, "Resume": self._resume}
        self._view = ProcessView(server, "Diagnosis", acts, post)

    def _start(self) -> None:
        self._diagnosis.start(self._chosen())

    def _resume(self) -> None:
        self._diagnosis.resume(self._chosen())

    def _chosen(self) -> str:
        return str(self._folder.value if self._data.value == OWN else self._data.value)

    def show(self, notice: str) -> None:
        """Ask the diagnosis how far it is; ``notice`` is the page's own last message, such as a refused click.

        Call it inside ``server.atomic()``, about twice a second.
        """
        status = self._diagnosis.status()
        text = status_markdown(status, "diagnosis", "Pours", notice)
        result = self._diagnosis.result()
        self._view.show(status, text if result is None else f"{answer_markdown(result)}\n\n{text}")


def answer_markdown(result: Plain) -> str:
    """The verdict in a sentence and the errors before, after, and by noise alone."""
    role, words = ("holdout", "held-out") if result["error"]["holdout"] else ("fit", "fitted")
    rows = "\n".join(
        f"| {escaped(summary_label(row['observable']))} | "
        + " | ".join(
            escaped(summary_value(result, row["observable"], row[key])) for key in ("before", "after", "noise_floor")
        )
        + " |"
        for row in result["error"][role]
    )
    head = f"| Error on {words} data | Before | After | Noise floor |\n|:--|--:|--:|--:|"
    return f"**{escaped(result['verdict'])}** — {escaped(verdict_sentence(result).replace('`', ''))}\n\n{head}\n{rows}"
