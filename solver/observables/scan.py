"""A scanned pile: spheres on the plate, as a three-dimensional scan gives them → :class:`Pile`.

    centre (m, 3) [m], radius (m,) [m], body (m,): which body a sphere belongs to, any whole numbers

The spheres of a body are in the order of the declared ``sphere_centres`` (in any order if the body is symmetric). Its
centre of mass is a weighted mean of its spheres' centres; the weights, which add up to one, are those that give the
declared centre of mass from the declared centres, and they remain valid under rigid motion and stretching. Its mass is
the declared mass times the cube of its relative linear size, the mean radius over the declared mean radius. Only one
component is allowed, because a scan does not show what a body is made of.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from solver.params import ParameterError
from solver.pours.record import Pile, Spheres
from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]

CENTRE_SLACK = 1e-3
"""Largest deviation of the weighted mean from the declared centre of mass, as a share of the body's size."""


def scanned_pile(scene: Scene, centre: Array, radius: Array, body: npt.NDArray[np.integer]) -> Pile:
    """The pile of the bodies of ``scene``; raises ParameterError for arrays that are no such pile."""
    if len(scene.bodies) != 1:
        names = ", ".join(declared.name for declared in scene.bodies)
        raise ParameterError(f"body: a scan does not tell {names} apart; allowed: a material of one component")
    _check(centre, radius, body)
    clump = scene.bodies[0].clump
    members = len(clump.radii)
    order = np.argsort(body, kind="stable")
    names, count = np.unique(body, return_counts=True)
    if (count != members).any():
        odd = names[np.flatnonzero(count != members)[0]]
        found = int(count[count != members][0])
        raise ParameterError(f"body: {found} spheres in body {odd}; allowed: {members}, as declared")
    centres, radii = centre[order].reshape(-1, members, 3), radius[order].reshape(-1, members)
    scale = radii.mean(axis=1) / clump.radii.mean()
    return Pile(
        spheres=Spheres(
            centres.reshape(-1, 3), radii.ravel(), np.repeat(np.arange(len(names), dtype=np.int32), members)
        ),
        position=np.einsum("m,bmk->bk", centre_weights(clump.centres, clump.bounding_radius), centres),
        mass=clump.mass * scale**3,
        component=np.zeros(len(names), dtype=np.int32),
        component_names=(scene.bodies[0].name,),
    )


def centre_weights(centres: Array, size: float) -> Array:
    """Weights (m,), sum one, with Σ wᵢ ``centres``ᵢ = 0 [m]; the ones of smallest norm.

    Raises ParameterError where the centre of mass lies off the plane, or line, of all sphere centres by more than
    ``CENTRE_SLACK`` of ``size`` [m].
    """
    # Rows in units of the size, so that lengths and the sum weigh alike.
    conditions = np.vstack([centres.T / size, np.ones(len(centres))])
    weights: Array = np.linalg.lstsq(conditions, np.array([0.0, 0.0, 0.0, 1.0]), rcond=None)[0]
    if np.abs(conditions @ weights - [0.0, 0.0, 0.0, 1.0]).max() > CENTRE_SLACK:
        raise ParameterError(
            "sphere_centres: the centre of mass cannot be computed from them, as it lies to one side of them all"
        )
    return weights


def _check(centre: Array, radius: Array, body: npt.NDArray[np.integer]) -> None:
    n = len(radius) if radius.ndim == 1 else -1
    if centre.shape != (n, 3) or body.shape != (n,):
        raise ParameterError(
            f"xyz, radius, body: shapes {centre.shape}, {radius.shape}, {body.shape}; allowed: (n, 3), (n,), (n,)"
        )
    if not (np.isfinite(centre).all() and np.isfinite(radius).all() and (radius > 0.0).all()):
        raise ParameterError("xyz, radius: a value is not finite, or a radius is not positive")
    if not np.issubdtype(body.dtype, np.integer):
        raise ParameterError(f"body: numbers of type {body.dtype}; allowed: whole numbers")
