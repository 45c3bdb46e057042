"""The profiler: a slider per factor of the response surface; the traces of the other factors follow at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import viser

from doe.studies.study_result import AnyStudy
from explorer.report.content import Spec
from explorer.report.figures.model import FittedTarget, fitted_targets, prediction, profiler
from explorer.report.study_charts import Plot, Plots
from explorer.units import (
    axis_title,
    checked,
    fixed,
    observable_label,
    observed,
    parameter_value,
    unit_of_observable,
    unit_of_parameter,
)
from explorer.viewer.actions import Post
from explorer.viewer.study.process_view import escaped

TITLE = "Profiler"
STEPS = 200
"""Number of steps of a slider across the region."""
EMPTY = "The profiler comes with the response surface."


class ProfilerPanel:
    """Sliders, the prediction in words, and a button that passes the values on.

    Args:
        server: the page.
        post: takes the action of a callback.
        moved: called with the titles of the charts after a slider was moved; one of the charts has to be redrawn.
        apply: called with path → value [SI], for the live pour.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        post: Post,
        moved: Callable[[Sequence[str]], None],
        apply: Callable[[Mapping[str, float | str]], None],
    ) -> None:
        self._gui, self._post, self._moved, self._apply = server.gui, post, moved, apply
        self._targets: tuple[FittedTarget, ...] = ()
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

    def show(self, result: AnyStudy | None) -> None:
        """Follow the result that the page shows; it may not have a surface yet."""
        self._targets = () if result is None else fitted_targets(result)
        region = [(self._paths(), one.low.tolist(), one.high.tolist()) for one in self._targets[:1]]
        if region != self._region:
            self._region = region
            self._build()
        self._tell()

    def plots(self) -> Plots:
        """The chart of every target at the present values; none until there is a surface."""
        caption = "Each row: the model along one factor, the others where the sliders are; band 95 %; dashed: target."
        return {title: Plot(partial(self._draw, k), caption, 1.35) for k, title in enumerate(self._titles())}

    def values(self) -> list[float]:
        """Values of the factors [SI] where the sliders are, within the region; raises InputError."""
        first, found = self._targets[0], []
        for factor, slider, low, high in zip(first.factors, self._sliders, first.low, first.high, strict=True):
            size = unit_of_parameter(factor.path).size
            value = checked(slider.value, low / size, high / size, factor.name) * size
            found.append(min(max(value, float(low)), float(high)))
        return found

    def _titles(self) -> list[str]:
        if len(self._targets) == 1:
            return [TITLE]
        return [f"{TITLE}: {observable_label(target.observable)}" for target in self._targets]

    def _draw(self, index: int) -> Spec | None:
        return profiler(self._targets[index], self.values()) if self._targets else None

    def _paths(self) -> list[str]:
        return [factor.path for factor in self._targets[0].factors]

    def _build(self) -> None:
        for slider in self._sliders:
            slider.remove()
        self._sliders = []
        if not self._targets:
            return
        first = self._targets[0]
        ends = zip(first.factors, first.section_point, first.low, first.high, strict=True)
        with self._place:
            for factor, start, *region in ends:
                size = unit_of_parameter(factor.path).size
                low, high = (float(f"{end / size:.6g}") for end in region)
                slider = self._gui.add_slider(
                    axis_title(factor.path, factor.name),
                    low,
                    high,
                    (high - low) / STEPS,
                    min(max(float(f"{start / size:.6g}"), low), high),
                    hint="Within the region of the surface; beyond it the model says nothing.",
                )
                slider.on_update(lambda event: self._post(self._follow) if event.client_id is not None else None)
                self._sliders.append(slider)

    def _follow(self) -> None:
        if self._targets:
            self._tell()
            self._moved(self._titles())

    def _to_optimum(self) -> None:
        if not self._targets:
            return
        first = self._targets[0]
        for slider, factor, value in zip(self._sliders, first.factors, first.section_point, strict=True):
            slider.value = float(f"{value / unit_of_parameter(factor.path).size:.6g}")
        self._follow()

    def _hand_on(self) -> None:
        if self._targets:
            self._apply(dict(zip(self._paths(), self.values(), strict=True)))

    def _tell(self) -> None:
        text = prediction_markdown(self._targets, self.values()) if self._targets else EMPTY
        if self._words.content != text:
            self._words.content = text


def prediction_markdown(targets: Sequence[FittedTarget], natural: list[float]) -> str:
    """Setting, prediction of every target with its interval, and how far it can be trusted."""
    at = ", ".join(
        f"{escaped(factor.name)} = {parameter_value(factor.path, value)}"
        for factor, value in zip(targets[0].factors, natural, strict=True)
    )
    lines = [f"At {at}:"]
    for target in targets:
        mean, half = prediction(target, natural)
        unit = unit_of_observable(target.observable)
        text = f"{escaped(observable_label(target.observable))} **{unit.attach(fixed(mean))}**"
        text += f", mean 95 % {fixed(mean - half)} … {unit.attach(fixed(mean + half))}"
        text += f"; target {observed(target.observable, target.target)}."
        if not target.anova.better_than_noise:
            text += " The surface is not better than noise: do not take this for a calibration."
        lines.append(text)
    if targets[0].optimum is None:
        lines.append("From the runs so far; the study goes on.")
    return "\n\n".join(lines)
