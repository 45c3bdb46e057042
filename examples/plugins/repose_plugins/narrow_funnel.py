"""A funnel whose feed opening is 95 mm wide instead of 114."""

from dataclasses import dataclass

from solver.params import param
from solver.rigs import Funnel


@dataclass(frozen=True)
class NarrowFunnel(Funnel):
    """Dimensions of the rig and the mass that is poured."""

    inlet_diameter: float = param(0.095, unit="m", low=0.01, high=2.0, doc="Inner diameter of the feed opening.")

    name = "narrow_funnel"
