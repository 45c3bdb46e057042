"""Files that are damaged, foreign or hostile, read by every parser; command lines; messages to the page: `make fuzz`.

    python -m tests.faults.fuzz --inputs 500 --seed 1 [--only material]

A good file is changed at random (bits and blocks of any file; numbers, names and lines of a text), and read as the
program would. Good ends are a result, or an error that is one line for the user. A fault is anything else: an exception
of another kind, a message of several lines, more than ``PATIENCE`` of time, a file that appears outside the folder.
Command lines are those of tests/faults/command_lines.py, messages those of tests/faults/attacker.py.
"""

import argparse
import atexit
import contextlib
import random
import re
import resource
import shutil
import signal
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

from doe.laboratory import TESTS
from doe.laboratory.analysis import analyse
from doe.measurement import load_measurement
from doe.store import Store
from doe.studies.study import load_study
from explorer.audit.read_study import read_study
from explorer.cli import line_for_user
from explorer.design.analysis import AnalyseOrder, run_analyse
from explorer.design.factors_file import read_factors
from explorer.scene.file import load_scene
from explorer.shape import mesh_solid
from solver.assets import asset_path
from solver.photograph import open_picture, read_drum, read_photograph
from solver.pours.raw_pour import unpacked
from tests.doe.test_store import RUN
from tests.faults.command_lines import command_fault, command_line
from tests.faults.seeds import drum_faces, meshes, pictures, recordings

ROOT = Path(__file__).parents[2]
ASSETS = ROOT / "assets"
_place = tempfile.TemporaryDirectory()
_open = ExitStack()
atexit.register(_open.close)
PATIENCE = 20
"""[s] of computing in which a file of the size of a shipped one has to be read or refused."""
WAITING = 10 * PATIENCE
"""[s] by the clock, for what computes nothing but waits; a busy machine is slower than ``PATIENCE``."""
TIMERS = ((signal.SIGPROF, signal.ITIMER_PROF, PATIENCE), (signal.SIGALRM, signal.ITIMER_REAL, WAITING))
MEMORY = 2**31
"""[bytes] that reading may take beside what the program has taken before."""
TOKENS = (
    *("nan", "inf", "-inf", "1e308", "-1", "0", "1e-320", "9" * 400, "0x7f", "1_0", "true", "''", "[]", "{}", "[[]]"),
    *('"../../../etc/passwd"', '"/dev/zero"', '"\\u0000"', '"a\\nb"', "é", "\u202e", "\ufeff", "\x00", '"""', "#", "="),
    *("1,5", ";", ",,,,", "\t", "[material]", "[[body]]", "[rig]", "name", "=CMD()"),
)
"""What a number, a name or a line of a text is replaced by."""


@dataclass(frozen=True)
class Parser:
    """``read`` takes a path to a changed copy of one of ``seeds``: a file, or a folder of which one file is changed."""

    seeds: tuple[Path, ...]
    read: Callable[[Path], object]
    make: Callable[[], tuple[Path, ...]] | None = None
    """Makes the seeds where none are shipped."""


def _stored(path: Path) -> None:
    store = Store(path, pouring=False)
    try:
        list(store.runs())
    finally:
        store.close()


@cache
def _a_store() -> Path:
    """A store of one pour, which is gone with this process."""
    path = Path(_place.name, "pours.sqlite")
    store = Store(path)
    store.add(RUN)
    store.close()
    return path


def _recording(path: Path) -> None:
    # Imported here: rerun takes a second to load.
    from explorer.recordings.recording_reader import read_recording

    read_recording(path)


def _lab(test: str) -> Callable[[Path], object]:
    return lambda path: analyse(test, path)


def _files(*patterns: str) -> tuple[Path, ...]:
    return tuple(sorted(path for pattern in patterns for path in ROOT.glob(pattern)))


PARSERS = {
    "material": Parser(_files("assets/materials/*.toml", "assets/benchmarks/*.toml"), lambda p: load_scene(str(p))),
    "rig and scene": Parser(_files("assets/scenes/*.toml"), lambda p: load_scene(str(p))),
    "study": Parser(_files("assets/studies/*.toml", "examples/two_rigs/*.toml"), lambda p: load_study(str(p))),
    "factors": Parser(_files("assets/designs/*.toml"), read_factors),
    "sheet of runs": Parser(_files("assets/designs/*.csv"), lambda p: run_analyse(AnalyseOrder(str(p)))),
    "measurement": Parser(
        _files("assets/measurements/trefoil_1", "assets/measurements/granudrum_mcc"), load_measurement
    ),
    "published study": Parser((ROOT / "assets/source_tables",), read_study),
    "photograph": Parser(_files("assets/photographs/cone*.jpg"), lambda p: read_photograph(open_picture(p))),
    "mesh": Parser(_files("assets/meshes/*.stl"), lambda p: mesh_solid(p, "mm", "--unit")),
    "raw pour": Parser(_files("tests/doe/raw_pours/*.npz"), lambda p: unpacked(p.read_bytes())),
    "picture": Parser((), lambda p: read_photograph(open_picture(p)), pictures),
    "drum's face": Parser((), lambda p: read_drum(open_picture(p)), drum_faces),
    "mesh of every format": Parser((), lambda p: mesh_solid(p, "mm", "--unit"), meshes),
    "recording": Parser((), _recording, recordings),
    "store": Parser((_a_store(),), _stored),
    **{
        f"readings of {test}": Parser((asset_path("laboratory", test),), _lab(test))
        for test in TESTS
        if (ASSETS / "laboratory" / f"{test}.csv").exists()
    },
}


def changed(content: bytes, draw: random.Random) -> bytes:
    """``content`` with one to four changes."""
    for _ in range(draw.randint(1, 4)):
        content = draw.choice((_bits, _cut, _block, _token, _token, _token, _line, _line))(content, draw)
    return content


def _bits(content: bytes, draw: random.Random) -> bytes:
    found = bytearray(content)
    for _ in range(draw.randint(1, 8)):
        if found:
            found[draw.randrange(len(found))] ^= 1 << draw.randrange(8)
    return bytes(found)


def _cut(content: bytes, draw: random.Random) -> bytes:
    return content[: draw.randint(0, len(content))]


def _block(content: bytes, draw: random.Random) -> bytes:
    """A block taken out, doubled, zeroed or moved."""
    a, b = sorted(draw.randint(0, len(content)) for _ in range(2))
    b = min(b, a + 4096)
    block, place = content[a:b], draw.randint(0, len(content))
    return draw.choice(
        (
            content[:a] + content[b:],
            content[:place] + block + content[place:],
            content[:a] + bytes(b - a) + content[b:],
            content[:a] + draw.randbytes(b - a) + content[b:],
        )
    )


def _token(content: bytes, draw: random.Random) -> bytes:
    """A number, a name or a quoted text replaced."""
    found = list(re.finditer(rb"-?\d+\.?\d*(?:e-?\d+)?|[A-Za-z_]+|\"[^\"\n]*\"", content[:200_000]))
    if not found:
        return content
    one = draw.choice(found)
    return content[: one.start()] + draw.choice(TOKENS).encode() + content[one.end() :]


def _line(content: bytes, draw: random.Random) -> bytes:
    """A line left out, doubled, moved or made up."""
    lines = content.split(b"\n")
    k, place = draw.randrange(len(lines)), draw.randrange(len(lines))
    line = lines[k]
    act = draw.choice(("out", "double", "move", "new"))
    if act in ("out", "move"):
        del lines[k]
    lines.insert(place, draw.choice(TOKENS).encode() if act == "new" else line) if act != "out" else None
    return b"\n".join(lines)


@contextlib.contextmanager
def _in_time() -> Iterator[None]:
    def over(*_: object) -> None:
        raise TimeoutError(f"not read or refused within {PATIENCE} s")

    for alarm, timer, seconds in TIMERS:
        signal.signal(alarm, over)
        signal.setitimer(timer, seconds)
    try:
        yield
    finally:
        for _, timer, _ in TIMERS:
            signal.setitimer(timer, 0.0)


def fault_of(parser: Parser, seed: str) -> str | None:
    """What is wrong with how ``parser`` takes the input that ``seed`` makes; None for nothing."""
    draw = random.Random(seed)
    source = draw.choice(parser.make() if parser.make else parser.seeds)
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place, source.name)
        if source.is_dir():
            shutil.copytree(source, copy)
            file = draw.choice(sorted(path for path in copy.rglob("*") if path.is_file() and path.suffix != ".md"))
        else:
            file = Path(shutil.copy(source, copy))
        file.write_bytes(changed(file.read_bytes(), draw))
        try:
            with _in_time():
                parser.read(copy)
        except Exception as error:
            line = None if isinstance(error, TimeoutError) else line_for_user(error)
            if line is None:
                return f"{source.name}: " + "".join(traceback.format_exception(error)[-3:])
    return None


def line_fault(seed: str) -> str | None:
    """What is wrong with how the command line that ``seed`` makes ends; None for nothing."""
    import taichi  # noqa: F401 - seconds that are the first command's and not those of its line

    with tempfile.TemporaryDirectory() as place:
        try:
            with _in_time():
                return command_fault(command_line(random.Random(seed)), Path(place))
        except TimeoutError as error:
            return f"{command_line(random.Random(seed))}: {error}"


@cache
def _a_page() -> Any:
    """A page for all messages, which is gone with this process."""
    # Imported here: it loads the page, and most campaigns need none.
    from tests.faults.attacker import attacked_page

    return _open.enter_context(attacked_page(Path(_place.name)))


def page_fault(seed: str) -> str | None:
    """What is wrong with how the page takes the fifty messages that ``seed`` makes; None for nothing."""
    from tests.faults.attacker import message_fault

    return message_fault(_a_page(), random.Random(seed))


CAMPAIGNS: dict[str, Callable[[str], str | None]] = {
    **{name: partial(fault_of, parser) for name, parser in PARSERS.items()},
    "command line": line_fault,
    "messages to the page": page_fault,
}
"""What is tried → what is wrong with how the program takes the input that a seed makes."""


def main() -> int:
    """Read so many inputs by each parser; 1 if one of them was taken badly."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--inputs", type=int, default=500, help="inputs of each parser")
    asked.add_argument("--seed", type=int, default=1)
    asked.add_argument("--only", choices=list(CAMPAIGNS))
    order = asked.parse_args()
    taken = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    tried, faults = 0, 0
    for name, fault_from in CAMPAIGNS.items():
        if order.only not in (None, name):
            continue
        for number in range(order.inputs):
            seed = f"{name} {order.seed} {number}"
            if (fault := fault_from(seed)) is not None:
                faults += 1
                print(f"{seed}: {fault}", flush=True)
            tried += 1
        print(f"{name}: {order.inputs} inputs", flush=True)
    _open.close()  # viser says that it has stopped, and the count is to be the last line
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - taken
    if grown > MEMORY:
        faults += 1
        print(f"memory: {grown / 1e9:.1f} GB beside what the program had taken")
    print(
        f"{tried} inputs of {len(CAMPAIGNS)} parsers, seed {order.seed}: {faults} faults, memory + {grown / 1e6:.0f} MB"
    )
    return 1 if faults else 0


if __name__ == "__main__":
    raise SystemExit(main())
