"""One report from finished folders: the audit of a published study, and a material's photographs, bench tests, planned
and analysed designs, calibration and diagnosis.

The result file of a folder shows its kind. The report is rebuilt from that file, so the result of an older version of
the program also gets today's figures. Several reports are joined: the verdict of the last stage first, the verdicts of
all in a table, then every report in the order of the work.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from PIL import Image

from doe.provenance import About
from doe.studies.study_result import StudyResult
from explorer.audit.report import AuditResult, audit_report
from explorer.design.plan_result import PlanResult
from explorer.design.result import DesignResult
from explorer.diagnosis.result import DiagnosisResult
from explorer.errors import CommandError
from explorer.photograph.result import PhotographResult
from explorer.project.project import FILE, load_project
from explorer.report import study_report
from explorer.report.bench import BenchResult, bench_report
from explorer.report.content import Banner, Block, Drawing, Figure, Folded, Picture, Report, Section, Strong, Table
from explorer.report.design import design_report
from explorer.report.design.plan import plan_report
from explorer.report.diagnosis import diagnosis_report
from explorer.report.figures.pours import outlines_caption, pile_outlines
from explorer.report.photograph import MOST_BYTES, READ, photograph_report, png_within

Content = Mapping[str, Any]


@dataclass(frozen=True)
class Part:
    """A folder of a project: what kind of work it is, its result, and its report."""

    kind: str
    result: object
    report: Report


def _picture(folder: Path) -> bytes | None:
    pictures = sorted((folder / "figures").glob(f"figure_*_{READ}.png"))
    return pictures[0].read_bytes() if pictures else None


KINDS: dict[str, tuple[str, Callable[[Content], bool], Callable[[Content], Any], Callable[[Any, Path], Report]]] = {
    "Audit": (
        AuditResult.NAME,
        lambda _: True,
        AuditResult.from_dict,
        lambda result, _: audit_report(result),
    ),
    "Photographs": (
        PhotographResult.NAME,
        lambda _: True,
        PhotographResult.from_dict,
        lambda result, folder: photograph_report(result, _picture(folder)),
    ),
    "Bench test": (
        BenchResult.NAME,
        lambda _: True,
        BenchResult.from_dict,
        lambda result, _: bench_report(result),
    ),
    "Planned runs": (
        PlanResult.NAME,
        lambda _: True,
        PlanResult.from_dict,
        lambda result, _: plan_report(result),
    ),
    "Design": (
        "result.json",
        lambda content: content.get("kind") == "design analysis",
        DesignResult.from_dict,
        lambda result, _: design_report(result),
    ),
    "Calibration": (
        "result.json",
        lambda content: "study" in content,
        StudyResult.from_dict,
        lambda result, _: study_report(result),
    ),
    "Diagnosis": (
        DiagnosisResult.NAME,
        lambda _: True,
        DiagnosisResult.from_dict,
        lambda result, _: diagnosis_report(result),
    ),
}
"""Kind → file, test whether its content is of this kind, reader, and report; in the order of the work."""


def part_of(folder: Path) -> Part:
    """What a folder holds; raises CommandError in one line if it holds no finished result."""
    kind, content = _content(folder)
    if not kind:
        names = ", ".join(dict.fromkeys(name for name, *_ in KINDS.values()))
        raise CommandError(f"{folder}: holds no finished result ({names})")
    name, _, read, report = KINDS[kind]
    try:
        result = read(content)
    except ValueError as problem:
        raise CommandError(f"{folder / name}: {problem}") from None
    return Part(kind, result, report(result, folder))


def _content(folder: Path) -> tuple[str, Content]:
    """Kind of a folder's result, and the content of its file; "" if it holds none."""
    for kind, (name, fits, _, _) in KINDS.items():
        file = folder / name
        if not file.is_file():
            continue
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
        except ValueError as problem:
            raise CommandError(f"{file}: {problem}") from None
        if isinstance(content, dict) and fits(content):
            return kind, content
    return "", {}


def finished_folders(folder: Path) -> list[Path]:
    """Folders with a result, oldest first, of the project (`explorer.project`) in ``folder``; else ``folder`` alone."""
    if not (folder / FILE).is_file():
        return [folder]
    project = load_project(folder)
    places = dict.fromkeys(place.resolve() for place in (*project.reports, project.target))
    found = [place for place in reversed(places) if _content(place)[0]]
    if not found:
        raise CommandError(f"{folder}: a project without a finished result")
    return found


def project_report(folders: list[Path], title: str, about: About) -> Report:
    """The report of one folder, or of several joined."""
    parts = sorted((part_of(folder) for folder in folders), key=lambda part: list(KINDS).index(part.kind))
    if len(parts) == 1:
        (part,) = parts
        said = replace(
            part.report.about, **{name: text for name, text in vars(about).items() if text and name != "date"}
        )
        return replace(part.report, title=title or part.report.title, about=said)
    decisive = parts[-1].report
    assert decisive.banner is not None
    verdicts = Table(
        ("work", "of", "verdict", "date"),
        tuple(
            (part.kind, part.report.title, Strong(part.report.banner.headline), part.report.about.date)
            for part in parts
            if part.report.banner
        ),
    )
    sections = [Section("Verdicts", (verdicts,)), *_side_by_side(parts)]
    parts = _with_small_pictures(parts)
    for k, part in enumerate(parts, start=1):
        sections += [_renamed(section, f"{k}. {part.kind}", f"part-{k}-") for section in part.report.sections]
    return Report(
        title=title or decisive.title,
        subtitle=f"Project report: {', '.join(dict.fromkeys(part.kind.lower() for part in parts))}",
        banner=Banner(
            decisive.banner.word,
            decisive.banner.of,
            f"{parts[-1].kind}: {decisive.banner.why}",
            decisive.banner.then,
        ),
        sections=tuple(sections),
        about=about,
        data=tuple(
            replace(table, name=f"part_{k}_{table.name}")
            for k, part in enumerate(parts, start=1)
            for table in part.report.data
        ),
        references=tuple({one.key: one for part in parts for one in part.report.references}.values()),
    )


def _with_small_pictures(parts: list[Part]) -> list[Part]:
    """The parts, with pictures small enough for one page."""
    n = sum(isinstance(one, Picture) for part in parts for one in part.report.shown.values())

    def small(block: Block) -> Block:
        if not isinstance(block, Picture) or n < 2:
            return block
        with Image.open(io.BytesIO(block.png)) as picture:
            return replace(block, png=png_within(MOST_BYTES // n, picture))

    def smaller(report: Report) -> Report:
        sections = tuple(replace(one, blocks=tuple(map(small, one.blocks))) for one in report.sections)
        return replace(report, sections=sections)

    return [replace(part, report=smaller(part.report)) for part in parts]


def _side_by_side(parts: list[Part]) -> list[Section]:
    """Photographed outlines over the mean silhouettes of a study, if there are both and the scale is known."""
    studies = [part.result for part in parts if isinstance(part.result, StudyResult) and part.result.piles]
    photographs = [part.result for part in parts if isinstance(part.result, PhotographResult)]
    measured = {pile.name: (pile.u, pile.z) for one in photographs for pile in one.piles if pile.unit == "m"}
    if not studies or not measured:
        return []
    piles = studies[0].piles
    figure = Figure("piles", pile_outlines(piles, measured), outlines_caption(piles, len(measured)))
    return [Section("Photograph, reference and optimum", (figure,))]


def _renamed(section: Section, before: str, prefix: str) -> Section:
    """A section whose title and figure names are unique on the joined page."""
    return Section(f"{before}: {section.title}", tuple(_block(block, prefix) for block in section.blocks))


def _block(block: Block, prefix: str) -> Block:
    if isinstance(block, Folded):
        return Folded(block.title, tuple(_block(inner, prefix) for inner in block.blocks))
    if isinstance(block, Figure | Drawing | Picture):
        return replace(block, name=f"{prefix}{block.name}")
    return block
