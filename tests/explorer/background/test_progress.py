"""What a study tells of its progress."""

import json
import os
import signal
from concurrent.futures import ThreadPoolExecutor

import pytest

from doe.run_records import Setting
from explorer.background.progress import RunProgress, told_of_pauses
from explorer.background.reporter import Reporter
from tests.doe.formula_runner import FormulaRunner


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


RUNS = [run for row in FormulaRunner(lambda values: 20.0, jam=0.3).run("scan", [Setting("a", {}, 12)]) for run in row]


@pytest.fixture
def reporter(tmp_path):
    with Reporter("calibrate", lambda line: None) as reporter:
        reporter.begin(tmp_path)
        yield reporter


def progress_of(reporter, clock):
    return RunProgress(reporter, {"pilot": 4, "scan": 12}, clock)


def events(tmp_path):
    return [json.loads(line) for line in (tmp_path / "progress.jsonl").read_text().splitlines()]


def test_every_run_is_told_with_its_outcome_and_every_stage_with_its_runs(tmp_path, reporter):
    progress = progress_of(reporter, Clock())
    progress.compiling()
    for run, left in zip(RUNS, range(20, 0, -1), strict=False):
        progress.run("scan", run, left)
    progress.stage("scan", "found")
    told = events(tmp_path)
    assert told[0]["stages"] == {"pilot": [0, 4], "scan": [0, 12]}
    assert told[0]["run"] is None
    assert [event["run"]["seed"] for event in told[1:-1]] == [run.seed for run in RUNS]
    assert [event["run"]["valid"] for event in told[1:-1]] == [run.outcome == "at_rest" for run in RUNS]
    assert any(not event["run"]["valid"] for event in told[1:-1])
    assert told[-2]["stages"]["scan"] == [len(RUNS), len(RUNS) + 20 - len(RUNS) + 1]
    assert (told[-1]["line"], told[-1]["run"]) == ("found", None)


def test_the_time_left_follows_from_finished_runs_without_pauses(reporter):
    clock = Clock()
    progress = progress_of(reporter, clock)
    assert progress.eta_s() is None
    for k in range(5):
        clock.now += 2.0
        progress.run("scan", RUNS[k], 11 - k)
    # The first run took 0.1 s by itself (FormulaRunner), four gaps of 2 s; 4 + 7 runs are left.
    expected = 11 * (0.1 + 4 * 2.0) / 5
    assert progress.eta_s() == pytest.approx(expected)
    clock.now += 3600.0
    progress.went_on()
    assert progress.eta_s() == pytest.approx(expected)
    clock.now += 2.0
    progress.run("scan", RUNS[5], 6)
    assert progress.eta_s() == pytest.approx(10 * (0.1 + 5 * 2.0) / 6)


def test_a_process_that_goes_on_is_told_so():
    told = []
    before = signal.getsignal(signal.SIGCONT)
    with told_of_pauses(lambda: told.append(1)):
        os.kill(os.getpid(), signal.SIGCONT)
    assert told == [1]
    assert signal.getsignal(signal.SIGCONT) == before


def test_a_study_may_run_in_another_thread():
    """As in a notebook that goes on meanwhile; only the main thread can be told of a pause."""

    def work():
        with told_of_pauses(lambda: None):
            return "done"

    with ThreadPoolExecutor() as threads:
        assert threads.submit(work).result() == "done"
