"""A pour that a link holds: offered by the browser that was opened with it, and poured if the user agrees."""

from __future__ import annotations

from functools import partial

from explorer.scene.link import LinkedPour, read_pour
from explorer.viewer.panel import AROUND, PageContext, Panel


class PourLink(Panel):
    """Takes the text of a link from a browser. Opening a link sends nothing; a click on *Pour it* does."""

    name, tab = "pour_link", AROUND

    def __init__(self, page: PageContext) -> None:
        self._page = page
        page.channel.offer("pour_link", lambda command: page.post(partial(self._take, command.get("text"))))

    def _take(self, text: object) -> None:
        begun = self._page.project.source
        self._page.background.start_when_free("reading the link", lambda: read_pour(str(text), begun), self._pour)

    def _pour(self, linked: LinkedPour) -> None:
        session = self._page.session
        self._page.beside.close()
        session.start(linked.scene, linked.seed, linked.source)
        if linked.moment > 0.0:
            session.run_to(linked.moment)
