"""What scripts and notebooks take from ``explorer``: it loads late, and gives what commands and the packages give."""

import json
import os
import re
import subprocess
import sys
from html import unescape
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest
from plotly.offline import get_plotlyjs

import explorer
from doe.store import Store
from explorer.diagnosis import run as diagnosis_run
from explorer.report import report_html
from explorer.report.diagnosis import diagnosis_html
from explorer.study import run as study_run
from solver import (
    EFFECTS,
    WorkerPool,
    load_material,
    observable_names,
    observe,
    packed,
    poured_mass,
    run_pour,
    unpacked,
    value,
    with_rig,
    with_values,
)
from tests.explorer import diagnosed, reported_studies
from tests.explorer.command_line import explorer as command
from tests.explorer.report.test_charts_stay_private import ADDRESS
from tests.explorer.study.test_run import Formula

pytestmark = pytest.mark.usefixtures("unprinted")

ROOT = Path(__file__).parents[2]
FRICTION = "pair.seed.seed.static_friction"
SMALL = {"rig.mass": "2 g", "body.spheres": "coarse", "insertion.rate": "50 g/s"}


@pytest.fixture(scope="module")
def scene():
    return explorer.load("sunflower_extract", SMALL)


@pytest.fixture(scope="module")
def poured(taichi, scene):
    return explorer.pour(scene, seed=3)


@pytest.fixture(scope="module")
def swept(scene, tmp_path_factory):
    """A grid of two by one over two seeds, and the store that it was poured into."""
    store = tmp_path_factory.mktemp("sweep") / "pours.sqlite"
    values = {FRICTION: ["20 %", 0.6], "rig.outlet_height": "70 mm"}
    return explorer.sweep(scene, values, [3, 1], store=store, workers=2, progress=False), store


def python(*arguments, cwd):
    """A process of its own in the folder ``cwd``."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run([sys.executable, *arguments], env=environment, cwd=cwd, capture_output=True, text=True)


def test_the_import_brings_nothing_and_a_look_at_a_scene_no_taichi(tmp_path):
    code = (
        "import sys, explorer\n"
        "seen = {name.partition('.')[0] for name in sys.modules}\n"
        "print(*sorted(seen & {'doe', 'numpy', 'pandas', 'plotly', 'rich', 'solver', 'taichi', 'typer', 'viser'}))\n"
        "explorer.parameters(explorer.load('funnel'))\n"
        "print(*sorted(sys.modules.keys() & {'pandas', 'rerun', 'taichi', 'viser'}))"
    )
    done = python("-c", code, cwd=tmp_path)
    assert (done.stdout, done.stderr) == ("\npandas\n", "")


def test_every_name_is_there_listed_and_documented():
    assert explorer.__all__ == sorted(explorer.__all__) == sorted(explorer._LATE)
    for name in explorer.__all__:
        assert getattr(explorer, name).__name__ == name
        assert getattr(explorer, name).__doc__
    assert set(explorer.__all__) <= set(dir(explorer))
    with pytest.raises(AttributeError, match="no attribute 'pours'"):
        explorer.pours  # noqa: B018


@pytest.mark.parametrize("name", ["doe", "solver"])
@pytest.mark.parametrize("file", ["{}.py", "{}/__init__.py"])
def test_a_namesake_that_stands_before_ours_is_one_line(tmp_path, name, file):
    namesake = tmp_path / file.format(name)
    namesake.parent.mkdir(exist_ok=True)
    namesake.write_text("raise SystemExit('somebody else began')")
    line = python("-c", "import explorer", cwd=tmp_path).stderr.splitlines()[-1]
    assert line.startswith(f"ImportError: explorer needs the package `{name}` beside it in {ROOT}, but Python finds ")
    assert str(namesake) in line


def test_load_takes_what_the_command_line_takes(scene, tmp_path):
    assert scene == with_values(load_material("sunflower_extract"), SMALL)
    assert explorer.load(scene) is scene
    assert explorer.load(scene, {"rig.mass": 0.004}) == with_values(scene, {"rig.mass": 0.004})
    drum = explorer.load("rotating_drum", {"rig.averaging_turns": 2.0}, material="nine_sphere_seed")
    assert drum == with_values(
        with_rig(load_material("nine_sphere_seed"), "rotating_drum"), {"rig.averaging_turns": 2.0}
    )
    assert explorer.load(scene, {"rig.name": "lifting_cylinder"}).rig.name == "lifting_cylinder"


@pytest.mark.parametrize(
    ("source", "settings"),
    [("nowhere", {}), ("funnel", {"rig.masss": "1g"}), ("funnel", {"rig.mass": "2 m"})],
)
def test_a_bad_input_is_the_line_of_the_command(source, settings):
    with pytest.raises(ValueError, match=r"\w") as refused:
        explorer.pour(source, settings)
    words = [word for path, text in settings.items() for word in ("--set", f"{path}={text}")]
    told = command("export", source, "never", "--to", "liggghts", *words).stderr.removeprefix("error: ").strip()
    assert str(refused.value) == told.removeprefix("--set: ")


def test_nothing_is_poured_into_a_bench_test():
    with pytest.raises(ValueError, match="'inclined_plane' is a bench test; a pour needs one of funnel"):
        explorer.pour("inclined_plane")


@pytest.mark.parametrize("seed", [-1, 1.5])
def test_a_seed_that_is_none_is_one_line(scene, seed):
    with pytest.raises(ValueError, match=f"^seed {seed}: allowed: a whole number from 0, below 2\\^63$"):
        explorer.pour(scene, seed=seed)


def test_a_material_needs_a_rig(scene):
    with pytest.raises(ValueError, match="allowed only with the name of a rig"):
        explorer.load(scene, material="nine_sphere_seed")


def test_the_folder_of_a_calibration_is_its_optimum_with_a_caution(tmp_path):
    content = reported_studies.result_of_case("nothing acts")
    content["study"]["profile"]["name"] = "quick"
    (tmp_path / "result.json").write_text(json.dumps(content))
    with pytest.warns(UserWarning, match="not better than noise"):
        found = explorer.load(tmp_path, {"rig.mass": "5 g"})
    for path, level in content["optimum"]["values"].items():
        assert value(found, path) == pytest.approx(level)
    assert value(found, "rig.mass") == 0.005


def test_parameters_and_observables_are_tables_of_what_is_declared(scene):
    table = explorer.parameters(scene)
    assert table.loc["rig.mass", ["value", "unit", "live"]].tolist() == [0.002, "kg", False]
    assert table.loc[FRICTION, "low"] <= table.loc[FRICTION, "value"] <= table.loc[FRICTION, "high"]
    assert np.isnan(table.loc["body.spheres", "low"])
    assert "coarse" in table.loc["body.spheres", "choices"]
    assert {f"effect.{name}" for name in EFFECTS} <= {path.rpartition(".")[0] for path in table.index}
    assert tuple(explorer.observables(scene).index[: len(observable_names(scene))]) == observable_names(scene)
    assert explorer.observables(scene).loc["angle_of_repose_deg", "unit"] == "deg"


def test_a_pour_is_the_solvers_own(poured, scene):
    record = run_pour(scene, 3, threads=1)
    assert np.array_equal(poured.positions, record.bodies.position)
    assert np.array_equal(poured.quaternions, record.bodies.quaternion)
    assert poured.positions[poured.in_pile].shape == record.pile.position.shape
    assert poured.components.shape == poured.in_pile.shape == (len(poured.positions),)
    assert set(poured.components) <= {body.name for body in scene.bodies}
    assert (poured.outcome, poured.message, poured.seed) == (record.outcome, record.message, 3)
    assert repr(poured).startswith(f"<Poured {scene.title!r}, seed 3: no heap: ")


def test_curves_end_with_the_mass_that_was_poured(poured, scene):
    curves = poured.curves
    assert curves.index.name == "time_s"
    assert curves.index.is_monotonic_increasing
    last = curves.iloc[-1]
    # Counts of bodies are whole numbers.
    heaviest = poured.record.bodies.mass.max()
    assert last["entered_mass_kg"] == pytest.approx(poured_mass(scene), abs=len(scene.bodies) * heaviest)
    assert last["discharged_mass_kg"] == pytest.approx(poured.record.bodies.mass.sum())


def test_observables_are_read_off_the_raw_pour(poured):
    kept = observe(unpacked(packed(poured.record)))
    assert poured.observables.value.to_dict() == pytest.approx({n: v.value for n, v in kept.items()}, nan_ok=True)
    assert poured.observables.unit.to_dict() == {name: found.unit for name, found in kept.items()}
    assert poured.observables.spread["angle_of_repose_deg"] == kept["angle_of_repose_deg"].spread


def test_a_notebook_shows_outline_and_observables(poured):
    shown = poured._repr_html_()
    assert shown.count("<svg") == 1
    assert "View along +y" in shown
    assert "angle_of_repose_deg" in shown
    assert "&lt;Poured" in shown


def test_a_sweep_is_the_grid_in_order_and_every_row_a_pour(swept, scene, taichi):
    table, _ = swept
    assert table[[FRICTION, "rig.outlet_height", "seed"]].to_numpy().tolist() == [
        [0.2, 0.07, 3],
        [0.2, 0.07, 1],
        [0.6, 0.07, 3],
        [0.6, 0.07, 1],
    ]
    assert table.columns[-1] == "message"
    names = list(explorer.observables(scene).index)
    assert list(table.columns[5:-1]) == names
    assert table.attrs["units"][FRICTION] == "1"
    assert table.attrs["units"]["apex_height_m"] == table.attrs["units"]["rig.outlet_height"] == "m"
    one = explorer.pour(scene, {FRICTION: 0.6, "rig.outlet_height": 0.07}, seed=1)
    row = table.iloc[3]
    assert (row.outcome, row.valid, row.message) == (one.outcome, one.outcome.valid, one.message)
    assert set(one.observables.index) == set(names)
    assert row[names].to_dict() == pytest.approx(one.observables.value.to_dict(), nan_ok=True)


def test_mass_fractions_of_a_sweep_are_those_that_are_poured(scene, monkeypatch, tmp_path):
    """Fractions that are set stay as they are, and scale the others."""
    fractions = {"body.seed.mass_fraction": [0.5], "body.plate.mass_fraction": [0.3]}
    queued = []
    monkeypatch.setattr(WorkerPool, "run_queue", lambda self, queue, room: queued.extend(queue) or [])
    table = explorer.sweep(scene, fractions, np.int64(1), store=tmp_path / "pours.sqlite", progress=False)
    assert table.empty  # no pour came back
    changed = with_values(scene, {path: one for path, (one,) in fractions.items()})
    assert [job.scene for job in queued] == [changed]
    assert sum(value(changed, f"body.{body.name}.mass_fraction") for body in scene.bodies) == pytest.approx(1.0)
    shares = [value(changed, f"body.{name}.mass_fraction") for name in ("seed", "plate", "petiole")]
    assert shares == pytest.approx([0.5, 0.3, 0.2])


def test_what_is_in_the_store_is_not_poured_again(swept, scene, monkeypatch):
    table, store = swept

    def refuse(*_):
        raise AssertionError("nothing is left to pour")

    monkeypatch.setattr(WorkerPool, "run_queue", refuse)
    again = explorer.sweep(
        scene,
        {"rig.outlet_height": [0.07], FRICTION: np.array([0.6])},
        (1, 3),
        observables=["apex_height_m"],
        store=store,
        progress=False,
    )
    assert again.seed.tolist() == [1, 3]
    assert again.apex_height_m.tolist() == table.apex_height_m.tolist()[:1:-1]
    kept = Store(store, pouring=False)
    assert {run.study for run in kept.runs()} == {"sweep"}
    kept.close()


@pytest.mark.parametrize(
    ("values", "options", "told"),
    [
        ({"rig.mass": ["5 g", "2 m"]}, {}, "rig.mass: unit 'm'"),
        ({"rig.masss": [1]}, {}, "rig.masss: no such parameter"),
        ({}, {"observables": ["angle"]}, "observables: 'angle' is not one of angle_of_repose_deg, "),
        ({"rig.mass": np.int64(20)}, {}, "rig.mass: 20 kg"),
        ({"rig.mass": None}, {}, "rig.mass: None"),
        ({}, {"seeds": [1, -1]}, "seed -1: allowed: a whole number from 0"),
        ({}, {"seeds": -1}, "seeds -1: allowed: a number of seeds from 1 on"),
        ({}, {"seeds": 0}, "seeds 0: allowed: a number of seeds from 1 on"),
        ({}, {"seeds": []}, r"seeds \[\]: allowed: a number of seeds from 1 on"),
        ({}, {"seeds": 2.5}, "seeds 2.5: allowed: a number of seeds from 1 on"),
        ({}, {"seeds": [3, 4, 3]}, "seeds: 3 appears 2 times"),
        ({}, {"seeds": [np.nan]}, "seed nan: allowed: a whole number from 0"),
        ({}, {"seeds": [np.inf]}, "seed inf: allowed: a whole number from 0"),
        ({}, {"seeds": [2**63]}, "seed 9223372036854775808: allowed: a whole number from 0, below"),
        ({"rig.mass": []}, {}, "rig.mass: no values"),
        ({}, {"workers": 0}, "workers 0: allowed: a whole number of at least 1"),
        ({}, {"workers": -1}, "workers -1: allowed: a whole number of at least 1"),
    ],
)
def test_a_sweep_is_refused_before_anything_is_poured(scene, tmp_path, values, options, told):
    with pytest.raises(ValueError, match=told):
        explorer.sweep(scene, values, store=tmp_path / "pours.sqlite", **options)
    assert list(tmp_path.iterdir()) == []


def test_a_script_without_a_guard_runs_once(tmp_path):
    """multiprocessing imports a script in every process that it spawns, unless told otherwise."""
    script = tmp_path / "script.py"
    script.write_text(
        "import explorer\n"
        "print('begun')\n"
        f"scene = explorer.load('funnel', {SMALL | {'numerics.max_time': 0.2}!r})\n"
        "print(len(explorer.sweep(scene, {}, seeds=2, store='pours.sqlite', workers=1)))\n"
    )
    done = python(script, cwd=tmp_path)
    assert (done.stdout.split(), done.stderr) == (["begun", "2"], "")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A study by a formula: its result, its folder, and what was said meanwhile."""
    said, folder = [], tmp_path_factory.mktemp("study") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_run, "PourRunner", Formula)
        store = folder.parent / "pours.sqlite"
        result = explorer.run_study("sunflower_extract", folder, profile="quick", store=store, tries=5, say=said.append)
    return result, folder, said


@pytest.fixture(scope="module")
def diagnosis(tmp_path_factory):
    """A diagnosis of made-up data, and its folder."""
    measurement, found = diagnosed.diagnosed(**diagnosed.CASES["effect"])
    folder = tmp_path_factory.mktemp("diagnosis") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(diagnosis_run, "load_measurement", lambda folder: measurement)
        patch.setattr(diagnosis_run, "run_diagnosis", lambda *given, **options: found)
        store = folder.parent / "pours.sqlite"
        result = explorer.diagnose(
            "trefoil_2", folder, effects=["adhesion_sjkr"], store=store, apply=False, say=lambda line: None
        )
    return result, folder


def test_a_study_leaves_the_folder_of_the_command_and_is_read_back(study):
    result, folder, said = study
    assert {"result.json", "report.html", "report.md"} <= {path.name for path in folder.iterdir()}
    assert any(line.endswith("report.html, report.md, result.json") for line in said)
    assert Formula.tries == result.study.tries == 5
    assert explorer.load_study(folder).to_dict() == result.to_dict()
    with pytest.raises(ValueError, match="is not empty"):
        explorer.run_study("sunflower_extract", folder, profile="quick")


def test_a_diagnosis_leaves_the_folder_of_the_command_and_is_read_back(diagnosis):
    result, folder = diagnosis
    assert {"diagnosis.json", "report.html", "report.md"} <= {path.name for path in folder.iterdir()}
    assert (result.verdict, result.names) == ("effect:adhesion_sjkr", ("adhesion_sjkr",))
    assert result.order.effects == ("adhesion_sjkr",)
    assert explorer.load_diagnosis(folder).to_dict() == result.to_dict()
    with pytest.raises(ValueError, match="'glue' is not one of"):
        explorer.diagnose("trefoil_2", folder, effects=["glue"])


@pytest.mark.parametrize("load", [explorer.load_study, explorer.load_diagnosis])
def test_a_folder_without_a_result_is_one_line(tmp_path, load):
    with pytest.raises(ValueError, match=r"holds no (result|diagnosis)\.json"):
        load(tmp_path)
    for name in ("result.json", "diagnosis.json"):
        (tmp_path / name).write_text('{"schema": 0}')
    with pytest.raises(ValueError, match=r"\.json: .* made by an older version of the program") as refused:
        load(tmp_path)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("made", "report"), [("study", report_html), ("diagnosis", diagnosis_html)])
def test_charts_are_those_of_the_report(made, report, request):
    result = request.getfixturevalue(made)[0]
    drawn = explorer.charts(result)
    whole = report(result)
    # The drawing of the set-up is no chart.
    assert list(drawn) == re.findall(r'<figure id="([^"]+)"><script', whole)
    for chart in drawn.values():
        assert isinstance(chart.figure, go.Figure)
        assert len(chart.figure.data) == len(chart.drawn.spec["data"])


@pytest.mark.parametrize("made", ["study", "diagnosis"])
def test_a_notebook_shows_charts_in_a_frame_that_may_load_nothing(made, request):
    drawn = explorer.charts(request.getfixturevalue(made)[0])
    one = next(iter(drawn.values()))
    for shown, number in ((drawn, len(drawn)), (one, 1)):
        frame = shown._repr_html_()
        assert frame.startswith('<iframe srcdoc="')
        assert frame.count('"') == 2 * frame.count('="')
        inside = unescape(frame.split('"')[1])
        assert inside.count("<figure id=") == number
        assert "default-src 'none'" in inside
        assert ADDRESS.findall(inside.replace(get_plotlyjs(), "")) == []
    assert repr(one) == f"<Chart {one.drawn.name!r}: {one.section}>"
    assert repr(drawn) == f"<Charts {', '.join(drawn)}>"


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: explorer.sweep("funnel", {"rig.mass": [0.01, "10 g"]}), "comes 2 times; allowed: each once"),
        (
            lambda: explorer.sweep(
                "funnel", {"pair.seed.plate.restitution": [0.2], "pair.plate.seed.restitution": [0.3]}
            ),
            "pair.seed.plate.restitution is named twice",
        ),
        (lambda: explorer.sweep("funnel", {}, seeds=None), "seeds None: allowed"),
        (lambda: explorer.sweep("funnel", None), "values None: allowed: a dictionary"),
        (lambda: explorer.sweep("funnel", {}, observables="angle"), "observables: 'angle' is not one of"),
        (
            lambda: explorer.run_study("sunflower_extract", "out", tries=0),
            "tries 0: allowed: a whole number from 1 to 20",
        ),
        (lambda: explorer.diagnose("trefoil_2", "out", seed=-1), "seed -1: allowed"),
        (lambda: explorer.diagnose("trefoil_2", "out", effects="drag"), "'drag' is not one of"),
        (lambda: explorer.diagnose("trefoil_2", "out", effects="air_drag", budget=1), "1"),
    ],
)
def test_wrong_arguments_are_one_line_and_write_nothing(call, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=re.escape(says)) as error:
        call()
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []
