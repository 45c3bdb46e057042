"""What a diagnosis tells while it runs, read back by the page's readers."""

import json

from doe.declared.pours import Ended
from explorer.background.command_process import CommandStatus
from explorer.background.events import ProgressEvent, failures, with_event, with_run
from explorer.background.progress import PourProgress
from explorer.background.reporter import Reporter
from explorer.viewer.study.process_view import state_markdown
from solver import Outcome


def test_a_pour_that_broke_off_is_told_with_its_seed(tmp_path):
    with Reporter("diagnose", lambda line: None) as reporter:
        reporter.begin(tmp_path)
        progress = PourProgress(reporter)
        progress.pour("screening", 2, Ended("air_drag@2 0, fast", 11, Outcome.AT_REST, ""))
        progress.pour("screening", 1, Ended("air_drag@2 1, fast", 12, Outcome.JAMMED, "the outlet is blocked"))
    stages, tried = (), ()
    for line in (tmp_path / "progress.jsonl").read_text().splitlines():
        event = ProgressEvent.from_dict(json.loads(line))
        stages, tried = with_event(stages, event), with_run(tried, event)
    (lost,) = failures(tried)
    assert (lost.run.label, lost.run.seed, lost.replaced_by) == ("air_drag@2 1, fast", 12, None)
    shown = state_markdown(CommandStatus("running", stages=stages, tried=tried), "diagnosis", "pours")
    assert r"| screening | air\_drag@2 1, fast | jammed: the outlet is blocked | 12 | none |" in shown
