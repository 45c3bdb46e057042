"""What people photograph: piles on discs and in trays, funnels, bent lenses, cameras above and close by, drawings."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import ExifTags, Image

from solver.observables.silhouette import largest_part, silhouette
from solver.photograph import PhotographedPile, Reason, Refusal, open_picture, read_photograph
from solver.photograph.lens import bent, straight
from solver.photograph.picture import FILM_DIAGONAL
from solver.photograph.support import rimless, severed, support_under
from tests.solver.photograph.coverage import scanned_spheres
from tests.solver.photograph.rendered import Look, image_cover, photograph, picture_of, solid_cover
from tests.solver.photograph.staged import Camera, Stage, seen_deg, staged

LOOK = Look(width=640, pile=70, plate=70, noise=2, base=0.78)
SMOOTH = 0.5
"""Largest error on a smooth solid [°]."""
HEIGHT = float(np.tan(np.radians(30.0)))


def read(stage, look=LOOK, **options):
    """The reading of a stage; fails on a refusal."""
    found = read_photograph(replace(picture_of(staged(stage, look)), **options))
    assert isinstance(found, PhotographedPile), found
    return found


def holds(pile, angle_deg):
    """Whether both flanks' intervals hold the angle."""
    return all(
        low <= angle_deg <= high for low, high in (pile.angles.left.interval_deg, pile.angles.right.interval_deg)
    )


@pytest.mark.parametrize("support", ["disc", "tray", "dish"])
@pytest.mark.parametrize("tilt_deg", [0.0, 3.0])
def test_what_is_under_the_pile_in_its_tone_is_cut_off(support, tilt_deg):
    stage = Stage(30.0, support, wide=1.35, high=0.35 * HEIGHT)
    pile = read(stage, replace(LOOK, tilt_deg=tilt_deg))
    # Of a tilted dish the rim itself is found as the edge of a plate: the base line is the same.
    assert pile.base.kind == "support" or (support, pile.base.kind) == ("dish", "plate")
    assert pile.angles.left.value_deg == pytest.approx(30.0, abs=SMOOTH)
    assert pile.angles.right.value_deg == pytest.approx(30.0, abs=SMOOTH)
    # Of a pile in a tray the rim hides what is below.
    shown = HEIGHT if support == "disc" else HEIGHT + stage.foot - stage.high
    assert pile.height == pytest.approx(shown * stage.fill * LOOK.width / 2, rel=0.03)


def test_a_corner_on_one_side_is_no_support_and_bodies_are_none():
    cone = np.maximum(0.0, 200.0 - 0.5 * np.abs(np.arange(900.0) - 450.0))
    step = np.where(np.arange(900) > 700, np.maximum(cone, 75.0), cone)
    assert support_under(cone, 1.0) is None
    assert support_under(step, 1.0) is None
    both = np.where(np.abs(np.arange(900) - 450.0) > 250, np.maximum(cone, 75.0), cone)
    found = support_under(both, 1.0)
    assert found.height == pytest.approx(75.0, abs=0.5)
    image = largest_part(silhouette(scanned_spheres(np.random.default_rng(3)), 0.0, 0.2e-3))
    assert support_under(image.sum(axis=0).astype(float), 1.0) is None


@pytest.mark.parametrize("mouth", [0.05, 0.4], ids=["tube", "funnel"])
@pytest.mark.parametrize("plate", [None, 70.0, 120.0])
def test_a_funnel_in_the_apex_is_cut_off(mouth, plate):
    angles = read(Stage(30.0, "funnel", stem=0.05, mouth=mouth), replace(LOOK, plate=plate)).angles
    assert angles.left.value_deg == pytest.approx(30.0, abs=SMOOTH)
    assert angles.right.value_deg == pytest.approx(30.0, abs=SMOOTH)


def test_a_funnel_that_comes_from_above_the_picture_is_cut_off():
    def cover(u, z):
        return np.maximum(solid_cover(25.0, 30.0, 120.0)(u, z), (np.abs(u) < 12) & (z > 100))

    pile = read_photograph(picture_of(photograph(cover, Look(width=700))))
    assert isinstance(pile, PhotographedPile)
    assert pile.angles.mean.value_deg == pytest.approx(27.5, abs=SMOOTH)


def test_a_ledge_on_one_side_is_never_read_wrong():
    """A pile at one end of a disc."""
    found = read_photograph(picture_of(staged(Stage(30.0, "disc", wide=1.4, high=0.17, aside=0.4, fill=0.5), LOOK)))
    assert isinstance(found, Refusal), found.angles
    assert found.reason == Reason.BENT_FLANK


def test_only_thin_bars_on_both_sides_above_the_foot_are_a_rim():
    y, x = np.mgrid[0:200, 0:400]
    pile = (np.abs(x - 200) < y - 80) & (y < 180)
    rim = pile | ((np.abs(y - 150) < 4) & (np.abs(x - 200) < 150))
    cut = rimless(rim)
    assert np.abs(np.flatnonzero(cut.any(axis=0))[[0, -1]] - 200.0).max() <= 100
    assert rimless(pile) is pile
    one = pile | ((np.abs(y - 150) < 4) & (x > 200) & (x < 350))
    assert rimless(one) is one
    plate = pile | ((y >= 180) & (y < 190))
    assert rimless(plate) is plate


def test_only_a_long_tip_is_severed():
    y, x = np.mgrid[0:200, 0:400]
    pile = np.abs(x - 200) < y - 100
    assert severed(pile) is None
    assert severed(pile | ((np.abs(x - 200) < 6) & (y > 95))) is None
    cut = severed(pile | ((np.abs(x - 200) < 6) & (y > 20)))
    # To where the pile is a quarter wider than the tip.
    assert 105 <= np.flatnonzero(cut.any(axis=1))[0] <= 109


@pytest.mark.parametrize("k", [-0.12, -0.05, 0.05, 0.12])
def test_a_lens_that_bends_the_plate_is_taken_out(k):
    stage = Stage(25.0, lens=k, fill=0.5)
    pile = read(stage)
    assert pile.lens == pytest.approx(k, abs=0.15 * abs(k))
    assert pile.angles.left.value_deg == pytest.approx(25.0, abs=SMOOTH)
    assert pile.angles.right.value_deg == pytest.approx(25.0, abs=SMOOTH)
    # The outline lies over the pile of the picture as it is: the apex as the camera sees it.
    top = int(pile.outline.top.argmax())
    place = np.array(pile.in_picture(pile.outline.u[[top]], pile.outline.top[[top]]))[:, 0]
    camera = Camera(stage, LOOK)
    apex = camera.seen(np.array([[0.0, 0.0, stage.height]]))[:, 0] + [camera.columns / 2 - 0.5, camera.rows / 2 - 0.5]
    assert np.hypot(*(place - apex)) < 4.0


def test_a_straight_picture_is_left_alone():
    pile = read(Stage(25.0, fill=0.5))
    assert pile.lens == 0.0
    assert pile.angles.left.parts_deg["lens"] < 0.05


def test_bent_and_straight_are_inverse():
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 9), np.linspace(-0.5, 0.5, 7))
    for k in (-0.15, 0.15):
        np.testing.assert_allclose(
            bent(*straight(x, y, k), k), [x, y], atol=1e-9
        )  # fifty steps, each half of the last or less


@pytest.mark.parametrize("plate", [None, 130.0])
@pytest.mark.parametrize("above_deg", [8.0, 13.0, 20.0])
def test_a_camera_that_looks_down_is_refused_as_such(plate, above_deg):
    look = replace(LOOK, plate=plate, base=0.7, shadow=0.2)
    found = read_photograph(picture_of(staged(Stage(35.0, above_deg=above_deg, plate_wide=2.0, fill=0.45), look)))
    assert isinstance(found, Refusal), found.angles
    assert found.reason == Reason.CAMERA_LOOKS_DOWN, found


def test_the_interval_holds_what_a_camera_a_little_above_takes_away():
    stage, look = Stage(20.0, above_deg=4.0), replace(LOOK, plate=None, base=0.7)
    pile = read(stage, look)
    # As the planes through the camera that touch the cone have it.
    seen = float(
        np.degrees(
            np.arctan(np.sqrt(np.tan(np.radians(20)) ** 2 * np.cos(np.radians(4)) ** 2 - np.sin(np.radians(4)) ** 2))
        )
    )
    assert seen_deg(stage, look) == pytest.approx([seen, seen], abs=0.05)
    assert pile.angles.mean.value_deg == pytest.approx(seen, abs=0.2)
    assert holds(pile, 20.0)


def test_the_interval_holds_the_perspective_that_the_file_tells():
    stage = Stage(30.0, distance=3.0, fill=0.5)
    grey = picture_of(staged(stage, replace(LOOK, base=0.5)))
    near = read_photograph(replace(grey, focal=stage.fill * LOOK.width / 2 * stage.distance))
    # tan α cos θ, sin θ = 1/3 of a camera three radii away: 28.56°.
    assert near.angles.mean.value_deg == pytest.approx(28.56, abs=0.2)
    assert holds(near, 30.0)
    assert near.angles.mean.error_deg > 2 * read_photograph(grey).angles.mean.error_deg


def test_the_focal_length_for_film_is_read_off_the_file(tmp_path):
    exif = Image.Exif()
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FocalLengthIn35mmFilm] = 26
    path = tmp_path / "a.jpg"
    Image.fromarray(np.full((300, 400), 100, dtype=np.uint8)).save(path, exif=exif)
    assert open_picture(path).focal == pytest.approx(26.0 * 500.0 / FILM_DIAGONAL)
    assert pytest.approx(43.27, abs=0.01) == FILM_DIAGONAL
    Image.fromarray(np.full((300, 400), 100, dtype=np.uint8)).save(path)
    assert open_picture(path).focal is None


def test_thirds_of_a_straight_flank_are_alike_and_a_bend_widens_the_interval():
    def bent_cover(change):
        def cover(u, z):
            # From its apex down the flank is flatter by ``change`` of its slope.
            x = np.abs(u) / 300.0
            return np.clip(0.5 + 150.0 * (1.0 - (1.0 + change) * x + change * x * x) - z, 0.0, 1.0) * (z > 0)

        return cover

    even, curved = (read_photograph(picture_of(photograph(bent_cover(c), Look(width=900)))) for c in (0.0, 0.12))
    assert even.angles.left.thirds_deg == pytest.approx([26.57] * 3, abs=0.3)
    lower, middle, upper = curved.angles.left.thirds_deg
    assert lower < middle < upper
    assert curved.angles.left.error_deg > 3 * even.angles.left.error_deg


def test_a_flank_of_two_slopes_is_refused_and_the_base_line_offered():
    def cover(u, z):
        x = np.abs(u)
        height = np.where(x < 150, 200.0 - x, 50.0 - 0.2 * (x - 150.0))
        return np.clip(0.5 + height - z, 0.0, 1.0) * (z > 0)

    picture = picture_of(photograph(cover, Look(width=1000)))
    found = read_photograph(picture)
    assert isinstance(found, Refusal), found.angles
    assert found.reason == Reason.BENT_FLANK
    assert "--baseline" in found.detail
    y = 0.82 * 620 - 52
    given = read_photograph(picture, base_line=(y, y))
    assert given.angles.mean.value_deg == pytest.approx(45.0, abs=SMOOTH)


def test_a_drawn_triangle_is_refused_and_a_black_and_white_photograph_is_read():
    plain = {"noise": 0.0, "texture": 0.0, "blur": 0.3}
    drawn = read_photograph(picture_of(photograph(solid_cover(30, 30, 150), Look(width=800, **plain))))
    assert isinstance(drawn, Refusal)
    assert drawn.reason == Reason.DRAWN
    image = largest_part(silhouette(scanned_spheres(np.random.default_rng(3)), 0.0, 0.1e-3))
    look = Look(width=1200, **plain)
    masked = read_photograph(picture_of(photograph(image_cover(image, 0.7 * 1200 / image.shape[1]), look)))
    assert isinstance(masked, PhotographedPile), masked
