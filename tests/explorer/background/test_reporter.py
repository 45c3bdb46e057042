"""What a long command tells to CI, to its log, and of a pour that diverged."""

import io
import logging
import math
from collections import deque
from contextlib import redirect_stdout, suppress
from dataclasses import replace

import pytest

from doe.declared.pours import Ended
from explorer.background.events import PROGRESS
from explorer.background.progress import PourProgress, SetProgress
from explorer.background.reporter import LOG, MOST_SCENES, Reporter, reporter_of
from explorer.errors import CommandError
from explorer.scene.file import load_scene
from solver import Job, Outcome, PourBrokeOff, pour_key, with_values
from tests.doe.test_pour_runner import made_up
from tests.explorer.beads import bead_scene
from tests.explorer.command_line import explorer, refused
from tests.explorer.events import checked_events, lines_of


class Told:
    """A command that tells of one pour, and ends by ``ending`` if that is an error."""

    def __init__(self, folder, ending=None):
        printed, self.reporter = io.StringIO(), None
        with (
            suppress(CommandError, KeyboardInterrupt, RuntimeError),
            Reporter("diagnose", lambda line: None, printed) as self.reporter,
        ):
            self.reporter.begin(folder, resumed=True)
            progress = PourProgress(self.reporter)
            progress.compiling()
            progress.pour("screening", 3, Ended("drag 0", 7, Outcome.JAMMED, "it is blocked", wall_s=2.5))
            progress.stage("nothing acts")
            if ending is not None:
                raise ending
            self.reporter.result = folder / "diagnosis.json"
        self.events = checked_events(printed.getvalue())
        self.log = lines_of((folder / LOG).read_text())


def test_page_and_ci_read_the_same_events(tmp_path):
    told = Told(tmp_path)
    assert lines_of((tmp_path / PROGRESS).read_text()) == told.events
    assert [event["event"] for event in told.events] == ["start", "pour", "stage", "end"]
    pour, end = told.events[1], told.events[-1]
    assert (pour["stage"], pour["done"], pour["planned"], pour["run"]["wall_s"]) == ("screening", 1, 4, 2.5)
    assert (pour["run"]["outcome"], pour["run"]["message"]) == ("jammed", "it is blocked")
    assert (end["outcome"], end["result"], end["error"]) == ("finished", str(tmp_path / "diagnosis.json"), None)


@pytest.mark.parametrize(
    ("ending", "outcome", "error", "traceback"),
    [
        (KeyboardInterrupt(), "interrupted", "KeyboardInterrupt", False),
        (CommandError("no such\nfolder"), "failed", "no such folder", False),
        (RuntimeError("out of cheese"), "failed", "out of cheese", True),
    ],
)
def test_every_end_is_told_with_its_reason(tmp_path, ending, outcome, error, traceback):
    told = Told(tmp_path, ending)
    end, last = told.events[-1], told.log[-1]
    assert (end["outcome"], end["error"], end["result"]) == (outcome, error, None)
    assert last["level"] == "error"
    assert error in last["message"]
    assert ("traceback" in last) == traceback


def test_the_log_has_levels_one_run_and_what_a_pour_cost(tmp_path):
    told = Told(tmp_path)
    assert {line["run_id"] for line in told.log} == {told.reporter.run_id} == {told.events[0]["run_id"]}
    assert [line["level"] for line in told.log] == ["info", "warning", "info", "info"]
    assert told.log[0]["message"] == "diagnose: resumed"
    assert {"seed": 7, "outcome": "jammed", "wall_s": 2.5}.items() <= told.log[1].items()
    assert told.log[2]["message"] == "screening: nothing acts"
    assert not any(isinstance(one, logging.FileHandler) for one in logging.getLogger("explorer").handlers)


def test_the_time_left_of_a_campaign_follows_from_its_sets(tmp_path):
    now, printed, said = [0.0], io.StringIO(), []
    with Reporter("validate-diagnosis", said.append, printed, clock=lambda: now[0]) as reporter:
        reporter.begin(tmp_path)
        progress = SetProgress(reporter)
        now[0] = 60.0
        progress.judged(done=5, planned=10, judged_now=2, line="4: effect:air_drag")
    (judged, _) = checked_events(printed.getvalue())
    assert (judged["done"], judged["planned"], judged["eta_s"]) == (5, 10, 150.0)
    assert "5 of 10 data sets, about 2 min left" in said[0]


def diverged_pours(queue, room):
    for job, record in made_up(queue, room):
        yield job, replace(record, outcome=Outcome.OVERLAP_LIMIT, message="overlap of 0.2 radii at 0.1 s")


def test_the_scene_of_a_pour_that_diverged_is_written_and_named_a_few_times(tmp_path):
    said, scene = [], bead_scene()
    with Reporter("repeat", said.append) as reporter:
        reporter.begin(tmp_path)
        jobs = deque(Job(scene, seed) for seed in range(1, MOST_SCENES + 3))
        assert len(list(reporter.watched(diverged_pours)(jobs, [scene]))) == MOST_SCENES + 2
    assert len(list(tmp_path.glob("*.toml"))) == len(said) == MOST_SCENES
    file = tmp_path / "diverged_1.toml"
    assert f"explorer simulate {file} --seed 1" in said[0]
    assert "overlap of 0.2 radii" in said[0]
    assert pour_key(load_scene(str(file)), 1) == pour_key(scene, 1)


def test_two_scenes_that_diverge_with_one_seed_are_both_written(tmp_path):
    said, scenes = [], [bead_scene(), with_values(bead_scene(), {"pair.bead.bead.static_friction": 0.7})]
    with Reporter("repeat", said.append) as reporter:
        reporter.begin(tmp_path)
        list(reporter.watched(diverged_pours)(deque(Job(one, 4) for one in scenes), scenes))
    for name, scene, line in zip(("diverged_4.toml", "diverged_4_2.toml"), scenes, said, strict=True):
        assert f"explorer simulate {tmp_path / name} --seed 4" in line
        assert pour_key(load_scene(str(tmp_path / name)), 4) == pour_key(scene, 4)


def test_so_is_that_of_one_that_broke_off(tmp_path):
    def broken(queue, room):
        raise PourBrokeOff(queue.popleft(), RuntimeError("out of room"))
        yield

    said, scene = [], bead_scene()
    with Reporter("repeat", said.append) as reporter:
        reporter.begin(tmp_path)
        pours = reporter.watched(broken)(deque([Job(scene, 4)]), [scene])
        with pytest.raises(PourBrokeOff):
            list(pours)
    assert "out of room" in said[0]
    assert pour_key(load_scene(str(tmp_path / "diverged_4.toml")), 4) == pour_key(scene, 4)


def test_a_lost_worker_is_said_and_logged_and_pours_are_told_once(tmp_path):
    said = []
    with Reporter("repeat", said.append, every=math.inf) as reporter:
        reporter.begin(tmp_path)
        logging.getLogger("solver.pours.worker_pool").warning("a worker process has ended (%d of 3 losses)", 1)
        PourProgress(reporter).pour("pours", 0, Ended("a", 1, Outcome.JAMMED, ""))
    assert said == ["a worker process has ended (1 of 3 losses)"]
    levels = [(line["logger"], line["level"]) for line in lines_of((tmp_path / LOG).read_text())]
    assert ("solver.pours.worker_pool", "warning") in levels


def test_a_log_level_puts_the_log_on_standard_error(tmp_path):
    sets = ("validate-diagnosis", "--minutes", "0", "--out", tmp_path)
    log = lines_of(explorer("--log-level", "info", *sets).stderr)
    assert log[0]["message"] == "validate-diagnosis: started"
    assert explorer("--log-level", "warning", *sets).stderr == ""
    assert logging.getLogger("explorer").handlers == []
    assert "allowed: debug, info" in refused(explorer("--log-level", "loud", *sets))


def test_lines_go_where_standard_output_is_now():
    """While a bar is shown, rich stands there and prints above it."""
    reporter = reporter_of("repeat", json=False)
    with redirect_stdout(io.StringIO()) as above_the_bar:
        reporter.say("found it")
    assert above_the_bar.getvalue() == "found it\n"


def test_a_name_that_is_no_utf_8_ends_nothing(tmp_path, monkeypatch):
    # pytest would hand the log on from one of its processes to the other, which cannot be done with such a name.
    monkeypatch.setattr(logging.getLogger("explorer"), "propagate", False)
    folder = tmp_path / "b\udcff"
    folder.mkdir()
    told = Told(folder)
    assert told.events[-1]["result"] == str(folder / "diagnosis.json")
    assert Told(tmp_path, CommandError("b\udcff: no such folder")).events[-1]["error"] == "b\udcff: no such folder"


def test_half_a_line_of_a_command_that_was_killed_costs_no_event_of_the_next(tmp_path):
    (tmp_path / PROGRESS).write_text('{"event": "po')
    told = Told(tmp_path)
    assert lines_of((tmp_path / PROGRESS).read_text().partition("\n")[2]) == told.events
