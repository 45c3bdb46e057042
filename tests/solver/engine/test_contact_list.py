"""The contact list against all pairs in NumPy: random clumps, sizes 1 : 50, anywhere in space.

An entry is a pair of member spheres of different bodies with a gap below the margins of both. Bodies are found through
a grid whose cells share buckets by a hash: the more bodies far from one another, the more cells collide.
"""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.engine.kernels.neighbours import AHEAD, LEAST, MOST
from solver.engine.state import Capacity
from solver.engine.tables import body_tables
from solver.engine.world import SUMMARY_COLUMNS, Batch
from solver.scenes.body import Body, Members
from solver.scenes.insertion import random_quaternion, rotation_matrix
from solver.scenes.material import Pair
from solver.scenes.time_step import time_step
from solver.single_body.free_world import GRAIN, ROOM, UPRIGHT, WALL, FreeWorld, scene_of, sphere

pytestmark = pytest.mark.usefixtures("taichi")

ROUNDING = 1e-9
"""A gap nearer to the margins than this [m] may be on either side: 1 km from the origin a place resolves 1e-13 m."""
DT = 1e-9
"""[s]"""
PAIRS = (Pair("grain", "grain", 0.5, 0.5), Pair("grain", "wall", 0.5, 0.5))


def random_clump(generator, size, members):
    """``members`` spheres of different radii around a centre, about ``size`` [m] across."""
    centres = generator.normal(size=(members, 3)) * 0.3 * size
    radii = size * generator.uniform(0.1, 0.5, members)
    mass, inertia = 1e3 * size**3, 1e2 * size**5
    return Members(
        tuple(map(tuple, centres.tolist())), tuple(radii.tolist()), mass, (inertia, 2 * inertia, 2 * inertia)
    )


def cloud(seed, sizes, members, spread, origin, skin, couples=False):
    """Bodies of ``sizes`` [m] scattered over ``spread`` [m] around ``origin`` [m], one by one or two and two.

    Returns the arrays after a step's build of the list, and centres, radii and bodies of all member spheres.
    """
    generator = np.random.default_rng(seed)
    bodies = tuple(
        Body(f"b{k}", "grain", 1.0 / len(sizes), random_clump(generator, size, members), GRAIN.density)
        for k, size in enumerate(sizes)
    )
    scene = scene_of(bodies, (GRAIN, WALL), PAIRS)
    scene = dataclasses.replace(scene, numerics=dataclasses.replace(scene.numerics, skin=skin))
    lab = FreeWorld(scene, range(len(bodies)), dt=DT, plate=False)
    places = origin + generator.uniform(-0.5, 0.5, (len(bodies), 3)) * spread
    if couples:
        places[1::2] = places[::2] + np.array(sizes)[::2, None] * generator.uniform(-0.5, 0.5, (len(bodies) // 2, 3))
    turns = np.array([random_quaternion(generator) for _ in bodies])
    # Margins from the least to the most; the list is built before anything moves.
    speeds = generator.uniform(0.0, 1.2, len(bodies)) * MOST * skin / (AHEAD * DT)
    for b, (place, turn, speed) in enumerate(zip(places, turns, speeds, strict=True)):
        lab.put(b, place, velocity=(speed, 0.0, 0.0), quaternion=turn)
    assert lab.run(1)["overflow"] == 0
    clumps = [body.clump for body in bodies]
    centres = [
        place + clump.centres @ rotation_matrix(turn).T
        for place, clump, turn in zip(places, clumps, turns, strict=True)
    ]
    owner = np.repeat(np.arange(len(bodies)), members)
    return lab.batch.take(0), np.concatenate(centres), np.concatenate([clump.radii for clump in clumps]), owner


def gaps(centres, radii, owner):
    """Gap [m] between every two member spheres, shape (m, m); infinite within a body, and each pair once."""
    between = np.linalg.norm(centres[:, None] - centres[None], axis=2) - radii[:, None] - radii[None]
    return np.where(owner[:, None] < owner[None], between, np.inf)


def check(arrays, centres, radii, owner, skin):
    """The list holds every pair nearer than both margins, none that is further, each once, and in order."""
    margin = arrays["body.margin"][owner]
    assert LEAST * skin <= margin.min() <= margin.max() <= MOST * skin
    reach = margin[:, None] + margin[None]
    listed = np.zeros((len(radii), len(radii)), dtype=int)
    np.add.at(listed, (arrays["contact.i"], arrays["contact.j"]), 1)
    between = gaps(centres, radii, owner)
    near = between < reach
    certain = np.abs(between - reach) > ROUNDING
    assert listed.max(initial=0) <= 1
    assert np.array_equal(listed[certain] == 1, near[certain])
    order = arrays["contact.i"].astype(np.int64) * len(radii) + arrays["contact.j"]
    assert np.all(np.diff(order) > 0)
    return int(near.sum())


SIZES = st.lists(st.floats(min_value=1e-3, max_value=5e-2), min_size=2, max_size=40)
ORIGINS = st.sampled_from([0.0, -0.0137, -1.0, -997.3, 1e3])


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    sizes=SIZES,
    members=st.integers(1, 6),
    crowding=st.floats(0.3, 8.0),
    origin=st.tuples(ORIGINS, ORIGINS, ORIGINS),
    skin=st.floats(1e-5, 5e-3),
)
def test_the_list_is_that_of_all_pairs(seed, sizes, members, crowding, origin, skin):
    """Spread over a few to a few hundred times the bodies' own volume."""
    spread = crowding * np.cbrt(np.sum(np.array(sizes) ** 3))
    check(*cloud(seed, sizes, members, spread, np.array(origin), skin), skin)


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (-1e3, -2e3, -3e3), (-21.3, 40.0, -1e4)])
@pytest.mark.parametrize(("spread", "couples"), [(0.08, False), (3.0, True)])
def test_bodies_of_very_different_sizes(origin, spread, couples):
    """60 bodies of 1 mm to 50 mm: a crowd; and couples, in a space of more cells than the hash table has buckets."""
    sizes = np.geomspace(1e-3, 5e-2, 60)[np.random.default_rng(0).permutation(60)].tolist()
    arrays, *spheres = cloud(7, sizes, 5, spread, np.array(origin), 1e-3, couples)
    assert check(arrays, *spheres, 1e-3) > 100
    assert ((spread / arrays["world.cell"]) ** 3 > 10 * ROOM.buckets) == couples


def test_the_check_sees_a_missing_and_a_foreign_entry():
    sizes = np.geomspace(1e-3, 5e-2, 20).tolist()
    arrays, *spheres = cloud(3, sizes, 4, 0.06, np.zeros(3), 1e-3)
    entries = len(arrays["contact.i"])
    assert check(arrays, *spheres, 1e-3) == entries > 10
    short = arrays | {name: np.delete(arrays[name], 5) for name in ("contact.i", "contact.j")}
    with pytest.raises(AssertionError):
        check(short, *spheres, 1e-3)
    narrow = arrays | {"body.margin": 0.9 * arrays["body.margin"]}
    with pytest.raises(AssertionError):
        check(narrow, *spheres, 0.9e-3)


@pytest.mark.parametrize("far", [0.0, -1e3])
def test_no_contact_is_missed_while_bodies_of_different_sizes_fly_into_each_other(far):
    """27 clumps of 4 to 24 mm shot at one point: after any number of steps the touching pairs are those of NumPy."""
    generator = np.random.default_rng(2)
    sizes = generator.permutation(np.geomspace(4e-3, 2.4e-2, 27))
    bodies = tuple(
        Body(f"b{k}", "grain", 1.0 / 27, random_clump(generator, size, 4), GRAIN.density)
        for k, size in enumerate(sizes)
    )
    lab = FreeWorld(scene_of(bodies, (GRAIN, WALL), PAIRS), range(27), dt=2e-6, plate=False)
    places = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3) * 0.045
    for b, place in enumerate(places):
        lab.put(b, place + far, velocity=-20.0 * place, spin=generator.normal(size=3) * 50.0)
    clumps, owner = [body.clump for body in bodies], np.repeat(np.arange(27), 4)
    radii = np.concatenate([clump.radii for clump in clumps])
    met = 0
    for _ in range(40):
        lab.run(613)
        state = lab.state()
        centres = [
            row[:3] + clump.centres @ rotation_matrix(row[3:7]).T for row, clump in zip(state, clumps, strict=True)
        ]
        arrays = lab.batch.take(0)
        touching = np.zeros((len(radii), len(radii)), dtype=bool)
        touching[arrays["contact.i"], arrays["contact.j"]] = arrays["contact.radius"] > 0.0
        between = gaps(np.concatenate(centres), radii, owner)
        # The list's contacts are those at the beginning of the last step: no point has moved by 20 µm since.
        certain = np.abs(between) > 2e-5
        assert np.array_equal(touching[certain], (between < 0.0)[certain])
        met += int((between < -2e-5).sum())
    assert met > 50
    assert lab.run(1)["rebuilds"] > 20


@pytest.mark.slow
def test_a_list_that_did_not_fit_once_is_told_though_the_next_one_fits():
    """Two spheres reach a third at once, where one entry has room, pass through, and part."""
    pairs = (Pair("grain", "grain", 0.0, 1.0), Pair("grain", "wall", 0.0, 1.0))
    scene = scene_of((sphere(),), (GRAIN, WALL), pairs)
    batch = Batch(Capacity(worlds=1, bodies=8, members=8, contacts=1))
    batch.load(0, scene, body_tables(scene, np.zeros(3, dtype=np.int32)), time_step(scene), (False,))
    for b, (x, speed) in enumerate(((-0.0102, 1.0), (0.0, 0.0), (0.0102, -1.0))):
        batch.enter(0, b, np.array([x, 0.0, 0.0]), UPRIGHT, np.array([speed, 0.0, 0.0]), np.zeros(3))
    steps = np.array([round(0.03 / time_step(scene))], dtype=np.int32)
    summary = dict(zip(SUMMARY_COLUMNS, batch.advance(steps)[0].tolist(), strict=True))
    assert summary["contacts"] == 0
    assert summary["overflow"] == 1
