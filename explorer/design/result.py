"""An analysed sheet with its order: the content of ``result.json``, and the views of it that charts draw."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from doe.analysis.analyse import DesignAnalysis
from doe.analysis.contrasts import Curvature
from doe.analysis.screening import Screening
from doe.provenance import About
from doe.record import Document, Record
from doe.stages.surface import OptimumResult
from doe.studies.study import Factor
from explorer.report.figures.model import FittedTarget

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class SheetFactor(Factor):
    """A factor of a sheet, called by its letter. ``factor``, ``unit``: its name and unit; all values in that unit."""

    factor: str
    unit: str


@dataclass(frozen=True)
class Response(Record):
    """The analysed column. ``path``: name and unit as the charts read them (`own_path`)."""

    name: str
    path: str
    unit: str


@dataclass(frozen=True)
class RunCount(Record):
    """Rows of the design, runs with a result, and runs without."""

    rows: int
    valid: int
    missing: int


@dataclass(frozen=True)
class DrawnEffects:
    """The effects of a two-level design, in the form that the charts of a screening read."""

    analysis: Screening
    columns: tuple[str, ...]
    factors: tuple[SheetFactor, ...]
    response: str
    aliases: Mapping[str, tuple[str, ...]]
    """Column → the other effects that it contains."""
    curvature: Curvature | None


@dataclass(frozen=True, kw_only=True)
class DesignResult(Document):
    """``design``: kind of the design, "" if the sheet does not state it. ``coded``: its levels, shape (rows, k).

    ``labels``: labels of the valid runs, in the order of the model's runs. ``target``: the requested value.
    """

    SCHEMA: ClassVar[int] = 2
    NAME: ClassVar[str] = "result of a design"

    kind: str = "design analysis"
    sheet: str
    design: str
    response: Response
    runs: RunCount
    labels: tuple[str, ...]
    factors: tuple[SheetFactor, ...]
    coded: Array
    target: float | None
    analysis: DesignAnalysis
    command: tuple[str, ...]
    versions: dict[str, str | None]
    about: About = field(default_factory=About)

    @property
    def names(self) -> tuple[tuple[str, ...], ...]:
        """The names of each factor, () for a numeric one, in a model that tells names apart."""
        found = self.analysis.named or self.analysis.random
        return found.levels if found is not None else ((),) * len(self.factors)

    def levels_of(self, row: int) -> tuple[float | str, ...]:
        """The levels of a row of the design: numbers in the units of their factors, and names."""
        names = self.names
        return tuple(
            own[round((coded + 1) / 2 * (len(own) - 1))]
            if own
            else (float(factor.low) + float(factor.high)) / 2 + (float(factor.high) - float(factor.low)) / 2 * coded
            for factor, own, coded in zip(self.factors, names, self.coded[row].tolist(), strict=True)
        )

    @property
    def effects(self) -> DrawnEffects | None:
        """The effects of a two-level design; None for any other."""
        found = self.analysis.effects
        if found is None:
            return None
        contrasts = found.contrasts
        return DrawnEffects(
            found.screening, contrasts.names, self.factors, self.response.path, contrasts.aliases, found.curvature
        )

    @property
    def optimum(self) -> OptimumResult | None:
        """The setting for the target; None if no target was given, or there is no model."""
        found = self.analysis.optimum
        if found is None:
            return None
        values = {factor.path: value for factor, value in zip(self.factors, found.point.tolist(), strict=True)}
        return OptimumResult(values=values, factors=self.factors, single=found, compromise=None)

    @property
    def fitted(self) -> FittedTarget | None:
        """The response surface; None if the runs do not support a model."""
        found = self.analysis.model
        if found is None:
            return None
        return FittedTarget(
            model=found.surface,
            anova=found.anova,
            factors=self.factors,
            design=found.surface.region.natural(self.coded),
            observable=self.response.path,
            target=self.target,
            margin=0.0,
            optimum=self.optimum,
            reference_name="reference",
        )
