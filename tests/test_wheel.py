"""The Python interface from a wheel: built from this repository, installed into an empty folder, used from another."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
USE = """
import doe, explorer, solver
print(*(module.__file__ for module in (doe, explorer, solver)), solver.asset_path("materials", "nine_sphere_seed"))
small = {"rig.mass": "1 g", "numerics.max_time": 0.2}
scene = explorer.load("funnel", small, material="nine_sphere_seed")
poured = explorer.pour(scene)
table = explorer.sweep(scene, {}, seeds=[1], store="pours.sqlite")
assert table.outcome[0] == poured.outcome == "time_limit", poured
assert len(poured.positions) == len(poured.components) > 0
assert len(explorer.parameters(scene)) > 50
assert "angle_of_repose_deg" in poured._repr_html_()
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder of packages as pip leaves it."""
    pytest.importorskip("hatchling", reason="hatchling, which builds the wheel, is not installed (`make venv`)")
    place = tmp_path_factory.mktemp("wheel")
    subprocess.run([*PIP, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", place, ROOT], check=True)
    (wheel,) = place.glob("repose_explorer-*.whl")
    subprocess.run([*PIP, "install", "--no-deps", "--no-index", "--target", place / "site", wheel], check=True)
    return place / "site"


def test_the_interface_works_from_a_wheel(site, tmp_path):
    environment = os.environ | {"PYTHONPATH": str(site)}
    done = subprocess.run([sys.executable, "-c", USE], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    files = done.stdout.split()
    assert len(files) == 4
    assert all(Path(file).is_relative_to(site) for file in files)


def test_a_report_can_be_written_from_a_wheel(site):
    """The templates are no Python files; a wheel without them has reports only in a checkout."""
    places = {path.name for path in (ROOT / "explorer/report/templates").iterdir()}
    assert places == {path.name for path in (site / "explorer/report/templates").iterdir()}
    assert {"page.html.j2", "blocks.html.j2"} < places


def test_a_wheel_says_that_its_types_are_to_be_read(site):
    """PEP 561: without the marker mypy and editors take every name of an installed package for Any."""
    assert all((site / package / "py.typed").is_file() for package in ("doe", "explorer", "solver"))
