"""The observables of a pile at rest, each a function PileReading → Value.

The angle of repose is read by the image method (``repose.py``) and, as the angle of an equivalent cone, by three
estimators that use the whole pile instead of its outline. For a homogeneous cone of height H, base radius R and
tan(angle) = H/R:

    centre of mass          z_com = H/4
    mass within radius ρR   3ρ² - 2ρ³ of the whole, so r50 = R/2 exactly
    volume                  V = π R² H / 3

hence

    centre-of-mass cone     tan(angle) = 2 z_com / r50
    volume cone             tan(angle) = 3 V / (8 π r50³)
    cone-equivalent         the cone nearest to the surface h(r):
                            min over H, R of ∫ (h(r) - H max(0, 1 - r/R))² r dr

Bias [°] on made-up piles of 80 seed-sized bodies in a cone of 25° (60 piles each, 95 % interval;
``made_up.seeds_in_cone``), for three rules on how much of a body must lie inside the cone: its centre
(homogeneous mass, bodies stick out), half of it, all of it:

    silhouette flank fit    -5.4 ± 0.6    -1.6 ± 0.5     -0.4 ± 0.4
    cone-equivalent         -8.3 ± 0.8    -1.4 ± 0.6     +4.0 ± 0.5
    centre-of-mass cone     -0.2 ± 0.8   +11.3 ± 0.9    +20.9 ± 0.9
    volume cone            -12.9 ± 0.7    -0.6 ± 1.2    +13.2 ± 1.5

The centre-of-mass cone is right for homogeneous mass and far too steep where the toe is thin. None of the
three may be compared with an angle that was read from a picture.

Closed forms by integration of H (1 - r/R) over the disc r < R; no source needed.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import numpy.typing as npt

from solver.effects.effect import Telltale
from solver.observables.observable import ANGLE, AT_LEAST_0, SHARE, Observable, Value, mean_value, of_pile
from solver.observables.reading import PileReading
from solver.observables.silhouette import PIXEL, column_tops
from solver.observables.surface import height_map, radial_profile, radius_holding
from solver.rigs.rig import PILE

Array = npt.NDArray[np.float64]

BASE_RADII = np.linspace(0.2, 1.0, 801)
"""Base radii that :func:`fitted_cone_angle_deg` tries, as fractions of the profile's reach."""
SHAPE, FLOW, ASYMMETRY, PACKING = Telltale
PROFILE_RING = 5.0e-3
"""Width of the rings of :func:`height_profile` [m]."""
PROFILE_RINGS = 30
SURFACE_RINGS = 60
"""Rings of the surface that the cone is fitted to, out to 3 r50."""


def mass_cone_angle_deg(z_com: float, r50: float) -> float:
    """Angle [°] of the cone with its centre of mass at ``z_com`` [m] and half of its mass within ``r50`` [m]."""
    return _degrees(2.0 * z_com, r50)


def volume_cone_angle_deg(volume: float, r50: float) -> float:
    """Angle [°] of the cone of ``volume`` [m³] with half of its mass within ``r50`` [m]."""
    return _degrees(3.0 * volume, 8.0 * np.pi * r50**3)


def fitted_cone_angle_deg(radius: Array, height: Array) -> float:
    """Angle [°] of the cone nearest to the surface ``height`` [m] at evenly spaced ``radius`` [m], shape
    (n,) each.

    For a given R the best H is a ratio of two sums; R is searched on a grid of 0.1 % of the profile's
    reach. NaN for a surface without height.
    """
    if radius.size == 0 or not height.any():
        return float("nan")
    reach = radius[-1] + 0.5 * (radius[1] - radius[0])
    base = BASE_RADII * reach
    shape = np.maximum(0.0, 1.0 - radius / base[:, None])
    overlap = (shape * height) @ radius
    norm = (shape**2) @ radius
    # The squared distance at the best H is constant - overlap²/norm.
    best = int(np.argmax(overlap**2 / norm))
    return _degrees(overlap[best] / norm[best], base[best])


def _degrees(rise: float, run: float) -> float:
    return float(np.degrees(np.arctan2(rise, run))) if run > 0.0 else float("nan")


def angle_of_repose(reading: PileReading) -> Value:
    """Silhouette flank fit, mean of 12 views × 2 flanks; spread over the flanks."""
    return mean_value(reading.flanks_deg.ravel().tolist(), "deg")


def angle_of_repose_above_one_body(reading: PileReading) -> Value:
    """Silhouette flank fit with the floor at max(20 % of the height, one body's thickness)."""
    return mean_value(reading.flanks_above_one_body_deg.ravel().tolist(), "deg")


def angle_of_repose_left(reading: PileReading) -> Value:
    """Silhouette flank fit, left flank of the view along +y (the side of -x)."""
    return Value(float(reading.flanks_deg[0, 0]), "deg")


def angle_of_repose_right(reading: PileReading) -> Value:
    """Silhouette flank fit, right flank of the view along +y (the side of +x)."""
    return Value(float(reading.flanks_deg[0, 1]), "deg")


def angle_of_repose_at(azimuth_deg: float) -> Callable[[PileReading], Value]:
    """The observable "one view, mean of both flanks" for any azimuth."""
    return lambda reading: mean_value(list(reading.view_deg(azimuth_deg)), "deg")


of_angle = partial(of_pile, group=PILE, possible=ANGLE)


def view(name: str, azimuth_deg: float) -> Observable:
    """The observable "one view, mean of both flanks" from ``azimuth_deg``, as ``<name>@<azimuth>``."""
    return of_angle(
        f"{name}@{azimuth_deg:g}",
        "deg",
        angle_of_repose_at(azimuth_deg),
        SHAPE,
        doc=f"Silhouette flank fit, view from azimuth {azimuth_deg:g}°, mean of both flanks.",
        scanned=True,
    )


def angle_of_repose_cone(reading: PileReading) -> Value:
    """Angle of the cone nearest to the azimuth-averaged top surface."""
    if not reading.is_pile or reading.surface is None:
        return Value(float("nan"), "deg")
    ring_width = 3.0 * reading.r50 / SURFACE_RINGS
    return Value(fitted_cone_angle_deg(*radial_profile(reading.surface, ring_width, SURFACE_RINGS)), "deg")


def angle_of_repose_mass_cone(reading: PileReading) -> Value:
    """Angle of the cone with the pile's height of the centre of mass and its r50."""
    if not reading.is_pile:
        return Value(float("nan"), "deg")
    return Value(mass_cone_angle_deg(float(reading.centre[2]), reading.r50), "deg")


def angle_of_repose_volume_cone(reading: PileReading) -> Value:
    """Angle of the cone with the volume under the pile's surface (within 2 r50, its base) and its r50."""
    if not reading.is_pile or reading.surface is None:
        return Value(float("nan"), "deg")
    return Value(volume_cone_angle_deg(reading.surface.volume(2.0 * reading.r50), reading.r50), "deg")


def apex_height(reading: PileReading) -> Value:
    """Top of the silhouette above the plate, median over the views; spread over them.

    The median, because a tall stray stands before or behind the pile in a few views.
    """
    heights = [float(column_tops(image).max()) * PIXEL for image in reading.silhouettes if image.size]
    over_views = mean_value(heights, "m")
    return Value(float(np.median(heights)), "m", over_views.spread) if heights else over_views


def centre_height(reading: PileReading) -> Value:
    """Height of the pile's centre of mass above the plate; a quarter of the height of a homogeneous cone."""
    return Value(float(reading.centre[2]), "m")


def footprint_r50(reading: PileReading) -> Value:
    """Radius about the pile's centre of mass that holds 50 % of the mass on the plate."""
    return Value(reading.r50, "m")


def footprint_r90(reading: PileReading) -> Value:
    """Radius about the pile's centre of mass that holds 90 % of the mass on the plate."""
    return Value(radius_holding(0.9, reading.radii, reading.pile.mass), "m")


def centroid_x(reading: PileReading) -> Value:
    """Centre of mass relative to the rig's axis as it was measured (``Scene.axis``), along x."""
    return Value(float(reading.centre[0]) - reading.pile.axis[0], "m")


def centroid_y(reading: PileReading) -> Value:
    """Centre of mass relative to the rig's axis as it was measured (``Scene.axis``), along y."""
    return Value(float(reading.centre[1]) - reading.pile.axis[1], "m")


def stray_fraction(reading: PileReading) -> Value:
    """Mass fraction of the bodies whose centre lies beyond 2 r50."""
    mass = reading.pile.mass
    if mass.size == 0:
        return Value(float("nan"), "1")
    return Value(float(mass[reading.radii > 2.0 * reading.r50].sum() / mass.sum()), "1")


def height_profile(
    reading: PileReading, ring_width: float = PROFILE_RING, rings: int = PROFILE_RINGS
) -> tuple[Array, Array]:
    """``height_profile_m``: middle radii of rings [m] and mean top surface in them [m]; shape (rings,) each.

    About the pile's own centre of mass; bare plate counts as 0. An empty pile is NaN everywhere.
    """
    if reading.pile.mass.size == 0:
        middle: Array = (np.arange(rings, dtype=np.float64) + 0.5) * ring_width
        return middle, np.full(rings, np.nan)
    surface = height_map(reading.pile.spheres, reading.centre[:2], ring_width * rings, ring_width / 8.0)
    return radial_profile(surface, ring_width, rings)


OBSERVABLES = (
    of_angle(
        "angle_of_repose_deg",
        "deg",
        angle_of_repose,
        SHAPE,
        label="angle of repose, silhouette",
        estimator=True,
        scanned=True,
    ),
    of_angle("angle_of_repose_left_deg", "deg", angle_of_repose_left, SHAPE, ASYMMETRY, scanned=True),
    of_angle("angle_of_repose_right_deg", "deg", angle_of_repose_right, SHAPE, ASYMMETRY, scanned=True),
    *(view("angle_of_repose_deg", azimuth) for azimuth in (0, 45, 90, 135)),
    of_angle(
        "angle_of_repose_above_one_body_deg",
        "deg",
        angle_of_repose_above_one_body,
        SHAPE,
        label="angle of repose, silhouette above one body",
        estimator=True,
    ),
    of_angle(
        "angle_of_repose_cone_deg",
        "deg",
        angle_of_repose_cone,
        SHAPE,
        label="angle of repose, mean cone",
        estimator=True,
    ),
    of_angle(
        "angle_of_repose_mass_cone_deg",
        "deg",
        angle_of_repose_mass_cone,
        SHAPE,
        label="angle of repose, centre-of-mass cone",
        estimator=True,
    ),
    of_angle(
        "angle_of_repose_volume_cone_deg",
        "deg",
        angle_of_repose_volume_cone,
        SHAPE,
        label="angle of repose, volume cone",
        estimator=True,
    ),
    of_pile("apex_height_m", "m", apex_height, SHAPE, PACKING, group=PILE, scanned=True, possible=AT_LEAST_0),
    of_pile("centre_height_m", "m", centre_height, SHAPE, PACKING, group=PILE, scanned=True, possible=AT_LEAST_0),
    of_pile("footprint_r50_m", "m", footprint_r50, SHAPE, group=PILE, scanned=True, possible=AT_LEAST_0),
    of_pile("footprint_r90_m", "m", footprint_r90, SHAPE, FLOW, group=PILE, scanned=True, possible=AT_LEAST_0),
    of_pile("centroid_x_m", "m", centroid_x, ASYMMETRY, group=PILE, scanned=True),
    of_pile("centroid_y_m", "m", centroid_y, ASYMMETRY, group=PILE, scanned=True),
    of_pile("stray_fraction", "1", stray_fraction, FLOW, group=PILE, scanned=True, possible=SHARE),
)
"""What is read off a pile on the plate, in the order of tables."""
