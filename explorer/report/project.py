"""One report of finished folders: a material's photographs, bench tests, designs, calibration, diagnosis and audit.

A folder says by its result file what it is; its report is built anew from that file, so one of an older version of the
program gets today's figures as well. Several are joined: the verdict of the last stage first, those of all in a table,
then every report in the order of the work.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from doe.laboratory import LabResult
from doe.provenance import About
from doe.record import RecordError
from doe.studies.study_result import StudyResult
from explorer.design.result import DesignResult
from explorer.diagnosis.result import DiagnosisResult
from explorer.errors import CommandError
from explorer.report import study_report
from explorer.report.bench import bench_report
from explorer.report.content import Banner, Block, Drawing, Figure, Folded, Picture, Report, Section, Strong, Table
from explorer.report.design import design_report
from explorer.report.diagnosis import diagnosis_report
from explorer.report.photograph import READ, PhotographResult, photograph_report

Content = Mapping[str, Any]


@dataclass(frozen=True)
class Part:
    """A folder of a project: what kind of work it is, and its report."""

    kind: str
    folder: Path
    report: Report


def _bench(content: Content, folder: Path) -> Report:
    return bench_report(LabResult.from_dict(content["result"]), About.from_dict(content["about"]))


def _photograph(content: Content, folder: Path) -> Report:
    pictures = sorted((folder / "figures").glob(f"figure_*_{READ}.png"))
    return photograph_report(PhotographResult.from_dict(content), pictures[0].read_bytes() if pictures else None)


KINDS: dict[str, tuple[str, Callable[[Content], bool], Callable[[Content, Path], Report]]] = {
    "Photographs": ("photograph.json", lambda _: True, _photograph),
    "Bench test": ("bench.json", lambda _: True, _bench),
    "Design": (
        "result.json",
        lambda content: content.get("kind") == "design analysis",
        lambda content, _: design_report(DesignResult.from_dict(content)),
    ),
    "Calibration": (
        "result.json",
        lambda content: "study" in content,
        lambda content, _: study_report(StudyResult.from_dict(content)),
    ),
    "Diagnosis": (
        DiagnosisResult.NAME,
        lambda _: True,
        lambda content, _: diagnosis_report(DiagnosisResult.from_dict(content)),
    ),
}
"""Kind → file, whether its content is of this kind, and the report of it; in the order of the work."""


def part_of(folder: Path) -> Part:
    """What a folder holds; CommandError in one line where it is no finished result."""
    for kind, (name, fits, report) in KINDS.items():
        file = folder / name
        if not file.is_file():
            continue
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            if isinstance(content, dict) and fits(content):
                return Part(kind, folder, report(content, folder))
        except (RecordError, ValueError, KeyError) as problem:
            raise CommandError(f"{file}: {problem}") from None
    names = ", ".join(dict.fromkeys(name for name, _, _ in KINDS.values()))
    raise CommandError(f"{folder}: holds no finished result ({names})")


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
    sections = [Section("Verdicts", (verdicts,))]
    for k, part in enumerate(parts, start=1):
        sections += [_renamed(section, f"{k}. {part.kind}", f"part-{k}-") for section in part.report.sections]
    return Report(
        title=title or decisive.title,
        subtitle=f"Project report: {', '.join(part.kind.lower() for part in parts)}",
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


def _renamed(section: Section, before: str, prefix: str) -> Section:
    """A section whose title and figures have names of their own on the joined page."""
    return Section(f"{before}: {section.title}", tuple(_block(block, prefix) for block in section.blocks))


def _block(block: Block, prefix: str) -> Block:
    if isinstance(block, Folded):
        return Folded(block.title, tuple(_block(inner, prefix) for inner in block.blocks))
    if isinstance(block, Figure | Drawing | Picture):
        return replace(block, name=f"{prefix}{block.name}")
    return block
