"""Pictures without a pile to read are refused by name, not measured."""

from dataclasses import replace

import numpy as np
import pytest

from solver.photograph import PhotographedPile, Reason, Refusal, read_photograph
from tests.solver.photograph.rendered import Look, photograph, picture_of, solid_cover

LOOK = Look(width=800)
PILE = solid_cover(25, 30, 144)


def nothing(u, z):
    return np.zeros_like(u)


def two(apart, height):
    one = solid_cover(25, 30, height)
    return lambda u, z: np.maximum(one(u - apart, z), one(u + apart, z))


def moved(by):
    return lambda u, z: PILE(u - by, z)


def from_above(degrees, base_radius=250):
    """A cone of 25° as a camera sees it that looks down by ``degrees``: a stack of ellipses."""
    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    rise = np.tan(np.radians(25.0)) * cosine

    def cover(u, z):
        covered = np.zeros_like(u)
        for share in np.linspace(0, 1, 60, endpoint=False):
            radius = base_radius * (1 - share)
            inside = (u / radius) ** 2 + ((z - base_radius * share * rise) / (radius * sine)) ** 2 < 1
            covered = np.maximum(covered, inside)
        return covered

    return cover


@pytest.mark.parametrize(
    ("cover", "look", "reason"),
    [
        (nothing, LOOK, Reason.BLANK),
        (nothing, replace(LOOK, noise=15, slant=0.8, falloff=0.3), Reason.BLANK),
        (nothing, replace(LOOK, noise=40, blur=3), Reason.BLANK),
        (PILE, replace(LOOK, pile=186, noise=4), Reason.BLANK),
        (nothing, replace(LOOK, plate=70), Reason.NO_FLANK),
        (two(180, 80), LOOK, Reason.TWO_PILES),
        (two(90, 100), LOOK, Reason.TWO_PILES),
        (moved(200), LOOK, Reason.CUT_BY_FRAME),
        (moved(-220), replace(LOOK, plate=70), Reason.CUT_BY_FRAME),
        (PILE, replace(LOOK, base=1.05), Reason.CUT_BY_FRAME),
        (PILE, replace(LOOK, tilt_deg=10), Reason.TILTED_CAMERA),
        (PILE, replace(LOOK, tilt_deg=-20, base=0.7), Reason.TILTED_CAMERA),
        (from_above(8), replace(LOOK, base=0.7), Reason.CAMERA_LOOKS_DOWN),
        (from_above(20), replace(LOOK, base=0.7), Reason.CAMERA_LOOKS_DOWN),
        (PILE, replace(LOOK, blur=40), Reason.NO_CLEAR_SILHOUETTE),
        (PILE, replace(LOOK, pile=170, backdrop=100, shading=0.4, slant=0.3), Reason.NO_CLEAR_SILHOUETTE),
        (lambda u, z: (np.abs(u) < 100) & (z > 0) & (z < 100), LOOK, Reason.NO_FLANK),
    ],
    ids=[
        "blank",
        "blank, noisy, slanting light",
        "noise alone",
        "no contrast",
        "plate alone",
        "two apart",
        "two joined",
        "cut on the right",
        "cut on the left, plate",
        "cut below",
        "tilted by 10",
        "tilted by -20",
        "from 8 above",
        "from 20 above",
        "out of focus",
        "one flank as the backdrop",
        "a box",
    ],
)
def test_refused_by_name(cover, look, reason):
    found = read_photograph(picture_of(photograph(cover, look)))
    assert isinstance(found, Refusal), found.angles
    assert found.reason == reason, found
    assert found.detail


def test_a_camera_four_degrees_above_is_still_read():
    found = read_photograph(picture_of(photograph(from_above(4), replace(LOOK, base=0.7))))
    assert isinstance(found, PhotographedPile)
    # Seen from 4° above, 25° looks like 24.6°: √(h² − b²)/R with h = R tan 25° cos 4°, b = R sin 4°.
    assert found.angles.mean.value_deg == pytest.approx(24.6, abs=0.15)


def test_a_pile_of_a_few_pixels_is_too_small():
    found = read_photograph(picture_of(photograph(solid_cover(35, 35, 11), Look(width=300, pile=10, noise=0.5))))
    assert isinstance(found, Refusal)
    assert found.reason == Reason.TOO_SMALL
