"""Plate tests of single bodies against closed forms."""

import math
import os
import select
import subprocess
import sys
from concurrent.futures.process import BrokenProcessPool

import pytest
from scipy.optimize import brentq

from solver import PlateTest, load_material, plate_tests, with_values
from solver.scenes.material import effective_youngs_modulus
from solver.scenes.material_file import with_settings
from solver.single_body.plate_tests import NOTHING, PLATE_TESTS, plate_test
from tests.explorer.beads import GLASS, MASS, RADIUS, STEEL, bead_scene

STATIC, KINETIC, RESTITUTION = PLATE_TESTS
FRICTION, E = 0.4, 0.6
WEIGHT = MASS * 9.81


@pytest.fixture
def bead(taichi):
    return with_settings(bead_scene(), {"pair.bead.steel.static_friction": FRICTION, "pair.bead.steel.restitution": E})


def measured(scene, name, **effects):
    """``effects``: name of an effect's parameter, "__" for a point, and its value."""
    values = {f"effect.{path.replace('__', '.')}": x for path, x in effects.items()}
    return plate_test(PlateTest(with_values(scene, values), "bead", name))


def test_without_effects_they_are_what_is_declared(bead):
    assert measured(bead, STATIC) == pytest.approx(FRICTION, rel=2e-3)
    assert measured(bead, KINETIC) == pytest.approx(FRICTION, rel=1e-3)
    # Gravity acts during the contact as well.
    assert measured(bead, RESTITUTION) == pytest.approx(E, rel=2e-3)


@pytest.mark.parametrize("effect", ["adhesion_jkr__work_of_adhesion", "wall_adhesion__work_of_adhesion"])
def test_adhesion_makes_a_body_heavier_by_twice_its_pull_off_force(bead, effect):
    """μ (W + 2 F_c)/W, F_c = 3/2 π w R (Thornton 1991, doi 10.1088/0022-3727/24/11/007)."""
    work = 2.0
    wanted = FRICTION * (1.0 + 2.0 * 1.5 * math.pi * work * RADIUS / WEIGHT)
    assert wanted > 1.5 * FRICTION
    assert measured(bead, STATIC, **{effect: work}) == pytest.approx(wanted, rel=3e-3)
    assert measured(bead, KINETIC, **{effect: work}) == pytest.approx(wanted, rel=3e-3)


def test_cohesion_that_grows_with_the_area_pulls_at_the_overlap_that_it_makes(bead):
    """4/3 E* √R δ^1.5 − k 2π R δ = W, and the Coulomb limit counts the Hertzian force."""
    k = 2e6
    stiffness = 4.0 / 3.0 * effective_youngs_modulus(GLASS, STEEL) * math.sqrt(RADIUS)
    pull = 2.0 * math.pi * RADIUS * k
    overlap = brentq(lambda d: stiffness * d**1.5 - pull * d - WEIGHT, (pull / stiffness) ** 2, 1e-3)
    wanted = FRICTION * stiffness * overlap**1.5 / WEIGHT
    assert wanted > 1.2 * FRICTION
    assert measured(bead, STATIC, adhesion_sjkr__cohesion_energy_density=k) == pytest.approx(wanted, rel=5e-3)


def test_kinetic_friction_is_seen_where_a_body_slides(bead):
    """μ_k = (1 − d) μ_s well above the speed of transition, 1 cm/s."""
    found = measured(bead, KINETIC, kinetic_friction__friction_drop=0.4)
    assert found == pytest.approx(0.6 * FRICTION, rel=0.01)
    # Some slip there is before it slides.
    assert measured(bead, STATIC, kinetic_friction__friction_drop=0.4) == pytest.approx(FRICTION, rel=0.02)


def test_restitution_that_falls_with_speed_is_that_of_the_impact(bead):
    """1 − e(v) = (1 − e) [1 + q (v^{1/5} − 1)] at v = √(2 g h), 1.98 m/s."""
    speed = math.sqrt(2.0 * 9.81 * 0.2)
    wanted = 1.0 - (1.0 - E) * (1.0 + 2.0 * (speed**0.2 - 1.0))
    assert measured(bead, RESTITUTION, velocity_dependent_restitution__speed_sensitivity=2.0) == pytest.approx(
        wanted, rel=5e-3
    )
    # At rest its contacts hardly damp; the body gets its weight gradually and does not swing.
    assert measured(bead, STATIC, velocity_dependent_restitution__speed_sensitivity=2.0) == pytest.approx(
        FRICTION, rel=0.01
    )


def test_a_tilted_pile_leaves_the_bench_level(bead):
    for name in PLATE_TESTS:
        assert measured(bead, name, plate_tilt__tilt_x=8.0) == pytest.approx(measured(bead, name), rel=1e-9)


def test_a_smooth_plate_holds_nothing(bead):
    smooth = with_settings(bead, {"pair.bead.steel.static_friction": 0.0})
    assert measured(smooth, STATIC) == NOTHING
    assert measured(smooth, KINETIC) == pytest.approx(NOTHING, abs=1e-3)


def test_a_clump_lies_on_several_spheres_and_slides_by_one_friction(taichi):
    scene = with_settings(load_material("sunflower_extract"), {"body.spheres": "coarse"})
    found = plate_test(PlateTest(scene, "petiole", STATIC))
    assert found == pytest.approx(0.78, rel=0.01)


def test_tests_run_in_processes_of_their_own_and_once(monkeypatch):
    scene = with_settings(bead_scene(), {"pair.bead.steel.static_friction": 0.37})
    asked = [PlateTest(scene, "bead", name) for name in (KINETIC, RESTITUTION, KINETIC)]
    first = plate_tests(asked)
    assert first[0] == first[2] == pytest.approx(0.37, rel=1e-3)
    monkeypatch.setattr("solver.single_body.plate_tests._workers", lambda: pytest.fail("they were run before"))
    assert plate_tests(asked) == first


class Pool:
    """Stands for the processes: ``results`` of its tests, or an error."""

    _processes = None

    def __init__(self, results):
        self.results, self.ended = results, False

    def map(self, function, tests):
        if isinstance(self.results, Exception):
            raise self.results
        return self.results

    def shutdown(self, **how):
        self.ended = True


def test_tests_begin_again_where_a_process_was_killed_but_only_once(monkeypatch):
    def pools(*results):
        made = [Pool(one) for one in results]
        given = iter(made)
        workers = lambda: next(given)  # noqa: E731
        workers.cache_clear = lambda: None
        monkeypatch.setattr("solver.single_body.plate_tests._workers", workers)
        return made

    def asked(friction):
        scene = with_settings(bead_scene(), {"pair.bead.steel.static_friction": friction})
        return [PlateTest(scene, "bead", KINETIC)]

    lost, _ = pools(BrokenProcessPool(), [0.361])
    assert plate_tests(asked(0.361)) == [0.361]
    assert lost.ended
    pools(BrokenProcessPool(), BrokenProcessPool())
    with pytest.raises(BrokenProcessPool):
        plate_tests(asked(0.362))
    pools([0.362])
    assert plate_tests(asked(0.362)) == [0.362]


KILLED = """
import multiprocessing as mp, os, signal, sys
from solver import PlateTest, plate_tests
from tests.explorer.beads import bead_scene

def test(name):
    return plate_tests([PlateTest(bead_scene(), "bead", name)])

test("restitution")
for child in mp.active_children():
    os.kill(child.pid, signal.SIGKILL)
print(*test("apparent_static_friction"), *test("apparent_kinetic_friction"))
print(*[child.pid for child in mp.active_children()], flush=True)
sys.stdin.read()
"""


@pytest.mark.slow
def test_a_killed_process_is_replaced_and_none_outlives_the_one_in_charge():
    with subprocess.Popen(
        [sys.executable, "-c", KILLED], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as program:
        said = program.stdout.readline().split()
        assert [float(x) for x in said] == pytest.approx([0.3, 0.3], rel=3e-3)
        children = [os.pidfd_open(int(pid)) for pid in program.stdout.readline().split()]
        assert children
        program.kill()
    for child in children:
        assert select.select([child], [], [], 60.0)[0], "a process outlives the one in charge"
