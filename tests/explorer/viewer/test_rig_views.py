"""Every rig on the page, in recordings and on the command line."""

import json
import multiprocessing
import tomllib

import numpy as np
import pytest

from explorer.live.frames import FrameReader, FrameWriter, shared_block
from explorer.scene.file import load_scene, with_settings
from explorer.scene.meshes import PLATE_OVERHANG, rig_poses, rig_triangles, rim_circles, scene_height
from solver.assets import asset_path
from solver.params import ParameterError
from solver.rigs import BENCH_RIGS, RIGS
from solver.scenes.insertion import rotation_matrix
from solver.scenes.material_file import with_settings as with_rig_settings
from tests.explorer.beads import bead_scene
from tests.explorer.command_line import explorer, refused
from tests.explorer.live.test_frames import bodies

ALL = {**RIGS, **BENCH_RIGS}


def in_world(rig, name):
    """Corners of a drawn surface in the world [m], and its normals there."""
    k = rig.surface_names.index(name)
    pose, mesh = rig_poses(rig)[k], rig_triangles(rig)[name]
    turn = rotation_matrix(pose[3:])
    return mesh.vertices @ turn.T + pose[:3], mesh.normals @ turn.T


@pytest.mark.parametrize("name", ALL)
def test_every_surface_is_drawn(name):
    rig = ALL[name]()
    drawn = rig_triangles(rig)
    assert set(drawn) == set(rig.surface_names)
    assert rig_poses(rig).shape == (len(rig.surface_names), 7)
    for mesh in drawn.values():
        assert np.isfinite(mesh.vertices).all()
        assert len(mesh.faces) >= 2
        assert mesh.faces.max() < len(mesh.vertices)
        assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0, abs=1e-6)


def test_a_drum_lies_on_its_side():
    rig = RIGS["rotating_drum"]()
    shell, _ = in_world(rig, "shell")
    centre = np.array([0.0, 0.0, rig.radius])
    assert np.hypot(*(shell - centre)[:, [0, 2]].T) == pytest.approx(rig.radius, abs=1e-7)
    assert np.abs(shell[:, 1]).max() == pytest.approx(rig.axial_length / 2)
    front, normals = in_world(rig, "front")
    assert front[:, 1] == pytest.approx(-rig.axial_length / 2, abs=1e-7)
    # Its side with bodies is that of +y.
    assert (normals @ [0.0, 1.0, 0.0]) == pytest.approx(1.0)
    # Plates that are infinite are drawn as large as the shell.
    assert np.ptp(front[:, 0]) == pytest.approx(rig.diameter, rel=1e-3)
    assert rim_circles(rig)["shell"] == [(rig.radius, -rig.axial_length / 2), (rig.radius, rig.axial_length / 2)]


def test_a_box_stands_on_its_plate():
    rig = RIGS["draw_down_box"]()
    back, normals = in_world(rig, "back")
    assert back[:, 1] == pytest.approx(rig.depth / 2, abs=1e-7)
    assert (normals @ [0.0, -1.0, 0.0]) == pytest.approx(1.0)
    assert back[:, 2].max() == pytest.approx(rig.shelf_height + rig.box_height)
    gate, _ = in_world(rig, "gate")
    assert np.ptp(gate, axis=0) == pytest.approx([rig.slot_width, rig.depth, 0.0], abs=1e-7)
    plate, _ = in_world(rig, "plate")
    reach = np.hypot(rig.width, rig.depth) / 2
    assert np.hypot(plate[:, 0], plate[:, 1]).max() == pytest.approx(PLATE_OVERHANG * reach)


def test_the_picture_holds_rig_and_feed():
    funnel = bead_scene()
    assert scene_height(funnel) == pytest.approx(funnel.rig.inlet_height + funnel.insertion.region_height)
    drum = with_rig_settings(funnel, {"rig.name": "rotating_drum"})
    assert scene_height(drum) == pytest.approx(drum.rig.diameter)


def test_poses_of_surfaces_come_with_a_frame():
    block = shared_block(multiprocessing.get_context("spawn"))
    writer, reader = FrameWriter(block), FrameReader(block)
    writer.publish(bodies(2), 1, 0.1)
    assert reader.newest().surfaces.shape == (0, 7)
    poses = np.arange(14.0).reshape(2, 7)
    writer.publish(bodies(2), 1, 0.2, poses)
    np.testing.assert_array_equal(reader.newest().surfaces, poses)


@pytest.mark.parametrize("name", RIGS)
def test_a_rig_is_named_on_the_command_line(name):
    scene = load_scene(name)
    assert scene.rig.name == name
    chosen = with_settings(load_scene("funnel"), [f"rig.name={name}", "body.spheres=coarse"])
    assert chosen.rig == scene.rig
    assert chosen.bodies[0].spheres == "coarse"


def test_a_material_file_may_bring_its_rig(tmp_path):
    own = tmp_path / "own.toml"
    text = asset_path("materials", "sunflower_extract").read_text(encoding="utf-8")
    drum = '\n[rig]\nname = "rotating_drum"\nspeed_rpm = 30\n[numerics]\nskin = "2mm"\n'
    own.write_text(text + drum, encoding="utf-8")
    scene = with_settings(load_scene(str(own)), [])
    assert (scene.rig.name, scene.rig.speed_rpm, scene.numerics.skin) == ("rotating_drum", 30.0, 2e-3)
    assert scene.insertion.protocol == "fill_then_open"
    own.write_text(text + drum.replace("30", "1000"), encoding="utf-8")
    with pytest.raises(ParameterError, match=r"own\.toml: rig\.speed_rpm: 1000 rpm is outside 0\.1 … 300 rpm"):
        load_scene(str(own))


def test_a_set_up_file_names_a_rig(tmp_path):
    path = tmp_path / "lift.toml"
    path.write_text(
        'format = 1\nmaterial = "sunflower_extract"\n[rig]\nname = "lifting_cylinder"\nlift_speed = "5cm/s"\n'
        "[insertion]\nrate = '10g/s'\n",
        encoding="utf-8",
    )
    scene = with_settings(load_scene(str(path)), [])
    assert (scene.rig.name, scene.rig.lift_speed, scene.insertion.rate) == ("lifting_cylinder", 0.05, 0.01)


def test_a_bench_test_prints_what_it_measured_beside_what_was_put_in(taichi, tmp_path):
    asked = ("simulate", "compression", "--set", "body.spheres=coarse", "--out", tmp_path / "run")
    printed = explorer(*asked)
    assert printed.exit_code == 0, printed.output
    assert "compression: sphere of seed on rigid_sieve_plate" in printed.stdout
    row = next(line for line in printed.stdout.splitlines() if line.startswith("effective_youngs_modulus"))
    measured, put_in, error = (float(word) for word in row.split()[1:4])
    assert measured == pytest.approx(put_in, rel=0.01)
    assert error == pytest.approx(100.0 * (measured / put_in - 1.0), abs=0.01)

    data = json.loads((tmp_path / "run" / "result.json").read_text())
    assert data["quantities"]["effective_youngs_modulus"]["reference"] == pytest.approx(put_in, rel=1e-4)
    assert len(set(map(len, data["series"].values()))) == 1
    values = tomllib.loads((tmp_path / "run" / "parameters.toml").read_text())
    assert (values["rig.body"], values["rig.strain"]) == ("seed", 4e-3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["compression", "--replicates", "2"], ["compression", "bench test", "--replicates"]),
        (["inclined_plane", "--set", "rig.body=wheat"], ["rig.body", "wheat", "seed, plate, petiole"]),
        (["inclined_plane", "--set", "insertion.rate=1"], ["insertion.rate"]),
        (["rotating_drum", "--set", "rig.rpm=3"], ["rig.rpm", "rig.speed_rpm"]),
        (["funnel", "--set", "rig.name=mixer"], ["rig.name", "mixer", "lifting_cylinder"]),
    ],
)
def test_what_a_rig_refuses(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = refused(explorer("simulate", *arguments, "--out", "result"))
    assert all(word in line for word in words), line
    assert list(tmp_path.iterdir()) == []
