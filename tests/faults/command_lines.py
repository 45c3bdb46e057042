"""Command lines of every command, made at random of its own options with values from the edge and beyond.

They are run in this process up to where the work would begin: whatever would pour, serve, start a process or open a
browser ends the attempt. Good ends are that, a result, or one line with an exit code that is documented.
"""

import os
import random
import traceback
from collections.abc import Iterator
from contextlib import ExitStack, chdir, contextmanager
from pathlib import Path
from unittest import mock

import typer
from typer.testing import CliRunner

from explorer.cli import app, line_for_user

ROOT = Path(__file__).parents[2]
VALUES = (
    *("", " ", "-1", "0", "1", "0.5", "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "9" * 400, "0x10", "1,5", "١"),
    *("x" * 10_000, "a\nb", "\u202e", "é", "=", "a=b", "==", "*", "..", "/", ".", "-", "--", "@x", "%s", "{}", "'"),
    *(
        "../../../etc/passwd",
        "/etc/passwd",
        "/dev/null",
        "/dev/full",
        "/proc/self/mem",
        "~nobody-here/x",
        "no/such/file",
    ),
    *(
        "rig.mass=nan",
        "rig.mass=1e30kg",
        "rig.mass=-1g",
        "rig.mass=1e-30g",
        "rig.=1",
        "no.such=1",
        "body.spheres=9999999",
    ),
    *("pair.seed.seed.static_friction=inf", "numerics.max_time=1e9s", "insertion.rate=0", "rig=funnel"),
    *("funnel", "rotating_drum", "sunflower_extract", "trefoil_1", "seed_pour", "glass_beads", "cone_25_30"),
    *("quick", "standard", "box-behnken", "definitive-screening", "factorial", "liggghts", "yade", "tcp://127.0.0.1:1"),
    *("angle_of_repose_deg=25", "25", "24.68", "file.csv", "file.rrd", "file.toml", "file.png", "file.xlsx", "folder"),
)
RIGHT = (
    "serve --port 0 --study sunflower_extract --seed 2",
    "serve --material glass_beads --set rig.mass=10g --record session.rrd",
    "simulate funnel --set rig.mass=1g --replicates 2 --out poured",
    "simulate funnel --material sand --seed 3 --checkpoint point.npz --json",
    f"board {ROOT}/examples/trefoil_2 --port 0 --token 0123456789abcdef",
    "repeat funnel --pours 3 --set rig.mass=1g --out repeated",
    "calibrate --headless --study sunflower_extract --profile quick --out calibrated --tries 2",
    "diagnose trefoil_1 --out diagnosed --effects rolling_resistance --budget 100 --seed 2",
    "design box-behnken --factors sunflower_extract --out runs.csv --sigma 0.4 --seed 1",
    "design factorial --factors sunflower_extract --out runs.xlsx --fraction 1 --centre 3 --replicates 2",
    "analyse sunflower_extract --target 24.68 --model quadratic --reduce aicc",
    "runs --csv --study sunflower_extract",
    "parameters funnel",
    "new material pea --out pea.toml",
    "new study mine --material glass_beads --out study.toml",
    "new project lentil",
    "schema material --out schema.json",
    f"shape {ROOT}/assets/meshes/square_hopper.stl --unit mm --spheres 8 --density 1200 --out body.toml",
    f"lab compression {ROOT}/assets/laboratory/compression.csv --leave-out 1 --out found.toml",
    "lab rebound --template",
    f"audit {ROOT}/assets/source_tables --json",
    "measure cone_25_30 --reference-length 100 --baseline auto --plot seen.png",
    "export seed_pour deck --to liggghts --seed 1 --time 0.1",
    "replay session.rrd --port 0 --no-browser",
    f"report {ROOT}/examples/trefoil_2 --out report --title T --author A",
    "verify --only T1 --pours 2",
    "bench --only spheres --rounds 1 --duration 0.2",
    "warm-up funnel --threads 1",
    "limit trefoil_1 --rounds 1 --out limit",
    "measurements check trefoil_1",
    "store check --store runs.sqlite",
    "store prune",
)
"""Lines that are, or nearly are, as they should be."""
CODES = {0, 1, 2, 3, 4}
"""Those of docs/commands.md; 130 is an interrupt's, which nobody sends here."""


class Begun(BaseException):
    """The work would begin now."""


def _begin(*_: object, **__: object) -> None:
    raise Begun


@contextmanager
def _without_work(folder: Path) -> Iterator[None]:
    """Nothing is poured, served or started, and all that is the person's own is in ``folder``."""
    homes = {name: str(folder) for name in ("HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME")}
    with ExitStack() as stack:
        stack.enter_context(mock.patch.dict(os.environ, homes))
        stack.enter_context(chdir(folder))
        for place in (
            "taichi.init",
            "subprocess.Popen",
            "webbrowser.open",
            "multiprocessing.process.BaseProcess.start",
            "explorer.viewer.app.guarded_server",
            "http.server.ThreadingHTTPServer.__init__",
        ):
            stack.enter_context(mock.patch(place, _begin))
        yield


def _commands() -> dict[tuple[str, ...], typer.core.TyperCommand]:
    """Every command by its words."""
    group = typer.main.get_command(app)
    found = {}
    for name, command in group.commands.items():
        inner = getattr(command, "commands", {})
        found |= {(name, other): one for other, one in inner.items()} if inner else {(name,): command}
    return found


def command_line(draw: random.Random) -> list[str]:
    """A line of ``RIGHT`` with up to three changes: a word replaced, one left out, an option of its command added."""
    line = draw.choice(RIGHT).split()
    words = tuple(line[: 2 if line[0] in ("measurements", "store") else 1])
    options = [one for one in _commands()[words].params if one.param_type_name == "option"]
    for _ in range(draw.choice((0, 1, 1, 1, 2, 2, 3))):
        place = draw.randint(len(words), len(line))
        act = draw.choice(("replace", "replace", "leave out", "add", "add"))
        if act == "add" and options:
            option = draw.choice(options)
            line.append(draw.choice((*option.opts, *option.secondary_opts)))
            line += [draw.choice(VALUES)] * (not option.is_flag)
        elif act == "leave out":
            line = line[:place] + line[place + 1 :]
        else:
            line[place : place + 1] = [draw.choice(VALUES)]
    return line


def command_fault(line: list[str], folder: Path) -> str | None:
    """What is wrong with how ``line`` ends in ``folder``; None for nothing."""
    with _without_work(folder):
        try:
            result = CliRunner().invoke(app, line, prog_name="explorer")
        except Begun:
            return None
    error, shown = result.exception, " ".join(word[:60] for word in line)
    if isinstance(error, Begun):
        return None
    if error is not None and not isinstance(error, SystemExit):
        known = isinstance(error, Exception) and line_for_user(error) is not None
        return f"{shown}: " + "".join(traceback.format_exception(error)[-3:]) + (" (has a line)" if known else "")
    if result.exit_code not in CODES:
        return f"{shown}: exit code {result.exit_code}"
    if result.exit_code == 2 and len(result.stderr.splitlines()) != 1:
        return f"{shown}: refused in {len(result.stderr.splitlines())} lines: {result.stderr[:300]!r}"
    return None
