"""Cells, comments and numbers of a table in every dialect that a spreadsheet writes, and of a workbook."""

import math
import re

import openpyxl
import pytest

from doe.table_file import check_cells, csv_table, read_table, read_text


def table(text, **more):
    return csv_table(text, lambda line, what: ValueError(f"line {line}: {what}"), **more)


@pytest.mark.parametrize(
    ("text", "number"),
    [("name,x\na,1.5\n", "1.5"), ("name;x\na;1,5\n", "1,5"), ("name\tx\na\t1,5\n", "1,5"), ("name;x\na;1.5\n", "1.5")],
)
def test_the_header_says_what_stands_between_cells_and_whether_a_comma_is_decimal(text, number):
    found = table(text)
    assert found.rows == ((1, ["name", "x"]), (2, ["a", number]))
    assert found.number(number) == 1.5


def test_a_comma_is_no_decimal_sign_where_it_stands_between_cells():
    found = table('name,x\na,"1,5"\n')
    assert found.rows[1] == (2, ["a", "1,5"])
    assert math.isnan(found.number("1,5"))


def test_below_a_header_of_one_name_a_comma_is_decimal():
    found = table("angle_deg\n24,1\n25.3\n")
    assert found.rows == ((1, ["angle_deg"]), (2, ["24,1"]), (3, ["25.3"]))
    assert [found.number(cells[0]) for _, cells in found.rows[1:]] == [24.1, 25.3]


def test_a_row_with_another_number_of_cells_than_the_header_is_named():
    check_cells(table("x,y\n1,2\n3,\n"), AssertionError)
    for row, count in (("6,1,40", 3), ("6", 1)):
        with pytest.raises(ValueError, match=f"^line 3: {count} cells; allowed: 2, one per column"):
            check_cells(table(f"x,y\n1,2\n{row}\n"), lambda line, what: ValueError(f"line {line}: {what}"))


@pytest.mark.parametrize("text", ["", "steep", "nan", "inf", "1_000", "1.234,5", "1,2,3", "1e999", "0x10"])
def test_what_is_no_finite_number_is_nan(text):
    assert math.isnan(table("name;x\n").number(text))


def test_a_typographic_minus_is_a_minus():
    assert table("x,y\n").number("−1.5") == table("x;y\n").number("−1,5") == -1.5


def test_comments_are_kept_apart_also_quoted_and_filled_up_by_a_spreadsheet():
    text = '# plain\n"# factor | a | 0,5; or so";;;\n  # padded;;;\nx;y\n1;2\n#3;4\n'
    found = table(text)
    assert found.comments == ((1, "# plain"), (2, "# factor | a | 0,5; or so"), (3, "# padded"), (6, "#3;4"))
    assert [line for line, _ in found.rows] == [4, 5]


def test_a_comment_behind_a_row_ends_it_only_where_that_is_asked_for():
    text = 'x,y # one, two; three; four; "five"\n1,2 # said, "so"\n3,"# four"\n'
    assert table(text, trailing_comments=True).rows == ((1, ["x", "y"]), (2, ["1", "2"]), (3, ["3", "# four"]))
    assert table("x,y\n1,no #2\n").rows[1] == (2, ["1", "no #2"])


def test_empty_rows_and_columns_that_a_spreadsheet_adds_are_left_out():
    found = table(";;;\nx;y;;\n\n1;2;;\n;;;\n3;;;\n4;5;;6\n")
    assert found.rows == ((2, ["x", "y"]), (4, ["1", "2"]), (6, ["3", ""]), (7, ["4", "5", "", "6"]))


def test_a_row_over_several_lines_is_named_by_its_first():
    assert table('x,y\n1,"two\nlines"\n3,4\n').rows[1:] == ((2, ["1", "two\nlines"]), (4, ["3", "4"]))


def test_a_quote_that_never_ends_is_refused_by_the_line_where_it_begins():
    with pytest.raises(ValueError, match=r"^line 3: cannot be read as cells: "):
        table('x,y\n1,2\n3,"4\n5,6\n')


def test_nothing_but_comments_has_no_rows():
    assert table("# only\n\n").rows == table("").rows == ()


SAID = "# Versuch für Ölsaat\nname;x\nä;1,5\n"


@pytest.mark.parametrize(
    "content",
    [
        SAID.encode(),
        b"\xef\xbb\xbf" + SAID.encode(),
        SAID.encode("cp1252"),
        SAID.encode("utf-16"),
        b"\xfe\xff" + SAID.encode("utf-16-be"),
        SAID.replace("\n", "\r\n").encode("cp1252"),
    ],
    ids=["utf-8", "utf-8 with a mark", "cp1252", "utf-16", "utf-16 big endian", "Windows"],
)
def test_a_file_is_read_in_whatever_characters_it_was_saved(tmp_path, content):
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    found = read_table(path, 1000, ValueError)
    assert found.rows == ((2, ["name", "x"]), (3, ["ä", "1,5"]))
    assert found.comments == ((1, "# Versuch für Ölsaat"),)
    assert read_text(path, 1000, ValueError) == SAID


def test_a_workbook_is_read_by_its_first_sheet(tmp_path):
    book = openpyxl.Workbook()
    for row in (["# Versuch"], ["name", "x", None], [], ["ä", 1.5], ["b", 2], ["c", "1e-3", None, "odd"]):
        book.active.append(row)
    book.create_sheet("other").append(["name", "y"])
    book.save(tmp_path / "t.xlsx")
    found = read_table(tmp_path / "t.xlsx", 100_000, ValueError)
    assert found.comments == ((1, "# Versuch"),)
    assert found.rows == (
        (2, ["name", "x"]),
        (4, ["ä", "1.5"]),
        (5, ["b", "2"]),
        (6, ["c", "1e-3", "", "odd"]),
    )
    assert [found.number(cells[1]) for _, cells in found.rows[1:]] == [1.5, 2.0, 1e-3]


def refused(path, most=100):
    with pytest.raises(ValueError, match=re.escape(str(path))) as caught:
        read_table(path, most, ValueError)
    return str(caught.value)


@pytest.mark.parametrize("content", [b"a\0b", b"\xff\xfe\x00", b"\x81\xff"])
def test_what_is_no_text(tmp_path, content):
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    assert refused(path) == f"{path}: neither text nor a workbook (.xlsx)"
    path = tmp_path / "t.xlsx"
    path.write_bytes(content)
    assert refused(path).startswith(f"{path}: cannot be read as a workbook: ")


def test_too_large_missing_and_a_folder(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("x" * 101)
    assert refused(path) == f"{path}: 101 bytes; allowed: up to 100"
    assert refused(tmp_path / "none") == f"{tmp_path / 'none'}: no such file"
    assert refused(tmp_path, most=10**6) == f"{tmp_path}: Is a directory"


def test_a_line_is_named_as_it_is_asked_for(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text('x,y\n1,"2\n')
    with pytest.raises(ValueError, match=re.escape(f"{path}, row 2: cannot be read as cells")):
        read_table(path, 100, ValueError, ", row {}")
