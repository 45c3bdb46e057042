"""Published examples that several tests compute again."""

import numpy as np

from doe.analysis.steepest_ascent import Region
from doe.designs import factorial


def region(names, centre=None, half_width=None):
    k = len(names)
    return Region(
        tuple(names), np.zeros(k) if centre is None else centre, np.ones(k) if half_width is None else half_width, ()
    )


# Montgomery 2017, Design and Analysis of Experiments, example 6.2: filtration rate, 2^4 in standard order.
FILTRATION = factorial(4).astype(float)
FILTRATION_RATE = np.array([45, 71, 48, 65, 68, 60, 80, 65, 43, 100, 45, 104, 75, 86, 70, 96], dtype=float)
FILTRATION_EFFECTS = {
    "A": 21.625, "B": 3.125, "C": 9.875, "D": 14.625, "A*B": 0.125, "A*C": -18.125, "A*D": 16.625, "B*C": 2.375,
    "B*D": -0.375, "C*D": -1.125, "A*B*C": 1.875, "A*B*D": 4.125, "A*C*D": -1.625, "B*C*D": -2.625, "A*B*C*D": 1.375,
}  # fmt: skip

# Montgomery 2017, section 11.2 (table 11.6): chemical process, coded time and temperature, yield in per cent.
YIELD_POINTS = np.array(
    [
        *[(-1, -1), (-1, 1), (1, -1), (1, 1)],
        *[(0, 0)] * 5,
        *[(1.414, 0), (-1.414, 0), (0, 1.414), (0, -1.414)],
    ]
)
YIELD = np.array([76.5, 77.0, 78.0, 79.5, 79.9, 80.3, 80.0, 79.7, 79.8, 78.4, 75.6, 78.5, 77.0])
YIELD_REGION = region("AB", np.array([85.0, 175.0]), np.array([5.0, 5.0]))
