"""One factor at a time: the middle, and every factor low and high with the others in the middle.

Its main effects have a third of the precision of a Plackett–Burman design of as many runs, or less; it is here to show
what a design takes, not to be recommended (Fisher 1935, The Design of Experiments, ch. 6).
"""

import numpy as np

from doe.designs import Design, DesignOptions, Points


class OneAtATime(Design):
    """2 k + 1 rows."""

    name = "one-at-a-time"
    title = "one-factor-at-a-time"
    doc = "The middle, and each factor low and high alone."
    options = ("centre",)

    def points(self, factors: int, options: DesignOptions) -> Points:
        """Low and high of each factor, then centre runs, one by default."""
        steps = np.repeat(np.eye(factors), 2, axis=0) * np.tile([-1.0, 1.0], factors)[:, None]
        centre = np.zeros((1 if options.centre is None else options.centre, factors))
        return Points(np.vstack([steps, centre]), traits=("each factor alone",))


DESIGN = OneAtATime()
