"""One chart at a time, chosen from a list, dark or light as the page is.

The chart is made when it is chosen, or when its content has changed. plotly paints it white unless told otherwise.
"""

from __future__ import annotations

import json
from collections.abc import Hashable, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

import viser

from explorer.report.content import Spec
from explorer.report.figures.style import CONFIG
from explorer.report.study_charts import Plots
from explorer.viewer.actions import Post
from explorer.viewer.study.process_view import escaped

NAMES = {True: "plotly_dark", False: "plotly_white"}
TRANSPARENT = "rgba(0, 0, 0, 0)"
NOTHING = "(nothing yet)"


class PlotView:
    """List, chart and caption. ``empty`` says what to do while there is nothing to show.

    The chart is added to the page with the first content, because it loads plotly.js (4 MB) into every browser.
    """

    def __init__(self, server: viser.ViserServer, label: str, empty: str, post: Post, dark: bool = True) -> None:
        self._gui, self._empty, self._dark = server.gui, empty, dark
        self._place = server.gui.add_folder(None)
        with self._place:
            self._choice = server.gui.add_dropdown(
                label, (NOTHING,), hint="One chart at a time. Hover over it for a button that shows it large."
            )
            self._caption = server.gui.add_markdown(empty)
        self._chart: Any = None
        self._plots: Plots = {}
        self._version: Hashable = None
        self._shown: tuple[Hashable, str, bool] | None = None

        @self._choice.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                post(self._draw)

    @property
    def dark(self) -> bool:
        """Whether charts are for a dark page."""
        return self._dark

    @dark.setter
    def dark(self, dark: bool) -> None:
        self._dark = dark
        self._draw()

    def offer(self, plots: Plots, version: Hashable) -> None:
        """Offer the present charts; ``version`` changes when their content does. Call it inside ``server.atomic()``."""
        if version == self._version:
            return
        self._version, self._plots = version, plots
        titles = tuple(plots) or (NOTHING,)
        if tuple(self._choice.options) != titles:
            # viser takes the first option if the present one is not among the new ones.
            self._choice.options = titles
        self._draw()

    def show_anew(self, titles: Sequence[str]) -> None:
        """Draw changed charts again: the chosen chart if it is one of ``titles``, else the first."""
        if self._choice.value not in titles:
            self._choice.value = titles[0]  # type: ignore[misc]
        self._shown = None
        self._draw()

    def _draw(self) -> None:
        title = str(self._choice.value)  # what a browser sent may be anything
        plot = self._plots.get(title)
        now = (self._version, title, self._dark)
        if now == self._shown:
            return
        self._shown = now
        try:
            spec = None if plot is None else plot.make()
        except (KeyError, IndexError, TypeError, ValueError) as error:
            # A folder that somebody named may hold any JSON, also that of another version.
            self._clear(f"This chart cannot be drawn: {escaped(f'{type(error).__name__}: {error}')}")
            return
        if plot is None or spec is None:
            self._clear(self._empty)
            return
        drawn, aspect = Drawn(spec, self._dark, title), plot.aspect
        if self._chart is None:
            with self._place:
                self._chart = self._gui.add_plotly(drawn, aspect=aspect)
        else:
            self._chart.aspect = aspect
            self._chart.figure = drawn
            self._chart.visible = True
        self._caption.content = escaped(plot.caption)

    def _clear(self, words: str) -> None:
        if self._chart is not None:
            self._chart.visible = False
        self._caption.content = words


class Drawn:
    """A chart as viser takes it: something that gives its JSON. plotly's own figure would check every number again."""

    def __init__(self, spec: Spec, dark: bool, name: str) -> None:
        layout = {key: value for key, value in spec["layout"].items() if key != "height"}
        layout |= {"template": template(dark), "paper_bgcolor": TRANSPARENT, "plot_bgcolor": TRANSPARENT}
        for key, entry in layout.items():
            # The page keeps zoom and angle of view from figure to figure; they are this chart's own.
            if key.startswith(("xaxis", "yaxis", "scene")):
                layout[key] = {**entry, "uirevision": name}
        self._content = {"data": spec["data"], "layout": layout, "config": CONFIG}

    def to_json(self) -> str:
        """The chart as plotly.js reads it."""
        return json.dumps(self._content, allow_nan=False, separators=(",", ":"))


@cache
def template(dark: bool) -> dict[str, Any]:
    """plotly's own template; every chart carries it along (3 kB), since plotly.js knows none by name.

    Read from plotly's data: by its Python interface it takes half a second, for which the pile would stand still.
    """
    file = files("plotly").joinpath("package_data", "templates", f"{NAMES[dark]}.json")
    # Defaults of trace types that no chart here has are left out.
    return {"layout": json.loads(file.read_text(encoding="utf-8"))["layout"]}
