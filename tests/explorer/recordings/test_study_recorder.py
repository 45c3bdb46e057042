"""The verification pours of a study are recorded, one file per seed, and no other stage."""

import pytest
from rerun.chunk import RrdReader

from doe.pour_runner import PourRunner
from doe.run_records import Setting
from doe.store import Store
from explorer.recordings.pour_recorder import StudyRecorder
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
