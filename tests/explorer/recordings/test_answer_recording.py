"""The piles of an answer as one recording: what is in it is the data, two pours, and the numbers of the answer."""

import csv
import json
import shutil
import sys
from dataclasses import replace

import numpy as np
import pytest
from rerun.chunk import RrdReader

from doe.declared.model import effect_values
from doe.measurement.load import load_measurement
from doe.studies.study import load_study, with_profile
from explorer.errors import CommandError
from explorer.recordings.recording_reader import read_recording
from explorer.report import folder as report_folder
from explorer.study import run as study_run
from explorer.viewer.actions import Actions
from explorer.viewer.output.pile_recording import CANCEL, RECORD, PileRecording
from solver import asset_path, run_pour, with_values
from solver.assets import measurement_folder
from solver.observables import observe
from tests.explorer import diagnosed
from tests.explorer.background.waiting import wait_for
from tests.explorer.command_line import explorer, refused
from tests.explorer.recordings.test_pour_log import rows
from tests.explorer.study.test_run import Formula
from tests.explorer.viewer.page_session import event, finished, page_context
from tests.explorer.viewer.person import Browser

pytestmark = pytest.mark.usefixtures("unprinted")

SEED = 1
EFFECT = ("rolling_resistance", (0.2,))
STUDY = "sunflower_extract"


def text_of(path, entity):
    (document,) = rows(path, entity, "TextDocument:text")
    return str(document[0])


def entities(path):
    return {chunk.entity_path for chunk in RrdReader(str(path)).stream()}


def is_recorded(path, name, record):
    """Positions at the end and the trace of a pour are those of ``record``, and its outcome is told."""
    found = read_recording(path, under=name)
    for k, body in enumerate(record.bodies.component_names):
        chosen = (record.bodies.component == k) & record.bodies.inside
        (component,) = [one for one in found.components if one.shape.name == body] or [None]
        there = np.zeros((0, 3), np.float32) if component is None else component.at(np.inf).position
        assert np.array_equal(there, record.bodies.position[chosen].astype(np.float32))
    times, mass = found.curves["discharged_mass_g"]
    assert (times[-1], mass[-1]) == pytest.approx((record.trace.time[-1], 1e3 * record.trace.discharged_mass[-1]))
    angle = observe(record)["angle_of_repose_deg"].value
    if np.isfinite(angle):
        assert found.curves["angle_of_repose_deg"][1][-1] == angle
    assert found.outcome.startswith(f"# {str(record.outcome).replace('_', ' ')}")
    assert f"Seed {SEED};" in found.parameters


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """The shipped data with a tenth of the mass, scanned while the bodies come down."""
    folder = tmp_path_factory.mktemp("answer") / "data"
    shutil.copytree(measurement_folder("trefoil_2"), folder)
    file = folder / "measurement.toml"
    text = file.read_text().replace("mass = 0.030", "mass = 0.002").replace("duration = 2.6", "duration = 0.5")
    file.chmod(0o644)
    file.write_text(text)
    return folder


@pytest.fixture(scope="module")
def result(data):
    """A made-up answer about these data."""
    found = diagnosed.typed(diagnosed.result_of_case("effect"))
    theta = tuple(one.mean for one in load_measurement(data).parameters)
    models = replace(
        found.confirmation,
        before=replace(found.confirmation.before, theta=theta, effects=()),
        after=replace(found.confirmation.after, theta=theta, effects=(EFFECT,)),
    )
    return replace(found, data=replace(found.data, folder=str(data)), confirmation=models)


@pytest.fixture(scope="module")
def answered(taichi, result, data):
    """Output folder of the finished diagnosis, and its recording by the command line."""
    out, path = data.parent / "out", data.parent / "piles.rrd"
    out.mkdir()
    (out / "diagnosis.json").write_text(json.dumps(result.to_dict()))
    done = explorer("diagnose", data, "--out", out, "--record", path)
    assert done.exit_code == 0, done.output
    assert [file.name for file in out.iterdir()] == ["diagnosis.json"]
    assert "finished already; only recorded" in done.output
    return out, path


@pytest.mark.slow
def test_both_models_are_recorded_as_a_direct_pour_of_them_goes(answered, data):
    condition = load_measurement(data).fit[0]
    parameters = {one.path: one.mean for one in load_measurement(data).parameters}
    before = with_values(condition.scene, parameters)
    for name, scene in (("calibrated", before), ("corrected", with_values(before, effect_values(*EFFECT)))):
        is_recorded(answered[1], name, run_pour(scene, SEED, threads=1))


def test_the_measured_pile_and_outlines_are_those_of_the_data(answered, result):
    (vertices,) = rows(answered[1], "/measured/world/pile", "Mesh3D:vertex_positions")
    (scan,) = [one for one in result.maps if one.condition == "fit"]
    assert vertices[:, 2].reshape(scan.measured.shape) == pytest.approx(scan.measured, abs=1e-8)
    (profile,) = [one for one in result.piles if one.condition == "fit"]
    for name, band in (("measured", profile.measured), ("calibrated", profile.before), ("corrected", profile.after)):
        (strips,) = rows(answered[1], f"/outlines/{name}", "LineStrips2D:strips")
        mean, above, below = (np.array(strip.tolist()) for strip in strips)
        assert mean[:, 0] == pytest.approx(1e3 * profile.radius, rel=1e-6)
        assert -mean[:, 1] == pytest.approx(1e3 * band.mean, rel=1e-6, abs=1e-6)
        assert 0.5 * (below - above)[:, 1] == pytest.approx(1e3 * band.sd, rel=1e-4, abs=1e-5)


def test_the_measured_curves_are_those_of_the_table(answered, data):
    lines = [line for line in (data / "fit.csv").read_text().splitlines() if not line.startswith("#")]
    table = list(csv.DictReader(lines))
    angles = [float(row["value"]) for row in table if row["observable"] == "angle_of_repose_deg"]
    shown = rows(answered[1], "/measured/curves/angle/angle_of_repose_deg", "Scalars:scalars")
    # Ours are read off the piles, those of the table by the other engine's own program.
    assert [float(one[0]) for one in shown] == pytest.approx(2 * [np.mean(angles)], abs=0.05)
    masses = {}
    for row in table:
        if row["observable"] == "discharged_mass_kg":
            masses.setdefault(float(row["x"]), []).append(1e3 * float(row["value"]))
    shown = rows(answered[1], "/measured/curves/mass/discharged_mass_g", "Scalars:scalars")
    assert [float(one[0]) for one in shown] == pytest.approx([np.mean(masses[x]) for x in sorted(masses)])


def test_the_bars_are_the_errors_over_the_noise(answered, result):
    for role, words in (("fit", "fitted"), ("holdout", "held-out")):
        errors = [row for row in result.error.of(role) if row.noise_floor > 0.0]
        assert len(errors) > 5
        for side, name in enumerate(("before", "after")):
            entity = f"/errors/{words}/{name}"
            (bars,) = rows(answered[1], entity, "BarChart:values")
            expected = [(row.before, row.after)[side] / row.noise_floor for row in errors]
            assert tensor(bars) == pytest.approx(expected)
        (noise,) = rows(answered[1], f"/errors/{words}/noise", "BarChart:values")
        assert set(tensor(noise)) == {1.0}
    told = text_of(answered[1], "/answer")
    assert "The declared model lacks `adhesion_sjkr`" in told
    assert "| 1: angle of repose |" in told


def tensor(value):
    """Numbers of a tensor of float64, whatever rerun wraps them in."""
    (one,) = value
    return np.array(one["buffer"], dtype=np.float64) if isinstance(one["buffer"], list) else np.array(one["buffer"])


def test_it_opens_side_by_side(answered):
    assert len(RrdReader(str(answered[1])).blueprints()) == 1
    assert {"/calibrated/world/plate", "/corrected/world/plate", "/measured/world/plate"} <= entities(answered[1])
    with pytest.raises(CommandError, match="holds no bodies"):
        read_recording(answered[1])


def test_where_nothing_is_added_one_model_is_poured(answered, result):
    from explorer.recordings.answer_recording import diagnosis_answer

    answer = diagnosis_answer(replace(result, final="base", maps=(), piles=()))
    assert list(answer.models) == ["calibrated"]
    assert (answer.measured, answer.outlines) == (None, ())
    assert "only numbers were measured" in answer.measured_words


def test_a_name_that_cannot_be_is_refused_before_anything_is_poured(answered, data, tmp_path):
    there = tmp_path / "there.rrd"
    there.write_text("mine")
    for path, says in (
        (there, "exists already"),
        (tmp_path / "piles.txt", "must end in .rrd"),
        (tmp_path / "no" / "piles.rrd", "there is no folder"),
    ):
        assert says in refused(explorer("diagnose", data, "--out", tmp_path / "new", "--record", path))
    for path in (there, tmp_path / "no" / "piles.rrd"):
        order = ("calibrate", "--headless", "--profile", "quick", "--out", tmp_path / "new", "--record", path)
        assert str(path) in refused(explorer(*order))
    assert [one.name for one in tmp_path.iterdir()] == ["there.rrd"]
    asked = ("--out", answered[0], "--record", tmp_path / "new.rrd")
    assert "another question" in refused(explorer("diagnose", "trefoil_1", *asked))
    assert "another question" in refused(explorer("diagnose", data, "--seed", 5, *asked))


@pytest.fixture(scope="module")
def calibrated(taichi, tmp_path_factory):
    """A study by a formula, of pours that are cut off at once, with its recording."""
    folder = tmp_path_factory.mktemp("study")
    text = asset_path("studies", STUDY).read_text()
    file, path = folder / "cut_off.toml", folder / "piles.rrd"
    file.write_text(text.replace("[insertion]\n", "[numerics]\nmax_time = 0.1\n\n[insertion]\n"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_run, "PourRunner", Formula)
        patch.setattr(report_folder, "find_spec", lambda name: None)
        order = ("calibrate", "--headless", "--study", file, "--profile", "quick", "--out", folder / "out")
        done = explorer(*order, "--store", folder / "runs.sqlite", "--record", path)
        assert done.exit_code == 0, done.output
        again = explorer(*order, "--record", folder / "again.rrd")
    assert again.exit_code == 0, again.output
    assert "only recorded" in again.output
    return file, path, json.loads((folder / "out" / "result.json").read_text())


def test_a_study_is_recorded_at_its_declared_values_and_at_its_optimum(calibrated):
    file, path, found = calibrated
    declared = with_profile(load_study(str(file)), "quick")[0].scene
    optimum = with_values(declared, found["verification"]["values"])
    for name, scene in (("declared", declared), ("optimum", optimum)):
        record = run_pour(scene, SEED, threads=1)
        # A pour that does not end well is told by its name.
        assert str(record.outcome) == "time_limit"
        is_recorded(path, name, record)
    assert entities(path) == entities(path.with_name("again.rrd"))


def test_its_target_is_a_line_and_its_errors_are_against_the_measured_scatter(calibrated):
    _, path, found = calibrated
    lines = rows(path, "/measured/curves/angle/angle_of_repose_deg", "Scalars:scalars")
    assert [float(one[0]) for one in lines] == [24.68, 24.68]
    assert "silhouette 24.68°" in text_of(path, "/measured/words")
    pilot = [
        run["observables"]["angle_of_repose_deg"] for run in found["pilot"]["runs"][0] if run["outcome"] == "at_rest"
    ]
    means = {"before": np.mean(pilot), "after": found["verification"]["tests"][0]["simulated"]["mean"]}
    for name, mean in means.items():
        (bars,) = rows(path, f"/errors/targets/{name}", "BarChart:values")
        assert tensor(bars) == pytest.approx([abs(mean - 24.68) / 1.6])


PROGRAM = """
import sys
order = sys.argv[1:]
if order[0] != "diagnose":
    sys.exit("error: no such answer")
open(order[order.index("--record") + 1], "w").write(" ".join(order[:4]))
"""


def test_the_page_sends_the_recording_to_the_browser_that_asked(server, tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    program, actions, browser = (sys.executable, str(tmp_path / "program.py")), Actions(), Browser()
    orders = [(tmp_path / "out.1", ["diagnose", "data"]), (tmp_path / "out.1", ["calibrate"])]
    page = page_context(server, post=actions.post, data=tmp_path / "kept")
    panel = PileRecording(page, lambda: orders.pop(0), program)
    notices = []
    for _ in range(2):
        event(panel._buttons, RECORD, client=browser)
        panel.show()
        notices.append(finished(actions, panel._work))
    assert notices == ["", "no such answer"]
    ((name, content),) = browser.sent.items()
    assert name.startswith("out.1-piles-")
    assert content.decode() == f"diagnose data --out {tmp_path / 'out.1'}"
    assert [one.name for one in (tmp_path / "kept" / "recordings").iterdir()] == [name]


TOLD = """
import os, sys, time
print("pouring the <after> model", flush=True)
while not os.path.exists(sys.argv[1]):
    time.sleep(0.01)
print("x" * 200_000, file=sys.stderr)
open(sys.argv[sys.argv.index("--record") + 1], "w").write("a recording")
"""


def test_what_the_recording_is_at_is_told_while_it_pours(server, tmp_path):
    (tmp_path / "program.py").write_text(TOLD)
    program, actions, browser = (sys.executable, str(tmp_path / "program.py")), Actions(), Browser()
    page = page_context(server, post=actions.post, data=tmp_path)
    panel = PileRecording(page, lambda: (tmp_path / "out", [str(tmp_path / "go on")]), program)
    event(panel._buttons, RECORD, client=browser)

    def told():
        actions.carry_out()
        panel.show()
        return "recording the piles: pouring the &lt;after&gt; model" in panel._line.content

    wait_for(told)
    (tmp_path / "go on").touch()
    assert finished(actions, panel._work) == ""
    panel.show()
    assert not panel._line.visible
    assert list(browser.sent.values()) == [b"a recording"]


def test_a_recording_is_cancelled_and_leaves_nothing(server, tmp_path):
    (tmp_path / "program.py").write_text(TOLD)
    program, actions, browser = (sys.executable, str(tmp_path / "program.py")), Actions(), Browser()
    page = page_context(server, post=actions.post, data=tmp_path)
    panel = PileRecording(page, lambda: (tmp_path / "out", [str(tmp_path / "never")]), program)
    panel.show()
    assert tuple(panel._buttons.options) == (RECORD,)
    event(panel._buttons, RECORD, client=browser)
    actions.carry_out()
    panel.show()
    assert tuple(panel._buttons.options) == (CANCEL,)
    event(panel._buttons, CANCEL, client=browser)
    assert finished(actions, panel._work) == "the recording of the piles was cancelled"
    panel.show()
    assert tuple(panel._buttons.options) == (RECORD,)
    assert list((tmp_path / "recordings").iterdir()) == []
    assert not browser.sent
