"""A guided tour of one minute: windows, one after the other, for the person who asked and nobody else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import viser


@dataclass(frozen=True)
class Stop:
    """One window of the tour; ``text`` is Markdown."""

    title: str
    text: str


STOPS = (
    Stop(
        "The pour",
        "Bodies fall through the funnel and pile up, computed while you watch. **Space** pauses and plays, the **right "
        "arrow** goes on by 10 ms and the **left arrow** back, **R** pours anew. Drag to turn the view, scroll to come "
        "closer.\n\n"
        "The big number is the angle of repose of the pile as it lies, ± its spread over the flanks. The lines below "
        "it say what the solver is doing, and how fast compared with real time.",
    ),
    Stop(
        "Turn a parameter",
        "Everything under *acts now* changes the pile that lies there. Take **Pair → all pairs → Static friction** to "
        "zero, and it flows apart. The line *In the solver* tells what is in force, not what the slider shows.",
    ),
    Stop(
        "Change the set-up",
        "What stands under *on restart* (mass, outlet, feed, sizes) waits for **Restart with this set-up**. The same "
        "seed gives the same pour, to the last bit.",
    ),
    Stop(
        "Look closer, and take along",
        "The tab **Look** colours the bodies by speed, force or neighbours (**C**), draws force chains (**K**), cuts "
        "the pile open, and tells about a body that you click. **Take along** has the command that repeats what you "
        "see, tables, pictures, meshes and recordings.",
    ),
    Stop(
        "Calibrate",
        "The tab **Calibrate** runs a whole study in the background: screening, steepest ascent, response surface, "
        "optimum, verification. The pour goes on meanwhile, and a cancelled study resumes where it stopped.",
    ),
    Stop(
        "Diagnose",
        "The tab **Diagnose** takes measured data and asks which physical effect the declared model lacks, or whether "
        "nothing is missing. The answer comes with the error on data that were not fitted, before and after.",
    ),
    Stop(
        "Laboratory",
        "The tab **Laboratory** works on what you have measured: readings of bench tests, photographs of a pile, a "
        "filled sheet of runs, the tables of a publication. Shipped examples stand in each list.",
    ),
)


class Tour:
    """A button that starts the tour."""

    def __init__(self, server: viser.ViserServer) -> None:
        button = server.gui.add_button("Tour: one minute", icon=viser.Icon.MAP_2, hint="What is where, in seven steps.")

        @button.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                open_stop(event.client.gui, 0)


def open_stop(gui: viser.GuiApi, k: int) -> Any:
    """Open window ``k``; its buttons lead to the next one, back, or out."""
    stop = STOPS[k]
    modal = gui.add_modal(f"{stop.title}   ({k + 1} of {len(STOPS)})")
    with modal:
        gui.add_markdown(stop.text)
        for label, target in ways(k):
            _way(gui, modal, label, target)
    return modal


def ways(k: int) -> tuple[tuple[str, int | None], ...]:
    """Buttons of window ``k`` and where they lead; None ends the tour."""
    last = len(STOPS) - 1
    forward: tuple[tuple[str, int | None], ...] = (("Next", k + 1),) if k < last else (("Done", None),)
    back: tuple[tuple[str, int | None], ...] = (("Back", k - 1),) if k > 0 else ()
    leave: tuple[tuple[str, int | None], ...] = (("End the tour", None),) if k < last else ()
    return forward + back + leave


def _way(gui: viser.GuiApi, modal: Any, label: str, target: int | None) -> None:
    @gui.add_button(label).on_click
    def _(event: viser.GuiEvent[Any]) -> None:
        modal.close()
        if target is not None:
            open_stop(gui, target)
