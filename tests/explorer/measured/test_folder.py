"""`explorer new measurement`: what comes back from the reader is numpy's of what went in, and a diagnosis takes it."""

import json
import tomllib

import numpy as np
import pytest
from PIL import Image

from doe.declared.budget import Budget
from doe.diagnose.diagnosis import run_diagnosis
from doe.laboratory import analyse
from doe.measurement import load_measurement, summaries_of_data
from doe.store import Store
from solver import asset_path, value
from tests.doe.measurement.folders import MATERIAL
from tests.explorer.command_line import explorer, refused
from tests.explorer.measured.test_balance import BEGINS, LAG, LASTS, MASS, RATE, steady
from tests.explorer.measured.test_balance import write as write_balance
from tests.solver.photograph import drum_faces
from tests.solver.photograph.rendered import Look, photograph, save, solid_cover

ANGLES = (24.1, 25.0, 26.2, 23.9)


@pytest.fixture
def material(tmp_path):
    path = tmp_path / "beads.toml"
    path.write_text(MATERIAL, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    return [
        save(folder / f"pile {k}.PNG", photograph(solid_cover(angle, angle, 90), Look(width=500, seed=k)))
        for k, angle in enumerate((24, 27), start=1)
    ]


def new(folder, *arguments):
    result = explorer("new", "measurement", folder.name, "--out", folder.parent, *arguments)
    assert result.exit_code == 0, result.output
    return result.stdout


def files(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def values(folder, condition, observable):
    (one,) = (one for one in load_measurement(folder).conditions if one.name == condition)
    return one.offered[observable].values


def test_angles_come_back_with_their_mean_and_spread(material, tmp_path):
    folder = tmp_path / "data"
    text = new(folder, "--material", material, "--angles", ",".join(map(str, ANGLES)), "--set", "rig.mass=14g")
    measurement = load_measurement(folder)
    (condition,) = measurement.fit
    assert values(folder, "A", "angle_of_repose_deg").tolist() == list(ANGLES)
    assert summaries_of_data(condition).mean() == np.mean(ANGLES)
    assert f"{np.mean(ANGLES):.5g}  {np.std(ANGLES, ddof=1):.3g}" in text
    assert value(condition.scene, "rig.mass") == 0.014
    # The checker's own words, a moment later, are those that the command printed.
    checked = explorer("measurements", "check", folder)
    assert checked.exit_code == 0
    assert checked.stdout.strip() in text
    assert "role: A is fitted" in text
    assert f"try it: explorer diagnose {folder}" in text
    # The folder is whole without what it was made from.
    material.unlink()
    load_measurement(folder)


def test_a_column_of_a_table(material, tmp_path):
    sheet = tmp_path / "angles.csv"
    sheet.write_text("pour;angle;by\n1;24,1;x\n2;25,0;y\n", encoding="utf-8")
    new(tmp_path / "data", "--material", material, "--angles", f"{sheet}:angle")
    assert values(tmp_path / "data", "A", "angle_of_repose_deg").tolist() == [24.1, 25.0]
    line = refused(explorer("new", "measurement", tmp_path / "b", "--material", material, "--angles", sheet))
    assert "column not named; allowed: FILE.csv:COLUMN, one of pour, angle, by" in line


def test_decimal_commas_of_a_column_alone_are_read_and_others_refused(material, tmp_path):
    sheet = tmp_path / "angles.csv"
    sheet.write_text("angle_deg\n24,1\n25,3\n", encoding="utf-8")
    new(tmp_path / "data", "--material", material, "--angles", sheet)
    assert values(tmp_path / "data", "A", "angle_of_repose_deg").tolist() == [24.1, 25.3]
    sheet.write_text("pour,angle_deg\n1,24,1\n2,25,3\n", encoding="utf-8")
    line = refused(
        explorer("new", "measurement", tmp_path / "b", "--material", material, "--angles", f"{sheet}:angle_deg")
    )
    assert f"--angles {sheet}:2: 3 cells; allowed: 2" in line


@pytest.mark.parametrize(
    ("old", "new_", "words"),
    [
        ("value = 0.3, ", "", "value: missing, with an sd beside it; allowed: a number in SI"),
        ("sd = 0.05", 'sd = "0.05"', "sd: '0.05'; allowed: a number in SI"),
    ],
)
def test_a_measured_entry_changed_by_hand_is_refused_by_its_key(old, new_, words, material, tmp_path):
    entry = "\n[measured.pair.glass.glass]\nstatic_friction = { value = 0.3, sd = 0.05 }\n"
    material.write_text(MATERIAL + entry.replace(old, new_), encoding="utf-8")
    line = refused(explorer("new", "measurement", tmp_path / "data", "--material", material, "--angles", "24,25"))
    assert line == f"{material}: measured.pair.glass.glass.static_friction.{words}"


def test_what_a_study_says_of_set_up_and_ranges_is_taken_over(tmp_path):
    assert explorer("new", "study", "lentil", "--out", tmp_path).exit_code == 0
    new(tmp_path / "data", "--study", tmp_path / "lentil_study.toml", "--angles", "24,25")
    table = tomllib.loads((tmp_path / "lentil_study.toml").read_text(encoding="utf-8"))
    measurement = load_measurement(tmp_path / "data")
    assert {(p.path, p.low, p.high) for p in measurement.parameters} == {
        (f["path"], f["low"], f["high"]) for f in table["factor"]
    }
    scene = measurement.fit[0].scene
    assert value(scene, "rig.outlet_height") == table["rig"]["outlet_height"]
    assert value(scene, "insertion.drop_speed") == table["insertion"]["drop_speed"]


def test_a_second_condition_is_added_and_the_one_that_tells_least_held_out(material, tmp_path):
    folder = tmp_path / "data"
    new(folder, "--material", material, "--angles", "24,25,26", "--condition", "slow")
    file = folder / "measurement.toml"
    mine = file.read_text(encoding="utf-8").replace('role = "fit"', 'role = "fit"     # mine')
    file.write_text(mine, encoding="utf-8")
    time = np.arange(0.0, 8.0, 0.05)
    curve = write_balance(tmp_path / "b.csv", time, steady(time))
    again = write_balance(tmp_path / "c.csv", time + 0.01, steady(time))
    more = ["--condition", "fast", "--set", "insertion.rate=0.2", "--set", f"rig.mass={MASS}"]
    text = new(folder, *more, "--balance", curve, "--balance", again, "--starts", BEGINS, "--starts", BEGINS)
    measurement = load_measurement(folder)
    assert [(one.name, one.role) for one in measurement.conditions] == [("slow", "holdout"), ("fast", "fit")]
    assert "proposed to hold out: slow" in text
    assert "slow 1, fast " in text
    assert value(measurement.fit[0].scene, "insertion.rate") == 0.2
    assert value(measurement.holdout[0].scene, "insertion.rate") == 0.02
    # All else in the file stays.
    now = file.read_text(encoding="utf-8")
    assert now.startswith(mine.replace('role = "fit" ', 'role = "holdout" ').rstrip())
    # A third one leaves roles as they are.
    text = new(folder, "--condition", "high", "--angles", "22,23", "--set", "rig.outlet_height=0.09")
    assert [one.role for one in load_measurement(folder).conditions] == ["holdout", "fit", "fit"]
    assert "held out: slow, as before or as asked for" in text
    assert "has the set-up of" not in text
    text = new(folder, "--condition", "twin", "--angles", "22,23", "--role", "holdout")
    assert "twin has the set-up of slow" in text
    assert [one.name for one in load_measurement(folder).holdout] == ["slow", "twin"]


def test_photographs_are_kept_and_read_as_measure_reads_them(material, pictures, tmp_path):
    folder = tmp_path / "data"
    new(folder, "--material", material, *(w for one in pictures for w in ("--photo", one)), "--scale", 0.5)
    measured = json.loads(explorer("measure", *pictures, "--scale", 0.5, "--json").stdout)["pictures"]
    means = [one["angles"]["mean"]["value_deg"] for one in measured]
    assert values(folder, "A", "angle_of_repose_deg@0").tolist() == means
    assert 1e3 * values(folder, "A", "apex_height_m") == pytest.approx([one["height"] for one in measured])
    assert [one.rms for one in load_measurement(folder).cross_check] == [0.0, 0.0]
    assert {path.as_posix() for path in files(folder)} >= {"images/A_1.png", "images/A_2.png"}


def test_times_of_a_balance_less_its_lag_are_those_of_the_flow(material, tmp_path):
    """q t from the start on: t50 and t90 without the lag, which is 1/20 of the flow's time."""
    time = np.arange(0.0, 8.0, 0.02)
    curves = [write_balance(tmp_path / f"b{k}.csv", time + 0.5 * k, steady(time)) for k in range(2)]
    given = [w for k, curve in enumerate(curves) for w in ("--balance", curve, "--starts", BEGINS + 0.5 * k)]
    folder = tmp_path / "data"
    text = new(folder, "--material", material, "--set", f"rig.mass={MASS}", *given, "--lag", LAG)
    for share, name in ((0.5, "discharge_t50_s"), (0.9, "discharge_t90_s")):
        assert values(folder, "A", name) == pytest.approx([share * LASTS] * 2, abs=2e-3)
    # At t10 the balance has not yet come to follow by its lag, so that it lags by less: 0.1 T = 2 τ.
    assert values(folder, "A", "discharge_t10_s") == pytest.approx([0.1 * LASTS] * 2, abs=0.1 * LAG)
    (condition,) = load_measurement(folder).fit
    flow = condition.offered["discharged_mass_kg"]
    late = flow.x > 5 * LAG
    expected = np.minimum(RATE * flow.x, MASS)
    away = np.abs(flow.x - LASTS) > LAG
    assert flow.values[:, late & away] == pytest.approx(np.tile(expected[late & away], (2, 1)), abs=RATE * LAG / np.e)
    assert "a reading every 0.02 s" in text
    assert f"lag of the balance: at most {LAG:.2g} s by the end of the curve, stated, {LAG:g} s" in text


def test_a_lag_that_reaches_from_the_start_beyond_the_first_tenth_is_refused(material, tmp_path):
    time = np.arange(0.0, 8.0, 0.02)
    curve = write_balance(tmp_path / "b.csv", time, steady(time, 0.0))
    given = ["--balance", curve, "--set", f"rig.mass={MASS}", "--starts", BEGINS, "--lag", 0.1 * LASTS + 0.01]
    line = refused(explorer("new", "measurement", tmp_path / "data", "--material", material, *given))
    assert line == "--lag 0.31: allowed: below 0.3 s, from the start to where a tenth of b.csv has passed"


def test_without_a_start_a_balance_gives_the_duration_alone(material, tmp_path):
    time = np.arange(0.0, 8.0, 0.05)
    curve = write_balance(tmp_path / "b.csv", time, steady(time, 0.0))
    one = ["--balance", curve, "--set", f"rig.mass={MASS}", "--uncertainty", "discharge_time_s=0.1"]
    text = new(tmp_path / "data", "--material", material, *one)
    (condition,) = load_measurement(tmp_path / "data").fit
    assert set(condition.offered) == {"discharge_time_s"}
    assert condition.offered["discharge_time_s"].values == pytest.approx([0.8 * LASTS], abs=1e-6)
    assert "not stated, nothing is taken off" in text
    assert "no --starts: t10, t50, t90" in text


def test_a_balance_that_misses_the_last_tenth_gives_no_duration(material, tmp_path):
    time = np.arange(0.0, 8.0, 0.05)
    whole, short = (
        write_balance(tmp_path / f"{name}.csv", time, share * steady(time, 0.0))
        for name, share in (("whole", 1.0), ("short", 0.85))
    )
    stated = ["--set", f"rig.mass={MASS}", "--uncertainty", "discharge_time_s=0.1"]
    given = ["--balance", whole, "--balance", short, *stated]
    line = refused(explorer("new", "measurement", tmp_path / "data", "--material", material, *given))
    assert line.startswith("--balance short.csv: less than 90 % of ")
    given += ["--uncertainty", "discharge_t90_s=0.1", "--starts", BEGINS]
    text = new(tmp_path / "data", "--material", material, *given)
    assert "short.csv: less than 90 % of it passed" in text
    assert "only 0 readings" not in text
    assert np.isnan(values(tmp_path / "data", "A", "discharge_t90_s")).tolist() == [False, True]


def test_a_scanned_cone_has_the_rings_of_a_cone(material, tmp_path):
    """Mean of h − s r over a ≤ r < b: h − 2 s (b³ − a³)/(3 (b² − a²))."""
    height, slope = 0.030, 0.5
    axis = (np.arange(-100, 100) + 0.5) * 1e-3
    x, y = np.meshgrid(axis, axis)
    z = np.maximum(0.0, height - slope * np.hypot(x, y))
    scan = tmp_path / "cone.xyz"
    np.savetxt(scan, 1e3 * np.column_stack([x.ravel() + 0.2, y.ravel() - 0.1, z.ravel()]))
    stated = ["--uncertainty", "height_profile_m=0.5mm", "--scan-unit", "mm"]
    text = new(tmp_path / "data", "--material", material, "--scan", scan, *stated)
    (condition,) = load_measurement(tmp_path / "data").fit
    profile = condition.offered["height_profile_m"]
    a, b = profile.x - 0.0025, profile.x + 0.0025
    cone = height - 2 * slope * (b**3 - a**3) / (3 * (b**2 - a**2))
    inside = b < height / slope + 1e-9
    assert inside.sum() == 12
    assert profile.values[0, inside] == pytest.approx(cone[inside], abs=2e-4)
    assert profile.values[0, a > height / slope] == pytest.approx(0.0, abs=1e-6)
    assert "whole pile: surface of 1 of 1 piles in cells of 1 mm" in text


def test_a_scan_too_coarse_for_rings_is_refused(material, tmp_path):
    """At 8 mm no point lies in the innermost ring, whose height would be 0 under the top."""
    axis = (np.arange(-12, 12) + 0.5) * 8e-3
    x, y = np.meshgrid(axis, axis)
    np.savetxt(
        tmp_path / "cone.xyz", np.column_stack([x.ravel(), y.ravel(), np.maximum(0, 0.03 - np.hypot(x, y) / 2).ravel()])
    )
    given = ["--scan", tmp_path / "cone.xyz", "--scan-unit", "m", "--uncertainty", "height_profile_m=0.5mm"]
    line = refused(explorer("new", "measurement", tmp_path / "data", "--material", material, *given))
    assert "its points lie 8 mm apart, too far for a profile in rings of 5 mm" in line
    assert not (tmp_path / "data").exists()


def test_a_drum_s_sheet_is_read_as_the_laboratory_does(tmp_path):
    folder = tmp_path / "data"
    rig = ["rig.name=rotating_drum", "rig.speed_rpm=2", "rig.diameter=200mm"]
    drum = ["--material", "sunflower_extract", "--drum", "drum", *(w for one in rig for w in ("--set", one))]
    new(folder, *drum)
    (angle,) = (one for one in analyse("drum", asset_path("laboratory", "drum")).derived if one.name == "dynamic_angle")
    assert values(folder, "A", "dynamic_angle_deg") == pytest.approx(np.degrees(angle.values), rel=1e-12)
    rows = asset_path("laboratory", "drum").read_text().replace(",37.5,0.5,", ",,,", 1)
    (tmp_path / "gap.csv").write_text(rows)
    gap = [str(tmp_path / "gap.csv") if one == "drum" else one for one in drum]
    assert "no lower angle in replicate 1 of mixture" in refused(explorer("new", "measurement", tmp_path / "b", *gap))
    drum[-3] = "rig.speed_rpm=20"
    assert "its Froude number is" in refused(explorer("new", "measurement", tmp_path / "b", *drum))


def test_pictures_of_a_drum_s_face_give_its_angle_and_surface(tmp_path):
    """Three runs of drawn beds; the diameter is the scale, and turned the other way the surface is the same."""
    folder, drum = tmp_path / "data", ["--material", "sunflower_extract", "--set", "rig.name=rotating_drum"]
    drum += ["--set", "rig.diameter=200mm"]
    angles, photos = (28.0, 30.0, -31.0), []
    for k, angle in enumerate(angles):
        photos.append(tmp_path / f"face_{k}.png")
        grey = drum_faces.drawn(drum_faces.plane(angle), drum_faces.Look(grains=10.0, seed=k)).grey
        Image.fromarray(grey.astype(np.uint8)).save(photos[-1])
    text = new(folder, *drum, *(word for photo in photos for word in ("--photo", photo)))
    assert "3 pictures of the drum" in text
    found = values(folder, "A", "dynamic_angle_deg")
    assert found == pytest.approx(np.abs(angles), abs=0.3)
    profile = load_measurement(folder).conditions[0].offered["surface_profile_m"]
    line = -0.1 * 0.1 - np.tan(np.radians(found)).mean() * profile.x
    assert profile.values.mean(axis=0) == pytest.approx(line, abs=1.5e-3)
    assert len(list((folder / "images").iterdir())) == 3
    bad = [*drum, "--photo", "cone_25_30"]
    assert "no drum" in refused(explorer("new", "measurement", tmp_path / "b", *bad))
    assert "--photo, --angles, --drum: each gives dynamic_angle_deg" in refused(
        explorer("new", "measurement", tmp_path / "b", *drum, "--photo", photos[0], "--angles", "28,29")
    )
    assert "--scale: not allowed for pictures of a drum" in refused(
        explorer("new", "measurement", tmp_path / "b", *drum, "--photo", photos[0], "--scale", "0.2")
    )


def test_a_diagnosis_plans_its_pours_from_the_folder(material, tmp_path):
    """As far as the first queue: the declared model in the fitted condition alone, parameters within their ranges."""
    folder = tmp_path / "data"
    new(folder, "--material", material, "--angles", ",".join(map(str, ANGLES)))
    new(folder, "--condition", "fast", "--angles", "22,23,24", "--set", "insertion.rate=0.2")

    class Planned(Exception):
        """Nothing is poured."""

    def plan(queue, room):
        raise Planned([job.scene for job in queue])

    measurement = load_measurement(folder)
    with pytest.raises(Planned) as planned:
        run_diagnosis(measurement, Store(tmp_path / "s.sqlite"), plan, ("rolling_resistance",), Budget(), str)
    scenes = planned.value.args[0]
    assert len(scenes) >= Budget().base
    assert {value(scene, "insertion.rate") for scene in scenes} == {0.02}
    for one in measurement.parameters:
        poured = [float(value(scene, one.path)) for scene in scenes]
        assert one.low <= min(poured) < max(poured) <= one.high
    assert [one.role for one in measurement.conditions] == ["fit", "holdout"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "nothing was measured: give --photo"),
        (["--angles", "24"], "angle_of_repose_deg: one replicate has no scatter"),
        (["--angles", "24"], "(--uncertainty NAME=VALUE)"),
        (["--angles", "24,x"], "--angles 24,x: allowed: angles in degrees"),
        (["--angles", "24,95"], "above 0 and below 90"),
        (
            ["--angles", "24,1"],
            "1° is no angle of a pile; allowed: such as 24.1,25.0 or, with decimal commas, 24,1;25,0",
        ),
        (["--angles", "RADIANS:angle_rad"], "angle_rad: allowed: a column in degrees"),
        (["--balance", "RADIANS", "--balance", "RADIANS"], "is the same file as"),
        (["--scan", "SCAN", "--scan-unit", "mm"], "--scan-unit mm: SCAN states its own units"),
        (
            ["--photo", "PILE", "--angles", "24,25", "--set", "rig.name=draw_down_box"],
            "each gives angle_of_repose_deg@0",
        ),
        (["--angles", "24,25", "--lag", "1"], "--starts, --lag: allowed only with --balance"),
        (["--angles", "24,25", "--set", "pair.glass.glass.static_friction=0.4"], "a condition cannot state it"),
        (["--angles", "24,25", "--set", "rig.name=inclined_plane"], "inclined_plane"),
        (["--angles", "24,25", "--condition", "a/b"], "letters, digits"),
        (["--angles", "24,25", "--uncertainty", "colour=1"], "uncertainty.colour: no such observable"),
        (["--angles", "24,25", "--role", "holdout"], "none of 1 conditions has the role fit"),
        (["--angles", "24,25", "--study", "sunflower_extract"], "needs --study or --material"),
        (["--photo", "missing.jpg"], "missing.jpg"),
        (["--photo", "BLANK"], "blank.png: no angle: blank"),
        (["--photo", "PILE", "--photo", "PILE"], "is the same picture as"),
        (["--photo", "PILE"], "condition 'A' has no usable value"),
        (["--scan", "BLANK"], "allowed: an existing file ending in .ply"),
        (["--drum", "drum"], "--drum: the rig funnel does not give this"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_refusals_leave_nothing_behind(arguments, words, material, pictures, tmp_path):
    blank = save(tmp_path / "blank.png", np.full((200, 300), 150, dtype=np.uint8))
    (tmp_path / "rad.csv").write_text("angle_rad\n0.43\n0.44\n")
    (tmp_path / "scan.npz").write_bytes(b"none")
    there = {"BLANK": blank, "PILE": pictures[0], "RADIANS": tmp_path / "rad.csv", "SCAN": tmp_path / "scan.npz"}
    there |= {"RADIANS:angle_rad": f"{tmp_path / 'rad.csv'}:angle_rad"}
    named, words = [there.get(one, one) for one in arguments], words.replace("SCAN", str(tmp_path / "scan.npz"))
    before = files(tmp_path)
    line = refused(explorer("new", "measurement", "data", "--out", tmp_path, "--material", material, *named))
    assert words in line
    assert files(tmp_path) == before
    assert not (tmp_path / "data").exists()


def test_a_folder_with_data_changes_as_a_whole_or_not_at_all(material, tmp_path):
    folder = tmp_path / "data"
    new(folder, "--material", material, "--angles", "24,25")
    before = files(tmp_path)
    for arguments, words in (
        (["--angles", "24,25"], "--condition A: exists already"),
        (["--condition", "B", "--angles", "24"], "B.csv: angle_of_repose_deg: one replicate has no scatter"),
        (["--condition", "B", "--angles", "24,25", "--material", material], "--material: "),
        (["--condition", "B", "--angles", "24,25", "--set", "rig.outlet_height=9m"], "rig.outlet_height"),
    ):
        line = refused(explorer("new", "measurement", "data", "--out", tmp_path, *arguments))
        assert words in line
        assert str(folder) in line or words.startswith(("--", "rig"))
        assert files(tmp_path) == before
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes/a.txt").write_text("mine")
    assert "is not empty" in refused(
        explorer("new", "measurement", "notes", "--out", tmp_path, "--material", material, "--angles", "24,25")
    )
    line = refused(explorer("new", "study", "own", "--out", tmp_path, "--angles", "24,25"))
    assert line.startswith("No such option: --angles")


def test_a_file_that_bears_the_name_of_a_new_one_is_not_overwritten(material, pictures, tmp_path):
    folder = tmp_path / "data"
    new(folder, "--material", material, "--angles", "24,25")
    (folder / "images").mkdir()
    (folder / "images/B_1.png").write_bytes(b"mine")
    before = files(tmp_path)
    photos = [word for one in pictures for word in ("--photo", one)]
    line = refused(explorer("new", "measurement", folder, "--condition", "B", *photos))
    assert (
        line == f"--condition B: {folder / 'images/B_1.png'} exists already; allowed: a name whose files do not exist"
    )
    assert files(tmp_path) == before


def test_what_lies_beside_the_folder_is_found_while_a_condition_is_added(material, tmp_path):
    folder = tmp_path / "data"
    new(folder, "--material", material, "--angles", "24,25")
    (folder / "beads.toml").unlink()
    file = folder / "measurement.toml"
    file.write_text(file.read_text(encoding="utf-8").replace('"beads.toml"', '"../beads.toml"'), encoding="utf-8")
    new(folder, "--condition", "B", "--angles", "22,23", "--set", "insertion.rate=0.1")
    assert [one.name for one in load_measurement(folder).conditions] == ["A", "B"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["beads.toml", "data"]


def test_plain_data(material, tmp_path):
    found = json.loads(new(tmp_path / "data", "--material", material, "--angles", "24,25", "--json"))
    assert found["conditions"][0]["observations"][0]["values"] == [24.0, 25.0]
    assert [path.rpartition("/")[2] for path in found["written"]] == ["A.csv", "beads.toml", "measurement.toml"]
    assert found["proposal"].startswith("role: A is fitted")
    assert found["reach"]["unknowns"] == len(load_measurement(tmp_path / "data").parameters)
