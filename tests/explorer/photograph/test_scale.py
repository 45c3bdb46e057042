"""A bar of known length is as bent by the lens as the pile is: the height is that through a straight lens."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from explorer.photograph.run import MeasureOrder, _reading
from solver.photograph.lens import Bend, bent, centred
from tests.solver.photograph.rendered import Look, picture_of
from tests.solver.photograph.staged import Stage, staged

LOOK = Look(width=900, noise=3.0, blur=0.8, pile=70, plate=70)
BAR = np.array([[60.0, 40.0], [840.0, 90.0]])
"""Its ends through a straight lens [px], near a corner each."""


def order(ends):
    return MeasureOrder((Path("pile.png"),), None, 0.3, tuple(ends.reshape(-1).tolist()), None, None, None, None)


def seen_through(k, shape):
    u, v, half = centred(*BAR.T, shape)
    u, v = bent(u, v, k)
    return np.column_stack([u * half + 0.5 * (shape[1] - 1), v * half + 0.5 * (shape[0] - 1)])


@pytest.mark.parametrize("known", [False, True], ids=["found from the base line", "by a checkerboard"])
@pytest.mark.parametrize("k", [pytest.param(-0.1, marks=pytest.mark.slow), 0.1])
def test_a_bar_is_measured_in_the_straight_picture(k, known):
    stage = Stage(30.0)
    plain = _reading(picture_of(staged(stage, LOOK)), order(BAR), None)
    picture = picture_of(staged(replace(stage, lens=k), LOOK))
    ends = seen_through(k, (picture.height, picture.width))
    board = SimpleNamespace(bend=Bend(k, 0.001)) if known else None
    found = _reading(picture, order(ends), board)
    assert found.lens == pytest.approx(k, abs=0.03)
    assert found.height == pytest.approx(plain.height, rel=0.01)
    # By the bar as it is seen it would be some 9 % off.
    raw = np.hypot(*(ends[1] - ends[0])) / np.hypot(*(BAR[1] - BAR[0]))
    assert abs(raw - 1.0) > 0.05
