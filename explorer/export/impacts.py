"""Single impacts in LIGGGHTS: the cases of ``solver.verification`` are written as input, run, and read back.

The law is the same as in every other deck here (``liggghts.py``): ``hertz tangential history``, or ``hooke`` for linear
springs, with ``limitForce on`` and a restitution that gives our damping, so that the normal force is the same function.
Hertz's tangential force remains LIGGGHTS's own: a displacement times the present stiffness 8 G* a, whether the contact
is loaded or unloaded (LIGGGHTS-PUBLIC 3.8.0, ``tangential_model_history.h``). Ours is a force that is scaled down on
unloading.
"""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from explorer.errors import CommandError
from explorer.export.frames import SphereFrame
from explorer.export.liggghts import (
    INPUT,
    WRITE_FINAL,
    ContactSettings,
    FreeSpheres,
    run_lines,
    settings_lines,
    write_spheres,
)
from explorer.export.run import run_liggghts
from solver.scenes.contact_model import ContactModel
from solver.scenes.material import Material
from solver.verification.chung_ooi import RIGID
from solver.verification.impacts import (
    DECLARED_BY_NOBODY,
    STEPS_PER_CONTACT,
    Engine,
    Impact,
    Rebound,
    StruckSphere,
    contact_time,
    struck_time,
)

Array = npt.NDArray[np.float64]
DATA = "spheres.data"
BY_DEFAULT = ContactSettings()
"""Hertz–Mindlin without rolling resistance."""
SKIN = 0.4
"""Reach of the contact list beyond touching, in radii of the largest sphere."""
LENGTH = 4.0
"""Length of a run, in elastic contact times: a damped contact with e = 0.5 lasts 1.3 of them."""


def liggghts_engine(limit: float | None = None, contact: ContactModel = DECLARED_BY_NOBODY) -> Engine:
    """LIGGGHTS as an engine of the verification; each call is one run in a temporary folder.

    Parameters
    ----------
    limit
        Wall time after which a run is stopped [s]; None: never.
    contact
        The contact model whose law is run; conventions are LIGGGHTS's own.

    Raises
    ------
    CommandError
        On a call: LIGGGHTS is not installed, failed, or took longer than ``limit``; or a sphere is still in contact
        with the plane or its target at the end.
    """
    law = ContactSettings(law=contact.law, characteristic_velocity=contact.characteristic_velocity)
    on_plane, on_target = (functools.partial(one, limit=limit, law=law) for one in (_rebounds, _struck))
    return Engine("LIGGGHTS", on_plane, on_target)


def plane_input(folder: Path, impacts: Sequence[Impact], law: ContactSettings = BY_DEFAULT) -> None:
    """Write ``in.liggghts`` and ``spheres.data`` for impacts on the rigid plane z = 0, ``STEPS_PER_CONTACT`` each.

    Every kind of sphere (material, restitution, friction) is a type of its own; the plane is the last type.
    """
    kinds = list(dict.fromkeys((i.material, i.restitution, i.friction) for i in impacts))
    types = np.array([1 + kinds.index((i.material, i.restitution, i.friction)) for i in impacts])
    n, radius = len(impacts), np.array([i.radius for i in impacts])
    place = np.zeros((n, 3))
    place[:, 1] = np.arange(n) * 4.0 * radius.max()
    place[:, 2] = radius + [i.gap for i in impacts]
    spheres = FreeSpheres(
        types, radius, np.array([i.material.density for i in impacts]), place, _velocity(impacts), _spin(impacts)
    )
    # Only sphere and plane meet; the values for two spheres are not used.
    of_kind = np.array([[e, mu] for _, e, mu in kinds] + [[1.0, 0.0]])
    restitution = np.minimum.outer(of_kind[:, 0], of_kind[:, 0])
    friction = np.maximum.outer(of_kind[:, 1], of_kind[:, 1])
    times = [contact_time(i) for i in impacts]
    dt = min(times) / STEPS_PER_CONTACT
    materials = [*(material for material, _, _ in kinds), RIGID]
    _write(folder, law, spheres, materials, restitution, friction, dt, round(LENGTH * max(times) / dt), plane=True)


def target_input(
    folder: Path, impacts: Sequence[Impact], target: StruckSphere, law: ContactSettings = BY_DEFAULT
) -> None:
    """Write the same files for impacts on one free sphere each; the balls are numbered first, then the targets."""
    one, n = impacts[0], len(impacts)
    place = np.zeros((2 * n, 3))
    place[:, 1] = np.tile(np.arange(n) * 3.0 * target.radius, 2)
    place[:n, 2] = one.radius + target.radius
    still = np.zeros((n, 3))
    spheres = FreeSpheres(
        np.repeat([1, 2], n),
        np.repeat([one.radius, target.radius], n),
        np.repeat([one.material.density, target.material.density], n),
        place,
        np.vstack([_velocity(impacts), still]),
        np.vstack([_spin(impacts), still]),
    )
    tables = np.full((2, 2), one.restitution), np.full((2, 2), one.friction)
    dt, steps = struck_time(one, target) / STEPS_PER_CONTACT, round(LENGTH * STEPS_PER_CONTACT)
    _write(folder, law, spheres, [one.material, target.material], *tables, dt, steps, plane=False)


def _write(
    folder: Path,
    law: ContactSettings,
    spheres: FreeSpheres,
    materials: Sequence[Material],
    restitution: Array,
    friction: Array,
    dt: float,
    steps: int,
    plane: bool,
) -> None:
    largest, n = float(spheres.radius.max()), len(materials)
    room = np.array([spheres.position.min(axis=0), spheres.position.max(axis=0)])
    room += np.array([[-4.0 * largest], [4.0 * largest]])
    settings = settings_lines(room, n, SKIN * largest)
    moduli = [2.0 * one.shear_modulus * (1.0 + one.poisson_ratio) for one in materials]
    lines = [
        f"# {len(spheres.radius)} spheres, {steps} steps of {dt:.6g} s",
        *[line for line in settings if not line.startswith(("region", "create_box"))],
        f"read_data {DATA}",
        *law.pair_lines(moduli, [one.poisson_ratio for one in materials], restitution, friction),
        *([law.plane_line("plane", n, "z", 0.0)] if plane else []),
        "fix motion all nve/sphere",
        *run_lines(steps, dt),
        f"run {steps}",
        WRITE_FINAL,
    ]
    (folder / INPUT).write_text("\n".join(lines) + "\n", encoding="ascii")
    write_spheres(folder / DATA, spheres, n, room)


def _rebounds(impacts: Sequence[Impact], limit: float | None, law: ContactSettings) -> list[Rebound]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plane_input(folder, impacts, law)
        final = run_liggghts(folder, limit=limit).final
    _apart(final.position[:, 2] - final.radius)
    return [
        Rebound(v_n=float(v[2]), v_t=float(v[0]), surface_speed=float(-w[1] * r))
        for v, w, r in zip(final.velocity, final.spin, final.radius, strict=True)
    ]


def _struck(
    impacts: Sequence[Impact], target: StruckSphere, limit: float | None, law: ContactSettings
) -> list[Rebound]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        target_input(folder, impacts, target, law)
        final = run_liggghts(folder, limit=limit).final
    n = len(impacts)
    ball, hit = _part(final, slice(0, n)), _part(final, slice(n, 2 * n))
    _apart(np.linalg.norm(ball.position - hit.position, axis=1) - ball.radius - hit.radius)
    touched = hit.velocity[:, 0] + hit.radius * hit.spin[:, 1]
    return [
        Rebound(v_n=float(v[2] - u[2]), v_t=float(v[0] - speed), surface_speed=float(-w[1] * r))
        for v, u, speed, w, r in zip(ball.velocity, hit.velocity, touched, ball.spin, ball.radius, strict=True)
    ]


def _velocity(impacts: Sequence[Impact]) -> Array:
    return np.array([(i.v_t, 0.0, -i.v_n) for i in impacts])


def _spin(impacts: Sequence[Impact]) -> Array:
    return np.array([(0.0, -i.surface_speed / i.radius, 0.0) for i in impacts])


def _part(frame: SphereFrame, rows: slice) -> SphereFrame:
    return SphereFrame(
        frame.step, frame.id[rows], frame.radius[rows], frame.position[rows], frame.velocity[rows], frame.spin[rows]
    )


def _apart(gaps: Array) -> None:
    if not (gaps > 0.0).all():
        raise CommandError(f"LIGGGHTS: {int((gaps <= 0.0).sum())} of {len(gaps)} spheres still touch at the end")
