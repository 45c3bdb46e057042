import json
import math
import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
import trimesh

from doe.declared.set_ups import CHANGES, TURNED, feasible
from doe.diagnose.diagnosis import joined
from doe.diagnose.next_experiment import RankedExperiment
from doe.diagnose.result import BODIES_ALONE, Suggestion
from doe.errors import MeasurementError
from doe.measurement.load import load_measurement
from explorer.diagnosis.next_folder import asks_for, read_next, write_next
from explorer.diagnosis.setup_drawing import CHANGED, setup_svg
from explorer.errors import CommandError
from solver import RIGS, pour_rig, with_rig, with_values
from solver.assets import measurement_folder
from solver.rigs import Funnel
from tests.doe.measurement import folders

SOURCE = measurement_folder("trefoil_2")
RIVALS = ("rolling_resistance", "rolling_resistance+twisting", "base")
TWICE = "outlet at twice the height"
SHUT = "filled with the outlet closed, then opened"


@pytest.fixture(scope="module")
def measured():
    return load_measurement(SOURCE)


@pytest.fixture(params=[name for name in (*(one.name for one in CHANGES), *Funnel.quick_changes) if name != SHUT])
def timed(request):
    """A change of a set-up that is read after a stated time: filled first, it would be read while it runs out."""
    return request.param


def suggestion(name, values, condition="fit", pours=3):
    experiment = RankedExperiment(name, 0.83, 1.5)
    levers = ("twisting: spin a single body",)
    return Suggestion(experiment, values, condition, RIVALS, levers, pours, name.endswith(TURNED))


def values_of(measurement, name):
    changes = feasible(measurement.fit[0].scene)
    return {change.named(turned): values for change, values in changes for turned in (False, True)}[name]


def written(folder, source, measurement, name=TWICE):
    condition = measurement.fit[0].name
    write_next(folder, source, measurement, suggestion(name, values_of(measurement, name), condition))
    return folder


def fill(folder):
    """A made-up number in every row that waits for one."""
    (table,) = folder.glob("*.csv")
    lines = table.read_text().splitlines()
    rows = [re.sub(r"^# (\d+)(,[^,]*,[^,]*,)$", r"\1\g<2>0.0\1", line) for line in lines]
    assert rows != lines
    table.write_text("\n".join(rows) + "\n")
    return folder


def test_a_filled_folder_is_the_changed_set_up(tmp_path, measured, timed):
    fit = measured.fit[0]
    values = values_of(measured, timed)
    found = read_next(fill(written(tmp_path / "out/next", SOURCE, measured, timed)))
    assert (found.rivals, found.change) == (RIVALS, timed)
    (condition,) = found.measurement.conditions
    assert replace(condition.scene, title="") == replace(with_values(fit.scene, dict(values)), title="")
    assert (condition.role, condition.replicates, condition.mean_of) == ("fit", 3, 1)
    assert not condition.turned
    assert set(condition.offered) == set(fit.offered)
    assert all((condition.offered[name].x == o.x).all() for name, o in fit.offered.items() if o.x is not None)
    assert found.measurement.parameters == measured.parameters
    assert condition.name not in {one.name for one in measured.conditions}


def test_the_drawing_shows_what_changes(tmp_path, measured, timed):
    values = values_of(measured, timed)
    folder = written(tmp_path / "next", SOURCE, measured, timed)
    drawing = (folder / "setup.svg").read_text()
    assert ElementTree.fromstring(drawing).tag == "{http://www.w3.org/2000/svg}svg"
    assert (CHANGED in drawing) == bool(values)
    labels = [f'fill="{CHANGED}"' in line for line in drawing.splitlines() if "<text" in line]
    assert sum(labels) == len(values) + bool(values)


def test_a_pile_whose_feed_takes_longer_is_read_later(tmp_path, measured):
    """By as much: at the time stated for the first condition a third of the mass would still be fed."""
    scene = measured.fit[0].scene
    found = {change.name: values for change, values in feasible(scene)}
    fed = scene.rig.mass / scene.insertion.rate
    slow = found["fed at 0.4 times the rate"]
    assert slow["numerics.duration"] == pytest.approx(2.6 + 1.5 * fed)
    assert found["half as much mass again"]["numerics.duration"] == pytest.approx(2.6 + 0.5 * fed)
    assert all("numerics.duration" not in found[name] for name in ("half the mass", "fed four times as fast"))
    folder = tmp_path / "next"
    write_next(folder, SOURCE, measured, suggestion("fed at 0.4 times the rate", slow, "fit"))
    assert "Read each pile 4.85 s after the first body" in (folder / "README.md").read_text()


def test_the_readme_says_what_to_do(tmp_path, measured):
    text = (written(tmp_path / "next", SOURCE, measured) / "README.md").read_text()
    assert f"explorer diagnose {SOURCE.absolute()} --follow-up {tmp_path / 'next'} " in text
    for part in (TWICE, "83 %", "outlet height: **120 mm** (so far 60 mm)", "3 times", "twisting: spin a single body"):
        assert part in text
    for part in (
        "`rolling_resistance` with `twisting`",
        "the declared model",
        "outlet_at_twice_the_height.csv",
        "2.6 s",
    ):
        assert part in text


def test_the_readme_says_how_to_set_a_speed_and_a_gate(tmp_path, measured):
    fast = written(tmp_path / "fast", SOURCE, measured, "dropped four times as fast")
    assert "**2 m/s**, as after a free fall of 203.9 mm (so far 0.5 m/s)" in (fast / "README.md").read_text()
    asked = suggestion(SHUT, {"insertion.protocol": "fill_then_open"})
    write_next(tmp_path / "shut", SOURCE, measured, asked)
    shut = tmp_path / "shut"
    assert "filled with the outlet closed, left to settle, then opened" in (shut / "README.md").read_text()


def test_what_is_read_after_a_stated_time_is_not_filled_first(measured):
    scene = measured.fit[0].scene
    assert SHUT not in {change.name for change, _ in feasible(scene)}
    assert SHUT in {change.name for change, _ in feasible(with_values(scene, {"numerics.duration": 0.0}))}


def test_a_rig_s_own_changes_are_on_the_menu(measured):
    for name in RIGS:
        scene = with_rig(measured.scene, name)
        assert set(pour_rig(scene).quick_changes) <= {change.name for change, _ in feasible(scene)}


def test_a_drum_forgets_how_it_was_fed_and_is_not_asked_to_be_fed_otherwise(measured):
    offered = {name: {change.name for change, _ in feasible(with_rig(measured.scene, name))} for name in RIGS}
    fed = {"fed four times as fast", "fed at 0.4 times the rate", "dropped four times as fast"}
    assert [name for name, found in offered.items() if not fed & found] == ["rotating_drum"]
    assert offered["rotating_drum"] == {"as it is, poured again", *RIGS["rotating_drum"].quick_changes}
    at_once = with_values(with_rig(measured.scene, "rotating_drum"), {"rig.transient_turns": 0.1})
    assert fed <= {change.name for change, _ in feasible(at_once)}


def test_what_is_calibrated_is_changed_by_no_candidate(measured):
    scene = measured.fit[0].scene
    paths = {path for _, values in feasible(scene, {"rig.outlet_height"}) for path in values}
    assert "rig.outlet_height" not in paths
    assert {"rig.mass", "rig.outlet_diameter"} <= paths


def test_the_readme_says_how_a_rig_is_turned(tmp_path, measured):
    folder = written(tmp_path / "next", SOURCE, measured, TURNED)
    text = (folder / "README.md").read_text()
    assert "the whole rig, plate and funnel: **turned by 180° on its bench**" in text
    assert "turned = true" in (folder / "measurement.toml").read_text()


def test_the_order_says_what_was_asked(tmp_path, measured):
    folder = written(tmp_path / "next", SOURCE, measured)
    assert json.loads((folder / "follow_up.json").read_text()) == {
        "schema": 1,
        "rivals": list(RIVALS),
        "change": TWICE,
        "values": {"rig.outlet_height": 0.12},
        "turned": False,
        "condition": "fit",
        "source": str(SOURCE.absolute()),
        "before": [],
    }
    assert (folder / "scans/README.txt").read_text().count("\n") == 1


def test_a_folder_asks_for_the_change_that_it_was_written_for(tmp_path, measured):
    folder = written(tmp_path / "next", SOURCE, measured)
    assert asks_for(folder, suggestion(TWICE, {}))
    assert not asks_for(folder, suggestion(SHUT, {}))
    assert not asks_for(tmp_path, suggestion(TWICE, {}))
    order = json.loads((folder / "follow_up.json").read_text())
    for wrong in ("{", "[]", json.dumps(order | {"schema": 2}), json.dumps(order | {"rivals": 1})):
        (folder / "follow_up.json").write_text(wrong)
        assert not asks_for(folder, suggestion(TWICE, {}))


def test_an_unfilled_folder_is_refused(tmp_path, measured):
    folder = written(tmp_path / "next", SOURCE, measured)
    with pytest.raises(CommandError, match=r"outlet_at_twice_the_height\.csv: value: none is filled in yet"):
        read_next(folder)
    (table,) = folder.glob("*.csv")
    table.write_text(table.read_text().replace("# 1,", "1,"))
    with pytest.raises(CommandError, match="value: none is filled in yet"):
        read_next(folder)


BODIES = (("trefoil", "mass"), ("trefoil", "length_spread"))


def asking_for_bodies(folder, measured):
    asked = replace(suggestion(TWICE, values_of(measured, TWICE), measured.fit[0].name), bodies=BODIES)
    write_next(folder, SOURCE, measured, asked)
    return folder


def test_single_bodies_are_asked_for_and_may_be_left_out(tmp_path, measured):
    (body,) = {one.name for one in measured.scene.bodies}
    assert body == BODIES[0][0]
    folder = asking_for_bodies(tmp_path / "next", measured)
    text = (folder / "README.md").read_text()
    assert "- trefoil, mean mass of one body: count fifty, weigh them in five lots of ten" in text
    assert "from body to body, over its mean: measure thirty with a caliper" in text
    assert "3 pours and these numbers give the right answer" in text
    bodies, pours = folder / "bodies.csv", folder / "outlet_at_twice_the_height.csv"
    assert "# trefoil,mass,g,,\n# trefoil,length_spread,1,,\n" in bodies.read_text()
    with pytest.raises(CommandError, match=r"outlet_at_twice_the_height\.csv: value: none is filled in yet"):
        read_next(folder)
    filled = re.sub(r"^# (\d+)(,[^,]*,[^,]*,)$", r"\1\g<2>0.0\1", pours.read_text(), flags=re.MULTILINE)
    pours.write_text(filled)
    assert read_next(folder).measurement.bodies == ()
    bodies.write_text(bodies.read_text().replace("# trefoil,mass,g,,", "trefoil,mass,g,0.21,0.002"))
    (row,) = read_next(folder).measurement.bodies
    assert (row.quantity, row.mean, row.standard_error) == ("mass", pytest.approx(2.1e-4), pytest.approx(2e-6))
    bodies.write_text(bodies.read_text().replace("0.21,0.002", "0.21,"))
    with pytest.raises(MeasurementError, match=r"bodies\.csv:\d+: standard_error: "):
        read_next(folder)


CHECK = Suggestion(
    RankedExperiment(BODIES_ALONE, 0.91, 2.5), {}, "fit", ("density_error", "base"), (), 0, bodies=BODIES
)


def test_a_check_asks_for_bodies_and_for_no_pour(tmp_path, measured):
    folder = tmp_path / "next"
    write_next(folder, SOURCE, measured, CHECK)
    assert not list(folder.glob("*.svg")) + list(folder.glob("scans"))
    text = (folder / "README.md").read_text()
    assert text.startswith("# To be checked: `density_error`\n")
    for part in ("single bodies tell it from\nthe declared model.", "91 %", "mean mass of one body: count fifty"):
        assert part in text
    assert f"explorer diagnose {SOURCE.absolute()} --follow-up {folder} " in text
    assert asks_for(folder, CHECK)
    table = folder / "bodies.csv"
    with pytest.raises(CommandError, match=r"bodies\.csv: mean: none is filled in yet"):
        read_next(folder)
    table.write_text(table.read_text().replace("# trefoil,mass,g,,", "trefoil,mass,g,0.21,0.002"))
    found = read_next(folder)
    assert found.measurement.conditions == ()
    both = joined(measured, found.measurement)
    assert both.conditions == measured.conditions
    assert [(one.quantity, one.mean) for one in both.bodies] == [("mass", pytest.approx(2.1e-4))]


def test_bodies_alone_are_no_data_set_to_be_diagnosed(tmp_path, measured):
    write_next(tmp_path / "next", SOURCE, measured, CHECK)
    with pytest.raises(MeasurementError, match=r"measurement\.toml: condition\.role: none of 0 conditions"):
        load_measurement(tmp_path / "next")


def test_without_bodies_none_are_asked_for(tmp_path, measured):
    folder = written(tmp_path / "next", SOURCE, measured)
    assert not (folder / "bodies.csv").exists()
    assert "bodies" not in tomllib.loads((folder / "measurement.toml").read_text())
    assert "single bodies" not in (folder / "README.md").read_text()


def test_a_row_without_its_value_is_named(tmp_path, measured):
    folder = fill(written(tmp_path / "next", SOURCE, measured))
    (table,) = folder.glob("*.csv")
    table.write_text(table.read_text().replace("1,apex_height_m,,0.01", "1,apex_height_m,,"))
    with pytest.raises(MeasurementError, match=r"\.csv:\d+: value: ''"):
        read_next(folder)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (None, "no such file"),
        ("{", "no JSON"),
        ("[]", "schema: "),
        ('{"schema": 2}', "schema: 2; allowed: 1"),
        ('{"schema": 1, "change": "x"}', "rivals: None"),
        ('{"schema": 1, "rivals": ["base", "phlogiston"], "change": "x"}', "rivals: .*phlogiston"),
        ('{"schema": 1, "rivals": ["base"], "change": "x"}', "rivals: "),
        ('{"schema": 1, "rivals": ["base", "twisting"]}', "change: None"),
        ('{"schema": 1, "rivals": ["base", "twisting"], "change": "x", "before": "next"}', "before: 'next'; allowed: "),
        ('{"schema": 1, "rivals": ["base", "twisting"], "change": "x", "before": [1]}', r"before: \[1\]; allowed: "),
    ],
)
def test_what_is_no_follow_up_is_refused(tmp_path, text, wanted):
    if text is not None:
        (tmp_path / "follow_up.json").write_text(text)
    with pytest.raises(CommandError, match=rf"^[^\n]*follow_up\.json: {wanted}[^\n]*$"):
        read_next(tmp_path)


def test_a_folder_that_is_not_empty_is_refused(tmp_path, measured):
    (tmp_path / "mine.txt").write_text("kept")
    with pytest.raises(CommandError, match=r"^[^\n]*is not empty[^\n]*$"):
        written(tmp_path, SOURCE, measured)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    with pytest.raises(CommandError, match="is a file"):
        written(tmp_path / "mine.txt", SOURCE, measured)


@pytest.mark.parametrize(
    "title", ['"quoted" \\ back', 'a"""\n[[condition]]\nname = 1', "tab\t`del\x7f nul\x00", "日本 <b>&", ""]
)
def test_a_title_is_only_text(tmp_path, title):
    text = json.dumps(title).replace("\x7f", "\\u007f")
    source = folders.write(
        tmp_path / "data",
        {"measurement.toml": folders.changed(folders.MEASUREMENT, 'title = "beads"', f"title = {text}")},
    )
    folder = written(tmp_path / "next", source, load_measurement(source))
    expected = f"{title or 'data'}: follow-up, {TWICE}"
    assert tomllib.loads((folder / "measurement.toml").read_text())["title"] == expected
    assert read_next(fill(folder)).measurement.title == expected
    assert ElementTree.fromstring((folder / "setup.svg").read_text()) is not None


def test_numbers_come_back_to_the_last_bit(tmp_path):
    odd = folders.changed(folders.MEASUREMENT, "mean = 0.3, sd = 0.05", "mean = 0.1234567890123456789, sd = 1e-2")
    source = folders.write(tmp_path / "data", {"measurement.toml": odd})
    measured = load_measurement(source)
    scene = measured.fit[0].scene
    for k, (change, values) in enumerate(feasible(scene)):
        values = {path: v * (1 / 3 + 2 / 3) if isinstance(v, float) else v for path, v in values.items()}
        folder = tmp_path / f"next_{k}"
        write_next(folder, source, measured, suggestion(change.name, values, "slow"))
        again = read_next(fill(folder)).measurement
        expected, found = with_values(scene, dict(values)), again.conditions[0].scene
        assert again.parameters == measured.parameters
        assert found.rig == expected.rig
        # region_z holds two heights, whose difference cannot always be had to the last bit.
        assert found.insertion.region_height == pytest.approx(expected.insertion.region_height, rel=1e-14)
        same = replace(found.insertion, region_height=expected.insertion.region_height)
        assert same == expected.insertion


def test_what_a_material_names_is_copied(tmp_path):
    source = tmp_path / "lab/data"
    body = "sphere_centres = [[0.0, 0.0, 0.0]]\nsphere_radii = [6e-3]\nmass = 2e-3\n"
    body += 'inertia = [3e-8, 3e-8, 3e-8]\nunit = "m"\n'
    material = folders.changed(
        folders.MATERIAL, "shape = { sphere = 12e-3 }", 'mass_fraction = 0.4\nfile = "bodies/bead.toml"'
    )
    other = '[[body]]\nname = "grain"\nmaterial = "glass"\nmass_fraction = 0.6\nmesh = "../common/box.stl"\n'
    material = folders.changed(material, "[pair.glass.glass]", f"{other}{body}[pair.glass.glass]")
    folders.write(source, {"material.toml": material})
    (source / "bodies").mkdir()
    (tmp_path / "lab/common").mkdir()
    (source / "bodies/bead.toml").write_text(f'format = 1\n[[body]]\nname = "bead"\nmesh = "box.stl"\n{body}')
    for path in (source / "bodies/box.stl", tmp_path / "lab/common/box.stl"):
        trimesh.creation.box((0.012, 0.012, 0.012)).export(path)
    measured = load_measurement(source)
    folder = fill(written(tmp_path / "next", source, measured))
    shutil.rmtree(source)
    again = read_next(folder).measurement
    drawn = [Path(body.shape.drawn.file).resolve() for body in again.scene.bodies]
    assert drawn == [folder / "bodies/box.stl", tmp_path / "lab/common/box.stl"]
    assert [body.shape.centres for body in again.scene.bodies] == [body.shape.centres for body in measured.scene.bodies]
    assert again.scene.pairs == measured.scene.pairs


def test_a_condition_of_another_material_is_followed_up_with_that(tmp_path):
    source = tmp_path / "data"
    text = folders.changed(folders.MEASUREMENT, 'role = "fit"', 'role = "fit"\nmaterial = "dense.toml"')
    dense = folders.changed(folders.MATERIAL, "density = 2500.0", "density = 5000.0")
    folders.write(source, {"measurement.toml": text, "dense.toml": dense})
    measured = load_measurement(source)
    folder = fill(written(tmp_path / "next", source, measured))
    shutil.rmtree(source)
    (again,) = read_next(folder).measurement.conditions
    assert again.scene.materials == measured.fit[0].scene.materials != measured.scene.materials


def test_a_published_mean_is_followed_up_by_single_pours(tmp_path):
    source = measurement_folder("sunflower_extract")
    folder = written(tmp_path / "next", source, load_measurement(source))
    table = tomllib.loads((folder / "measurement.toml").read_text())
    assert table["material"] == "sunflower_extract"
    assert table["uncertainty"] == {"angle_of_repose_deg": math.sqrt(10) * 0.51}
    assert not (folder / "scans").exists()
    assert read_next(fill(folder)).measurement.conditions[0].mean_of == 1


def test_a_range_narrowed_by_another_condition_stays_narrow(tmp_path):
    source = shutil.copytree(measurement_folder("granudrum_mcc"), tmp_path / "data")
    text = (source / "measurement.toml").read_text()
    at = text.rindex("axial_length = 0.020")
    (source / "measurement.toml").write_text(
        text[:at] + "axial_length = 0.0195" + text[at + len("axial_length = 0.020") :]
    )
    measured = load_measurement(source)
    folder = written(tmp_path / "next", source, measured, "turned twice as fast")
    again = read_next(fill(folder)).measurement
    assert again.parameters == measured.parameters
    assert set(again.conditions[0].offered) == set(measured.fit[0].offered)
    assert not (folder / "setup.svg").exists()


def test_a_taken_name_is_not_taken_again(tmp_path):
    text = folders.changed(folders.MEASUREMENT, 'name = "fast"', 'name = "half_the_mass"')
    source = folders.write(tmp_path / "data", {"measurement.toml": text})
    folder = written(tmp_path / "next", source, load_measurement(source), "half the mass")
    assert [path.name for path in folder.glob("*.csv")] == ["half_the_mass_2.csv"]


@pytest.mark.parametrize(
    ("values", "wanted"),
    [
        ({"pair.grain.grain.restitution": 0.5}, "pair.grain.grain.restitution: is calibrated"),
        ({"numerics.max_time": 9.0}, "numerics.max_time: no condition states it"),
    ],
)
def test_a_change_that_no_condition_states_is_refused(tmp_path, measured, values, wanted):
    with pytest.raises(CommandError, match=wanted):
        write_next(tmp_path / "next", SOURCE, measured, suggestion("odd", values))
    assert not (tmp_path / "next").exists()


def test_rigs_that_are_drawn(measured):
    scene = measured.scene
    cylinder = ElementTree.fromstring(setup_svg(with_rig(scene, "lifting_cylinder"), {}))
    words = " ".join(cylinder.itertext())
    assert "cylinder height 150 mm" in words
    assert "diameter 80 mm" in words
    assert "lifted at 0.02 m/s" in words
    for name in ("rotating_drum", "mesh_funnel"):
        assert setup_svg(with_rig(scene, name), {}) == ""


def test_the_drawing_is_to_scale(measured):
    scene = with_values(measured.scene, {"rig.outlet_diameter": 0.04, "rig.outlet_height": 0.08})
    lines = [
        dict(one.items()) for one in ElementTree.fromstring(setup_svg(scene, {})).iter() if one.tag.endswith("line")
    ]
    plate, left, right = ([float(one[key]) for key in ("x1", "y1", "x2", "y2")] for one in lines[:3])
    feed = pour_rig(scene).feed()
    scale = (plate[1] - left[1]) / 0.08
    assert right[0] - left[0] == pytest.approx(0.04 * scale, abs=0.2)
    assert right[2] - left[2] == pytest.approx(2.0 * feed.radius * scale, abs=0.3)
    assert plate[1] - left[3] == pytest.approx(feed.floor * scale, abs=0.3)
