"""What holds for every contact law, written once."""

import dataclasses
import importlib

import numpy as np
import pytest

from solver import pour_key
from solver.effects import EFFECTS
from solver.engine.tables import body_tables
from solver.engine.world import Batch, compiled_in, law_table
from solver.laws import CONTACT_LAWS, ContactLaw, HertzMindlin, LinearSpringDashpot
from solver.params import ParameterError
from solver.pours.parameter_ramp import RAMP_TIME, Ramp, spring_ratio
from solver.pours.run import Job, capacity_for, run_pours
from solver.scenes.contact_model import ContactModel
from solver.scenes.insertion import rotation_matrix
from solver.scenes.material_file import scene_from
from solver.scenes.scene import parameters, with_values
from solver.single_body.free_world import EARTH, FREE, GRAIN, RADIUS, ROOM, WALL, FreeWorld, grain_on_plate, sphere
from solver.verification.impacts import Impact, rebounds
from tests.solver.effects.cases import FELT, IN_KERNELS, felt, scene_with, tumble, with_effects
from tests.solver.effects.test_contracts import momenta
from tests.solver.pour_digests import digest
from tests.solver.pours.test_pour import QUICK
from tests.solver.scenes.test_material_file import mutated

pytestmark = pytest.mark.usefixtures("taichi")

LAWS = tuple(CONTACT_LAWS)
every_law = pytest.mark.parametrize("law", LAWS)


def under(law, scene, **contact):
    """``scene`` under the contact law of that name."""
    return dataclasses.replace(scene, contact=ContactModel(law=law, **contact))


def grazed(law, restitution=0.6, friction=0.5, chunk=None):
    """Two unequal spheres meet obliquely, spinning: states before and after, summaries, masses, inertias."""
    bodies = (sphere(RADIUS, name="big"), sphere(0.6 * RADIUS, name="small"))
    scene = under(law, scene_with(bodies=bodies, friction=friction, restitution=restitution))
    lab = FreeWorld(scene, (0, 1), fraction=0.02, plate=False)
    lab.put(0, (0, 0, 0), velocity=(0.3, 0.1, 0.2), spin=(10.0, 20.0, -40.0))
    lab.put(1, (0.3 * RADIUS, 0.1 * RADIUS, 1.6 * RADIUS), velocity=(0.1, 0.0, -0.6), spin=(-30.0, 5.0, 60.0))
    before, steps = lab.state(), round(0.02 / lab.dt)
    rows = [lab.run(chunk or steps) for _ in range(steps // (chunk or steps))]
    return before, lab.state(), rows, np.array([b.mass for b in bodies]), np.array([b.clump.inertia[0] for b in bodies])


@every_law
def test_a_pair_keeps_its_momentum(law):
    before, after, _, mass, inertia = grazed(law)
    assert not np.allclose(before[:, 7:10], after[:, 7:10], atol=0.1)
    for old, new in zip(momenta(before, mass, inertia), momenta(after, mass, inertia), strict=True):
        assert new == pytest.approx(old, rel=1e-9, abs=1e-13)  # rounding; both are of the order of 1e-4 … 1e-6


@every_law
def test_the_energy_account_of_an_oblique_impact_closes_at_every_moment(law):
    before, _, rows, mass, inertia = grazed(law, chunk=20)
    put_in = 0.5 * mass @ (before[:, 7:10] ** 2).sum(axis=1) + 0.5 * inertia @ (before[:, 10:13] ** 2).sum(axis=1)
    total = np.array([row["kinetic"] + row["elastic"] + row["dissipated"] for row in rows])
    assert total == pytest.approx(put_in, rel=5e-3)  # velocities of the half step before
    assert max(row["elastic"] for row in rows) > 0.1 * put_in
    assert rows[-1]["dissipated"] > 0.1 * put_in
    assert total[-1] == pytest.approx(put_in, rel=1e-3)


@every_law
def test_without_damping_and_friction_nothing_is_lost(law):
    before, after, rows, mass, _ = grazed(law, restitution=1.0, friction=0.0)
    assert rows[-1]["dissipated"] == 0.0
    kinetic = [mass @ (state[:, 7:10] ** 2).sum(axis=1) for state in (before, after)]
    assert kinetic[1] == pytest.approx(kinetic[0], rel=1e-3)  # time step


@every_law
def test_turned_with_all_that_is_there_it_gives_the_same_turned(law):
    """Three spheres that drop, roll and pile up; plane, gravity, places and velocities are turned."""
    quaternion = np.array([0.3, -0.5, 0.7, 0.4])
    quaternion /= np.linalg.norm(quaternion)
    turn = rotation_matrix(quaternion)
    expected, dt = tumble(under(law, scene_with(gravity=EARTH)))
    scene = under(law, scene_with(gravity=turn @ np.array(EARTH), turn=quaternion))
    state = tumble(scene, dt=dt, turn=turn, quaternion=quaternion)[0]
    # Rounding, 1e-16, grows with every impact and slip.
    assert state[:, :3] @ turn == pytest.approx(expected[:, :3], abs=1e-9 * RADIUS)
    assert state[:, 7:10] @ turn == pytest.approx(expected[:, 7:10], abs=1e-9)


@every_law
def test_other_units_of_mass_length_and_time_give_the_same(law):
    mass, length, time = 0.7, 3.0, 1.6
    per_volume, per_area = mass / length**3, mass / length / time**2
    grain, wall = (
        dataclasses.replace(m, density=m.density * per_volume, shear_modulus=m.shear_modulus * per_area)
        for m in (GRAIN, WALL)
    )
    expected, dt = tumble(under(law, scene_with(gravity=EARTH)))
    gravity = tuple(g * length / time**2 for g in EARTH)
    scene = scene_with(bodies=(sphere(RADIUS * length, grain),), gravity=gravity, grain=grain)
    scene = under(law, dataclasses.replace(scene, materials=(grain, wall)), characteristic_velocity=length / time)
    state = tumble(scene, dt=dt * time, scale=(length, time))[0]
    assert state[:, :3] / length == pytest.approx(expected[:, :3], abs=1e-8 * RADIUS)
    assert state[:, 7:10] * time / length == pytest.approx(expected[:, 7:10], abs=1e-8)


@every_law
@pytest.mark.parametrize("speed", [0.1, 1.0, 4.0])
def test_the_restitution_that_is_declared_comes_out_at_every_speed(law, speed):
    values = (0.05, 0.15, 0.3, 0.5, 0.8, 0.95, 1.0)
    out = rebounds([Impact(GRAIN, RADIUS, speed, restitution=e) for e in values], contact=ContactModel(law=law))
    # e = 0.15 and 0.05 lie on either branch of ζ; 2000 steps per contact.
    assert [one.v_n / speed for one in out] == pytest.approx(values, abs=1e-3)


@every_law
def test_a_contact_never_pulls(law):
    """A grain that is drawn off the plate at once feels no tension, however strong the dashpot."""
    lab = FreeWorld(under(law, grain_on_plate(restitution=0.05)), 1)
    lab.put(0, (0.0, 0.0, RADIUS - 1e-6), velocity=(0.0, 0.0, 1.0))
    lab.run(2)
    assert lab.state()[0, 9] >= 1.0


@every_law
@pytest.mark.parametrize("name", IN_KERNELS)
def test_an_effect_acts_or_is_refused_in_one_line(law, name):
    plain = under(law, scene_with(gravity=EARTH))
    values = {f"effect.{name}.{key}": number for key, number in FELT[name].items()}
    if name in CONTACT_LAWS[law].refuses:
        with pytest.raises(ParameterError, match=rf"effect\.{name}\..*does not go with contact.law {law}; allowed: 0"):
            with_values(under(law, QUICK), values)
        return
    with_values(under(law, QUICK), values)
    state, dt = tumble(plain)
    assert np.abs(tumble(with_effects(plain, felt(name)), dt=dt)[0] - state)[:, 7:10].max() > 1e-4


@pytest.mark.parametrize("law", LAWS)
def test_rolling_takes_the_tangential_stiffness_of_the_law(law):
    """Below its cap the torque spring is k_t R*² ω_r dt: after one step of a pure spin, with k_t of the law itself."""
    scene = under(law, scene_with(EFFECTS["rolling_resistance"](rolling_friction=1.0), friction=0.0, restitution=1.0))
    dt, overlap, spin = 1e-6, 1e-4, 2.0
    lab = FreeWorld(scene, 1, dt=dt)
    lab.put(0, (0.0, 0.0, RADIUS - overlap), spin=(0.0, spin, 0.0))
    lab.run(1)
    inertia = scene.bodies[0].clump.inertia[0]
    torque = inertia * (spin - lab.state()[0, 11]) / dt
    wall = scene.materials
    row = dict(
        zip(
            CONTACT_LAWS[law].columns,
            CONTACT_LAWS[law].constants(*wall, scene.pairs[1], scene.contact),
            strict=True,
        )
    )
    mass = scene.bodies[0].mass
    stiffness = {
        HertzMindlin.name: lambda: 8.0 * row["g_star"] * np.sqrt(RADIUS * overlap),
        LinearSpringDashpot.name: lambda: row["stiffness"] * (RADIUS**2 * mass) ** 0.2,
    }[law]()
    assert torque == pytest.approx(stiffness * RADIUS**2 * spin * dt, rel=1e-6)


@every_law
def test_a_running_pile_approaches_stiffness_and_damping_and_takes_friction_at_once(law):
    """Four times G: halfway twice the modulus, and springs that keep their displacement pull as k_t grows."""
    stiff = dataclasses.replace(GRAIN, shear_modulus=4.0 * GRAIN.shear_modulus)
    before, after = (
        law_table(under(law, grain_on_plate(grain=grain, friction=mu))) for grain, mu in ((GRAIN, 0.3), (stiff, 0.6))
    )
    kind = CONTACT_LAWS[law]
    ramp = Ramp(kind, before, after, 1.0)
    half = dict(zip(kind.columns, ramp.table(1.0 + 0.5 * RAMP_TIME)[0, 0], strict=True))
    assert half["e_star"] == pytest.approx(2.0 * before[0, 0, kind.columns.index("e_star")])
    assert half["friction"] == 0.6
    assert np.array_equal(ramp.table(1.0 + RAMP_TIME), after)
    grown = {HertzMindlin.name: 4.0, LinearSpringDashpot.name: 4.0**0.8}[law]
    assert spring_ratio(kind, before, after)[0, 0] == pytest.approx(grown)


SMALL = with_values(QUICK, {"rig.mass": "4g"})


@pytest.mark.slow
def test_pours_of_two_laws_run_side_by_side_with_the_bits_that_each_has_alone():
    scenes = [under(law, SMALL) for law in LAWS]
    jobs = [Job(scene, seed) for seed in (1, 2) for scene in scenes]
    together = dict(run_pours(jobs, worlds=2))
    assert len({digest(record) for record in together.values()}) == len(jobs)
    for k, job in enumerate(jobs):
        assert digest(dict(run_pours([job], worlds=1))[0]) == digest(together[k])
    with pytest.raises(ValueError, match=r"contact\.law: .* cannot share a batch"):
        capacity_for(scenes, 1)


def test_a_batch_takes_scenes_of_its_own_law_only():
    batch, other = Batch(ROOM), under(LinearSpringDashpot.name, grain_on_plate())
    with pytest.raises(ValueError, match=r"contact\.law: the batch was made for hertz_mindlin"):
        batch.load(0, other, body_tables(other, np.zeros(1, dtype=np.int32)), 1e-5, (True,))


def test_a_material_file_names_its_law_in_either_place(tmp_path):
    name = LinearSpringDashpot.name

    def law_of(**more):
        return scene_from(mutated(contact_law=None) | more, tmp_path / "m.toml").contact.law

    assert law_of() == HertzMindlin.name
    assert law_of(contact_law=name) == law_of(contact={"law": name}) == law_of(contact_law=name, contact={"law": name})
    assert law_of(contact_law=name, contact={"tangential_dashpot": "uncapped"}) == name
    with pytest.raises(ParameterError, match="contact_law: 'hertz_mindlin' is not the 'linear_spring_dashpot'"):
        law_of(contact_law=HertzMindlin.name, contact={"law": name})
    with pytest.raises(ParameterError, match="contact_law: 'jkr' is not one of hertz_mindlin, linear_spring_dashpot"):
        law_of(contact_law="jkr")


class Softer(LinearSpringDashpot):
    """A law of somebody else: half the stiffness."""

    name = "softer"

    @staticmethod
    def constants(*declared):
        e_star, stiffness, friction, damping = LinearSpringDashpot.constants(*declared)
        return e_star, 0.5 * stiffness, friction, damping


@pytest.fixture
def softer(monkeypatch):
    """The scene ``SMALL`` under a law that is not of this program."""
    monkeypatch.setitem(CONTACT_LAWS.things, Softer.name, Softer)
    return under(Softer.name, SMALL)


def test_a_law_of_a_package_is_compiled_like_any_other(softer):
    """Deeper by √2 at the same speed."""
    depths = []
    for law in (LinearSpringDashpot.name, Softer.name):
        scene = under(law, grain_on_plate(restitution=1.0, friction=0.0, gravity=FREE))
        lab = FreeWorld(scene, 1, dt=1e-6)
        lab.put(0, (0.0, 0.0, RADIUS), velocity=(0.0, 0.0, -1.0))
        heights = []
        while not heights or lab.state()[0, 9] < 0.0:
            lab.run(1)
            heights.append(lab.state()[0, 2])
        depths.append(RADIUS - min(heights))
    assert depths[1] / depths[0] == pytest.approx(np.sqrt(2.0), rel=1e-3)
    assert compiled_in([softer])["law"] == Softer.name


def test_the_package_of_a_law_is_in_the_key_of_a_pour(softer, monkeypatch):
    keys = set()
    for version in ("", "grains 1.0", "grains 1.1"):
        # The module, not the function of its name that the package exports.
        module = importlib.import_module("solver.pours.pour_key")
        monkeypatch.setattr(module, "origin", lambda kind, name, version=version: version)
        keys.add(pour_key(softer, 1))
    assert len(keys) == 3


def test_what_is_no_law_is_none():
    assert issubclass(CONTACT_LAWS[HertzMindlin.name], ContactLaw)
    assert parameters(QUICK)["contact.law"].choices == LAWS
    with pytest.raises(ParameterError, match=r"contact\.law: 'hooke' is not one of hertz_mindlin"):
        with_values(QUICK, {"contact.law": "hooke"})
