"""All checks over a published study, each where the parts that it needs are there.

Those that need one line of arithmetic stand here: derived columns, means of replicates, totals, values quoted twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from doe.audit.finding import Audit, Figure, Finding, Remark, compared, unchecked
from doe.audit.printed import common_half, halves_of, rounding_slack, values_of
from doe.audit.restitution_formula import check_drop_test, evaluated, names_in
from doe.audit.screening_anova import check_screening, check_significance
from doe.audit.study import Derived, Measured, PublishedStudy, Quote, Target, Total
from doe.audit.surface_refit import check_optimum, check_runs_against_model, check_surface
from doe.audit.verification import check_ascent_errors, check_verification_error, check_verification_test
from doe.audit.walk import check_levels, check_walk
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]


def audit_study(study: PublishedStudy) -> Audit:
    """Recompute everything that can be recomputed; findings in the order of a study's own stages."""
    findings = [finding for check in CHECKS for finding in _caught(check, study)]
    figures = tuple(one for one in findings if isinstance(one, Figure))
    remarks = tuple(one for one in findings if isinstance(one, Remark))
    return Audit(study.title, study.source, figures, remarks)


def check_derived(derived: Derived) -> Iterator[Finding]:
    """Every cell of a column against its formula on the printed cells of its row."""
    names = names_in(derived.formula)
    for row, print_, cells in zip(derived.rows, derived.printed, derived.inputs, strict=True):
        inputs = [cells[name] for name in names]

        def value(numbers: FloatArray) -> FloatArray:
            return np.array([evaluated(derived.formula, dict(zip(names, numbers.tolist(), strict=True)))])

        values = values_of(inputs)
        slack = rounding_slack(value, values, halves_of(inputs))
        how = f"{derived.formula} from the same row"
        quantity = f"{derived.quantity}, {row}"
        yield compared("stated formula", derived.where, quantity, print_, float(value(values)[0]), how, float(slack[0]))


def check_measured(measured: Measured) -> Iterator[Finding]:
    """Means against their replicates; without them, one entry that says so."""
    check = "mean of replicates"
    if measured.replicates is None:
        count = len(measured.printed)
        what = f"{measured.quantity}, {count} value{'s' if count > 1 else ''}"
        printed = ", ".join(one.text for one in measured.printed)
        why = f"mean of {measured.made_from}, which are not printed"
        yield unchecked(check, measured.where, what, why, printed)
        return
    for row, print_, runs in zip(measured.rows, measured.printed, measured.replicates, strict=True):
        values = values_of(runs)
        slack = rounding_slack(lambda x: np.array([x.mean()]), values, common_half(runs))
        how = f"mean of the {len(runs)} printed replicates"
        yield compared(
            check, measured.where, f"{measured.quantity}, {row}", print_, float(values.mean()), how, float(slack[0])
        )


def check_target(target: Target) -> Iterator[Finding]:
    """Mean, standard deviation and number of the measured values that the study aims at."""
    check = "mean of replicates"
    if target.replicates is None:
        made_from = "values" if target.n is None else f"{target.n} values"
        yield unchecked(check, target.where, target.quantity, f"mean of {made_from}, not printed", target.mean.text)
        return
    values, halves = values_of(target.replicates), common_half(target.replicates)
    how = f"from the {values.size} printed values"

    def summary(x: FloatArray) -> FloatArray:
        return np.array([x.mean(), x.std(ddof=1) if x.size > 1 else np.nan])

    found, slack = summary(values), rounding_slack(summary, values, halves)
    for k, (words, print_) in enumerate((("mean", target.mean), ("standard deviation", target.sd))):
        if print_ is not None:
            quantity = f"{target.quantity}, {words}"
            yield compared(check, target.where, quantity, print_, float(found[k]), how, float(slack[k]))
    if target.n is not None and target.n != values.size:
        quantity, n = f"{target.quantity}, number of values", str(target.n)
        yield Figure(check, target.where, quantity, "differs", n, float(values.size), 0.0, how)


def check_total(total: Total) -> Figure:
    """A printed total against the sum of its printed parts."""
    values = values_of(total.parts)
    slack = rounding_slack(lambda x: np.array([x.sum()]), values, halves_of(total.parts))
    how = f"sum of the {len(total.parts)} printed parts"
    return compared("parts add up", total.where, total.quantity, total.total, float(values.sum()), how, float(slack[0]))


def check_quote(quote: Quote) -> Figure:
    """A value said again against the value in its table."""
    check, said = "values said twice", f" (“{quote.text}”)" if quote.text else ""
    if quote.original is not None:
        original, slack, how = (
            quote.original,
            _finer(quote),
            f"{quote.original_where} prints {quote.original.text}{said}",
        )
    elif quote.among:
        # The text says no more than what kind of value it is: there must be one like it in that column.
        original, slack = min(quote.among, key=lambda cell: abs(cell.value - quote.value.value)), 0.0
        how = f"the nearest {quote.kind} in {quote.original_where} is {original.text}{said}"
    else:
        why = f"the text does not say which value of {quote.original_where} this is{said}"
        return unchecked(check, quote.where, quote.quantity, why, quote.value.text)
    found = compared(check, quote.where, quote.quantity, quote.value, original.value, how, slack)
    return replace(found, how=how + _elsewhere(quote)) if found.status == "differs" else found


def check_quotes_among_themselves(quotes: tuple[Quote, ...]) -> Iterator[Figure]:
    """Values that the same text gives differently for one quantity which no table settles."""
    by_quantity: dict[tuple[str, str], list[Quote]] = {}
    for quote in quotes:
        if quote.original is None and not quote.among:
            by_quantity.setdefault((quote.where, quote.quantity), []).append(quote)
    for (where, quantity), said in by_quantity.items():
        first = said[0].value
        for other in (quote.value for quote in said[1:]):
            if not first.agrees(other.value, other.half):
                yield Figure(
                    "values said twice", where, quantity, "differs", other.text, first.value, 0.0, "the text gives both"
                )


def _elsewhere(quote: Quote) -> str:
    """What the table prints with the number that the text gives to something else."""
    if not quote.elsewhere:
        return ""
    return f"; it prints {quote.value.text} as {' and as '.join(quote.elsewhere)}"


def _finer(quote: Quote) -> float:
    """How far rounding of the table lets the two prints be apart: only where it prints fewer digits than the quote."""
    assert quote.original is not None
    return quote.original.half if quote.original.half > quote.value.half else 0.0


def _caught(check: Callable[[PublishedStudy], Iterator[Finding]], study: PublishedStudy) -> Iterator[Finding]:
    """Findings of one check; where no statistic can be computed, one entry that says why."""
    try:
        yield from check(study)
    except StatisticsError as error:
        yield unchecked(check.__name__.strip("_").replace("_", " "), "", "all figures", str(error))


def _bench(study: PublishedStudy) -> Iterator[Finding]:
    for derived in study.derived:
        yield from check_derived(derived)
    for measured in study.measured:
        yield from check_measured(measured)
    for total in study.totals:
        yield check_total(total)
    if study.drop_test is not None:
        yield from check_drop_test(study.drop_test)
    for quote in study.quotes:
        yield check_quote(quote)
    yield from check_quotes_among_themselves(study.quotes)


def _target(study: PublishedStudy) -> Iterator[Finding]:
    if study.target is not None:
        yield from check_target(study.target)


def _screening(study: PublishedStudy) -> Iterator[Finding]:
    if study.screening is not None:
        yield from check_screening(study.screening)
        yield from check_significance(study.screening)


def _ascent(study: PublishedStudy) -> Iterator[Finding]:
    if study.ascent is not None:
        yield from check_ascent_errors(study.ascent, study.target)
        if study.screening is not None:
            yield from check_walk(study.ascent, study.screening)


def _surface(study: PublishedStudy) -> Iterator[Finding]:
    walked = set[str]()
    for surface in study.surfaces:
        # Several responses are often fitted over one design.
        if study.ascent is not None and surface.responses and surface.where_runs not in walked:
            yield from check_levels(surface, study.ascent)
        walked.add(surface.where_runs)
        yield from check_surface(surface)


def _optimum(study: PublishedStudy) -> Iterator[Finding]:
    if study.surface is not None and study.optimum is not None:
        yield from check_optimum(study.optimum, study.surface, study.target)


def _verification(study: PublishedStudy) -> Iterator[Finding]:
    if study.surface is not None:
        yield from check_runs_against_model(study.surface, study.ascent, study.optimum, study.verified)
    if study.verified is not None:
        yield from check_verification_error(study.verified, study.target)
        yield from check_verification_test(study.verified, study.target)


CHECKS = (_bench, _target, _screening, _ascent, _surface, _optimum, _verification)
