"""Where a step calls the effects: contact effects stage by stage, body effects on every body that moves.

Compiled in only for batches whose capacity has ``effects``; where an effect's first amplitude is zero, it is skipped.
Parameters of a contact effect are in its columns of ``effect.row`` (by contact class), what a contact keeps is in its
columns of ``memory.number``.
"""

from solver.backend import ti
from solver.effects.columns import BODY_EFFECTS, COLUMNS, CONTACT_EFFECTS, COUPLE, HERTZ, KEPT, MEMORIES, MEMORY, WIDTHS
from solver.effects.touch import Flight
from solver.engine.kernels.geometry import rotation
from solver.engine.state import Vec3

CONTACT_ACTS = tuple(kind.act for kind in CONTACT_EFFECTS)
BODY_ACTS = tuple(kind.act for kind in BODY_EFFECTS)


@ti.func
def pass_stage(s: ti.template(), w, k, touch, stage: ti.template(), still):
    """``touch`` (entry ``k`` of the list) after the effects of one stage; if ``still``, their memory is unchanged."""
    for index in ti.static(range(len(CONTACT_EFFECTS))):
        if ti.static(CONTACT_EFFECTS[index].stage == stage):
            row = s.contact.law[w, k]
            if s.effect.row[w, row, ti.static(COLUMNS[index])] != 0.0:
                p = ti.Vector([s.effect.row[w, row, COLUMNS[index] + d] for d in ti.static(range(WIDTHS[index]))])
                if ti.static(MEMORIES[index] > 0):
                    m = ti.Vector([s.memory.number[w, k, MEMORY[index] + d] for d in ti.static(range(MEMORIES[index]))])
                    touch, m = CONTACT_ACTS[index](p, m, touch)
                    if not still:
                        for d in ti.static(range(MEMORIES[index])):
                            s.memory.number[w, k, ti.static(MEMORY[index] + d)] = m[d]
                else:
                    touch, _ = CONTACT_ACTS[index](p, Vec3(0.0, 0.0, 0.0), touch)
    return touch


@ti.func
def forget(s: ti.template(), w, k):
    """Clear what effects keep of entry ``k``, whose surfaces have separated."""
    for column in ti.static(range(KEPT)):
        s.memory.number[w, k, column] = 0.0


@ti.func
def last_couple(s: ti.template(), w, k):
    """Torque [N m] of the effects on the first body of entry ``k`` at the last step."""
    return Vec3(s.memory.number[w, k, COUPLE], s.memory.number[w, k, COUPLE + 1], s.memory.number[w, k, COUPLE + 2])


@ti.func
def keep(s: ti.template(), w, k, torque, hertz):
    """Store what the energy account needs of entry ``k``: torque [N m] and contact radius without adhesion [m]."""
    for d in ti.static(range(3)):
        s.memory.number[w, k, ti.static(COUPLE + d)] = torque[d]
    s.memory.number[w, k, HERTZ] = hertz


@ti.func
def body_force(s: ti.template(), w, b):
    """Force [N] of the body effects on body ``b``; their parameters are in the row of the first contact class."""
    force = Vec3(0.0, 0.0, 0.0)
    for index in ti.static(range(len(BODY_EFFECTS))):
        column = ti.static(COLUMNS[len(CONTACT_EFFECTS) + index])
        if s.effect.row[w, 0, column] != 0.0:
            p = ti.Vector(
                [s.effect.row[w, 0, column + d] for d in ti.static(range(WIDTHS[len(CONTACT_EFFECTS) + index]))]
            )
            flight = Flight(
                velocity=s.body.velocity[w, b],
                rotation=rotation(s.body.quaternion[w, b]),
                semi_axes=s.body.semi_axes[w, b],
                diameter=s.body.diameter[w, b],
                drag_factors=s.body.drag_factors[w, b],
            )
            force += BODY_ACTS[index](p, flight)
    return force
