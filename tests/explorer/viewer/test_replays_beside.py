"""The pages that replay a recording beside the live one are all there, or none is left open."""

import threading

import pytest

from explorer.errors import CommandError
from explorer.recordings.pour_log import PourLog
from explorer.scene.file import load_scene
from explorer.viewer.output.recording_panel import replays_beside
from tests.explorer.recordings.test_pour_log import poses


def names() -> list[str]:
    return sorted(one.name for one in threading.enumerate() if one.name == "explorer-replay")


def test_none_is_left_open_where_one_of_them_cannot_be_read(server, tmp_path):
    with PourLog(tmp_path / "pour.rrd", load_scene("funnel"), seed=1) as log:
        log.frame(0.0, poses(0), {})
    (tmp_path / "text.rrd").write_text("not a recording")
    with pytest.raises(CommandError, match=r"text\.rrd: is not a rerun recording"):
        replays_beside([tmp_path / "pour.rrd", tmp_path / "text.rrd"], server)
    assert names() == []
    (replay,) = replays_beside([tmp_path / "pour.rrd"], server)
    assert names() == ["explorer-replay"]
    assert replay.address.startswith("http://127.0.0.1:")
    assert not replay.address.endswith(f":{server.get_port()}")
    replay.close()
    assert names() == []
