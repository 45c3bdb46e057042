"""A calibration from the command line to its files, with a formula in place of the pours."""

import dataclasses
import json
import re
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from doe.errors import StudyFileError
from doe.pour_runner import TRIES
from doe.studies.study_result import OWN_STAGES, Stages
from explorer.background.output_folder import kept_for_one
from explorer.background.reporter import LOG
from explorer.photograph.target import FOLDER, load_target, remove_target
from explorer.report import folder
from explorer.study import run as study_run
from explorer.study.process import PARTIAL, RESULT
from solver import asset_path, unpacked
from solver.pours.record import Spheres
from tests.doe.formula_runner import FormulaRunner
from tests.doe.studies.test_campaign import planted
from tests.explorer import reported_studies
from tests.explorer.command_line import explorer
from tests.explorer.events import checked_events, lines_of
from tests.explorer.viewer.study_panel_at_hand import study_with_own_profiles

pytestmark = pytest.mark.usefixtures("unprinted")


class Formula(FormulaRunner):
    """Takes the arguments of a PourRunner and tells its progress in the same way."""

    def __init__(self, scene, store, study, seed, threads, on_run, observer, pours, tries, experiments, watched):
        super().__init__(planted, sigma=0.5)
        assert not experiments
        self._on_run = on_run
        Formula.tries = tries

    def run(self, stage, settings):
        rows = super().run(stage, settings)
        left = sum(setting.replicates for setting in settings)
        for runs in rows:
            for one in runs:
                left -= 1
                self._on_run(stage, one, left)
        return rows


@pytest.fixture
def formula(monkeypatch):
    monkeypatch.setattr(study_run, "PourRunner", Formula)
    # Figures for print take half a minute; tests/explorer/report/test_report_files.py has them.
    monkeypatch.setattr(folder, "find_spec", lambda name: None)


def calibrate(tmp_path, *options):
    store = ("--store", str(tmp_path / "runs.sqlite"))
    return explorer("calibrate", "--headless", "--profile", "quick", "--out", str(tmp_path / "out"), *store, *options)


@pytest.mark.usefixtures("formula")
def test_two_studies_in_one_folder_are_refused_and_the_first_is_left_alone(tmp_path):
    with kept_for_one(tmp_path / "out"):
        refused = calibrate(tmp_path, "--resume")
    assert refused.exit_code == 2
    assert refused.output.count("\n") == 1
    assert "out: another command is writing there" in refused.output
    assert not list((tmp_path / "out").iterdir())


@pytest.mark.usefixtures("formula")
def test_a_study_leaves_result_and_reports(tmp_path):
    done = calibrate(tmp_path, "--json")
    assert done.exit_code == 0, done.output
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    keys = {"screening", "ascent", "surface", "optimum", "verification", "assumptions", "runs", "timing", "versions"}
    assert keys <= set(result)
    assert len(result["screening"]["runs"]) == 28
    assert len(result["surface"]["runs"]) == 17
    assert result["runs"]["total"] == len(result["runs"]["list"])
    for name in ("report.html", "report.md"):
        assert (tmp_path / "out" / name).stat().st_size > 1000
    events = checked_events(done.stdout)
    assert events == lines_of((tmp_path / "out" / "progress.jsonl").read_text())
    assert (events[-1]["outcome"], events[-1]["result"]) == ("finished", str(tmp_path / "out" / "result.json"))
    assert "report.html" in done.stderr
    assert re.search(r"\d+ runs of coarse shapes, roughly \d+ (s|min) on \d+ core.* GB of memory", done.stderr)
    assert {line["run_id"] for line in lines_of((tmp_path / "out" / LOG).read_text())} == {events[0]["run_id"]}
    assert [event["stage"] for event in events if event["line"]] == list(OWN_STAGES)
    assert events[-1]["done"] == events[-1]["planned"] == result["runs"]["total"]
    assert list(events[0]["stages"]) == list(OWN_STAGES)
    assert {name: done for name, (done, _) in events[-1]["stages"].items() if done} == result["runs"]["by_stage"]
    assert sum(event["run"] is not None for event in events) == result["runs"]["total"]
    assert not (tmp_path / "out" / "partial.json").exists()
    assert Formula.tries == TRIES


@pytest.mark.usefixtures("formula")
def test_a_folder_that_is_not_empty_needs_resume(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    refused = calibrate(tmp_path)
    assert refused.exit_code == 2
    assert "not empty" in refused.stderr
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["notes.txt"]
    assert calibrate(tmp_path, "--resume").exit_code == 0
    assert (tmp_path / "out" / "notes.txt").read_text() == "mine"


@pytest.mark.usefixtures("formula")
@pytest.mark.parametrize("kept", [RESULT, PARTIAL])
def test_what_another_study_has_found_is_not_overwritten(tmp_path, kept):
    (tmp_path / "out").mkdir()
    found = tmp_path / "out" / kept
    found.write_text('{"schema": 1, "study": {"name": "lentils"}}')
    refused = calibrate(tmp_path, "--resume")
    assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
    assert "holds the study lentils, not sunflower_extract; name another folder" in refused.stderr
    assert [one.name for one in found.parent.iterdir()] == [kept]
    found.write_text('{"schema": 1, "study": {"name": "sunflower_extract"}}')
    assert calibrate(tmp_path, "--resume").exit_code == 0


@pytest.mark.usefixtures("formula")
def test_a_folder_with_nothing_but_its_own_study_file_is_new(tmp_path):
    own = tmp_path / "out" / "changed.toml"
    own.parent.mkdir()
    own.write_text(asset_path("studies", "sunflower_extract").read_text())
    assert calibrate(tmp_path).exit_code == 2
    done = calibrate(tmp_path, "--study", str(own), "--tries", "6")
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "out" / "result.json").read_text())["study"]["file"] == str(own)
    assert Formula.tries == 6


@pytest.mark.usefixtures("formula")
def test_an_error_above_the_limit_is_exit_code_3_with_the_files_there(tmp_path):
    done = calibrate(tmp_path, "--fail-above", "0")
    assert done.exit_code == 3
    assert "above the limit" in done.stderr
    assert (tmp_path / "out" / "result.json").is_file()


def test_a_study_that_cannot_be_analysed_ends_in_one_line(tmp_path, monkeypatch):
    class NoSurface(Formula):
        def _once(self, stage, row, setting, replicate, attempt):
            run = super()._once(stage, row, setting, replicate, attempt)
            return dataclasses.replace(run, outcome="jammed") if stage == "surface" else run

    monkeypatch.setattr(study_run, "PourRunner", NoSurface)
    stopped = calibrate(tmp_path)
    assert stopped.exit_code == 1
    assert stopped.stderr.startswith("error: stopped in the surface stage: ")
    assert stopped.stderr.count("\n") == 1
    assert "--resume" in stopped.stderr
    assert not (tmp_path / "out" / "result.json").exists()


@pytest.mark.usefixtures("formula")
def test_a_folder_goes_on_with_the_profile_it_was_begun_with(tmp_path):
    assert calibrate(tmp_path).exit_code == 0
    before = (tmp_path / "out" / "result.json").read_bytes()
    refused = calibrate(tmp_path, "--profile", "standard", "--resume")
    assert refused.exit_code == 2
    assert refused.stderr == (
        f"error: --out {tmp_path / 'out'}: holds the profile quick of sunflower_extract, not standard; name another "
        "folder, or continue with --profile quick\n"
    )
    assert (tmp_path / "out" / "result.json").read_bytes() == before


def test_a_target_out_of_reach_stops_a_study_unless_it_is_told_to_go_on(tmp_path, monkeypatch):
    class Flat(Formula):
        def _once(self, stage, row, setting, replicate, attempt):
            run = super()._once(stage, row, setting, replicate, attempt)
            seen = dict.fromkeys(run.observables, 3.0 + 0.1 * (run.seed % 5))
            return dataclasses.replace(run, observables=seen)

    monkeypatch.setattr(study_run, "PourRunner", Flat)
    # The shipped quick profile asks for no corners: its coarse shapes are known to come nowhere near the target.
    stopped = calibrate(tmp_path, "--profile", "standard")
    assert stopped.exit_code == 1
    assert stopped.stderr.startswith("error: stopped in the reach stage: out of reach: 3.")
    assert stopped.stderr.count("\n") == 1
    assert "--beyond-reach" in stopped.stderr
    done = calibrate(tmp_path, "--profile", "standard", "--resume", "--beyond-reach")
    assert done.exit_code == 0, done.output
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert result["reach"] is None
    assert result["study"]["profile"]["reach_runs"] == 0


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--profile", "huge"), "sunflower_extract.toml: profile: 'huge' is not one of quick, standard, full\n"),
        (("--study", "nowhere.toml"), "sunflower_extract"),
        (("--fail-above", "-1"), "fail-above"),
        (
            ("--scheduler", "tcp://127.0.0.1:9", "--record", "pours"),
            "--record pours: a folder records only pours on this",
        ),
        (("--summary", "no/such/summary.md"), "--summary no/such/summary.md: there is no folder "),
        (("--junit", "/"), "--junit /: is a folder; name a file"),
    ],
)
def test_bad_orders_are_one_line_and_leave_nothing(tmp_path, options, says):
    refused = calibrate(tmp_path, *options)
    assert refused.exit_code == 2
    assert says in refused.stderr
    assert not (tmp_path / "out").exists()


def test_a_stage_that_refuses_its_table_leaves_no_folder(tmp_path, monkeypatch):
    def refuse(study, profile):
        raise StudyFileError("stage.repeatability: {'runs': 1}; allowed: runs, a whole number of at least 2")

    monkeypatch.setattr(study_run, "planned_runs", refuse)
    found = calibrate(tmp_path)
    assert found.exit_code == 2
    assert "allowed: runs" in found.output
    assert not (tmp_path / "out").exists()


def test_where_no_scheduler_answers_the_folder_is_left_for_the_next_try(tmp_path, monkeypatch):
    monkeypatch.setattr("solver.pours.dask_pool.CONNECTED", 0.2)
    refused = calibrate(tmp_path, "--scheduler", "tcp://127.0.0.1:9")
    assert refused.exit_code == 2
    assert refused.stderr.startswith("error: --scheduler tcp://127.0.0.1:9: no Dask scheduler answers there")
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.usefixtures("formula")
def test_a_study_with_its_own_profiles_is_asked_for_by_their_names(tmp_path):
    file = study_with_own_profiles(tmp_path)
    options = ("--study", str(file), "--store", str(tmp_path / "runs.sqlite"), "--out", str(tmp_path / "out"))
    refused = explorer("calibrate", "--headless", *options)
    assert refused.exit_code == 2
    assert refused.stderr == f"error: {file}: profile: 'standard' is not one of first look, thesis-2, fine\n"
    assert explorer("calibrate", "--headless", "--profile", "first look", *options).exit_code == 0
    assert json.loads((tmp_path / "out" / "result.json").read_text())["study"]["profile"]["name"] == "first look"


@pytest.mark.usefixtures("formula")
def test_against_a_baseline_what_moved_is_named_in_every_file_and_by_exit_code_4(tmp_path, monkeypatch):
    """Three files for CI: the result to compare with, a summary, JUnit XML; then pours scatter 8 times as much."""
    assert calibrate(tmp_path).exit_code == 0
    (tmp_path / "out").rename(tmp_path / "accepted")
    options = ("--baseline", str(tmp_path / "accepted/result.json"))
    options += ("--summary", str(tmp_path / "summary.md"), "--junit", str(tmp_path / "junit.xml"))
    same = calibrate(tmp_path, *options)
    assert same.exit_code == 0, same.output
    assert "Against the baseline: nothing has moved" in (tmp_path / "summary.md").read_text()
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert suite.get("failures") == "0"
    assert int(suite.get("tests")) == len(suite) > 4

    monkeypatch.setattr(study_run, "PourRunner", Noisier)
    other = calibrate(tmp_path, "--resume", *options)
    assert other.exit_code == 4
    lines = [line for line in other.stderr.splitlines() if line.startswith("moved: ")]
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert len(lines) == int(suite.get("failures")) == len(suite.findall("testcase/failure")) > 0
    assert f"{len(lines)} of {len(suite)} have moved" in (tmp_path / "summary.md").read_text()


class Noisier(Formula):
    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.sigma *= 8.0


@pytest.mark.parametrize(("content", "says"), [("{}", "no result.json of a finished study"), ("no", "no result.json")])
def test_a_baseline_that_is_none_is_told_before_any_pour(tmp_path, content, says):
    (tmp_path / "old.json").write_text(content)
    refused = calibrate(tmp_path, "--baseline", str(tmp_path / "old.json"))
    assert refused.exit_code == 2
    assert refused.stderr.startswith(f"error: --baseline {tmp_path / 'old.json'}: {says}")
    assert refused.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_without_headless_it_says_where_to_go(tmp_path):
    refused = explorer("calibrate", "--out", str(tmp_path / "out"))
    assert refused.exit_code == 2
    assert "--headless" in refused.stderr


def test_piles_of_reference_and_optimum_are_read_off_the_store(monkeypatch):
    """Small spheres on a cone of 30° and 50 mm height: its silhouette from any side is h (1 − |u|/r)."""
    height, radius, small = 0.05, 0.05 / np.tan(np.radians(30.0)), 4e-4
    rings = np.linspace(0.0, radius, 220)
    places = [
        (r * np.cos(a), r * np.sin(a), height * (1.0 - r / radius))
        for r in rings
        for a in np.linspace(0.0, 2.0 * np.pi, 1 + int(r / radius * 900), endpoint=False)
    ]
    spheres = Spheres(np.array(places), np.full(len(places), small), np.arange(len(places)))
    record = SimpleNamespace(pile=SimpleNamespace(spheres=spheres))

    def read(raw):
        return record if raw == b"kept" else unpacked(raw)

    monkeypatch.setattr(study_run, "unpacked", read)
    raws = {"a": b"kept", "b": b"kept", "damaged": b"no archive"}
    kept = SimpleNamespace(find=lambda key: SimpleNamespace(raw=raws[key]) if key in raws else None)
    run = reported_studies.typed(reported_studies.result_of_case("planted")).verification.runs[0]
    runs = [
        dataclasses.replace(run, label="reference", outcome="at_rest", key=key) for key in ("a", "b", "lost", "damaged")
    ]
    jammed = dataclasses.replace(run, label="reference", outcome="jammed", key="jammed")
    elsewhere = dataclasses.replace(runs[0], experiment="drum")
    rows = {"pilot": ((*runs, jammed, elsewhere),)}
    monkeypatch.setattr(Stages, "runs_of", lambda self, stage: rows.get(stage, ()))
    (pile,) = study_run.poured_piles(Stages(), kept)
    assert (pile.name, pile.pours) == ("reference", 2)
    u = np.array(pile.u)
    inside = np.abs(u) < 0.9 * radius
    assert np.array(pile.mean)[inside] == pytest.approx(height * (1.0 - np.abs(u[inside]) / radius), abs=1.5e-3)
    assert np.allclose(pile.sd, 0.0)


@pytest.mark.usefixtures("formula")
def test_a_study_against_a_photograph_keeps_it_and_says_what_its_spread_is(tmp_path):
    target = tmp_path / "target"
    assert explorer("measure", "cone_25_30", "--reference-length", 100, "--target", target).exit_code == 0
    done = calibrate(tmp_path, "--target", str(target))
    assert done.exit_code == 0, done.output
    assert "read off cone_25_30.jpg" in done.stdout
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    (first, *_) = result["study"]["targets"]
    # A solid of 25° and 30°.
    assert (first["mean"], first["n"]) == (pytest.approx(27.5, abs=0.1), None)
    test = result["verification"]["tests"][0]
    assert (test["target"]["mean"], test["welch"]) == (first["mean"], None)
    report = (tmp_path / "out" / "report.md").read_text()
    assert "is of reading one photograph, not measured; the tests take its mean as exact." in report
    assert load_target(tmp_path / "out" / FOLDER).result == load_target(target).result
    # What it was started with holds when it goes on, whether or not it is named again.
    remove_target(target)
    assert calibrate(tmp_path).exit_code == 2
    assert calibrate(tmp_path, "--resume").exit_code == 0
    again = json.loads((tmp_path / "out" / "result.json").read_text())
    assert again["study"]["targets"] == result["study"]["targets"]
