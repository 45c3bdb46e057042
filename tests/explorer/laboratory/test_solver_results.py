"""Answers that take the solver: each is what its command prints, which runs in a process of its own."""

import json
import shlex
import sys
import zipfile
from io import BytesIO

import pytest

from explorer.background.command_output import command_output, kept_scene
from explorer.errors import CommandError
from explorer.laboratory.command_results import (
    Ruler,
    compared_result,
    photograph_reading,
    photograph_result,
    rig_result,
    twin_result,
)
from explorer.laboratory.run import LabOrder
from explorer.scene.file import load_scene
from explorer.terminal.photograph import measure_result
from explorer.viewer.output.engine_export import packed_export
from solver import load_material, with_values
from tests.explorer.command_line import explorer

MATERIAL = load_material("nine_sphere_seed")


def python(*arguments):
    return command_output(arguments, program=(sys.executable, "-c"))


def test_what_a_command_prints_is_told():
    assert python("print('one'); print('two')") == "one\ntwo"


def test_a_command_without_good_news_has_an_answer_if_it_says_anything():
    assert python("print('does not close'); raise SystemExit(1)") == "does not close"
    with pytest.raises(CommandError, match="no such body"):
        python("import sys; print('error: no such body', file=sys.stderr); raise SystemExit(1)")


def test_a_refusal_is_its_last_line():
    refused = "import sys; print('half'); print('error: rig.drops: 1 is below 2', file=sys.stderr); raise SystemExit(2)"
    with pytest.raises(CommandError, match=r"^rig\.drops: 1 is below 2$"):
        python(refused)
    with pytest.raises(CommandError, match="ended with exit code 9"):
        python("raise SystemExit(9)")


@pytest.mark.slow
def test_a_rig_answers_what_the_command_line_prints(tmp_path):
    """The fastest of the three, on the solver itself."""
    settings = {"rig.drop_height": 0.1, "rig.specimen": "sphere"}
    answer = rig_result(MATERIAL, "drop_plate_45", settings, 1, tmp_path)
    words = shlex.split(answer.command)
    assert words[:3] == ["explorer", "simulate", "drop_plate_45"]
    assert "rig.drop_height=100mm" in words
    told = explorer(*words[1:])
    assert told.exit_code == 0
    assert told.stdout.strip() == answer.text
    found = json.loads(answer.files["drop_plate_45.json"])["quantities"]["restitution"]
    # The rebound is tracked to a fifth of a percent (tests/solver/single_body/test_bench_tests.py).
    assert found["value"] == pytest.approx(found["reference"], rel=2e-3)


def test_a_rig_that_cannot_be_is_refused_before_anything_runs(tmp_path, monkeypatch):
    monkeypatch.setattr("explorer.laboratory.command_results.command_output", lambda words: pytest.fail(str(words)))
    with pytest.raises(ValueError, match="drop_height"):
        rig_result(MATERIAL, "drop_plate_45", {"rig.drop_height": -1.0}, 1, tmp_path)


def test_curves_of_a_rig_become_charts(tmp_path, monkeypatch):
    data = {
        "title": "",
        "test": "compression",
        "body": "sphere of seed",
        "wall": "steel",
        "note": "",
        "quantities": {},
        "series": {"approach_m": [0.0, 1e-6, 2e-6], "force_N": [0.0, 1.0, None], "modulus_Pa": [None, 1.0, 2.0]},
        "table": {},
        "parameters": {},
        "versions": {},
    }
    monkeypatch.setattr("explorer.laboratory.command_results.command_output", lambda words: json.dumps(data))
    answer = rig_result(MATERIAL, "compression", {}, 1, tmp_path)
    assert list(answer.plots) == ["force_N over approach_m", "modulus_Pa over approach_m"]
    (curve,) = answer.plots["force_N over approach_m"].make()["data"]
    assert curve["y"] == [0.0, 1.0, None]
    data["series"] = {"v_x_m_s": [1.0], "v_z_m_s": [0.2]}  # one drop is no curve
    assert rig_result(MATERIAL, "compression", {}, 1, tmp_path).plots == {}


def test_a_twin_is_the_command_with_its_options(monkeypatch):
    asked = []
    monkeypatch.setattr(
        "explorer.laboratory.command_results.command_output", lambda words: asked.append(words) or "closes"
    )
    order = LabOrder("shear", "shear", compression="compression", material="mine.toml", simulate=True, bias=True)
    answer = twin_result(order)
    words = "lab shear shear --compression compression --simulate --material mine.toml --bias"
    assert asked == [words.split()]
    assert (answer.text, answer.command) == ("closes", f"explorer {words}")
    assert answer.plots
    assert list(answer.files) == ["shear.toml", "report.html"]


def test_the_bias_of_a_formula_is_the_commands():
    answer = twin_result(LabOrder("compression", "compression", bias=True))
    told = explorer(*shlex.split(answer.command)[1:])
    assert told.exit_code == 0
    assert told.stdout.strip() == answer.text


def test_a_photograph_beside_a_pour_has_both_in_its_picture_and_its_table(tmp_path, monkeypatch):
    from PIL import Image

    read = photograph_reading("cone_25_30", Ruler(scale_mm=0.2))
    spread = {"mean": 20.5, "sd": 0.25}
    keys = ("left_deg", "right_deg", "mean_deg", "height_mm", "half_width_mm")
    asked = []

    def drawn(words):
        Image.new("RGB", (30, 20), "red").save(words[words.index("--plot") + 1])
        asked.append(words[words.index("--from-simulation") + 1])
        simulation = {"source": asked[0], "piles": 1, "views": 12, **dict.fromkeys(keys, spread)}
        return json.dumps(measure_result(read.measured) | {"simulation": simulation})

    monkeypatch.setattr("explorer.laboratory.command_results.command_output", drawn)
    answer = compared_result(read, MATERIAL, tmp_path)
    assert load_scene(asked[0]) == MATERIAL
    assert answer.picture.shape == (20, 30, 3)
    assert answer.command == f"explorer measure cone_25_30 --scale 0.2 --from-simulation {asked[0]}"
    photographed, simulated = map(dict, answer.tables.values())
    assert photographed == dict(*photograph_result(read).tables.values())
    assert simulated["angle of repose"] == "20.50° (standard deviation 0.25°)"
    assert simulated["height"] == "20.50 mm (standard deviation 0.25 mm)"
    assert simulated["read on"] == "12 views of 1 pile"
    assert simulated["photographed less simulated"].startswith("+7.0")  # 27.5° less 20.5°


def test_a_scene_is_kept_under_a_name_of_its_contents(tmp_path):
    same = {kept_scene(MATERIAL, tmp_path) for _ in range(2)}
    softer = kept_scene(with_values(MATERIAL, {"rig.mass": 0.002}), tmp_path)
    assert len(same) == 1
    assert softer not in same
    assert load_scene(str(softer)) != MATERIAL


def test_an_export_is_one_file_with_everything_in_it(tmp_path):
    content = packed_export(kept_scene(load_material("sunflower_extract"), tmp_path), "edem", 1)
    with zipfile.ZipFile(BytesIO(content)) as archive:
        names = {name.rpartition("/")[2] for name in archive.namelist()}
        assert archive.testzip() is None
    assert "conventions.csv" in names


def test_what_a_program_does_not_take_is_one_line(tmp_path):
    with pytest.raises(CommandError, match="not a program"):
        packed_export(kept_scene(MATERIAL, tmp_path), "excel", 1)
