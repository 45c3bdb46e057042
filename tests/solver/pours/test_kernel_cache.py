"""Kernels are kept as soon as they are compiled, one process compiles what several want, and none waits for ever."""

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest

from solver import backend, capacity_for, load_material, warm_up, with_values
from solver.engine.state import Capacity
from solver.pours import kernel_cache
from solver.pours.kernel_cache import compiled_once, missing
from solver.single_body.free_world import GRAIN, MANY_KINDS, ROOM, WALL, grain_on_plate, room_for, scene_of, sphere

ONE = Capacity(worlds=1, bodies=128, members=1024, contacts=16384)
OTHER = Capacity(worlds=1, bodies=256, members=1024, contacts=16384)

FIRST_LAUNCH = """
import os, signal, sys
import numpy as np
from solver import Batch, Pour, backend, capacity_for, load_material, with_values
backend.init(threads=1)
scene = with_values(load_material("sunflower_extract"), {"body.spheres": "coarse", "rig.mass": "1g"})
pour = Pour(Batch(capacity_for([scene], 1)), 0, scene, 1)
pour.batch.run(np.array([pour.steps_due(1)], dtype=np.int32))
if sys.argv[1] == "killed":
    os.kill(os.getpid(), signal.SIGKILL)
"""

HOLDER = """
import sys
from solver.pours.kernel_cache import compiled_once
from solver.engine.state import Capacity
with compiled_once([Capacity(worlds=1, bodies=128, members=1024, contacts=16384)]) as mine:
    print(len(mine), flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder of kernels, for this process and those that it starts."""
    monkeypatch.setenv("TI_OFFLINE_CACHE_FILE_PATH", str(tmp_path / "kernels"))
    # Threads of other tests are none of a command's, and one that wants kernels stands for a process.
    monkeypatch.setattr(kernel_cache.threading, "active_count", lambda: 1)
    (tmp_path / "kernels").mkdir()
    return tmp_path / "kernels"


@pytest.fixture
def compiled(folder, monkeypatch):
    """Stands for a compilation within `compiled_once` that is kept."""
    monkeypatch.setattr(kernel_cache, "keep_compiled", lambda least: True)
    return lambda: (folder / "Tabc.tic").touch()


def kernels(folder):
    return {file.name: file.stat().st_mtime_ns for file in folder.glob("*.tic")}


@pytest.mark.slow
def test_what_a_killed_process_compiled_is_kept(folder):
    command = [sys.executable, "-c", FIRST_LAUNCH]
    assert subprocess.run([*command, "killed"], check=False).returncode == -signal.SIGKILL
    kept = kernels(folder)
    assert kept
    subprocess.run([*command, "ends"], check=True)  # at its end Taichi writes whatever it had to compile
    assert kernels(folder) == kept


def test_a_copy_that_hangs_is_ended(monkeypatch):
    copies, fork = [], os.fork
    monkeypatch.setattr(backend, "LONGEST_WRITE", 0.0)
    monkeypatch.setattr(os, "fork", lambda: copies.append(fork()) or copies[-1])
    assert not backend._done_by_a_copy(signal.pause)
    with pytest.raises(ChildProcessError):
        os.waitpid(copies[0], os.WNOHANG)


def test_where_no_copy_can_be_made_a_pour_goes_on(monkeypatch):
    def full():
        raise BlockingIOError("no room for one more process")

    monkeypatch.setattr(os, "fork", full)
    before = len(list(Path("/proc/self/fd").iterdir()))
    assert not backend._done_by_a_copy(int)
    assert len(list(Path("/proc/self/fd").iterdir())) == before


@pytest.mark.parametrize(("work", "done"), [(int, True), (lambda: 1 / 0, False)], ids=["done", "failed"])
def test_a_copy_says_whether_it_did_its_work(work, done, capfd):
    assert backend._done_by_a_copy(work) == done
    assert capfd.readouterr().out == ""


def test_the_lock_of_a_killed_process_is_removed_once_it_is_old(folder):
    lock = folder / "ticache.lock"
    lock.touch()
    backend._drop_stale_lock()
    assert lock.exists()
    long_ago = time.time() - 2.0 * backend.STALE_LOCK
    os.utime(lock, (long_ago, long_ago))
    backend._drop_stale_lock()
    assert not lock.exists()


def test_kernels_belong_to_the_order_in_which_batches_are_allocated(compiled):
    with compiled_once([ONE, OTHER]) as mine:
        assert mine == [ONE, OTHER]
        compiled()
    assert missing([ONE, OTHER]) == []
    assert missing([ONE]) == []
    assert missing([OTHER]) == [OTHER]
    assert missing([OTHER, ONE]) == [OTHER, ONE]


def test_kernels_that_are_gone_are_compiled_again(compiled, folder):
    with compiled_once([ONE]):
        compiled()
    (folder / "Tabc.tic").unlink()
    assert missing([ONE]) == [ONE]


def test_nothing_is_noted_of_a_compilation_that_fails(compiled):
    with pytest.raises(MemoryError), compiled_once([ONE]):
        raise MemoryError
    assert missing([ONE]) == [ONE]


def waiting(monkeypatch):
    """A thread that wants the kernels of `ONE`, once it has to wait; what it is to compile goes into the list."""
    asks, result = threading.Event(), []
    flock = kernel_cache.fcntl.flock

    def told(file, operation):
        if operation == kernel_cache.fcntl.LOCK_SH:
            asks.set()
        flock(file, operation)

    def want():
        with compiled_once([ONE]) as mine:
            result.append(mine)

    monkeypatch.setattr(kernel_cache.fcntl, "flock", told)
    thread = threading.Thread(target=want)
    thread.start()
    assert asks.wait(60)
    return thread, result


def test_one_compiles_and_the_other_waits(compiled, monkeypatch):
    with compiled_once([ONE]) as mine:
        assert mine == [ONE]
        thread, result = waiting(monkeypatch)
        assert result == []
        compiled()
    thread.join(60)
    assert result == [[]]


def test_a_killed_process_lets_the_others_go_on(folder, monkeypatch):
    holder = subprocess.Popen([sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    with holder:
        assert holder.stdout.readline() == b"1\n"
        thread, result = waiting(monkeypatch)
        assert result == []
        holder.kill()
        thread.join(60)
    # It compiles when it comes to that, with nobody waiting for it: three that wait must not do so in turn.
    assert result == [[]]
    assert missing([ONE]) == [ONE]


@pytest.mark.parametrize(("variable", "value"), [("TI_OFFLINE_CACHE", "0"), ("EXPLORER_ARCH", "cuda")])
def test_where_nothing_is_kept_nobody_waits(folder, monkeypatch, variable, value):
    monkeypatch.setenv(variable, value)
    with compiled_once([ONE]) as mine:
        assert mine == []
    assert list(folder.iterdir()) == []


def test_a_single_body_needs_no_kernels_but_those_of_a_small_pour():
    pour = with_values(load_material("sunflower_extract"), {"body.spheres": "coarse", "rig.mass": "1g"})
    assert room_for(grain_on_plate()) == ROOM == capacity_for([pour], 1) == ONE
    many = scene_of([sphere(name=f"b{k}") for k in range(ROOM.kinds)], (GRAIN, WALL), grain_on_plate().pairs)
    assert room_for(many) == replace(ROOM, kinds=MANY_KINDS).rounded()


def test_warm_rooms_are_found(folder):
    """Alike ones are compiled once; what a pool needs afterwards is there."""
    scene = with_values(load_material("sunflower_extract"), {"body.spheres": "coarse", "rig.mass": "1g"})
    heavier = with_values(scene, {"rig.mass": "2g"})
    first = dict(warm_up([[scene], [heavier]]))
    assert first[0] > 0.0
    assert first[1] is None
    kept = kernels(folder)
    assert dict(warm_up([[scene], [heavier]])) == {0: None, 1: None}
    assert kernels(folder) == kept
