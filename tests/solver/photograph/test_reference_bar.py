"""A bar of known length in the picture: found wherever it lies, refused where it cannot be told."""

import numpy as np
import pytest

from solver.photograph import NotAPile, Reason, reference_pixels
from tests.solver.photograph.rendered import Look, photograph, picture_of, solid_cover

PILE = solid_cover(25, 30, 150)


def bar(u, z, x=40.0, y=320.0, length=300.0, width=12.0, turn_deg=0.0):
    """Cover of a bar about (x, y)."""
    turn = np.radians(turn_deg)
    along = (u - x) * np.cos(turn) + (z - y) * np.sin(turn)
    across = (z - y) * np.cos(turn) - (u - x) * np.sin(turn)
    return np.clip(0.5 + length / 2 - np.abs(along), 0, 1) * np.clip(0.5 + width / 2 - np.abs(across), 0, 1)


@pytest.mark.parametrize("turn_deg", [0.0, 20.0, 85.0])
@pytest.mark.parametrize("look", [Look(), Look(pile=210, backdrop=70, noise=6, jpeg=60)], ids=["dark", "light"])
def test_the_length_of_a_bar(look, turn_deg):
    def cover(u, z):
        return np.maximum(PILE(u, z), bar(u, z, length=200.0, turn_deg=turn_deg))

    assert reference_pixels(picture_of(photograph(cover, look))) == pytest.approx(200.0, abs=0.6)


def test_a_bar_with_its_shadow_is_one_bar():
    def cover(u, z):
        return np.maximum(PILE(u, z), bar(u, z, x=-100.0, length=240.0))

    assert reference_pixels(picture_of(photograph(cover, Look(shadow=0.3)))) == pytest.approx(240.0, abs=0.6)


@pytest.mark.parametrize(
    "cover",
    [
        PILE,
        lambda u, z: np.maximum(bar(u, z), bar(u, z, y=250.0)),
        lambda u, z: bar(u, z, x=450.0),
        lambda u, z: bar(u, z, width=100.0),
    ],
    ids=["none", "two", "cut by the frame", "not long"],
)
def test_no_single_bar(cover):
    with pytest.raises(NotAPile) as error:
        reference_pixels(picture_of(photograph(cover, Look())))
    assert error.value.reason == Reason.NO_SCALE
