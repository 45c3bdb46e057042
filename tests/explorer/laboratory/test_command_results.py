"""What the tab "Laboratory" tells: the words of the terminal, by the command line that it says repeats them."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from doe.laboratory import TESTS
from explorer.design.analysis import AnalyseOrder
from explorer.design.choices import Alpha, ModelOrder
from explorer.design.filled_sheet import read_sheet
from explorer.design.run_plan import DesignOrder
from explorer.errors import CommandError
from explorer.laboratory.command_results import (
    Ruler,
    SheetOrder,
    analysis_result,
    audit_result,
    bench_result,
    example_rulers,
    photograph_reading,
    photograph_result,
    sheet_result,
)
from explorer.laboratory.part import measured_source, read_part
from explorer.laboratory.run import LabOrder, analysed
from solver import ParameterError, load_material, value
from solver.assets import asset_path, shipped_assets
from solver.toml_file import read_toml
from tests.explorer.command_line import explorer
from tests.solver.photograph.examples import BAR_MM, EXAMPLES, MM_PER_PX

pytestmark = pytest.mark.usefixtures("unprinted")


def told(answer, *more):
    """What the terminal says to the answer's own command line."""
    result = explorer(*shlex.split(answer.command)[1:], *more)
    assert result.exit_code == 0, result.output
    return result.stdout.strip()


@pytest.mark.parametrize("test", TESTS)
def test_a_bench_test_is_told_as_in_the_terminal_and_its_part_can_be_read(test, tmp_path):
    answer = bench_result(LabOrder(test, test))
    assert answer.text.strip() == told(answer)
    (name, content), *_ = answer.files.items()
    (tmp_path / name).write_bytes(content)
    assert read_part(tmp_path / name)["format"] == 1
    assert all(plot.make()["data"] for plot in answer.plots.values())
    assert bool(answer.plots) == (test in ("compression", "shear"))


def test_options_are_part_of_the_command_line():
    shear = bench_result(LabOrder("shear", "shear", compression="compression"))
    assert shear.text.strip() == told(shear)
    rest = bench_result(LabOrder("composition", "composition", left_out=("light_impurity",)))
    assert rest.text.strip() == told(rest)
    assert rest.text != bench_result(LabOrder("composition", "composition")).text


def read(photo, **ruler):
    return photograph_result(photograph_reading(str(photo), Ruler(**ruler)))


def test_a_photograph_is_read_and_drawn():
    answer = read("cone_25_30", scale_mm=0.2)
    assert answer.picture.ndim == 3
    assert np.ptp(answer.picture) > 100
    assert {name.split(".")[-1] for name in answer.files} == {"png", "csv"}
    assert "outline" not in "".join(read(asset_path("photographs", "cone_25_30")).files)


@pytest.mark.parametrize(("ruler", "unit"), [({"reference_mm": 100.0}, "mm"), ({"scale_mm": 0.2}, "mm"), ({}, "px")])
def test_what_was_read_off_a_photograph_has_a_unit_at_every_number(ruler, unit):
    answer = read("cone_25_30", **ruler)
    ((caption, rows),) = answer.tables.items()
    said = dict(rows)
    # A solid of 25° and 30°, 40 mm or 200 pixels high.
    for name, angle in (("left flank", 25.0), ("right flank", 30.0), ("angle of repose", 27.5)):
        form = re.fullmatch(r"(\S+)° \(95 % (\S+) … (\S+)°; standard error (\S+)°\)", said[name])
        value, low, high, error = map(float, form.groups())
        assert value == pytest.approx(angle, abs=0.2)
        assert (low, high) == (pytest.approx(value - 2 * error, abs=0.02), pytest.approx(value + 2 * error, abs=0.02))
    number, its = said["height"].split(" ")
    assert (float(number), its) == (pytest.approx(40.0 if unit == "mm" else 200.0, rel=0.01), unit)
    assert all(re.fullmatch(rf"[\d.]+ {unit}", said[name]) for name in ("height", "half-width", "roughness"))
    assert said["base line"].endswith("°")
    # The terminal's numbers, in its line of the picture.
    line = told(answer).splitlines()[1].split("  ")
    assert caption == line[0].strip()
    numbers = {part.split(" ±")[0].strip() for part in line if re.match(r"\d", part.strip())}
    assert len(numbers) >= 6
    assert all(number in " ".join(said.values()) for number in numbers)


def test_a_bar_in_the_picture_gives_lengths_too():
    answer = read("cone_25_30", reference_mm=100.0)
    assert "--reference-length 100" in answer.command
    assert "cone_25_30_outline.csv" in answer.files


def test_every_shipped_photograph_has_the_scale_that_it_was_rendered_at():
    assert set(example_rulers()) == set(shipped_assets("photographs")) == set(EXAMPLES)
    for name, ruler in example_rulers().items():
        assert (ruler.scale_mm or ruler.reference_mm) == (BAR_MM if name == "cone_25_30" else MM_PER_PX)
        assert ruler.known


def test_a_picture_of_nothing_says_so(tmp_path):
    from PIL import Image

    Image.new("L", (640, 480), 128).save(tmp_path / "nothing.png")
    (((what, _why),),) = read(tmp_path / "nothing.png").tables.values()
    assert what == "no angle"


def test_a_sheet_is_that_of_the_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = SheetOrder("sunflower_extract", 0.5, 1.0, decimal_comma=True)
    answer = sheet_result(DesignOrder("box-behnken", replicates=2, seed=4, standard_order=True), asked)
    assert told(answer).startswith(answer.text.strip())
    assert "chance to see 1" in answer.text
    assert (tmp_path / "runs.csv").read_bytes() == answer.files["runs.csv"]


def test_a_workbook_is_that_of_the_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = sheet_result(DesignOrder("box-behnken"), SheetOrder("sunflower_extract", workbook=True))
    told(answer)
    (tmp_path / "mine.xlsx").write_bytes(answer.files["runs.xlsx"])
    mine, theirs = (read_sheet(tmp_path / name) for name in ("mine.xlsx", "runs.xlsx"))
    assert mine.cells == theirs.cells
    assert len(mine.cells) == 17


@pytest.mark.parametrize("number", [0.0, -1.0, float("inf")])
def test_a_scatter_that_cannot_be_is_refused(number):
    with pytest.raises(CommandError, match=r"--effect .* a positive number"):
        sheet_result(DesignOrder("box-behnken"), SheetOrder("sunflower_extract", effect=number))


@pytest.mark.parametrize(
    ("order", "said"),
    [
        (DesignOrder("plackett-burman", runs=12, fold=True), "--runs 12 --fold"),
        (DesignOrder("factorial", generators=("C=AB",)), "--generator C=AB"),
        (DesignOrder("plackett-burman", runs=16, nonregular=True), "--runs 16 --nonregular"),
        (DesignOrder("central-composite", blocks=3), "--blocks 3"),
        (DesignOrder("central-composite", alpha=Alpha.INSCRIBED, centre=2), "--alpha inscribed"),
        (DesignOrder("factorial", fraction=1), "--fraction 1"),
        (DesignOrder("d-optimal", augment=asset_path("runs", "sunflower_extract"), runs=3), "--augment"),
        (DesignOrder("d-optimal", model=ModelOrder.LINEAR, constraints=("A + 60*B <= 90",)), "'A + 60*B <= 90'"),
    ],
)
def test_options_of_a_design_are_part_of_its_command_line(order, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = sheet_result(order, SheetOrder("sunflower_extract"))
    assert said in answer.command
    assert told(answer).startswith(answer.text.strip())
    assert (tmp_path / "runs.csv").read_bytes() == answer.files["runs.csv"]


def test_an_analysis_has_its_words_its_charts_and_its_report():
    answer = analysis_result(AnalyseOrder("sunflower_extract", target=24.68))
    assert answer.text.strip() == told(answer)
    assert {"Contours", "Predicted and observed", "Single runs", "Ridge", "Solution surface"} <= set(answer.plots)
    drawn = {title: plot.make() for title, plot in answer.plots.items()}
    assert all(spec and spec["data"] for spec in drawn.values()), drawn.keys()
    assert b"</html>" in answer.files["report.html"]


def test_an_audit_is_that_of_the_command():
    answer = audit_result(None)
    assert answer.text.strip() == told(answer)
    assert "141 reproduced exactly" in answer.text
    assert b"</html>" in answer.files["audit.html"]


def test_a_pour_gets_what_was_measured_in_a_file_that_says_where_it_is_from(tmp_path):
    present = load_material("sunflower_extract")
    source = measured_source(present, analysed(LabOrder("inclined_plane", "inclined_plane")), tmp_path)
    friction = "pair.seed.seed.static_friction"
    # Angles are given to 0.01°.
    assert value(source.scene, friction) == pytest.approx(value(present, friction), rel=1e-3)
    (file,) = tmp_path.iterdir()
    assert load_material(str(file)) == source.scene
    assert "[measured.pair.seed.seed.static_friction]" in file.read_text()
    assert value(source.scene, "pair.seed.seed.restitution") == value(present, "pair.seed.seed.restitution")


def test_a_second_bench_test_keeps_the_origins_of_the_first(tmp_path):
    first = measured_source(
        load_material("sunflower_extract"), analysed(LabOrder("inclined_plane", "inclined_plane")), tmp_path
    )
    second = measured_source(first.scene, analysed(LabOrder("drop", "drop")), tmp_path, first.material)
    measured = read_toml(Path(second.material))["measured"]["pair"]["seed"]["plate"]
    assert {"static_friction", "restitution"} <= set(measured)


def test_readings_without_a_parameter_or_of_another_material_pour_nothing(tmp_path):
    present = load_material("sunflower_extract")
    with pytest.raises(CommandError, match="moisture: the test gives no material parameter"):
        measured_source(present, analysed(LabOrder("moisture", "moisture")), tmp_path)
    path = tmp_path / "other.csv"
    path.write_text("a,b,replicate,angle_deg\n" + "".join(f"maize,steel,r{k},{20 + k / 10}\n" for k in range(5)))
    with pytest.raises(ParameterError, match="maize"):
        measured_source(present, analysed(LabOrder("inclined_plane", str(path))), tmp_path / "kept")
    assert not (tmp_path / "kept").exists()
