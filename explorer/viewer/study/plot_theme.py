"""Dark and light for the charts of the page, which plotly paints white unless told otherwise."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import Any

from explorer.report.content import Spec
from explorer.report.figures.style import CONFIG

NAMES = {True: "plotly_dark", False: "plotly_white"}
NOTHING = "rgba(0, 0, 0, 0)"


class Drawn:
    """A chart as viser takes it: something that gives its JSON. plotly's own figure would check every number again."""

    def __init__(self, spec: Spec, dark: bool, name: str) -> None:
        layout = {key: value for key, value in spec["layout"].items() if key != "height"}
        layout |= {"template": template(dark), "paper_bgcolor": NOTHING, "plot_bgcolor": NOTHING}
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
