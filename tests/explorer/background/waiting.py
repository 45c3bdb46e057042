"""Waiting for commands that run in the background, and finding what they leave."""

import time


def wait_for(condition, patience=120.0):
    """Until it holds; the patience is for a busy machine, on which a command in the background hardly gets a turn."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def only_folder(tmp_path):
    (folder,) = [entry for entry in (tmp_path / "out").iterdir() if entry.is_dir()]
    return folder
