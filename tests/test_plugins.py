"""A made-up thing of every kind in a package of its own (``examples/plugins``), found and working everywhere.

The package lies in a folder of its own with the metadata that an installer would write; the program finds it by its
entry points, in processes of its own.
"""

import csv
import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from solver import load_material, pour_key
from solver.plugins import GROUP

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "examples" / "plugins"
KINDS = {"contact_law", "design", "effect", "export", "observable", "panel", "rig", "stage"}
SMALL = ("--set", "rig.mass=5g", "--set", "body.spheres=coarse", "--set", "insertion.rate=50g/s")


def metadata():
    """The entry points of the package, kind.name → what it is."""
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]
    return project["name"], project["version"], project["entry-points"][GROUP]


def installed(folder, version=None, entries=None):
    """A folder as an installer leaves it."""
    name, own_version, own_entries = metadata()
    folder.mkdir(exist_ok=True)
    shutil.copytree(PACKAGE / "repose_plugins", folder / "repose_plugins")
    info = folder / f"{name.replace('-', '_')}-{version or own_version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version or own_version}\n")
    lines = [f"{entry} = {value}" for entry, value in (entries or own_entries).items()]
    (info / "entry_points.txt").write_text("\n".join([f"[{GROUP}]", *lines, ""]))
    return folder


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    return installed(tmp_path_factory.mktemp("site"))


def python(site, *arguments, cwd=None):
    """A process of the program that sees the package."""
    path = os.pathsep.join([str(site), str(ROOT)])
    return subprocess.run(
        [sys.executable, *arguments], env=os.environ | {"PYTHONPATH": path}, cwd=cwd, capture_output=True, text=True
    )


def explorer(site, *arguments, cwd=None):
    """Output of a command that must succeed."""
    done = python(site, "-m", "explorer", *arguments, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


def said(site, code, *arguments):
    """What a few lines of Python print, as JSON."""
    done = python(site, "-c", code, *arguments)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[0])


def test_the_package_has_one_thing_of_every_kind():
    assert {entry.partition(".")[0] for entry in metadata()[2]} == KINDS


def pours(site, tmp_path, source, *settings, seed=1):
    """Result of a pour of 5 g."""
    sets = [word for one in settings for word in ("--set", one)]
    return json.loads(explorer(site, "simulate", source, *SMALL, *sets, "--seed", str(seed), "--json", cwd=tmp_path))


def test_an_effect_is_a_parameter_and_acts(site, tmp_path):
    assert "effect.stokes_drag.resistance" in explorer(site, "parameters")
    # A seed of 0.1 g falls no faster than m g/k = 0.1 m/s; without drag it would reach 1 m/s.
    # So few bodies jam now and then, and which seeds do depends on the processor's rounding.
    for seed in range(1, 6):
        times = [
            pours(site, tmp_path, "funnel", f"effect.stokes_drag.resistance={k}", seed=seed)["observables"][
                "discharge_time_s"
            ]["value"]
            for k in (0, 0.01)
        ]
        if None not in times:
            break
    plain, slowed = times
    assert slowed > 1.2 * plain
    code = """
import json
from explorer.viewer.pour.live_panel import effect_targets
from solver import EFFECTS
print(json.dumps([list(EFFECTS), list(effect_targets())]))
"""
    assert all("stokes_drag" in names for names in said(site, code))


def test_a_rig_is_poured_into_and_listed(site, tmp_path):
    found = pours(site, tmp_path, "narrow_funnel")
    assert found["outcome"] in {"at_rest", "no_heap"}
    assert "narrow_funnel" in explorer(site, "simulate", "--help")
    scene = tmp_path / "set_up.toml"
    scene.write_text('format = 1\nmaterial = "sunflower_extract"\n[rig]\nname = "narrow_funnel"\nmass = "5g"\n')
    assert pours(site, tmp_path, str(scene))["observables"] == found["observables"]
    refused = python(site, "-m", "explorer", "simulate", "funnel", "--set", "rig.name=wide_funnel")
    assert refused.returncode == 2
    assert "narrow_funnel" in refused.stderr


def test_an_observable_is_read_named_and_a_target_of_studies(site, tmp_path):
    seen = pours(site, tmp_path, "funnel")["observables"]["heaviest_body_kg"]
    assert seen["unit"] == "kg"
    assert seen["value"] == pytest.approx(max(body.mass for body in load_material("sunflower_extract").bodies))
    code = """
import json
import tomllib
from doe.studies.study import study_from
from explorer.units import observable_label
from solver import asset_path, named
path = asset_path("studies", "sunflower_extract")
table = tomllib.loads(path.read_text())
table["target"] = [{"observable": "heaviest_body_kg", "mean": 1e-4, "sd": 1e-5, "n": 5, "margin": 1e-5}]
study = study_from(table, path)
print(json.dumps([study.estimators[0], observable_label("heaviest_body_kg"), named("heaviest_body_kg").unit]))
"""
    assert said(site, code) == ["heaviest_body_kg", "heaviest body", "kg"]


def test_a_design_is_made_listed_and_run_by_a_stage(site, tmp_path):
    assert "one-at-a-time" in explorer(site, "design", "--help")
    explorer(site, "design", "one-at-a-time", "--factors", "sunflower_extract", "--out", "runs.csv", cwd=tmp_path)
    lines = [line for line in (tmp_path / "runs.csv").read_text().splitlines() if not line.startswith("#")]
    # Three factors, each low and high, and the shipped file's centre runs.
    centre = tomllib.loads((ROOT / "assets/designs/sunflower_extract.toml").read_text()).get("centre", 1)
    assert len(list(csv.reader(lines))) == 1 + 2 * 3 + centre
    refused = python(site, "-m", "explorer", "design", "taguchi", "--factors", "sunflower_extract", "--out", "x.csv")
    assert "one-at-a-time" in refused.stderr


STUDY = """
import sys
from explorer.study import run as study_run
from tests.explorer.study.test_run import Formula
study_run.PourRunner = Formula
from explorer.cli import main
sys.argv = ["explorer", "calibrate", "--headless", *sys.argv[1:]]
main()
"""


@pytest.mark.slow
def test_a_stage_runs_in_the_study_that_names_it_with_a_design_of_the_package(site, tmp_path):
    shipped = (ROOT / "assets/studies/sunflower_extract.toml").read_text()
    study = tmp_path / "study.toml"
    study.write_text(shipped + '\n[screening]\ndesign = "one-at-a-time"\n\n[stage.repeatability]\nruns = 7\n')
    options = ("--study", str(study), "--profile", "quick", "--out", str(tmp_path / "out"))
    done = python(site, "-c", STUDY, *options, "--store", str(tmp_path / "pours.sqlite"), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert len(result["screening"]["runs"]) == 2 * 24 + 1
    assert result["study"]["designs"]["screening"] == "one-factor-at-a-time"
    found = result["further"]["repeatability"]
    assert found["facts"]["standard deviation"] > 0
    assert [len(rows) for rows in found["runs"]] == [7]
    assert result["runs"]["by_stage"]["repeatability"] == 7
    assert list(result["timing"]["stage_s"])[-1] == "repeatability"
    report = (tmp_path / "out" / "report.md").read_text()
    assert "## Repeatability at the optimum" in report
    assert "49-run one-factor-at-a-time design" in report
    # Whoever lacks the package can still read what it found.
    code = f"""
import json
from pathlib import Path
from doe.studies.study_result import study_from
from explorer.report.sections import sections_of
result = study_from(json.loads(Path({str(tmp_path / "out" / "result.json")!r}).read_text()))
print(json.dumps([section.title for section in sections_of(result)]))
"""
    assert "Repeatability" in said(ROOT, code)
    bad = study.read_text().replace("runs = 7", "runs = 1")
    study.write_text(bad)
    done = python(site, "-c", STUDY, *options[:-1], str(tmp_path / "other"), cwd=tmp_path)
    assert done.returncode == 2
    assert "allowed: runs, a whole number of at least 2" in done.stderr
    assert not (tmp_path / "other").exists()


def test_an_export_target_is_offered_and_writes_its_files(site, tmp_path):
    assert "centres of the bodies" in explorer(site, "export", "--help")
    said_so = explorer(site, "export", "funnel", "out", "--to", "points", *SMALL, cwd=tmp_path)
    rows = (tmp_path / "out" / "points.csv").read_text().splitlines()
    assert rows[0] == "x_m,y_m,z_m"
    assert f"{len(rows) - 1} bodies in points.csv" in said_so


def test_a_panel_stands_on_the_page_in_a_tab_of_its_own_and_is_shown(site, tmp_path):
    code = """
import json
import sys
import threading
from pathlib import Path
from explorer.diagnosis.process import DiagnoseProcess
from explorer.scene.source import material_source
from explorer.viewer.guarded_server import guarded_server
from tests.explorer.viewer.page_session import page_of
from tests.explorer.viewer.test_page import Session
folder = Path(sys.argv[1])
server = guarded_server("127.0.0.1", 0, "test")
diagnosis = DiagnoseProcess(folder / "diagnoses", folder / "runs.sqlite")
page = page_of(server, Session(material_source("sunflower_extract")), diagnosis, folder)
notes = page.panels["notes"]
notes._text.value = "the seed hangs"
stop = threading.Event()
show, shown = notes.show, []
def watched(now):
    show(now)
    shown.append(notes._time.value)
    stop.set()
notes.show = watched
page.run(stop)
handles = server.gui._container_handle_from_uuid.values()
tabs = [one._parent for one in handles if hasattr(one, "_parent")][-1]
print(json.dumps([[tab._label for tab in tabs._tab_handles], shown[-1]]))
page.close()
diagnosis.close()
server.stop()
"""
    names, written = said(site, code, str(tmp_path))
    assert names[-1] == "Notes"
    assert written == "0.000 s"


@pytest.mark.slow
def test_a_contact_law_is_a_choice_and_acts(site, tmp_path):
    law = "contact.law=soft_springs"
    assert pours(site, tmp_path, "funnel", law)["outcomes"]
    refused = python(site, "-m", "explorer", "simulate", "funnel", "--set", "contact.law=hooke")
    assert "hertz_mindlin, linear_spring_dashpot, soft_springs" in refused.stderr
    exported = python(site, "-m", "explorer", "export", "funnel", str(tmp_path / "out"), "--to", "yade", "--set", law)
    assert "'soft_springs' cannot be exported to yade; allowed: hertz_mindlin" in exported.stderr
    # An elastic impact lasts π √(m/k): four times softer, twice as long.
    code = """
import dataclasses
import json
from solver import backend
from solver.scenes.contact_model import ContactModel
from solver.single_body.free_world import RADIUS, FreeWorld, grain_on_plate
backend.init(threads=1)
lasted = []
for name in ("linear_spring_dashpot", "soft_springs"):
    scene = dataclasses.replace(grain_on_plate(restitution=1.0), contact=ContactModel(law=name))
    lab = FreeWorld(scene, 1, dt=1e-7)
    lab.put(0, (0.0, 0.0, RADIUS), velocity=(0.0, 0.0, -0.5))
    steps = 0
    while steps == 0 or lab.state()[0][2] < RADIUS:
        lab.run(20)
        steps += 20
    lasted.append(steps)
print(json.dumps(lasted))
"""
    stiff, soft = said(site, code)
    assert soft / stiff == pytest.approx(2.0, abs=2 * 20 / stiff)


def test_stored_pours_keep_their_keys_and_know_the_package_that_acted(site, tmp_path):
    scene = load_material("sunflower_extract")
    code = """
import json
from solver import load_material, pour_key, with_rig, with_values
scene = load_material("sunflower_extract")
dragged = with_values(scene, {"effect.stokes_drag.resistance": 1e-3})
print(json.dumps([pour_key(scene, 1), pour_key(dragged, 1), pour_key(with_rig(scene, "narrow_funnel"), 1)]))
"""
    before = said(site, code)
    later = said(installed(tmp_path / "later", version="1.1"), code)
    assert before[0] == later[0] == pour_key(scene, 1)
    assert not set(before[1:]) & set(later[1:])
    assert len({*before, *later}) == 5


@pytest.mark.parametrize(
    ("entry", "value", "message"),
    [
        ("effect.air_drag", "repose_plugins.stokes_drag:StokesDrag", "the name 'air_drag' is taken"),
        ("effect.drag", "repose_plugins.stokes_drag:StokesDrag", "its name is 'stokes_drag', not 'drag'"),
        ("effect.stokes_drag", "repose_plugins.stokes_drag:Stokes", "cannot be loaded"),
        ("effect.stokes_drag", "repose_plugins.nowhere:StokesDrag", "cannot be loaded: No module named"),
        ("effect.stokes_drag", "repose_plugins.one_at_a_time:DESIGN", "is not of the kind effect"),
        ("effect.stokes_drag", "repose_plugins.broken:StokesDrag", "cannot be loaded: division by zero"),
        (
            "effects.stokes_drag",
            "repose_plugins.stokes_drag:StokesDrag",
            "'effects' is not a kind of plug-in; allowed: contact_law",
        ),
    ],
)
def test_a_plug_in_that_cannot_be_used_is_one_line_that_names_it(tmp_path, entry, value, message):
    site = installed(tmp_path / "site", entries={entry: value})
    (site / "repose_plugins" / "broken.py").write_text("1 / 0\n")
    done = python(site, "-m", "explorer", "parameters")
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: plug-in {entry} of repose-plugins 1.0: ")
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_thing_of_two_packages_is_refused(site, tmp_path):
    """Otherwise which of the two acts hangs on the order of folders."""
    entry = "effect.stokes_drag"
    other = tmp_path / "other"
    info = other / "other_plugins-2.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: other-plugins\nVersion: 2.0\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\n{entry} = repose_plugins.stokes_drag:StokesDrag\n")
    done = python(os.pathsep.join([str(site), str(other)]), "-m", "explorer", "parameters")
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: plug-in {entry} of ")
    assert all(name in done.stderr for name in ("other-plugins 2.0", "repose-plugins 1.0", "adds one of that name"))


def test_a_module_of_a_package_may_be_imported_first(site):
    """As its own tests do: the protocol that it follows must not load it again."""
    code = """
import json
from repose_plugins.stokes_drag import StokesDrag
from solver import EFFECTS, load_material, with_values
print(json.dumps([EFFECTS["stokes_drag"] is StokesDrag]))
"""
    assert said(site, code) == [True]
