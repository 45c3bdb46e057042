"""The tab "Laboratory": what the commands `lab`, `measure`, `design`, `analyse` and `audit` do, on the page."""

from __future__ import annotations

from html import escape
from pathlib import Path

import viser

from explorer.session import Session
from explorer.viewer.actions import Post
from explorer.viewer.background_work import BackgroundWork
from explorer.viewer.laboratory.audit_panel import AuditPanel
from explorer.viewer.laboratory.bench_panel import BenchPanel
from explorer.viewer.laboratory.design_panel import DesignPanel
from explorer.viewer.laboratory.photograph_panel import PhotographPanel
from explorer.viewer.laboratory.rig_panel import RigPanel
from explorer.viewer.small_text import small_html


class LaboratoryTab:
    """Made inside its tab; ``uploads`` keeps what browsers send."""

    def __init__(self, server: viser.ViserServer, session: Session, uploads: Path, post: Post) -> None:
        self._background = BackgroundWork(post)
        server.gui.add_markdown("From readings, photographs and tables to parameters; single bodies on the solver.")
        self._state = server.gui.add_html("")
        bench = BenchPanel(server, session, uploads, post, self._background)
        self._rig = RigPanel(server, session, uploads, post, self._background)
        photograph = PhotographPanel(server, session, uploads, post, self._background)
        design = DesignPanel(server, uploads, post, self._background)
        audit = AuditPanel(server, uploads, post, self._background)
        self._views = (bench.view, self._rig.view, photograph.view, design.sheet, design.analysis, audit.view)

    def show(self, notice: str) -> None:
        """What is being done, or the page's last message; call it inside ``server.atomic()``."""
        busy = self._background.busy_with
        state = small_html(escape(f"Busy {busy}." if busy else notice))
        if self._state.content != state:
            self._state.content = state
        self._rig.show()

    def set_dark(self, dark: bool) -> None:
        """Charts for a dark page, or a light one."""
        for view in self._views:
            view.set_dark(dark)
