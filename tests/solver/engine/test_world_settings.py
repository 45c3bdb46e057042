"""What a world is set up with arrives in the field of its name."""

from dataclasses import replace

import numpy as np
import pytest

from solver.engine.kernels.neighbours import MOST
from solver.engine.kernels.transfer import SETTINGS
from solver.engine.tables import body_tables
from solver.engine.world import Batch
from solver.rigs import Funnel
from solver.scenes.material import Pair
from solver.single_body.free_world import GRAIN, ROOM, WALL, FreeWorld, grain_on_plate, scene_of, sphere

pytestmark = pytest.mark.usefixtures("taichi")

DT = 1.25e-5
CONVENTIONS = {"clump_rule": "local_mass", "tangential_law": "mindlin", "tangential_dashpot": "uncapped"}
"""Second choice of each convention of the contact law."""
GRAVITY = (0.5, -1.5, -9.0)


def test_every_setting_arrives_in_its_own_field():
    scene = grain_on_plate(gravity=GRAVITY)
    scene = replace(
        scene,
        rig=Funnel(outlet_height=0.07, inlet_diameter=0.13, domain_half_width=0.31, wall="wall"),
        numerics=replace(scene.numerics, skin=1.5e-4, sleep_speed=2.5e-4, sleep_time=0.0125),
    )
    bodies = body_tables(scene, np.zeros(3, dtype=np.int32))
    batch = Batch(ROOM)
    batch.load(0, scene, bodies, DT, (True,) * len(scene.rig.surfaces()))
    world = {name.removeprefix("world."): values for name, values in batch.take(0).items() if name.startswith("world.")}
    inside = scene.rig.container(0.0)
    expected = {
        "dt": DT,
        "skin": 1.5e-4,
        "cell": 2.0 * bodies.numbers[0, 4] + 2.0 * MOST * 1.5e-4,
        "sleep_speed": 2.5e-4,
        "sleep_time": 0.0125,
        "domain": 0.31,
        "outlet": inside.height,
        "inlet_radius": inside.radius,
        "clump_rule": 0.0,
        "tangential_law": 0.0,
        "tangential_dashpot": 0.0,
    }
    # Or two could change places unseen; the three that name a choice have a test of their own.
    assert len({float(value) for value in expected.values()}) == len(expected) - len(CONVENTIONS) + 1
    assert set(SETTINGS) == {*expected, "gravity"}
    assert {name: float(world[name]) for name in expected} == expected
    assert tuple(world["gravity"]) == GRAVITY


@pytest.mark.parametrize("name", CONVENTIONS)
def test_a_convention_of_the_contact_law_arrives_in_its_own_field(name):
    scene = grain_on_plate()
    scene = replace(scene, contact=replace(scene.contact, **{name: CONVENTIONS[name]}))
    batch = Batch(ROOM)
    batch.load(0, scene, body_tables(scene, np.zeros(1, dtype=np.int32)), DT, (True,))
    world = batch.take(0)
    assert {one: int(world[f"world.{one}"]) for one in CONVENTIONS} == {one: int(one == name) for one in CONVENTIONS}


def test_a_scene_of_more_contact_classes_than_the_batch_has_is_refused():
    """Its rows of the law table would be written past the end."""
    ball = sphere()
    many = tuple(replace(ball, name=f"b{k}") for k in range(ROOM.kinds))
    scene = scene_of(many, (GRAIN, WALL), (Pair("grain", "grain", 0.3, 0.5), Pair("grain", "wall", 0.3, 0.5)))
    bodies = body_tables(scene, np.zeros(3, dtype=np.int32))
    with pytest.raises(ValueError, match=f"{ROOM.kinds + 1} kinds do not fit into a batch of {ROOM.kinds}"):
        Batch(ROOM).load(0, scene, bodies, DT, (True,) * len(scene.rig.surfaces()))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_overlap_of_unequal_spheres_is_a_share_of_the_smaller_one(order):
    """1 mm by 0.2 mm into 20 mm: 0.2, whichever entered first (it was 0.01 where the large one did)."""
    radii, deep = (20e-3, 1e-3), 0.2e-3
    bodies = tuple(sphere(radius, name=f"r{radius:g}") for radius in radii)
    pairs = (Pair("grain", "grain", 0.3, 0.5), Pair("grain", "wall", 0.3, 0.5))
    lab = FreeWorld(scene_of(bodies, (GRAIN, WALL), pairs), order, plate=False)
    for b, kind in enumerate(order):
        lab.put(b, (kind * (sum(radii) - deep), 0.0, 0.5))
    assert lab.run(1)["overlap"] == pytest.approx(0.2, rel=1e-6)
