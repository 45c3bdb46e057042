"""Materials and pairs of materials: the input of a contact law, without the law itself."""

from __future__ import annotations

from dataclasses import dataclass

from solver.params import param


@dataclass(frozen=True)
class Material:
    """An isotropic elastic solid. ``youngs_modulus`` follows from E = 2 G (1 + ν)."""

    name: str
    density: float = param(1000.0, unit="kg/m3", low=1.0, high=3e4, doc="Density of the solid.")
    shear_modulus: float = param(1e7, unit="Pa", low=1e4, high=1e12, doc="Shear modulus G.", live=True, scale="log")
    poisson_ratio: float = param(0.3, low=0.0, high=0.49, doc="Poisson's ratio ν.", live=True)

    @property
    def youngs_modulus(self) -> float:
        """Young's modulus E = 2 G (1 + ν) [Pa]."""
        return 2.0 * self.shear_modulus * (1.0 + self.poisson_ratio)


@dataclass(frozen=True)
class Pair:
    """What two surfaces do to each other; ``a`` and ``b`` are body or material names, in no particular order."""

    a: str
    b: str
    static_friction: float = param(0.5, low=0.0, high=3.0, doc="Coulomb friction coefficient μ.", live=True)
    restitution: float = param(
        0.5, low=0.05, high=1.0, doc="Coefficient of restitution e of a central impact.", live=True
    )

    def joins(self, a: str, b: str) -> bool:
        """True if this is the pair of ``a`` and ``b``, in either order."""
        return {self.a, self.b} == {a, b}


def effective_youngs_modulus(one: Material, two: Material) -> float:
    """E* with 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂ [Pa] (Hertz 1882)."""
    compliance = sum((1.0 - m.poisson_ratio**2) / m.youngs_modulus for m in (one, two))
    return 1.0 / compliance


def effective_shear_modulus(one: Material, two: Material) -> float:
    """G* with 1/G* = (2 − ν₁)/G₁ + (2 − ν₂)/G₂ [Pa] (Mindlin 1949)."""
    return 1.0 / sum((2.0 - m.poisson_ratio) / m.shear_modulus for m in (one, two))
