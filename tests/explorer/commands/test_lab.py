"""`explorer lab`: text, JSON, parts, figures and refusals, on the shipped examples."""

import json
import tomllib

import pytest

from doe.laboratory import TESTS
from explorer.commands import lab
from solver import load_material, value
from solver.assets import asset_path
from tests.explorer.command_line import explorer, refused

pytestmark = pytest.mark.usefixtures("unprinted")


@pytest.mark.parametrize("test", TESTS)
def test_every_shipped_example_is_evaluated(test):
    result = explorer("lab", test, test)
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith(f"{test}: ")
    assert "95 % of the mean" in result.stdout


def test_units_for_people_and_what_must_not_be_overlooked(tmp_path):
    path = tmp_path / "readings.csv"
    angles = [30.0, 30.2, 29.9, 30.1, 30.0, 29.8, 30.1, 45.0]
    path.write_text("a,b,replicate,angle_deg\n" + "".join(f"x,y,r{k},{a}\n" for k, a in enumerate(angles)))
    shown = explorer("lab", "inclined_plane", path).stdout
    (angle,) = [line for line in shown.splitlines() if " sliding_angle " in line and not line.startswith("note")]
    assert " deg " in angle
    assert angle.endswith("r7")
    assert (
        "replicate r7 is an outlier at the 5 % level (Grubbs) and was kept; without it the mean is 30.01 deg" in shown
    )
    assert "not normal" in shown
    # tan 30° + 0.0143° · (1 + 1/3): no digit lost, no unit behind
    assert "without it the mean is 0.5777\n" in shown


def test_json_is_all_of_it_in_si():
    result = explorer("lab", "shear", "shear", "--compression", "compression", "--json")
    data = json.loads(result.stdout)
    assert {one["name"] for one in data["derived"]} == {"shear_modulus", "youngs_modulus"}
    assert data["derived"][0]["summary"]["mean"] == pytest.approx(56.3e6, rel=3e-3)
    assert [one["of"] for one in data["estimates"]] == [["seed"], ["plate"], ["petiole"]]
    assert len(data["curves"]) == 60
    assert (data["twins"], data["bias"]) == ([], None)


def test_the_bias_needs_no_readings():
    shown = explorer("lab", "drop", "--bias")
    assert shown.exit_code == 0
    assert "0.5456" in shown.stdout
    data = json.loads(explorer("lab", "compression", "--bias", "--json").stdout)
    assert data["bias"]["columns"] == ["strain", "poisson_ratio", "ratio"]
    both = explorer("lab", "drop", "drop", "--bias").stdout
    assert "seed-seed" in both
    assert "0.5456" in both


def curved(tmp_path, power=1.5):
    """Readings of a sphere, R 5 mm, ν 0.3, between two plates: F = 115.834 δ^1.5 (N, mm) is 100 MPa."""
    path = tmp_path / "curved.csv"
    rows = [f"seed,{k},5,0.3,2,{0.004 * i:.3f},{115.834 * (0.004 * i) ** power:.5f}" for k in (1, 2) for i in range(51)]
    path.write_text("component,replicate,radius_mm,poisson_ratio,contacts,displacement_mm,force_N\n" + "\n".join(rows))
    return path


def test_a_curved_body_is_told_by_hertz_and_by_the_standard(tmp_path):
    shown = explorer("lab", "compression", curved(tmp_path)).stdout
    (by_hertz,) = [line for line in shown.splitlines() if line.startswith("seed  youngs_modulus   ")]
    assert " 100 " in by_hertz
    (by_standard,) = [line for line in shown.splitlines() if line.startswith("seed  youngs_modulus_asae_s368 ")]
    assert " 100.1 " in by_standard
    assert "Hertz's law of" in shown
    assert "1.500 (1.500 … 1.500)  none" in shown
    assert "straight part of" not in shown
    (curve, _) = json.loads(explorer("lab", "compression", curved(tmp_path), "--json").stdout)["curves"]
    assert curve["fit"]["exponent"] == pytest.approx(1.5, abs=1e-3)
    assert curve["fit"]["yield_force"] is None


def test_what_speaks_against_a_modulus_goes_with_it_everywhere(tmp_path):
    """A curve that is no Hertz's: text, JSON, report, part, and the material that is made with the part."""
    path, said = curved(tmp_path, power=1.0), "is not Hertz's 1.5"
    part, report = tmp_path / "part.toml", tmp_path / "report"
    shown = explorer("lab", "compression", path, "--out", part, "--report", report)
    assert shown.exit_code == 0, shown.output
    assert said in shown.stdout
    assert said in json.loads(explorer("lab", "compression", path, "--json").stdout)["derived"][0]["notes"][0]
    assert "is not Hertz’s 1.5" in (report / "report.md").read_text().replace("'", "’")
    assert said in tomllib.loads(part.read_text())["measured"]["materials"]["seed"]["youngs_modulus"]["notes"][0]
    made = explorer("new", "material", "own", "--like", "sunflower_extract", "--part", part, "--out", tmp_path)
    assert made.exit_code == 0, made.output
    measured = tomllib.loads((tmp_path / "own.toml").read_text())["measured"]
    assert said in measured["materials"]["seed"]["youngs_modulus"]["notes"][0]


def test_the_bias_of_compression_says_which_area_it_takes():
    """4/(3π(1 − ν²)√s) by the contact's area, s times that by the sphere's cross-section: 0.081 at s = 0.03."""
    shown = explorer("lab", "compression", "--bias").stdout
    assert "A is the area of one contact under load, π R δ" in shown
    assert "cross-section before the test, π R²" in shown
    assert "0.081 at 0.03" in shown
    assert "π R δ, not the sphere's cross-section" in explorer("lab", "shear", "--bias").stdout


def test_from_readings_to_a_material(tmp_path):
    """Parts of six tests over the shipped material: its own numbers, with their origin, and no fraction assumed."""
    orders = {
        "friction": ["inclined_plane", "inclined_plane"],
        "drop": ["drop", "drop"],
        "elastic": ["shear", "shear", "--compression", "compression"],
        "density": ["density", "density"],
        "composition": ["composition", "composition", "--leave-out", "light_impurity"],
        "sizes": ["dimensions", "dimensions"],
    }
    parts = []
    for name, words in orders.items():
        part = tmp_path / f"{name}.toml"
        assert explorer("lab", *words, "--out", part).exit_code == 0
        parts += ["--part", part]
    made = explorer("new", "material", "own", "--like", "sunflower_extract", *parts, "--out", tmp_path)
    assert made.exit_code == 0, made.output
    path = tmp_path / "own.toml"
    ours, shipped = load_material(str(path)), load_material("sunflower_extract")
    for pair in shipped.pairs:
        for key in ("static_friction", "restitution"):
            parameter = f"pair.{pair.a}.{pair.b}.{key}"
            # angles to 0.01°, distances to 0.1 mm
            assert value(ours, parameter) == pytest.approx(value(shipped, parameter), abs=2e-4)
    for material in shipped.materials:
        own = ours.material(material.name)
        assert own.density == pytest.approx(material.density, rel=1e-3)
        assert own.shear_modulus == pytest.approx(material.shear_modulus, rel=3e-3)
        # printed digits of ν
        assert own.poisson_ratio == pytest.approx(material.poisson_ratio, abs=5e-3)
    measured = tomllib.loads(path.read_text())["measured"]
    spreads = {body.name: (body.sizes.kind, body.sizes.spread) for body in ours.bodies}
    assert spreads["seed"] == ("log_normal", pytest.approx(measured["body"]["seed"]["size_spread"]["value"]))
    assert spreads["plate"] == ("none", 0.0)
    assert measured["pair"]["seed"]["seed"]["restitution"]["source"] == "drop.csv"
    assert measured["seed"]["moisture_percent"] == 28.7
    assert not any("mass_fraction" in entry for entry in ours.assumed)
    assert explorer("parameters", path).exit_code == 0


def test_parts_fit_the_starter_material_too(tmp_path):
    readings = tmp_path / "plane.csv"
    readings.write_text("a,b,replicate,angle_deg\ngrain,steel,1,20\ngrain,steel,2,22\n")
    part = tmp_path / "part.toml"
    assert explorer("lab", "inclined_plane", readings, "--out", part).exit_code == 0
    assert explorer("new", "material", "lentil", "--part", part, "--out", tmp_path).exit_code == 0
    scene = load_material(str(tmp_path / "lentil.toml"))
    assert value(scene, "pair.grain.steel.static_friction") == pytest.approx(0.384, abs=1e-3)
    assert "pair.grain.steel.static_friction" not in scene.assumed
    assert "pair.grain.steel.restitution" in scene.assumed


def test_a_part_of_another_material_makes_no_file(tmp_path):
    part = tmp_path / "part.toml"
    assert explorer("lab", "drop", "drop", "--out", part).exit_code == 0
    line = refused(explorer("new", "material", "lentil", "--part", part, "--out", tmp_path))
    assert "part.toml: does not fit the starter material" in line
    assert not (tmp_path / "lentil.toml").exists()
    assert "exists" in refused(explorer("new", "material", "part", "--part", part, "--out", tmp_path))
    assert "No such option: --part" in refused(explorer("new", "study", "lentil", "--part", part, "--out", tmp_path))


def test_the_figure_of_a_curved_body_draws_the_law(tmp_path):
    path = tmp_path / "law.html"
    assert explorer("lab", "compression", curved(tmp_path), "--plot", path).exit_code == 0
    page = path.read_text()
    assert "Hertzian part, on to zero force" in page
    assert "straight part" not in page


def test_the_figure_holds_every_replicate_and_escapes_names(tmp_path):
    path = tmp_path / "curves.html"
    assert explorer("lab", "compression", "compression", "--plot", path).exit_code == 0
    page = path.read_text()
    assert page.count('<figure id="curves-') == 3
    assert page.count("replicate 10:") == 6
    assert "<script src" not in page


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["torsion", "drop"], "torsion"),
        (["drop"], "FILE.csv is missing"),
        (["drop", "drop", "--template"], "--template: makes an empty sheet"),
        (["drop", "--template", "--bias"], "--template: makes an empty sheet"),
        (["drop", "--template", "--out", "x.toml"], ".csv"),
        (["drum", "drum", "--simulate"], "explorer simulate rotating_drum"),
        (["draw_down", "draw_down", "--simulate"], "explorer simulate draw_down_box"),
        (["bulk_density", "bulk_density", "--simulate"], "explorer simulate lifting_cylinder"),
        (["sieve", "sieve", "--simulate"], "sieve has no rig"),
        (["drum", "--bias"], "needs no model"),
        (["drop", "nowhere.csv"], "nowhere.csv"),
        (["drop", "--bias", "--simulate"], "need readings"),
        (["moisture", "moisture", "--simulate"], "moisture has no rig"),
        (["moisture", "moisture", "--bias"], "difference of masses"),
        (["dimensions", "dimensions", "--simulate"], "dimensions has no rig"),
        (["dimensions", "dimensions", "--bias"], "a caliper has no model"),
        (["drop", "drop", "--compression", "compression"], "shear"),
        (["drop", "drop", "--leave-out", "seed"], "composition"),
        (["drop", "drop", "--plot", "x.html"], "force–displacement"),
        (["drop", "drop", "--material", "sunflower_extract"], "--simulate"),
        (["drop", "drop", "--out", "x.txt"], ".toml"),
        (["drop", "drop", "--out", "none/x.toml"], "no folder"),
        (["drop", "inclined_plane"], "angle_deg"),
    ],
)
def test_lab_refuses(words, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert expected in refused(explorer("lab", *words))
    assert list(tmp_path.iterdir()) == []


def test_single_readings_have_no_figure(tmp_path):
    readings = tmp_path / "one.csv"
    readings.write_text("component,replicate,thickness_mm,area_mm2,displacement_mm,force_N\nseed,1,5,20,0.05,30\n")
    assert "no curve" in refused(explorer("lab", "compression", readings, "--plot", tmp_path / "x.html"))
    assert not (tmp_path / "x.html").exists()


def test_shipped_examples_say_that_they_are_made_up():
    for test in TESTS:
        assert "# Made up" in asset_path("laboratory", test).read_text()


def test_the_choices_are_the_tests_that_there_are():
    assert [one.value for one in lab.Test] == list(TESTS)


@pytest.mark.parametrize("test", TESTS)
def test_a_sheet_is_printed_or_written_and_read_once_it_is_filled_in(test, tmp_path):
    path = tmp_path / "sheet.csv"
    assert explorer("lab", test, "--template", "--out", path).stdout == f"wrote {path}\n"
    printed = explorer("lab", test, "--template").stdout
    assert path.read_text() == printed
    assert json.loads(explorer("lab", test, "--template", "--json").stdout) == {"test": test, "template": printed}
    assert "no readings below the names" in refused(explorer("lab", test, path))
    header = printed.splitlines()[-1].split(",")
    shipped = asset_path("laboratory", test)
    rows = [line.split(",") for line in shipped.read_text().splitlines() if not line.startswith("#")]
    # The shipped readings, copied into the sheet by hand: columns that it lacks are those of the errors of readings.
    cells = [dict(zip(rows[0], row, strict=True)) for row in rows[1:]]
    path.write_text(printed + "".join(",".join(row.get(name, "") for name in header) + "\n" for row in cells))
    of_sheet = json.loads(explorer("lab", test, path, "--json").stdout)
    of_shipped = json.loads(explorer("lab", test, shipped, "--json").stdout)
    assert [one["values"] for one in of_sheet["derived"]] == [one["values"] for one in of_shipped["derived"]]


def test_the_errors_of_readings_stand_beside_the_scatter():
    shown = explorer("lab", "rebound", "rebound").stdout
    assert "with the readings' own errors" in shown
    assert "with the readings' own errors" not in explorer("lab", "drop", "drop").stdout


def test_a_report_of_a_test_with_errors_has_them(tmp_path):
    folder = tmp_path / "report"
    assert explorer("lab", "drum", "drum", "--report", folder).exit_code == 0
    page = (folder / "report.html").read_text()
    assert "u of the readings" in page
    assert "A target, no parameter" in page
    assert "explorer simulate rotating_drum" in page
