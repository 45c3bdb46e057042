"""Rendered piles of known angle come back; the silhouette of bodies is read as the simulation reads it."""

from dataclasses import replace

import numpy as np
import pytest

from solver.observables.repose import flank_angles_deg, outline
from solver.observables.silhouette import largest_part, silhouette
from solver.photograph import PhotographedPile, read_photograph
from solver.pours.record import Spheres
from tests.solver.photograph.coverage import scanned_spheres
from tests.solver.photograph.rendered import Look, image_cover, photograph, picture_of, solid_cover

LEFT, RIGHT = 25.0, 30.0
SMOOTH = 0.5
"""Largest error on a smooth solid [°], as promised."""


def read(look, left=LEFT, right=RIGHT, height=0.18, **options):
    """The reading of a solid; fails on a refusal."""
    found = read_photograph(picture_of(photograph(solid_cover(left, right, height * look.width), look)), **options)
    assert isinstance(found, PhotographedPile), found
    return found


@pytest.mark.parametrize(
    "look",
    [
        Look(),
        Look(width=400),
        Look(width=2600),
        Look(tilt_deg=5, width=640),
        Look(tilt_deg=-5, width=640, plate=70),
        Look(pile=220, backdrop=60),
        Look(pile=120, backdrop=160, noise=6),
        Look(slant=0.8, falloff=0.3, pile=120),
        Look(shading=0.5),
        Look(shadow=0.4),
        Look(shadow=0.3, pile=90, shadow_blur=0.004),
        Look(jpeg=10, noise=4, width=500),
        Look(plate=130),
        Look(plate=20),
        Look(plate=240, pile=230, backdrop=60),
        Look(texture=15),
    ],
    ids=lambda look: ",".join(f"{k}={v}" for k, v in vars(look).items() if v != getattr(Look(), k)) or "plain",
)
def test_a_solid_has_its_angles(look):
    angles = read(look).angles
    assert angles.left.value_deg == pytest.approx(LEFT, abs=SMOOTH)
    assert angles.right.value_deg == pytest.approx(RIGHT, abs=SMOOTH)
    assert angles.mean.value_deg == pytest.approx((LEFT + RIGHT) / 2, abs=SMOOTH)


@pytest.mark.parametrize(("left", "right", "height"), [(12.0, 10.0, 0.07), (50.0, 45.0, 0.30)])
def test_shallow_and_steep(left, right, height):
    angles = read(Look(), left, right, height).angles
    assert (angles.left.value_deg, angles.right.value_deg) == pytest.approx((left, right), abs=SMOOTH)


def test_lengths_and_places():
    look = Look(tilt_deg=3.0)
    pile = read(look, metres_per_pixel=2e-4)
    height = 0.18 * look.width
    feet = height / np.tan(np.radians([LEFT, RIGHT]))
    assert pile.unit == "m"
    # The tip of a cone is a pixel narrow and its blur as wide as that.
    assert pile.height == pytest.approx(2e-4 * height, abs=2e-4 * 2)
    assert pile.half_width == pytest.approx(2e-4 * feet.mean(), rel=2e-3)
    assert pile.base.tilt_deg == pytest.approx(3.0, abs=0.05)
    # The apex is above the origin of the picture's base line, up along the tilted normal.
    k = pile.outline.top.argmax()
    x, y = pile.in_picture(pile.outline.u[k], pile.outline.top[k])
    tilt = np.radians(3.0)
    up = height * np.array([np.sin(tilt), -np.cos(tilt)])
    base = [(look.width - 1) / 2, look.base * round(0.62 * look.width)]
    assert np.hypot(*(np.array([x, y]) - base - up)) < 3.0


def test_without_a_scale_lengths_are_pixels():
    pile = read(Look())
    assert pile.unit == "px"
    assert pile.height == pytest.approx(180.0, abs=2.0)


def test_a_stated_base_line_is_taken():
    look = replace(Look(), plate=70.0)
    y = look.base * round(0.62 * look.width)
    # Forty pixels higher, so that the foot of the cone is cut off: the flanks stay, the height does not.
    pile = read(look, base_line=(y - 40, y - 40))
    assert pile.base.kind == "given"
    assert pile.height == pytest.approx(140.0, abs=2.0)
    assert pile.angles.mean.value_deg == pytest.approx((LEFT + RIGHT) / 2, abs=SMOOTH)


def test_a_funnel_above_the_pile_is_not_the_pile():
    def cover(u, z):
        funnel = (np.abs(u) < 30 + np.maximum(z - 330, 0)) & (z > 250)
        return np.maximum(solid_cover(LEFT, RIGHT, 144)(u, z), funnel)

    pile = read_photograph(picture_of(photograph(cover, Look(width=800))))
    assert isinstance(pile, PhotographedPile)
    assert pile.height == pytest.approx(144, abs=2)


def test_the_interval_grows_with_noise_and_shrinks_with_pixels():
    quiet, loud = read(Look(noise=1)), read(Look(noise=12, pile=130))
    small, large = read(Look(width=400)), read(Look(width=1600))
    assert quiet.angles.left.error_deg < loud.angles.left.error_deg
    assert large.angles.left.error_deg < small.angles.left.error_deg


@pytest.mark.parametrize("azimuth", [0.0, 75.0])
def test_bodies_are_read_as_the_simulation_reads_them(azimuth):
    """One estimator with two readers: the photograph of a silhouette gives the angles of the silhouette."""
    spheres = scanned_spheres(np.random.default_rng(3))
    image = largest_part(silhouette(spheres, azimuth, 0.1e-3))
    look = Look(width=1400, texture=8, noise=3, tilt_deg=1.5)
    pile = read_photograph(picture_of(photograph(image_cover(image, 0.75 * 1400 / image.shape[1]), look)))
    assert isinstance(pile, PhotographedPile)
    truth = np.array(flank_angles_deg(image, 1.0))
    angles = (pile.angles.left, pile.angles.right)
    for angle, true in zip(angles, truth, strict=True):
        assert abs(angle.value_deg - true) <= max(SMOOTH, 2 * angle.error_deg)


def test_the_outline_is_of_the_simulations_kind():
    """A ball-built ramp of two sizes: outline and flanks are the fields that a simulated pile's outline has."""
    pile = read(Look(), metres_per_pixel=1e-4)
    simulated = outline(Spheres(np.array([[0.0, 0.0, 5e-3]]), np.array([5e-3]), np.zeros(1, dtype=np.int32)), 0.0)
    assert type(pile.outline) is type(simulated)
    assert pile.flanks[0].u[0] > pile.flanks[0].u[1]  # from the innermost to the outermost column
    assert pile.flanks[1].u[0] < pile.flanks[1].u[1]
