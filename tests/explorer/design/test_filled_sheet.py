"""The factors file and the sheet of a design: what is written is read again, and bad files get one clear line."""

import numpy as np
import pytest

from doe.designs import box_behnken
from doe.errors import StatisticsError
from explorer.design.choices import Alpha
from explorer.design.factors_file import read_factors, region_of
from explorer.design.filled_sheet import read_sheet, runs_of
from explorer.design.run_plan import DesignOrder, make_plan, sheet_text
from explorer.errors import CommandError
from solver.assets import asset_path

FACTORS = """
title = "Cement"
responses = ["strength", "slump"]

[[factor]]
name = "temperature"
low = 150
high = 180
unit = "°C"
reference = 160

[[factor]]
name = "time"
low = 0.1
high = 0.3

[[factor]]
name = "pH-value"
low = -1.5
high = 2
unit = "1"
"""
SHEET = """# factor | temperature | 150 | 180 | °C | 160
# factor | time | 1 | 3 | h
row,replicate,run,temperature [°C],time [h],strength [MPa]
1,1,3,150,1,10.5
2,1,1,180,1,11.5
3,1,2,150,3,12.5
4,1,4,180,3,13.5
1,2,5,150,1,10.9
"""


def factors_file(folder, text=FACTORS):
    path = folder / "factors.toml"
    path.write_text(text, encoding="utf-8")
    return path


def sheet_file(folder, text=SHEET):
    path = folder / "runs.csv"
    path.write_text(text, encoding="utf-8")
    return path


def filled(text, values):
    """The sheet with ``values`` in the first response, line by line."""
    lines = text.splitlines()
    runs = [k for k, line in enumerate(lines) if not line.startswith("#")][1:]
    for k, value in zip(runs, values, strict=True):
        cells = lines[k].split(",")
        cells[-2] = str(value)
        lines[k] = ",".join(cells)
    return "\n".join(lines)


@pytest.mark.parametrize(
    "order",
    [
        DesignOrder("plackett-burman", replicates=2, centre=2, fold=True),
        DesignOrder("box-behnken"),
        DesignOrder("central-composite", alpha=Alpha.INSCRIBED),
        DesignOrder("factorial", generators=("C=AB",), replicates=3),
        DesignOrder("lhs", runs=12),
        DesignOrder("sobol", runs=16),
        DesignOrder("central-composite", blocks=3),
    ],
    ids=lambda order: order.design,
)
def test_a_design_is_read_from_its_sheet_as_it_was_made(tmp_path, order):
    file = read_factors(factors_file(tmp_path))
    plan = make_plan(order, file)
    values = np.arange(len(plan.sequence)) + 0.25
    text = filled(sheet_text(plan, file), values)
    runs = runs_of(read_sheet(sheet_file(tmp_path, text)), "strength", block="block" if order.blocks else "")
    assert runs.design == order.design
    assert runs.factors == file.factors
    assert runs.coded == pytest.approx(plan.coded, abs=1e-9)  # twelve digits of a level
    assert runs.responses.shape == (len(plan.coded), plan.replicates)
    position = {tuple(pair): k for k, pair in enumerate(plan.sequence.tolist())}
    expected = [[values[position[row, r]] for r in range(plan.replicates)] for row in range(len(plan.coded))]
    # Replicates stand in the order in which they were run.
    assert np.array_equal(runs.responses, np.sort(expected, axis=1))


def test_levels_of_a_sheet_are_exactly_low_middle_and_high_again(tmp_path):
    file = read_factors(factors_file(tmp_path))
    plan = make_plan(DesignOrder("box-behnken"), file)
    runs = runs_of(read_sheet(sheet_file(tmp_path, filled(sheet_text(plan, file), range(17)))), "strength")
    assert np.array_equal(runs.coded, box_behnken(3, 5))


def test_order_of_the_runs_is_shuffled_by_its_seed_and_seeds_stay_with_their_runs(tmp_path):
    file = read_factors(factors_file(tmp_path))
    one, again, other = (make_plan(DesignOrder("factorial", replicates=2, seed=seed), file) for seed in (1, 1, 2))
    assert np.array_equal(one.sequence, again.sequence)
    assert not np.array_equal(one.sequence, other.sequence)
    in_order = make_plan(DesignOrder("factorial", replicates=2, standard_order=True), file)
    assert in_order.sequence[:, 0].tolist() == [*range(8), *range(8)]
    of_run = {tuple(pair): seed for pair, seed in zip(in_order.sequence.tolist(), in_order.seeds.tolist(), strict=True)}
    assert len(set(of_run.values())) == 16
    for pair, seed in zip(one.sequence.tolist(), one.seeds.tolist(), strict=True):
        assert of_run[tuple(pair)] == seed


def test_the_files_own_numbers_hold_until_an_option_says_otherwise(tmp_path):
    text = "replicates = 2\ncentre = 3\nseed = 9\nfirst_seed = 100\n" + FACTORS
    file = read_factors(factors_file(tmp_path, text))
    plan = make_plan(DesignOrder("box-behnken"), file)
    assert len(plan.sequence) == (12 + 3) * 2
    assert sorted(plan.seeds.tolist()) == list(range(100, 130))
    assert len(make_plan(DesignOrder("box-behnken", replicates=1, centre=5), file).sequence) == 17


def test_shipped_sheet_is_table_8(tmp_path):
    runs = runs_of(read_sheet(asset_path("runs", "sunflower_extract")), "angle_of_repose_deg")
    table = np.genfromtxt(asset_path("source_tables", "table8_box_behnken"), delimiter=",", skip_header=1)
    assert np.array_equal(runs.coded, table[:, 1:4])
    assert np.array_equal(runs.responses[:, 0], table[:, 4])
    assert runs.factors == read_factors(asset_path("designs", "sunflower_extract")).factors
    table_7 = np.genfromtxt(asset_path("source_tables", "table7_steepest_ascent"), delimiter=",", skip_header=1)
    region = region_of(runs.factors)
    assert region.natural([[-1] * 3, [0] * 3, [1] * 3]) == pytest.approx(table_7[1:4, 1:4], rel=1e-12)


def test_replicates_of_a_row_stand_together_whatever_their_order(tmp_path):
    runs = runs_of(read_sheet(sheet_file(tmp_path)), "strength")
    assert runs.unit == "MPa"
    assert runs.coded.tolist() == [[-1, -1], [1, -1], [-1, 1], [1, 1]]
    assert runs.responses[0].tolist() == [10.5, 10.9]
    assert np.isnan(runs.responses[1:, 1]).all()
    assert runs.labels[0] == ("3", "5")


def test_spreadsheet_with_semicolons_decimal_commas_and_a_byte_order_mark(tmp_path):
    text = SHEET.replace(",", ";").replace(".", ",")
    text = text.replace(
        "# factor | temperature | 150 | 180 | °C | 160", '"# factor | temperature | 150 | 180 | °C | 160";;;;;'
    )
    path = tmp_path / "runs.csv"
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    runs = runs_of(read_sheet(path), "strength")
    assert runs.responses[0].tolist() == [10.5, 10.9]
    assert [factor.unit for factor in runs.factors] == ["°C", "h"]


def test_missing_runs_are_counted_and_levels_may_be_other_than_planned(tmp_path):
    text = SHEET.replace("2,1,1,180,1,11.5", "2,1,1,180,1,").replace("3,1,2,150,3,", "3,1,2,156,3,")
    runs = runs_of(read_sheet(sheet_file(tmp_path, text)), "strength")
    assert runs.missing == 1
    assert runs.coded[2].tolist() == pytest.approx([-0.6, 1.0])


def test_rows_whose_levels_differ_are_not_taken_for_replicates(tmp_path):
    runs = runs_of(read_sheet(sheet_file(tmp_path, SHEET.replace("1,2,5,150,1", "1,2,5,151,1"))), "strength")
    assert runs.responses.shape == (5, 1)


def test_any_csv_is_read_with_a_factors_file_beside_it(tmp_path):
    factors = read_factors(factors_file(tmp_path)).factors[:1]
    runs = runs_of(read_sheet(sheet_file(tmp_path, "temperature,y\n150,1\n\n180,2\n150,1.5\n"), factors), "y")
    assert runs.responses[:, 0].tolist() == [1.0, 2.0, 1.5]
    assert runs.labels[1] == ("line 4",)


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("180,1,11.5", "180,1,abc", "line 5, column strength: 'abc' is not a number"),
        ("180,1,11.5", "180,1,1_1", "line 5, column strength: '1_1' is not a number"),
        ("180,1,11.5", "180,1,inf", "line 5, column strength: 'inf' is not a number"),
        ("180,1,11.5", "18O,1,11.5", "line 5, column temperature: '18O' is not a number"),
        ("180,1,11.5", ",1,11.5", "line 5, column temperature: is empty"),
        ("180,1,11.5", "180,1,11.5,7", "line 5: 7 cells; allowed: 6"),
        ("temperature [°C]", "temperature [K]", "column temperature is in [K], the factor in [°C]"),
        ("temperature [°C]", "Temperature [°C]", "no column 'temperature'; the columns are row"),
        ("time [h]", "temperature [°C]", "column 'temperature' appears twice"),
        ("| 150 | 180 |", "| 180 | 150 |", "line 1: factor.high: 150 is not above low 180"),
        ("| 150 | 180 |", "| low | 180 |", "line 1: 'low' is not a number"),
        ("| 150 | 180 | °C | 160", "", "line 1: allowed: '# factor | name | low | high"),
        ("# factor | time", "# factor | temperature", "'temperature' appears twice"),
    ],
)
def test_a_cell_that_cannot_be_read_is_named_by_line_and_column(tmp_path, old, new, message):
    assert old in SHEET
    with pytest.raises(CommandError) as refusal:
        runs_of(read_sheet(sheet_file(tmp_path, SHEET.replace(old, new, 1))), "strength")
    assert message in str(refusal.value)
    assert "runs.csv" in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "content, message",
    [
        (b"", "no line '# factor"),
        (b"# factor | x | 0 | 1\n", "no header line"),
        (b"# factor | x | 0 | 1\nx,y\n", "no line with a run"),
        (b"# factor | x | 0 | 1\nx,y\n" + b"1" * 140_000 + b",2\n", "line 3: cannot be read as cells"),
        (b"# factor | x | 0 | 1\nx,y\n0,\n1,\n", "column y: every cell is empty"),
        (b"\xff\xfe\x00", "neither text nor a workbook"),
        (b"PK\x00\x03", "neither text nor a workbook"),
    ],
)
def test_a_file_that_is_no_filled_sheet_gets_one_line(tmp_path, content, message):
    path = tmp_path / "runs.csv"
    path.write_bytes(content)
    with pytest.raises(CommandError, match=message):
        runs_of(read_sheet(path), "y")


def test_a_response_or_factor_that_is_not_there_is_answered_with_those_that_are(tmp_path):
    sheet = read_sheet(sheet_file(tmp_path))
    with pytest.raises(CommandError, match="--response slump: no such column; the responses are strength"):
        runs_of(sheet, "slump")
    with pytest.raises(CommandError, match="--only acid: no such factor; the factors are temperature, time"):
        runs_of(sheet, "strength", ["acid"])


def test_a_response_that_would_be_markup_is_refused(tmp_path):
    sheet = read_sheet(sheet_file(tmp_path, SHEET.replace("strength [MPa]", "<b>strength")))
    with pytest.raises(CommandError, match="no < > & or quotes"):
        runs_of(sheet, "<b>strength")


@pytest.mark.parametrize(
    "old, new, message",
    [
        ('name = "time"', 'name = "ti me"', r"factor\[2\].name: 'ti me'; allowed"),
        ('name = "time"', 'name = "temperature"', "'temperature' appears twice"),
        ('name = "time"', 'name = "run"', "is a reserved column name"),
        ("low = 0.1", "low = 0.3", r"factor\[2\].high: 0.3 is not above low 0.3"),
        ("low = 0.1", 'low = "0.1"', r"factor\[2\].low: '0.1' is not a number"),
        ("low = 0.1", "lower = 0.1", r"factor\[2\].lower: unknown key"),
        ('"strength"', '"strength [M|a]"', r"responses: unit of 'strength \[M\|a\]'; allowed"),
        ("low = 0.1", "", r"factor\[2\].low: missing"),
        ("low = 0.1", 'levels = ["a"]\nlow = 0.1', r"factor\[2\].low: 0.1 together with levels \(time\); allowed: one"),
        ("low = 0.1\nhigh = 0.3", 'levels = ["a"]', r"factor\[2\].levels: \['a'\]; allowed: two or more different"),
        ("low = 0.1\nhigh = 0.3", 'levels = ["a", "7"]', r"factor\[2\].levels: '7'; allowed: names"),
        ('unit = "°C"', 'unit = "a|b"', r"factor\[1\].unit: 'a\|b'"),
        ("high = 180", "high = inf", r"factor\[1\].high: inf is not a number"),
        ('responses = ["strength", "slump"]', "responses = []", "responses: "),
        ('responses = ["strength", "slump"]', 'responses = ["time"]', "'time' appears twice"),
        ('title = "Cement"', "title = 3", "title: 3"),
        ('title = "Cement"', "replicates = 0", "replicates: 0 is not a whole number of at least 1"),
        ('title = "Cement"', "[[factor", "Expected"),
    ],
)
def test_a_bad_factors_file_gets_one_line_with_its_key(tmp_path, old, new, message):
    assert old in FACTORS
    with pytest.raises(CommandError, match=message) as refusal:
        read_factors(factors_file(tmp_path, FACTORS.replace(old, new, 1)))
    assert str(refusal.value).startswith(str(tmp_path / "factors.toml"))


@pytest.mark.parametrize(
    "order, message",
    [
        (DesignOrder("box-behnken", runs=20), "--runs: is not for box-behnken"),
        (DesignOrder("lhs", fold=True), "--fold: is not for lhs"),
        (DesignOrder("sobol", centre=3), "--centre: is not for sobol"),
        (DesignOrder("lhs", generators=("C=AB",)), "--generator: is not for lhs"),
        (DesignOrder("factorial", generators=("C=AB",), fraction=1), "fraction: given together with"),
        (DesignOrder("factorial", alpha=Alpha.INSCRIBED), "--alpha: is not for factorial"),
        (DesignOrder("lhs", runs=30_000), "--runs 30000; allowed: up to"),
        (DesignOrder("factorial", replicates=9000), "allowed: up to 20000 runs"),
        (DesignOrder("lhs", blocks=2), "--blocks: is not for lhs; allowed with: .*, or 2 replicates of any design"),
        (DesignOrder("box-behnken", blocks=2), "no number of blocks is orthogonal .*; or .* --replicates 2 --blocks 2"),
        (DesignOrder("factorial", nonregular=True), "--nonregular: is not for factorial"),
    ],
)
def test_an_option_of_another_design_is_refused(tmp_path, order, message):
    with pytest.raises((CommandError, StatisticsError), match=message):
        make_plan(order, read_factors(factors_file(tmp_path)))


def test_runs_of_a_block_stand_together_and_are_shuffled_within(tmp_path):
    file = read_factors(factors_file(tmp_path))
    plan = make_plan(DesignOrder("factorial", blocks=2, replicates=3), file)
    assert plan.block.tolist() == [0] * 12 + [1] * 12
    product = plan.coded[plan.sequence[:, 0]].prod(axis=1)
    assert (product[:12] == -product[12:]).all()
    assert not np.array_equal(plan.sequence[:12, 0], np.sort(plan.sequence[:12, 0]))
    header, first = [line for line in sheet_text(plan, file).splitlines() if line[0] != "#"][:2]
    assert header.startswith("row,replicate,run,seed,block,")
    assert first.split(",")[4] == "1"


def test_blocks_of_whole_replicates_hold_every_row_of_any_design(tmp_path):
    plan = make_plan(DesignOrder("box-behnken", blocks=2, replicates=4), read_factors(factors_file(tmp_path)))
    for block in (0, 1):
        rows = plan.sequence[plan.block == block, 0]
        assert np.array_equal(np.bincount(rows), np.full(17, 2))


FINISHED = (
    "# factor | a | 0 | 1\n# factor | b | 0 | 1\nrow,seed,a,b,y\n1,11,0,0,1.5\n2,40,1,0,2\n3,13,0,1,3\n4,,1,1,4\n"
)


def augmented(folder, sheet, **order):
    text = 'responses = ["y"]\n' + "".join(f'[[factor]]\nname = "{name}"\nlow = 0\nhigh = 1\n' for name in "ab")
    file = read_factors(factors_file(folder, text))
    return make_plan(DesignOrder("d-optimal", augment=sheet_file(folder, sheet), runs=4, **order), file)


def test_finished_runs_keep_their_seeds_and_new_ones_count_on(tmp_path):
    seeds = augmented(tmp_path, FINISHED).seeds.tolist()
    assert seeds[:3] == [11, 40, 13]
    assert sorted(seeds[3:]) == [41, 42, 43, 44, 45]  # the fourth had none
    assert sorted(augmented(tmp_path, FINISHED.replace("seed", "day")).seeds.tolist()) == list(range(1, 9))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("1,11,0,0,1.5", '1,11,0,0,"1,5"', "line 4, column y: '1,5' is not a number"),
        ("1,11,0,0,1.5", "1,0.5,0,0,1.5", "line 4, column seed: 0.5; allowed: a whole number"),
        ("1,11,0,0,1.5", "1,-4,0,0,1.5", "line 4, column seed: -4; allowed: a whole number"),
    ],
)
def test_a_finished_run_that_cannot_be_read_is_named_by_line_and_column(tmp_path, old, new, message):
    with pytest.raises(CommandError, match=message):
        augmented(tmp_path, FINISHED.replace(old, new))


def test_a_factor_called_block_is_refused_where_there_are_blocks(tmp_path):
    file = read_factors(factors_file(tmp_path, FACTORS.replace('"strength"', '"block"')))
    assert len(make_plan(DesignOrder("factorial"), file).block) == 0
    with pytest.raises(CommandError, match="the sheet needs the column 'block', a name in the factors file"):
        make_plan(DesignOrder("factorial", blocks=2), file)


def test_a_table_with_too_few_columns_is_refused(tmp_path):
    more = "".join(f'[[factor]]\nname = "f{k}"\nlow = 0\nhigh = 1\n' for k in range(6))
    file = read_factors(factors_file(tmp_path, FACTORS + more))
    with pytest.raises(StatisticsError, match="runs = 8: has 7 columns for 9 factors; allowed: at least 12"):
        make_plan(DesignOrder("plackett-burman", runs=8), file)
    assert len(make_plan(DesignOrder("plackett-burman"), file).coded) == 12
