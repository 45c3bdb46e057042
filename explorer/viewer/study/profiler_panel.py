"""The profiler: a slider per factor of the response surface; the traces of the others follow at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import viser

from explorer.report.content import Spec
from explorer.report.figures.model import chosen_point, section_point
from explorer.report.figures.profiler import prediction, profiler
from explorer.report.findings import Plain
from explorer.report.plot import Plot, Plots
from explorer.report.units_for_people import (
    axis_title,
    fixed,
    observable_label,
    parameter_value,
    unit_of_observable,
    unit_of_parameter,
)
from explorer.screen_units import checked
from explorer.viewer.actions import Post
from explorer.viewer.study.process_view import escaped

TITLE = "Profiler"
STEPS = 200
"""Steps of a slider over the region."""
EMPTY = "The profiler comes with the response surface."


class ProfilerPanel:
    """Sliders, the prediction in words, and a button that hands the values on.

    Args:
        server: the page.
        post: how a callback leaves its action.
        moved: called with the titles of the charts after a slider was moved; one of them is to be drawn anew.
        apply: takes path → value [SI], for the live pour.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        post: Post,
        moved: Callable[[Sequence[str]], None],
        apply: Callable[[Mapping[str, float | str]], None],
    ) -> None:
        self._gui, self._post, self._moved, self._apply = server.gui, post, moved, apply
        self._result: Plain | None = None
        self._sliders: list[Any] = []
        self._region: object = None
        self._place = server.gui.add_folder(None)
        self._words = server.gui.add_markdown(EMPTY)
        optimum = server.gui.add_button("To the optimum", hint="The middle of the region before there is one.")
        pour = server.gui.add_button(
            "Set the live pour to these values",
            hint="Values that act on a running pour are set at once; others begin it anew.",
        )
        optimum.on_click(lambda _: post(self._to_optimum))
        pour.on_click(lambda _: post(self._hand_on))

    def show(self, result: Plain | None) -> None:
        """Follow the result that the page shows; it may have got no surface yet."""
        self._result = result if result is not None and result.get("surface") else None
        region = None if self._result is None else (self._result["surface"]["region"], self._paths())
        if region != self._region:
            self._region = region
            self._build()
        self._tell()

    def plots(self) -> Plots:
        """The chart of every target at the present values; none before there is a surface."""
        caption = "Each row: the model along one factor, the others where the sliders are; band 95 %; dashed: target."
        return {title: Plot(partial(self._draw, k), caption, 1.35) for k, title in enumerate(self._titles())}

    def values(self) -> list[float]:
        """Values of the factors [SI] where the sliders are, within the region; raises InputError."""
        assert self._result is not None
        surface = self._result["surface"]
        found = []
        for k, (factor, slider) in enumerate(zip(surface["factors"], self._sliders, strict=True)):
            size = unit_of_parameter(factor["path"]).size
            low, high = self._ends(k)
            found.append(min(max(checked(slider.value, low / size, high / size, factor["name"]) * size, low), high))
        return found

    def _titles(self) -> list[str]:
        targets = [] if self._result is None else self._result["study"]["targets"]
        if len(targets) == 1:
            return [TITLE]
        return [f"{TITLE}: {observable_label(target['observable'])}" for target in targets]

    def _draw(self, index: int) -> Spec | None:
        return None if self._result is None else profiler(self._result, index, self.values())

    def _paths(self) -> list[str]:
        assert self._result is not None
        return [factor["path"] for factor in self._result["surface"]["factors"]]

    def _ends(self, k: int) -> tuple[float, float]:
        assert self._result is not None
        region = self._result["surface"]["region"]
        return region["centre"][k] - region["half_width"][k], region["centre"][k] + region["half_width"][k]

    def _build(self) -> None:
        for slider in self._sliders:
            slider.remove()
        self._sliders = []
        if self._result is None:
            return
        start = section_point(self._result)
        with self._place:
            for k, factor in enumerate(self._result["surface"]["factors"]):
                size = unit_of_parameter(factor["path"]).size
                low, high = (float(f"{end / size:.6g}") for end in self._ends(k))
                slider = self._gui.add_slider(
                    axis_title(factor["path"], factor["name"]),
                    low,
                    high,
                    (high - low) / STEPS,
                    min(max(float(f"{start[k] / size:.6g}"), low), high),
                    hint="Within the region of the surface; beyond it the model says nothing.",
                )
                slider.on_update(lambda event: self._post(self._follow) if event.client_id is not None else None)
                self._sliders.append(slider)

    def _follow(self) -> None:
        if self._result is not None:
            self._tell()
            self._moved(self._titles())

    def _to_optimum(self) -> None:
        if self._result is None:
            return
        for slider, factor, value in zip(
            self._sliders, self._result["surface"]["factors"], section_point(self._result), strict=True
        ):
            slider.value = float(f"{value / unit_of_parameter(factor['path']).size:.6g}")
        self._follow()

    def _hand_on(self) -> None:
        if self._result is not None:
            self._apply(dict(zip(self._paths(), self.values(), strict=True)))

    def _tell(self) -> None:
        text = EMPTY if self._result is None else prediction_markdown(self._result, self.values())
        if self._words.content != text:
            self._words.content = text


def prediction_markdown(result: Plain, natural: list[float]) -> str:
    """Setting, prediction of every target with its interval, and what it is worth."""
    surface = result["surface"]
    at = ", ".join(
        f"{escaped(factor['name'])} = {parameter_value(factor['path'], value)}"
        for factor, value in zip(surface["factors"], natural, strict=True)
    )
    lines = [f"At {at}:"]
    for index, target in enumerate(result["study"]["targets"]):
        unit = unit_of_observable(target["observable"])
        mean, half = prediction(result, index, natural)
        text = f"{escaped(observable_label(target['observable']))} **{unit.attach(fixed(mean))} ± {fixed(half)}**"
        text += f" (95 % interval of the mean); target {unit.attach(fixed(unit.of(target['mean'])))}."
        if not surface["anova"][index]["better_than_noise"]:
            text += " The surface is not better than noise: do not take this for a calibration."
        lines.append(text)
    if chosen_point(result) is None:
        lines.append("From the runs so far; the study goes on.")
    return "\n\n".join(lines)
