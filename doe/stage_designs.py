"""The design of a stage, from its table in a study file: ``design = "NAME"`` and the options of that family."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from doe.designs import ALPHAS, DESIGNS, BoxBehnken, ChosenDesign, DesignOptions, PlackettBurman, Points
from doe.errors import StatisticsError, StudyFileError
from doe.study_table import Table, one_of, only, section, whole
from doe.surface import second_order_terms, with_intercept

if TYPE_CHECKING:
    from doe.study import Factor

DUMMIES = 3
"""Columns of a table for main effects alone that stay free of factors, where the file says nothing."""
IN_STUDIES = DesignOptions(alpha="face-centred")
"""Options where a study says nothing: the axial points stay in the region that is searched."""
SCREENING = ChosenDesign(PlackettBurman(), replace(IN_STUDIES, runs=28))
ASSUMPTIONS = ChosenDesign(PlackettBurman(), replace(IN_STUDIES, runs=12))
SURFACE = ChosenDesign(BoxBehnken(), replace(IN_STUDIES, centre=5))


def main_effect_design(
    table: Table, key: str, whose: str, usual: ChosenDesign, factors: Sequence[Factor], dummies: int | None
) -> ChosenDesign:
    """The design of a stage that looks at main effects, read from ``table[key]`` and checked with its factors.

    ``whose``: key of the factors in the file. ``dummies``: columns that have to stay free in a design that is made for
    main effects alone; None: three. Raises StudyFileError.
    """
    chosen = _chosen(table, key, usual)
    if not factors:
        return chosen
    name, free = chosen.design.name, DUMMIES if dummies is None else dummies
    try:
        points = chosen.points(len(factors))
    except StatisticsError as error:
        raise StudyFileError(f"{whose}: {len(factors)} in the {name} design of [{key}]: {error}") from None
    _require_inside(points, key, name)
    columns = points.unused.shape[1]
    if columns < free and chosen.design.main_effects_only:
        most = len(factors) + columns - free
        raise StudyFileError(
            f"{whose}: {len(factors)} {whose}s with {free} dummies; allowed: up to {most} in a {len(points.coded)}-run "
            f"{name} design"
        )
    model = with_intercept(points.coded)
    if np.linalg.matrix_rank(model) < model.shape[1]:
        raise StudyFileError(f"{key}.design: {name} cannot tell the main effects of {len(factors)} {whose}s apart")
    named = [factor.name for factor in factors if isinstance(factor.low, str)]
    if named and not (np.abs(points.coded) == 1).all():
        raise StudyFileError(f"{key}.design: {name} has levels between low and high, which {named[0]} has not")
    return chosen


def second_order_design(table: Table, key: str, usual: ChosenDesign, factors: int) -> ChosenDesign:
    """The design of a stage that fits a full second-order model; raises StudyFileError where it cannot."""
    chosen = _chosen(table, key, usual)
    name = chosen.design.name
    try:
        points = chosen.points(factors)
    except StatisticsError as error:
        raise StudyFileError(f"{key}: {error}") from None
    _require_inside(points, key, name)
    model = second_order_terms(points.coded)
    if np.linalg.matrix_rank(model) < model.shape[1]:
        raise StudyFileError(
            f"{key}.design: the {len(points.coded)} rows of {name} cannot tell apart the {model.shape[1]} terms of a "
            f"second-order model of {factors} factors"
        )
    return chosen


def _chosen(table: Table, key: str, usual: ChosenDesign) -> ChosenDesign:
    entry = section(table, key)
    design = DESIGNS[one_of(entry.get("design", usual.design.name), f"{key}.design", DESIGNS)]
    only(entry, {"design", "seed", *design.options}, key)
    options = usual.options if design.name == usual.design.name else IN_STUDIES
    values = {name: _option(f"{key}.{name}", name, entry[name]) for name in entry if name != "design"}
    return ChosenDesign(design, replace(options, **values))


def _option(where: str, name: str, value: Any) -> Any:
    if name == "alpha":
        return one_of(value, where, ALPHAS)
    if name == "fold":
        if not isinstance(value, bool):
            raise StudyFileError(f"{where}: {value!r} is neither true nor false")
        return value
    if name == "generators":
        if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
            raise StudyFileError(f'{where}: a list such as ["D=ABC"] is needed, not {value!r}')
        return tuple(value)
    return whole(value, where, least=0)


def _require_inside(points: Points, key: str, name: str) -> None:
    """Beyond low … high a parameter may be out of its range, or a factor mean nothing."""
    furthest = float(np.abs(points.coded).max())
    if furthest > 1.0 + 1e-9:
        raise StudyFileError(
            f"{key}.design: {name} has points {furthest:.3g} times as far out as low and high; allowed: 1, as with "
            'alpha = "face-centred" or "inscribed"'
        )
