"""The bench tests return what was put in: atan μ, e, E* and G*."""

import dataclasses
import math

import numpy as np
import pytest

from solver.params import ParameterError
from solver.rigs import BENCH_RIGS
from solver.scenes.material_file import load_material, with_settings
from solver.single_body import BENCH_TESTS, compression, run_bench_test
from solver.single_body.drop_plate_45 import PlateRebound, paper_estimate, restitution
from tests.explorer.beads import GLASS, MASS, STEEL, bead_scene
from tests.explorer.beads import RADIUS as BEAD

pytestmark = pytest.mark.usefixtures("taichi")


def bead_on(name, friction=0.3, e=0.5, **settings):
    values = {"pair.bead.steel.static_friction": friction, "pair.bead.steel.restitution": e, **settings}
    return with_settings(bead_scene(), {"rig.name": name, **values})


def test_every_bench_rig_has_its_test():
    assert set(BENCH_TESTS) == set(BENCH_RIGS)
    with pytest.raises(ParameterError, match="'funnel' is no bench test"):
        run_bench_test(bead_scene())


@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_a_bead_slides_at_the_angle_of_friction(friction):
    found = run_bench_test(bead_on("inclined_plane", friction)).quantity("sliding_angle_deg")
    expected = math.degrees(math.atan(friction))
    assert found.reference == pytest.approx(expected)
    # What the contact yields before it slides: some thousandths of a degree.
    assert found.value == pytest.approx(expected, abs=0.01)


def test_a_clump_slides_at_the_angle_of_friction_of_its_own_pair():
    """A petiole on several of its spheres, and the shipped friction with the plate, 0.78."""
    scene = with_settings(
        load_material("sunflower_extract"),
        {"rig.name": "inclined_plane", "rig.body": "petiole", "body.spheres": "coarse", "rig.tilt_rate": 5.0},
    )
    result = run_bench_test(scene)
    assert result.body == "petiole"
    assert result.quantity("static_friction").reference == 0.78
    assert result.quantity("static_friction").value == pytest.approx(0.78, rel=1e-3)


def test_the_ends_of_the_range_of_friction():
    """The steepest tilt lies above atan 3 = 71.565°, the largest friction that can be asked for."""
    result = run_bench_test(bead_on("inclined_plane", 3.0, **{"rig.tilt_rate": 5.0}))
    assert result.quantity("sliding_angle_deg").value == pytest.approx(71.565, abs=0.02)
    smooth = run_bench_test(bead_on("inclined_plane", 0.0))
    assert smooth.quantity("sliding_angle_deg").value == pytest.approx(0.0, abs=0.05)


def test_the_path_on_the_plane_is_kept():
    series = dict(run_bench_test(bead_on("inclined_plane", 0.5)).series)
    tilt, moved = np.array(series["tilt_deg"]), np.array(series["displacement_m"])
    assert len(tilt) == len(moved)
    assert (np.diff(tilt) > 0.0).all()
    # It holds: micrometres of elastic yielding, until it slides.
    assert moved[tilt < 26.0].max() < 5e-6 < moved[-1]


@pytest.mark.parametrize("friction", [0.0, 0.6])
@pytest.mark.parametrize("e", [0.3, 0.5, 0.8])
def test_the_tracked_rebound_returns_the_restitution(e, friction):
    found = run_bench_test(bead_on("drop_plate_45", friction, e)).quantity("restitution")
    assert found.reference == e
    assert found.value == pytest.approx(e, rel=0.01)


def test_the_paper_s_estimate_by_hand():
    gravity, height = 9.81, 0.2
    speed = math.sqrt(2.0 * gravity * height)
    # horizontal rebound with e: v_x = e V; then L = v_x √(2H/g) and L/2H = e exactly
    level = PlateRebound(0.6 * speed, 0.0)
    assert paper_estimate(level, gravity, height) == pytest.approx(0.6)
    assert restitution(level, gravity, height) == pytest.approx(0.6)
    # a gripping sphere at e = 0.5: v_x, v_z = (0.5 ± 5/7)/2 V → L/2H = v_x (v_z + √(v_z² + 1)), 0.546
    gripping = PlateRebound((0.5 + 5 / 7) / 2 * speed, (0.5 - 5 / 7) / 2 * speed)
    assert restitution(gripping, gravity, height) == pytest.approx(0.5)
    assert paper_estimate(gripping, gravity, height) == pytest.approx(0.546, abs=5e-4)


def test_the_paper_s_estimate_is_biased_and_shown_over_e_and_friction():
    table = {name: np.array(values) for name, values in run_bench_test(bead_on("drop_plate_45")).table}
    e, friction, tracked, paper = (table[k] for k in ("restitution", "static_friction", "tracked", "paper_L_over_2H"))
    assert set(e) == {0.2, 0.35, 0.5, 0.65, 0.8}
    assert np.abs(tracked / e - 1.0).max() < 0.01
    gripping = paper[(e == 0.5) & (friction == 0.6)]
    # 5/7 is that of a contact without tangential compliance; Mindlin's springs give a little of the spin back
    assert gripping == pytest.approx(0.546, abs=0.01)
    assert paper[(e == 0.5) & (friction == 0.0)] == pytest.approx(0.5856, abs=0.002)
    assert (paper[e == 0.2] > 0.3).all()


def test_a_body_that_hits_off_centre_scatters_and_makes_no_energy():
    scene = with_settings(
        load_material("sunflower_extract"),
        {"rig.name": "drop_plate_45", "rig.specimen": "body", "rig.drops": 6, "body.spheres": "coarse"},
    )
    first, again, other = (run_bench_test(scene, seed) for seed in (1, 1, 2))
    assert first == again
    found = first.quantity("restitution")
    assert found.value != other.quantity("restitution").value
    assert found.spread > 0.05
    speed = np.hypot(*(np.array(dict(first.series)[name]) for name in ("v_x_m_s", "v_z_m_s")))
    assert len(speed) == 6
    # It fell through 0.2 m.
    assert speed.max() < math.sqrt(2.0 * 9.81 * 0.2)


@pytest.mark.parametrize("shear", [2e6, 5e7])
def test_squeezing_and_shearing_return_the_contact_moduli(shear):
    scene = bead_on("compression", 0.3, **{"material.glass.shear_modulus": shear})
    result = run_bench_test(scene)
    # By hand: 1/E* = Σ (1 − ν²)/E, E = 2 G (1 + ν); 1/G* = Σ (2 − ν)/G
    e_star = 1.0 / sum((1 - nu**2) / (2 * g * (1 + nu)) for g, nu in ((shear, 0.25), (8e10, 0.3)))
    g_star = 1.0 / sum((2 - nu) / g for g, nu in ((shear, 0.25), (8e10, 0.3)))
    assert (GLASS.poisson_ratio, STEEL.poisson_ratio, STEEL.shear_modulus) == (0.25, 0.3, 8e10)
    for name, expected in (("effective_youngs_modulus", e_star), ("effective_shear_modulus", g_star)):
        found = result.quantity(name)
        assert found.reference == pytest.approx(expected)
        assert found.value == pytest.approx(expected, rel=0.01)


def test_shearing_ends_at_the_wanted_share_of_sliding(monkeypatch):
    reached, shear = [], compression._shear

    def noted(*arguments):
        slip, tangential = shear(*arguments)
        reached.append(tangential[-1])
        return slip, tangential

    monkeypatch.setattr(compression, "_shear", noted)
    result = run_bench_test(bead_on("compression", 0.3))
    # Up to micro-slip: Mindlin's spring in steps, the preload as it was when squeezing ended.
    assert reached[0] == pytest.approx(0.2 * 0.3 * dict(result.series)["force_N"][-1], rel=0.03)


def test_the_apparent_modulus_is_that_of_equation_1_and_no_constant():
    """E = (F/A)/(ΔL/T) with A = π R δ is 4 E* √R/(3 π √δ): it falls with the overlap δ."""
    result = run_bench_test(bead_on("compression"))
    series = {name: np.array(values) for name, values in result.series}
    overlap = 0.5 * series["approach_m"]
    e_star = result.quantity("effective_youngs_modulus").value
    expected = 4.0 * e_star * np.sqrt(BEAD) / (3.0 * np.pi * np.sqrt(overlap))
    shown = series["youngs_modulus_paper_equation_1_Pa"]
    assert shown[50:] == pytest.approx(expected[50:], rel=0.01)
    assert shown[50] > 1.5 * shown[-1]


def test_a_plate_that_moves_fast_is_read_less_often_or_refused(monkeypatch):
    """The shear of some 2 µm takes 39 steps of 56 µs at 1 mm/s, and 3 at 1 cm/s."""
    readings, shear = [], compression._shear

    def noted(*arguments):
        readings.append(shear(*arguments))
        return readings[-1]

    monkeypatch.setattr(compression, "_shear", noted)
    result = run_bench_test(bead_on("compression", 0.3, **{"rig.speed": 1e-3}))
    found = result.quantity("effective_youngs_modulus")
    assert found.value == pytest.approx(found.reference, rel=0.01)
    ((slip, _),) = readings
    assert compression.FEWEST <= len(slip) < compression.MOMENTS
    assert np.ptp(np.diff(slip)) == pytest.approx(0.0, abs=1e-3 * slip[-1])
    with pytest.raises(
        ParameterError, match=r"rig\.speed: 0\.01 m/s leaves \d+ time steps of .* at least 20 are needed"
    ):
        run_bench_test(bead_on("compression", 0.3, **{"rig.speed": 1e-2}))


def test_without_friction_there_is_no_shear_modulus_to_measure():
    result = run_bench_test(bead_on("compression", 0.0))
    assert math.isnan(result.quantity("effective_shear_modulus").value)
    assert "friction" in result.note


def test_a_specimen_is_a_ball_of_the_body_s_mass():
    from solver.single_body.bench import ball

    (bead,) = bead_scene().bodies
    assert ball(bead).clump.radii == pytest.approx([BEAD])
    assert ball(bead).mass == pytest.approx(MASS)
    seed = load_material("sunflower_extract").bodies[0]
    sphere = ball(dataclasses.replace(seed))
    assert 4.0 / 3.0 * math.pi * float(sphere.clump.radii[0]) ** 3 * seed.density == pytest.approx(seed.mass)


def test_a_set_up_effect_acts_on_a_bench_as_well():
    """A seed stretched to twice its length, of the same volume, rebounds otherwise."""
    settings = {"rig.name": "drop_plate_45", "rig.specimen": "body", "rig.drops": 2}
    scene = with_settings(load_material("nine_sphere_seed"), settings)
    stretched = with_settings(scene, {"effect.shape_elongation.elongation": 1.0})
    one, other = (run_bench_test(each).quantity("restitution").value for each in (scene, stretched))
    assert abs(one - other) > 1e-3
