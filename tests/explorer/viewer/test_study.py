"""The panel of a study: what it asks for, what it tells, and its charts."""

import json
import math
from dataclasses import replace
from unittest import mock

import plotly.io
import pytest

from doe.stages import planned_runs
from doe.studies.exclusion import ExcludedRun
from doe.studies.study import load_study
from doe.studies.study_result import study_from
from explorer.background.command_process import HERE, CommandStatus, PourPlace
from explorer.background.events import StageProgress, TriedRun
from explorer.errors import CommandError
from explorer.report.sections.answer import banner as study_banner
from explorer.report.study_charts import Plot
from explorer.study.edit import StudyEdits
from explorer.study.excluded_runs import load_excluded
from explorer.study.process import QueuedStudy
from explorer.viewer.actions import Actions
from explorer.viewer.study.order_panel import number_on_screen
from explorer.viewer.study.plot_view import NOTHING, Drawn, PlotView
from explorer.viewer.study.process_view import (
    CANCEL,
    CLEAR,
    CONTINUE,
    PAUSE,
    QUEUE,
    RESUME,
    RETRY,
    START,
    state_markdown,
)
from explorer.viewer.study.study_panel import NONE
from explorer.viewer.view import ThemeSwitch
from solver import asset_path
from solver.scenes.scene import value
from tests.explorer.viewer.person import Person
from tests.explorer.viewer.study_panel_at_hand import (
    OWN_PROFILES,
    FakeStudy,
    PanelAtHand,
    drawn,
    study_with_own_profiles,
    written,
)

EVIL = "<img src=x> *bold* | `code`"


def test_the_buttons_ask_for_what_they_say(table):
    for button in (START, PAUSE, CANCEL, RESUME, RETRY, QUEUE, CLEAR, CONTINUE, "Delete everything"):
        assert table.press(button) == ""
    asked = [one if isinstance(one, str) else one[:2] for one in table.study.asked]
    assert asked == [
        *(("start", "quick"), "pause", "cancel", "resume", "retry", ("queue", "quick"), "clear_queue", "go_on"),
    ]
    assert not table.study.asked[0][2]


@pytest.mark.parametrize(
    ("state", "waiting", "offered"),
    [
        ("idle", (), (START, RESUME)),
        ("running", (), (PAUSE, CANCEL, QUEUE)),
        ("paused", ("full",), (CONTINUE, CANCEL, QUEUE, CLEAR)),
        ("failed", (), (START, RESUME, RETRY)),
    ],
)
def test_only_buttons_that_mean_something_now_are_there(table, state, waiting, offered):
    table.study.now, table.study.queued = CommandStatus(state), waiting
    table.show()
    assert table.person.options("Study") == offered
    assert bool(table.person.progress) == (state in ("running", "paused"))


def test_what_was_not_stopped_is_not_offered_to_be_resumed(table):
    table.study.resumable = lambda: False
    table.show()
    assert table.person.options("Study") == (START,)
    # Looked up once per state: it reads folders.
    table.study.resumable = lambda: True
    table.show()
    assert table.person.options("Study") == (START,)
    table.study.now = CommandStatus("cancelled")
    table.show()
    assert table.person.options("Study") == (START, RESUME)


def test_the_profiles_of_the_study_file_are_offered_and_started(server, tmp_path, monkeypatch):
    monkeypatch.setattr(FakeStudy, "study_file", study_with_own_profiles(tmp_path))
    table = PanelAtHand(server)
    chosen = table.person.control("Profile")
    assert chosen.options == OWN_PROFILES
    study = load_study(str(table.study.study_file))
    runs = sum(planned_runs(study, study.profiles["first look"]).values())
    assert chosen.hint.startswith(f"first look: coarse shapes, {runs} runs; thesis-2: standard shapes, ")
    assert "fine: standard shapes, as many runs as the pilot asks for" in chosen.hint
    table.press("Start")
    table.person.enter("Profile", "thesis-2")
    table.press("Queue")
    assert [one[:2] for one in table.study.asked] == [("start", "first look"), ("queue", "thesis-2")]


def test_a_browser_chooses_between_the_scheduler_of_the_server_and_this_machine(server, monkeypatch):
    """And names none itself: what another scheduler sends would be run here."""
    monkeypatch.setattr("explorer.viewer.actions.HANDS_OFF", 0.0)
    place, at = PourPlace("tcp://127.0.0.1:9"), "tcp://127.0.0.1:9"
    table = PanelAtHand(server, place)
    person = table.person
    assert (person.options("Pour on"), person.value("Pour on")) == ((at, HERE), at)
    for sent in ("tcp://evil:1", ["a"], None):
        assert "is not one of tcp://127.0.0.1:9, this machine" in person.send("Pour on", sent)
        table.show()
        assert person.value("Pour on") == place.chosen == at
    assert person.enter("Pour on", HERE) == ""
    assert (place.chosen, place.arguments) == (HERE, ())
    assert not PanelAtHand(server).person.sees("Pour on")


def test_an_empty_page_says_what_to_do(server, tmp_path, monkeypatch):
    sent = []  # also a chart that is hidden brings plotly.js to every browser
    monkeypatch.setattr(server.gui, "add_plotly", lambda *_, **__: sent.append("plotly.js") or mock.Mock())
    table = PanelAtHand(server, data=tmp_path / "data")
    board = table.board()
    assert (board["title"], board["charts"]) == ("", [])
    assert "No study is running" in table.person.text
    assert table.profiler.options("Chart") == (NOTHING,)
    assert table.profiler.charts == sent == []
    assert "comes with the response surface" in table.profiler.text
    table.profiler.press("Set the live pour to these values")
    assert table.session.asked == []


def test_the_study_at_work_is_named_with_its_own_target(table):
    """It may be another one than the page's: the corrected model of a diagnosis."""
    study = load_study(str(FakeStudy.study_file))
    other = replace(
        study, scene=replace(study.scene, title="Trefoil pour 2"), targets=(replace(study.targets[0], mean=17.9),)
    )
    table.study.present = QueuedStudy("corrected_study", "quick", StudyEdits(), "", None, other)
    table.study.now = CommandStatus("running")
    table.show()
    assert "**At work:** Trefoil pour 2, profile quick." in table.person.text
    assert "17.90°" in table.person.text
    assert "24.68°" not in table.person.text
    # What it will take stands there until the first pours tell.
    assert "runs of coarse shapes" in table.person.text
    table.study.now = CommandStatus("cancelled")
    table.show()
    assert "24.68°" in table.person.text


def test_stages_failed_runs_and_the_queue_are_told(table):
    jam = TriedRun("screening", "row 3", 0, 0, 7, "jammed", EVIL, False)
    table.study.now = CommandStatus(
        "running",
        "screening",
        28,
        112,
        125.0,
        ("22.0 ± 3",),
        stages=(StageProgress("pilot", 20, 20, f"22 ± 3 {EVIL}"), StageProgress("screening", 8, 28)),
        tried=(jam, TriedRun("screening", "row 3", 0, 1, 9, "at_rest", "", True)),
    )
    table.study.queued = ("standard", "full, changed")
    table.show("no")
    text = table.person.html
    assert "28 of 112 runs, time left 2 min 05 s" in text
    assert [(one["name"], one["count"], one["mark"]) for one in table.board()["stages"]] == [
        ("pilot", "20 of 20", "done"),
        ("screening", "8 of 28", "▶"),
    ]
    assert "**1 without a valid result**" in text
    assert "| 7 | 9: at rest |" in text
    assert "Waiting: standard; full, changed." in text
    assert "<img" not in text.replace(r"\<", "")
    assert "*bold*" not in text.replace(r"\*bold\*", "")
    assert table.person.progress == [25.0]


def test_a_paused_command_and_one_that_found_no_replacement_say_so():
    lost = tuple(TriedRun("scan", "a", 0, k, k, "jammed", "", False) for k in range(9))
    text = state_markdown(CommandStatus("paused", tried=lost), "study", "runs")
    assert text.startswith("Paused")
    assert "**9 without a valid result**, the newest 6:" in text
    assert "| jammed | 8 | none |" in text


def test_a_finished_study_is_a_board_of_verdict_charts_answers_and_runs(table, result, tmp_path):
    folder = written(tmp_path / "study-1", result)
    (folder / "report.html").write_text("report", encoding="utf-8")
    table.study.out = folder
    board = table.board()
    assert board["banner"]["headline"] == study_banner(study_from(result)).headline
    titles = [chart["title"] for chart in board["charts"]]
    assert titles[0] == "Verification"  # the answer first
    assert {"Scan of an assumption", "Half-normal", "Contours"} <= set(titles)
    answers, runs = (next(one for one in board["tables"] if one["title"].startswith(name)) for name in ("Par", "Runs"))
    assert len(answers["rows"]) == len(result["surface"]["factors"])
    assert len(runs["rows"]) == len(runs["opens"]) == result["runs"]["total"]
    assert table.page.pages.page(board["report"]).body == b"report"
    (folder / "result.json").write_text(json.dumps(result | {"scan": None}))
    assert "Scan of an assumption" not in [chart["title"] for chart in table.board()["charts"]]


def test_a_row_of_the_board_pours_that_run_in_the_scene(table, result, tmp_path):
    table.study.out = written(tmp_path / "study-1", result)
    (runs,) = (one for one in table.board()["tables"] if one["title"].startswith("Runs"))
    asked = next(one for one in runs["opens"] if one["stage"] == "surface" and one["label"].startswith("point 4"))
    # The formula gives other keys than a pour would, and the page says so.
    table.page.channel.take(json.dumps(asked))
    assert "has changed since that run" in table.actions.carry_out()
    (poured,) = table.session.asked
    assert (poured[0], poured[2]) == ("start", asked["seed"])
    # The default, the command line and the bench twin are those of the study, whatever was poured before.
    assert poured[3].arguments == ("sunflower_extract",)
    for factor, natural in zip(result["surface"]["factors"], result["surface"]["natural"][3], strict=True):
        assert value(poured[1], factor["path"]) == pytest.approx(natural)
    table.page.channel.take(json.dumps(asked | {"seed": -1}))
    assert "not in the study that is shown" in table.actions.carry_out()


def test_dark_and_light(table, result, tmp_path):
    table.study.out = written(tmp_path / "study-1", result)
    table.show()
    dark = drawn(table.profiler)["layout"]["template"]["layout"]
    table.panel.set_dark(False)
    light = drawn(table.profiler)["layout"]["template"]["layout"]
    # plotly_dark writes light text, plotly_white dark text
    assert (dark["font"]["color"], light["font"]["color"]) == ("#f2f5fa", "#2a3f5f")
    assert set(light) == set(plotly.io.templates["plotly_white"].to_plotly_json()["layout"])


def test_the_switch_of_the_page_turns_viser_and_the_charts(server, monkeypatch):
    themes, told, actions = [], [], Actions()
    monkeypatch.setattr(server.gui, "configure_theme", lambda **theme: themes.append(theme["dark_mode"]))
    with server.gui.add_folder("theme") as place:
        ThemeSwitch(server, actions.post, told.append)
    person = Person(place, actions.carry_out)
    (label,) = person.labels
    for dark in (False, True):
        assert person.enter(label, dark) == ""
    assert themes == told == [False, True]


def test_zoom_belongs_to_one_chart():
    spec = {"data": [], "layout": {"height": 400, "xaxis": {"title": "t"}, "xaxis2": {}, "scene": {}}}
    layout = json.loads(Drawn(spec, True, "this one").to_json())["layout"]
    assert [layout[key]["uirevision"] for key in ("xaxis", "xaxis2", "scene")] == ["this one"] * 3
    assert "height" not in layout
    assert spec["layout"]["xaxis"] == {"title": "t"}


def test_what_a_browser_sends_for_the_list_may_be_anything(server):
    actions, made = Actions(), []
    with server.gui.add_folder("plots") as place:
        view = PlotView(server, "Chart", "empty", actions.post)
    person = Person(place, actions.carry_out)
    view.offer({"a": Plot(lambda: made.append(1) or {"data": [], "layout": {}}, "caption")}, 1)
    assert person.text == "caption"
    for sent in ("no such title", ["a"], None, 3):
        assert person.send("Chart", sent) == ""
        assert person.text == "empty"
    view.offer({"bad": Plot(lambda: {}["gone"], "caption")}, 2)
    person.enter("Chart", "bad")
    assert "cannot be drawn" in person.text
    assert made == [1]


def test_a_study_that_runs_shows_what_it_has(table, result, tmp_path):
    partial = {key: result[key] for key in ("schema", "study", "pilot", "screening")} | {
        "partial": "screening",
        "line": "X7 *acts*",
    }
    table.study.out = written(tmp_path / "study-1", partial, "partial.json")
    table.study.now = CommandStatus("running", "screening", 40, 100, stages=(StageProgress("screening", 20, 84),))
    table.show()
    table.show()
    board = table.board()
    (stage,) = board["stages"]
    assert (stage["mark"], stage["found"]) == ("▶", "so far: X7 *acts*")
    titles = [chart["title"] for chart in board["charts"]]
    assert "Half-normal" in titles
    assert "Ascent path" not in titles
    assert board["banner"] is None
    # finished: the result counts, and a partial one that was left behind does not
    written(tmp_path / "study-1", result)
    table.study.now = CommandStatus("finished")
    assert "Ascent path" in [chart["title"] for chart in table.board()["charts"]]


def test_runs_are_left_out_of_the_study_that_is_shown(table, result, tmp_path):
    folder = written(tmp_path / "study-1", result)
    table.study.out, table.study.now = folder, CommandStatus("finished")
    table.show()
    # What the page of the table is handed: there is no control of the panel for it.
    in_hand = table.all_runs
    shown = in_hand.result()
    run = shown.surface.runs[0][0]
    excluded = [ExcludedRun.of(run, "wedged")]
    in_hand.take(shown, excluded)
    assert load_excluded(folder) == tuple(excluded)
    told = {one["title"]: one["rows"] for one in table.board()["tables"]}
    assert told["Runs left out"] == [[run.label, str(run.seed), "wedged"]]
    with pytest.raises(CommandError, match="another study is now shown"):
        in_hand.take(replace(shown), excluded)
    assert in_hand.excluded() == tuple(excluded)


X4, TARGET = "X4 · shear modulus seed [MPa]", "Target: mean [°]"


def factor_labels(ranges):
    return [label for label in ranges.labels if " · " in label]


def x7(ranges):
    return next(label for label in factor_labels(ranges) if label.startswith("X7 · "))


def started_with(table):
    """The changes that the study is started with."""
    table.press(START)
    return table.study.asked[-1][2]


def test_ranges_and_target_are_asked_for_as_entered(table):
    ranges = table.ranges
    assert not started_with(table)
    assert ranges.value(X4) == (40.1, 70.5, 56.3)
    assert ranges.enter(X4, (30.0, 70.5, 56.3)) == ""
    ranges.enter(TARGET, 26.0)
    assert ranges.sees("Target: SD [°]")
    edits = started_with(table)
    assert (dict(edits.factors), dict(edits.target)) == ({"X4": {"low": 30e6}}, {"mean": 26.0})
    assert "| X4 low | 40.1 MPa | 30 MPa |" in ranges.text
    # another factor beside it: both changes hold
    other = x7(ranges)
    ranges.enter(other, (0.5, *ranges.value(other)[1:]))
    assert set(started_with(table).factors) == {"X4", "X7"}
    ranges.enter(TARGET, 95.0)
    assert "**This study cannot start:** changed study: target.mean: 95 deg of" in ranges.text
    ranges.enter(X4, (90.0, 70.5, 56.3))
    assert "**This study cannot start:** " in ranges.text
    assert "is not below high" in ranges.text
    assert "X4 low" in ranges.send(X4, (math.nan, 70.5, 56.3))
    ranges.press("Reset to file")
    assert not started_with(table)
    assert ranges.value(X4) == (40.1, 70.5, 56.3)
    assert ranges.value(TARGET) == 24.68


def test_all_ranges_are_taken_from_a_table_or_none(table):
    in_hand = table.all_ranges
    rows = {row.name: row for row in in_hand.rows()}
    assert [label.split(" · ")[0] for label in factor_labels(table.ranges)] == list(rows)
    assert (rows["X4"].label, rows["X4"].unit, rows["X4"].range) == ("shear modulus seed", "MPa", (40.1, 70.5, 56.3))
    ranges = {name: row.range for name, row in rows.items()}
    in_hand.take(ranges)
    assert not started_with(table)
    with pytest.raises(ValueError, match="X7 low"):
        in_hand.take(ranges | {"X4": (30.0, 70.5, 56.3), "X7": (math.nan, 1.0, 1.0)})
    assert not started_with(table)
    in_hand.take(ranges | {"X4": (30.0, 70.5, 56.3)})
    assert dict(started_with(table).factors) == {"X4": {"low": 30e6}}
    assert table.ranges.value(X4) == (30.0, 70.5, 56.3)
    assert "| X4 low | 40.1 MPa | 30 MPa |" in table.ranges.text


def test_every_factor_has_a_row_and_what_is_shown_as_in_the_file_is_no_change(server, tmp_path, monkeypatch):
    # Numbers of more digits than a box shows.
    text = asset_path("studies", "sunflower_extract").read_text(encoding="utf-8")
    for short, long in (('low = "40.1MPa"', 'low = "40.1000123MPa"'), ("mean = 24.68 ", "mean = 24.6800123 ")):
        assert text.count(short) == 1
        text = text.replace(short, long)
    (tmp_path / "long.toml").write_text(text, encoding="utf-8")
    monkeypatch.setattr(FakeStudy, "study_file", tmp_path / "long.toml")
    table = PanelAtHand(server)
    ranges = table.ranges
    assert (ranges.value(X4)[0], ranges.value(TARGET)) == (40.1, 24.68)
    rows = factor_labels(ranges)
    assert len(rows) == len(load_study(str(table.study.study_file)).factors)
    for label in (*rows, TARGET):
        assert ranges.enter(label, ranges.value(label)) == "", label
    assert not started_with(table)
    assert number_on_screen(1 / 3) == 0.333333


def test_a_study_file_that_cannot_be_read_leaves_the_page_standing(server, tmp_path, monkeypatch):
    monkeypatch.setattr(FakeStudy, "study_file", tmp_path / "gone.toml")
    table = PanelAtHand(server)
    assert "cannot be read" in table.ranges.text
    assert table.person.options("Profile") == (NONE,)
    assert not started_with(table)
    table.show()
