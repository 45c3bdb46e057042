"""Processes that give way: their niceness, and that of the session that Linux shares its processors between."""

import multiprocessing
import os
from pathlib import Path

import pytest

from explorer.priority import LIVE, give_way, session_gives_way

AUTOGROUP = Path("/proc/self/autogroup")


def gone_back(told):
    give_way(LIVE)
    told.send((os.nice(0), os.getsid(0) == os.getpid(), AUTOGROUP.read_text() if AUTOGROUP.exists() else None))


def test_a_process_gives_way_in_a_session_of_its_own():
    context = multiprocessing.get_context("spawn")
    near, far = context.Pipe()
    process = context.Process(target=gone_back, args=(far,))
    process.start()
    assert near.poll(60.0)
    niceness, leads, group = near.recv()
    process.join()
    assert niceness == min(19, os.nice(0) + LIVE)
    assert leads
    if group is None:
        pytest.skip("this kernel does not tell sessions apart")
    assert group.split()[-1] == str(LIVE)


def test_a_process_that_is_gone_is_no_trouble():
    process = multiprocessing.get_context("spawn").Process(target=int)
    process.start()
    process.join()
    mine = AUTOGROUP.read_text() if AUTOGROUP.exists() else None
    session_gives_way(process.pid, LIVE)
    assert not Path(f"/proc/{process.pid}").exists()
    assert (AUTOGROUP.read_text() if AUTOGROUP.exists() else None) == mine
