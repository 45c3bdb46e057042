"""The READMEs' code blocks, run as they are written.

Every command of a block runs in a folder of its own that has what a checkout has, one after the other. Those of
``BEGUN`` take long, or run until they are stopped: here they are begun, and stopped by Ctrl-C once they say what they
are at. ``-m slow`` (`make nightly`) runs `make calibrate` and `make diagnose` to their ends, with what follows.
"""

import ast
import builtins
import csv
import os
import re
import signal
import subprocess
import sys
import threading
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from explorer.diagnosis import run as diagnosis_run
from explorer.study import run as study_run
from tests.explorer import diagnosed
from tests.explorer.study.test_run import Formula

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted(
    path.relative_to(ROOT).as_posix()
    for folder in ("", "solver/**/", "doe/**/", "explorer/**/", "docs/**/")
    for path in ROOT.glob(f"{folder}*.md")
)
CHECKOUT = ("assets", "Makefile", "pyproject.toml", "constraints.txt", ".venv")
BIN = Path(sys.executable).parent
MAKE = f"make -o .venv/.ready BIN={BIN}"
"""As `make` in a checkout whose environment is set up: this one."""
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BEGUN = {
    "make serve": r"The page is at http://127\.0\.0\.1:\d+ \(Ctrl-C ends it\)",
    "make calibrate": r"sunflower_extract, profile standard: 251 runs of 30 g; store ",
    "make diagnose": r"trefoil_2: 1 fitted and 1 held-out conditions; store ",
    "explorer calibrate --headless --study lentil_study.toml --out results/lentil": r"lentil_study, profile standard: ",
    "explorer serve --study lentil_study.toml": r"The page is at http://127\.0\.0\.1:\d+",
    "explorer simulate own.toml --replicates 10": r" 1 +at_rest ",
    "explorer simulate lentil.toml --replicates 5": r" 1 +at_rest ",
}
"""What each says once it is at work."""
NEVER_WHOLE = (*(command for command in BEGUN if "serve" in command), *(c for c in BEGUN if "results/lentil" in c))
"""Commands without an end, and a second calibration, which takes as long as `make calibrate`."""
AFTER = {"explorer simulate results/diagnosis/corrected.toml --replicates 10": "make diagnose"}
"""Commands that need what one of ``BEGUN`` leaves at its end."""
AT_NIGHT = ("docs/laboratory.md", "docs/own_material.md", "explorer/design/README.md")
"""Documents whose commands run in the night: 25 to 70 s of processor time each."""
SCRIPTS = ("README.md", "docs/python.md")
"""Documents whose Python blocks, one after the other, are a script; those of others only name what there is."""
PATIENCE = 300.0
"""[s] after which a command that has said nothing is given up."""


@dataclass(frozen=True)
class Block:
    """A fenced block: its document, the line of its fence, its language and its text."""

    document: str
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.document}:{self.line}"

    @property
    def commands(self) -> list[str]:
        """What a reader types: lines that begin with ``$``, without the comments behind them."""
        typed = [line[2:] for line in self.text.splitlines() if line.startswith("$ ")]
        return [line.split("  #")[0].split(" #")[0].strip() for line in typed]


def in_their_time(found: Sequence[Block]) -> list[Any]:
    """``found`` as parameters, those of ``AT_NIGHT`` marked slow."""
    return [pytest.param(one, marks=[pytest.mark.slow] if one.document in AT_NIGHT else []) for one in found]


def blocks() -> Iterator[Block]:
    for document in DOCUMENTS:
        text = (ROOT / document).read_text(encoding="utf-8")
        for found in BLOCK.finditer(text):
            yield Block(document, text[: found.start()].count("\n") + 1, found[1], found[2])


ALL = list(blocks())
TYPED = [block for block in ALL if block.commands]
PYTHON = [block for block in ALL if block.language == "python"]
LONG = [block for block in TYPED if any(command in BEGUN and command not in NEVER_WHOLE for command in block.commands)]


@pytest.fixture
def checkout(tmp_path):
    """A folder with what a checkout has."""
    for name in CHECKOUT:
        if (ROOT / name).exists():
            (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


def started(command, folder):
    """The command at work in ``folder``, its output in one pipe."""
    command = re.sub(r"^make\b", MAKE, command)
    environment = os.environ | {
        "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}",
        "REPOSE_STORE": str(folder / "pours.sqlite"),
        "XDG_DATA_HOME": str(folder / "data"),
        "PYTHONUNBUFFERED": "1",
    }
    return subprocess.Popen(
        command,
        shell=True,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        # A shell in the background hands its children a Ctrl-C that is ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def begun(command, folder):
    """Start a command of ``BEGUN``, wait for what it says, stop it by Ctrl-C, and return all its output."""
    process = started(command, folder)
    watchdog = threading.Timer(PATIENCE, os.killpg, (process.pid, signal.SIGKILL))
    watchdog.start()
    seen = []
    try:
        for line in process.stdout:
            seen.append(line)
            if re.search(BEGUN[command], line):
                os.killpg(process.pid, signal.SIGINT)
                break
        seen.append(process.stdout.read())
        process.wait()
    finally:
        watchdog.cancel()
    return "".join(seen)


def run(command, folder):
    """Run a command to its end, which must be a good one, and return its output."""
    process = started(command, folder)
    output, _ = process.communicate()
    assert process.returncode == 0, f"$ {command}\n{output}"
    return output


def fill(sheet):
    """Write readings into the empty columns of a sheet of runs, as its user would."""
    lines = sheet.read_text(encoding="utf-8").splitlines()
    head = [line for line in lines if line.startswith("#")]
    rows = list(csv.reader(lines[len(head) :]))
    for k, row in enumerate(rows[1:]):
        rows[1 + k] = [cell or f"{40.0 + (7 * k) % 5:g}" for cell in row]
    sheet.write_text("\n".join([*head, *(",".join(row) for row in rows)]) + "\n", encoding="utf-8")


def prepare(block, folder):
    """Write the files that the block's document shows and its commands read."""
    tables = [one.text for one in ALL if one.document == block.document and one.language == "toml"]
    for name in set(re.findall(r"--factors (\w+\.toml)", block.text)):
        (folder / name).write_text("\n".join(tables), encoding="utf-8")


@pytest.mark.parametrize("block", in_their_time(TYPED), ids=str)
def test_the_commands_of_a_block_run_as_they_are_written(block, checkout):
    prepare(block, checkout)
    for command in block.commands:
        if command in BEGUN:
            output = begun(command, checkout)
            assert re.search(BEGUN[command], output), f"$ {command}\n{output}"
        elif command not in AFTER:
            run(command, checkout)
            if sheet := re.search(r"explorer design .*--out (\S+\.csv)", command):
                fill(checkout / sheet[1])


@pytest.mark.slow
@pytest.mark.parametrize("block", LONG, ids=str)
def test_the_long_commands_of_a_block_run_to_their_ends(block, checkout):
    prepare(block, checkout)
    for command in block.commands:
        if command not in NEVER_WHOLE:
            run(command, checkout)


def test_every_command_that_is_only_begun_stands_in_a_block():
    typed = {command for block in TYPED for command in block.commands}
    assert {*BEGUN, *AFTER} <= typed
    assert all(AFTER[command] in BEGUN for command in AFTER)


@pytest.mark.parametrize("block", [block for block in ALL if block.language == "toml"], ids=str)
def test_tables_are_toml(block):
    assert tomllib.loads(block.text)


@pytest.mark.usefixtures("taichi")
@pytest.mark.parametrize("document", SCRIPTS)
def test_python_runs_as_it_is_written(document, checkout, monkeypatch):
    """Pours are poured; the study and the diagnosis, which take long, get theirs from formulas."""
    blocks = [block.text for block in PYTHON if block.document == document]
    assert blocks
    case = cache(lambda: diagnosed.diagnosed(**diagnosed.CASES["effect"]))
    monkeypatch.setattr(study_run, "PourRunner", Formula)
    monkeypatch.setattr(diagnosis_run, "load_measurement", lambda folder: case()[0])
    monkeypatch.setattr(diagnosis_run, "run_diagnosis", lambda *given, **options: case()[1])
    monkeypatch.setenv("REPOSE_STORE", str(checkout / "pours.sqlite"))
    monkeypatch.chdir(checkout)
    exec(compile("\n".join(blocks), document, "exec"), {})


@pytest.mark.parametrize("block", [block for block in PYTHON if block.document not in SCRIPTS], ids=str)
def test_python_calls_what_there_is(block):
    """Every function that is called is a public one of doe or solver, or of Python."""
    tree = ast.parse(block.text)
    called = {node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    sources = [
        path.read_text(encoding="utf-8") for folder in ("doe", "solver") for path in (ROOT / folder).rglob("*.py")
    ]
    known = {name for text in sources for name in re.findall(r"^def (\w+)\(", text, re.MULTILINE)}
    assert called
    assert called - known <= {"sqrt", *dir(builtins)}


def test_no_block_that_a_reader_types_is_overlooked():
    """A block in a shell's language has its commands behind ``$``, and a block with commands is found by them."""
    assert len(TYPED) >= 5
    for block in ALL:
        if block.language in ("console", "sh", "bash", "shell"):
            assert block.commands, block


def test_the_gallery_lists_every_picture():
    listed = set(re.findall(r"pictures/(\w+)\.png", (ROOT / "docs/pictures.md").read_text(encoding="utf-8")))
    assert listed >= {file.stem for file in (ROOT / "assets/pictures").glob("*.png")}
