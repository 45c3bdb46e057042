"""The program as people install it: the wheel in an empty environment, used by another user from awkward places.

The environment and the folders have blanks and umlauts in their names, and nobody may write into the environment. As
root the commands run as `nobody`, whom missing rights stop as they stop everybody else.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import urllib.request
import zipfile
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.explorer.command_line import TINY, settings

ROOT = Path(__file__).parents[1]
NOBODY = 65534
OF_THE_USER = ("HOME", "PYTHONPATH", "VIRTUAL_ENV", "XDG_", "REPOSE_", "TI_", "EXPLORER_")
"""Variables of whoever runs the tests that the user of the program does not have, or how their names begin."""
FIT = "import ensurepip, sys, venv; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))"
"""Ends with 0 in a Python that can make the environment."""
HOMES = ("of their own", "none", "of somebody else")

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Installed:
    """A program in an environment of its own, and who uses it from where."""

    program: Path
    folder: Path
    """Working directory, which the user may write into."""
    environment: dict[str, str]
    user: tuple[str, ...]
    """What a command begins with, so that the user runs it."""

    def started(self, *arguments: object) -> subprocess.Popen[str]:
        """A command at work; its two outputs are one."""
        return subprocess.Popen(
            [*self.user, str(self.program), *map(str, arguments)],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def ran(self, *arguments: object, code: int = 0) -> str:
        """Output of a command that ends with ``code``."""
        process = self.started(*arguments)
        output, _ = process.communicate()
        assert process.returncode == code, output
        return output


def as_user() -> tuple[str, ...]:
    """What makes another user of root."""
    if os.geteuid() != 0:
        return ()
    # Root's capabilities last until the next program begins: that is `env`, and what it begins has none.
    return ("setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", "env")


def python_for_all() -> str:
    """A Python that the user may run: that of these tests may lie in somebody's home."""
    for name in (sys.executable, "python3.12", "python3.11"):
        for place in filter(None, (shutil.which(name), f"/usr/bin/{name}")):
            base = os.path.realpath(place)
            check = (*as_user(), base, "-c", FIT)
            if Path(base).exists() and subprocess.run(check, capture_output=True).returncode == 0:
                return base
    pytest.skip("no Python 3.11 or 3.12 with ensurepip that another user may run")


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Wheel and sdist of this source tree."""
    place = tmp_path_factory.mktemp("built")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-d", place], cwd=ROOT, check=True, capture_output=True)
    (wheel,), (sdist,) = place.glob("*.whl"), place.glob("*.tar.gz")
    return wheel, sdist


@pytest.fixture(scope="module")
def environment(built):
    """Folder with the program in an environment that nobody may write into; anybody may look."""
    base = Path(tempfile.mkdtemp(prefix="Körner & Samen "))
    try:
        base.chmod(0o755)
        place = base / "gemeinsame Programme"
        subprocess.run([python_for_all(), "-m", "venv", place], check=True)
        pip = (place / "bin/python", "-m", "pip", "--disable-pip-version-check", "--quiet")
        subprocess.run([*pip, "install", "-c", ROOT / "constraints.txt", built[0]], check=True)
        subprocess.run(["chmod", "-R", "a-w,a+rX", place], check=True)
        yield base
    finally:
        subprocess.run(["chmod", "-R", "u+w", base], check=False)
        shutil.rmtree(base, ignore_errors=True)


def installed(base: Path, home: str) -> Installed:
    """The program for a user whose home is one of ``HOMES``."""
    folder = Path(tempfile.mkdtemp(prefix="Säcke in Übersee ", dir=base))
    user = as_user()
    variables = {name: value for name, value in os.environ.items() if not name.startswith(OF_THE_USER)}
    if home != "none":
        place = folder / "zu Hause"
        place.mkdir(mode=0o755)
        variables["HOME"] = str(place)
    if user:
        subprocess.run(["chown", "-R", f"{NOBODY}:{NOBODY}", folder], check=True)
    if home == "of somebody else":
        if user:
            os.chown(place, 0, 0)
        place.chmod(0o555)
    return Installed(base / "gemeinsame Programme/bin/explorer", folder, variables, user)


@contextmanager
def page_of(program: Installed):
    """Address of the page of `explorer serve`, which Ctrl-C ends well."""
    process = program.started("serve", "--port", 0)
    said = []
    try:
        for line in process.stdout:
            said.append(line)
            if found := re.search(r"The page is at (http://\S+)", line):
                yield found[1]
                break
        else:
            pytest.fail("".join(said))
        process.send_signal(signal.SIGINT)
        rest, _ = process.communicate(timeout=60)
        assert process.returncode == 0, "".join(said) + rest
    finally:
        process.kill()
        process.wait()


def contents(wheel: Path) -> dict[str, bytes]:
    """Every file of a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.parametrize("home", HOMES)
def test_it_pours_audits_and_serves(environment, home):
    program = installed(environment, home)
    told = json.loads(program.ran("doctor", "--json", "--port", 1024 + os.getpid() % 60000, code=home != HOMES[0]))
    absent = {one["thing"] for one in told["findings"] if one["needed"] and not one["present"]}
    assert absent == (set() if home == HOMES[0] else {"folder of pours"})
    program.ran("simulate", "funnel", *settings(TINY), "--out", "Ausgabe für später")
    result = json.loads((program.folder / "Ausgabe für später/result.json").read_text(encoding="utf-8"))
    assert result["outcome"] == "time_limit"
    assert "reproduced exactly" in program.ran("audit")
    with page_of(program) as address, urllib.request.urlopen(address, timeout=60) as page:
        assert b"<html" in page.read()


def test_the_long_commands_come_to_their_ends(environment):
    """A study, a diagnosis of two effects, and a validation that is stopped for time in its first pours."""
    program = installed(environment, HOMES[0])
    program.ran("calibrate", "--headless", "--profile", "quick", "--out", "Studie")
    study = json.loads((program.folder / "Studie/result.json").read_text(encoding="utf-8"))
    assert study["verification"]["tests"][0]["verdict"]
    asked = ("--effects", "rolling_resistance,air_drag", "--budget", 40, "--out", "Diagnose")
    program.ran("diagnose", "trefoil_2", *asked)
    answer = json.loads((program.folder / "Diagnose/diagnosis.json").read_text(encoding="utf-8"))
    assert answer["verdict"] == "effect:rolling_resistance"
    for folder in ("Studie", "Diagnose"):
        assert (program.folder / folder / "report.html").stat().st_size > 10_000
    assert "all pours are kept" in program.ran("validate-diagnosis", "--n", 1, "--minutes", 0.5)


def test_without_a_home_a_study_asks_for_a_store_in_one_line(environment):
    program = installed(environment, "none")
    said = program.ran("calibrate", "--headless", "--profile", "quick", "--out", "Studie", code=2)
    assert re.fullmatch(r"error: .*\n", said)
    assert "--store" in said


def test_a_wheel_from_the_sdist_is_the_same(built, tmp_path):
    wheel, sdist = built
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    (source,) = tmp_path.iterdir()
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path / "again"]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    (again,) = (tmp_path / "again").glob("*.whl")
    assert contents(again) == contents(wheel)


def test_the_sdist_holds_what_the_repository_does_and_nothing_beside_it(built):
    """Such as a project or results in the root of the checkout."""
    if not (ROOT / ".git").exists():
        pytest.skip("no git repository to compare with")

    def listed(*options):
        command = ["git", "-c", "core.quotepath=off", "ls-files", *options]
        return set(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines())

    with tarfile.open(built[1]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    tracked, roots = listed(), {name.split("/")[0] for name in listed()}
    new = {name for name in listed("--others", "--exclude-standard") if name.split("/")[0] in roots}
    assert names == tracked | new | {"PKG-INFO"}


def test_the_wheel_has_all_data_and_no_pictures_of_the_documents(built):
    names = set(contents(built[0]))
    shipped = {
        f"solver/assets/{path.relative_to(ROOT / 'assets').as_posix()}"
        for path in (ROOT / "assets").rglob("*")
        if path.is_file() and path.relative_to(ROOT / "assets").parts[0] != "pictures"
    }
    assert {name for name in names if name.startswith("solver/assets/")} == shipped
    assert len(shipped) > 100
