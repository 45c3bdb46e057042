"""Meshes of closed form for tests, in millimetres."""

import numpy as np
import trimesh


def ring(major=10.0, minor=3.0, sections=64):
    """A torus about z."""
    return trimesh.creation.torus(major, minor, major_sections=sections, minor_sections=sections // 2)


def bent_rod(bend=20.0, radius=3.0, angle=0.75 * np.pi, sections=48, sides=24):
    """A rod of circular section along an arc, with flat ends."""
    turn, around = np.linspace(0.0, angle, sections), np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    outward = np.stack([np.cos(turn), np.sin(turn), np.zeros(sections)], axis=1)
    rim = bend * outward[:, None] + radius * (
        np.cos(around)[None, :, None] * outward[:, None] + np.sin(around)[None, :, None] * [0.0, 0.0, 1.0]
    )
    vertices = np.concatenate([rim.reshape(-1, 3), bend * outward[[0, -1]]])
    k = np.arange(sides)
    following = (k + 1) % sides
    faces = [np.stack([np.full(sides, len(vertices) - 2), following, k], axis=1)]
    for low in range(0, (sections - 1) * sides, sides):
        faces.append(np.stack([low + k, low + following, low + following + sides], axis=1))
        faces.append(np.stack([low + k, low + following + sides, low + k + sides], axis=1))
    last = (sections - 1) * sides
    faces.append(np.stack([np.full(sides, len(vertices) - 1), last + k, last + following], axis=1))
    mesh = trimesh.Trimesh(vertices, np.concatenate(faces), process=False)
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


def angle_bar(length=30.0, height=26.0, width=6.0):
    """An L of square bars."""
    outline = [[0, 0], [length, 0], [length, width], [width, width], [width, height], [0, height]]
    bottom, top = (np.column_stack([outline, np.full(6, z)]) for z in (0.0, width))
    caps = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    faces = [(c, b, a) for a, b, c in caps] + [(a + 6, b + 6, c + 6) for a, b, c in caps]
    for i in range(6):
        j = (i + 1) % 6
        faces += [(i, j, j + 6), (i, j + 6, i + 6)]
    return trimesh.Trimesh(np.concatenate([bottom, top]), faces)


def crossed_boxes():
    """A cross of two bars as one closed surface that cuts through itself."""
    return trimesh.util.concatenate([trimesh.creation.box((20, 4, 4)), trimesh.creation.box((4, 20, 5))])


def saved(mesh, path):
    """The mesh or scene in a file; returns its path."""
    mesh.export(path)
    return path
