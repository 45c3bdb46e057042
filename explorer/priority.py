"""Processes that let others go first: the page and a browser beside it before the solver, both before a study.

Linux shares its processors between sessions first (sched(7), "autogroup"); niceness counts within one session only.
So a process that is to give way needs a session of its own, and that session the niceness too.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Sequence
from pathlib import Path

LIVE, BACKGROUND = 5, 15
"""Niceness of what a person looks at, and of what works in the background."""


def give_way(niceness: int) -> None:
    """Let the present process, and what it starts, go on at ``niceness``, in a session of its own."""
    os.nice(niceness)
    with contextlib.suppress(OSError):  # it leads a session already
        os.setsid()
    session_gives_way(os.getpid(), niceness)


def session_gives_way(process: int, niceness: int) -> None:
    """Let the session of ``process`` go on at ``niceness``; without effect where sessions are not told apart."""
    with contextlib.suppress(OSError):
        Path(f"/proc/{process}/autogroup").write_text(str(niceness), encoding="ascii")


def lowered(command: Sequence[str], niceness: int) -> list[str]:
    """``command`` as it is started with ``niceness``; as it is where there is no program `nice`."""
    nice = shutil.which("nice")
    return [*([nice, "-n", str(niceness)] if nice else []), *command]
