"""Boards of studies and diagnoses: what they show of a result, live or of a folder."""

import json

import pytest

from doe.studies.exclusion import ExcludedRun
from doe.studies.study_result import study_from
from explorer.background.command_process import CommandStatus
from explorer.background.events import StageProgress
from explorer.errors import CommandError
from explorer.report.content import Word
from explorer.study.excluded_runs import keep_excluded
from explorer.viewer.board.board import Board, board_json
from explorer.viewer.board.diagnosis_board import diagnosis_board
from explorer.viewer.board.folder_board import FolderBoard
from explorer.viewer.board.study_board import study_board
from explorer.viewer.shell.web_pages import WebPages
from tests.explorer import diagnosed, reported_studies


@pytest.mark.parametrize("case", reported_studies.CASES)
def test_every_kind_of_study_is_plain_json_without_a_gap(case):
    board = study_board(study_from(reported_studies.result_of_case(case)), None, "/reports/x/report.html")
    text = board_json(board).decode()
    shown = json.loads(text)
    assert shown["banner"]["headline"].startswith(tuple(Word))
    assert shown["report"] == "/reports/x/report.html"
    for chart in shown["charts"]:
        assert chart["spec"]["data"]
        assert 0.3 < chart["aspect"] < 4.0
    for table in shown["tables"]:
        assert all(len(row) == len(table["header"]) for row in table["rows"])
        assert len(table["opens"]) in (0, len(table["rows"]))


@pytest.mark.parametrize("case", diagnosed.CASES)
def test_every_kind_of_diagnosis_says_what_is_missing_and_shows_the_piles(case):
    result = diagnosed.typed(diagnosed.result_of_case(case))
    shown = json.loads(board_json(diagnosis_board(result, None)))
    assert shown["banner"]["headline"].startswith(tuple(Word))
    assert shown["banner"]["why"]
    titles = [chart["title"] for chart in shown["charts"]]
    assert len([one for one in titles if one.startswith("Pile")]) == len(result.piles)
    assert len([one for one in titles if one.startswith("Where the pile is off")]) == len(result.maps)
    # What starts a study opens the room in which it is seen.
    assert {act["label"]: act["room"] for act in shown["acts"]}.get(
        "Calibrate the corrected model", "Calibrate"
    ) == "Calibrate"
    assert titles[: len(result.piles)] == [one for one in titles if one.startswith("Pile")]


def test_without_a_result_a_board_says_where_the_command_is():
    status = CommandStatus("running", "pilot", 3, 20, 61.0, stages=(StageProgress("pilot", 3, 20),))
    shown = json.loads(board_json(study_board(None, status)))
    assert shown["subtitle"] == "Running: pilot, 3 of 20, time left 1 min 01 s"
    assert [one["mark"] for one in shown["stages"]] == ["▶"]
    assert json.loads(board_json(study_board(None, None))) == json.loads(board_json(Board("", "")))


def test_a_cancelled_study_keeps_what_its_stages_have_come_to():
    result = reported_studies.result_of_case("planted")
    partial = {key: result[key] for key in ("schema", "study", "pilot")} | {"partial": "screening", "line": ""}
    stages = (StageProgress("pilot", 20, 20, "σ 1.2"), StageProgress("screening", 3, 28))
    status = CommandStatus("cancelled", "screening", 23, 48, stages=stages)
    shown = json.loads(board_json(study_board(study_from(partial), status)))
    assert [(one["name"], one["mark"]) for one in shown["stages"]] == [("pilot", "done"), ("screening", "–")]
    assert [one["title"] for one in shown["charts"]] == ["Noise of the estimators"]


def test_a_noise_of_two_seeds_is_no_chart():
    result = reported_studies.result_of_case("planted")
    noise = {name: one | {"runs": 2} for name, one in result["pilot"]["noise"].items()}
    partial = {key: result[key] for key in ("schema", "study")} | {"pilot": result["pilot"] | {"noise": noise}}
    shown = json.loads(board_json(study_board(study_from(partial | {"partial": "pilot", "line": ""}), None)))
    assert shown["charts"] == []


def test_a_folder_is_a_board_that_follows_its_files(tmp_path):
    pages = WebPages("test")
    with pytest.raises(CommandError, match=r"holds no result\.json, partial\.json or diagnosis\.json"):
        FolderBoard(tmp_path, pages)
    result = reported_studies.result_of_case("planted")
    partial = {key: result[key] for key in ("schema", "study", "pilot")} | {"partial": "pilot", "line": "so far"}
    (tmp_path / "partial.json").write_text(json.dumps(partial), encoding="utf-8")
    folder = FolderBoard(tmp_path, pages)
    first = pages.page(folder.address)
    assert json.loads(first.body)["banner"] is None
    folder.follow()
    assert pages.page(folder.address) is first
    (tmp_path / "result.json").write_text(json.dumps(result), encoding="utf-8")
    folder.follow()
    shown = json.loads(pages.page(folder.address).body)
    assert shown["banner"] is not None
    assert shown["report"] == ""
    (tmp_path / "report.html").write_text("written last", encoding="utf-8")
    folder.follow()
    assert pages.page(json.loads(pages.page(folder.address).body)["report"]).body == b"written last"
    left_out = study_from(result).surface.runs[0][0]
    keep_excluded(tmp_path, study_from(result), [ExcludedRun.of(left_out, "spilled")])
    folder.follow()
    assert "spilled" in pages.page(folder.address).body.decode()
    (tmp_path / "result.json").write_text('{"runs": 1}', encoding="utf-8")
    with pytest.raises(CommandError, match=str(tmp_path)):
        folder.follow()
