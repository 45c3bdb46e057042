"""Fields of a world into one row of numbers and back, in one launch per group of fields.

``width`` is the number of columns that an entry of the group takes, ``first`` the number in the row where it begins.
"""

from solver.backend import serial, ti

Row = ti.types.ndarray(dtype=ti.f64, ndim=1)


@ti.kernel
def pack(fields: ti.template(), w: ti.i32, entries: ti.i32, width: ti.i32, first: ti.i32, row: Row):
    """Write the first ``entries`` entries of ``fields`` (of shape (worlds, …)) into ``row``."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(entries):
        at = first + k * width
        for field in ti.static(fields):
            if ti.static(hasattr(field, "n")):
                for i, j in ti.static(ti.ndrange(field.n, field.m)):
                    if ti.static(field.m == 1):
                        row[at] = field[w, k][i]
                    else:
                        row[at] = field[w, k][i, j]
                    at += 1
            else:
                row[at] = ti.cast(field[w, k], ti.f64)
                at += 1


@ti.kernel
def unpack(fields: ti.template(), w: ti.i32, entries: ti.i32, width: ti.i32, first: ti.i32, row: Row):
    """Take back what :func:`pack` wrote."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(entries):
        at = first + k * width
        for field in ti.static(fields):
            if ti.static(hasattr(field, "n")):
                for i, j in ti.static(ti.ndrange(field.n, field.m)):
                    if ti.static(field.m == 1):
                        field[w, k][i] = row[at]
                    else:
                        field[w, k][i, j] = row[at]
                    at += 1
            else:
                field[w, k] = ti.cast(row[at], field.dtype)
                at += 1


@ti.kernel
def pack_world(fields: ti.template(), w: ti.i32, row: Row):
    """Write what a world has once (``fields`` of shape (worlds,)) into the beginning of ``row``."""
    ti.loop_config(serialize=ti.static(serial()))
    for world in range(w, w + 1):
        at = 0
        for field in ti.static(fields):
            if ti.static(hasattr(field, "n")):
                for i in ti.static(range(field.n)):
                    row[at] = field[world][i]
                    at += 1
            else:
                row[at] = ti.cast(field[world], ti.f64)
                at += 1


@ti.kernel
def unpack_world(fields: ti.template(), w: ti.i32, row: Row):
    """Take back what :func:`pack_world` wrote."""
    ti.loop_config(serialize=ti.static(serial()))
    for world in range(w, w + 1):
        at = 0
        for field in ti.static(fields):
            if ti.static(hasattr(field, "n")):
                for i in ti.static(range(field.n)):
                    field[world][i] = row[at]
                    at += 1
            else:
                field[world] = ti.cast(row[at], field.dtype)
                at += 1


@ti.kernel
def pack_memory(number: ti.template(), w: ti.i32, entries: ti.i32, first: ti.i32, row: Row):
    """Write what effects keep of the first ``entries`` contacts (``number`` of shape (worlds, contacts, columns))."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(entries):
        for column in range(number.shape[2]):
            row[first + k * number.shape[2] + column] = number[w, k, column]


@ti.kernel
def unpack_memory(number: ti.template(), w: ti.i32, entries: ti.i32, first: ti.i32, row: Row):
    """Take back what :func:`pack_memory` wrote."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(entries):
        for column in range(number.shape[2]):
            number[w, k, column] = row[first + k * number.shape[2] + column]
