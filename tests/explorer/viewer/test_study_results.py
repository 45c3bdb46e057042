"""What the page does with a result of a study: profiler, comparison, files that are none."""

import math
from pathlib import Path

import pytest

from explorer.viewer.panel import Now
from explorer.viewer.study.plot_view import NOTHING
from explorer.viewer.study.profiler_panel import TITLE as PROFILER
from explorer.viewer.study.study_panel import PRESENT, set_live
from solver.scenes.scene import value
from tests.explorer import reported_studies
from tests.explorer.viewer.study_panel_at_hand import FakeSession, drawn, written


def test_the_profiler_follows_its_sliders_and_sets_the_live_pour(table, result, tmp_path):
    table.study.out = written(tmp_path / "study-1", result)
    table.show()
    profiler, plots = table.panel._profiler, table.panel._plots
    found = result["optimum"]["single"]
    assert f"**{found['predicted']:.2f}°**, mean 95 % " in profiler._words.content
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
    table.show()
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


def test_the_piles_of_the_study_that_is_shown_are_recorded(table, result, tmp_path):
    table.show()
    with pytest.raises(ValueError, match="no finished study yet"):
        table.panel._record_order()
    table.study.out = written(tmp_path / "study-1", result)
    table.show()
    file, profile = result["study"]["file"], result["study"]["profile"]["name"]
    order = ["calibrate", "--headless", "--study", file, "--profile", profile]
    assert table.panel._record_order() == (tmp_path / "study-1", order)


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
    panel = table.panel
    panel.show(Now(FakeSession().status()))
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
    table.show()
    table.show()
    if content != "{}":
        assert "odd-1: cannot be shown" in table.panel._view._text.content.replace("\\", "")
    for bad in ("[]", "{", ""):
        (folder / "result.json").write_text(bad)
        table.show()
        assert table.panel._plots._choice.options == (NOTHING,)
        table.panel._chooser._text.value = str(folder)
        with pytest.raises(ValueError, match="cannot be read"):
            table.panel._chooser._add()
