"""A design with the order of its runs and the effects that they can detect: the content of ``plan.json``."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from doe.analysis.models import Order, bearable, highest_order, terms_of
from doe.analysis.named_factors import order_of_names, orders_of
from doe.analysis.power import TermPrecision, precision, precision_of_names
from doe.analysis.surface import Blocks
from doe.designs import factor_letters
from doe.provenance import About
from doe.record import Document
from explorer.design.factors_file import DesignFactor, FactorsFile, region_of
from explorer.design.run_plan import RunPlan
from explorer.files.run_result import versions
from explorer.units import enumeration, number

Array = npt.NDArray[np.float64]
TERMS = {
    "factor": "of a factor",
    "name": "between two names",
    "interaction": "of an interaction",
    "square": "curvature, centre → end",
}
"""Kind of a term → the change that it describes, in words."""
OF_NAMES = (
    "A factor of three names and more is tested by all of them at once (F); the change is that between two of its "
    "names, the others midway, which is seen least."
)


@dataclass(frozen=True, kw_only=True)
class PlanResult(Document):
    """A design with the order of its runs: the content of ``plan.json``.

    ``coded``: levels of its rows, −1 … +1, shape (rows, k). ``sequence``: row and replicate of every run, from 1, in
    the order to make them; ``seeds`` and ``block`` (from 1, empty without blocks) of each. ``model``: the polynomial
    that the runs support. ``power``: their precision for its terms, as multiples of sigma if ``sigma`` is NaN.
    """

    SCHEMA: ClassVar[int] = 1
    NAME: ClassVar[str] = "plan.json"

    kind: str = "design"
    title: str
    design: str
    traits: tuple[str, ...]
    factors: tuple[DesignFactor, ...]
    responses: tuple[str, ...]
    replicates: int
    seed: int
    coded: Array
    sequence: tuple[tuple[int, int], ...]
    seeds: tuple[int, ...]
    block: tuple[int, ...]
    aliases: tuple[str, ...]
    notes: tuple[str, ...]
    model: str
    power: tuple[TermPrecision, ...]
    sigma: float
    versions: dict[str, str | None]
    about: About = field(default_factory=About)


def design_plan(
    plan: RunPlan, file: FactorsFile, sigma: float | None, effect: float | None, about: About
) -> PlanResult:
    """The record of ``plan``; ``sigma``: standard deviation of one run, ``effect``: a change to detect, if known."""
    order = planned_order(plan, file)
    return PlanResult(
        title=file.title,
        design=plan.design.name,
        traits=(*plan.points.traits, *plan.points.generators),
        factors=file.factors,
        responses=file.response_titles,
        replicates=plan.replicates,
        seed=plan.seed,
        coded=plan.coded,
        sequence=tuple((int(row) + 1, int(replicate) + 1) for row, replicate in plan.sequence),
        seeds=tuple(map(int, plan.seeds)),
        block=tuple(int(one) + 1 for one in plan.block),
        aliases=plan.points.aliases,
        notes=(*beyond(plan, file), *blocks(plan), *plan.points.notes),
        model=order or "",
        power=planned_power(plan, file, sigma, effect),
        sigma=math.nan if sigma is None else sigma,
        versions=versions(),
        about=about,
    )


def beyond(plan: RunPlan, file: FactorsFile) -> list[str]:
    """A sentence about runs outside low … high, which a laboratory may not be able to make."""
    if plan.finished or np.abs(plan.coded).max() <= 1 + 1e-9:
        return []
    natural = region_of(file.factors).natural(plan.coded)
    ends = [
        f"{factor.name} {number(low, 6)} … {number(high, 6)}"
        for factor, low, high in zip(file.factors, natural.min(axis=0), natural.max(axis=0), strict=True)
    ]
    return [f"The axial runs go beyond low … high: {enumeration(ends)}. --alpha inscribed keeps them within."]


def blocks(plan: RunPlan) -> list[str]:
    """A sentence about the blocks: their sizes, in running order."""
    if not len(plan.block):
        return []
    sizes = ", ".join(map(str, np.bincount(plan.block)))
    of = "whole replicates" if not len(plan.points.block) else "rows"
    return [f"Blocks of {of}, of {sizes} runs, one block after the other, shuffled within each."]


def planned_order(plan: RunPlan, file: FactorsFile) -> Order | None:
    """The model that the runs support besides their blocks; None if even a linear one leaves nothing for the error."""
    letters = factor_letters(plan.coded.shape[1])
    runs, values = plan.coded[plan.sequence[:, 0]], np.zeros((len(plan.sequence), 1))
    if _many_names(file):
        found = order_of_names(runs, _names(file), plan.block)
        return "linear" if found is not None and plan.design.main_effects_only else found
    blocks = None
    if len(plan.block):
        names = tuple(str(number + 1) for number in range(plan.block.max() + 1))
        blocks = Blocks(names, plan.block[:, None])
    linear = bearable(runs, values, letters, terms_of(letters, "linear"), blocks)
    if plan.design.main_effects_only or not linear:
        return "linear" if linear else None
    return highest_order(runs, values, letters, blocks=blocks)


def planned_power(
    plan: RunPlan, file: FactorsFile, sigma: float | None, effect: float | None
) -> tuple[TermPrecision, ...]:
    """The precision of the runs for each kind of term of the model, in units of sigma if sigma is not known."""
    order = planned_order(plan, file)
    if order is None:
        return ()
    letters = factor_letters(plan.coded.shape[1])
    runs = plan.coded[plan.sequence[:, 0]]
    # Without a known sigma, everything is in units of sigma.
    if _many_names(file):
        levels = _names(file)
        terms = orders_of(levels)[order]
        return precision_of_names(runs, levels, terms, sigma or 1.0, effect or math.nan, block=plan.block)
    return precision(runs, letters, terms_of(letters, order), sigma or 1.0, effect or math.nan, block=plan.block)


def _many_names(file: FactorsFile) -> bool:
    """Whether a factor has more names than the polynomials of `doe.analysis` tell apart."""
    return any(len(factor.levels) > 2 for factor in file.factors)


def _names(file: FactorsFile) -> list[int]:
    """Number of names per factor, 0 for a numeric factor."""
    return [len(factor.levels) for factor in file.factors]
