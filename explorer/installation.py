"""What this installation has, what it lacks, and what that limits: every answer is found by a trial of seconds.

What can crash or hang is tried in a process of its own: Taichi, whose core library is linked against X11, and a
graphics processor with its driver.
"""

from __future__ import annotations

import ctypes
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from solver import available_cores, memory_limits

DISTRIBUTION = "repose-explorer"
PYTHONS = ((3, 11), (3, 12))
"""With which this program is tested."""
CHROMIUM_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""Of the browser that the tests take, on PATH."""
GPUS = {"cuda": "libcuda.so.1", "vulkan": "libvulkan.so.1"}
"""Architectures beside the processor, and the library of each driver."""
LONGEST_TRIAL = 180.0
"""[s] after which Taichi is taken to hang; it starts in one to two, and in a minute on a very busy machine."""
PAGE_GB = 0.5
"""Resident memory of a command or a page beside its workers [GB], generously."""
OPTIONAL = (
    ("Dask", "distributed", "dask", "--scheduler (pours on many machines)"),
    ("meshio", "meshio", "paraview", "export --to paraview"),
    ("Matplotlib", "matplotlib", "paper", "figures/ of a report (SVG, PDF)"),
    ("NiceGUI", "nicegui", "tables", "tables and pictures to edit in a window of their own, from the page"),
)
"""Name, module, extra of this distribution, what does not work without."""
PEERS = (
    ("LIGGGHTS", "liggghts", "its rows in bench, verify --peers, running exported decks"),
    ("YADE", "yade", "its rows in bench, running exported decks"),
)


@dataclass(frozen=True)
class Finding:
    """One thing that was looked for."""

    thing: str
    present: bool
    found: str
    """Version, place or number; of what is missing, how that was seen."""
    limits: str
    """What does not work without it, or works worse."""
    remedy: str
    """How to get it."""
    needed: bool = False
    """Whether pouring, calibrating, diagnosing and the page all want it."""


@dataclass(frozen=True)
class SolverTrial:
    """What a process of its own says of the solver; ``error`` is empty where its start went well."""

    error: str
    kernel_folder: str = ""
    kernels: int = 0
    """Compiled kernels that are kept."""
    study_compiled: bool = False
    """Whether those of the shipped study are among them."""


def examined(port: int) -> list[Finding]:
    """Look for everything; what cannot be asked, because a package is missing, is left out.

    Parameters
    ----------
    port
        The one that a page is to have on 127.0.0.1.
    """
    first = [_python(), _packages()]
    if not ready(first):  # What follows imports those packages.
        return first
    solver = _solver_trial()
    return [
        *first,
        *_x11(),
        _taichi(solver),
        _gpu(),
        _cores(),
        _memory(),
        *_folders(solver),
        *_kernels(solver),
        _port(port),
        *_peers(),
        *_optional(),
        _chromium(),
    ]


def ready(findings: Sequence[Finding]) -> bool:
    """Whether nothing that is needed is missing."""
    return all(one.present or not one.needed for one in findings)


def examined_result(findings: Sequence[Finding]) -> dict[str, Any]:
    """Plain data: ``ready``, ``findings`` with the fields of `Finding`, ``versions`` (null: not installed)."""
    names = (DISTRIBUTION, "taichi", "numpy", "viser")
    versions = {name: _version(name) for name in names}
    return {"ready": ready(findings), "findings": [asdict(one) for one in findings], "versions": versions}


def examined_text(findings: Sequence[Finding]) -> str:
    """A table of a line each, and whether the main path works."""
    from explorer.terminal.text_table import text_table

    rows = [
        (one.thing, "present", one.found, "", "")
        if one.present
        else (one.thing, "missing" + ", needed" * one.needed, one.found, one.limits, one.remedy)
        for one in findings
    ]
    table = text_table(("thing", "state", "found", "limits", "remedy"), rows)
    needed = [one.thing for one in findings if one.needed and not one.present]
    others = sum(not one.present for one in findings) - len(needed)
    verdict = (
        f"not ready: {', '.join(needed)}" if needed else "ready: pouring, calibrating, diagnosing and the page work"
    )
    return f"{table}\n\n{verdict}; optional items missing: {others}"


def tell_of_solver() -> None:
    """Print a `SolverTrial` of the chosen processor as JSON; in a process of its own, where Taichi may crash."""
    from explorer.scene.file import DEFAULT_STUDY, load_scene
    from solver.backend import kernel_folder, trial
    from solver.pours.kernel_cache import missing
    from solver.pours.worker_pool import Room, Rooms

    folder = kernel_folder()
    kernels = sum(1 for _ in folder.glob("*.tic")) if folder.is_dir() else 0
    compiled = not missing(Rooms().make(Room.of([load_scene(DEFAULT_STUDY)])))
    trial()
    print(json.dumps(asdict(SolverTrial("", str(folder), kernels, compiled))))


def _python() -> Finding:
    return Finding(
        "Python",
        sys.version_info[:2] in PYTHONS,
        f"{'.'.join(map(str, sys.version_info[:3]))}, {sys.executable}",
        "everything: the program is tested with 3.11 and 3.12",
        "Python 3.11 or 3.12",
        needed=True,
    )


def _packages() -> Finding:
    """What the distribution requires without extras, by name; pip sees to the versions."""
    try:
        required = [one for one in metadata.requires(DISTRIBUTION) or [] if "extra ==" not in one]
    except metadata.PackageNotFoundError:
        return Finding(
            "Python packages",
            False,
            f"{DISTRIBUTION} is not installed; a source tree is run as it stands",
            "versions in results; whether all packages are there is not known",
            "make venv",
        )
    names = [re.split(r"[^A-Za-z0-9_.-]", one, maxsplit=1)[0] for one in required]
    absent = [name for name in names if _version(name) is None]
    return Finding(
        "Python packages",
        not absent,
        f"no {', '.join(absent)}" if absent else f"all {len(names)}, {DISTRIBUTION} {_version(DISTRIBUTION)}",
        "everything",
        f"pip install {DISTRIBUTION}",
        needed=True,
    )


def _x11() -> Iterator[Finding]:
    if sys.platform != "linux":
        return
    name = "libX11.so.6"
    yield Finding(
        "X11 library",
        _loads(name),
        name if _loads(name) else f"{name} cannot be loaded",
        "everything: Taichi is linked against it, also where no window is opened",
        "apt install libx11-6",
        needed=True,
    )


def _taichi(solver: SolverTrial) -> Finding:
    return Finding(
        "Taichi on the CPU",
        not solver.error,
        solver.error or f"{_version('taichi')}, double precision",
        "everything but reading results",
        "apt install libx11-6" if "libX11" in solver.error else "pip install --force-reinstall taichi==1.7.4",
        needed=True,
    )


def _gpu() -> Finding:
    """The first graphics processor on which Taichi calculates in double precision."""
    seen = []
    for arch, library in GPUS.items():
        error = _apart("from solver.backend import trial; trial()", arch).error if _loads(library) else f"no {library}"
        seen.append(f"{arch}: {error or 'double precision'}")
        if not error:
            break
    return Finding(
        "GPU for Taichi",
        not error,
        seen[-1] if not error else "; ".join(seen),
        "--arch cuda, --arch vulkan; the CPU is the reference and is enough",
        "a GPU with its driver (NVIDIA: libcuda.so.1)",
    )


def _cores() -> Finding:
    cores, allowed = os.cpu_count() or 1, available_cores()
    return Finding(
        "CPU cores",
        allowed > 1,
        f"{cores}" if allowed == cores else f"{allowed} of {cores} allowed to this process",
        "the page's frame rate and the speed of studies: page, live pour and workers share cores",
        "two cores or more",
    )


def _memory() -> Finding:
    from explorer.scene.pour_cost import WORKER_GB

    wanted = PAGE_GB + available_cores() * WORKER_GB
    there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    allowed = min((limit / 1e9 for limit in memory_limits()), default=there)
    found = f"{there:.1f} GB" if allowed >= there else f"{allowed:.1f} of {there:.1f} GB allowed to this process"
    return Finding(
        "memory",
        min(allowed, there) >= wanted,
        f"{found}; a study on all cores takes {wanted:.1f} GB",
        "studies on all cores",
        "--threads 1, or more memory",
    )


def _folders(solver: SolverTrial) -> Iterator[Finding]:
    from doe.store import default_store
    from explorer.scene.presets import data_folder
    from solver.shapes.clump import cache_folder

    yield _folder(
        "folder of pours", default_store().parent, "calibrate, diagnose, serve", "--store FILE, or REPOSE_STORE=FILE"
    )
    yield _folder(
        "folder of the page", data_folder(), "results, presets and uploads of serve", "XDG_DATA_HOME=FOLDER", False
    )
    yield _folder(
        "folder of body fits",
        cache_folder(),
        "member spheres of your own bodies are fitted in every command, for seconds",
        "REPOSE_CACHE=FOLDER",
        False,
    )
    if solver.kernel_folder:
        yield _folder(
            "folder of kernels",
            Path(solver.kernel_folder),
            "every command compiles the solver anew, for some seconds",
            "TI_OFFLINE_CACHE_FILE_PATH=FOLDER",
            False,
        )


def _folder(thing: str, folder: Path, limits: str, remedy: str, needed: bool = True) -> Finding:
    """Whether ``folder``, or the first above it that there is, takes a file. It is not made."""
    there = folder
    try:
        there = next(one for one in (folder, *folder.absolute().parents) if one.exists())
        with tempfile.TemporaryFile(dir=there) as file:
            file.write(bytes(4096))
            file.flush()
    except OSError as error:
        return Finding(thing, False, f"{folder}: {there}: {error.strerror}", limits, remedy, needed)
    free = shutil.disk_usage(there).free / 1e9
    return Finding(thing, True, f"{folder}, {free:.1f} GB free", limits, remedy, needed)


def _kernels(solver: SolverTrial) -> Iterator[Finding]:
    if solver.error:  # There is nobody to ask.
        return
    yield Finding(
        "compiled kernels",
        solver.study_compiled,
        f"{solver.kernels} kept, those of the shipped study {'' if solver.study_compiled else 'not '}among them",
        "the first command of a kind waits some seconds for them",
        "explorer warm-up",
    )


def _port(port: int) -> Finding:
    from explorer.viewer.guarded_server import PortError, free_port

    try:
        free_port("127.0.0.1", port)
        error = ""
    except PortError as refused:
        error = str(refused)
    return Finding(
        f"port {port}",
        not error,
        error or "free on 127.0.0.1",
        f"serve --port {port}",
        "serve --port 0 takes a free one",
    )


def _peers() -> Iterator[Finding]:
    for thing, program, limits in PEERS:
        yield _program(thing, (program,), limits, f"apt install {program}")


def _chromium() -> Finding:
    limits = "browser tests and make pictures of a checkout; no command wants it"
    return _program("Chromium", CHROMIUM_NAMES, limits, "apt install chromium")


def _program(thing: str, names: Sequence[str], limits: str, remedy: str) -> Finding:
    place = next(filter(None, map(shutil.which, names)), None)
    return Finding(thing, place is not None, place or f"no {', '.join(names)} on PATH", limits, remedy)


def _optional() -> Iterator[Finding]:
    for thing, module, extra, limits in OPTIONAL:
        there = find_spec(module) is not None
        found = _version(module) or "there" if there else f"no module {module}"
        yield Finding(thing, there, found, limits, f"pip install '{DISTRIBUTION}[{extra}]'")


def _solver_trial() -> SolverTrial:
    return _apart("from explorer.installation import tell_of_solver; tell_of_solver()", "cpu")


def _apart(program: str, arch: str) -> SolverTrial:
    """What ``program`` tells, run in a process that calculates on ``arch`` and keeps no kernels."""
    # What this process imports, that one can, also from a source tree.
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "EXPLORER_ARCH": arch, "TI_OFFLINE_CACHE": "0"}
    command = [sys.executable, "-P", "-c", program]
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=LONGEST_TRIAL)
    except subprocess.TimeoutExpired:
        return SolverTrial(f"no answer after {LONGEST_TRIAL:g} s")
    if done.returncode < 0:
        return SolverTrial(f"crashed by signal {-done.returncode}")
    if done.returncode:
        return SolverTrial((done.stderr.strip().splitlines() or ["no reason given"])[-1])
    lines = done.stdout.strip().splitlines()
    return SolverTrial(**json.loads(lines[-1])) if lines else SolverTrial("")


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _version(distribution: str) -> str | None:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None
