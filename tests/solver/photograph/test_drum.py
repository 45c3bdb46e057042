"""Pictures of a turning drum: drawn beds of known angle, and a bed that the solver has poured."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from solver.assets import asset_path
from solver.observables.free_surface import column_places, slope_angle_deg, surface_heights
from solver.photograph import PhotographedDrum, Picture, Reason, Refusal, open_picture, read_drum
from solver.pours.record import Spheres
from tests.solver.photograph.drum_faces import Look, drawn, plane

LOOKS = {
    "dark bed": Look(),
    "light bed": Look(bed=200.0, void=60.0, beyond=90.0),
    "no rim": Look(rim=150.0, rim_width=0.3),
    "grains": Look(grains=18.0),
    "slanting light": Look(slant=0.35),
    "noisy, small": Look(width=420, height=320, radius=120.0, at=(205.0, 160.0), noise=9.0),
    "hazy": Look(blur=4.0, bed=120.0),
    "off the middle": Look(at=(590.0, 310.0), grains=10.0, seed=3),
    "bed as the rim": Look(bed=60.0, rim=55.0),
}


@pytest.mark.parametrize("angle", [12.0, 28.0, 44.0])
@pytest.mark.parametrize("name", LOOKS)
def test_a_drawn_bed_has_its_angle(name, angle):
    look = LOOKS[name]
    read = read_drum(drawn(plane(angle), look))
    assert isinstance(read, PhotographedDrum), read
    # Three standard errors, and a tenth of a pixel over the window, which no residual shows.
    assert abs(read.angle_deg - angle) < 3.0 * read.error_deg + np.degrees(0.1 / look.radius)
    assert read.error_deg < 0.6
    assert read.carried == "left"
    assert np.hypot(read.circle.x - look.at[0], read.circle.y - look.at[1]) < 0.01 * look.radius
    assert read.circle.radius == pytest.approx(look.radius, rel=0.01)


@pytest.mark.slow
def test_the_errors_are_of_the_right_size():
    """Over beds of grains: as many angles beyond two standard errors as may be, and no shift."""
    reads = [read_drum(drawn(plane(30.0), replace(LOOKS["grains"], seed=seed, grains=30.0))) for seed in range(20)]
    z = np.array([(one.angle_deg - 30.0) / one.error_deg for one in reads])
    assert np.count_nonzero(np.abs(z) > 2.0) <= 4  # binomial: 20 at 5 % give more than 4 once in 390
    assert abs(np.mean([one.angle_deg for one in reads]) - 30.0) < 0.2


def test_the_other_sense_of_rotation_is_the_same_angle():
    read = read_drum(drawn(plane(-33.0), Look()))
    assert read.carried == "right"
    assert read.angle_deg == pytest.approx(33.0, abs=0.2)
    known = np.isfinite(read.height)
    assert np.polyfit(read.x[known], read.height[known], 1)[0] < 0.0


def test_a_bent_surface_is_read_as_the_solver_reads_one():
    def bent(x):
        return -0.05 - 0.5 * x - 0.25 * x**3 + 0.15 * x**2

    read = read_drum(drawn(bent, Look()))
    x = np.linspace(-0.6, 0.6, 601)
    assert read.angle_deg == pytest.approx(slope_angle_deg(x, bent(x), 0.5), abs=0.25)
    known = np.abs(read.x) <= 0.5
    assert np.abs(read.height[known] - bent(read.x[known])).max() < 0.02


def test_a_bed_of_spheres_is_read_as_its_silhouette_is():
    """Spheres below a plane in a drum of 42 mm: the same moment read by the solver and off a picture of it."""
    rng = np.random.default_rng(5)
    radius, grain = 0.042, 1.2e-3
    centres = rng.uniform(-radius, radius, (12_000, 3)) * (1.0, 0.2, 1.0)
    inside = np.hypot(centres[:, 0], centres[:, 2]) < radius - grain
    below = centres[:, 2] < -0.004 - np.tan(np.radians(32.0)) * centres[:, 0]
    centres = centres[inside & below]
    lifted = centres + np.array([0.0, 0.0, radius])  # the solver's silhouettes stand on z = 0
    spheres = Spheres(centre=lifted, radius=np.full(len(centres), grain), body=np.arange(len(centres)))
    heights, places = surface_heights(spheres, radius) - radius, column_places(radius)
    ours = slope_angle_deg(places, heights, 0.5 * radius)

    def top(x):
        return np.interp(x, places / radius, np.nan_to_num(heights, nan=-radius) / radius)

    read = read_drum(drawn(top, Look(grains=12.0, grain=0.05)))
    assert read.angle_deg == pytest.approx(ours, abs=0.5)


@pytest.mark.parametrize(
    ("picture", "reason"),
    [
        (lambda: open_picture(asset_path("photographs", "cone_25_30")), {Reason.NO_DRUM}),
        (lambda: drawn(plane(30.0), Look(bed=190.0)), {Reason.BLANK, Reason.NO_SURFACE}),
        (lambda: drawn(plane(30.0, depth=3.0), Look()), {Reason.BLANK, Reason.NO_SURFACE}),
        (
            lambda: drawn(plane(30.0), Look(rim=190.0, beyond=190.0, bed=190.0)),
            {Reason.BLANK, Reason.NO_DRUM},
        ),
        (lambda: drawn(plane(30.0), Look(at=(60.0, 350.0))), {Reason.NO_DRUM}),
    ],
)
def test_what_is_no_drum_is_refused_by_name(picture, reason):
    read = read_drum(picture())
    assert isinstance(read, Refusal), read.angle_deg
    assert read.reason in reason, read.detail


GREY, FACE = drawn(plane(30.0), Look(grains=10.0)).grey.astype(np.float64), Look()
X = (np.arange(FACE.width) - FACE.at[0]) / FACE.radius
Y = (FACE.at[1] - np.arange(FACE.height))[:, None] / FACE.radius
R = np.hypot(X, Y)


def seen(grey):
    return Picture("drum", np.clip(grey, 0, 255).astype(np.float32), grey.shape[1], grey.shape[0], 1)


@pytest.mark.parametrize(
    ("grey", "reason"),
    [
        (np.where((np.abs(Y - 0.25) < 0.025) & (R < 1.0), 80.0, GREY), Reason.NO_SURFACE),  # a bar
        (np.where((Y > 0.0) & (Y < 0.4) & (R < 1.0), GREY - 70.0, GREY), Reason.NO_SURFACE),  # a reflection
        (np.where((np.abs(0.5 * X - 0.866 * Y) < 0.03) & (R < 1.0), 60.0, GREY), Reason.NO_SURFACE),  # a spoke
        (np.where(np.abs(R - 0.6) < 0.012, 30.0, GREY), Reason.NO_SURFACE),  # a ring
        (ndimage.zoom(GREY, (1, 0.97)), Reason.CAMERA_ASLANT),
        (GREY[:, 180:], Reason.CUT_BY_FRAME),
        (np.where(R < 1.0, 255.0, GREY), Reason.BLANK),  # overexposed
        (np.where(R < 1.0, 190.0 * (1.0 + 0.4 * (X + Y)), GREY), Reason.NO_SURFACE),  # empty, under slanting light
        (drawn(plane(0.0), Look()).grey.astype(np.float64), Reason.NO_SURFACE),  # at rest
    ],
)
def test_what_would_be_read_wrong_is_refused(grey, reason):
    read = read_drum(seen(grey))
    assert isinstance(read, Refusal), read.angle_deg
    assert read.reason == reason, read.detail


def test_a_thin_ring_inside_or_a_motor_beside_it_is_not_the_drum():
    """A faint line at 0.9 of the radius, and a round two-toned thing beside the drum."""
    rows, columns = np.mgrid[: FACE.height, : FACE.width]
    off = np.hypot(columns - 800.0, rows - 120.0)
    motor = np.where(off < 70.0, np.where(rows > 120, 60.0, 200.0), GREY)
    for grey in (np.where(np.abs(R - 0.9) < 0.004, GREY - 25.0, GREY), motor):
        read = read_drum(seen(grey))
        assert read.circle.radius == pytest.approx(FACE.radius, rel=0.01)
        assert read.angle_deg == pytest.approx(30.0, abs=0.2)


def test_no_picture_ends_otherwise_than_by_a_reading_or_a_refusal():
    """Noise, stripes, blocks and constants of odd shapes."""
    rng = np.random.default_rng(1)
    for k in range(60):
        rows, columns = rng.integers(32, 160, 2)
        grey = rng.uniform(0, 255, (rows, columns))
        stripes, blocks = np.repeat(grey[:, :1], columns, axis=1), np.round(grey / 255) * 255
        grey = [grey, blocks, np.full_like(grey, 7.0), stripes][k % 4]
        read = read_drum(Picture("any", grey.astype(np.float32), int(columns), int(rows), 1))
        assert isinstance(read, Refusal), read
