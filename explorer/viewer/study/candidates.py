"""Which effects a diagnosis asks about, and how many pours it may take for them."""

from __future__ import annotations

import viser

from doe.diagnose.budget import Budget
from explorer.screen_units import checked
from solver import EFFECTS

MOST = 100_000
BY_ITSELF = (
    f"As many pours as the program takes by itself: {Budget().base} of the declared model, {Budget().screening} of "
    f"every direction of an effect, then {Budget().more} at a time of what stays in question."
)


class Candidates:
    """A check box per effect, all set at first, and the number of pours; both are read when a diagnosis starts."""

    def __init__(self, server: viser.ViserServer) -> None:
        gui = server.gui
        gui.add_markdown(
            "An effect that is not asked about can never be the answer, and another one may take its place: leave out "
            "only what your set-up cannot have."
        )
        self._boxes = {
            name: gui.add_checkbox(name.replace("_", " "), True, hint=f"What reveals it: {kind.lever}.")
            for name, kind in EFFECTS.items()
        }
        self._pours = gui.add_number("Pours (0: by itself)", 0, min=0, max=MOST, step=10, hint=BY_ITSELF)

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects that are asked about, () for all. Raises ValueError where none is left."""
        chosen = tuple(name for name, box in self._boxes.items() if box.value)
        if not chosen:
            raise ValueError("effects: none is chosen; without a candidate there is nothing to ask")
        return () if len(chosen) == len(self._boxes) else chosen

    @property
    def budget(self) -> int | None:
        """About so many pours before the first closer look; None: as many as the program takes by itself."""
        pours = checked(self._pours.value, 0, MOST, "pours")
        return round(pours) or None
