"""What CI reads of a calibration: a summary in Markdown, and JUnit XML with one case per question."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from doe.record import RecordError
from doe.studies.baseline import Compared, moved
from doe.studies.study_result import StudyResult
from explorer.errors import CommandError
from explorer.report.identified import settings
from explorer.units import observable_label, observed, parameter_label, parameter_value


def read_baseline(path: Path) -> StudyResult:
    """The finished result in ``path``. Raises CommandError in one line."""
    try:
        return StudyResult.from_dict(json.loads(path.read_text(encoding="utf-8")))
    except (RecordError, ValueError, RecursionError) as error:
        raise CommandError(f"--baseline {path}: no result.json of a finished study ({error})") from None


def summary(result: StudyResult, compared: Sequence[Compared]) -> str:
    """Verdict, parameters, and what has moved from the baseline, as Markdown."""
    lines = [f"# {result.study.title}: calibration", ""]
    for target, test in zip(result.verification.targets, result.verification.tests, strict=True):
        name, found = target.observable, test.simulated
        error = "" if target.mean == 0.0 else f"; relative error {test.relative_error_percent:.2f} %"
        lines += [
            f"**{test.verdict}**: {test.statement} Simulated {observed(name, found.mean)} "
            f"(SD {observed(name, found.sd)}, n = {found.n}), measured {observed(name, target.mean)}{error}.",
            "",
        ]
    lines += ["| parameter | value, 95 % interval, or the range that gives the target |", "|---|---|"]
    lines += [f"| {one.label} | {one.answer} |" for one in settings(result.optimum)]
    if compared:
        gone = moved(tuple(compared))
        verdict = f"{len(gone)} of {len(compared)} have moved" if gone else "nothing has moved"
        lines += ["", f"## Against the baseline: {verdict}", "", "| quantity | before | now | answer | why |"]
        lines += ["|---|---|---|---|---|"]
        lines += map(_row, compared)
    return "\n".join(lines) + "\n"


def junit(result: StudyResult, compared: Sequence[Compared], fail_above: float | None) -> str:
    """One case per compared quantity, failed if it has moved, and one per target for the limit on its error."""
    cases = [(_what(one), one.why, change(one) if one.answer == "moved" else "") for one in compared]
    if fail_above is not None:
        cases += [(one.name, f"{one.percent:.2f} %", one.fault(fail_above)) for one in errors(result)]
    if not cases:
        cases.append(("finished", result.verification.line, ""))
    failed = sum(bool(fault) for _, _, fault in cases)
    suite = ElementTree.Element(
        "testsuite",
        name=f"calibration of {result.study.name}",
        tests=str(len(cases)),
        failures=str(failed),
        errors="0",
        skipped="0",
        time=f"{result.timing.total_s:.1f}",
    )
    for name, why, fault in cases:
        case = ElementTree.SubElement(suite, "testcase", classname=result.study.name, name=name, time="0")
        if fault:
            ElementTree.SubElement(case, "failure", message=fault).text = why
        elif why:
            ElementTree.SubElement(case, "system-out").text = why
    ElementTree.indent(suite)
    return ElementTree.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"


@dataclass(frozen=True)
class RelativeError:
    """How far the mean of the fresh pours is from one target, in percent of the target."""

    name: str
    percent: float

    def fault(self, limit: float) -> str:
        """What is wrong if the error is above ``limit`` percent (or not a number), else ""."""
        if self.percent <= limit:
            return ""
        if math.isnan(self.percent):
            return f"{self.name} cannot be told: the target is 0, or no pour is valid"
        return f"{self.name} {self.percent:.2f} % is above the limit of {limit:g} %"


def errors(result: StudyResult) -> tuple[RelativeError, ...]:
    """Relative error of every target."""
    return tuple(
        RelativeError(f"{observable_label(target.observable)}: relative error", test.relative_error_percent)
        for target, test in zip(result.verification.targets, result.verification.tests, strict=True)
    )


def _what(one: Compared) -> str:
    if one.kind == "parameter":
        return parameter_label(one.name)
    return f"{observable_label(one.name)}: {one.kind}"


def _value(one: Compared, value: float | str) -> str:
    if isinstance(value, str):
        return value
    return parameter_value(one.name, value) if one.kind == "parameter" else observed(one.name, value)


def _row(one: Compared) -> str:
    answer = f"**{one.answer}**" if one.answer == "moved" else one.answer
    return f"| {_what(one)} | {_value(one, one.before)} | {_value(one, one.now)} | {answer} | {one.why} |"


def change(one: Compared) -> str:
    """E.g. "static friction seed–seed: 0.31 before, 0.42 now"."""
    return f"{_what(one)}: {_value(one, one.before)} before, {_value(one, one.now)} now"
