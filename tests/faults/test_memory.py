"""The line that is fitted to the memory of a process."""

import numpy as np
import pytest

from tests.faults.memory import KIB, Growth


@pytest.mark.parametrize(("per_pour", "certain"), [(0.0, False), (60.0, False), (2000.0, True)])
def test_growth_is_found_with_its_interval(per_pour, certain):
    pours = np.arange(50, 10_001, 50.0)
    rng = np.random.default_rng(1)
    # Loaded within the first 500 pours; then what a garbage collector leaves to chance, alike for a while.
    noise = np.repeat(rng.normal(0.0, 300 * KIB, 40), 5)
    memory = 90e6 + 10e6 * (pours > 500) + per_pour * pours + noise
    found = Growth.of(pours, memory)
    assert abs(found.slope - per_pour) < 1.5 * found.half_width
    assert found.half_width < 60.0
    assert found.certain == certain
