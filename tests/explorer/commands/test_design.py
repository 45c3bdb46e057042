"""`explorer design` and `explorer analyse` from the command line to their files."""

import json
import re

import numpy as np
import pytest

from explorer.design.filled_sheet import read_sheet
from solver.assets import asset_path
from tests.explorer.command_line import explorer, refused

pytestmark = pytest.mark.usefixtures("unprinted")

PROCESS = """
responses = ["yield"]
[[factor]]
name = "time"
low = 80
high = 90
unit = "min"
[[factor]]
name = "temperature"
low = 170
high = 180
unit = "°F"
"""
FILTRATION_RATE = (45, 71, 48, 65, 68, 60, 80, 65, 43, 100, 45, 104, 75, 86, 70, 96)


@pytest.fixture
def process(tmp_path):
    path = tmp_path / "process.toml"
    path.write_text(PROCESS, encoding="utf-8")
    return path


def many_factors(folder, number):
    path = folder / "factors.toml"
    entries = (f'[[factor]]\nname = "f{k + 1}"\nlow = -1\nhigh = 1\n' for k in range(number))
    path.write_text("".join(entries), encoding="utf-8")
    return path


def fill(path, values):
    """Writes ``values`` into the last column, line by line."""
    lines = path.read_text(encoding="utf-8").splitlines()
    first = next(k for k, line in enumerate(lines) if not line.startswith("#")) + 1
    for k, value in enumerate(values):
        lines[first + k] += str(value)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def made(folder, *options):
    path = folder / "runs.csv"
    result = explorer("design", *options, "--out", path)
    assert result.exit_code == 0, result.output
    return path, result.stdout


def analysed(*options):
    result = explorer("analyse", *options, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_table_8_gives_table_9_the_papers_equation_and_a_solution(tmp_path):
    """Processes 2022, 10, 185: Table 9 (sums of squares, p), R² 0.983, adjusted 0.9612, CV 1.59 %; equation 8."""
    result = analysed("sunflower_extract", "--target", 24.68)
    anova = result["analysis"]["model"]["anova"]
    rows = {row["source"]: row for row in anova["rows"]}
    table = np.genfromtxt(asset_path("source_tables", "table9_box_behnken_anova"), delimiter=",", dtype=str)[1:]
    ours = ("model", "A", "B", "C", "A*B", "A*C", "B*C", "A^2", "B^2", "C^2", "residual", "lack_of_fit", "pure_error")
    for name, printed in zip(ours, table, strict=False):
        # Four significant digits at most are printed.
        assert rows[name]["sum_of_squares"] == pytest.approx(float(printed[3]), rel=2e-3), name
    assert rows["lack_of_fit"]["p"] == pytest.approx(0.2805, abs=5e-5)
    assert anova["r_squared"] == pytest.approx(0.983, abs=5e-4)
    assert anova["r_squared_adjusted"] == pytest.approx(0.9612, abs=5e-5)
    assert anova["cv_percent"] == pytest.approx(1.59, abs=5e-3)
    # As the README quotes it; its check by leaving out one run at a time is in tests/doe/analysis/test_surface.py.
    assert anova["r_squared_predicted"] == pytest.approx(0.832, abs=5e-4)
    printed = [18.31, 0.14, 149.7, -219.08, 3.01, 1.85, 22.22, -0.026, -249, 113.81]
    natural = result["analysis"]["model"]["surface"]["coefficients_natural"]
    assert natural == pytest.approx(printed, rel=0.03)  # 0.14 and -0.026 are printed with two digits
    single = result["analysis"]["optimum"]
    assert single["reached"]
    assert single["predicted"] == pytest.approx(24.68, abs=1e-5)
    assert single["unidentified"] == ["A", "B", "C"]
    # 28.335 by the printed angles: half a unit of the last digit, and rounding.
    assert single["reachable_high"] == pytest.approx(28.34, abs=5e-3 + 1e-9)
    assert single["solution_share"] == pytest.approx([0.77, 0.76, 1.0], abs=5e-3)
    canonical = result["analysis"]["model"]["canonical"]
    assert (canonical["kind"], canonical["inside"]) == ("saddle", False)


def test_report_is_written_complete_and_holds_the_same_numbers(tmp_path):
    out = tmp_path / "report"
    result = explorer("analyse", "sunflower_extract", "--target", 24.68, "--out", out)
    assert result.exit_code == 0, result.output
    files = {"report.html", "report.md", "result.json", "references.bib"}
    assert {path.name for path in out.iterdir()} == files | {"data", "figures"}
    markdown = (out / "report.md").read_text(encoding="utf-8")
    for words in ("## Target", "## Model", "## Diagnostics", "## Shape and ridge", "a saddle outside the region"):
        assert words in markdown
    assert "18.309 + 0.13632 A + 149.7 B − 219.08 C" in markdown
    page = (out / "report.html").read_text(encoding="utf-8")
    for name in (
        "contours",
        "surface",
        "profiler",
        "fit",
        "residual-quantiles",
        "single-runs",
        "box-cox",
        "ridge",
        "cloud",
    ):
        assert f'<figure id="{name}">' in page
    stored = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert stored["analysis"]["optimum"]["statement"] in result.stdout
    assert "explorer analyse sunflower_extract --target 24.68" in markdown
    assert "is not empty" in refused(explorer("analyse", "sunflower_extract", "--target", 24.68, "--out", out))


def test_factorial_from_factors_to_the_textbooks_effects(tmp_path):
    """Montgomery 2017, example 6.2, through the files: A = 21.625, AC = -18.125, AD = 16.625."""
    factors = many_factors(tmp_path, 4)
    path, said = made(tmp_path, "factorial", "--factors", factors, "--standard-order")
    assert "2^4: 16 rows × 1 = 16 runs" in said
    result = analysed(fill(path, FILTRATION_RATE), "--terms", "f1,f3,f4,f1*f3,A*D")
    effects = {effect["name"]: effect["effect"] for effect in result["analysis"]["effects"]["screening"]["effects"]}
    assert effects["A"] == pytest.approx(21.625)
    assert effects["A*C"] == pytest.approx(-18.125)
    surface = result["analysis"]["model"]["surface"]
    included = [term for term, is_in in zip(surface["terms"], surface["included"], strict=True) if is_in]
    assert included == ["intercept", "A", "C", "D", "A*C", "A*D"]
    assert result["analysis"]["model"]["anova"]["r_squared"] == pytest.approx(0.966, abs=5e-4)
    text = explorer("analyse", path, "--terms", "f1,f3,f4,f1*f3,A*D").stdout
    equation = next(line for line in text.splitlines() if line.startswith("Equation, coded: "))
    assert re.sub("[0-9.]+", "n", equation) == "Equation, coded: n + n A + n C + n D − n A·C + n A·D"
    # Half a unit of the last digit: the coefficients are sixteenths, and lie between two printed numbers.
    printed = [float(number) for number in re.findall(r"[0-9.]+", equation)]
    assert printed == pytest.approx([70.0625, 10.8125, 4.9375, 7.3125, 9.0625, 8.3125], abs=0.0051)


def test_central_composite_finds_a_planted_maximum(tmp_path, process):
    """y = 80 - 1.4 (x1 - 0.4)² - (x2 - 0.3)², x coded: the maximum lies at 87 min and 176.5 °F."""
    path, said = made(tmp_path, "central-composite", "--factors", process, "--sigma", 0.3)
    assert "beyond low … high: time 77.9289 … 92.0711" in said
    rows = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    x1, x2 = np.array([[(float(row[4]) - 85) / 5, (float(row[5]) - 175) / 5] for row in rows]).T
    noise = 1e-3 * np.random.default_rng(3).standard_normal(len(rows))
    result = analysed(fill(path, 80 - 1.4 * (x1 - 0.4) ** 2 - (x2 - 0.3) ** 2 + noise))
    canonical = result["analysis"]["model"]["canonical"]
    assert canonical["kind"] == "maximum"
    assert canonical["inside"]
    assert canonical["stationary_natural"] == pytest.approx([87.0, 176.5], abs=0.02)
    assert result["analysis"]["optimum"] is None


def test_screening_with_a_fold_over_says_what_it_confuses(tmp_path):
    factors = many_factors(tmp_path, 11)
    path, said = made(tmp_path, "plackett-burman", "--factors", factors)
    assert "12 runs, 0 columns without a factor" in said
    assert "As many effects as runs" in said
    assert "1/3 " in said
    assert "and 33 more" in said
    folded = explorer("design", "plackett-burman", "--factors", factors, "--fold", "--out", tmp_path / "folded.csv")
    assert "aliases" not in folded.stdout
    assert "those share columns with each other, up to 1/3 of one" in folded.stdout
    result = analysed(fill(path, np.random.default_rng(1).standard_normal(12)))
    assert result["analysis"]["model"] is None
    assert len(result["analysis"]["effects"]["screening"]["effects"]) == 11


def test_fraction_prints_its_defining_relation_and_alias_chains(tmp_path):
    _, said = made(tmp_path, "factorial", "--factors", many_factors(tmp_path, 6), "--fraction", 2)
    assert "2^(6−2): 16 rows" in said
    assert "I = ABCE = ADEF = BCDF" in said
    assert "AE = BC = DF" in said


def test_days_that_differ_take_nothing_from_the_model(tmp_path, process):
    """A surface with a shift of 7 from day to day: the coefficients are the planted ones, and the days add up to 0."""
    path, said = made(tmp_path, "central-composite", "--factors", process, "--blocks", 2, "--seed", 4)
    assert "Blocks of rows, of 7, 7 runs" in said
    assert f"explorer analyse {path} --block block" in said
    lines = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    day, x1, x2 = np.array([[float(one[4]), (float(one[5]) - 85) / 5, (float(one[6]) - 175) / 5] for one in lines]).T
    noise = 1e-3 * np.random.default_rng(3).standard_normal(len(lines))
    filled = fill(path, 80 + x1 - 2 * x2 + 3 * x1 * x2 - 1.4 * x1**2 + 7 * day + noise)
    surface = analysed(filled, "--block", "block")["analysis"]["model"]["surface"]
    assert surface["coefficients"] == pytest.approx([90.5, 1, -2, 3, -1.4, 0], abs=0.01)
    assert surface["block_effects"] == pytest.approx([-3.5, 3.5], abs=0.01)
    # Without a name the column is no response, and is pointed at.
    assert "Not used: block." in explorer("analyse", filled).stdout


SOLVENT = """
[[factor]]
name = "solvent"
levels = ["water", "ethanol"]
"""


def test_an_optimal_design_stays_within_constraints_in_the_factors_units(tmp_path, process):
    process.write_text(PROCESS + SOLVENT, encoding="utf-8")
    limits = ("--constraint", "time + temperature <= 265", "--constraint", "A >= 2*B - 266")
    path, said = made(tmp_path, "i-optimal", "--factors", process, "--runs", 12, *limits, "--model", "quadratic")
    assert "i-optimal, quadratic model of 9 terms: 12 rows × 1 = 12 runs" in said
    assert "D-efficiency" in said
    lines = path.read_text(encoding="utf-8").splitlines()
    assert "# levels | solvent | water | ethanol" in lines
    runs = [line.split(",")[4:7] for line in lines if line[0].isdigit()]
    time, temperature = np.array([[float(one[0]), float(one[1])] for one in runs]).T
    assert (time + temperature <= 265 + 1e-6).all()
    assert (time >= 2 * temperature - 266 - 1e-6).all()
    assert {one[2] for one in runs} == {"water", "ethanol"}


def test_runs_are_added_to_a_finished_sheet_for_what_it_could_not_tell(tmp_path):
    """A half fraction with C = AB, four of eight runs filled: the added runs make a main effect of C again."""
    factors = many_factors(tmp_path, 3)
    path, _ = made(tmp_path, "factorial", "--factors", factors, "--generator", "C=AB", "--replicates", 2,
                   "--standard-order")  # fmt: skip
    fill(path, (1.5, 2.5, 3.5, 4.5))
    out = tmp_path / "more.csv"
    order = ("design", "d-optimal", "--factors", factors, "--augment", path, "--runs", 4, "--model", "interactions")
    result = explorer(*order, "--out", out, "--json")
    assert result.exit_code == 0, result.output
    said = json.loads(result.stdout)
    assert said["gained"] == ["A", "B", "C", "A*B", "A*C", "B*C"]
    assert (said["kept"], said["runs"], said["efficiency"]["d"]) == (4, 8, pytest.approx(100))
    lines = [line.split(",") for line in out.read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    assert [line[-1] for line in lines] == ["1.5", "2.5", "3.5", "4.5", "", "", "", ""]
    assert len({tuple(line[4:7]) for line in lines}) == 8
    again = explorer(*order, "--out", tmp_path / "again.csv")
    assert "The 4 finished runs could not tell apart A, B, C, A*B, A*C, B*C; with the 4 added runs" in again.stdout
    assert "allowed: --replicates 1" in refused(explorer(*order, "--replicates", 2, "--out", tmp_path / "x.csv"))
    explorer("design", "factorial", "--factors", factors, "--out", tmp_path / "empty.csv")
    empty = ("design", "d-optimal", "--factors", factors, "--augment", tmp_path / "empty.csv")
    assert "no run with a result in response" in refused(explorer(*empty, "--out", tmp_path / "x.csv"))


def test_a_factor_of_two_names_is_analysed_by_its_name(tmp_path, process):
    """y = 10 + time's 2 and solvent's 3 either way of the mean: ethanol, the second name, is +1."""
    process.write_text(PROCESS + SOLVENT, encoding="utf-8")
    path, _ = made(tmp_path, "factorial", "--factors", process, "--replicates", 2)
    runs = [line.split(",")[4:7] for line in path.read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    noise = np.random.default_rng(5).standard_normal(len(runs)) / 100
    values = [10 + 2 * (float(a) - 85) / 5 + (3 if c == "ethanol" else -3) for a, _, c in runs]
    result = analysed(fill(path, np.array(values) + noise))
    found = dict(zip(result["analysis"]["model"]["surface"]["terms"],
                     result["analysis"]["model"]["surface"]["coefficients"], strict=True))  # fmt: skip
    assert [found[term] for term in ("intercept", "A", "B", "C")] == pytest.approx([10, 2, 0, 3], abs=0.02)
    assert "solvent: −1 is water, +1 is ethanol." in result["analysis"]["notes"]
    # With a target there is a setting of the numbers for each name.
    named = analysed(path, "--target", 12)["analysis"]["named"]
    for group, offset in zip(named["groups"], (-3, 3), strict=True):
        assert group["setting"]["reached"] == (abs(12 - 10 - offset) <= 2)
    path.write_text(path.read_text(encoding="utf-8").replace("ethanol,", "Ethanol,", 1), encoding="utf-8")
    assert "column solvent: 'Ethanol'; allowed: water, ethanol" in refused(explorer("analyse", path))


def test_a_factor_of_three_names_is_a_term_with_two_degrees_of_freedom_or_blocks(tmp_path, process):
    process.write_text(PROCESS + SOLVENT.replace('"ethanol"', '"ethanol", "oil"'), encoding="utf-8")
    order = ("--factors", process, "--model", "linear", "--runs", 12, "--report", tmp_path / "plan")
    path, said = made(tmp_path, "d-optimal", *order)
    # Of several orthogonal designs some bear the interactions too; which one is found first is a matter of rounding.
    assert re.search("what the (linear|interactions) model will see", said)
    assert re.search(r"between two names +1 ", said)
    assert "tested by all of them at once (F)" in said
    told = (tmp_path / "plan/report.md").read_text(encoding="utf-8")
    assert re.search(
        r"A change of \S+ σ by a factor \(low to high\) and \S+ σ between two names of a factor is seen", told
    )
    effect = {"water": 0.0, "ethanol": 2.0, "oil": -2.0}
    lines = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    noise = 0.1 * np.random.default_rng(1).standard_normal(12)
    fill(path, [10 + effect[cells[6]] + one for cells, one in zip(lines, noise, strict=True)])
    named = analysed(path, "--model", "linear", "--target", 12)["analysis"]["named"]
    assert {row["source"]: row["df"] for row in named["rows"]}["C"] == 2
    assert [one["effect"] for one in named["means"]] == pytest.approx([0, 2, -2], abs=0.2)
    assert [group["names"] for group in named["groups"]] == [["water"], ["ethanol"], ["oil"]]
    said = explorer("analyse", path, "--model", "linear", "--target", 12, "--out", tmp_path / "found").stdout
    assert "solvent: ethanol" in said
    assert "Terms that act: C (p < 0.05" in said
    report = (tmp_path / "found/report.md").read_text(encoding="utf-8")
    assert "solvent: oil" in report
    assert (tmp_path / "found/data/anova.csv").read_text(encoding="utf-8").count("\n") == 1 + len(named["rows"])
    assert "C has named levels and therefore no square" in refused(explorer("analyse", path, "--terms", "A,C^2"))
    result = analysed(path, "--only", "time,temperature", "--block", "solvent")
    assert set(result["analysis"]["model"]["surface"]["block_names"]) == {"water", "ethanol", "oil"}


def test_a_morris_design_tells_elementary_effects(tmp_path, process):
    """y = 3 u_time² + 2 u_temperature on [0, 1]: the temperature acts linearly, σ = 0; of the time e = 3 (u + u')."""
    path, said = made(tmp_path, "morris", "--factors", process)
    assert "morris, 10 trajectories: 30 rows × 1 = 30 runs" in said
    cells = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    fill(path, [3 * ((float(one[4]) - 80) / 10) ** 2 + 2 * (float(one[5]) - 170) / 10 for one in cells])
    result = analysed(path)["analysis"]
    assert result["model"] is None
    time, temperature = result["elementary"]["effects"]
    assert (temperature["mu_star"], temperature["sigma"]) == (pytest.approx(2), 0)
    assert set(np.round(time["effects"], 6)) <= {2.0, 4.0}  # 3 (0 + 2/3), 3 (1/3 + 1)
    said = explorer("analyse", path, "--out", tmp_path / "found").stdout
    assert "Elementary effects: by μ* A" in said
    assert "one step of one factor" in (tmp_path / "found/report.md").read_text(encoding="utf-8")
    assert analysed(path, "--model", "linear")["analysis"]["model"] is not None
    order = ("design", "morris", "--factors", process, "--runs", 10, "--out", tmp_path / "x.csv")
    assert "trajectory of 2 factors has 3 runs; allowed: 9, 12" in refused(explorer(*order))


def test_days_drawn_at_random_are_a_variance_component(tmp_path, process):
    """Three days with every run each: y = 10 + 2 A + day, the days -4, 0 and 4 (variance 16)."""
    path, _ = made(tmp_path, "factorial", "--factors", process, "--replicates", 3, "--blocks", 3)
    cells = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    noise = 0.1 * np.random.default_rng(2).standard_normal(len(cells))
    days = {"1": -4, "2": 0, "3": 4}
    fill(path, [10 + 2 * (float(one[5]) - 85) / 5 + days[one[4]] + e for one, e in zip(cells, noise, strict=True)])
    random = analysed(path, "--random", "block")["analysis"]["random"]
    between, within = random["components"]
    assert between["variance"] == pytest.approx(16, rel=0.1)
    assert between["low"] < 16 < between["high"]
    assert within["variance"] < 0.03
    assert {one["source"]: one["p"] < 1e-6 for one in random["tests"]}["A"]
    said = explorer("analyse", path, "--random", "block", "--out", tmp_path / "found").stdout
    assert "between groups" in said
    assert "Terms that act: A (p < 0.05" in said
    assert "Satterthwaite" in (tmp_path / "found/report.md").read_text(encoding="utf-8")
    assert (tmp_path / "found/data/tests.csv").read_text(encoding="utf-8").startswith("source,df,df_error,f,p")


def test_a_process_is_set_beside_the_polynomial_and_answers_the_target(tmp_path, process):
    """A step that no quadratic follows: tanh(4 A) + B, with A = atanh(0.5)/4 = 0.137 at B = 0 for 0.5."""
    path, _ = made(tmp_path, "lhs", "--factors", process, "--runs", 40)
    cells = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
    a, b = np.array([[(float(one[4]) - 85) / 5, (float(one[5]) - 175) / 5] for one in cells]).T
    fill(path, np.tanh(4 * a) + b)
    found = analysed(path, "--surrogate", "gp", "--target", 0.5)["analysis"]
    polynomial = found["model"]["anova"]["r_squared_predicted_by_row"]
    assert found["surrogate"]["r_squared_predicted_by_row"] > max(polynomial, 0.99)
    assert found["optimum"] is None
    answer = found["surrogate_target"]
    nearest = min(np.hypot(x, 0.5 - np.tanh(4 * x)) for x in np.linspace(-1, 1, 20001))
    assert np.hypot((answer["point"][0] - 85) / 5, (answer["point"][1] - 175) / 5) == pytest.approx(nearest, abs=0.02)
    said = explorer("analyse", path, "--surrogate", "gp", "--target", 0.5, "--out", tmp_path / "found").stdout
    assert "Predicts better: the Gaussian process; R² of rows left out" in said
    assert "Gaussian process" in (tmp_path / "found/report.md").read_text(encoding="utf-8")
    assert "surrogate" not in analysed(path)["analysis"]
    process.write_text(PROCESS + SOLVENT, encoding="utf-8")
    (tmp_path / "named").mkdir()
    named, _ = made(tmp_path / "named", "factorial", "--factors", process)
    fill(named, range(8))
    message = refused(explorer("analyse", named, "--surrogate", "gp"))
    assert (
        "--surrogate gp: solvent has named levels; allowed: numeric factors, as with --only time,temperature" in message
    )


@pytest.mark.parametrize(
    "options, message",
    [
        (("--constraint", "time < 3"), "--constraint 'time < 3': allowed: the form A"),
        (("--constraint", "time + heat <= 3"), "cannot read '+ heat'"),
        (("--constraint", "time temperature <= 3"), "cannot read 'temperature'"),
        (("--constraint", "2* <= time"), "cannot read '*'"),
        (("--constraint", "3 <= 4"), "names no factor"),
        (("--constraint", "solvent <= 1"), "solvent has named levels"),
        (("--constraint", "time + temperature <= 20"), "satisfy them; allowed: at least"),
        (("--runs", 5), "runs = 5: too few for the 9 terms of the quadratic model; allowed: at least 9"),
        (("--augment", "nowhere.csv"), "nowhere.csv"),
    ],
)
def test_bad_orders_of_an_optimal_design_get_one_line(tmp_path, process, options, message):
    process.write_text(PROCESS + SOLVENT, encoding="utf-8")
    out = tmp_path / "runs.csv"
    assert message in refused(explorer("design", "d-optimal", "--factors", process, *options, "--out", out))
    assert not out.exists()


def test_names_are_for_designs_that_run_them(tmp_path, process):
    process.write_text(PROCESS + SOLVENT, encoding="utf-8")
    order = ("design", "central-composite", "--factors", process, "--out", tmp_path / "runs.csv")
    assert "needs levels of solvent other than water, ethanol" in refused(explorer(*order))
    other = ("design", "factorial", "--factors", process, "--model", "linear", "--out", tmp_path / "runs.csv")
    assert "--model: is not for factorial; allowed with: d-optimal, i-optimal" in refused(explorer(*other))


def test_a_mixture_goes_from_its_parts_to_the_best_blend(tmp_path):
    """A whole of 100, 20 of water at least: y = 3 a + 5 b + 1 w + 8 a b of the shares above the lows."""
    factors = tmp_path / "parts.toml"
    parts = {"ash": (0, 80), "binder": (0, 80), "water": (20, 100)}
    entries = (
        f'[[factor]]\nname = "{name}"\nlow = {low}\nhigh = {high}\nunit = "%"\n' for name, (low, high) in parts.items()
    )
    factors.write_text("".join(entries), encoding="utf-8")
    path, said = made(tmp_path, "mixture", "--factors", factors, "--replicates", 2, "--centre", 1)
    assert "simplex centroid: 8 rows × 2 = 16 runs" in said
    assert "special cubic polynomial (7 terms), with 9 degrees of freedom" in said
    runs = [
        [float(cell) for cell in line.split(",")[4:7]] for line in path.read_text().splitlines() if line[0].isdigit()
    ]
    assert np.allclose(np.sum(runs, axis=1), 100)
    a, b, w = ((np.array(runs) - [0, 0, 20]) / 80).T
    noise = np.random.default_rng(2).standard_normal(16) / 1000
    result = analysed(fill(path, 3 * a + 5 * b + w + 8 * a * b + noise), "--model", "quadratic")
    found = result["analysis"]["mixture"]
    assert found["terms"] == ["A", "B", "C", "A*B", "A*C", "B*C"]
    assert found["coefficients"] == pytest.approx([3, 5, 1, 8, 0, 0], abs=0.02)
    # On the edge of ash and binder: b = 1/2 + 2/16.
    assert found["highest"]["amounts"] == pytest.approx([30, 50, 20], abs=0.8)
    out = tmp_path / "report"
    assert explorer("analyse", path, "--out", out).exit_code == 0
    text = (out / "report.md").read_text(encoding="utf-8")
    assert "Scheffé's special cubic polynomial" in text
    assert "Highest blend" in text
    assert "--target: not allowed for a mixture" in refused(explorer("analyse", path, "--target", 3))


def test_parts_whose_ranges_cannot_be_one_whole_are_refused(tmp_path, process):
    order = ("design", "mixture", "--factors", process, "--out", tmp_path / "x.csv")
    process.write_text(PROCESS.replace("170", "175"), encoding="utf-8")
    assert "high minus low differs between the parts (time 10, temperature 5)" in refused(explorer(*order))
    many = ("design", "lhs", "--factors", process, "--lattice", 2, "--out", tmp_path / "x.csv")
    assert "--sigma: is not for mixture, whose" in refused(explorer(*order, "--sigma", 1))
    assert "--lattice: is not for lhs; allowed with: mixture" in refused(explorer(*many))


def test_a_reduced_model_says_what_was_dropped_and_that_its_p_are_too_small(tmp_path):
    full, reduced = analysed("sunflower_extract"), analysed("sunflower_extract", "--reduce", "p")
    assert "reduced" not in full["analysis"]
    found = reduced["analysis"]["reduced"]
    surface = reduced["analysis"]["model"]["surface"]
    left = [term for term, is_in in zip(surface["terms"], surface["included"], strict=True) if is_in][1:]
    assert sorted(left + found["dropped"]) == sorted(surface["terms"][1:])
    assert found["dropped"]
    text = explorer("analyse", "sunflower_extract", "--reduce", "aicc", "--target", 24.68).stdout
    assert "Reduced by AICc, one term after the other" in text
    assert "take no account of this search and are too small" in text
    out = tmp_path / "report"
    assert explorer("analyse", "sunflower_extract", "--reduce", "aicc", "--out", out).exit_code == 0
    assert "explorer analyse sunflower_extract --reduce aicc" in (out / "report.md").read_text(encoding="utf-8")


def test_further_runs_at_the_target_have_their_own_intervals(tmp_path):
    """Wider than that of the mean, by the scatter of a run; most runs wider than one."""
    result = analysed("sunflower_extract", "--target", 24.68)["analysis"]
    one, most = result["at_target"]["one_run"], result["at_target"]["most_runs"]
    mean = (result["optimum"]["predicted_high"] - result["optimum"]["predicted_low"]) / 2
    sigma = result["model"]["anova"]["sigma"]
    assert mean < one < most
    assert one > sigma
    assert "One further run there: ± " in explorer("analyse", "sunflower_extract", "--target", 24.68).stdout


def test_power_is_in_the_plain_data(tmp_path, process):
    result = explorer("design", "factorial", "--factors", process, "--replicates", 4, "--sigma", 2, "--effect", 3,
                      "--out", tmp_path / "runs.csv", "--json")  # fmt: skip
    factor = next(one for one in json.loads(result.stdout)["power"] if one["kind"] == "factor")
    assert factor["standard_error"] == pytest.approx(2 * 2 / 16**0.5)
    assert 0.5 < factor["power"] < 1


def test_a_change_without_sigma_is_of_so_many_standard_deviations(tmp_path, process):
    order = ("design", "factorial", "--factors", process, "--replicates", 4)
    said = explorer(*order, "--effect", 1.5, "--out", tmp_path / "a.csv").stdout
    assert "chance to see 1.5 σ" in said
    with_sigma = explorer(*order, "--sigma", 2, "--effect", 3, "--out", tmp_path / "b.csv").stdout
    assert "chance to see 3\n" in with_sigma
    last = [[line.split()[-1] for line in text.splitlines() if line.startswith("of a")] for text in (said, with_sigma)]
    assert last[0] == last[1] != []
    assert "standard deviations of one run" in " ".join(explorer("design", "--help").stdout.split())


def test_only_some_factors_leave_the_others_to_the_scatter(tmp_path):
    path, _ = made(tmp_path, "factorial", "--factors", many_factors(tmp_path, 4), "--standard-order")
    result = analysed(fill(path, FILTRATION_RATE), "--only", "f1,f3,f4", "--model", "interactions")
    assert [factor["factor"] for factor in result["factors"]] == ["f1", "f3", "f4"]
    rows = {row["source"]: row for row in result["analysis"]["model"]["anova"]["rows"]}
    assert rows["pure_error"]["df"] == 8


def test_missing_runs_are_told(tmp_path, process):
    path, _ = made(tmp_path, "box-behnken", "--factors", many_factors(tmp_path, 3))
    result = analysed(fill(path, np.arange(16) ** 1.3))
    assert result["runs"] == {"rows": 17, "valid": 16, "missing": 1}


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("design", "box-behnken", "--factors", "nowhere"), "neither a file"),
        (("design", "box-behnken", "--factors", "sunflower_extract", "--sigma", "-1"), "--sigma -1: allowed"),
        (("design", "factorial", "--factors", "sunflower_extract", "--generator", "C=A"), "generator 'C=A'"),
        (("design", "plackett-burman", "--factors", "sunflower_extract", "--runs", "10"), "allowed are 8, 12"),
    ],
)
def test_bad_orders_of_a_design_leave_no_file(tmp_path, arguments, message):
    out = tmp_path / "runs.csv"
    assert message in refused(explorer(*arguments, "--out", out))
    assert not out.exists()


def test_a_workbook_and_a_sheet_with_decimal_commas_hold_the_same_runs(tmp_path, process):
    """Read back by the table reader, and the numbers of the workbook as numbers by openpyxl."""
    import openpyxl

    process.write_text(PROCESS.replace('"yield"', '"yield [%]"').replace("80", "80.5") + SOLVENT, encoding="utf-8")
    names = {"a.csv": (), "b.csv": ("--decimal-comma",), "c.xlsx": ()}
    sheets = {}
    for name, options in names.items():
        order = ("design", "factorial", "--factors", process, *options, "--out", tmp_path / name)
        assert explorer(*order).exit_code == 0
        sheet = read_sheet(tmp_path / name)
        levels = [[sheet.level(k, factor) for factor in sheet.factors] for k in range(len(sheet.cells))]
        sheets[name] = (sheet.factors, sheet.units, levels)
        assert sheet.responses == ["yield"]
        assert sheet.units["yield"] == "%"
    assert sheets["a.csv"] == sheets["b.csv"] == sheets["c.xlsx"]
    text = (tmp_path / "b.csv").read_bytes().decode("utf-8")
    assert text.startswith("\ufeff# design")
    assert "row;replicate;run;seed;time [min];temperature [°F];solvent;yield [%]" in text
    assert ";80,5;" in text
    page = openpyxl.load_workbook(tmp_path / "c.xlsx").active
    time = [row[4] for row in page.iter_rows(min_row=6, values_only=True)]
    assert set(time) == {80.5, 90.0}
    both = ("design", "factorial", "--factors", process, "--decimal-comma", "--out", tmp_path / "d.xlsx")
    assert "for the workbook" in refused(explorer(*both))


def test_a_workbook_is_analysed_as_the_sheet_is(tmp_path):
    import openpyxl

    factors = many_factors(tmp_path, 4)
    made_sheet, _ = made(tmp_path, "factorial", "--factors", factors, "--standard-order")
    book_file = tmp_path / "runs.xlsx"
    explorer("design", "factorial", "--factors", factors, "--standard-order", "--out", book_file)
    book = openpyxl.load_workbook(book_file)
    for row, value in zip(book.active.iter_rows(min_row=7), FILTRATION_RATE, strict=True):
        row[-1].value = value
    book.save(book_file)
    by_book, by_sheet = analysed(book_file), analysed(fill(made_sheet, FILTRATION_RATE))
    assert by_book["analysis"] == by_sheet["analysis"]


def test_a_sheet_is_not_written_over(tmp_path):
    path, _ = made(tmp_path, "box-behnken", "--factors", "sunflower_extract")
    before = path.read_text(encoding="utf-8")
    assert "exists already" in refused(
        explorer("design", "box-behnken", "--factors", "sunflower_extract", "--out", path)
    )
    assert path.read_text(encoding="utf-8") == before
    assert "every cell is empty" in refused(explorer("analyse", path))


@pytest.mark.parametrize(
    "options, message",
    [
        (("--response", "angle"), "no such column; the responses are angle_of_repose_deg"),
        (("--model", "linear", "--terms", "A"), "--terms: given together with --model"),
        (("--terms", "A,Q"), "--terms: no factor 'Q'"),
        (("--terms", "A*B*C"), "--terms A*B*C: allowed: factors"),
        (("--only", "x"), "--only x: no such factor"),
        (("--target", "nan"), "--target nan: allowed"),
        (("--target-error", "2"), "--target-error: allowed only with --target"),
    ],
)
def test_bad_orders_of_an_analysis_get_one_line(options, message):
    assert message in refused(explorer("analyse", "sunflower_extract", *options))


def test_runs_that_can_bear_nothing_are_named_with_their_file(tmp_path, process):
    path, _ = made(tmp_path, "box-behnken", "--factors", many_factors(tmp_path, 3))
    assert "runs.csv, column response: responses: 3 valid runs" in refused(explorer("analyse", fill(path, (1, 2, 3))))
