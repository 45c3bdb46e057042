"""What is kept of a finished pour: enough to read every observable again, even a new one, without pouring.

A raw pour is a compressed NumPy archive (``.npz``):

    head                                JSON text: format, physics, how the motion ended (outcome and message), seed,
                                        times, rig, and the bodies by the member spheres that they were poured with
    component, inside, in_pile (n,)     of the n bodies that entered: which component, whether they are still in the
                                        domain, whether they belong to the pile
    mass, scale (n,)                    [kg], linear size relative to the declared one
    position (n, 3)                     centres of mass, in units of ``LENGTH``
    quaternion (n, 4)                   orientation wxyz, in units of ``TURN``
    clock (k, 3)                        time [s], entered and discharged mass [kg]
    curves (k, 9)                       the other curves of `solver.pours.record.Trace`, in the order of ``CURVES``
    surface_time (m,), surface_x (c,), surface (m, c)    free surface of a rig that records one: moments [s], places
                                        [m]; heights in units of ``LENGTH``, ``HOLE`` where there is no bed, as
                                        differences along a row

Lengths are rounded to 0.01 mm, 1/25 of a pixel of the silhouettes. Velocities, the way bodies entered, and the scene's
materials, feed and numerics are not kept; the parameters of the scene are stored beside its raw pour.
"""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
import numpy.typing as npt

from solver.npz import npz_arrays
from solver.observables.heap import told
from solver.params import declared
from solver.pours.record import Bodies, FreeSurface, Outcome, Record, Trace
from solver.pours.record_builder import entries_of, measured_from, member_spheres, pile_of
from solver.rigs import RIGS, PourRig
from solver.scenes.body import Body, Members
from solver.scenes.scene import Scene, pour_rig
from solver.version import PHYSICS

FORMAT = 1
LENGTH = 1e-5
"""Unit of the stored lengths [m]."""
TURN = 1.0 / 32767
"""Unit of the components of a quaternion."""
HOLE = -(2**31) // 2
CURVES = (
    "kinetic_energy",
    "contacts",
    "max_overlap",
    "potential_energy",
    "elastic_energy",
    "dissipated_energy",
    "wall_work",
    "taken_out_energy",
    "supplied_energy",
)


class RawPourError(ValueError):
    """Bytes that are not a raw pour of a known format; the message is one line, fit for a user."""


def packed(record: Record) -> bytes:
    """Return the raw pour of ``record``: some 10 kB, or 150 kB with a free surface."""
    bodies, trace, surface = record.bodies, record.trace, record.free_surface
    head = {
        "format": FORMAT,
        "physics": PHYSICS,
        **{name: getattr(record, name) for name in ("seed", "gate_opened", "poured_mass", "dt", "steps", "wall_s")},
        "outcome": str(record.ended[0]),
        "message": record.ended[1],
        "title": record.scene.title,
        "axis": record.scene.axis,
        "rig": _of_rig(pour_rig(record.scene)),
        "bodies": [_of_body(body) for body in record.scene.bodies],
    }
    arrays: dict[str, npt.NDArray[Any]] = {
        "head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8),
        "component": bodies.component.astype(np.int16),
        "inside": bodies.inside,
        "in_pile": record.in_pile,
        "mass": bodies.mass,
        "scale": bodies.scale,
        "position": np.rint(bodies.position / LENGTH).astype(np.int32),
        "quaternion": np.rint(bodies.quaternion / TURN).astype(np.int16),
        "clock": np.column_stack([trace.time, trace.entered_mass, trace.discharged_mass]),
        "curves": np.column_stack([getattr(trace, name) for name in CURVES]).astype(np.float32),
    }
    if surface is not None:
        heights = np.where(np.isfinite(surface.height), np.rint(surface.height / LENGTH), HOLE).astype(np.int32)
        arrays |= {"surface_time": surface.time, "surface_x": surface.x, "surface": np.diff(heights, axis=1, prepend=0)}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def unpacked(raw: bytes) -> Record:
    """Return the record of a raw pour, from which observables read the same numbers every time.

    Its outcome follows from how the motion ended and from the pile that it left (``observables/heap.py``). Its scene
    holds the rig and the bodies by their member spheres; velocities are NaN and no entries are listed. Raises
    RawPourError for bytes that are not a raw pour, or one of another format or of an unknown rig.
    """
    try:
        return _unpacked(raw)
    except RawPourError:
        raise
    except (AttributeError, LookupError, TypeError, ValueError, OverflowError, RecursionError) as error:
        raise RawPourError(f"not a raw pour, or damaged ({error})") from error


def _unpacked(raw: bytes) -> Record:
    arrays = npz_arrays(raw)
    head = json.loads(bytes(arrays["head"]))
    if head.get("format") != FORMAT:
        raise RawPourError(f"a raw pour of format {head.get('format')!r}; this program reads {FORMAT}")
    scene = Scene(
        head["title"], (), tuple(map(_body_of, head["bodies"])), (), _rig_of(head["rig"]), axis=tuple(head["axis"])
    )
    n = len(arrays["mass"])
    quaternion = arrays["quaternion"] * TURN
    bodies = Bodies(
        component=arrays["component"].astype(np.int32),
        component_names=tuple(body.name for body in scene.bodies),
        mass=arrays["mass"],
        scale=arrays["scale"],
        position=arrays["position"] * LENGTH,
        quaternion=quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True),
        velocity=np.full((n, 3), np.nan),
        inside=arrays["inside"],
    )
    spheres = member_spheres(scene, bodies)
    pile = measured_from(pile_of(bodies, spheres, arrays["in_pile"]), scene.axis)
    ended = Outcome(head["outcome"]), head["message"]
    outcome, message = told(pour_rig(scene), ended, pile)
    return Record(
        scene=scene,
        seed=head["seed"],
        outcome=outcome,
        message=message,
        ended=ended,
        bodies=bodies,
        spheres=spheres,
        in_pile=arrays["in_pile"],
        pile=pile,
        trace=_trace_of(arrays),
        entries=entries_of(bodies.component, []),
        gate_opened=head["gate_opened"],
        poured_mass=head["poured_mass"],
        dt=head["dt"],
        steps=head["steps"],
        wall_s=head["wall_s"],
        free_surface=_surface_of(arrays),
    )


def _trace_of(arrays: dict[str, npt.NDArray[Any]]) -> Trace:
    time, entered, discharged = arrays["clock"].T.copy()
    curves = dict(zip(CURVES, arrays["curves"].T.astype(np.float64), strict=True))
    contacts = curves.pop("contacts").astype(np.int32)
    return Trace(time=time, entered_mass=entered, discharged_mass=discharged, contacts=contacts, **curves)


def _surface_of(arrays: dict[str, npt.NDArray[Any]]) -> FreeSurface | None:
    if "surface" not in arrays:
        return None
    heights = np.cumsum(arrays["surface"], axis=1)
    height = np.where(heights == HOLE, np.nan, heights * LENGTH)
    return FreeSurface(time=arrays["surface_time"], x=arrays["surface_x"], height=height)


def _of_rig(rig: PourRig) -> dict[str, Any]:
    names = (path.split(".")[1] for path in declared(rig, "rig"))
    return {"name": rig.name, "wall": rig.wall} | {name: getattr(rig, name) for name in names}


def _rig_of(kept: dict[str, Any]) -> PourRig:
    values = {name: value for name, value in kept.items() if name != "name"}
    try:
        return RIGS[kept["name"]](**values)
    except (KeyError, TypeError):
        known = ", ".join(RIGS)
        raise RawPourError(f"a raw pour in the rig {kept['name']!r} with {sorted(values)}; known: {known}") from None


def _of_body(body: Body) -> dict[str, Any]:
    clump = body.clump
    return {
        "name": body.name,
        "material": body.material,
        "mass_fraction": body.mass_fraction,
        "density": body.density,
        "centres": clump.centres.tolist(),
        "radii": clump.radii.tolist(),
        "mass": clump.mass,
        "inertia": clump.inertia.tolist(),
    }


def _body_of(kept: dict[str, Any]) -> Body:
    centres = tuple(map(tuple, kept["centres"]))
    shape = Members(centres, tuple(kept["radii"]), kept["mass"], tuple(kept["inertia"]), kept["density"])
    return Body(kept["name"], kept["material"], kept["mass_fraction"], shape, kept["density"])
