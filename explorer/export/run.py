"""Run an exported folder with the installed engine, and report how long its stepping loop took."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from explorer.errors import CommandError
from explorer.export.frames import FINAL, SphereFrame, final_frame
from explorer.export.liggghts import INPUT

LOOP = re.compile(r"Loop time of ([\d.eE+-]+) (?:s |on \d+ procs )?for (\d+) steps")


class PeerTimeout(CommandError):
    """Another engine exceeded its time limit; it has been stopped."""


@dataclass(frozen=True)
class PeerRun:
    """A finished run of another engine."""

    engine: str
    version: str
    steps: int
    wall_s: float
    """Wall time of the stepping loop, as the engine reports it [s]."""
    setup_s: float
    """Wall time of the rest: start, reading, setting up, writing [s]."""
    final: SphereFrame


def run_liggghts(folder: Path, dump_every: int = 0, limit: float | None = None) -> PeerRun:
    """Run ``in.liggghts`` in ``folder``; one process, stopped after ``limit`` [s] of wall time.

    Raises:
        PeerTimeout: it took longer than ``limit``.
        CommandError: LIGGGHTS is not installed, or it failed (the line says why).
    """
    program = installed("liggghts")
    log = "log.liggghts"
    options = ["-var", "dump_every", str(dump_every)]
    output, elapsed = _run([program, "-in", INPUT, "-log", log, "-nocite", *options], folder, {}, limit)
    version = re.search(r"Version (LIGGGHTS\S* \S+?),", output)
    return _finished("liggghts", version[1] if version else "unknown", folder, output, elapsed)


def run_yade(folder: Path, threads: int = 1, dump_every: int = 0, limit: float | None = None) -> PeerRun:
    """Run the YADE script in ``folder``, stopped after ``limit`` [s] of wall time.

    Raises:
        PeerTimeout: it took longer than ``limit``.
        CommandError: YADE is not installed, or it failed (the line says why).
    """
    program = installed("yade")
    script = next((path.name for path in sorted(folder.glob("yade_*.py"))), None)
    if script is None:
        raise CommandError(f"{folder}: holds no yade_*.py; export it with --to yade")
    command = [program, "-n", "-x", f"-j{threads}", script, *([str(dump_every)] if dump_every else [])]
    output, elapsed = _run(command, folder, {"OMP_WAIT_POLICY": "passive"}, limit)
    version = re.search(r"Welcome to Yade (\S+)", output)
    return _finished("yade", f"YADE {version[1]}" if version else "unknown", folder, output, elapsed)


def installed(name: str) -> str:
    """Path of the program ``name``; :class:`CommandError` if it is not on ``PATH``."""
    program = shutil.which(name)
    if program is None:
        raise CommandError(f"{name}: not installed (Debian: apt install {name})")
    return program


def _run(command: list[str], folder: Path, environment: dict[str, str], limit: float | None) -> tuple[str, float]:
    """Output and duration [s] of a program; the final state of an earlier run is removed first.

    The program has a process group of its own, which is killed at ``limit`` [s] and whenever this function exits early:
    otherwise a wrapper script (YADE's) would die alone and leave its child running.
    """
    (folder / FINAL).unlink(missing_ok=True)
    name, started = Path(command[0]).name, time.perf_counter()
    process = subprocess.Popen(
        command,
        cwd=folder,
        env=os.environ | environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    try:
        output, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired as late:
        raise PeerTimeout(f"{name}: stopped after {limit:g} s, the limit") from late
    finally:
        # The process is not yet reaped, so its number still identifies this group.
        if process.returncode is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
    elapsed = time.perf_counter() - started
    if process.returncode != 0 or not (folder / FINAL).is_file():
        raise CommandError(f"{name} failed in {folder}: {_reason(output)}")
    return output, elapsed


def _reason(output: str) -> str:
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    told = [line for line in lines if "error" in line.lower()]
    return (told or lines or ["no output"])[-1]


def _finished(engine: str, version: str, folder: Path, output: str, elapsed: float) -> PeerRun:
    loops = LOOP.findall(output)
    if not loops:
        raise CommandError(f"{engine} in {folder}: reported no loop time")
    wall = sum(float(seconds) for seconds, _ in loops)
    return PeerRun(engine, version, sum(int(steps) for _, steps in loops), wall, elapsed - wall, final_frame(folder))
