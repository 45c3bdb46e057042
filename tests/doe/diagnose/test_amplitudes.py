"""What a posterior says of an amplitude: its mean with the sign and direction of the best fit, and its interval."""

import math

import pytest

from doe.diagnose.emulator import Way
from tests.doe.diagnose.test_posterior import emulator, judged, planar
from tests.doe.validation.test_limit_ruler import unit


def test_of_a_direction_that_nothing_tells_the_amplitude_is_not_averaged_away():
    even = 6.0 * unit(0, 8)
    (x, y) = (one.value for one in judged(planar([even] * 4), 0.7 * even).fits["tilt"].amplitudes)
    assert math.hypot(x, y) == pytest.approx(1.4, rel=0.1)


def test_of_a_sign_that_nothing_tells_the_amplitude_is_not_averaged_away():
    even, ways = 6.0 * unit(0, 8), (Way("mass", "mass +", (0.3,)), Way("mass", "mass -", (-0.3,)))
    (found,) = judged(emulator({"up": even, "down": even}, ways=ways), 0.7 * even).fits["mass"].amplitudes
    # Six pours of data know it to 0.41/6 of itself, and the mean is over a prior even in the logarithm.
    assert abs(found.value) == pytest.approx(0.21, rel=0.15)
    assert found.low < -0.15 < 0.15 < found.high
