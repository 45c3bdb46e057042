"""The verification: fresh pours at the optimum against every target."""

from __future__ import annotations

import math

from doe.analysis.t_tests import Sample
from doe.analysis.verification import Verification
from doe.stages.verification import VerificationResult
from doe.studies.study_result import StudyResult
from doe.target import Target
from explorer.report.content import Block, Figure, Section, Table, Text
from explorer.report.figures.walks import verification as verification_chart
from explorer.units import MISSING, fixed, observable_label, observed, p_value, percent, unit_of_observable


def verification(result: StudyResult) -> Section:
    """Per target: samples, tests, equivalence, relative error beside the noise."""
    stage = result.verification
    seeds = len({run.seed for run in stage.runs})
    blocks: list[Block] = [
        Text(
            f"{len(stage.runs)} pours at the optimum with {seeds} seeds that no other stage used; "
            f"{percent(stage.no_pile_share, 1)} are not valid. Means are over valid pours."
        )
    ]
    for index, (target, test) in enumerate(zip(stage.targets, stage.tests, strict=True)):
        blocks += _of_target(stage, index, target, test)
    return Section("Verification", tuple(blocks))


def _of_target(stage: VerificationResult, index: int, target: Target, test: Verification) -> list[Block]:
    name = target.observable
    words = observable_label(name)
    caption = "Band: target ± equivalence margin, fixed before any run."
    return [
        Text(f"{words[0].upper()}{words[1:]}: {verdict(target, test)}"),
        Figure(f"verification-{index + 1}", verification_chart(stage, index), caption),
        _samples(target, test),
        _tests(target, test),
    ]


def verdict(target: Target, test: Verification) -> str:
    """The outcome in one sentence, the equivalence test first: no difference found is no proof of agreement."""
    name = target.observable
    margin = observed(name, target.margin)
    deciding = test.deciding
    words = {
        "equivalent": f"equivalent to the measurement within ± {margin}.",
        "different": f"different from the measurement, and not shown to lie within ± {margin}.",
        "cannot tell": f"neither different nor shown to lie within ± {margin}; more pours are needed to tell.",
    }[test.verdict]
    if deciding is None or math.isnan(deciding.low):
        return words
    interval = f"{_difference(name, deciding.low)} … {_difference(name, deciding.high)}"
    return f"{words} Difference {_difference(name, deciding.difference)}, 95 % interval {interval}."


def _samples(target: Target, test: Verification) -> Table:
    name = target.observable
    rows = []
    samples = [("simulated", test.simulated), ("measured", test.target)]
    if target.before_mean is not None:
        sd, n = target.before_sd, target.before_n
        samples.append(("the model before", Sample(target.before_mean, math.nan if sd is None else sd, n or 0)))
    for words, sample in samples:
        spread = observed(name, sample.sd)
        if words == "measured" and math.isfinite(sample.sd) and target.sd_source != "measured":
            spread += f" ({target.sd_source})"
        error = observed(name, sample.standard_error)
        rows.append((words, observed(name, sample.mean), spread, str(sample.n or MISSING), error))
    share = 100 * test.simulated.standard_error / abs(target.mean)
    caption = (
        f"Relative error {fixed(test.relative_error_percent)} %; standard error of the simulated mean "
        f"{fixed(share)} % of the target."
    )
    return Table(("", "mean", "sd", "n", "standard error"), tuple(rows), caption)


def _tests(target: Target, test: Verification) -> Table:
    name = target.observable
    rows: list[tuple[str, ...]] = []
    for found, words in (
        (test.welch, "Welch, two samples"),
        (test.pooled, "Student, two samples, equal variances"),
        (test.one_sample, "one sample against the measured mean"),
    ):
        if found is None:
            continue
        interval = f"{_difference(name, found.low)} … {_difference(name, found.high)}"
        rows.append(
            (
                words,
                _difference(name, found.difference),
                f"{percent(found.level)}: {interval}",
                fixed(found.t),
                fixed(found.df, 1),
                p_value(found.p),
            )
        )
    equivalence = test.equivalence
    if equivalence is not None:
        interval = f"{_difference(name, equivalence.low)} … {_difference(name, equivalence.high)}"
        margin = observed(name, equivalence.margin)
        rows.append(
            (
                f"equivalence within ± {margin} (TOST)",
                MISSING,
                f"{percent(equivalence.level)}: {interval}",
                MISSING,
                MISSING,
                p_value(equivalence.p),
            )
        )
    if not rows:
        rows.append(("no test: one pour, or no spread", *[MISSING] * 5))
    caption = "Difference = simulated − measured. A small p of the equivalence test speaks for agreement."
    return Table(("test", "difference", "interval", "t", "df", "p"), tuple(rows), caption)


def _difference(name: str, value: float) -> str:
    """A difference with its sign and unit."""
    text = observed(name, value)
    unit = unit_of_observable(name)
    return f"+{text}" if unit.of(value) >= 0 else text
