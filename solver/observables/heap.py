"""Whether the material on the plate is a heap, which has an angle of repose, or only a flat layer or a few bodies.

The silhouette of any layer slopes at its rim, so that an angle can be fitted there, but this angle depends on single
grains and on where they happen to lie. A heap

    is at least ``LEAST_HEIGHT`` grain thicknesses high at its apex, the height that the flanks' windows refer to, and
    has the tops of at least ``LEAST_GRAINS`` grains in the window of a flank's line, median over views and flanks.

The thickness is a grain's smallest outer dimension, averaged by mass over the pile (``surface.grain_thickness``):
flat grains lie on their broad side, so that two layers are two thicknesses high. Two grains determine a line, whatever
the rest of the heap looks like; only from the third on is there something to fit. At 2.5 thicknesses the window, from
20 % to 80 % of the height, is 1.5 thicknesses high, which is 3.5 along a slope of 25° and less than 3 from 30° on. For
equal round grains the two limits are therefore close together, and the second one rejects what is steep and narrow.
"""

from __future__ import annotations

import numpy as np

from solver.observables.pile import apex_height
from solver.observables.reading import PileReading
from solver.pours.record import Outcome, Pile, Verdict
from solver.rigs import PourRig

LEAST_HEIGHT = 2.5
"""Height of the lowest heap, in grain thicknesses."""
LEAST_GRAINS = 3
"""Grains in the window of a flank."""


def why_no_heap(pile: Pile) -> str:
    """The reason why ``pile`` is not a heap, with numbers; empty for a heap. Its coordinates must be finite."""
    reading = PileReading(pile)
    if not reading.is_pile:
        return f"{pile.mass.size or 'no'} body lies still on the plate"
    height, thickness = apex_height(reading).value, reading.grain_thickness
    # Both heights may be the same number of pixels: rounding must not decide that one is lower.
    least = LEAST_HEIGHT * thickness
    if height < least * (1.0 - 1e-9):
        limit = f"{LEAST_HEIGHT:g} grain thicknesses, {1e3 * least:.2f} mm"
        return f"a flat layer {1e3 * height:.2f} mm high; a heap has {limit}"
    fitted = reading.flank_grains[np.isfinite(reading.flank_grains)]
    if not fitted.size:
        return "no flank of it can be fitted"
    grains = float(np.median(fitted))
    if grains < LEAST_GRAINS:
        return f"a flank's line is fitted to {grains:g} grains (median), and needs {LEAST_GRAINS}"
    return ""


def told(rig: PourRig, ended: Verdict, pile: Pile) -> Verdict:
    """Outcome and message of a run in ``rig`` that ``ended`` and left ``pile``.

    Both are those of ``ended``, except that a pile at rest that is not a heap, in a rig whose heap is read, is
    ``NO_HEAP``. A pour that is read at a given time (``MEASURED``) is read as it is then, like the pile that it is
    compared with.
    """
    outcome, message = ended
    if outcome != Outcome.AT_REST or not rig.leaves_heap:
        return ended
    why = why_no_heap(pile)
    return (Outcome.NO_HEAP, f"{why}; {message}" if message else why) if why else ended
