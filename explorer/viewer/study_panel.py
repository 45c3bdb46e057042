"""The design of experiments on the page: start, progress, partial results, cancel, resume."""

from __future__ import annotations

import re

import viser

from explorer.study_process import PROFILES, StudyProcess, StudyStatus
from explorer.viewer.actions import Post

MARKDOWN_MARKS = re.compile(r"([\\`*_{}\[\]<>()#+!|~&])")

STATE_WORDS = {
    "idle": "No study runs.",
    "running": "Running at low priority; the pour goes on.",
    "cancelled": "Cancelled.",
    "finished": "Finished.",
    "failed": "Failed.",
}


class StudyPanel:
    """Talks to a :class:`StudyProcess`; knows nothing of statistics."""

    def __init__(self, server: viser.ViserServer, study: StudyProcess, name: str, post: Post) -> None:
        gui = server.gui
        self._study = study
        gui.add_markdown(f"**{escaped(name)}** — screening, steepest ascent, response surface, optimum, verification.")
        self._profile = gui.add_dropdown(
            "Profile",
            PROFILES,
            hint="quick: coarse shapes, less mass, one run per row; standard: 30 g, 3 seeds",
        )
        self._buttons = gui.add_button_group("Study", ("Start", "Cancel", "Resume"))
        acts = {"Start": self._start, "Cancel": study.cancel, "Resume": study.resume}

        @self._buttons.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client_id is not None and event.target.value in acts:
                post(acts[event.target.value])

        self._bar = gui.add_progress_bar(0.0)
        self._text = gui.add_markdown("")

    def _start(self) -> None:
        self._study.start(str(self._profile.value))

    def show(self, notice: str) -> None:
        """Ask the study how far it is; ``notice`` is the page's own last message, such as a refused click.

        Call it inside ``server.atomic()``, about twice a second.
        """
        status = self._study.status()
        percent = 100.0 * progress(status)
        if self._bar.value != percent:
            self._bar.value = percent  # type: ignore[misc]
        if self._bar.animated != (status.state == "running"):
            self._bar.animated = status.state == "running"
        text = study_markdown(status, notice)
        if self._text.content != text:
            self._text.content = text


def progress(status: StudyStatus) -> float:
    """Share of the planned runs that are done, 0 … 1."""
    return min(1.0, max(0.0, status.done / status.planned)) if status.planned > 0 else 0.0


def study_markdown(status: StudyStatus, notice: str = "") -> str:
    """State, stage and partial results as markdown; texts of the study are escaped."""
    parts = [STATE_WORDS[status.state]]
    parts += [escaped(text) for text in dict.fromkeys((notice, status.message)) if text]
    if status.stage:
        parts.append(
            "| Stage | Runs | Time left |\n|:--|--:|--:|\n"
            f"| {escaped(status.stage)} | {status.done} of {status.planned} | {time_left(status.eta_s)} |"
        )
    if status.lines:
        rows = "\n".join(f"| {k} | {escaped(line)} |" for k, line in enumerate(status.lines, start=1))
        parts.append(f"| | Partial results |\n|--:|:--|\n{rows}")
    return "\n\n".join(parts)


def time_left(eta_s: float | None) -> str:
    """Seconds as "2 min 05 s"; a dash where nobody knows."""
    if eta_s is None or not 0.0 <= eta_s < 1e6:
        return "–"
    minutes, seconds = divmod(round(eta_s), 60)
    return f"{minutes} min {seconds:02d} s" if minutes else f"{seconds} s"


def escaped(text: str) -> str:
    """``text`` as one line that markdown shows as it is."""
    return MARKDOWN_MARKS.sub(r"\\\1", " ".join(text.split()))
