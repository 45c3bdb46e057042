"""The folder of a report: checksums, data, figures for print, methods, set-up, verdicts, and joined reports."""

import csv
import dataclasses
import hashlib
import io
import json
import re
import subprocess
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from doe.analysis.verification import verify
from doe.provenance import About
from doe.stages.surface import CONTRADICTION
from explorer.design.analysis import AnalyseOrder, run_analyse
from explorer.errors import CommandError
from explorer.report import folder, study_report
from explorer.report.content import Caution, DataTable, Drawing, Figure, Strong, Struck, Table, Word
from explorer.report.data import study_data
from explorer.report.design import design_report
from explorer.report.diagnosis import diagnosis_report
from explorer.report.figures.style import axis, chart
from explorer.report.folder import MANIFEST, NO_FIGURES, bibtex, write_report
from explorer.report.html import page
from explorer.report.printed import INCH, WIDTHS, drawn, figure_data, printed
from explorer.report.project import project_report
from explorer.report.set_up import material_tables, rig_drawing, set_up_of
from explorer.report.sources import SOURCES, cited
from solver import load_material
from solver.rigs import RIGS
from solver.scenes.scene import with_rig
from tests.explorer import diagnosed, reported_studies
from tests.explorer.command_line import explorer, refused

ABOUT = About("Ada Example", "2026-11-26", "dry & sieved")


@pytest.fixture(scope="module")
def study():
    return dataclasses.replace(reported_studies.typed(reported_studies.result_of_case("planted")), about=ABOUT)


@pytest.fixture(scope="module")
def place(study, tmp_path_factory):
    """The folder of a study, with two of its figures."""
    made = tmp_path_factory.mktemp("study")
    report = study_report(study)
    kept = {"set-up", "verification-1", "contours-1"}
    sections = tuple(
        dataclasses.replace(s, blocks=tuple(b for b in s.blocks if getattr(b, "name", "set-up") in kept))
        for s in report.sections
    )
    text = json.dumps(study.to_dict(), allow_nan=False) + "\n"
    assert write_report(dataclasses.replace(report, sections=sections), made, {"result.json": text}) == ""
    return made


@pytest.fixture(scope="module")
def specs(study):
    """Name → chart, of every kind of report."""
    reports = (
        study_report(study),
        design_report(run_analyse(AnalyseOrder("sunflower_extract", target=24.68))),
        diagnosis_report(diagnosed.typed(diagnosed.result_of_case("ambiguous"))),
    )
    return {
        f"{k}-{name}": one.spec
        for k, report in enumerate(reports)
        for name, one in report.shown.items()
        if isinstance(one, Figure)
    }


def rows_of(path):
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))


def test_the_manifest_has_the_checksum_of_every_file_and_says_whose_it_is(place):
    manifest = json.loads((place / MANIFEST).read_text(encoding="utf-8"))
    files = {str(path.relative_to(place)) for path in place.rglob("*") if path.is_file()} - {MANIFEST}
    assert manifest["sha256"].keys() == files
    assert {"result.json", "report.html", "data/runs.csv", "references.bib"} < files
    for name, digest in manifest["sha256"].items():
        assert hashlib.sha256((place / name).read_bytes()).hexdigest() == digest
    assert (manifest["author"], manifest["date"], manifest["notes"]) == tuple(vars(ABOUT).values())
    assert manifest["verdict"].startswith(Word.CALIBRATED)
    assert manifest["versions"]["repose-explorer"]


def test_every_run_is_in_the_table_with_its_setting(study, place):
    rows = rows_of(place / "data/runs.csv")
    assert len(rows) == study.runs.total
    assert [row["key"] for row in rows] == [run.key for run in study.runs.list]
    observable = study.study.targets[0].observable
    poured = [float(row[observable]) for row in rows if row["stage"] == "verification" and row["outcome"] == "at_rest"]
    assert np.mean(poured) == pytest.approx(study.verification.tests[0].simulated.mean)
    # Every verification pour is one of the optimum.
    for path, value in study.optimum.values.items():
        assert {float(row[path]) for row in rows if row["stage"] == "verification"} == {value}


def test_parameters_say_their_unit_and_where_they_come_from(study, place):
    rows = {row["path"]: row for row in rows_of(place / "data/parameters.csv")}
    assert rows["material.seed.density"]["unit"] == "kg/m3"
    assert float(rows["material.seed.density"]["value"]) == study.set_up.values["material.seed.density"]
    assert rows["material.seed.density"]["origin"] == "stated"
    # The file declares a Young's modulus and marks it as assumed; the scene holds the shear modulus.
    assert rows["material.rigid_sieve_plate.shear_modulus"]["origin"] == "assumed"
    assert rows["numerics.rayleigh_fraction"]["origin"] == "setting"
    calibrated = {path for path, row in rows.items() if row["at_optimum"]}
    assert calibrated == set(study.optimum.values)
    single = study.optimum.single
    for k, factor in enumerate(study.optimum.factors):
        row = rows[factor.path]
        assert row["identified"] == "no"
        assert float(row["low"]) == single.solution_low[k]  # the range that gives the target, not the set of the pick


def test_parameters_of_several_targets_are_those_of_all_of_them():
    result = reported_studies.typed(reported_studies.result_of_case("two targets"))
    table = next(one for one in study_data(result) if one.name == "parameters")
    rows = {row[0]: row[-4:] for row in table.rows}
    assert result.optimum.compromise is not None
    for path, one in result.optimum.estimates.items():
        assert rows[path] == (one.value, one.low, one.high, "yes" if one.identified else "no")
    single = result.optimum.single
    firsts = [(single.solution_low[k], single.solution_high[k]) for k in range(len(result.optimum.factors))]
    assert [rows[factor.path][1:3] for factor in result.optimum.factors] != firsts


def test_the_anova_file_adds_up(place):
    rows = {row["source"]: row for row in rows_of(place / "data/anova.csv")}
    parts = sum(float(rows[name]["sum_of_squares"]) for name in ("model", "residual"))
    assert parts == pytest.approx(float(rows["total"]["sum_of_squares"]))
    assert int(rows["model"]["df"]) + int(rows["residual"]["df"]) == int(rows["total"]["df"])


def test_a_missing_number_is_an_empty_cell():
    assert folder.csv_text(DataTable("t", ("a", "b"), ((float("nan"), None), (1.5, "x")))) == "a,b\n,\n1.5,x\n"


# Figures for print


@pytest.mark.slow
def test_every_chart_can_be_printed_at_both_widths_without_loss(specs):
    for name, spec in specs.items():
        for width in WIDTHS:
            figure = drawn(spec, width)
            figure.draw_without_rendering()
            assert figure.get_size_inches()[0] == pytest.approx(width * INCH), name
            for axes in figure.axes:
                box = axes.get_tightbbox()
                # Within the figure, up to half a millimetre.
                assert box.x0 > -2.0, (name, width)
                assert box.x1 < figure.bbox.width + 2.0, (name, width)
                assert box.y0 > -2.0, (name, width)


def test_print_has_the_points_of_the_page(specs):
    spec = specs["0-verification-1"]
    pours = next(trace for trace in spec["data"] if trace["name"] == "fresh pours")
    (axes,) = drawn(spec, 85).axes
    offsets = [np.asarray(one.get_offsets()) for one in axes.collections]
    expected = np.column_stack([pours["x"], pours["y"]])
    assert any(one.shape == expected.shape and np.allclose(one, expected) for one in offsets)
    written = figure_data("x", spec)
    assert [row[2:4] for row in written.rows if row[0] == "fresh pours"] == list(
        zip(pours["x"], pours["y"], strict=True)
    )


def test_bars_that_are_pale_on_the_page_are_pale_in_print():
    pale = {"type": "bar", "name": "beside", "orientation": "h", "x": [40.0], "y": ["JKR"]}
    marks = [{"color": "#305070", "opacity": opacity} for opacity in (1.0, 0.3)]
    spec = chart(
        [pale | {"marker": mark} for mark in marks], {"barmode": "stack", "xaxis": axis("probability [%]")}, 200
    )
    bars = drawn(spec, 85).axes[0].patches
    assert [bar.get_alpha() for bar in bars] == [1.0, 0.3]


def test_the_data_of_a_surface_in_space_have_all_three_coordinates(specs):
    spec = specs["1-solutions"]
    space = next(trace for trace in spec["data"] if trace["type"] == "isosurface")
    written = np.array([[row[k] for k in (2, 3, 4, 9)] for row in figure_data("x", spec).rows[: len(space["x"])]])
    np.testing.assert_array_equal(written, np.column_stack([space[key] for key in ("x", "y", "z", "value")]))


def test_a_surface_in_space_is_printed_as_contours_with_the_level_of_the_target(specs):
    spec = specs["1-surface"]
    surface = next(trace for trace in spec["data"] if trace["type"] == "surface")
    level = surface["contours"]["z"]["start"]
    axes = drawn(spec, 180).axes[0]
    levels = [float(value) for one in axes.collections if hasattr(one, "levels") for value in one.levels]
    assert level in levels
    assert drawn(specs["1-solutions"], 180).axes[0].get_xlabel().startswith("A: ")


def test_svg_is_text_of_its_width_and_pdf_holds_its_fonts(specs):
    files = printed(specs["0-verification-1"])
    assert set(files) == {f"{width}mm.{kind}" for width in WIDTHS for kind in ("svg", "pdf")}
    for width in WIDTHS:
        root = ElementTree.fromstring(files[f"{width}mm.svg"])
        assert float(root.attrib["width"].removesuffix("pt")) == pytest.approx(width * INCH * 72)
        assert any("fresh pours" in "".join(text.itertext()) for text in root.iter("{http://www.w3.org/2000/svg}text"))
        assert b"/FontFile2" in files[f"{width}mm.pdf"]
    assert files == printed(specs["0-verification-1"])  # no date, no chance


def test_without_the_extra_the_report_is_written_and_says_how_to_get_the_figures(study, tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "find_spec", lambda name: None)
    assert write_report(study_report(study), tmp_path) == NO_FIGURES
    assert (tmp_path / "report.html").is_file()
    assert {path.suffix for path in (tmp_path / "figures").iterdir()} == {
        ".svg"
    }  # the set-up, which needs no matplotlib


# Methods and set-up


def test_methods_state_the_numbers_of_the_run_and_cite_only_what_is_listed(study):
    report = study_report(study)
    (section,) = [one for one in report.sections if one.title == "Methods"]
    text = section.blocks[0].text
    test = study.verification.tests[0]
    for words in (
        f"{study.runs.total} pours ({study.runs.valid} valid)",
        f"seeds drawn from {study.study.seed}",
        f"time step of {1e6 * study.set_up.dt:.3g} µs",
        "outlet diameter 30 mm",
        f"a Plackett–Burman design of {study.screening.analysis.rows} rows",
        f"{test.simulated.n} fresh pours",
        *(f"{name} {version}" for name, version in study.versions.items() if name != "physics"),
    ):
        assert words in text
    keys = {one.key for one in report.references}
    named = {key for key in SOURCES if cited(key) in text}
    assert named == {key for key in keys if not key.startswith("software-")}
    assert {"plackett1946", "box1960", "holm1979", "welch1947", "schuirmann1987", "hertz1882"} <= named
    entries = bibtex(report.references)
    assert len(re.findall(r"^@\w+\{", entries, re.MULTILINE)) == len(report.references)
    assert entries.count("{") == entries.count("}")


def test_a_doi_of_a_source_stands_in_the_code_that_rests_on_it():
    for source in SOURCES.values():
        if "doi" in source.fields:
            found = subprocess.run(
                ["grep", "-rl", source.fields["doi"], "doe", "solver"], capture_output=True, text=True
            )
            assert found.stdout, source.key


def test_the_drawing_has_the_dimensions_of_the_rig():
    scene = load_material("sunflower_extract")
    drawing = rig_drawing(set_up_of(scene))
    assert isinstance(drawing, Drawing)
    for words in ("inlet diameter 114", "outlet diameter 30", "cone height 130", "outlet height 65"):
        assert words in drawing.svg
    # To scale: the slope of the cone, (114 − 30) / 2 over 130.
    lines = [
        np.array([place.split(",") for place in points.split()], dtype=float)
        for points in re.findall(r'<polyline points="([^"]*)"', drawing.svg)
    ]
    slopes = [abs((b - a)[0] / (b - a)[1]) for a, b in lines if abs((b - a)[1]) > 1]
    assert slopes == pytest.approx([42 / 130] * 2, rel=0.01)
    ElementTree.fromstring(drawing.svg)


@pytest.mark.parametrize("rig", [name for name in RIGS if name != "mesh_funnel"])
def test_every_rig_is_drawn(rig):
    drawing = rig_drawing(set_up_of(with_rig(load_material("sunflower_extract"), rig)))
    assert drawing is not None
    assert "<polyline" in drawing.svg
    assert "<text" in drawing.svg  # at least one dimension
    assert not re.search(r"\bnan\b", drawing.svg)


def test_the_material_table_holds_what_another_engine_needs():
    scene = load_material("sunflower_extract")
    materials, pairs, bodies = material_tables(set_up_of(scene), scene.assumed)
    seed = next(row for row in materials.rows if row[0] == "seed")
    assert seed[1:4] == ("346 kg/m³", "56.3 MPa", "0.31")
    assert seed[4] == "147.5 MPa"  # 2 · 56.3 · 1.31
    wall = next(row for row in materials.rows if row[0] == "rigid sieve plate")
    assert wall[2].endswith("†")
    assert ("seed–seed", "0.57", "0.57") in pairs.rows
    assert {row[0] for row in bodies.rows} == {body.name for body in scene.bodies}


# Verdicts


CASES = {
    "planted": Word.CALIBRATED,
    "nothing acts": Word.OUT_OF_REACH,
    "out of reach": Word.OUT_OF_REACH,
}


@pytest.mark.parametrize("case", CASES)
def test_parameters_follow_the_verdict_and_are_struck_out_where_it_is_no_calibration(case):
    report = study_report(reported_studies.typed(reported_studies.result_of_case(case)))
    assert report.banner.word is CASES[case]
    first = report.sections[0]
    assert first.title == "Parameters"
    (table,) = [block for block in first.blocks if isinstance(block, Table)]
    kind = Strong if case == "planted" else Struck
    assert all(isinstance(row[2], kind) for row in table.rows)
    if case == "planted":  # none is identified: the range is the answer, the point is named as a choice
        assert all("…" in row[2] and "chosen by rule" in row[3] for row in table.rows)
        assert "95 % set" not in "".join("".join(row) for row in table.rows)


def test_a_surface_of_noise_is_no_calibration_whatever_the_fresh_pours_say(study):
    single = dataclasses.replace(study.optimum.single, better_than_noise=False)
    report = study_report(dataclasses.replace(study, optimum=dataclasses.replace(study.optimum, single=single)))
    assert report.banner.headline == "NOT CALIBRATED"
    (table,) = report.sections[0].blocks
    assert all(isinstance(row[2], Struck) for row in table.rows)
    assert "<s>" in page(report)


def test_of_several_targets_the_verdict_names_every_one():
    report = study_report(reported_studies.typed(reported_studies.result_of_case("two targets")))
    assert report.banner.word is Word.CALIBRATED
    assert re.search(
        r"gave \S+° against \S+° measured \(angle of repose, silhouette\) and \S+ kg/m³ against \S+ kg/m³ measured "
        r"\(bulk density\)",
        report.banner.why,
    )
    assert report.banner.why.count("equivalent to the measurement within") == 2
    overview = next(section for section in report.sections if section.title == "In short")
    facts = dict(overview.blocks[0].pairs)
    assert {"Verification (bulk density)", "Noise of one pour (bulk density)"} <= set(facts)
    assert not any("One number cannot fix" in block.text for block in overview.blocks if isinstance(block, Caution))
    ascent = next(section for section in report.sections if section.title == "Steepest ascent")
    assert [block.name for block in ascent.blocks if isinstance(block, Figure)] == ["ascent", "ascent-2"]
    *_, together = [block for block in ascent.blocks if isinstance(block, Table)]
    assert together.header[-2:] == ("misfit J", "desirability")
    assert "All 2 targets together are missed least at step" in ascent.blocks[0].text
    assert any("Derringer" in text for text in page(report).split("<li>"))


def test_of_several_targets_any_may_spoil_the_verdict():
    found = reported_studies.typed(reported_studies.result_of_case("two targets"))
    spoiled = (found.surface.anova[0], dataclasses.replace(found.surface.anova[1], better_than_noise=False))
    noisy = study_report(dataclasses.replace(found, surface=dataclasses.replace(found.surface, anova=spoiled))).banner
    assert noisy.word is Word.NOT_CALIBRATED
    assert noisy.why.startswith("The response surface of the bulk density is not better than noise")
    first, second = found.verification.tests
    far = verify(second.target.mean + np.arange(40.0, 46.0), second.target.mean, 2.0, 10, 2.0)
    missed = dataclasses.replace(
        found,
        verification=dataclasses.replace(found.verification, tests=(first, far)),
        optimum=dataclasses.replace(
            found.optimum, posterior=dataclasses.replace(found.optimum.posterior, p=CONTRADICTION / 2)
        ),
    )
    banner = study_report(missed).banner
    assert banner.word is Word.OUT_OF_REACH
    assert "No setting of the region gives all targets at once (χ², p = 0.0050)" in banner.why
    assert banner.why.count(" measured (") == 2


# Joined


def test_a_project_joins_photographs_study_and_diagnosis(study, place, tmp_path):
    assert (
        explorer(
            "measure", "cone_25_30", "--reference-length", 100, "--report", tmp_path / "photo", "--author", "Ada"
        ).exit_code
        == 0
    )
    told = diagnosed.typed(diagnosed.result_of_case("effect"))
    (tmp_path / "told").mkdir()
    (tmp_path / "told" / told.NAME).write_text(json.dumps(told.to_dict(), allow_nan=False), encoding="utf-8")
    joined = project_report([tmp_path / "told", place, tmp_path / "photo"], "Seeds", ABOUT)
    assert joined.banner.word is Word.EFFECT_FOUND  # that of the last stage
    verdicts = joined.sections[0].blocks[0]
    assert [row[0] for row in verdicts.rows] == ["Photographs", "Calibration", "Diagnosis"]
    assert [row[2].split()[0] for row in verdicts.rows] == ["MEASURED", "CALIBRATED", "EFFECT"]
    assert len({section.title for section in joined.sections}) == len(joined.sections)
    assert {"part-1-read", "part-2-set-up", "part-3-probabilities"} <= joined.shown.keys()
    text = page(joined)
    assert len(text.encode()) < 5e6
    numbers = [int(number) for number in re.findall(r"<b>Figure (\d+)\.</b>", text)]
    assert numbers == list(range(1, len(joined.shown) + 1))
    assert "data:image/png;base64," in text


def test_one_folder_is_reported_again_and_a_folder_without_a_result_is_refused(study, place, tmp_path):
    again = project_report([place], "", About())
    assert dataclasses.replace(again, sections=()) == dataclasses.replace(study_report(study), sections=())
    with pytest.raises(CommandError, match="holds no finished result"):
        project_report([tmp_path], "", About())
    assert "holds no finished result" in refused(explorer("report", tmp_path, "--out", tmp_path / "new"))


def test_author_and_notes_are_kept_in_the_result(tmp_path):
    out = tmp_path / "analysis"
    made = explorer("analyse", "sunflower_extract", "--out", out, "--author", "Ada Example", "--notes", "a & b")
    assert made.exit_code == 0, made.output
    kept = json.loads((out / "result.json").read_text(encoding="utf-8"))["about"]
    assert (kept["author"], kept["notes"]) == ("Ada Example", "a & b")
    assert re.fullmatch(r"\d{4}-\d{2}-\d{2}", kept["date"])
    html = (out / "report.html").read_text(encoding="utf-8")
    assert "Ada Example, " in html
    assert "a &amp; b" in html
