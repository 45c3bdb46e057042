"""The response surface of one target with what the charts mark on it: the runs, the target, the reference, the optimum.

A study's surface and that of a design from any laboratory are drawn by the same charts; both come as `FittedTarget`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.analysis.surface import Surface
from doe.analysis.surface_anova import SurfaceAnova
from doe.stages.surface import OptimumResult, SurfaceResult
from doe.studies.study import Factor
from doe.studies.study_result import AnyStudy
from doe.target import Target
from explorer.report.identified import BY_RULE, all_identified

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class FittedTarget:
    """Natural values in SI, the response in the unit of the store; k factors."""

    model: Surface
    anova: SurfaceAnova
    factors: tuple[Factor, ...]
    design: Array
    """Natural levels of the points of the design, shape (points, k)."""
    observable: str
    target: float | None
    margin: float
    optimum: OptimumResult | None
    reference_name: str = "measured parameters"
    """What the reference values of the factors are called."""

    @property
    def low(self) -> Array:
        """Lower end of the region, shape (k,)."""
        return self.model.region.centre - self.model.region.half_width

    @property
    def high(self) -> Array:
        """Upper end of the region, shape (k,)."""
        return self.model.region.centre + self.model.region.half_width

    @property
    def chosen(self) -> list[float] | None:
        """The optimum in the order of the factors (natural); None before there is one."""
        return None if self.optimum is None else [self.optimum.values[factor.path] for factor in self.factors]

    @property
    def chosen_name(self) -> str:
        """What the chosen point is called."""
        return "optimum" if self.optimum is None or all_identified(self.optimum) else BY_RULE

    @property
    def section_point(self) -> list[float]:
        """Where sections through the surface are laid (natural): the optimum, or the middle of the region before it."""
        return self.chosen or self.model.region.centre.tolist()


def fitted_targets(result: AnyStudy) -> tuple[FittedTarget, ...]:
    """One per target of a study; none before its surface."""
    if result.surface is None:
        return ()
    return tuple(_fitted(result.surface, k, target, result.optimum) for k, target in enumerate(result.study.targets))


def _fitted(surface: SurfaceResult, k: int, target: Target, optimum: OptimumResult | None) -> FittedTarget:
    return FittedTarget(
        model=surface.models[k],
        anova=surface.anova[k],
        factors=surface.factors,
        design=surface.natural,
        observable=target.observable,
        target=target.mean,
        margin=target.margin,
        optimum=optimum,
    )
