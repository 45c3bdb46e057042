"""A panel of the page: a place for a line of text, which says when it was written."""

from explorer.viewer.panel import Now, PageContext, Panel, Tab

NOTES = Tab("Notes")


class Notes(Panel):
    """A line of text, and the time of the pour at which it came."""

    name = "notes"
    tab = NOTES

    def __init__(self, page: PageContext) -> None:
        self._text = page.server.gui.add_text("Note", "", hint="Kept while the page is open.")
        self._time = page.server.gui.add_text("Written at", "", disabled=True)
        self._seen = ""

    def show(self, now: Now) -> None:
        """Tell when the text was changed last."""
        if self._text.value != self._seen:
            self._seen = self._text.value
            self._time.value = f"{now.status.time:.3f} s"
