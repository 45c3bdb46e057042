"""The panel of a study: what it asks for, shows, draws and hands to the live pour."""

import json
import math
from pathlib import Path

import plotly.io
import pytest

from explorer.command_process import CommandStatus
from explorer.live.messages import SessionState, Status
from explorer.report.plot import Plot
from explorer.screen_units import InputError
from explorer.stage_progress import StageProgress, TriedRun
from explorer.viewer.actions import Actions
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.order_panel import number_on_screen
from explorer.viewer.plot_theme import Drawn
from explorer.viewer.plot_view import NOTHING, PlotView
from explorer.viewer.profiler_panel import TITLE as PROFILER
from explorer.viewer.stage_table import stages_markdown
from explorer.viewer.study_panel import PRESENT, StudyPanel, set_live
from explorer.viewer.theme import ThemeSwitch
from solver import asset_path, load_material
from solver.scene import value
from tests.explorer import reported_studies

SCENE = load_material("sunflower_extract")
EVIL = "<img src=x> *bold* | `code`"


class FakeStudy:
    """Keeps what it was asked; its status and its folders are what the test says."""

    study_file = asset_path("studies", "sunflower_extract")

    def __init__(self):
        self.asked, self.now, self.out, self.queued, self.done = [], CommandStatus("idle"), None, (), ()

    def start(self, profile, edits):
        self.asked.append(("start", profile, edits))

    def queue(self, profile, edits):
        self.asked.append(("queue", profile, edits))

    def __getattr__(self, name):
        if name not in ("cancel", "pause", "go_on", "resume", "retry", "clear_queue"):
            raise AttributeError(name)
        return lambda: self.asked.append(name)

    def waiting(self):
        return self.queued

    def status(self):
        return self.now

    def finished(self):
        return self.done


class FakeSession:
    def __init__(self):
        self.asked = []

    def status(self):
        return Status(SessionState.RUNNING, "", SCENE, seed=1, generation=1, speed=1.0)

    def set_parameters(self, values):
        self.asked.append(("set", values))

    def restart(self, scene, seed=None):
        self.asked.append(("restart", scene, seed))


@pytest.fixture(scope="module")
def server():
    server = guarded_server("127.0.0.1", 0, "test")
    yield server
    server.stop()


@pytest.fixture(scope="module")
def result():
    return reported_studies.result_of_case("planted")


class Table:
    """A panel with what it talks to; ``enter`` and ``press`` are a person at a browser."""

    def __init__(self, server):
        self.study, self.session, self.actions = FakeStudy(), FakeSession(), Actions()
        self.panel = StudyPanel(server, self.study, "sunflower_extract", self.actions.post, self.session)

    def enter(self, handle, value):
        handle.value = value
        self._call(handle, value)
        return self.actions.carry_out()

    def press(self, button):
        self._call(self.panel._view._buttons, button)
        return self.actions.carry_out()

    def _call(self, handle, value):
        event = type("Event", (), {"client_id": 0, "target": type("Handle", (), {"value": value})})
        for callback in handle._impl.update_cb:
            callback(event)


@pytest.fixture
def table(server):
    return Table(server)


def written(folder, content, name="result.json"):
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(json.dumps(content))
    return folder


def drawn(view):
    return json.loads(view._chart._plotly_json_str)


def test_the_buttons_ask_for_what_they_say(table):
    for button in ("Start", "Pause / go on", "Cancel", "Resume", "Retry", "Queue", "Clear queue", "Delete everything"):
        assert table.press(button) in ("", None)
    table.study.now = CommandStatus("paused")
    table.press("Pause / go on")
    asked = [one if isinstance(one, str) else one[:2] for one in table.study.asked]
    assert asked == [
        *(("start", "quick"), "pause", "cancel", "resume", "retry", ("queue", "quick"), "clear_queue", "go_on"),
    ]
    assert not table.study.asked[0][2]


def test_an_empty_page_says_what_to_do(table):
    table.panel.show("")
    assert "Press *Start*" in table.panel._plots._caption.content
    assert table.panel._plots._choice.options == (NOTHING,)
    assert table.panel._plots._chart is None  # plotly.js is not sent for nothing
    assert "comes with the response surface" in table.panel._profiler._words.content
    table.panel._profiler._hand_on()
    assert table.session.asked == []


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
    table.panel.show("no")
    text = table.panel._view._text.content
    assert "28 of 112 runs, time left 2 min 05 s" in text
    assert "| pilot | 20 of 20 | done | 22 ± 3" in text
    assert "| screening | 8 of 28 | ▶ |" in text
    assert "**1 without a valid result**" in text
    assert "| 7 | 9: at rest |" in text
    assert "Waiting: standard; full, changed." in text
    assert "<img" not in text.replace(r"\<", "")
    assert "*bold*" not in text.replace(r"\*bold\*", "")
    assert table.panel._view._bar.value == 25.0


def test_a_paused_command_and_one_that_found_no_replacement_say_so():
    lost = tuple(TriedRun("scan", "a", 0, k, k, "jammed", "", False) for k in range(9))
    text = stages_markdown(CommandStatus("paused", tried=lost), "study", "Runs")
    assert text.startswith("Paused")
    assert "**9 without a valid result**, the newest 6:" in text
    assert "| jammed | 8 | none |" in text


def test_a_finished_study_is_drawn_and_stays_while_nothing_changes(table, result, tmp_path):
    table.study.out = written(tmp_path / "study-1", result)
    table.panel.show("")
    plots = table.panel._plots
    assert plots._choice.options[-1] == PROFILER
    assert drawn(plots)["layout"]["xaxis"]["title"]["text"] == "noise σ of one pour [°]"
    table.enter(plots._choice, "Ascent path")
    first = drawn(plots)
    assert first["layout"]["xaxis"]["title"]["text"] == "step"
    assert plots._caption.content.startswith("Band: the target")
    before = plots._chart.figure
    table.panel.show("")
    assert plots._chart.figure is before
    (tmp_path / "study-1" / "result.json").write_text(json.dumps(result | {"ascent": None}))
    table.panel.show("")
    assert "Ascent path" not in plots._choice.options
    assert drawn(plots) != first


def test_dark_and_light(table, result, tmp_path):
    table.study.out = written(tmp_path / "study-1", result)
    table.panel.show("")
    dark = drawn(table.panel._plots)["layout"]["template"]["layout"]
    table.panel.dark = False
    light = drawn(table.panel._plots)["layout"]["template"]["layout"]
    # plotly_dark writes light text, plotly_white dark text
    assert (dark["font"]["color"], light["font"]["color"]) == ("#f2f5fa", "#2a3f5f")
    assert table.panel.dark is False
    assert set(light) == set(plotly.io.templates["plotly_white"].to_plotly_json()["layout"])


def test_the_switch_of_the_page_turns_viser_and_the_charts(server, monkeypatch):
    themes, told, actions = [], [], Actions()
    monkeypatch.setattr(server.gui, "configure_theme", lambda **theme: themes.append(theme["dark_mode"]))
    switch = ThemeSwitch(server, actions.post, told.append)
    for sent in (False, True):
        switch._dark.value = sent
        for callback in switch._dark._impl.update_cb:
            callback(type("Event", (), {"client_id": 0}))
        assert actions.carry_out() == ""
    assert themes == told == [False, True]


def test_zoom_belongs_to_one_chart():
    spec = {"data": [], "layout": {"height": 400, "xaxis": {"title": "t"}, "xaxis2": {}, "scene": {}}}
    layout = json.loads(Drawn(spec, True, "this one").to_json())["layout"]
    assert [layout[key]["uirevision"] for key in ("xaxis", "xaxis2", "scene")] == ["this one"] * 3
    assert "height" not in layout
    assert spec["layout"]["xaxis"] == {"title": "t"}


def test_what_a_browser_sends_for_the_list_may_be_anything(server):
    actions, made = Actions(), []
    view = PlotView(server, "Chart", "empty", actions.post)
    view.offer({"a": Plot(lambda: made.append(1) or {"data": [], "layout": {}}, "caption")}, 1)
    for sent in ("no such title", ["a"], None, 3):
        view._choice.value = sent
        view._draw()
        assert view._caption.content == "empty"
    view.offer({"bad": Plot(lambda: {}["gone"], "caption")}, 2)
    view._choice.value = "bad"
    view._draw()
    assert "cannot be drawn" in view._caption.content
    assert made == [1]


def test_a_study_that_runs_shows_what_it_has(table, result, tmp_path):
    partial = {key: result[key] for key in ("study", "pilot", "screening")} | {
        "partial": "screening",
        "line": "X7 *acts*",
    }
    table.study.out = written(tmp_path / "study-1", partial, "partial.json")
    table.study.now = CommandStatus("running", "screening", 40, 100, stages=(StageProgress("screening", 20, 84),))
    table.panel.show("")
    table.panel.show("")
    assert r"| screening | 20 of 84 | ▶ | so far: X7 \*acts\* |" in table.panel._view._text.content
    assert "Half-normal" in table.panel._plots._choice.options
    assert "Ascent path" not in table.panel._plots._choice.options
    assert table.panel._runs._stage.options == ("pilot", "screening")
    # finished: the result counts, and a partial one that was left behind does not
    written(tmp_path / "study-1", result)
    table.study.now = CommandStatus("finished")
    table.panel.show("")
    assert "Ascent path" in table.panel._plots._choice.options


def test_the_profiler_follows_its_sliders_and_sets_the_live_pour(table, result, tmp_path):
    table.study.out = written(tmp_path / "study-1", result)
    table.panel.show("")
    profiler, plots = table.panel._profiler, table.panel._plots
    found = result["optimum"]["single"]
    assert f"**{found['predicted']:.2f}° ± " in profiler._words.content
    paths = [factor["path"] for factor in result["surface"]["factors"]]
    assert profiler.values() == pytest.approx([result["optimum"]["values"][path] for path in paths], rel=1e-5)
    slider = profiler._sliders[0]
    # With a planted slope of 3 and 4 degrees per coded unit the ends differ by far more than a degree.
    said = []
    for end in (slider.min, slider.max):
        assert table.enter(slider, end) == ""
        said.append(profiler._words.content)
        assert plots._choice.value == PROFILER
        here = [trace for trace in drawn(plots)["data"] if trace.get("name") == "here"]
        assert here[0]["x"] == [pytest.approx(end, rel=1e-5)]
        assert f"**{here[0]['y'][0]:.2f}°" in said[-1]
    assert said[0] != said[1]
    assert table.enter(slider, math.nan) == "X7: 'nan' is not a finite number"
    table.enter(slider, 1e9)  # beyond the region: its end is taken
    profiler._hand_on()
    (asked,) = table.session.asked
    assert asked[0] == "set"
    assert list(asked[1]) == paths
    region = result["surface"]["region"]
    assert asked[1][paths[0]] == pytest.approx(region["centre"][0] + region["half_width"][0], rel=1e-5)
    profiler._to_optimum()
    assert profiler.values() == pytest.approx([result["optimum"]["values"][path] for path in paths], rel=1e-5)


def test_every_target_has_a_profiler(table, tmp_path):
    table.study.out = written(tmp_path / "study-1", reported_studies.result_of_case("two targets"))
    table.panel.show("")
    profiler, plots = table.panel._profiler, table.panel._plots
    titles = [title for title in plots._choice.options if title.startswith(PROFILER)]
    assert len(titles) == 2
    slider = profiler._sliders[0]
    for title, unit in zip(titles, ("°", "kg/m³"), strict=True):
        table.enter(plots._choice, title)
        table.enter(slider, slider.min)
        before = drawn(plots)
        table.enter(slider, slider.max)
        assert plots._choice.value == title
        assert drawn(plots)["data"] != before["data"]
        assert f"[{unit}]" in drawn(plots)["layout"]["yaxis"]["title"]["text"]
        assert unit in profiler._words.content
    table.enter(plots._choice, "Half-normal")
    table.enter(slider, slider.min)
    assert plots._choice.value == titles[0]


def test_values_that_act_on_restart_begin_the_pour_anew():
    session = FakeSession()
    set_live(session, {"rig.outlet_height": 0.07, "pair.seed.seed.static_friction": 0.5})
    (asked,) = session.asked
    assert asked[0] == "restart"
    assert value(asked[1], "rig.outlet_height") == 0.07
    with pytest.raises(ValueError, match=r"material.sand"):
        set_live(session, {"material.sand.shear_modulus": 1e7})


def test_any_run_is_poured_again(table, result, tmp_path):
    table.study.out = written(tmp_path / "study-1", result)
    table.panel.show("")
    runs = table.panel._runs
    table.enter(runs._stage, "surface")
    chosen = runs._run.options[3]
    assert chosen.startswith("point ")
    table.enter(runs._run, chosen)
    assert "Set: " in runs._words.content
    runs._pour()
    (asked,) = table.session.asked
    stored = runs._runs[chosen]
    assert asked[2] == stored.seed
    k = int(stored.label.split()[1]) - 1
    for factor, natural in zip(result["surface"]["factors"], result["surface"]["natural"][k], strict=True):
        assert value(asked[1], factor["path"]) == pytest.approx(natural)
    # The formula gives other keys than a pour would, and the page says so.
    assert "have changed since that run" in runs._words.content
    table.enter(runs._run, "no such run")
    with pytest.raises(ValueError, match="no run is chosen"):
        runs._pour()


def test_ranges_and_target_are_asked_for_as_entered(table):
    order = table.panel._order
    assert not order.edits
    table.enter(order._choice, next(text for text in order._factors if text.startswith("X4 ")))
    assert order._inputs["low"].label == "Low [MPa]"
    assert [order._inputs[key].value for key in ("low", "high", "reference")] == [40.1, 70.5, 56.3]
    table.enter(order._inputs["low"], 30.0)
    table.enter(order._goal["mean"], 26.0)
    assert dict(order.edits.factors) == {"X4": {"low": 30e6}}
    assert dict(order.edits.target) == {"mean": 26.0}
    assert "| X4 low | 40.1 MPa | 30 MPa |" in order._told.content
    table.press("Start")
    assert table.study.asked[0][2] == order.edits
    # another factor and back: the change is still there
    table.enter(order._choice, next(text for text in order._factors if text.startswith("X7 ")))
    assert order._inputs["low"].label == "Low"
    assert order._inputs["low"].value == 0.47
    table.enter(order._choice, next(text for text in order._factors if text.startswith("X4 ")))
    assert order._inputs["low"].value == 30.0
    table.enter(order._inputs["low"], 90.0)
    assert "**This study cannot start:** " in order._told.content
    assert "is not below high" in order._told.content
    order._inputs["low"].value = math.nan
    with pytest.raises(InputError, match="X4 low"):
        order._take()
    order._forget()
    assert not order.edits
    assert order._inputs["low"].value == 40.1
    assert order._goal["mean"].value == 24.68


def test_what_is_shown_as_in_the_file_is_no_change(table):
    order = table.panel._order
    for text in order._factors:
        table.enter(order._choice, text)
        order._take()
    assert not order.edits
    assert number_on_screen(1 / 3) == 0.333333


def test_a_study_file_that_cannot_be_read_leaves_the_page_standing(server, tmp_path):
    table = FakeStudy()
    table.study_file = tmp_path / "gone.toml"
    panel = StudyPanel(server, table, "gone", Actions().post, FakeSession())
    assert "cannot be read" in panel._order._told.content
    assert not panel._order.edits
    panel.show("")


def test_a_result_from_elsewhere_is_added_and_compared(table, result, tmp_path):
    other = reported_studies.result_of_case("nothing acts")
    table.study.done = (written(tmp_path / "study-2", result),)
    away = written(tmp_path / "away-3", other)
    panel = table.panel
    panel.show("")
    assert panel._chooser._list.options == (PRESENT, "study-2")
    assert panel._chooser.folder is None
    comparison = panel._comparison
    assert "Choose a second finished study" in comparison._words.content
    comparison._chooser._text.value = str(away)
    comparison._chooser._add()
    comparison._draw()
    text = comparison._words.content
    assert "|  | study-2 | away-3 |" in text
    for one in (result, other):
        assert f"{one['verification']['tests'][0]['simulated']['mean']:.2f}°" in text
    panel._chooser._text.value = str(tmp_path / "nowhere")
    with pytest.raises(ValueError, match=r"nowhere: holds no result\.json"):
        panel._chooser._add()
    panel._chooser._text.value = " "
    with pytest.raises(ValueError, match="name a folder"):
        panel._chooser._add()


@pytest.mark.parametrize("content", ["{}", '{"study": 3}', '{"study": {"targets": []}, "screening": {"runs": 3}}'])
def test_a_file_that_is_no_result_is_one_line(table, tmp_path, content):
    folder = tmp_path / "odd-1"
    folder.mkdir()
    (folder / "result.json").write_text(content)
    table.study.out = Path(folder)
    table.panel.show("")
    table.panel.show("")
    if content != "{}":
        assert "odd-1: cannot be shown" in table.panel._view._text.content.replace("\\", "")
    for bad in ("[]", "{", ""):
        (folder / "result.json").write_text(bad)
        table.panel.show("")
        assert table.panel._plots._choice.options == (NOTHING,)
        table.panel._chooser._text.value = str(folder)
        with pytest.raises(ValueError, match="cannot be read"):
            table.panel._chooser._add()
