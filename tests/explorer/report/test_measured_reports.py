"""Reports of bench tests, photographs, sheets of runs, their analysis and audits: one form, by one option."""

import csv
import dataclasses
import hashlib
import io
import json
import math
import re

import numpy as np
import pytest
from PIL import Image
from scipy import stats

from doe.audit import audit_study
from doe.laboratory import analyse
from doe.laboratory.analysis import TESTS
from doe.provenance import About
from explorer.audit.read_study import read_study, shipped_study
from explorer.audit.report import graded
from explorer.errors import CommandError
from explorer.photograph.annotated import THIRD
from explorer.photograph.run import drawn_sheet, measure_order, run_measure
from explorer.report.bench import bench_record, bench_report
from explorer.report.content import Figure, Picture, Table, Word
from explorer.report.folder import MANIFEST
from explorer.report.html import page
from explorer.report.photograph import outlines, photograph_report, png_within
from explorer.report.printed import drawn
from explorer.report.project import KINDS, finished_folders, part_of, project_report
from explorer.report.sources import SOURCES, cited
from solver.assets import asset_path
from tests.explorer.command_line import explorer, refused

pytestmark = pytest.mark.usefixtures("unprinted")

AUTHOR, NOTES = "Ada Example", "dry & sieved"
COMMANDS = {
    "Audit": ("audit",),
    "Photographs": ("measure", "cone_25_30", "--reference-length", 100),
    "Bench test": ("lab", "rebound", "rebound"),
    "Planned runs": ("design", "box-behnken", "--factors", "sunflower_extract", "--sigma", 0.4),
    "Design": ("analyse", "sunflower_extract"),
}
WORDS = {
    "Audit": Word.DIFFERS,
    "Photographs": Word.MEASURED,
    "Bench test": Word.MEASURED,
    "Planned runs": Word.PLANNED,
    "Design": Word.EFFECT_FOUND,
}
OUTSIDE = re.compile(r"\b[a-z]+://|\b(?:src|href)\s*=\s*[\"'](?!#|data:image/png;)")


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    """Kind → the folder of its report, made by its command."""
    root = tmp_path_factory.mktemp("reports")
    made = {}
    for kind, words in COMMANDS.items():
        made[kind] = root / kind.replace(" ", "_")
        sheet_file = ("--out", root / "runs.csv") if words[0] == "design" else ()
        answer = explorer(*words, *sheet_file, "--report", made[kind], "--author", AUTHOR, "--notes", NOTES)
        assert answer.exit_code == 0, answer.output
    return made


@pytest.fixture(params=list(COMMANDS))
def kind(request):
    return request.param


def html_of(folder):
    """The page without the library of its charts."""
    text = (folder / "report.html").read_text(encoding="utf-8")
    return re.sub(r'<script id="plotly"[^<]*</script>', "", text)


def rows_of(path):
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))


def bench(test, other=None):
    """The report of a shipped example."""
    path = asset_path("laboratory", other or test)
    return bench_report(bench_record(analyse(test, path), About(), [(test, path)]))


# The form that all have


def test_the_manifest_has_every_file_and_its_checksum_holds(places, kind):
    folder = places[kind]
    manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    files = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()} - {MANIFEST}
    assert manifest["sha256"].keys() == files
    for name, digest in manifest["sha256"].items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest
    assert {KINDS[kind][0], "report.html", "report.md", "references.bib"} < files
    assert any(name.startswith("data/") and name.endswith(".csv") for name in files)
    assert (manifest["author"], manifest["notes"]) == (AUTHOR, NOTES)
    assert manifest["verdict"].startswith(WORDS[kind])


def test_the_page_is_small_and_loads_nothing(places, kind):
    assert (places[kind] / "report.html").stat().st_size < 5e6
    assert not OUTSIDE.search(html_of(places[kind]))


def test_the_verdict_stands_first_with_author_date_and_notes(places, kind):
    text = html_of(places[kind])
    banner, first = text.index('class="banner'), text.index("<section")
    assert banner < first
    assert WORDS[kind] in text[banner:first]
    assert f"{AUTHOR}, " in text[:banner]
    assert "dry &amp; sieved" in text[:first]


def test_figures_are_numbered_say_n_and_are_there_for_print(places, kind):
    text = html_of(places[kind])
    captions = re.findall(r"<figcaption><b>Figure (\d+)\.</b> (.*?)</figcaption>", text)
    assert [int(number) for number, _ in captions] == list(range(1, len(captions) + 1))
    assert captions
    if kind != "Design":  # whose captions speak of runs where others speak of n
        assert any("n = " in words for _, words in captions)
    shown = part_of(places[kind]).report.shown
    assert len(shown) == len(captions)
    files = {path.name for path in (places[kind] / "figures").iterdir()}
    for k, (name, one) in enumerate(shown.items(), start=1):
        stem = f"figure_{k:02d}_{name}"
        ends = (".csv", *(f"_{w}mm.{e}" for w in (85, 180) for e in ("svg", "pdf"))) if isinstance(one, Figure) else ()
        assert {f"{stem}{end}" for end in ends or (".png",)} <= files


def test_the_methods_name_their_programs_and_cite_what_is_listed(places, kind):
    report = part_of(places[kind]).report
    (section,) = [one for one in report.sections if one.title == "Methods"]
    text = section.blocks[0].text
    assert "repose-explorer" in text
    assert "taichi" not in text  # nothing was simulated
    keys = {one.key for one in report.references if not one.key.startswith("software-")}
    assert keys == {key for key in SOURCES if cited(key) in text}
    entries = (places[kind] / "references.bib").read_text(encoding="utf-8")
    assert len(re.findall(r"^@\w+\{", entries, re.MULTILINE)) == len(report.references)


def test_a_folder_reports_itself_again_as_it_was(places, kind):
    assert part_of(places[kind]).kind == kind
    text = page(part_of(places[kind]).report)
    assert re.sub(r"\s", "", text) == re.sub(r"\s", "", (places[kind] / "report.html").read_text(encoding="utf-8"))


def test_all_are_joined_in_the_order_of_the_work(places):
    joined = project_report([places[kind] for kind in reversed(COMMANDS)], "Lot 7", About())
    verdicts = joined.sections[0].blocks[0]
    assert [row[0] for row in verdicts.rows] == list(COMMANDS)
    assert joined.banner.word is WORDS["Design"]  # the last stage decides, and never an audit of what others did
    assert {one.key for one in joined.references} >= {"box1960", "gum2008", "processes2022"}
    assert len(page(joined).encode()) < 5e6


def test_a_project_is_joined_as_a_whole(places, tmp_path):
    folder = tmp_path / "lot"
    assert explorer("new", "project", folder).exit_code == 0
    with pytest.raises(CommandError, match="a project without a finished result"):
        finished_folders(folder)
    (folder / "results" / "laboratory").mkdir(parents=True)
    own = (folder / "rebound", folder / "results" / "laboratory" / "measure")
    for place, kind in zip(own, ("Bench test", "Photographs"), strict=True):
        place.symlink_to(places[kind])
    assert set(finished_folders(folder)) == {places["Bench test"], places["Photographs"]}
    assert finished_folders(places["Audit"]) == [places["Audit"]]


def test_out_still_names_the_folder_of_an_audit_and_an_analysis(tmp_path):
    assert explorer("analyse", "sunflower_extract", "--out", tmp_path / "analysis").exit_code == 0
    assert (tmp_path / "analysis" / "report.html").is_file()


# Bench tests


@pytest.mark.parametrize("test", TESTS)
def test_every_bench_test_has_figures_readings_and_its_standard(test):
    report = bench(test)
    assert report.banner.word is Word.MEASURED
    assert "±" in report.banner.of
    assert any(name.startswith("replicates") for name in report.shown)
    (methods,) = [one for one in report.sections if one.title == "Methods"]
    text = methods.blocks[0].text
    assert TESTS[test].layout.standard in text
    result = analyse(test, asset_path("laboratory", test))
    assert all(one.formula in text for one in result.derived if one.name != "drop_height")
    (readings,) = [one for one in report.sections if one.title == "Readings"]
    (table,) = [block for block in readings.blocks if isinstance(block, Table)]
    assert any("[" in name for name in table.header[2:])  # a unit


def test_the_verdict_is_the_mean_with_its_interval():
    rows = rows_of_shipped("inclined_plane")
    mu = np.tan(np.radians([float(row["angle_deg"]) for row in rows if row["a"] == row["b"] == "seed"]))
    half = stats.t.ppf(0.975, mu.size - 1) * mu.std(ddof=1) / math.sqrt(mu.size)
    assert f"static friction seed–seed {mu.mean():.3f} ± {half:.3f}" in bench("inclined_plane").banner.of


def rows_of_shipped(name):
    text = asset_path("laboratory", name).read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def test_a_quantity_of_several_pairs_is_named_once():
    of = bench("rebound").banner.of
    assert of.count("restitution") == 1
    assert "seed–plate" in of


def test_readings_stand_with_their_errors_and_can_be_evaluated_again(places, tmp_path):
    (section,) = [one for one in bench("rebound").sections if one.title == "Readings"]
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    assert table.header == ("a – b", "replicate", "drop height [mm]", "rebound height [mm]")
    assert table.rows[0] == ("seed–seed", "1", "300 ± 0.5", "88 ± 0.5")
    again = analyse("rebound", places["Bench test"] / "data" / "readings_rebound.csv")
    first = analyse("rebound", asset_path("laboratory", "rebound"))
    for one, other in zip(again.derived, first.derived, strict=True):
        assert one.values == pytest.approx(other.values, rel=1e-12)
        assert one.reading.combined == pytest.approx(other.reading.combined, rel=1e-9)


def test_a_sieve_curve_has_the_masses_and_its_line_passes_632_percent_at_its_size():
    spec = bench("sieve").shown["undersize-1"].spec
    rows = [row for row in rows_of_shipped("sieve") if row["replicate"] == "1"]
    total = sum(float(row["mass_retained_g"]) for row in rows)
    points = next(trace for trace in spec["data"] if trace["name"] == "sample 1")
    for x, share in zip(points["x"], points["y"], strict=True):
        finer = sum(float(row["mass_retained_g"]) for row in rows if float(row["aperture_mm"]) < x - 1e-9)
        assert share == pytest.approx(100.0 * finer / total)
    result = analyse("sieve", asset_path("laboratory", "sieve"))
    size = next(one for one in result.derived if one.name == "rosin_rammler_size").values[0]
    line = next(trace for trace in spec["data"] if trace["name"] == "Rosin–Rammler, sample 1")
    assert np.interp(1e3 * size, line["x"], line["y"]) == pytest.approx(100.0 * (1.0 - math.exp(-1.0)), abs=0.05)


def test_what_does_not_scatter_has_no_panel():
    shown = bench("drum").shown
    titles = [
        one.get("title", {}).get("text", "")
        for figure in shown.values()
        for key, one in figure.spec["layout"].items()
        if key.startswith("xaxis")
    ]
    assert "dynamic angle [°]" in titles
    assert "froude number" not in titles  # one speed was set


def test_readings_that_are_refused_leave_no_folder(tmp_path):
    file = tmp_path / "bad.csv"
    file.write_text("a,b,replicate,angle_deg\nseed,plate,1,95\n", encoding="utf-8")
    assert "row 2, column angle_deg: '95'" in refused(
        explorer("lab", "inclined_plane", file, "--report", tmp_path / "report")
    )
    assert not (tmp_path / "report").exists()


def test_one_replicate_is_no_answer(tmp_path):
    file = tmp_path / "one.csv"
    file.write_text("a,b,replicate,angle_deg\nseed,plate,1,30\n", encoding="utf-8")
    assert explorer("lab", "inclined_plane", file, "--report", tmp_path / "report").exit_code == 0
    assert part_of(tmp_path / "report").report.banner.word is Word.NO_ANSWER
    assert "<strong>NO ANSWER</strong>" in html_of(tmp_path / "report")


def test_a_folder_without_readings_is_reported_as_well():
    """As those of an older version are."""
    path = asset_path("laboratory", "inclined_plane")
    report = bench_report(bench_record(analyse("inclined_plane", path), About(), []))
    assert "Readings" not in [one.title for one in report.sections]


# Photographs


def noise(path):
    """A picture of nothing."""
    grey = np.random.default_rng(0).normal(128.0, 10.0, (300, 400))
    Image.fromarray(grey.astype(np.uint8)).save(path)
    return path


def test_a_refused_picture_is_the_verdict(tmp_path):
    answer = explorer("measure", noise(tmp_path / "nothing.png"), "--report", tmp_path / "report")
    assert answer.exit_code == 1
    text = html_of(tmp_path / "report")
    assert re.search(r'class="banner bad"[^>]*>\s*<strong>REFUSED</strong>\s*<p>nothing.png: blank', text)
    manifest = json.loads((tmp_path / "report" / MANIFEST).read_text(encoding="utf-8"))
    assert manifest["verdict"] == "REFUSED"
    (row,) = rows_of(tmp_path / "report" / "data" / "angles.csv")
    assert row["angle_deg"] == ""
    assert row["refused"].startswith("blank")


def test_a_picture_that_is_read_beside_a_refused_one_counts(tmp_path):
    words = ("measure", "cone_25_30", noise(tmp_path / "nothing.png"), "--report", tmp_path / "report")
    assert explorer(*words).exit_code == 1
    banner = part_of(tmp_path / "report").report.banner
    assert banner.word is Word.MEASURED
    assert "1 more show none" in banner.why


def test_the_angle_of_a_picture_has_the_interval_of_reading_it(places):
    part = part_of(places["Photographs"])
    value, half = (float(one) for one in re.fullmatch(r"([\d.]+) ± ([\d.]+)°", part.report.banner.of).groups())
    assert abs(value - 27.5) <= half  # a solid of 25° and 30°
    (pile,) = part.result.piles
    assert 2.0 * math.sqrt(sum(one**2 for one in pile.parts.values())) == pytest.approx(pile.mean[1], rel=1e-6)


def test_outlines_without_a_scale_are_not_drawn_beside_those_in_millimetres(places):
    """An outline of 0.1 m would be a tenth of a pixel."""
    result = part_of(places["Photographs"]).result
    (pile,) = result.piles
    bare = dataclasses.replace(pile, name="bare", unit="px", u=tuple(1e4 * u for u in pile.u))
    spec = outlines(dataclasses.replace(result, piles=(pile, bare)))
    (trace,) = spec["data"]
    assert trace["x"] == [1e3 * u for u in pile.u]
    assert spec["layout"]["xaxis"]["title"]["text"].endswith("[mm]")
    report = photograph_report(dataclasses.replace(result, piles=(pile, bare)), None)
    assert "1 without a scale is not drawn" in str(next(one for one in report.sections if one.title == "Outlines"))
    assert outlines(dataclasses.replace(result, piles=(bare,)))["layout"]["xaxis"]["title"]["text"].endswith("[px]")


def test_the_thirds_on_a_picture_have_the_slope_of_the_solid():
    order = measure_order(["cone_25_30"], None, 100.0, None, "auto", None, None, None)
    measured = run_measure(order)
    pixels = np.asarray(drawn_sheet(order, measured, thirds=True))
    plain = np.asarray(drawn_sheet(order, measured))
    y, x = np.nonzero((pixels == THIRD).all(axis=2))
    assert not (plain == THIRD).all(axis=2).any()
    middle = 0.5 * (x.min() + x.max())
    tilt = math.degrees(math.atan(measured.piles[0].base.slope))
    for side, angle, turn in ((x < middle, 25.0, 1.0), (x > middle, 30.0, -1.0)):
        slope = np.polyfit(x[side], -y[side], 1)[0]
        assert turn * math.degrees(math.atan(slope)) + turn * tilt == pytest.approx(angle, abs=0.6)


def test_a_picture_is_made_smaller_until_it_fits():
    grey = Image.fromarray(np.random.default_rng(1).integers(0, 255, (400, 600), dtype=np.uint8))
    found = png_within(60_000, grey)
    assert len(found) <= 60_000
    with Image.open(io.BytesIO(found)) as smaller:
        assert smaller.width / smaller.height == pytest.approx(1.5, rel=0.02)


def test_pictures_of_several_folders_share_the_room_of_one_page(places):
    joined = project_report([places["Photographs"]] * 2, "", About())
    pictures = [one for one in joined.shown.values() if isinstance(one, Picture)]
    assert len(pictures) == 2
    assert sum(len(one.png) for one in pictures) <= 1_500_000


# Planned runs


def test_the_drawn_levels_are_those_of_the_sheet(places):
    report = part_of(places["Planned runs"]).report
    grid = np.array(report.shown["levels"].spec["data"][0]["z"])
    lines = (places["Planned runs"].parent / "runs.csv").read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    names = [name for name in rows[0] if name.startswith(("shear", "static", "rest"))]
    levels = np.array([[float(row[name]) for row in rows] for name in names])
    low, high = levels.min(axis=1, keepdims=True), levels.max(axis=1, keepdims=True)
    assert grid == pytest.approx(2.0 * (levels - low) / (high - low) - 1.0, abs=1e-9)
    data = rows_of(places["Planned runs"] / "data" / "runs.csv")
    assert [[row[name] for name in names] for row in data] == [[row[name] for name in names] for row in rows]


def test_a_chance_of_08_is_at_the_smallest_change_that_is_told(places):
    part = part_of(places["Planned runs"])
    spec = part.report.shown["power"].spec
    for one, trace in zip(part.result.power, spec["data"], strict=True):
        assert np.interp(one.smallest, trace["x"], trace["y"]) == pytest.approx(0.8, abs=2e-3)
    assert "0.925" in part.report.banner.why


@pytest.mark.parametrize("design", ["mixture", "lhs", "d-optimal", "plackett-burman"])
def test_every_family_of_designs_is_planned(design, tmp_path):
    file = tmp_path / "parts.toml"
    file.write_text(
        "".join(f'[[factor]]\nname = "{name}"\nlow = 0\nhigh = 100\nunit = "g"\n' for name in ("a", "b", "c")),
        encoding="utf-8",
    )
    words = ("design", design, "--factors", file, "--out", tmp_path / "runs.csv", "--report", tmp_path / "report")
    assert explorer(*words).exit_code == 0
    report = part_of(tmp_path / "report").report
    assert report.banner.word is Word.PLANNED
    assert len(rows_of(tmp_path / "report" / "data" / "runs.csv")) == int(report.banner.of.split()[0])


# Audits


def test_the_bars_hold_every_figure_once_and_are_stacked_in_print():
    audit = audit_study(read_study(shipped_study()))
    spec = graded(audit)
    assert sum(sum(trace["x"]) for trace in spec["data"]) == len(audit.figures)
    (axes,) = drawn(spec, 180).axes
    ends = {}
    for bar in axes.patches:
        row = round(bar.get_y() + 0.5 * bar.get_height())
        assert bar.get_x() == pytest.approx(ends.get(row, 0.0))
        ends[row] = bar.get_x() + bar.get_width()
    assert sorted(ends.values()) == sorted(map(sum, zip(*(trace["x"] for trace in spec["data"]), strict=True)))
