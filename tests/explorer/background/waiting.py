"""Waiting for what runs in the background, and finding what they leave."""

import time


def wait_for(condition, patience=120.0):
    """What it gives once that is true.

    The patience is for a busy machine, on which a command in the background hardly gets a turn.
    """
    end = time.monotonic() + patience
    while not (found := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)
    return found


def only_folder(tmp_path):
    (folder,) = [entry for entry in (tmp_path / "out").iterdir() if entry.is_dir()]
    return folder
