"""What a reader sees of a diagnosis's report: its blocks, figures and tables, of the content of a result's file."""

import re

from doe.diagnose.result import Amplitude
from explorer.report import diagnosis as report
from explorer.report.content import Figure, Folded, Table
from explorer.report.diagnosis import answer, evidence, wording
from explorer.report.folder import write_report
from tests.explorer.diagnosed import typed


def of_content(make):
    """``make`` of a result, for the content of its file."""
    return lambda content, *more: make(typed(content), *more)


diagnosis_html, diagnosis_markdown = of_content(report.diagnosis_html), of_content(report.diagnosis_markdown)
sections_of = of_content(report.sections_of)
cautions, verdict_sentence = of_content(answer.cautions), of_content(answer.verdict_sentence)
strained, feature_value = of_content(evidence.strained), of_content(wording.feature_value)


def write_diagnosis_report(content, folder):
    write_report(report.diagnosis_report(typed(content)), folder)


def amplitude_text(estimate):
    return wording.amplitude_text(Amplitude.from_dict(estimate))


def blocks_of(result):
    def walk(blocks):
        for block in blocks:
            yield block
            if isinstance(block, Folded):
                yield from walk(block.blocks)

    for section in sections_of(result):
        yield from walk(section.blocks)


def figures_of(result):
    return {block.name: block.spec for block in blocks_of(result) if isinstance(block, Figure)}


def tables(result, *start):
    """Tables whose header begins with ``start``, as they stand in the sections."""
    found = [block for block in blocks_of(result) if isinstance(block, Table)]
    return [block.rows for block in found if block.header[: len(start)] == start]


def as_number(cell):
    return float(re.search(r"[-+]?[\d.]+(e-?\d+)?", cell.replace("−", "-"))[0])
