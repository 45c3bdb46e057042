"""Which kernels are compiled and kept, so that only one of several processes that need the same kernels compiles them.

Positions in the arrays are constants in the kernels. Every :class:`solver.engine.state.Capacity` therefore has its own
kernels, and they also depend on what was allocated before: a set of kernels belongs to a sequence of capacities. Taichi
looks up the kept kernels when it starts, and does not see what another process compiles later. So a process that needs
several asks here before it starts Taichi: either it compiles them itself, or it waits until another process has.

Every set has a file beside Taichi's own. It is locked while a process compiles, and no process leaves a lock behind;
afterwards it lists the kernels that were there. A file that is empty, or names a missing kernel, counts as absent.
"""

from __future__ import annotations

import hashlib
import os
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from solver.arch import chosen
from solver.backend import keep_compiled, kernel_folder

if TYPE_CHECKING:
    from solver.engine.state import Capacity

if sys.platform != "win32":
    import fcntl


def missing(capacities: Sequence[Capacity]) -> list[Capacity]:
    """The ``capacities``, allocated in this order by one thread, whose kernels are not known to be kept."""
    there = set(_kernels())
    listed = [_listed(_place(capacities[: k + 1])) for k in range(len(capacities))]
    return [one for one, kernels in zip(capacities, listed, strict=True) if not kernels or not kernels <= there]


@contextmanager
def compiled_once(capacities: Sequence[Capacity]) -> Iterator[list[Capacity]]:
    """Wait for kernels that other processes compile; yields the ``capacities`` to compile in the with block.

    Taichi must not have been started in this process before, and ``capacities`` must be allocated in this order.
    Kernels that another process began but did not keep, because it was killed or its disk is full, are not yielded:
    they are compiled when they are needed, as if this function did not exist.
    """
    with ExitStack() as locks:
        kept_at_all = chosen() == "cpu" and os.environ.get("TI_OFFLINE_CACHE") != "0"
        # A process with several threads, such as a Dask worker, keeps none before it ends: nobody should wait for it.
        kept_at_all = kept_at_all and threading.active_count() == 1
        absent = missing(capacities) if kept_at_all else []
        # In the same order everywhere, so that no two processes wait for each other.
        places = sorted((_place(capacities[: capacities.index(one) + 1]), one) for one in absent)
        claimed = [one for place, one in places if _claimed(place, locks)]
        mine = [one for one in missing(capacities) if one in claimed]
        yield mine
        if mine and keep_compiled(least=0.0):
            kept = "\n".join(sorted(_kernels()))
            with suppress(OSError):
                for place, one in places:
                    if one in mine:
                        place.write_text(kept, encoding="ascii")


def _claimed(place: Path, locks: ExitStack) -> bool:
    """Lock ``place`` until ``locks`` are closed; False after waiting for another process that had it locked."""
    if sys.platform == "win32":  # every process compiles for itself
        return False
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        file = locks.enter_context(place.open("a", encoding="ascii"))
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        # Shared, so that none of many waiting processes waits for another one to start.
        with suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_SH)
        file.close()
        return False
    return True


def _kernels() -> list[str]:
    """Names of the kernels' files."""
    with suppress(OSError):
        return [file.name for file in kernel_folder().iterdir() if file.suffix == ".tic"]
    return []


def _listed(place: Path) -> set[str]:
    """Kernels that ``place`` names; none if it is not there."""
    try:
        return set(place.read_text(encoding="ascii").split())
    except (OSError, ValueError):
        return set()


def _place(capacities: Sequence[Capacity]) -> Path:
    """File of the kernels of the last of ``capacities``."""
    digest = hashlib.sha256(f"{list(capacities)} {_made_from()}".encode()).hexdigest()
    return kernel_folder() / f"{digest[:32]}.set"


@cache
def _made_from() -> str:
    """Digest of the sources that make the kernels."""
    solver = Path(__file__).parents[1]
    files = [solver / "backend.py", solver / "engine/state.py"]
    for folder in ("engine/kernels", "laws", "effects"):
        files += sorted((solver / folder).glob("*.py"))
    digest = hashlib.sha256(version("taichi").encode())
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()
