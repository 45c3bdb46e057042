"""What this process may use of the machine: CPU cores and memory, by its affinity and the control groups around it.

A container or a job of a cluster sees all cores and all memory of its host. As many workers as the host has cores would
share the few that are allowed, and each takes its memory.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

OWN, TREE = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")
"""What names the control groups of a process, and where groups are mounted on Linux."""


def available_cores(own: Path = OWN, tree: Path = TREE) -> int:
    """CPU cores that this process may use, at least one: those of its affinity, or the quota of its control groups.

    A quota of one and a half cores counts as two.
    """
    cores = os.cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):
        cores = min(cores, len(os.sched_getaffinity(0)))
    quotas = []
    for group, version in _groups("cpu", own, tree):
        with suppress(OSError, ValueError):  # no such file, or "max"
            if version == 2:
                quota, period = (group / "cpu.max").read_text(encoding="utf-8").split()
            else:
                quota, period = (
                    (group / f"cpu.cfs_{name}_us").read_text(encoding="utf-8") for name in ("quota", "period")
                )
            if int(quota) > 0:  # -1 is no limit in version 1
                quotas.append(math.ceil(int(quota) / int(period)))
    return max(1, min([cores, *quotas]))


def memory_limits(own: Path = OWN, tree: Path = TREE) -> Iterator[int]:
    """Limits [bytes] of the control groups around this process; none elsewhere than on Linux.

    Version 1 has a huge one where there is none.
    """
    for group, version in _groups("memory", own, tree):
        with suppress(OSError, ValueError):  # no such file, or "max"
            yield int((group / ("memory.max" if version == 2 else "memory.limit_in_bytes")).read_text(encoding="utf-8"))


def _groups(controller: str, own: Path, tree: Path) -> Iterator[tuple[Path, int]]:
    """Folders of the groups around this process, the innermost first, with the version of control groups, 1 or 2.

    ``own`` names them as ``0::/path`` (version 2) or ``4:memory:/path`` (version 1). In a container that sees itself as
    the root of ``tree`` the path names the host's groups, and the limit stands in the root.
    """
    try:
        lines = own.read_text(encoding="utf-8").splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, place = line.split(":", 2)
        if controllers and controller not in controllers.split(","):
            continue
        root = tree / controller if controllers else tree
        group = root / place.lstrip("/")
        for folder in (group, *group.parents):
            if folder.is_relative_to(root):
                yield folder, 1 if controllers else 2
