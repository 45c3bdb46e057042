"""Where the mass of a pile lies on the plate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from solver.record import Pile

Array = npt.NDArray[np.float64]


def centre_of_mass(pile: Pile) -> Array:
    """Centre of mass of the pile [m], shape (3,); NaN for an empty pile."""
    if pile.mass.size == 0:
        return np.full(3, np.nan)
    centre: Array = pile.mass @ pile.position / pile.mass.sum()
    return centre


def mass_radii(pile: Pile) -> Array:
    """Distances of the bodies from the pile's centre of mass in the plane of the plate [m], shape (n,)."""
    offset = pile.position[:, :2] - centre_of_mass(pile)[:2]
    return np.hypot(offset[:, 0], offset[:, 1])


def radius_holding(share: float, radius: Array, mass: Array) -> float:
    """Radius [m] that holds ``share`` of ``mass`` [kg], bodies at ``radius`` [m]; shape (n,) each.

    A body at a radius counts half of its mass as inside; linear between bodies. For equal masses this is
    Hazen's quantile (Hyndman & Fan 1996, definition 5). NaN without bodies.
    """
    if mass.size == 0:
        return float("nan")
    order = np.argsort(radius, kind="stable")
    held = np.cumsum(mass[order]) - 0.5 * mass[order]
    return float(np.interp(share * mass.sum(), held, radius[order]))


def body_thicknesses(pile: Pile) -> Array:
    """Smallest extent of each body along its principal axes [m], shape (n,): of the body in its own size.

    Principal axes of the member spheres' centres; a flat body that lies on the plate is this high.
    """
    spheres = pile.spheres
    _, body = np.unique(spheres.body, return_inverse=True)
    members = np.bincount(body).astype(np.float64)
    mean = np.stack([np.bincount(body, spheres.centre[:, k]) for k in range(3)], axis=1) / members[:, None]
    offset = spheres.centre - mean[body]
    scatter = np.zeros((members.size, 3, 3))
    np.add.at(scatter, body, offset[:, :, None] * offset[:, None, :])
    thin_axis = np.linalg.eigh(scatter)[1][:, :, 0]
    along = np.einsum("mk,mk->m", offset, thin_axis[body])
    top, bottom = np.full(members.size, -np.inf), np.full(members.size, np.inf)
    np.maximum.at(top, body, along + spheres.radius)
    np.minimum.at(bottom, body, along - spheres.radius)
    return top - bottom


def body_thickness(pile: Pile) -> float:
    """Median of :func:`body_thicknesses` [m]; NaN for an empty pile."""
    return float(np.median(body_thicknesses(pile))) if pile.mass.size else float("nan")


def grain_thickness(pile: Pile) -> float:
    """Mean of :func:`body_thicknesses` [m], weighted by mass; NaN for an empty pile.

    By mass, because mass fills the pile: by number, the many fines of a mixture would set the scale of a heap of few
    coarse bodies. Bodies of one mass weigh alike.
    """
    return float(np.average(body_thicknesses(pile), weights=pile.mass)) if pile.mass.size else float("nan")
