"""A guided tour of one minute: windows, one after the other, for the person who asked and nobody else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import viser


@dataclass(frozen=True)
class Stop:
    """One window of the tour; ``text`` is Markdown."""

    title: str
    text: str


COUNTED = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


class Tour:
    """A button that starts the tour through ``stops``."""

    def __init__(self, server: viser.ViserServer, stops: Sequence[Stop]) -> None:
        steps = COUNTED[len(stops)] if len(stops) < len(COUNTED) else len(stops)
        button = server.gui.add_button(
            "Tour: one minute", icon=viser.Icon.MAP_2, hint=f"What is where, in {steps} steps."
        )

        @button.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                open_stop(event.client.gui, stops, 0)


def open_stop(gui: viser.GuiApi, stops: Sequence[Stop], k: int) -> Any:
    """Open window ``k``; its buttons lead to the next one, back, or out."""
    stop = stops[k]
    modal = gui.add_modal(f"{stop.title}   ({k + 1} of {len(stops)})")
    with modal:
        gui.add_markdown(stop.text)
        for label, target in ways(k, len(stops) - 1):
            _way(gui, modal, label, stops, target)
    return modal


def ways(k: int, last: int) -> tuple[tuple[str, int | None], ...]:
    """Buttons of window ``k``, 0 … ``last``, and where they lead; None ends the tour."""
    forward: tuple[tuple[str, int | None], ...] = (("Next", k + 1),) if k < last else (("Done", None),)
    back: tuple[tuple[str, int | None], ...] = (("Back", k - 1),) if k > 0 else ()
    leave: tuple[tuple[str, int | None], ...] = (("End the tour", None),) if k < last else ()
    return forward + back + leave


def _way(gui: viser.GuiApi, modal: Any, label: str, stops: Sequence[Stop], target: int | None) -> None:
    @gui.add_button(label).on_click
    def _(event: viser.GuiEvent[Any]) -> None:
        modal.close()
        if target is not None:
            open_stop(gui, stops, target)
