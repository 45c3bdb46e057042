"""The content of a board, as typed values and as the JSON that the page ``/shell/board.html`` draws."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from explorer.report.content import Banner, Spec, Table
from explorer.report.study_charts import Plots
from solver import EFFECTS

CODE = re.compile(r"`([^`]*)`")


@dataclass(frozen=True)
class BoardChart:
    """One chart: ``aspect`` is height over width."""

    title: str
    spec: Spec
    caption: str
    aspect: float


@dataclass(frozen=True)
class BoardTable:
    """A table that can be sorted and filtered; ``opens`` has a command per row that opens it in the scene, or none."""

    title: str
    table: Table
    opens: tuple[Mapping[str, Any], ...] = ()
    folded: bool = True


@dataclass(frozen=True)
class Stage:
    """Progress of one stage ("12 of 28"), and what it found."""

    name: str
    count: str
    mark: str
    found: str


@dataclass(frozen=True)
class BoardAct:
    """A button below the verdict: its label, the command it sends (`explorer.viewer.shell.channel`), and the room it
    opens, if any."""

    label: str
    command: Mapping[str, Any]
    room: str = ""


@dataclass(frozen=True)
class Board:
    """A complete board."""

    title: str
    subtitle: str
    banner: Banner | None = None
    acts: tuple[BoardAct, ...] = ()
    """What can be done next; not offered if the board is not part of a live page."""
    stages: tuple[Stage, ...] = ()
    charts: tuple[BoardChart, ...] = ()
    tables: tuple[BoardTable, ...] = ()
    report: str = ""
    """Address of the report; empty if there is none."""


def made_charts(plots: Plots) -> tuple[BoardChart, ...]:
    """The charts of ``plots`` that have content."""
    made = ((title, plot, plot.make()) for title, plot in plots.items())
    return tuple(BoardChart(title, spec, plot.caption, plot.aspect) for title, plot, spec in made if spec is not None)


def board_json(board: Board) -> bytes:
    """The board for its page; texts are plain, without code marks."""
    content = {
        "title": board.title,
        "subtitle": board.subtitle,
        "banner": None if board.banner is None else _banner(board.banner),
        "acts": [vars(act) for act in board.acts],
        "stages": [vars(stage) for stage in board.stages],
        "charts": [vars(chart) for chart in board.charts],
        "tables": [
            {
                "title": one.title,
                "header": one.table.header,
                "rows": [[_plain(cell) for cell in row] for row in one.table.rows],
                "caption": _plain(one.table.caption),
                "opens": one.opens,
                "folded": one.folded,
            }
            for one in board.tables
        ],
        "report": board.report,
    }
    return json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(",", ":")).encode()


def _banner(banner: Banner) -> dict[str, str]:
    texts = {"headline": banner.headline, "why": banner.why, "then": banner.then}
    return {"tone": banner.word.tone} | {name: _plain(text) for name, text in texts.items()}


def _plain(text: str) -> str:
    return CODE.sub(lambda found: found[1].replace("_", " ") if found[1] in EFFECTS else found[1], text)
