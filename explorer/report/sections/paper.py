"""Compared with the paper: its printed numbers beside ours, for the study of its material only.

Source: Processes 2022, 10, 185. Its tables are assets; what stands only in its text (section 3) is below.
"""

from __future__ import annotations

import csv

from doe.analysis.t_tests import Sample
from doe.studies.study_result import StudyResult
from explorer.report.content import Section, Table, Text
from explorer.report.identified import GIVES_TARGET, settings
from explorer.units import MISSING, enumeration, fixed, observed, p_value, parameter_label, parameter_value
from solver import asset_path

STUDY = "sunflower_extract"
PRINTED_SIGNIFICANT = ("X4", "X7", "X16")
PRINTED_OPTIMUM = {"X4": 58.34e6, "X7": 0.62, "X16": 0.608}
"""[Pa], 1, 1."""
PRINTED_MEAN_DEG = 24.91
PRINTED_RELATIVE_ERROR_PERCENT = 0.923
PRINTED_P = 0.827


def paper(result: StudyResult) -> Section | None:
    """Factors, optimum and verification side by side; None for any other study."""
    if result.study.name != STUDY:
        return None
    analysis = result.screening.analysis
    their_way = analysis.significant(adjust="none", error="dummies")
    text = (
        f"The paper (Processes 2022, 10, 185) found {enumeration(list(PRINTED_SIGNIFICANT))} significant, judged "
        f"against three dummy columns without correction. Here: {enumeration(their_way)} in that way, "
        f"{enumeration(analysis.significant())} after Holm against the {analysis.error_source}."
    )
    return Section("Compared with the paper", (Text(text), _optimum(result), _verification(result), _factors(result)))


def _optimum(result: StudyResult) -> Table:
    found = {setting.name: setting for setting in settings(result.optimum)}
    rows = []
    for factor in result.study.factors:
        name, path = factor.name, factor.path
        if name not in PRINTED_OPTIMUM and name not in found:
            continue
        here = found.get(name)
        ours = (MISSING,) * 3 if here is None else (here.value, here.confidence_set, here.feasible)
        rows.append((name, parameter_label(path), parameter_value(path, PRINTED_OPTIMUM.get(name)), *ours))
    header = ("factor", "parameter", "paper's optimum", "optimum here", "95 % set here", f"{GIVES_TARGET} here")
    return Table(header, tuple(rows))


def _verification(result: StudyResult) -> Table:
    name = result.study.targets[0].observable
    test = result.verification.tests[0]
    pours = [float(row["simulated_angle_of_repose_deg"]) for row in _table("table10_verification")]
    p = None if test.pooled is None else test.pooled.p
    ours = test.simulated
    rows = (
        ("simulated pours", f"{len(pours)}: {', '.join(f'{value:.2f}°' for value in pours)}", str(ours.n)),
        ("simulated mean", f"{PRINTED_MEAN_DEG:.2f}°", observed(name, ours.mean)),
        ("sd of one pour", f"{fixed(Sample.of(pours).sd)}° (from the three pours)", observed(name, ours.sd)),
        ("measured mean", "24.68°", observed(name, test.target.mean)),
        (
            "relative error",
            f"{PRINTED_RELATIVE_ERROR_PERCENT} % as printed",
            f"{fixed(test.relative_error_percent)} %",
        ),
        ("p, two-sample t test", f"{PRINTED_P}", p_value(p)),
    )
    caption = (
        "The paper's 0.923 % is 0.23° divided by its simulated mean, 24.91°; ours is divided by the measured mean. "
        "p: Student's test with equal variances on both sides."
    )
    return Table(("", "paper", "here"), rows, caption)


def _factors(result: StudyResult) -> Table:
    printed = {row["factor"]: row for row in _table("table6_plackett_burman_anova")}
    paths = {factor.name: factor.path for factor in result.study.factors}
    rows = []
    for effect in result.screening.analysis.effects:
        if effect.is_dummy or effect.name not in printed:
            continue
        row, by_dummies, by_replicates = printed[effect.name], effect.by_dummies, effect.by_replicates
        deciding = by_replicates or by_dummies
        rows.append(
            (
                effect.name,
                parameter_label(paths[effect.name]),
                row["sum_of_squares"],
                fixed(effect.sum_of_squares),
                row["p_value"],
                MISSING if by_dummies is None else p_value(by_dummies.p),
                MISSING if by_replicates is None else p_value(by_replicates.p),
                MISSING if deciding is None else p_value(deciding.p_holm),
            )
        )
    header = (
        *("factor", "parameter", "paper: sum of squares", "here: sum of squares", "paper: p"),
        *("here: p dummies", "here: p replicates", "here: p Holm"),
    )
    return Table(header, tuple(rows), "The paper's columns as printed in its Table 6.")


def _table(name: str) -> list[dict[str, str]]:
    with asset_path("source_tables", name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
