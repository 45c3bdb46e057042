"""The verification pours of a study are recorded, one file per seed, and no other stage."""

import pytest
from rerun.chunk import RrdReader

from doe.pour_runner import PourRunner, seed_of
from doe.run_records import Setting
from doe.store import Store
from explorer.errors import CommandError
from explorer.recordings.pour_recorder import StudyRecorder, check_recordings
from solver import load_material, with_values
from tests.explorer.command_line import TINY


@pytest.mark.usefixtures("taichi")
def test_only_verification_pours_are_recorded(tmp_path):
    scene = with_values(load_material("sunflower_extract"), TINY)
    store = Store(tmp_path / "runs.sqlite")
    with StudyRecorder(tmp_path / "recordings") as recorder:
        runner = PourRunner(scene, store, "test", 1, observer=recorder)
        runner.run("pilot", [Setting("reference", {}, 1)])
        runs = runner.run("verification", [Setting("optimum", {}, 1)])[0]
    files = sorted(path.name for path in (tmp_path / "recordings").iterdir())
    assert files == sorted(f"verification_{run.seed}.rrd" for run in runs)
    entities = {chunk.entity_path for chunk in RrdReader(str(tmp_path / "recordings" / files[0])).stream()}
    assert any(path.startswith("/world") for path in entities)
    check_recordings(tmp_path / "new", resume=False)
    check_recordings(tmp_path / "recordings", resume=True)
    with pytest.raises(CommandError, match=r"^--record \S*recordings: holds verification_\d+\.rrd already; name"):
        check_recordings(tmp_path / "recordings", resume=False)


@pytest.mark.usefixtures("taichi")
def test_the_recording_of_a_pour_that_was_cut_off_is_made_anew_and_none_is_lost(tmp_path):
    scene = with_values(load_material("sunflower_extract"), TINY)
    store = Store(tmp_path / "runs.sqlite")
    seed = seed_of(1, "verification", 0, 0, 0)
    cut = tmp_path / f"verification_{seed}.rrd"
    cut.write_bytes(b"RRF2")
    with StudyRecorder(tmp_path) as recorder:
        runner = PourRunner(scene, store, "test", 1, observer=recorder)
        (run,) = runner.run("verification", [Setting("optimum", {}, 1)])[0][:1]
    assert run.seed == seed
    assert any(chunk.entity_path.startswith("/world") for chunk in RrdReader(str(cut)).stream())
    assert (tmp_path / f"verification_{seed}_before_1.rrd").read_bytes() == b"RRF2"
