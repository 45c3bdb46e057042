"""`explorer measure`: shipped pictures, scale, plain data, the plot, a simulation beside, refusals."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from explorer.files.measured_curves import measured_file
from explorer.photograph.run import measure_order, run_measure
from explorer.photograph.target import load_target
from solver.assets import measurement_folder, shipped_assets
from solver.observables.silhouette import largest_part, silhouette
from solver.photograph.lens import straight
from solver.pours.record import Spheres
from tests.explorer.command_line import explorer, refused
from tests.solver.photograph.rendered import Look, fitted, photograph, save, solid_cover
from tests.solver.photograph.staged import Stage, staged
from tests.solver.photograph.test_checkerboard import LOOK
from tests.solver.photograph.test_checkerboard import board as checkerboard

SMALL = Look(width=500)


@pytest.fixture(scope="module")
def pile(tmp_path_factory):
    """A small picture of a solid of 25° and 30°, 90 px high."""
    return save(tmp_path_factory.mktemp("pile") / "pile.png", photograph(solid_cover(25, 30, 90), SMALL))


@pytest.fixture(scope="module")
def blank(tmp_path_factory):
    return save(tmp_path_factory.mktemp("blank") / "blank.png", np.full((200, 300), 150, dtype=np.uint8))


def data(result):
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_the_shipped_cone_by_its_name_and_its_bar():
    (picture,) = data(explorer("measure", "cone_25_30", "--reference-length", 100, "--json"))["pictures"]
    # 0.5°: what is promised for smooth solids. The bar is 100 mm long, the cone 200 px of 0.2 mm high.
    assert picture["angles"]["left"]["value_deg"] == pytest.approx(25.0, abs=0.5)
    assert picture["angles"]["right"]["value_deg"] == pytest.approx(30.0, abs=0.5)
    assert picture["length_of_pixel"] == pytest.approx(0.2, rel=0.005)
    assert (picture["height"], picture["length_unit"]) == (pytest.approx(40.0, abs=0.5), "mm")
    assert picture["half_width"] == pytest.approx(20.0 * sum(1 / np.tan(np.radians([25, 30]))), rel=0.01)
    low, high = picture["angles"]["mean"]["interval_deg"]
    assert low < 27.5 < high
    assert max(picture["profile"]["height"]) <= picture["height"]
    assert len(picture["profile"]["x"]) == len(picture["profile"]["height"]) <= 400


def test_a_shipped_pile_of_bodies_beside_its_scan():
    scan = measurement_folder("trefoil_2") / "piles/fit_1.npz"
    found = data(explorer("measure", "trefoil_2_fit_1", "--scale", 0.2, "--from-simulation", scan, "--json"))
    with np.load(scan) as arrays:
        spheres = Spheres(arrays["xyz"], arrays["radius"], arrays["body"])
    truth = fitted(largest_part(silhouette(spheres, 0.0, 0.1e-3)))
    angles = found["pictures"][0]["angles"]
    for side, true in zip(("left", "right"), truth, strict=True):
        assert angles[side]["value_deg"] == pytest.approx(true, abs=0.5)
    assert found["pictures"][0]["base_line"]["found_by"] == "plate"
    assert found["simulation"]["views"] == 12
    assert found["simulation"]["height_mm"]["mean"] == pytest.approx(found["pictures"][0]["height"], rel=0.02)


def test_the_shipped_pictures_are_listed_and_small():
    assert shipped_assets("photographs") == ("cone_25_30", "trefoil_2_fit_1", "trefoil_2_fit_5")


def test_the_table_plot_and_outline(pile, tmp_path):
    plot, outline = tmp_path / "plot.png", tmp_path / "outline.csv"
    result = explorer("measure", pile, "--scale", 0.5, "--plot", plot, "--outline", outline)
    assert result.exit_code == 0, result.output
    head, row, *_ = result.stdout.splitlines()
    assert head.split()[:3] == ["picture", "left", "°"]
    assert row.startswith("pile.png")
    assert " mm " in row
    with Image.open(plot) as image:
        colours = {colour for _, colour in image.convert("RGB").getcolors(1 << 24)}
    assert {(230, 159, 0), (86, 180, 233), (255, 255, 255)} <= colours  # flanks, base line, outline
    # The page takes the outline in: u over the middle of the pile, 45 mm high.
    curve = measured_file("outline.csv", outline.read_bytes())
    assert curve.z.max() == pytest.approx(0.045, abs=0.001)
    rows = list(csv.reader(outline.read_text(encoding="utf-8").splitlines()[1:]))
    assert rows[0] == ["u_m", "z_m"]


def test_several_pictures_give_a_mean_over_them(pile, tmp_path):
    other = save(tmp_path / "other.png", photograph(solid_cover(29, 32, 90), SMALL))
    over = data(explorer("measure", pile, other, "--json"))["over_pictures"]
    assert over["n"] == 2
    assert over["mean_deg"] == pytest.approx((27.5 + 30.5) / 2, abs=0.5)
    assert over["sd_deg"] == pytest.approx(3.0 / 2**0.5, abs=0.3)
    low, high = over["interval_deg"]
    assert high - low == pytest.approx(2 * 12.706 * over["sd_deg"] / 2**0.5, rel=1e-3)  # t of 1 degree of freedom


def test_a_picture_without_a_pile_is_named_and_the_others_are_measured(pile, blank):
    result = explorer("measure", pile, blank, "--json")
    assert result.exit_code == 1
    first, second = json.loads(result.stdout)["pictures"]
    assert first["pile"]
    assert (second["pile"], second["reason"]) == (False, "blank")
    assert result.stderr.startswith("blank.png: no angle: blank: ")
    assert len(result.stderr.splitlines()) == 1


def test_no_picture_with_a_pile(blank, tmp_path):
    plot = tmp_path / "plot.png"
    result = explorer("measure", blank, "--plot", plot, "--reference-length", 10)
    assert result.exit_code == 1
    assert "no reference length" in result.stderr
    assert plot.is_file()


def test_a_stated_reference_and_base_line(pile):
    y = SMALL.base * round(0.62 * SMALL.width)
    (picture,) = data(
        explorer(
            "measure", pile, "--reference-length", 50, "--reference", "0,0,300,400", "--baseline", f"{y},{y}", "--json"
        )
    )["pictures"]
    assert picture["length_of_pixel"] == pytest.approx(0.1)
    assert picture["base_line"]["found_by"] == "given"
    assert picture["height"] == pytest.approx(9.0, abs=0.2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.png"], ["missing.png", "cone_25_30"]),
        (["PILE", "--scale", "0"], ["--scale", "positive"]),
        (["PILE", "--scale", "nan"], ["--scale"]),
        (["PILE", "--scale", "1", "--reference-length", "3"], ["--scale", "--reference-length", "exclude"]),
        (["PILE", "--reference", "1,2,3,4"], ["--reference-length"]),
        (["PILE", "--reference-length", "3", "--reference", "1,2,3"], ["x0,y0,x1,y1"]),
        (["PILE", "--reference-length", "3", "--reference", "1,2,1,2"], ["less than 2 px"]),
        (["PILE", "--baseline", "level"], ["--baseline level", "auto or y0,y1"]),
        (["PILE", "--baseline", "1,inf"], ["--baseline"]),
        (["PILE", "--plot", "plot.jpg"], [".png"]),
        (["PILE", "--plot", "no/folder/plot.png"], ["no folder"]),
        (["PILE", "--outline", "outline.csv"], ["--scale"]),
        (["PILE", "--notes", "n"], ["--notes", "--report"]),
        (["PILE", "PILE"], ["is the same picture as"]),
        (["PILE", "--from-simulation", "nothing.npz"], ["nothing.npz", "no such file"]),
        (["TEXT"], ["not a picture"]),
        ([], ["PHOTO"]),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_refusals_in_one_line_with_exit_code_2(arguments, words, pile, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.jpg").write_text("not a picture")
    named = [{"PILE": str(pile), "TEXT": "text.jpg"}.get(one, one) for one in arguments]
    line = refused(explorer("measure", *named))
    assert all(word in line for word in words), line
    assert [path.name for path in tmp_path.iterdir()] == ["text.jpg"]


def test_one_pile_in_two_formats_is_refused_and_two_of_one_name_are_told_apart(pile, tmp_path):
    with Image.open(pile) as image:
        image.save(tmp_path / "pile.tif")
    assert "is the same picture as" in refused(explorer("measure", pile, tmp_path / "pile.tif"))
    other = tmp_path / "pour 2" / "pile.png"
    other.parent.mkdir()
    save(other, photograph(solid_cover(29, 32, 90), SMALL))
    report = tmp_path / "report"
    found = data(explorer("measure", pile, other, "--json", "--report", report))
    assert [one["picture"] for one in found["pictures"]] == [str(pile), str(other)]
    assert str(other) in (report / "data" / "angles.csv").read_text(encoding="utf-8")


def test_a_report_says_what_told_the_scale(pile, tmp_path):
    words = {
        ("--scale", "0.5"): "A pixel is 0.5 mm (as stated).",
        ("--reference-length", "50", "--reference", "0,0,300,400"): (
            "A pixel is 0.1 mm (by 50 mm between stated places)."
        ),
    }
    for k, (options, text) in enumerate(words.items()):
        assert explorer("measure", pile, *options, "--report", tmp_path / f"{k}").exit_code == 0
        assert text in (tmp_path / f"{k}" / "report.md").read_text(encoding="utf-8")


def test_the_base_line_in_a_report_is_on_the_picture_as_it_is_seen(tmp_path):
    """A plate at y = c in the straight copy is seen at c (1 + k r²) from the middle at the edges of the picture."""
    bent_pile = save(tmp_path / "pile.png", staged(Stage(30.0, fill=0.6, lens=0.1), replace(LOOK, base=0.9)))
    board = save(tmp_path / "board.png", checkerboard(0.1))
    order = measure_order([str(bent_pile)], None, None, None, "auto", None, None, None, str(board))
    (pile,) = run_measure(order).piles
    columns, rows = pile.size
    middle, half = 0.5 * (np.array([columns, rows]) - 1), 0.5 * np.hypot(columns, rows)
    for x, y in zip((0.0, columns - 1.0), pile.base_ends, strict=True):
        u, v = straight((x - middle[0]) / half, (y - middle[1]) / half, pile.lens)
        found = pile.base.at(u * half + middle[0])
        assert v * half + middle[1] == pytest.approx(found, abs=0.05)
    drawn = [pile.as_seen(np.array([x]), pile.base.at(np.array([x])))[1][0] for x in (0.0, columns - 1.0)]
    assert np.abs(np.array(pile.base_ends) - drawn).max() > 0.2  # the copy's edges are elsewhere


def test_a_stated_base_line_says_that_the_lens_stays(pile):
    y = SMALL.base * round(0.62 * SMALL.width)
    assert "tells no distortion of the lens" in explorer("measure", pile, "--baseline", f"{y},{y}").stdout


def test_many_pictures_are_not_all_kept_in_memory(tmp_path, monkeypatch):
    """Those beyond the first few are decoded again, with the same result."""
    names = [
        str(save(tmp_path / f"{k}.png", photograph(solid_cover(25 + k, 30, 90), replace(SMALL, seed=k))))
        for k in range(3)
    ]
    order = measure_order(names, None, None, None, "auto", None, None, None)
    whole = run_measure(order)
    monkeypatch.setattr("explorer.photograph.run.MOST_DECODED", 1)
    assert [one.angles for one in run_measure(order).piles] == [one.angles for one in whole.piles]


def test_a_scan_that_is_no_pile_is_refused(pile, tmp_path):
    flat = tmp_path / "flat.npz"
    np.savez(flat, xyz=np.array([[0.0, 0.0, 1e-3]]), radius=np.array([1e-3]), body=np.array([0]))
    line = refused(explorer("measure", pile, "--from-simulation", flat))
    assert "none of its views has two flanks" in line


def test_a_checkerboard_takes_the_lens_out(tmp_path):
    board = save(tmp_path / "board.png", checkerboard(0.1))
    bent_pile = save(tmp_path / "pile.png", staged(Stage(30.0, fill=0.8, lens=0.1), replace(LOOK, tilt_deg=3.0)))
    found = data(explorer("measure", bent_pile, "--checkerboard", board, "--json"))
    assert found["checkerboard"]["lens_k"] == pytest.approx(0.1, abs=0.003)
    assert found["checkerboard"]["corners"] == 48
    for side in ("left", "right"):
        assert found["pictures"][0]["angles"][side]["value_deg"] == pytest.approx(30.0, abs=0.5)
    text = explorer("measure", bent_pile, "--checkerboard", board).stdout
    assert "checkerboard board.png: 48 corners, k = +0." in text
    assert "bends the base line" not in text
    kept = explorer("measure", bent_pile, "--checkerboard", board, "--target", tmp_path / "target")
    assert kept.exit_code == 0, kept.output
    target = load_target(tmp_path / "target")
    assert target.mean == found["pictures"][0]["angles"]["mean"]["value_deg"]
    assert (target.result.piles[0].checkerboard, target.result.piles[0].lens) == (
        "board.png",
        found["checkerboard"]["lens_k"],
    )
    alone = data(explorer("measure", bent_pile, "--json"))
    assert "checkerboard" not in alone
    assert abs(alone["pictures"][0]["angles"]["left"]["value_deg"] - 30.0) > 0.5


def test_no_checkerboard_in_one_line(pile, blank, tmp_path):
    assert "blank.png: no checkerboard: 0 corners of a grid" in refused(
        explorer("measure", pile, "--checkerboard", blank)
    )
    board = save(tmp_path / "board.png", checkerboard(0.0)[:300])
    line = refused(explorer("measure", pile, "--checkerboard", board))
    assert "checkerboard board.png: " in line
    assert "whole pictures of one camera" in line


def test_a_picture_that_stands_twice_is_refused_under_whatever_name(pile, tmp_path):
    """Two readings of one pile would count as n = 2."""
    copy = tmp_path / "copy.png"
    copy.write_bytes(pile.read_bytes())
    for twin in (pile, copy):
        line = refused(explorer("measure", pile, twin))
        assert line == f"{twin}: is the same picture as {pile}; name each pile once"
