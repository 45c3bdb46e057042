"""Recordings, read back with rerun's own reader: what is in the file is what happened."""

import signal
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from rerun.chunk import RrdReader

from explorer.live.frames import Frame
from explorer.live.messages import SessionState, Status
from explorer.recordings.pour_log import PourLog
from explorer.recordings.pour_recorder import recorder_of
from explorer.recordings.recording import RecordedPour, recorded_lines
from explorer.recordings.recording_reader import read_recording
from explorer.recordings.session_recorder import SessionRecorder
from explorer.scene.file import load_scene, with_settings
from explorer.scene.meshes import rig_poses
from solver import Job, Outcome, Phase, Scene, run_pours, with_values
from tests.explorer.command_line import TINY

DISPERSED = {"effect.size_dispersion.spread": 0.1}
QUARTER_TURN = (0.5**0.5, 0.0, 0.5**0.5, 0.0)
ROOT = Path(__file__).parents[3]


@dataclass(frozen=True)
class Poses:
    """Made-up state of bodies."""

    component: npt.NDArray[np.int32]
    position: npt.NDArray[np.float64]
    quaternion: npt.NDArray[np.float64]
    inside: npt.NDArray[np.bool_]
    scale: npt.NDArray[np.float64]


def poses(*components: int, inside: tuple[bool, ...] | None = None) -> Poses:
    """Bodies of the given components, body k at (k, k, k) / 10 with a quaternion of its own."""
    n = len(components)
    quaternion = np.random.default_rng(1).normal(size=(n, 4))
    return Poses(
        np.array(components, dtype=np.int32),
        np.arange(n)[:, None] * np.full(3, 0.1),
        quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True),
        np.ones(n, dtype=bool) if inside is None else np.array(inside),
        1.0 + 0.1 * np.arange(n),
    )


def rows(path: Path, entity: str, column: str) -> list[np.ndarray]:
    """(rows of a component of an entity, in order of simulated time), each flat."""
    found = []
    for chunk in RrdReader(str(path)).stream():
        if chunk.entity_path != entity:
            continue
        batch = chunk.to_record_batch()
        if column not in batch.schema.names:
            continue
        values = batch.column(batch.schema.names.index(column)).to_pylist()
        times = batch.column(batch.schema.names.index("sim_time")).to_pylist() if not chunk.is_static else values
        found += [(time, np.array(value)) for time, value in zip(times, values, strict=True) if value is not None]
    return [value for _, value in sorted(found, key=lambda row: row[0])] if len(found) > 1 else [v for _, v in found]


def texts(path: Path) -> list[str]:
    return [str(value[0]) for value in rows(path, "/log", "TextLog:text")]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return with_settings(load_scene("funnel"), [f"{path}={value}" for path, value in TINY.items()])


@pytest.fixture(scope="module")
def poured(taichi, scene, tmp_path_factory):
    """A pour that is cut off in flight and its recording."""
    path = tmp_path_factory.mktemp("logs") / "pour.rrd"
    with recorder_of(path, [3]) as recorder:
        ((_, record),) = run_pours([Job(scene, 3)], on_sample=recorder.sample)
        recorder.finish(0, record)
    return record, path


def test_last_frame_is_the_record(poured):
    record, path = poured
    seen = 0
    for k, name in enumerate(record.bodies.component_names):
        chosen = record.bodies.component == k
        if chosen.any():
            last = rows(path, f"/world/bodies/{name}", "InstancePoses3D:translations")[-1].reshape(-1, 3)
            assert np.array_equal(last, record.bodies.position[chosen].astype(np.float32))
            seen += len(last)
    assert seen == len(record.bodies.mass) > 0


def test_a_pour_without_a_sample_is_not_recorded(poured, tmp_path):
    with recorder_of(tmp_path / "pour.rrd", [3]) as recorder:
        recorder.finish(0, poured[0])
    assert recorder.pours == ()
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("taichi")
def test_the_recorded_scene_has_the_set_up_effects_that_were_declared(scene, tmp_path):
    declared = with_values(scene, {"effect.plate_tilt.tilt_x": 2.0, "effect.funnel_offset.dx": 1e-3} | DISPERSED)
    with recorder_of(tmp_path / "pour.rrd", [3]) as recorder:
        ((_, record),) = run_pours([Job(declared, 3)], on_sample=recorder.sample)
        recorder.finish(0, record)
    assert rows(tmp_path / "pour.rrd", "/world/bodies/plate", "InstancePoses3D:scales")
    recorded = read_recording(tmp_path / "pour.rrd").scene
    assert recorded.effect("size_dispersion") == declared.effect("size_dispersion")
    assert recorded.effect("plate_tilt") == declared.effect("plate_tilt")
    assert recorded.effect("funnel_offset") == declared.effect("funnel_offset")


def test_curves_are_the_trace(poured):
    record, path = poured
    energy = rows(path, "/curves/energy/kinetic_energy_mJ", "Scalars:scalars")
    # a frame per 20 ms of a trace with 10 ms between samples, and always the last
    assert len(energy) == 1 + (len(record.trace.time) - 1) // 2 + (len(record.trace.time) - 1) % 2
    assert energy[-1][0] == 1e3 * record.trace.kinetic_energy[-1]
    entered = rows(path, "/curves/mass/entered_mass_g", "Scalars:scalars")
    assert entered[-1][0] == 1e3 * record.trace.entered_mass[-1]


def test_events_outcome_and_layout_are_there(poured):
    record, path = poured
    assert texts(path)[0] == "phase: fill"
    assert texts(path)[-1] == f"time limit: {record.message}"
    (document,) = rows(path, "/outcome", "TextDocument:text")
    assert "residual_mass_kg" in str(document[0])
    (parameters,) = rows(path, "/parameters", "TextDocument:text")
    assert "| rig.mass | 0.001 | kg |" in str(parameters[0])
    assert "Seed 3" in str(parameters[0])
    reader = RrdReader(str(path))
    assert len(reader.recordings()) == 1
    assert len(reader.blueprints()) == 1
    assert {"/world/plate", "/world/cone"} <= {chunk.entity_path for chunk in reader.stream()}


def test_quaternions_are_turned_round(scene, tmp_path):
    """wxyz here, xyzw in rerun."""
    state = poses(0, 0)
    with PourLog(tmp_path / "q.rrd", scene, seed=1) as log:
        log.frame(0.0, state, {})
    (written,) = rows(tmp_path / "q.rrd", "/world/bodies/seed", "InstancePoses3D:quaternions")
    assert np.array_equal(written.reshape(-1, 4), np.roll(state.quaternion, -1, axis=1).astype(np.float32))


def test_surfaces_are_where_they_have_moved(tmp_path):
    scene = with_settings(load_scene("lifting_cylinder"), ["rig.mass=1g", "body.spheres=coarse"])
    path, moved = tmp_path / "lift.rrd", rig_poses(scene.rig)
    with PourLog(path, scene, seed=1) as log:
        log.frame(0.0, poses(0), {}, gate_shut=True, surfaces=moved)
        moved = moved.copy()
        moved[1] = (0.0, 0.0, 0.04, *QUARTER_TURN)
        log.frame(0.1, poses(0), {}, surfaces=moved)
        log.frame(0.2, poses(0), {}, surfaces=moved)
    (place,) = rows(path, "/world/cylinder", "Transform3D:translation")
    (turn,) = rows(path, "/world/cylinder", "Transform3D:quaternion")
    assert place.ravel() == pytest.approx([0.0, 0.0, 0.04])
    assert turn.ravel() == pytest.approx([*QUARTER_TURN[1:], QUARTER_TURN[0]])
    assert rows(path, "/world/plate", "Transform3D:translation") == []


def test_bodies_are_drawn_at_their_size(scene, tmp_path):
    """Scales are there for a component whose sizes scatter, and only for it."""
    varied = with_values(scene, {"body.seed.size_distribution": "uniform", "body.seed.size_spread": 0.1})
    with PourLog(tmp_path / "sizes.rrd", varied, seed=1) as log:
        log.frame(0.0, poses(0, 1, 0, inside=(True, True, True)), {})
    (written,) = rows(tmp_path / "sizes.rrd", "/world/bodies/seed", "InstancePoses3D:scales")
    # single precision
    assert written.reshape(-1, 3) == pytest.approx(np.repeat([[1.0], [1.2]], 3, axis=1), rel=1e-7)
    assert rows(tmp_path / "sizes.rrd", "/world/bodies/plate", "InstancePoses3D:scales") == []


def test_only_bodies_in_the_domain_have_an_instance(scene, tmp_path):
    path = tmp_path / "bodies.rrd"
    with PourLog(path, scene, seed=1) as log:
        log.frame(0.0, poses(0), {})
        log.frame(0.1, poses(0, 1, 0), {})
        log.frame(0.2, poses(0, 1, 0, inside=(True, False, False)), {})
        log.frame(0.3, poses(0, 1, 0, 1, inside=(True, False, False, True)), {})
    seeds = rows(path, "/world/bodies/seed", "InstancePoses3D:translations")
    assert [value.size // 3 for value in seeds] == [1, 2, 1, 1]
    plates = rows(path, "/world/bodies/plate", "InstancePoses3D:translations")
    assert [value.size // 3 for value in plates] == [1, 1]
    # entered, taken out, entered again: the mesh comes, is cleared, comes again
    assert len(rows(path, "/world/bodies/plate", "Mesh3D:vertex_positions")) == 2
    assert len(rows(path, "/world/bodies/plate", "Clear:is_recursive")) == 1
    assert "/world/bodies/petiole" not in {chunk.entity_path for chunk in RrdReader(str(path)).stream()}


def test_gate_is_drawn_while_it_is_shut(scene, tmp_path):
    path = tmp_path / "gate.rrd"
    with PourLog(path, scene, seed=1) as log:
        for k, shut in enumerate((True, True, False, False)):
            log.frame(0.1 * k, poses(0), {}, gate_shut=shut)
    assert len(rows(path, "/world/gate", "Mesh3D:vertex_positions")) == 1
    assert len(rows(path, "/world/gate", "Clear:is_recursive")) == 1


def test_a_curve_has_gaps_where_nothing_was_measured(scene, tmp_path):
    path = tmp_path / "gaps.rrd"
    with PourLog(path, scene, seed=1) as log:
        for k, angle in enumerate((np.nan, 20.0, np.nan, 21.0)):
            log.frame(0.1 * k, poses(0), {"angle_of_repose_deg": angle})
    angles = rows(path, "/curves/angle/angle_of_repose_deg", "Scalars:scalars")
    assert [float(value[0]) for value in angles] == [20.0, 21.0]


KILLED = """
import os, signal, sys
from pathlib import Path
from explorer.recordings.pour_log import PourLog
from tests.explorer.recordings.test_pour_log import poses
from explorer.scene.file import load_scene
log = PourLog(Path(sys.argv[1]), load_scene("funnel"), seed=1)
for k in range(20):
    log.frame(0.02 * k, poses(0, 0), {})
log.flush()
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_killed_writer_leaves_a_readable_file(tmp_path):
    path = tmp_path / "killed.rrd"
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], cwd=ROOT, timeout=60)
    assert done.returncode == -signal.SIGKILL
    assert len(rows(path, "/world/bodies/seed", "InstancePoses3D:translations")) == 20
    assert len(read_recording(path).times) == 20


def frame(number: int, generation: int, time: float) -> Frame:
    state = poses(0, 0)
    return Frame(
        number,
        generation,
        time,
        state.position.astype(np.float32),
        state.quaternion.astype(np.float32),
        state.component,
        state.inside,
        state.scale.astype(np.float32),
    )


def status(scene: Scene, generation: int, **others) -> Status:
    return Status(SessionState.RUNNING, "", scene, seed=9, generation=generation, speed=1.0, **others)


def test_a_session_is_recorded_pour_by_pour(scene, tmp_path):
    harder = with_values(scene, {"pair.seed.seed.static_friction": 0.7})
    recorder = SessionRecorder(tmp_path / "live.rrd")
    recorder.take(frame(1, 1, 0.0), status(scene, 1))
    recorder.take(frame(2, 1, 0.01), status(scene, 1, discharged_mass=0.5e-3))
    moving = {"entered_mass": 0.9e-3, "discharged_mass": 0.7e-3, "kinetic_energy": 2e-6, "contacts": 12}
    recorder.take(frame(3, 1, 0.1), status(harder, 1, phase=Phase.PILE, **moving))
    # the status is still of the pour before: not to be mixed
    recorder.take(frame(4, 2, 0.0), status(harder, 1))
    recorder.take(frame(4, 2, 0.0), status(harder, 2))
    recorder.close()
    first, second = tmp_path / "live.rrd", tmp_path / "live_2.rrd"
    assert sorted(tmp_path.iterdir()) == [first, second]
    # 10 ms after the first frame none was due
    assert len(rows(first, "/world/bodies/seed", "InstancePoses3D:translations")) == 2
    # In the units of the names: g and mJ.
    expected = {"mass/entered_mass_g": 0.9, "mass/discharged_mass_g": 0.7, "energy/kinetic_energy_mJ": 2e-3}
    for curve, number in (expected | {"contacts/contacts": 12}).items():
        assert float(rows(first, f"/curves/{curve}", "Scalars:scalars")[-1][0]) == pytest.approx(number)
    assert texts(first) == [
        "phase: fill",
        "phase: pile",
        "pair.seed.seed.static_friction: 0.57 → 0.7",
    ]
    assert texts(second) == ["phase: fill"]


def test_what_repeats_itself_after_going_back_is_recorded_once(scene, tmp_path):
    recorder = SessionRecorder(tmp_path / "live.rrd")
    for time in (0.0, 0.1, 0.2, 0.1, 0.15, 0.2, 0.3):
        recorder.take(frame(1, 1, time), status(scene, 1, time=time))
    recorder.close()
    (path,) = tmp_path.iterdir()
    found = rows(path, "/world/bodies/seed", "InstancePoses3D:translations")
    assert len(found) == 4
    assert texts(path) == ["phase: fill"]


def test_a_pour_that_goes_on_with_other_parameters_after_going_back_has_a_file_of_its_own(scene, tmp_path):
    harder = with_values(scene, {"pair.seed.seed.static_friction": 0.7})
    recorder = SessionRecorder(tmp_path / "live.rrd")
    for time, now in ((0.0, scene), (0.1, scene), (0.2, harder), (0.3, harder)):
        recorder.take(frame(1, 1, time), status(now, 1, time=time))
    # Back to before the change, which does not come again by itself: the same until there, and another pour after it.
    recorder.take(frame(2, 1, 0.1), status(scene, 1, time=0.1))
    recorder.take(frame(2, 1, 0.15), status(scene, 1, time=0.15))
    assert len(list(tmp_path.iterdir())) == 1
    recorder.take(frame(2, 1, 0.25), status(scene, 1, time=0.25))
    recorder.take(frame(2, 1, 0.35), status(scene, 1, time=0.35))
    recorder.close()
    assert len(rows(tmp_path / "live.rrd", "/world/bodies/seed", "InstancePoses3D:translations")) == 4
    assert len(rows(tmp_path / "live_2.rrd", "/world/bodies/seed", "InstancePoses3D:translations")) == 2
    assert texts(tmp_path / "live_2.rrd") == ["brought back to 0.250 s, and on with other parameters"]


TAPPED = {"disturbance": "the plate is tapped", "disturbed": True}


@pytest.mark.parametrize(("first", "then"), [(TAPPED, {}), ({}, TAPPED)])
def test_a_pour_that_is_disturbed_otherwise_after_going_back_has_a_file_of_its_own(first, then, scene, tmp_path):
    recorder = SessionRecorder(tmp_path / "live.rrd")
    for time, how in ((0.0, {}), (0.1, {}), (0.2, first), (0.3, first)):
        recorder.take(frame(1, 1, time), status(scene, 1, time=time, **how))
    # What is repeated as it was needs no file of its own, even if its status comes a little later.
    for time, how in ((0.1, {}), (0.21, first)):
        recorder.take(frame(2, 1, time), status(scene, 1, time=time, **how))
    assert len(list(tmp_path.iterdir())) == 1
    recorder.take(frame(2, 1, 0.1), status(scene, 1, time=0.1))
    recorder.take(frame(2, 1, 0.25), status(scene, 1, time=0.25, **then))
    recorder.close()
    assert texts(tmp_path / "live_2.rrd") == ["brought back to 0.250 s, and on disturbed otherwise"]


def test_the_newest_frame_of_every_pour_is_recorded(scene, tmp_path):
    """Although it comes within 20 ms of the one before, in which none is due: a file has its whole length."""
    recorder = SessionRecorder(tmp_path / "live.rrd")
    for generation, times in ((1, (0.0, 0.1, 0.11)), (2, (0.0, 0.05, 0.0625, 0.0625))):
        for time in times:
            recorder.take(frame(1, generation, time), status(scene, generation, time=time))
    recorder.close()
    first, second = recorder.pours
    assert read_recording(first.path).times == pytest.approx([0.0, 0.1, 0.11])
    assert read_recording(second.path).times == pytest.approx([0.0, 0.05, 0.0625])
    assert (first.length, second.length) == ("0.110 s, from 0.000 to 0.110 s", "0.062 s, from 0.000 to 0.062 s")


def test_the_last_frame_comes_after_the_word_that_the_pour_has_ended(scene, tmp_path):
    recorder = SessionRecorder(tmp_path / "live.rrd")
    recorder.take(frame(1, 1, 0.1), status(scene, 1, time=0.1))
    ended = replace(status(scene, 1, time=0.115), state=SessionState.ENDED, outcome=Outcome.AT_REST)
    recorder.take(frame(2, 1, 0.11), ended)
    recorder.take(frame(3, 1, 0.115), ended)
    recorder.close()
    assert read_recording(tmp_path / "live.rrd").times == pytest.approx([0.1, 0.11, 0.115])


def test_a_file_of_another_recording_is_passed_over(scene, tmp_path):
    (tmp_path / "live_2.rrd").write_text("mine")
    recorder = SessionRecorder(tmp_path / "live.rrd")
    for generation in (1, 2, 3):
        recorder.take(frame(1, generation, 0.0), status(scene, generation))
    recorder.close()
    assert [pour.path.name for pour in recorder.pours] == ["live.rrd", "live_3.rrd", "live_4.rrd"]
    assert (tmp_path / "live_2.rrd").read_text() == "mine"


def test_what_a_recording_holds_is_told_in_words(tmp_path):
    empty = RecordedPour(tmp_path / "a.rrd")
    moment = RecordedPour(tmp_path / "b.rrd").with_frame(1.911)
    pour = moment.with_frame(1.95)
    assert recorded_lines([empty, moment, pour]) == [
        "3 pours recorded:",
        f"{tmp_path}/a.rrd: no body yet",
        f"{tmp_path}/b.rrd: a single moment, at 1.911 s",
        f"{tmp_path}/b.rrd: 0.039 s, from 1.911 to 1.950 s",
    ]
    assert [one.plays for one in (empty, moment, moment.with_frame(1.92), pour)] == [False, False, False, True]
    assert recorded_lines([pour])[0] == "1 pour recorded:"
    assert recorded_lines([]) == ["nothing was recorded: no pour had begun"]


def test_a_session_s_outcome_is_recorded_once(scene, tmp_path):
    import dataclasses

    ended = dataclasses.replace(status(scene, 1), state=SessionState.ENDED, outcome=Outcome.AT_REST)
    recorder = SessionRecorder(tmp_path / "live.rrd")
    recorder.take(frame(1, 1, 0.0), status(scene, 1))
    recorder.take(frame(2, 1, 0.001), ended)
    recorder.take(frame(2, 1, 0.001), ended)
    recorder.close()
    assert texts(tmp_path / "live.rrd").count("at rest") == 1
    assert len(rows(tmp_path / "live.rrd", "/world/bodies/seed", "InstancePoses3D:translations")) == 2
