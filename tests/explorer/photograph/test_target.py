"""Photographs as a study's target: mean and spread by their formulas, a folder that is whole or not there, commands.

The pictures are rendered solids of known angles, so that what has to come out is known beforehand.
"""

import datetime
import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from doe.studies.study import load_study
from explorer.errors import CommandError
from explorer.photograph import target as kept
from explorer.photograph.run import measure_order, run_measure
from explorer.photograph.target import (
    OBSERVABLE,
    OF_ONE,
    UPRIGHT,
    TargetFile,
    keep_target,
    load_target,
    remove_target,
    shown_name,
)
from explorer.project.project import load_project, new_project, study_project
from tests.explorer.command_line import explorer, refused
from tests.solver.photograph.rendered import Look, photograph, save, solid_cover

pytestmark = pytest.mark.usefixtures("unprinted")

ANGLES = (24.0, 27.0, 30.0)
WIDTH = 700
MM = 0.5
"""Length of a pixel."""


@pytest.fixture(scope="module")
def piles(tmp_path_factory):
    """Pictures of one solid each, with flanks of ``ANGLES``."""
    folder = tmp_path_factory.mktemp("piles")
    return [
        save(folder / f"pile {k}.png", photograph(solid_cover(angle, angle, 110), Look(width=WIDTH, seed=k)))
        for k, angle in enumerate(ANGLES, start=1)
    ]


@pytest.fixture(scope="module")
def blank(tmp_path_factory):
    return save(tmp_path_factory.mktemp("blank") / "blank.png", np.full((200, 300), 150, dtype=np.uint8))


def keep(folder, *pictures, anew=False, mm=MM):
    order = measure_order([str(one) for one in pictures], mm, None, None, "auto", None, None, None)
    return keep_target(folder, order.pictures, run_measure(order), anew)


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()} if folder.is_dir() else {}


def test_several_photographs_are_a_mean_and_the_spread_between_piles(piles, tmp_path):
    keep(tmp_path / "target", piles[0])
    keep(tmp_path / "target", piles[1])
    target = keep(tmp_path / "target", piles[2])
    # Of 24, 27 and 30: mean 27, SD 3, standard error 3/√3; each is read to a tenth of a degree.
    assert target.n == 3
    assert target.mean == pytest.approx(27.0, abs=0.15)
    assert target.sd == pytest.approx(3.0, abs=0.2)
    read = [pile.mean[0] for pile in target.result.piles]
    assert target.mean == pytest.approx(sum(read) / 3)
    assert target.sd == pytest.approx(math.sqrt(sum((one - target.mean) ** 2 for one in read) / 2))
    assert target.names == ("pile_1.png", "pile_2.png", "pile_3.png")
    assert f"standard error of the mean {target.sd / math.sqrt(3):.2f}°" in target.line
    assert "standard deviation between piles" in target.line
    assert target.short == f"{target.mean:.1f}° (standard deviation {target.sd:.1f}°) · 3 photographs"
    study = load_study("sunflower_extract")
    own = study.targets[0]
    (first, *rest) = target.of_study(study.targets)
    assert (first.mean, first.sd, first.n, first.sd_source) == (target.mean, target.sd, 3, "measured")
    assert (first.margin, first.weight, rest) == (own.margin, own.weight, list(study.targets[1:]))
    assert first.standard_error == pytest.approx(target.sd / math.sqrt(3))


def test_one_photograph_says_that_it_knows_no_spread_between_piles(piles, tmp_path):
    target = keep(tmp_path / "target", piles[1])
    order = measure_order([str(piles[1])], MM, None, None, "auto", None, None, None)
    (read,) = run_measure(order).piles
    assert target.mean == pytest.approx(27.0, abs=0.15)
    assert target.sd == pytest.approx(read.angles.mean.error_deg)  # one standard error, not the 95 % of the reading
    assert "One photograph: how piles differ among each other is in neither." in target.line
    # Flanks that differ say something of it.
    left, right = (f"{one.value_deg:.2f}°" for one in (read.angles.left, read.angles.right))
    assert target.line.endswith(f"Its flanks: {left} and {right}.")
    (first,) = target.of_study(load_study("sunflower_extract").targets)
    assert (first.n, first.sd_source) == (None, OF_ONE)


def test_a_study_of_another_observable_takes_no_photograph(piles, tmp_path):
    target = keep(tmp_path / "target", piles[0])
    other = [replace(one, observable="bulk_density_kg_m3") for one in load_study("sunflower_extract").targets]
    with pytest.raises(CommandError, match=f"a photograph gives {OBSERVABLE}, but the study's target is bulk_density"):
        target.of_study(other)


def test_a_target_is_there_again_and_goes_without_a_trace(piles, tmp_path):
    folder = tmp_path / "target"
    target = keep(folder, piles[0], piles[1])
    assert load_target(folder) == target
    assert sorted(content for name, content in files(folder).items() if name.endswith(".png")) == sorted(
        one.read_bytes() for one in piles[:2]
    )
    follower = TargetFile(folder)
    assert follower.now == target
    anew = keep(folder, piles[2], anew=True)
    assert follower.now == anew
    assert (anew.n, len(files(folder))) == (1, 3)
    (folder / "notes.txt").write_text("mine")
    remove_target(folder)
    assert (follower.now, list(files(folder))) == (None, ["notes.txt"])
    with pytest.raises(CommandError, match="the study's own; there is none to remove"):
        remove_target(folder)
    keep(folder, piles[2])
    (folder / "notes.txt").unlink()
    remove_target(folder)
    assert not folder.exists()


def test_what_cannot_be_added_changes_nothing(piles, blank, tmp_path):
    folder = tmp_path / "target"
    with pytest.raises(CommandError, match=r"blank\.png: no angle: blank"):
        keep(folder, piles[0], blank)
    assert not folder.exists()
    keep(folder, piles[0])
    before = files(folder)
    for pictures, line in (
        ((piles[0],), r"pile_1\.png: is in the target already"),
        ((piles[1], piles[1]), "is the same"),
    ):
        with pytest.raises(CommandError, match=line):
            keep(folder, *pictures)
    assert files(folder) == before


def test_a_disk_that_fails_leaves_the_target_of_before(piles, tmp_path, monkeypatch):
    folder = tmp_path / "target"
    target = keep(folder, piles[0])

    def full(path, text):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(kept, "write_whole", full)
    for anew in (True, False):
        with pytest.raises(OSError, match="No space"):
            keep(folder, piles[1], anew=anew)
        assert load_target(folder) == target
        assert target.backdrop is not None


def test_a_damaged_target_is_told_replaced_and_removed(piles, tmp_path):
    keep(tmp_path, piles[0])
    (tmp_path / "photograph.json").write_text('{"schema": 1, "piles": ')
    assert TargetFile(tmp_path).now is None
    with pytest.raises(CommandError, match=r"photograph\.json"):
        load_target(tmp_path)
    assert keep(tmp_path, piles[1], anew=True).n == 1
    (tmp_path / "photograph.json").write_text("{}")
    remove_target(tmp_path)
    assert load_target(tmp_path) is None


@pytest.mark.parametrize("tilt", [0.0, 3.0])
def test_the_upright_picture_stands_on_the_axes_of_its_outline(tilt, tmp_path):
    """Its darkest edge is the outline, and a solid of 25° left and 30° right has these slopes in it."""
    look = Look(width=WIDTH, tilt_deg=tilt, noise=0.5)
    target = keep(tmp_path / "t", save(tmp_path / "pile.png", photograph(solid_cover(25, 30, 110), look)))
    (pile,) = target.result.piles
    behind = target.backdrop
    content = (target.folder / (pile.name + UPRIGHT)).read_bytes()
    grey = np.asarray(Image.open(io.BytesIO(content)), dtype=float)
    rows, columns = grey.shape
    pixel = (behind.right - behind.left) / columns
    assert (behind.high - behind.low) / rows == pytest.approx(pixel, rel=0.01)
    u = behind.left + pixel * (np.arange(columns) + 0.5)
    edge = behind.high - pixel * np.argmax(grey < 0.5 * (look.pile + look.backdrop), axis=0)
    flank = np.abs(u) < 0.8 * pile.half_width
    assert np.abs(edge - np.interp(u, pile.u, pile.z))[flank].max() < 2.5 * pixel
    top = u[flank][np.argmax(edge[flank])]
    for degrees, side in ((25.0, flank & (u < top)), (-30.0, flank & (u > top))):
        assert math.degrees(math.atan(np.polyfit(u[side], edge[side], 1)[0])) == pytest.approx(degrees, abs=0.5)


def test_without_a_scale_there_is_an_angle_and_no_outline(piles, tmp_path):
    target = keep(tmp_path, piles[0], mm=None)
    assert (target.outlines, target.backdrop) == ({}, None)
    assert target.mean == pytest.approx(24.0, abs=0.15)


def test_a_copy_has_the_numbers_and_the_upright_pictures(piles, tmp_path):
    target = keep(tmp_path / "target", piles[0])
    target.copied(tmp_path / "copy")
    copy = load_target(tmp_path / "copy")
    assert (copy.result, copy.backdrop, copy.outlines) == (target.result, target.backdrop, target.outlines)
    assert set(files(tmp_path / "copy")) == {target.result.piles[0].name + UPRIGHT, "photograph.json"}


@pytest.mark.parametrize(
    ("name", "shown"),
    [("pile-0123456789ab.jpg", "pile.jpg"), ("pile-2.jpg", "pile-2.jpg"), ("pile.jpg", "pile.jpg")],
)
def test_a_kept_picture_is_called_as_it_came(name, shown):
    assert shown_name(name) == shown


def test_a_name_that_ends_like_a_digest_stays_whole(piles, tmp_path):
    """Cameras name pictures by their moment: twelve digits, which are a digest's as well."""
    named = tmp_path / "IMG-202611241530.png"
    named.write_bytes(piles[0].read_bytes())
    assert keep(tmp_path / "target", named).names == (named.name,)
    assert load_target(tmp_path / "target").names == (named.name,)
    (twice,) = (one for one in (tmp_path / "target").iterdir() if one.suffix == ".png")
    assert keep(tmp_path / "again", twice).names == (named.name,)  # a kept picture is given no second digest
    assert explorer("measure", named, "--report", tmp_path / "report").exit_code == 0
    assert load_target(tmp_path / "report").names == (named.name,)
    line = refused(explorer("measure", piles[1], "--target", tmp_path / "report"))
    assert "is a report of photographs" in line


def test_a_record_from_elsewhere_takes_no_file_away(piles, tmp_path):
    victim = tmp_path / "victim-0123456789ab.png"
    victim.write_text("mine")
    keep(tmp_path / "target", piles[0])
    record = tmp_path / "target" / "photograph.json"
    content = json.loads(record.read_text())
    content["piles"][0]["name"] = "../victim-0123456789ab.png"
    record.write_text(json.dumps(content))
    remove_target(tmp_path / "target")
    assert victim.read_text() == "mine"


def test_measure_keeps_a_target_that_grows(piles, blank, tmp_path):
    folder = tmp_path / "lentil" / "target"
    first = explorer("measure", piles[0], "--scale", MM, "--target", folder)
    assert first.exit_code == 0, first.output
    assert "One photograph" in first.stdout
    second = explorer("measure", piles[1], piles[2], "--scale", MM, "--target", folder, "--json")
    assert "n = 3" in second.stderr
    assert len(json.loads(second.stdout)["pictures"]) == 2
    assert load_target(folder).n == 3
    plot = tmp_path / "plot.png"
    assert "already" in refused(explorer("measure", piles[1], "--target", folder, "--plot", plot))
    assert not plot.exists()
    lost = explorer("measure", blank, "--target", folder)
    assert (lost.exit_code, load_target(folder).n) == (1, 3)
    assert lost.stderr.splitlines()[-1] == f"--target {folder}: nothing is written while a picture has no angle"


def test_a_report_of_photographs_is_a_target_as_well(piles, tmp_path):
    assert explorer("measure", *piles, "--scale", MM, "--report", tmp_path / "report").exit_code == 0
    assert load_target(tmp_path / "report").n == 3
    line = refused(explorer("measure", piles[0], "--scale", MM, "--target", tmp_path / "report"))
    assert "is a report of photographs" in line
    assert load_target(tmp_path / "report").n == 3


def test_calibrate_refuses_a_folder_without_photographs(tmp_path):
    line = refused(explorer("calibrate", "--headless", "--out", tmp_path / "out", "--target", tmp_path / "none"))
    assert "holds no photograph.json; `explorer measure PHOTO --target" in line
    assert not (tmp_path / "out").exists()


def test_a_project_has_a_place_for_its_target(tmp_path):
    new_project(tmp_path / "lentil")
    assert load_project(tmp_path / "lentil").target == tmp_path / "lentil" / "target"
    # Two studies of one name share the user's folder of results.
    new_project(tmp_path / "a" / "lentil")
    studies = [folder / "lentil" / "lentil_study.toml" for folder in (tmp_path, tmp_path / "a")]
    assert len({study_project(str(study)).target for study in studies}) == 2


def test_photographs_go_into_a_study_file(piles, tmp_path):
    """Mean and standard deviation are numpy's of the angles that `measure` reads; the rest of the file stays."""
    assert explorer("new", "study", "lentil", "--out", tmp_path).exit_code == 0
    file = tmp_path / "lentil_study.toml"
    before, study = file.read_text(encoding="utf-8"), load_study(str(file))
    result = explorer("measure", *piles, "--target", file, "--json")
    assert result.exit_code == 0, result.output
    means = [one["angles"]["mean"]["value_deg"] for one in json.loads(result.stdout)["pictures"]]
    again = load_study(str(file))
    (target,) = again.targets
    assert (target.mean, target.sd) == pytest.approx((np.mean(means), np.std(means, ddof=1)), abs=6e-5)
    assert (target.n, target.sd_source, target.margin) == (3, "measured", study.targets[0].margin)
    assert replace(again, targets=study.targets) == study
    (note,) = [line for line in file.read_text(encoding="utf-8").splitlines() if line.startswith("# photographs: ")]
    assert all(path.name in note for path in piles)
    assert datetime.date.today().isoformat() in note
    assert "between the 3 photographs" in note
    assert "n = 3" in result.stderr
    comments = [line.partition("#")[2] for line in before.splitlines()]
    assert comments == [
        line.partition("#")[2] for line in file.read_text(encoding="utf-8").splitlines() if line != note
    ]


def test_one_photograph_gives_a_study_no_number_of_piles(piles, tmp_path):
    assert explorer("new", "study", "lentil", "--out", tmp_path).exit_code == 0
    file = tmp_path / "lentil_study.toml"
    result = explorer("measure", piles[0], "--target", file)
    assert result.exit_code == 0, result.output
    assert "how piles differ among each other is in neither" in result.stdout
    (target,) = load_study(str(file)).targets
    assert (target.n, target.sd_source, target.standard_error) == (None, OF_ONE, 0.0)


def test_a_study_that_does_not_fit_stays_as_it_was(piles, blank, tmp_path):
    assert explorer("new", "study", "lentil", "--out", tmp_path).exit_code == 0
    file = tmp_path / "lentil_study.toml"
    before = file.read_text(encoding="utf-8")
    assert "is the same picture as" in refused(explorer("measure", piles[0], piles[0], "--target", file))
    unread = explorer("measure", piles[0], blank, "--target", file)
    assert (unread.exit_code, unread.stderr.split(":")[0]) == (1, "blank.png")
    assert file.read_text(encoding="utf-8") == before
    assert "no such study" in refused(explorer("measure", piles[0], "--target", tmp_path / "other.toml"))
    assert "is a material, not a study" in refused(explorer("measure", piles[0], "--target", tmp_path / "lentil.toml"))
    (tmp_path / "S2.TOML").write_bytes(file.read_bytes())
    assert explorer("measure", *piles, "--target", tmp_path / "S2.TOML").exit_code == 0
    assert load_study(str(tmp_path / "S2.TOML")).targets[0].n == 3
    (tmp_path / "S2.TOML").unlink()
    file.write_text(before.replace('"angle_of_repose_deg"', '"apex_height_m"'), encoding="utf-8")
    line = refused(explorer("measure", piles[0], "--target", file))
    assert line == "a photograph gives angle_of_repose_deg, but the study's target is apex_height_m"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lentil.toml", "lentil_study.toml"]
