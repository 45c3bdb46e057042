"""A printed checkerboard gives the lens back, and a pile through that lens reads as through a straight one."""

from dataclasses import replace

import numpy as np
import pytest

from solver.photograph import PhotographError, board_of, read_photograph
from solver.photograph.lens import bent, centred, straight
from tests.solver.photograph.rendered import Look, developed, picture_of
from tests.solver.photograph.staged import Stage, staged

LOOK = Look(width=560, noise=3.0, blur=0.8, slant=0.2, falloff=0.1, jpeg=85, base=0.5)


def board(k, look=LOOK, columns=9, rows=7, turn_deg=4.0, lean=0.12):
    """Grey levels of ``columns`` × ``rows`` fields, turned and leaning, seen through a lens of ``k``."""
    high = round(0.62 * look.width)
    y, x = np.mgrid[0 : 2 * high, 0 : 2 * look.width] / 2.0 - 0.25
    u, v, half = centred(x, y, (high, look.width))
    u, v = straight(u, v, k)
    # The plane of the board, from the picture: the inverse of a homography is one.
    turn = np.radians(turn_deg)
    a, b = np.cos(turn) * u + np.sin(turn) * v, np.cos(turn) * v - np.sin(turn) * u
    depth = 1.0 + lean * a
    field = 0.075 * look.width / half
    i, j = a / depth / field + columns / 2.0, b / depth / field + rows / 2.0
    on = (i >= 0) & (i < columns) & (j >= 0) & (j < rows)
    black = on & ((np.floor(i) + np.floor(j)) % 2 == 0)
    grey = np.where(black, 50.0, 200.0)
    return developed(grey.reshape(high, 2, look.width, 2).mean(axis=(1, 3)), look, np.random.default_rng(look.seed))


@pytest.mark.parametrize("k", [-0.15, -0.04, 0.0, 0.04, 0.15])
@pytest.mark.parametrize("turn_deg", [4.0, 20.0])
def test_a_board_gives_the_lens_back(k, turn_deg):
    found = board_of(picture_of(board(k, turn_deg=turn_deg)))
    assert found.corners == 8 * 6
    assert found.bend.k == pytest.approx(k, abs=max(0.002, 3 * found.bend.error))
    assert found.bend.error < 0.003
    assert found.miss < 0.3


@pytest.mark.parametrize("k", [-0.12, 0.12])
def test_a_pile_reads_as_through_a_straight_lens(k):
    bend = board_of(picture_of(board(k))).bend
    # The base line passes the middle of the picture and stays straight in any lens, which it then does not tell.
    look = replace(LOOK, pile=70, plate=70, jpeg=None, tilt_deg=3.0)
    stage = Stage(30.0, fill=0.8)
    plain = read_photograph(picture_of(staged(stage, look)))
    picture = picture_of(staged(replace(stage, lens=k), look))
    unknown, known = read_photograph(picture), read_photograph(picture, bend=bend)
    for side in ("left", "right"):
        before, after, through = (getattr(one.angles, side) for one in (unknown, known, plain))
        assert after.value_deg == pytest.approx(through.value_deg, abs=0.2)
        assert abs(before.value_deg - through.value_deg) > 0.5
        assert after.parts_deg["lens"] < 0.2 * before.parts_deg["lens"]
    assert known.lens == bend.k
    # A stated base line is that of the picture as it is.
    ends = known.as_seen(np.array([0.0, 559.0]), known.base.at(np.array([0.0, 559.0])))
    inner = np.polyfit(*known.as_seen(np.linspace(20, 539, 50), known.base.at(np.linspace(20, 539, 50))), 1)
    assert np.ptp(ends[1]) > 0
    given = read_photograph(picture, base_line=tuple(np.polyval(inner, [0.0, 559.0])), bend=bend)
    assert given.angles.mean.value_deg == pytest.approx(known.angles.mean.value_deg, abs=0.3)


def test_places_are_straightened_up_to_the_fold_of_a_barrel():
    """r (1 + k r²) has its largest value where 3 k r² = -1: 0.7698 at k = -0.25. What is seen farther out is no image
    of anything, and places there stay in order and at hand; within it the two functions are each other's inverse."""
    for k in (-0.25, -0.15, 0.15, 0.5):
        seen = np.linspace(0.0, 1.0, 201)
        r, _ = straight(seen, np.zeros_like(seen), k)
        assert (np.diff(r) > 0.0).all()
        assert r.max() <= 1.5
        within = seen < (0.76 if k == -0.25 else 0.97)
        np.testing.assert_allclose(bent(r, np.zeros_like(r), k)[0][within], seen[within], atol=1e-6)


def test_what_is_no_board_is_refused():
    for grey, why in (
        (staged(Stage(30.0), LOOK), "no checkerboard"),
        (board(0.0, columns=4, rows=3), "no checkerboard: 6 corners"),
        (np.full((300, 400), 120, dtype=np.uint8), "no checkerboard: 0 corners"),
    ):
        with pytest.raises(PhotographError, match=why):
            board_of(picture_of(grey))
