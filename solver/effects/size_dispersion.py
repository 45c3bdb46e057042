"""Sizes scatter although the declared bodies are all alike: log-normal linear sizes with the mean kept.

    s ~ log-normal, E[s] = 1, standard deviation σ        (``solver/scenes/sizes.py``)

Vanishes for σ → 0. The poured mass is kept, so the number of bodies falls by the factor E[s³] = 1 + 3 σ² + ….
Source: log-normal sizes of comminuted and natural grains, e.g. Allen 1997, Particle Size Measurement.
"""

from dataclasses import dataclass, replace
from typing import Any

from solver.effects.effect import SetUpEffect, Telltale
from solver.params import ParameterError, param
from solver.scenes.sizes import MOST_SPREAD, SizeDistribution


@dataclass(frozen=True)
class SizeDispersion(SetUpEffect):
    """Scatter of linear sizes; ``spread`` is the amplitude. Bodies that already have a distribution keep its kind."""

    spread: float = param(0.0, low=0.0, high=0.4, doc="Standard deviation σ of the linear size over its mean.")

    name = "size_dispersion"
    amplitudes = ("spread",)
    strongest = 0.3
    literature = "0.03–0.15 within a variety of seeds, up to 0.3 in unsieved mixtures"
    lever = "sieve, and pour one class; segregation over the radius"
    telltales = (Telltale.PACKING,)

    def applied(self, scene: Any) -> Any:
        """``scene`` with the spread added in quadrature to that of every component."""
        if self.spread == 0.0:
            return scene

        def spread(sizes: SizeDistribution) -> SizeDistribution:
            kind = sizes.kind if sizes.kind != "none" else "log_normal"
            before = sizes.spread if sizes.varies else 0.0
            together = (before**2 + self.spread**2) ** 0.5
            if together > MOST_SPREAD:
                raise ParameterError(
                    f"effect.size_dispersion.spread: {self.spread:g} and the declared size_spread {before:g} combine "
                    f"to {together:.3g}; allowed: up to {MOST_SPREAD:g}"
                )
            return SizeDistribution(kind, together)

        return replace(scene, bodies=tuple(replace(body, sizes=spread(body.sizes)) for body in scene.bodies))
