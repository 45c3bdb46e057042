"""Waiting for what runs in the background, and finding what they leave."""

import time

LONGEST_TURN = 1.0
"""[s] that one look counts for at most: while a virtual machine is held, its clock goes on and its programs do not."""


def wait_for(condition, patience=120.0, standing=lambda: ""):
    """What ``condition`` gives once that is true; ``standing`` tells what there is where it never is.

    The patience [s] is for a busy machine, on which a command in the background hardly gets a turn.
    """
    now = time.monotonic()
    while not (found := condition()):
        assert patience > 0.0, f"waited in vain; {standing()}"
        time.sleep(0.01)
        before, now = now, time.monotonic()
        patience -= min(now - before, LONGEST_TURN)
    return found


def only_folder(tmp_path):
    (folder,) = [entry for entry in (tmp_path / "out").iterdir() if entry.is_dir()]
    return folder
