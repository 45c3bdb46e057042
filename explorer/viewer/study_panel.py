"""The design of experiments on the page: start, progress, partial results, cancel, resume."""

from __future__ import annotations

import viser

from explorer.study_process import PROFILES, StudyProcess
from explorer.viewer.actions import Post
from explorer.viewer.process_view import ProcessView, escaped, status_markdown


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
        acts = {"Start": self._start, "Cancel": study.cancel, "Resume": study.resume}
        self._view = ProcessView(server, "Study", acts, post)

    def _start(self) -> None:
        self._study.start(str(self._profile.value))

    def show(self, notice: str) -> None:
        """Ask the study how far it is; ``notice`` is the page's own last message, such as a refused click.

        Call it inside ``server.atomic()``, about twice a second.
        """
        status = self._study.status()
        self._view.show(status, status_markdown(status, "study", "Runs", notice))
