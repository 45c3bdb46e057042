"""Tables on a port of their own: who is let in, what a browser may write into a sheet, and runs that are left out."""

import asyncio
import csv
import io
import sys

import pytest

from explorer.design.analysis import AnalyseOrder, run_analyse
from explorer.design.filled_sheet import read_sheet
from explorer.errors import CommandError
from explorer.viewer.actions import Actions
from explorer.viewer.guarded_server import token_cookie
from explorer.viewer.shell.web_pages import WebPages
from explorer.viewer.tables import table_server
from explorer.viewer.tables.ranges_page import RangeRow, entered_ranges
from explorer.viewer.tables.sheet_page import column_definitions, filled_sheet, rows_of
from explorer.viewer.tables.table_server import MISSING, TableGuard, TablePage, TableServer, done_by
from solver.assets import asset_path

PORT = 4711
HOST = f"127.0.0.1:{PORT}"
TOKEN = "a token of the page"
FRIENDLY = {"host": HOST, "origin": f"http://{HOST}", "sec-fetch-site": "same-origin"}


def answer(kind, headers, token=None):
    """The status of an HTTP request, or how a WebSocket is met."""
    sent = []

    async def application(scope, receive, send):
        opening = "websocket.accept" if scope["type"] == "websocket" else "http.response.start"
        await send({"type": opening, "status": 200, "headers": []})

    async def send(message):
        sent.append(message)

    scope = {"type": kind, "headers": [(key.encode(), value.encode()) for key, value in headers.items()]}
    asyncio.run(TableGuard(application, PORT, token)(scope, None, send))
    return sent[0].get("status") if kind == "http" else sent[0]["type"].removeprefix("websocket.")


@pytest.mark.parametrize(
    ("changes", "status"),
    [
        ({}, 200),
        ({"host": f"localhost:{PORT}", "origin": f"http://localhost:{PORT}"}, 200),
        ({"host": f"evil.example:{PORT}"}, 421),
        ({"host": "127.0.0.1"}, 421),
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "http://127.0.0.1:8080"}, 403),
        ({"origin": "null"}, 403),
        ({"sec-fetch-site": "cross-site"}, 403),
        ({"sec-fetch-site": "same-site"}, 403),
        ({"sec-fetch-site": "same-site", "sec-fetch-mode": "navigate"}, 200),
    ],
)
def test_only_pages_of_its_own_and_links_of_this_machine_are_served(changes, status):
    assert answer("http", FRIENDLY | changes) == status


def test_a_socket_needs_the_origin_of_its_page():
    assert answer("websocket", FRIENDLY) == "accept"
    assert answer("websocket", {"host": HOST}) == "close"
    assert answer("websocket", FRIENDLY | {"origin": "http://127.0.0.1:8080"}) == "close"


def test_the_token_of_the_page_is_asked_for_here_too():
    cookie = "=".join(token_cookie(TOKEN))
    assert answer("http", FRIENDLY, TOKEN) == 401
    assert answer("websocket", FRIENDLY, TOKEN) == "close"
    assert answer("http", FRIENDLY | {"cookie": cookie[:-1]}, TOKEN) == 401
    assert answer("http", FRIENDLY | {"cookie": f"other=1; {cookie}"}, TOKEN) == 200


def test_what_the_page_refuses_is_told_where_it_was_asked():
    def refuse():
        raise CommandError("no: allowed is yes")

    actions = Actions()

    async def told(act):
        done = asyncio.create_task(done_by(actions.post, act))
        await asyncio.sleep(0)  # until it is posted
        notice = actions.carry_out()
        return await done, notice

    assert asyncio.run(told(refuse)) == ("no: allowed is yes", "no: allowed is yes")
    assert asyncio.run(told(lambda: None)) == ("", "")


def test_without_the_extra_the_page_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    pages = WebPages("Pour")
    tables = TableServer(pages, None)
    address = tables.publish(TablePage("sheet", "Sheet", lambda: None))
    pages.page(address)
    tables.close()
    assert MISSING.encode() in pages.page(address).body


RANGES = [RangeRow("X4", "shear modulus seed", "MPa", (40.1, 70.5, 56.3)), RangeRow("X7", "restitution", "", (0, 1, 1))]


def test_ranges_are_read_with_a_comma_or_a_point_in_any_order():
    sent = [
        {"name": "X7", "low": "0,5", "high": 1, "measured": "0.75"},
        {"name": "X4", "low": "40.1", "high": "70,5", "measured": " 56.3 "},
    ]
    assert entered_ranges(RANGES, sent) == {"X4": (40.1, 70.5, 56.3), "X7": (0.5, 1.0, 0.75)}


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        ([{"name": "X4", "low": "soft", "high": "1", "measured": "1"}], "X4, low: 'soft' is not a number"),
        ([{"name": "X4", "low": None, "high": "1", "measured": "1"}], "X4, low: 'None' is not a number"),
        ([{"name": "X4", "low": "nan", "high": "1", "measured": "1"}], "X4, low: 'nan' is not a number"),
        ([{"name": "X7"}, "X4"], "X4: is no longer in the table"),
    ],
)
def test_ranges_that_are_no_numbers_are_refused(sent, words):
    with pytest.raises(CommandError, match=words):
        entered_ranges(RANGES, sent)


def test_what_is_carried_out_too_late_is_not_done_and_harms_nobody(monkeypatch):
    monkeypatch.setattr(table_server, "REPLY", 0.01)
    actions, done = Actions(), []
    assert "has not answered" in asyncio.run(done_by(actions.post, lambda: done.append("late")))
    assert actions.carry_out() == ""
    assert done == []


def test_what_keeps_the_server_from_starting_is_told(monkeypatch):
    def busy(*arguments):
        raise OSError(98, "Address already in use")

    monkeypatch.setattr(table_server.TableServer, "_run", busy)
    pages = WebPages("Pour")
    tables = TableServer(pages, None)
    address = tables.publish(TablePage("sheet", "Sheet", lambda: None))
    pages.page(address)
    tables.close()
    assert b"Tables cannot be served ([Errno 98] Address already in use)" in pages.page(address).body


SHEET = """# factor | a | 0 | 1 | m
# factor | b | 0 | 1 | m
row;run;a [m];b [m];angle_deg;who
1;2;0;0;;Ann
2;1;1;0;20,5;Bob
3;4;0;1;21,5;Ann
4;3;1;1;23,5;Bob
"""


@pytest.fixture
def sheet(tmp_path):
    path = tmp_path / "runs.csv"
    path.write_text(SHEET, encoding="utf-8")
    return read_sheet(path)


def place(sheet, name):
    return next(one["field"] for one in column_definitions(sheet) if one["headerName"].split(" [")[0] == name)


def test_results_and_reasons_are_written_whatever_the_order_on_the_screen(sheet, tmp_path):
    rows = rows_of(sheet)
    rows[0][place(sheet, "angle_deg")] = "19,25"
    rows[3][place(sheet, "excluded")] = 'spilled,  twice; "sorry"'
    rows[1][place(sheet, "a")] = "7"  # not a column that is filled in: a browser may send anything
    name, content = filled_sheet(sheet, rows[::-1])
    assert name == "runs_filled.csv"
    path = tmp_path / name
    path.write_bytes(content)
    again = read_sheet(path)
    assert [again.number(k, "angle_deg") for k in range(4)] == [19.25, 20.5, 21.5, 23.5]
    assert [again.number(k, "a") for k in range(4)] == [0, 1, 0, 1]
    assert [again.why_excluded(k) for k in range(4)] == ["", "", "", 'spilled, twice; "sorry"']
    assert again.factors == sheet.factors
    assert filled_sheet(again, rows_of(again)) == (name, content)


def test_a_row_that_would_become_a_comment_is_not_written(tmp_path):
    path = tmp_path / "runs.csv"
    path.write_text("# factor | a | 0 | 1 | m\nwho,a [m],angle_deg\nAnn,0,20\nBob,1,21\n", encoding="utf-8")
    sheet = read_sheet(path)
    rows = rows_of(sheet)
    rows[0]["0"] = "#1"
    with pytest.raises(CommandError, match="begins a row with #"):
        filled_sheet(sheet, rows)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: rows[2].update({"4": "steep"}), "line 6, angle_deg: 'steep' is not a number"),
        (lambda rows: rows[2].update({"6": "x" * 201}), "line 6, excluded: 201 characters; allowed: up to 200"),
        (lambda rows: rows.pop(), "these are not its rows"),
        (lambda rows: rows.__setitem__(0, "row"), "these are not its rows"),
    ],
)
def test_what_cannot_be_written_is_refused_in_one_line(sheet, change, words):
    rows = rows_of(sheet)
    change(rows)
    with pytest.raises(CommandError) as refused:
        filled_sheet(sheet, rows)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_words_are_entered_in_a_column_of_words_and_what_nobody_changed_stays(tmp_path):
    path = tmp_path / "runs.csv"
    long = "see  page 4 " + "and so on " * 30 + "end"
    lines = ["# factor | a | 0 | 1 | m", "a [m],angle_deg,note,batch,who", f"0,20,{long},A1,", "1,21,,7,"]
    path.write_text("\n".join(lines), encoding="utf-8")
    sheet = read_sheet(path)
    rows = rows_of(sheet)
    rows[1].update({"2": "wet", "3": "A2", "4": "Ann"})
    name, content = filled_sheet(sheet, rows)
    (tmp_path / name).write_bytes(content)
    assert [cells[:5] for cells in read_sheet(tmp_path / name).cells] == [
        ("0", "20", long, "A1", ""),
        ("1", "21", "wet", "A2", "Ann"),
    ]


@pytest.mark.parametrize("flag", ["0", "1", "no", "TRUE", "x"])
def test_a_flag_is_no_reason(tmp_path, flag):
    path = tmp_path / "runs.csv"
    path.write_text(f"# factor | a | 0 | 1 | m\na [m],angle_deg,excluded\n0,20,{flag}\n1,21,\n", encoding="utf-8")
    with pytest.raises(CommandError, match=f"line 3, column excluded: '{flag}' is not a reason"):
        run_analyse(AnalyseOrder(sheet=str(path)))


def test_a_run_that_is_left_out_of_a_mixture_is_named(tmp_path):
    points = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5), (0.25, 0.25, 0.5)]
    rows = [[*point, 10 + 3 * k % 5, "cup fell" if k == 6 else ""] for k, point in enumerate(points)]
    path = tmp_path / "blend.csv"
    factors = [f"# factor | {name} | 0 | 1 | 1" for name in "abc"]
    write(path, ["# design | mixture", *factors], [["a", "b", "c", "angle_deg", "excluded"], *rows])
    found = run_analyse(AnalyseOrder(sheet=str(path)))
    assert found.analysis.mixture is not None
    assert found.analysis.notes[0] == "Run line 12 is left out, as the sheet says: 'cup fell'."


def test_an_excluded_run_is_left_out_and_named(tmp_path):
    """As if its cell were empty, and the analysis says why."""
    lines = asset_path("runs", "sunflower_extract").read_text(encoding="utf-8").splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("row"))
    table = list(csv.reader(io.StringIO("\n".join(lines[head:]))))
    left_out, empty = tmp_path / "left_out.csv", tmp_path / "empty.csv"
    runs = [[*cells, "cup slipped" if cells[2] == "7" else ""] for cells in table[1:]]
    write(left_out, lines[:head], [[*table[0], "excluded"], *runs])
    write(
        empty, lines[:head], [table[0], *([*cells[:-1], "" if cells[2] == "7" else cells[-1]] for cells in table[1:])]
    )
    one, other = (run_analyse(AnalyseOrder(sheet=str(path))) for path in (left_out, empty))
    assert one.runs == other.runs
    assert one.analysis.model.surface.predicted == pytest.approx(other.analysis.model.surface.predicted, abs=0)
    assert "Run 7 is left out, as the sheet says: 'cup slipped'." in one.analysis.notes
    assert not any("left out" in note for note in other.analysis.notes)


def test_a_sheet_without_a_run_that_counts_is_refused(sheet, tmp_path):
    rows = rows_of(sheet)
    for row in rows:
        row[place(sheet, "excluded")] = "all of that day"
    name, content = filled_sheet(sheet, rows)
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(CommandError, match=r"every run with a result in angle_deg is left out"):
        run_analyse(AnalyseOrder(sheet=str(path), response="angle_deg"))


def write(path, comments, rows):
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    path.write_text("\n".join([*comments, text.getvalue()]), encoding="utf-8")
