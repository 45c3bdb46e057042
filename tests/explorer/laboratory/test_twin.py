"""Virtual twins: what the bench rigs give back of what was put in, and where the paper's formulas do not."""

import json
import math

import numpy as np
import pytest

from doe.errors import StatisticsError
from doe.laboratory import analyse
from doe.laboratory.linear_range import linear_range
from explorer.errors import CommandError
from explorer.laboratory.part import part_table, with_part
from explorer.laboratory.twin import bench_scene, restitution_that_lands, simulated_bias, specimen, twins
from solver import load_material, with_values
from solver.single_body import run_bench_test
from tests.explorer.command_line import explorer, refused

pytestmark = pytest.mark.usefixtures("taichi")


@pytest.fixture
def scene():
    return with_values(load_material("sunflower_extract"), {"body.spheres": "coarse"})


def rows_of(tmp_path, scene, test, text):
    path = tmp_path / f"{test}.csv"
    path.write_text(text)
    result = analyse(test, path)
    return {row.quantity: row for row in twins(result, with_part(scene, part_table(result)))}


@pytest.mark.parametrize("pair", ["seed,rigid_sieve_plate", "petiole,seed"])
def test_the_inclined_plane_closes(pair, tmp_path, scene):
    rows = rows_of(tmp_path, scene, "inclined_plane", f"a,b,replicate,angle_deg\n{pair},1,24\n{pair},2,26\n")
    friction = rows["static_friction"]
    expected = 0.5 * (math.tan(math.radians(24)) + math.tan(math.radians(26)))
    assert friction.put_in == friction.measured == pytest.approx(expected)
    assert friction.simulated == pytest.approx(expected, rel=0.01)
    assert friction.closes
    assert math.degrees(rows["sliding_angle"].simulated) == pytest.approx(25.0, abs=0.1)


def test_the_drop_closes_by_the_tracked_rebound_and_not_by_l_over_2h(tmp_path, scene):
    rows = rows_of(tmp_path, scene, "drop", "a,b,replicate,drop_height_mm,distance_mm\nseed,plate,1,150,150\n")
    assert rows["restitution"].put_in == pytest.approx(0.5)
    assert rows["restitution"].closes
    # A gripping sphere with e = 0.5 flies 0.546; tangential springs give a little of the spin back.
    assert rows["L_over_2H"].measured == pytest.approx(0.5)
    assert rows["L_over_2H"].simulated == pytest.approx(0.546, abs=0.01)
    assert rows["L_over_2H"].closes is None
    landing = rows["restitution_that_lands_there"].simulated
    # the rigid sphere's: 0.433 at L/2H = 0.5
    assert landing == pytest.approx(0.433, abs=0.02)


@pytest.mark.parametrize("e", [0.3, 0.9])
def test_the_rebound_closes(e, tmp_path, scene):
    head = "a,b,replicate,drop_height_mm,rebound_height_mm\n"
    rows = rows_of(tmp_path, scene, "rebound", f"{head}seed,rigid_sieve_plate,1,150,{150 * e * e!r}\n")
    assert rows["restitution"].put_in == pytest.approx(e)
    assert rows["restitution"].closes


def test_a_rebound_without_heights_falls_from_a_usual_one(tmp_path, scene):
    rows = rows_of(tmp_path, scene, "rebound", "a,b,replicate,restitution\nseed,plate,1,0.6\n")
    assert rows["restitution"].closes


@pytest.mark.parametrize("angle", [1.0, 8.0])
def test_rolling_closes(angle, tmp_path, scene):
    rows = rows_of(tmp_path, scene, "rolling", f"a,b,replicate,angle_deg\nseed,rigid_sieve_plate,1,{angle}\n")
    assert rows["rolling_friction"].put_in == pytest.approx(math.tan(math.radians(angle)))
    assert rows["rolling_friction"].closes


def test_rolling_of_a_sphere_that_slides_first_does_not_close(tmp_path, scene):
    """Where μ < μ_r the ball slides at atan μ: what is found is the friction, and the twin says so."""
    slippery = with_values(scene, {"pair.seed.rigid_sieve_plate.static_friction": 0.05})
    rows = rows_of(tmp_path, slippery, "rolling", "a,b,replicate,angle_deg\nseed,rigid_sieve_plate,1,8\n")
    assert rows["rolling_friction"].simulated == pytest.approx(0.05, rel=0.02)
    assert rows["rolling_friction"].closes is False


def test_the_restitution_that_lands_there_lands_there(scene):
    bench = with_values(bench_scene(scene, "drop", ("seed", "plate")), {"rig.drop_height": 0.2})
    found = restitution_that_lands(bench, 0.6)
    assert found is not None
    back = run_bench_test(with_values(bench, {"pair.seed.plate.restitution": found}))
    # tolerance of the root, 1e-4, times the slope of L/2H over e, 0.8
    assert back.quantity("restitution_paper_L_over_2H").value == pytest.approx(0.6, abs=2e-4)
    assert restitution_that_lands(bench, 0.1) is None


def test_a_camera_s_rebound_is_put_in(tmp_path, scene):
    head = "a,b,replicate,drop_height_mm,v_x_m_s,v_z_m_s\n"
    rows = rows_of(tmp_path, scene, "drop", head + "seed,seed,1,200,1.2,-0.2\n")
    assert rows["restitution"].put_in == pytest.approx(1.0 / math.sqrt(2 * 9.81 * 0.2))
    assert rows["restitution"].closes
    assert "restitution_that_lands_there" not in rows


@pytest.mark.parametrize("test", ["compression", "shear"])
def test_squeezing_and_shearing_close(test, tmp_path, scene):
    head = "component,replicate,thickness_mm,area_mm2,displacement_mm,force_N\n"
    rows = rows_of(tmp_path, scene, test, head + "plate,1,5,20,0.05,20\n")
    plate = scene.material("plate")
    expected = {"compression": 1e8, "shear": 2e8 * 1.3}[test]
    assert rows["youngs_modulus"].put_in == pytest.approx(expected)
    for name in ("effective_youngs_modulus", "effective_shear_modulus", "youngs_modulus", "shear_modulus"):
        assert rows[name].closes, name
        assert abs(rows[name].error) < 0.01
    # Hertz on a steel plate, 1/E* = (1 − ν²)/E + 0.91/2e11
    e_star = 1.0 / ((1.0 - plate.poisson_ratio**2) / expected + 0.91 / 2e11)
    assert rows["effective_youngs_modulus"].simulated == pytest.approx(e_star, rel=0.01)
    assert rows["youngs_modulus_by_equation_1"].error > 5.0
    assert rows["youngs_modulus_by_equation_1"].closes is None


def test_what_cannot_be_measured_does_not_close(tmp_path, scene):
    """Without friction there is no tangential force, and no G*."""
    smooth = with_values(scene, {"pair.plate.rigid_sieve_plate.static_friction": 0.0})
    head = "component,replicate,thickness_mm,area_mm2,displacement_mm,force_N\n"
    rows = rows_of(tmp_path, smooth, "compression", head + "plate,1,5,20,0.05,20\n")
    assert rows["effective_shear_modulus"].closes is False
    assert rows["effective_youngs_modulus"].closes


def test_the_simulated_squeezing_has_no_straight_part(scene):
    """A laboratory that pressed the twin's ball would find that Equation 1 does not apply."""
    series = dict(run_bench_test(bench_scene(scene, "compression", ("seed",))).series)
    with pytest.raises(StatisticsError, match="Hertzian"):
        linear_range(series["approach_m"], series["force_N"])


def test_specimens_of_pairs_and_of_one_component(scene):
    assert specimen(scene, ("seed",))[1] == "rigid_sieve_plate"
    body, wall = specimen(scene, ("rigid_sieve_plate", "petiole"))
    assert (body.name, wall) == ("petiole", "rigid_sieve_plate")
    body, wall = specimen(scene, ("plate", "seed"))
    assert (body.name, wall) == ("plate", "seed")
    with pytest.raises(CommandError, match="stone: no such body"):
        specimen(scene, ("stone",))


def test_the_simulated_bias_stands_beside_its_closed_form(scene):
    drop = np.array(simulated_bias("drop", scene, ("seed", "rigid_sieve_plate")).rows)
    closed, simulated = drop[:, 2], drop[:, 3]
    # tangential springs of the contact: hundredths
    assert np.abs(simulated / closed - 1.0).max() < 0.03
    assert np.abs(drop[:, 5] / drop[:, 1] - 1.0).max() < 0.01
    squeezed = np.array(simulated_bias("compression", scene, ("seed",)).rows)
    assert squeezed[:, 0].tolist() == [0.001, 0.003, 0.01, 0.03]
    # the first reading holds few steps; Hertz is integrated exactly from there on
    assert squeezed[:, 2] == pytest.approx(squeezed[:, 1], rel=0.01)


def test_the_command_shows_measured_and_simulated(tmp_path):
    readings = tmp_path / "drop.csv"
    readings.write_text("a,b,replicate,drop_height_mm,distance_mm\nseed,plate,1,200,232\nseed,plate,2,200,240\n")
    result = explorer("lab", "drop", readings, "--simulate", "--json")
    assert result.exit_code == 0, result.output
    tracked, flight, landing = json.loads(result.stdout)["twins"]
    assert tracked["closes"] is True
    assert flight["measured"] == pytest.approx(0.59)
    assert abs(tracked["error"]) < 0.01 < abs(flight["error"])
    assert landing["quantity"] == "restitution_that_lands_there"
    text = explorer("lab", "drop", readings, "--simulate").stdout
    assert "closes" in text
    assert "DOES NOT" not in text


def test_a_round_trip_that_does_not_close_is_a_failure(tmp_path):
    material = tmp_path / "smooth.toml"
    part = tmp_path / "part.toml"
    part.write_text("format = 1\n[pair.plate.rigid_sieve_plate]\nstatic_friction = 0.0\n")
    made = explorer("new", "material", "smooth", "--like", "sunflower_extract", "--part", part, "--out", tmp_path)
    assert made.exit_code == 0, made.output
    readings = tmp_path / "compression.csv"
    head = "component,replicate,thickness_mm,area_mm2,displacement_mm,force_N\n"
    readings.write_text(head + "plate,1,5,20,0.05,20\n")
    result = explorer("lab", "compression", readings, "--simulate", "--material", material)
    assert result.exit_code == 1, result.output
    assert "DOES NOT CLOSE" in result.stdout


def test_components_that_the_material_lacks_are_named(tmp_path):
    readings = tmp_path / "plane.csv"
    readings.write_text("a,b,replicate,angle_deg\nlentil,steel,1,24\n")
    line = refused(explorer("lab", "inclined_plane", readings, "--simulate"))
    assert "sunflower_extract" in line
    assert "pair.lentil.steel" in line
