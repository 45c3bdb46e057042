"""The process that reads angles while the solver goes on: piles in, angles out, until the line is cut.

The parent imports this file, so what reads is imported inside :func:`run` only.
"""

from __future__ import annotations

import signal
from multiprocessing.connection import Connection

from explorer.priority import LIVE, give_way


def run(line: Connection) -> None:
    """Main function of the process. It ends with the solver's process, whose end of the line closes with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    give_way(LIVE)
    from explorer.live.angle_reader import read_angles

    try:
        while True:
            line.send(read_angles(line.recv()))
    except (EOFError, OSError):
        return
