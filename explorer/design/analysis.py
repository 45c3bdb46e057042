"""From the order to analyse a filled sheet to the analysis and its files."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from doe.analysis.analyse import DesignAnalysis, analyse_design, reduction_words
from doe.analysis.elementary_effects import elementary_effects
from doe.analysis.gaussian_process import fit_process, process_target
from doe.analysis.mixture import MixtureOrder, fit_mixture
from doe.analysis.models import ORDERS, Order
from doe.analysis.named_factors import MOST_SOLVED, fit_named
from doe.analysis.optimum import ResponseTarget
from doe.analysis.random_groups import fit_random
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import Blocks
from doe.analysis.surface_anova import CONSTANT, FULL
from doe.designs import DESIGNS, factor_letters
from doe.designs.mixture import Mixture
from doe.designs.morris import Morris
from doe.errors import StatisticsError
from explorer.design.choices import ModelOrder, Reduction, Surrogate
from explorer.design.factors_file import factor_words, read_factors, region_of
from explorer.design.filled_sheet import Runs, read_sheet, runs_of, short
from explorer.design.result import DesignResult, Response, RunCount, SheetFactor
from explorer.design.run_plan import BLOCK
from explorer.errors import CommandError
from explorer.files.run_folder import appearing, json_text
from explorer.files.run_result import made_today, versions
from explorer.units import own_path
from solver.assets import asset_path

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
RARE = 0.01
"""p below which a pattern in the order of the residuals is worth a note."""
SAME = 1e-9
"""Coded levels that differ by less count as one."""
ROUNDED = 0.03
"""Share of a mixture's sum by which rounded amounts may miss it."""
FAR = 2.5
"""Half-widths from the middle of a factor's range beyond which a level is probably a slip: the star points of rotatable
central composite designs of up to five factors are 2^(5/4) = 2.4 away (Box and Hunter 1957, Ann. Math. Stat. 28,
195)."""


@dataclass(frozen=True)
class AnalyseOrder:
    """What a user asked for."""

    sheet: str
    response: str = ""
    target: float | None = None
    target_error: float = 0.0
    factors: str | None = None
    order: ModelOrder | None = None
    terms: tuple[str, ...] = ()
    only: tuple[str, ...] = ()
    block: str = ""
    """Column of the block in which each run was made."""
    random: str = ""
    """Column of the random group in which each run was made."""
    reduction: Reduction | None = None
    surrogate: Surrogate | None = None
    out: Path | None = field(default=None)
    author: str = ""
    notes: str = ""


def run_analyse(order: AnalyseOrder) -> DesignResult:
    """Read, analyse and, with ``out``, write result.json, report.html and report.md. Returns the result."""
    from explorer.report.design import design_report
    from explorer.report.folder import write_report

    for option, value in (("--target", order.target), ("--target-error", order.target_error)):
        if value is not None and not abs(value) < math.inf:
            raise CommandError(f"{option} {value:g}: allowed: a finite number")
    if order.target_error < 0:
        raise CommandError(f"--target-error {order.target_error:g}: allowed: 0 or more")
    if order.order is not None and order.terms:
        raise CommandError("--terms: given together with --model; allowed: one of the two")
    path = asset_path("runs", order.sheet)
    factors = read_factors(asset_path("designs", order.factors)).factors if order.factors else ()
    sheet = read_sheet(path, factors)
    responses = [
        name for name in sheet.responses if name not in (order.block, order.random, BLOCK) and not sheet.is_words(name)
    ]
    runs = runs_of(
        sheet, order.response or _only_response(sheet.path, responses), order.only, order.block, order.random
    )
    result = analyse_runs(runs, order)
    if order.out is not None:
        with appearing(order.out) as folder:
            write_report(design_report(result), folder, {"result.json": json_text(result.to_dict()) + "\n"})
    return result


def analyse_runs(runs: Runs, order: AnalyseOrder) -> DesignResult:
    """The analysis of one response."""
    region = region_of(runs.factors)
    asked_model = order.order or order.terms or order.reduction or order.surrogate
    if order.surrogate is not None:
        _refuse_surrogate(runs, order)
    if runs.groups is not None:
        found = _random(runs, region, order, runs.groups)
        return _result(runs, order, replace(found, notes=tuple(_run_notes(runs, region, found))))
    if runs.design == Morris.name and not (asked_model or order.target is not None or order.block):
        found = _elementary(runs, region, order)
        return _result(runs, order, replace(found, notes=(*found.notes, *_run_notes(runs, region, found))))
    if runs.design == Mixture.name:
        _refuse_rounded(runs, region, order.sheet)
    if _whole(runs, region) and order.surrogate is None:
        return _result(runs, order, _mixture(runs, region, order))
    reference = np.array([factor.reference for factor in runs.factors])
    target = None if order.target is None else ResponseTarget(order.target, order.target_error, reference)
    most_names = max(len(factor.levels) for factor in runs.factors)
    if most_names > 2 or (most_names and target is not None and order.surrogate is None):
        found = _named(runs, region, order, target)
        return _result(runs, order, replace(found, notes=(*found.notes, *_run_notes(runs, region, found))))
    _refuse_dependent(runs, region, order.sheet)
    try:
        found = analyse_design(
            runs.coded,
            runs.responses,
            region,
            _order(runs, order),
            _symbols(runs, order.terms),
            target if order.surrogate is None else None,
            runs.blocks,
            None if order.reduction is None else order.reduction.value,
        )
        if order.surrogate is not None:
            process = fit_process(runs.coded, runs.responses, region)
            answer = None if target is None else process_target(process, target)
            found = replace(found, surrogate=process, surrogate_target=answer)
    except StatisticsError as error:
        raise CommandError(f"{order.sheet}, column {runs.response}: {error}") from None
    return _result(runs, order, replace(found, notes=(*found.notes, *_run_notes(runs, region, found))))


def _refuse_surrogate(runs: Runs, order: AnalyseOrder) -> None:
    """Refuse what a Gaussian process cannot handle: groups, and distances between three names."""
    for option, given in {"--block": runs.blocks, "--random": runs.groups}.items():
        if given is not None:
            raise CommandError(f"--surrogate {order.surrogate}: cannot take groups of runs; leave out {option}")
    for factor in runs.factors:
        if factor.levels:
            others = ",".join(other.name for other in runs.factors if not other.levels)
            raise CommandError(
                f"--surrogate {order.surrogate}: {factor.name} has named levels; allowed: numeric factors, as with "
                f"--only {others}"
            )


def _result(runs: Runs, order: AnalyseOrder, analysis: DesignAnalysis) -> DesignResult:
    left_out = [f"Run {label} is left out, as the sheet says: {short(why)}." for label, why in runs.excluded]
    return DesignResult(
        sheet=order.sheet,
        design=runs.design,
        response=Response(runs.response, _response_path(runs), runs.unit),
        runs=RunCount(len(runs.coded), int((~np.isnan(runs.responses)).sum()), runs.missing),
        labels=_labels(runs),
        factors=_factors(runs),
        coded=runs.coded,
        target=order.target,
        analysis=replace(analysis, notes=(*left_out, *analysis.notes)),
        command=_command(order),
        versions=versions(),
        about=made_today(order.author, order.notes),
    )


def _whole(runs: Runs, region: Region) -> bool:
    """Whether all factors are the parts of a mixture: they have the same sum in every run with a result, and there is
    no other relation between them.
    """
    valid = ~np.isnan(runs.responses).all(axis=1)
    levels = region.natural(runs.coded[valid])
    if len(runs.factors) < 2 or any(factor.levels for factor in runs.factors) or len(levels) <= len(runs.factors):
        return False
    if (levels < -SAME).any():
        return False  # an amount cannot be below zero
    one_sum = bool(np.ptp(levels.sum(axis=1)) < SAME * np.abs(levels).max())
    return one_sum and bool(np.linalg.matrix_rank(levels - levels.mean(axis=0), tol=1e-6) == len(runs.factors) - 1)


def _refuse_rounded(runs: Runs, region: Region, sheet: str) -> None:
    """Raise CommandError for a mixture whose parts add up to nearly the same: of 0.33, 0.33 and 0.33 a hundredth is
    missing, and no model could tell it from a part.
    """
    sums = region.natural(runs.coded[~np.isnan(runs.responses).all(axis=1)]).sum(axis=1)
    if SAME * np.abs(sums).max() <= np.ptp(sums) <= ROUNDED * np.abs(sums).max():
        raise CommandError(
            f"{sheet}: the parts of the mixture add up to {sums.min():.6g} … {sums.max():.6g}; allowed: the same sum "
            "in every run; write the amounts with all their digits"
        )


def _mixture(runs: Runs, region: Region, order: AnalyseOrder) -> DesignAnalysis:
    """Scheffé's polynomial of a mixture; raises CommandError for options that do not apply to mixtures."""
    asked = {
        "--target": order.target is not None,
        "--terms": order.terms,
        "--block": order.block,
        "--reduce": order.reduction,
    }
    for option, given in asked.items():
        if given:
            raise CommandError(
                f"{option}: not allowed for a mixture: in {order.sheet} the factors add up to a constant sum"
            )
    polynomial: MixtureOrder | None = None
    if order.order is not None:
        polynomial = "linear" if order.order == ModelOrder.LINEAR else "quadratic"
    lows, highs = (np.array([getattr(factor, end) for factor in runs.factors]) for end in ("low", "high"))
    names = factor_letters(len(runs.factors))
    try:
        found = fit_mixture(region.natural(runs.coded), runs.responses, lows, names, polynomial, highs)
    except StatisticsError as error:
        raise CommandError(f"{order.sheet}, column {runs.response}: {error}") from None
    notes = ["A mixture: the factors add up to one sum in every run, and Scheffé's polynomial stands for the model."]
    if not found.rows[-1].sum_of_squares:
        notes.append(CONSTANT)
    return DesignAnalysis((), None, None, None, tuple(notes), mixture=found)


def _elementary(runs: Runs, region: Region, order: AnalyseOrder) -> DesignAnalysis:
    """The elementary effects of a Morris design; a model of the same runs has to be requested."""
    try:
        found = elementary_effects(runs.coded, runs.responses, region.names, runs.others)
    except StatisticsError as error:
        raise CommandError(f"{order.sheet}, column {runs.response}: {error}") from None
    note = "Elementary effects; --model linear, a target or --surrogate gp fits a model to the same runs."
    return DesignAnalysis((), None, None, None, (note,), elementary=found)


def _random(runs: Runs, region: Region, order: AnalyseOrder, groups: Blocks) -> DesignAnalysis:
    """The model with random groups; raises CommandError for options that do not apply to it."""
    for option, given in {"--target": order.target is not None, "--reduce": order.reduction}.items():
        if given:
            raise CommandError(f"{option}: not allowed with --random {order.random}; allowed: --block {order.random}")
    try:
        found = fit_random(
            runs.coded,
            runs.responses,
            region,
            [factor.levels for factor in runs.factors],
            groups,
            _order(runs, order),
            _symbols(runs, order.terms),
            runs.blocks,
        )
    except StatisticsError as error:
        raise CommandError(f"{order.sheet}, column {runs.response}: {error}") from None
    return DesignAnalysis((), None, None, None, (), random=found)


def _named(runs: Runs, region: Region, order: AnalyseOrder, target: ResponseTarget | None) -> DesignAnalysis:
    """The model of factors with named levels, together with numeric factors."""
    try:
        found = fit_named(
            runs.coded,
            runs.responses,
            region,
            [factor.levels for factor in runs.factors],
            _order(runs, order),
            _symbols(runs, order.terms),
            target,
            runs.blocks,
            None if order.reduction is None else order.reduction.value,
        )
    except StatisticsError as error:
        raise CommandError(f"{order.sheet}, column {runs.response}: {error}") from None
    notes = [] if found.reduced is None else [reduction_words(found.reduced)]
    numbers = sum(not names for names in found.levels)
    if target is not None and numbers > MOST_SOLVED:
        notes.append(
            f"The settings that give a target are searched for up to {MOST_SOLVED} numbers, not {numbers}: analyse the "
            "factors that act alone."
        )
    return DesignAnalysis((), None, None, None, tuple(notes), named=found)


def _refuse_dependent(runs: Runs, region: Region, sheet: str) -> None:
    """Raise CommandError, naming the factors, if the levels of the valid runs do not tell factors apart."""
    valid = ~np.isnan(runs.responses).all(axis=1)
    levels = region.natural(runs.coded[valid])
    names = [factor.name for factor in runs.factors]
    spread = np.ptp(runs.coded[valid], axis=0)
    for name, level, width in zip(names, levels[0], spread, strict=True):
        if width < SAME:
            raise CommandError(
                f"{sheet}, column {name}: is {level:.6g} in every run with a result, so its effect cannot be "
                f"estimated; leave it out with --only {','.join(one for one in names if one != name)}"
            )
    if int(valid.sum()) <= len(names):
        return  # too few runs for anything, which fitting the model will report
    centred = (runs.coded[valid] - runs.coded[valid].mean(axis=0)) / spread
    *_, singular, vectors = np.linalg.svd(centred, full_matrices=False)
    if singular[-1] > SAME * singular[0]:
        return
    tied = [k for k in range(len(names)) if abs(vectors[-1, k]) > SAME]
    listed = " and ".join([", ".join(names[k] for k in tied[:-1]), names[tied[-1]]])
    sums = levels[:, tied].sum(axis=1)
    if np.ptp(sums) < SAME * np.abs(levels).max():
        what = f"{listed} add up to {sums[0]:.6g} in every run: a mixture, of which one part follows from the others"
    else:
        what = f"{listed} change together in every run, so that their effects cannot be told apart"
    kept = [name for k, name in enumerate(names) if k != tied[-1]]
    raise CommandError(f"{sheet}: {what}; leave one out, as with --only {','.join(kept)}")


def _run_notes(runs: Runs, region: Region, found: DesignAnalysis) -> list[str]:
    """Notes about single runs: levels far outside a factor's range, and runs without which there is no model."""
    row, replicate = np.nonzero(~np.isnan(runs.responses))
    labels, notes = _labels(runs), []
    for factor in runs.factors:
        if factor.levels and found.named is None and len(factor.levels) == 2:
            notes.append(f"{factor.name}: −1 is {factor.levels[0]}, +1 is {factor.levels[1]}.")
    for label, k in zip(labels, row, strict=True):
        for factor, coded, level in zip(runs.factors, runs.coded[k], region.natural(runs.coded[k]), strict=True):
            if abs(coded) > FAR:
                notes.append(
                    f"{label}: {factor.name} is {level:.6g}, {abs(coded):.1f} half-widths from the middle of "
                    f"{factor.low:g} … {factor.high:g}: a slip? One such level decides the whole model."
                )
    if runs.grouping and runs.blocks is None and runs.groups is None:
        notes.append(
            f"Not used: {', '.join(runs.grouping)}. A column that says on which day, from which batch or by whom a run "
            "was made goes into --block."
        )
    if found.named is not None and runs.place.size:
        notes += _drift(runs.place[row, replicate], found.named.observed - found.named.predicted)
    if found.model is not None:
        model = found.model.surface
        if runs.place.size:
            notes += _drift(runs.place[row, replicate], model.observed - model.predicted)
        alone = [label for label, h in zip(labels, found.model.surface.leverage, strict=True) if h > FULL]
        if alone:
            one = len(alone) == 1
            notes.append(
                f"{'Run' if one else 'Runs'} {', '.join(alone)}: without {'it' if one else 'any of them'} this model "
                f"cannot be fitted, so {'it is' if one else 'they are'} fitted exactly, nothing checks "
                f"{'it' if one else 'them'}, and no R² can be predicted. Repeat {'it' if one else 'them'}, fill the "
                "lost cells, or take a smaller model (--model interactions)."
            )
    return notes


def _drift(place: IntArray, residual: Array) -> list[str]:
    """A note if the residuals, in the order of the runs, change sign too rarely to be chance.

    R runs of one sign among n₊ positive and n₋ negative residuals; P(R ≤ r) counts arrangements (Wald and Wolfowitz
    1940, Ann. Math. Stat. 11:147).
    """
    signs = residual[np.argsort(place, kind="stable")]
    signs = np.sign(signs[np.abs(signs) > SAME * np.abs(residual).max(initial=0.0)])
    plus, minus = int((signs > 0).sum()), int((signs < 0).sum())
    if not plus or not minus:
        return []
    stretches = 1 + int((signs[1:] != signs[:-1]).sum())

    def arrangements(r: int) -> int:
        half, odd = divmod(r, 2)
        if not odd:
            return 2 * math.comb(plus - 1, half - 1) * math.comb(minus - 1, half - 1)
        return math.comb(plus - 1, half) * math.comb(minus - 1, half - 1) + math.comb(plus - 1, half - 1) * math.comb(
            minus - 1, half
        )

    p = sum(arrangements(r) for r in range(2, stretches + 1)) / math.comb(plus + minus, plus)
    if p >= RARE:
        return []
    return [
        f"In the order of the runs the residuals change their sign {stretches - 1} times, too rarely for chance "
        f"(p = {p:.2g}): something drifted, or a day, a batch or a person changed. A column that says which goes into "
        "--block."
    ]


def _order(runs: Runs, order: AnalyseOrder) -> Order | None:
    """The order of the model; a design for main effects only is meant for the linear model."""
    if order.order is not None:
        return next(one for one in ORDERS if one == order.order)
    design = DESIGNS.get(runs.design)
    if order.terms or design is None or not design.main_effects_only:
        return None
    valid = int((~np.isnan(runs.responses)).sum())
    return "linear" if valid > len(runs.factors) + 1 else None


def _symbols(runs: Runs, terms: tuple[str, ...]) -> tuple[str, ...]:
    """Terms in letters; a term may be written with letters or with the names of the factors (`factor_words`)."""
    letters, known = factor_letters(len(runs.factors)), factor_words(runs.factors)

    def symbol(part: str) -> str:
        if part not in known:
            raise CommandError(f"--terms: no factor {part!r}; allowed: {', '.join(known)}, as in A,B,A*B,A^2")
        return letters[known[part]]

    found = []
    for term in terms:
        parts = term.replace("²", "^2").removesuffix("^2").split("*")
        names = sorted({symbol(part.strip()) for part in parts}, key=letters.index)
        square = term.endswith(("^2", "²")) or len(parts) > len(names)
        if len(parts) > 2 or (square and len(names) > 1):
            raise CommandError(f"--terms {term}: allowed: factors, products of two and squares, as in A,B,A*B,A^2")
        found.append(f"{names[0]}^2" if square else "*".join(names))
    return tuple(found)


def _factors(runs: Runs) -> tuple[SheetFactor, ...]:
    return tuple(
        SheetFactor(
            name=letter,
            path=own_path(factor.name, factor.unit),
            low=factor.low,
            high=factor.high,
            reference=factor.reference,
            factor=factor.name,
            unit=factor.unit,
        )
        for letter, factor in zip(factor_letters(len(runs.factors)), runs.factors, strict=True)
    )


def _response_path(runs: Runs) -> str:
    """Name and unit; a response without a unit is an angle if its name says so."""
    if not runs.unit and runs.response.endswith("_deg"):
        return own_path(runs.response.removesuffix("_deg"), "°")
    return own_path(runs.response, {"1": "", "deg": "°"}.get(runs.unit, runs.unit))


def _labels(runs: Runs) -> tuple[str, ...]:
    """Labels of the valid runs, in the order of the surface's runs."""
    row, replicate = np.nonzero(~np.isnan(runs.responses))
    return tuple(runs.labels[i][j] for i, j in zip(row, replicate, strict=True))


def _only_response(path: Path, responses: list[str]) -> str:
    if len(responses) == 1:
        return responses[0]
    raise CommandError(
        f"{path}: --response NAME is needed; the responses are {', '.join(responses) or 'none; add a column'}"
    )


def _command(order: AnalyseOrder) -> tuple[str, ...]:
    """The order as words of a command line, without the place that the results were written to."""
    words = ["explorer", "analyse", order.sheet]
    options: list[tuple[str, Any, Callable[[Any], str]]] = [
        ("--response", order.response, str),
        ("--target", order.target, repr),
        ("--target-error", order.target_error or None, repr),
        ("--factors", order.factors, str),
        ("--model", order.order, str),
        ("--terms", order.terms, ",".join),
        ("--only", order.only, ",".join),
        ("--block", order.block, str),
        ("--random", order.random, str),
        ("--reduce", order.reduction, str),
        ("--surrogate", order.surrogate, str),
    ]
    for option, value, write in options:
        if value is not None and value not in ("", ()):
            words += [option, write(value)]
    return tuple(words)
