"""What tests of the statistics share: plate tests of spheres by closed forms, in place of the simulated ones."""

import math

import pytest

from solver import actual, value


def by_formula(asked):
    """The numbers of plate tests of spheres."""
    return [_number(one.name, one.scene, one.body) for one in asked]


def _number(name, scene, of):
    body = next(one for one in actual(scene).bodies if one.name == of)
    pair = scene.contact_pair(body, scene.rig.wall)
    if name == "restitution":
        return pair.restitution * (1.0 - 0.8 * value(scene, "effect.plastic_contact.plasticity"))
    work = value(scene, "effect.adhesion_jkr.work_of_adhesion") + value(scene, "effect.wall_adhesion.work_of_adhesion")
    pull_off = 1.5 * math.pi * work * 0.5 * max(body.extents)
    friction = pair.static_friction * (1.0 + 2.0 * pull_off / (body.mass * 9.81))
    drop = value(scene, "effect.kinetic_friction.friction_drop") if name == "apparent_kinetic_friction" else 0.0
    return friction * (1.0 - drop)


@pytest.fixture
def plates(monkeypatch):
    """Plate tests that take no time: of JKR adhesion, kinetic friction and plastic contacts."""
    monkeypatch.setattr("solver.plate_tests", by_formula, raising=False)
