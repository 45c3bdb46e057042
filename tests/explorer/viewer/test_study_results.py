"""What the page does with a result of a study: profiler, comparison, files that are none."""

import math
from pathlib import Path

import pytest
import viser

from explorer.units import unit_of_parameter
from explorer.viewer.output import pile_recording
from explorer.viewer.study.plot_view import NOTHING
from explorer.viewer.study.profiler_panel import TITLE as PROFILER
from explorer.viewer.study.study_panel import PRESENT, set_live
from solver.scenes.scene import value
from tests.explorer import reported_studies
from tests.explorer.background.waiting import wait_for
from tests.explorer.viewer.study_panel_at_hand import FakeSession, drawn, written


def sliders(profiler):
    """Labels of the profiler's sliders."""
    return [label for label in profiler.labels if isinstance(profiler.control(label), viser.GuiSliderHandle)]


def stands_at(profiler):
    """Where its sliders stand, in the units of the screen."""
    return [profiler.value(label) for label in sliders(profiler)]


def test_the_profiler_follows_its_sliders_and_sets_the_live_pour(table, result, tmp_path):
    table.study.out = written(tmp_path / "study-1", result)
    table.show()
    profiler = table.profiler
    found = result["optimum"]["single"]
    assert f"**{found['predicted']:.2f}°**, mean 95 % " in profiler.text
    paths = [factor["path"] for factor in result["surface"]["factors"]]
    optimum = [unit_of_parameter(path).of(result["optimum"]["values"][path]) for path in paths]
    assert stands_at(profiler) == pytest.approx(optimum, rel=1e-5)
    label = sliders(profiler)[0]
    # With a planted slope of 3 and 4 degrees per coded unit the ends differ by far more than a degree.
    said = []
    for end in (profiler.control(label).min, profiler.control(label).max):
        assert profiler.enter(label, end) == ""
        said.append(profiler.text)
        assert profiler.value("Chart") == PROFILER
        here = [trace for trace in drawn(profiler)["data"] if trace.get("name") == "here"]
        assert here[0]["x"] == [pytest.approx(end, rel=1e-5)]
        assert f"**{here[0]['y'][0]:.2f}°" in said[-1]
    assert said[0] != said[1]
    assert profiler.send(label, math.nan) == "X7: 'nan' is not a finite number"
    profiler.send(label, 1e9)  # beyond the region: its end is taken
    profiler.press("Set the live pour to these values")
    (asked,) = table.session.asked
    assert asked[0] == "set"
    assert list(asked[1]) == paths
    region = result["surface"]["region"]
    assert asked[1][paths[0]] == pytest.approx(region["centre"][0] + region["half_width"][0], rel=1e-5)
    profiler.press("To the optimum")
    assert stands_at(profiler) == pytest.approx(optimum, rel=1e-5)


def test_every_target_has_a_profiler(table, tmp_path):
    table.study.out = written(tmp_path / "study-1", reported_studies.result_of_case("two targets"))
    table.show()
    profiler = table.profiler
    titles = [title for title in profiler.options("Chart") if title.startswith(PROFILER)]
    assert len(titles) == 2
    label = sliders(profiler)[0]
    for title, unit in zip(titles, ("°", "kg/m³"), strict=True):
        profiler.enter("Chart", title)
        profiler.enter(label, profiler.control(label).min)
        before = drawn(profiler)
        profiler.enter(label, profiler.control(label).max)
        assert profiler.value("Chart") == title
        assert drawn(profiler)["data"] != before["data"]
        assert f"[{unit}]" in drawn(profiler)["layout"]["yaxis"]["title"]["text"]
        assert unit in profiler.text


def test_the_piles_of_the_study_that_is_shown_are_recorded(table, result, tmp_path, monkeypatch):
    ordered = []
    monkeypatch.setattr(pile_recording, "command_output", lambda command, *_: ordered.append(command))
    table.show()
    assert not table.person.sees("Recording")
    table.study.out = written(tmp_path / "study-1", result)
    table.show()
    # Pressed just before the study is gone from the page.
    table.early.press(pile_recording.RECORD)
    table.study.out = None
    table.show()
    assert "no finished study yet" in table.actions.carry_out()
    assert not table.person.sees("Recording")
    table.study.out = tmp_path / "study-1"
    table.show()
    table.person.press(pile_recording.RECORD)
    wait_for(lambda: ordered)
    file, profile = result["study"]["file"], result["study"]["profile"]["name"]
    order = ["calibrate", "--headless", "--study", file, "--profile", profile]
    assert ordered[0][:-1] == [*order, "--out", str(tmp_path / "study-1"), "--record"]


def test_values_that_act_on_restart_begin_the_pour_anew():
    session = FakeSession()
    set_live(session, {"rig.outlet_height": 0.07, "pair.seed.seed.static_friction": 0.5})
    (asked,) = session.asked
    assert asked[0] == "restart"
    assert value(asked[1], "rig.outlet_height") == 0.07
    with pytest.raises(ValueError, match=r"material.sand"):
        set_live(session, {"material.sand.shear_modulus": 1e7})


def test_a_result_from_elsewhere_is_added_and_compared(table, result, tmp_path):
    other = reported_studies.result_of_case("nothing acts")
    table.study.done = (written(tmp_path / "study-2", result),)
    away = written(tmp_path / "away-3", other)
    table.show()
    assert table.others.options("Result") == (PRESENT, "study-2")
    assert table.others.value("Result") == PRESENT
    comparison = table.person.within("Compare two studies")
    assert "Choose a second finished study" in comparison.text
    comparison.enter("From a folder", str(away))
    assert comparison.press("Add to the list") == ""
    assert "| | study-2 | away-3 |" in comparison.text
    for one in (result, other):
        assert f"{one['verification']['tests'][0]['simulated']['mean']:.2f}°" in comparison.text
    table.others.enter("From a folder", str(tmp_path / "nowhere"))
    assert "nowhere: holds no result.json" in table.others.press("Add to the list")
    table.others.enter("From a folder", " ")
    assert "name a folder" in table.others.press("Add to the list")


def test_compared_studies_have_the_names_of_the_lists_and_no_study_is_compared_with_itself(table, result, tmp_path):
    for folder in ("here", "away"):
        (tmp_path / folder).mkdir()
    table.study.done = tuple(written(tmp_path / folder / "study-2", result) for folder in ("here", "away"))
    table.show()
    comparison = table.person.within("Compare two studies")
    first, second = comparison.options("Compare with")[1:]
    table.others.enter("Result", first)
    comparison.enter("Compare with", second)
    assert f"| | {first} | {second} |" in comparison.text
    comparison.enter("Compare with", first)
    assert comparison.text == "This is the study above: choose another one."


def test_a_result_from_elsewhere_of_the_same_name_is_the_one_that_is_shown(table, result, tmp_path):
    (tmp_path / "away").mkdir()
    own, away = written(tmp_path / "study-2", result), written(tmp_path / "away" / "study-2", result)
    table.study.done = (own,)
    table.show()
    table.others.enter("From a folder", str(away))
    assert table.others.press("Add to the list") == ""
    assert table.others.options("Result") == (PRESENT, "away/study-2", f"{tmp_path.name}/study-2")
    assert table.others.value("Result") == "away/study-2"


@pytest.mark.parametrize("content", ["{}", '{"study": 3}', '{"study": {"targets": []}, "screening": {"runs": 3}}'])
def test_a_file_that_is_no_result_is_one_line(table, tmp_path, content):
    folder = tmp_path / "odd-1"
    folder.mkdir()
    (folder / "result.json").write_text(content)
    table.study.out = Path(folder)
    table.show()
    table.show()
    if content != "{}":
        assert "odd-1: cannot be shown" in table.person.text.replace("\\", "")
    for bad in ("[]", "{", ""):
        (folder / "result.json").write_text(bad)
        table.show()
        assert table.profiler.options("Chart") == (NOTHING,)
        table.others.enter("From a folder", str(folder))
        assert "cannot be read" in table.others.press("Add to the list")
