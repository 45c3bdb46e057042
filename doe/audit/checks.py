"""All checks over a published study, each where the parts that it needs are there."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from doe.audit.ascent_walk import check_walk
from doe.audit.drop_test import check_drop_test
from doe.audit.finding import Audit, Figure, Finding, Remark, unchecked
from doe.audit.optimum_claim import check_optimum, check_runs_against_model
from doe.audit.screening_anova import check_screening
from doe.audit.significance import check_significance
from doe.audit.simple_checks import (
    check_derived,
    check_measured,
    check_quote,
    check_quotes_among_themselves,
    check_target,
    check_total,
)
from doe.audit.study import PublishedStudy
from doe.audit.surface_levels import check_levels
from doe.audit.surface_refit import check_surface
from doe.audit.target_errors import check_ascent_errors, check_verification_error
from doe.audit.verification_tests import check_verification_test
from doe.errors import StatisticsError


def audit_study(study: PublishedStudy) -> Audit:
    """Recompute everything that can be recomputed; findings in the order of a study's own stages."""
    findings = [finding for check in CHECKS for finding in _caught(check, study)]
    figures = tuple(one for one in findings if isinstance(one, Figure))
    remarks = tuple(one for one in findings if isinstance(one, Remark))
    return Audit(study.title, study.source, figures, remarks)


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
    if study.surface is not None:
        if study.ascent is not None:
            yield from check_levels(study.surface, study.ascent)
        yield from check_surface(study.surface)


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
