"""The whole analysis of a design that was run in any laboratory or engine, from its runs to the settings for a target.

Two-level designs are screened (effects, Lenth, error by replicates or by columns that carry no factor). Every design
whose runs support it gets a polynomial model with its analysis of variance, diagnostics and the path of steepest
ascent, and a full second-order model also its canonical analysis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from doe.analysis.canonical import Canonical, RidgePath, canonical_analysis, ridge_analysis
from doe.analysis.contrasts import (
    Contrasts,
    Curvature,
    curvature,
    is_regular,
    regular_contrasts,
    screening_contrasts,
    separable_contrasts,
)
from doe.analysis.elementary_effects import ElementaryEffects
from doe.analysis.few_terms import FewTermsModel, few_terms
from doe.analysis.gaussian_process import GaussianProcess, ProcessTarget
from doe.analysis.mixture import MixtureFit
from doe.analysis.model_adequacy import BoxCox, Diagnostics, box_cox, diagnose_fit
from doe.analysis.models import (
    STAYS,
    Order,
    OrderFit,
    ReducedModel,
    Reduction,
    bearable,
    fit_summary,
    hierarchical,
    highest_order,
    reduced_model,
    terms_of,
)
from doe.analysis.named_factors import NamedFit
from doe.analysis.optimum import Optimum, ResponseTarget, find_optimum
from doe.analysis.random_groups import RandomFit
from doe.analysis.replicates import row_moments
from doe.analysis.screening import Screening, analyse_screening
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import Blocks, Surface, fit_surface, term_names
from doe.analysis.surface_anova import SurfaceAnova, analyse_surface
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

MOST_SOLVED = 4
"""Factors up to which the settings that give a target are searched for."""
REFITS = 1000
"""Bootstrap refits of the solution; half of them where the search takes long."""


@dataclass(frozen=True)
class FittedModel(Record):
    """A fitted polynomial and what it says. canonical: only with all squares."""

    surface: Surface
    anova: SurfaceAnova
    diagnostics: Diagnostics
    box_cox: BoxCox
    canonical: Canonical | None
    highest: RidgePath
    lowest: RidgePath


@dataclass(frozen=True)
class Effects(Record):
    """The contrasts of a two-level design, their effects, and the centre runs against the corners.

    few_terms: models of few main effects and interactions, for a design whose effects share columns in part.
    """

    contrasts: Contrasts
    screening: Screening
    curvature: Curvature | None
    few_terms: tuple[FewTermsModel, ...] = ()


@dataclass(frozen=True)
class TargetIntervals(Record):
    """Half widths of intervals about the model at the setting for a target, unit of the response: for one further run
    (95 %), and for 95 % of all further runs with a confidence of 95 %.
    """

    one_run: float
    most_runs: float


@dataclass(frozen=True)
class DesignAnalysis(Record):
    """Results of the runs of a design. effects: None unless every level is low, high or (all factors) middle. model:
    None where the runs leave no error for any model. notes: sentences that a reader must know. at_target: None without
    an optimum. reduced: None without a search for terms to drop. In place of all these: mixture, if the factors are
    parts of a whole; named, if factors are names; random, if groups are drawn at random; elementary, for a Morris
    design. surrogate: in addition to the model, with its own setting for the target; None unless asked for.
    """

    fits: tuple[OrderFit, ...]
    effects: Effects | None
    model: FittedModel | None
    optimum: Optimum | None
    notes: tuple[str, ...]
    mixture: MixtureFit | None = None
    at_target: TargetIntervals | None = None
    reduced: ReducedModel | None = None
    named: NamedFit | None = None
    random: RandomFit | None = None
    elementary: ElementaryEffects | None = None
    surrogate: GaussianProcess | None = None
    surrogate_target: ProcessTarget | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return every field; fields that only some analyses have are left out where they are None."""
        optional = ("mixture", "at_target", "reduced", "named", "random", "elementary", "surrogate", "surrogate_target")
        own = {name for name in optional if getattr(self, name) is None}
        return {name: value for name, value in super().to_dict().items() if name not in own}


def analyse_design(
    coded: FloatArray,
    responses: FloatArray,
    region: Region,
    order: Order | None = None,
    terms: Sequence[str] = (),
    target: ResponseTarget | None = None,
    blocks: Blocks | None = None,
    reduction: Reduction | None = None,
) -> DesignAnalysis:
    """Analyse one response.

    coded: settings, shape (rows, k), low = -1, high = +1. responses: (rows, replicates), NaN where a run is missing.
    order: "linear", "interactions" or "quadratic"; None for the highest that the runs support with 3 degrees of freedom
    for the error. terms: the terms of the model instead of an order; the linear terms that they need are added. blocks:
    those in which the runs were made; they have fixed effects in the model, and the effects of a two-level design are
    then given by the model alone. reduction: rule by which terms are dropped from this model.
    Raises StatisticsError where nothing can be estimated, or the runs do not support the order or terms asked for.
    """
    notes: list[str] = []
    effects = None if blocks is not None else _effects(coded, responses, region.names, notes)
    chosen = _terms(coded, responses, region.names, order, terms, effects is not None, blocks)
    reduced = None
    if reduction is not None and chosen is not None:
        reduced = reduced_model(coded, responses, region, chosen, reduction, blocks)
        chosen = reduced.terms
        notes.append(reduction_words(reduced))
    model = None if chosen is None else _model(fit_surface(coded, responses, region, chosen, blocks), region.names)
    if model is None:
        notes.append("The runs leave no error for a model: effects stand beside Lenth's margin only.")
    optimum = None
    if target is not None and model is not None:
        if len(region.names) > MOST_SOLVED:
            notes.append(
                f"The settings that give a target are searched for up to {MOST_SOLVED} factors, not "
                f"{len(region.names)}: analyse the factors that act alone."
            )
        else:
            optimum = find_optimum(
                model.surface,
                target.value,
                target.reference,
                refits=REFITS if len(region.names) < MOST_SOLVED else REFITS // 2,
                target_standard_error=target.standard_error,
            )
            notes += _extrapolation(optimum, model.surface)
    fits = () if chosen is None else fit_summary(coded, responses, region, blocks)
    at_target = None
    if optimum is not None and model is not None:
        at = optimum.point_coded
        at_target = TargetIntervals(
            float(model.surface.prediction_half_width(at)), float(model.surface.tolerance_half_width(at))
        )
    return DesignAnalysis(fits, effects, model, optimum, tuple(notes), at_target=at_target, reduced=reduced)


def reduction_words(found: ReducedModel) -> str:
    """Return a sentence on which terms were dropped, and on how this affects the tests of the remaining terms."""
    rule = "AICc" if found.rule == "aicc" else f"p > {STAYS:g}"
    if not found.dropped:
        return f"Reduction by {rule} drops no term."
    return (
        f"Reduced by {rule}, one term after the other: {', '.join(found.dropped)}. The p values and intervals of "
        "what is left take no account of this search and are too small."
    )


def _terms(
    coded: FloatArray,
    responses: FloatArray,
    names: Sequence[str],
    order: Order | None,
    terms: Sequence[str],
    saturated_is_fine: bool,
    blocks: Blocks | None,
) -> tuple[str, ...] | None:
    """Return the terms of the model; None where the runs support no model and effects are estimated without one."""
    if terms:
        return hierarchical(names, terms)
    if order is not None:
        return terms_of(names, order)
    if saturated_is_fine and not bearable(coded, responses, names, terms_of(names, "linear")):
        return None
    return terms_of(names, highest_order(coded, responses, names, blocks=blocks))


def _model(surface: Surface, names: Sequence[str]) -> FittedModel:
    anova = analyse_surface(surface)
    squares = surface.included[len(term_names(names)) - len(names) :]
    highest, lowest = ridge_analysis(surface)
    return FittedModel(
        surface=surface,
        anova=anova,
        diagnostics=diagnose_fit(surface, anova),
        box_cox=box_cox(surface),
        canonical=canonical_analysis(surface) if squares.all() else None,
        highest=highest,
        lowest=lowest,
    )


def _extrapolation(optimum: Optimum, surface: Surface) -> list[str]:
    """Return a warning where the chosen setting is further from the centre than any run, as the corners are from a
    Box–Behnken design.
    """
    distance = float(np.linalg.norm(optimum.point_coded))
    furthest = float(np.linalg.norm(surface.points, axis=1).max())
    if distance <= furthest + 1e-6:
        return []
    return [
        f"The chosen setting is {distance:.2f} half-widths from the centre, further than any run ({furthest:.2f}): "
        "there the model is an extrapolation; run it before it is used."
    ]


def _effects(coded: FloatArray, responses: FloatArray, names: Sequence[str], notes: list[str]) -> Effects | None:
    """Return the effects of a two-level design; None for another one."""
    corner, centre = (np.abs(coded) == 1).all(axis=1), ~coded.any(axis=1)
    if not corner.any() or not (corner | centre).all():
        return None
    levels, values = coded[corner].astype(np.int64), responses[corner]
    if np.linalg.matrix_rank(np.column_stack([np.ones(len(levels)), levels])) <= len(names):
        return None
    regular = is_regular(levels)
    contrasts = regular_contrasts(levels, names) if regular else screening_contrasts(levels, names)
    valid = ~np.isnan(values).all(axis=1)
    if not valid.all():
        whole, contrasts = contrasts, separable_contrasts(contrasts, levels, names, valid)
        if lost := [name for name in whole.names if name not in contrasts.names]:
            notes.append(
                f"Rows without a valid run: the effects leave out {', '.join(lost)}, which cannot be separated."
            )
    screening = analyse_screening(contrasts.levels, contrasts.names, values, contrasts.dummies)
    searched = () if regular else few_terms(levels, names, row_moments(values)[0])
    return Effects(contrasts, screening, curvature(contrasts.levels, values, responses[centre]), searched)
