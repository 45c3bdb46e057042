"""Decks for other engines, as far as they can be judged without those: `tests/peers` runs them."""

import dataclasses
import json
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from scipy.integrate import solve_ivp

from explorer.errors import CommandError
from explorer.export import EXPORTS, names
from explorer.export.bed import BED_WRITERS, Bed
from explorer.export.deck import DeckTarget, assembled, deck_of, read_deck, revolved_triangles, write_stl
from explorer.export.frames import SphereFrame, motion, read_frames, rigid_fit
from explorer.export.liggghts import unclamped_restitution, write_liggghts
from explorer.export.target import ExportTarget
from explorer.scene.file import load_scene, with_settings
from explorer.viewer.output.engine_export import programs_text
from solver import run_pour, with_rig, with_values
from solver.plugins import GROUP
from solver.pours.record import Entries
from solver.rigs import Revolved
from solver.scenes.insertion import random_quaternion, rotation_matrix
from tests.explorer.beads import bead_scene
from tests.explorer.command_line import TINY, explorer, refused, settings

FUNNEL = Revolved(0.015, 0.08, 0.057, 0.21, "steel")


@pytest.fixture(scope="module")
def record(taichi):
    tiny = TINY | {"insertion.protocol": "fill_then_open", "insertion.rate": "60g/s"}
    return run_pour(with_settings(load_scene("funnel"), [f"{path}={value}" for path, value in tiny.items()]), 5)


@pytest.fixture(scope="module")
def deck(record):
    return deck_of(record)


@pytest.mark.parametrize("e", [0.22, 0.3, 0.5, 0.8, 0.98])
def test_liggghts_s_clamped_contact_returns_the_restitution_that_was_declared(e):
    """The force of its `hertz` with `limitForce`: max(0, 4/3 E* √R* δ^1.5 + 2 √(5/6) |β(e')| √(2 E* a m) δ')."""
    replaced = unclamped_restitution(e)
    beta = -np.log(replaced) / np.hypot(np.log(replaced), np.pi)

    def rates(_, state):
        depth, speed = state
        a = np.sqrt(max(depth, 0.0))
        return speed, -max(0.0, 4 / 3 * a * depth + 2 * np.sqrt(5 / 6) * beta * np.sqrt(2 * a) * speed)

    def apart(_, state):
        return state[0]

    apart.terminal, apart.direction = True, -1
    speed = solve_ivp(rates, (0, 50), (1e-9, 1.0), events=apart, rtol=1e-9, atol=1e-12).y[1, -1]
    assert -speed == pytest.approx(e, rel=0.01)  # the polynomial behind c_n is within 0.75 %


def test_a_deck_survives_its_file(deck, tmp_path):
    from explorer.export.deck import write_deck

    write_deck(tmp_path, deck)
    again = read_deck(tmp_path)
    text = [json.dumps(dataclasses.asdict(d), default=lambda array: array.tolist()) for d in (deck, again)]
    assert text[0] == text[1]
    assert isinstance(again.entries.position, np.ndarray)


def test_a_deck_says_what_the_pour_did(record, deck):
    entries = record.entries
    assert (deck.steps, deck.dt, deck.bodies) == (record.steps, record.dt, len(record.bodies.mass))
    assert (entries.component == record.bodies.component).all()
    assert entries.time == pytest.approx(entries.step * record.dt)
    assert (np.diff(entries.step) >= 0).all()
    assert entries.velocity == pytest.approx(np.tile([0.0, 0.0, -0.5], (deck.bodies, 1)))
    scene = record.scene
    wall = scene.contact_pair(scene.bodies[2], scene.rig.wall)
    assert (deck.friction[2, 3], deck.restitution[3, 2]) == (wall.static_friction, wall.restitution)
    # The gate was still shut when the run was cut off.
    assert [(mesh.name, mesh.until_step) for mesh in deck.meshes] == [("cone", -1), ("gate", -1)]


def test_a_body_that_met_nothing_is_where_its_entry_and_gravity_put_it(record):
    k = int(np.argmax(record.entries.step))
    n = record.steps - record.entries.step[k]
    fall = 9.81 * record.dt**2 * n * (n + 1) / 2  # leapfrog from rest to n steps
    expected = record.entries.position[k] + record.entries.velocity[k] * n * record.dt - [0, 0, fall]
    assert record.bodies.position[k] == pytest.approx(expected, abs=1e-12)


def test_a_shorter_time_leaves_out_who_enters_later(record):
    half = deck_of(record, time=0.5 * record.entries.time[-1])
    assert 0 < half.bodies < len(record.entries.step)
    assert (half.entries.step < half.steps).all()


@pytest.mark.parametrize("engine", [one for one in EXPORTS.values() if isinstance(one, DeckTarget)])
def test_a_folder_is_complete_and_knows_no_other_place(engine, deck, tmp_path):
    engine.write_deck(tmp_path, deck)
    names = {path.name for path in tmp_path.iterdir()}
    assert {"README.txt", "deck.json", "cone.stl", "gate.stl"} <= names
    for path in tmp_path.iterdir():
        text = path.read_text(encoding="utf-8")
        assert str(tmp_path) not in text
        assert "/home" not in text
        assert "{" not in text or path.suffix in (".json", ".py", ".liggghts")


@pytest.mark.parametrize("engine", [one for one in EXPORTS.values() if isinstance(one, DeckTarget)])
def test_the_readme_calls_the_cone_a_polygon_only_where_it_is_one(engine, deck, tmp_path):
    of_file = dataclasses.replace(
        deck, meshes=tuple(dataclasses.replace(mesh, of_file=mesh.name == "cone") for mesh in deck.meshes)
    )
    for name, one, words in (
        ("turned", deck, "    The cone is a polygon of the same area with 96 sides; bodies"),
        ("mesh", of_file, "    The cone has the triangles of its mesh file, as here; bodies"),
    ):
        (tmp_path / name).mkdir()
        engine.write_deck(tmp_path / name, one)
        assert words in (tmp_path / name / "README.txt").read_text(encoding="utf-8")
    assert read_deck(tmp_path / "mesh").meshes[0].of_file


def test_the_walls_of_a_mesh_funnel_are_of_a_file_but_for_its_gate():
    scene = with_rig(load_scene("funnel"), "mesh_funnel")
    scene = with_settings(scene, ["insertion.protocol=fill_then_open"])
    zero = np.zeros(0, dtype=np.int32)
    entries = Entries(zero * 1.0, zero, zero, np.zeros((0, 3)), np.zeros((0, 4)), np.zeros((0, 3)))
    pour = SimpleNamespace(scene=scene, seed=0, dt=1e-5, steps=1, gate_opened=0.0, entries=entries)
    assert [(mesh.name, mesh.of_file) for mesh in deck_of(pour).meshes] == [("cone", True), ("gate", False)]


def test_linear_springs_are_liggghts_s_model_hooke_and_nothing_of_yade_s(deck, tmp_path):
    linear = dataclasses.replace(deck, law="linear_spring_dashpot", characteristic_velocity=0.4)
    write_liggghts(tmp_path, linear)
    lines = (tmp_path / "in.liggghts").read_text().splitlines()
    assert "fix speed all property/global characteristicVelocity scalar 0.4" in lines
    models = [line.split(" model ")[1] for line in lines if " model " in line]
    assert {" ".join(words.split()[:3]) for words in models} == {"hooke tangential history"}
    assert read_deck(tmp_path).law == "linear_spring_dashpot"
    with pytest.raises(CommandError, match="contact law 'linear_spring_dashpot': not in the deck for YADE; allowed: h"):
        EXPORTS["yade"].write_deck(tmp_path, linear)


def test_the_gate_is_taken_away_at_its_step_in_liggghts(deck, tmp_path):
    meshes = tuple(dataclasses.replace(mesh, until_step=700 if mesh.name == "gate" else -1) for mesh in deck.meshes)
    write_liggghts(tmp_path, dataclasses.replace(deck, meshes=meshes, steps=1000))
    lines = (tmp_path / "in.liggghts").read_text().splitlines()
    opening = lines[lines.index("run 701") :]
    assert opening[1:3] == ["unfix walls", "unfix gate"]
    assert "n_meshes 1 meshes cone" in opening[3]
    assert opening[4] == "run 300"


def test_every_body_gets_an_insertion_of_its_own_in_liggghts(deck, tmp_path):
    write_liggghts(tmp_path, deck)
    lines = (tmp_path / "in.liggghts").read_text().splitlines()
    starts = [int(line.split(" start ")[1].split()[0]) for line in lines if "insert/pack" in line]
    assert starts == [step + 1 for step in deck.entries.step]
    assert sum(line.startswith("region place") for line in lines) == deck.bodies


def test_the_cone_has_the_circle_s_area_and_the_gate_covers_its_disc(tmp_path):
    triangles = revolved_triangles(FUNNEL)
    write_stl(tmp_path / "cone.stl", "cone", triangles)
    mesh = trimesh.load_mesh(tmp_path / "cone.stl")
    assert len(mesh.faces) == len(triangles) == 576
    slant = np.hypot(0.042, 0.13)
    assert mesh.area == pytest.approx(np.pi * 0.072 * slant, rel=1e-3)
    assert mesh.bounds[:, 2] == pytest.approx([0.08, 0.21])
    edges = mesh.outline().length  # the two rims and nothing else: no gap, no crack
    assert edges == pytest.approx(2 * np.pi * 0.072, rel=1e-3)
    gate = revolved_triangles(Revolved(0.0, 0.08, 0.015, 0.08, "steel"))
    assert gate.shape == (1, 3, 3)
    sides = gate[0] - np.roll(gate[0], 1, axis=0)
    distance = np.abs(np.cross(sides, gate[0])[:, 2] / np.linalg.norm(sides, axis=1))
    assert distance == pytest.approx(0.015)  # every side touches the circle from outside


def test_bodies_are_found_again_from_their_spheres(taichi):
    scene = with_values(load_scene("funnel"), {"body.spheres": "coarse"})
    rng = np.random.default_rng(3)
    places, turns = rng.normal(size=(3, 3)), np.array([random_quaternion(rng) for _ in range(3)])
    kinds, zero = np.array([0, 1, 2], dtype=np.int32), np.zeros(3, dtype=np.int32)
    deck = assembled(scene, 0, 1e-6, 1, Entries(zero * 1.0, zero, kinds, places, turns, zero[:, None] * places))
    velocity, spin = rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
    rows, speeds, spins = [], [], []
    for k, turn in enumerate(rotation_matrix(turns)):
        arms = deck.members(k) @ turn.T
        rows.append(places[k] + arms)
        speeds.append(velocity[k] + np.cross(spin[k], arms))
        spins.append(np.tile(spin[k], (len(arms), 1)))
    n = sum(map(len, rows))
    frame = SphereFrame(0, np.arange(1, n + 1), np.ones(n), *map(np.concatenate, (rows, speeds, spins)))
    found = motion(deck, frame)
    assert found.position == pytest.approx(places, abs=1e-12)
    assert found.velocity == pytest.approx(velocity, abs=1e-12)
    assert found.spin == pytest.approx(spin)
    turn, shift = rigid_fit(deck.members(1), rows[1])
    assert turn == pytest.approx(rotation_matrix(turns[1]), abs=1e-9)
    assert shift == pytest.approx(places[1])


def test_frames_are_read_in_order_of_the_spheres(tmp_path):
    head = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS mm mm mm\n" + "0 1\n" * 3 + "ITEM: ATOMS\n"
    rows = "2 0.1 4 5 6 0 0 0 0 0 0\n1 0.2 1 2 3 0 0 0 7 8 9\n"
    (tmp_path / "t.txt").write_text(head.format(0, 0) + head.format(500, 2) + rows)
    first, second = read_frames(tmp_path / "t.txt")
    assert (first.step, len(first.id)) == (0, 0)
    assert (second.step, second.radius.tolist()) == (500, [0.2, 0.1])
    assert second.position.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert second.spin[0].tolist() == [7, 8, 9]


@pytest.mark.parametrize("engine", BED_WRITERS)
def test_a_bed_is_written_for_both_engines(engine, tmp_path):
    rng = np.random.default_rng(1)
    place = rng.uniform(0, 0.1, (20, 3))
    bed = Bed(place, np.full(20, 2.5e-3), np.zeros((20, 3)), (0, 0, 0), (0.1, 0.1, 0.2), 1e-5, 100)
    BED_WRITERS[engine](tmp_path, bed)
    text = "".join(path.read_text() for path in sorted(tmp_path.iterdir()))
    assert all(f"{x:.15g}" in text or repr(float(x)) in text for x in place.ravel())


def test_an_unknown_engine_is_refused(tmp_path):
    line = refused(explorer("export", "seed_pour", tmp_path / "new", "--to", "rocky"))
    assert line == "--to rocky: not a program; allowed: liggghts, yade, paraview, edem"
    assert not (tmp_path / "new").exists()


def test_a_folder_in_use_is_refused(tmp_path):
    (tmp_path / "note.txt").write_text("mine")
    line = refused(explorer("export", "seed_pour", tmp_path, "--to", "yade", *settings(TINY)))
    assert line == f"DIR {tmp_path}: is not empty; name a folder that is new or empty"


def test_what_liggghts_cannot_take_is_one_line(taichi, tmp_path):
    zero = np.zeros(1, dtype=np.int32)
    entries = Entries(zero * 1.0, zero, zero, np.ones((1, 3)), np.array([[1.0, 0, 0, 0]]), np.zeros((1, 3)))
    beads = assembled(bead_scene(), 0, 1e-6, 1, entries)
    with pytest.raises(CommandError, match="'bead': LIGGGHTS takes clumps of at least 2 spheres"):
        write_liggghts(tmp_path, beads)
    with pytest.raises(CommandError, match="'bead': LIGGGHTS takes clumps of at least 2 spheres"):
        EXPORTS["liggghts"].check(bead_scene())
    dull = with_values(load_scene("seed_pour"), {"pair.seed.seed.restitution": 0.15})
    with pytest.raises(CommandError, match=r"restitution 0.15: .* allowed: 0.22 … 1"):
        write_liggghts(tmp_path, assembled(dull, 0, 1e-6, 1, entries))
    assert list(tmp_path.iterdir()) == []


class Tally(ExportTarget):
    """A made-up program, which takes a file with the name of every material."""

    name, what, pours, options = "tally", "a list of names", False, ("every",)

    def check(self, scene):
        if len(scene.materials) > 9:
            raise CommandError("tally: too many materials")

    def write(self, folder, order):
        (folder / "names.txt").write_text("\n".join(one.name for one in order.scene.materials))
        return f"every {order.every:g} s, seed {order.seed}"


def test_a_program_of_a_plug_in_is_listed_and_written_for(tmp_path, monkeypatch):
    monkeypatch.setitem(EXPORTS.things, "tally", Tally())
    assert "tally     a list of names; nothing is poured; takes --every" in explorer("export", "--help").output
    result = explorer("export", "seed_pour", tmp_path / "new", "--to", "tally", "--every", "0.5", "--seed", "3")
    assert result.output == f"{tmp_path / 'new'}: every 0.5 s, seed 3\n"
    assert "seed" in (tmp_path / "new" / "names.txt").read_text().splitlines()
    line = refused(explorer("export", "seed_pour", tmp_path / "other", "--to", "edem", "--every", "0.5"))
    assert line == "--every: allowed only with --to paraview or tally, not with edem"


def test_the_page_names_programs_of_plug_ins_without_loading_them(monkeypatch):
    entry = EntryPoint("export.tally", "there.is.none:TALLY", GROUP)
    for module in ("explorer.export", "solver.plugins"):
        monkeypatch.setattr(f"{module}.plugged_in", lambda kind: {"tally": entry} if kind == "export" else {})
    assert names() == ("liggghts", "yade", "paraview", "edem", "tally")
    assert programs_text().endswith("edem: tables of the material. tally: of an unknown package.")


def test_a_title_of_several_lines_stays_a_comment(deck, tmp_path):
    write_liggghts(tmp_path, dataclasses.replace(deck, title="two\nrun 7"))
    assert (tmp_path / "in.liggghts").read_text().startswith("# two run 7, seed 5: ")
