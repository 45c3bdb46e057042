"""What a container or a job of a cluster may use, by control groups as Linux writes them."""

import os

import pytest

from solver import machine

V2, BOX = "0::/\n", "0::/user/me\n"
V1 = "9:pids:/\n4:cpu,cpuacct,memory:/box\n0::/\n"


@pytest.fixture
def groups(tmp_path):
    """Folder of control groups with files of these contents, as arguments."""

    def of(own, **contents):
        (tmp_path / "cgroup").write_text(own)
        for name, content in contents.items():
            file = tmp_path / "tree" / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(f"{content}\n")
        return tmp_path / "cgroup", tmp_path / "tree"

    return of


@pytest.mark.parametrize(
    ("own", "limits", "expected"),
    [
        (V2, {"memory.max": "2000000000"}, [2000000000]),
        (BOX, {"user/memory.max": "600000000", "user/me/memory.max": "max"}, [600000000]),
        ("0::/docker/5f/on/the/host\n", {"memory.max": "700000000"}, [700000000]),
        (
            V1,
            {"memory/box/memory.limit_in_bytes": "800000000", "memory/memory.limit_in_bytes": str(2**63 - 4096)},
            [800000000, 2**63 - 4096],
        ),
        (V2, {}, []),
    ],
)
def test_memory_limits(own, limits, expected, groups):
    assert list(machine.memory_limits(*groups(own, **limits))) == expected


@pytest.mark.parametrize(
    ("own", "limits", "expected"),
    [
        (V2, {"cpu.max": "200000 100000"}, 2),
        (V2, {"cpu.max": "150000 100000"}, 2),
        (V2, {"cpu.max": "5000 100000"}, 1),
        (V2, {"cpu.max": "max 100000"}, 8),
        (V2, {"cpu.max": "6400000 100000"}, 8),
        (BOX, {"user/cpu.max": "300000 100000", "user/me/cpu.max": "max 100000"}, 3),
        ("0::/docker/5f/on/the/host\n", {"cpu.max": "400000 100000"}, 4),
        (V1, {"cpu/box/cpu.cfs_quota_us": "50000", "cpu/box/cpu.cfs_period_us": "20000"}, 3),
        (V1, {"cpu/box/cpu.cfs_quota_us": "-1", "cpu/box/cpu.cfs_period_us": "100000"}, 8),
        (V2, {}, 8),
    ],
)
def test_cores_of_a_quota(own, limits, expected, groups, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: range(8), raising=False)
    assert machine.available_cores(*groups(own, **limits)) == expected


def test_cores_of_an_affinity(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {3, 5, 11}, raising=False)
    assert machine.available_cores(tmp_path / "nothing", tmp_path) == 3
    monkeypatch.delattr(os, "sched_getaffinity")  # as on macOS and Windows
    assert machine.available_cores(tmp_path / "nothing", tmp_path) == 64


def test_where_there_are_no_control_groups_memory_has_no_limit(tmp_path):
    assert list(machine.memory_limits(tmp_path / "nothing", tmp_path)) == []
