"""Components of a mixture: what a body is made of, how it is shaped, and how many of it are poured."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Literal, cast

from solver.clump import Clump, explicit_clump, fit_clump
from solver.material import Material
from solver.params import Parameter
from solver.shape import Solid, mass_properties

Resolution = Literal["coarse", "standard", "fine"]

RESOLUTION = Parameter(
    "body.spheres", "1", 0, 0, "Number of member spheres per body.", choices=("coarse", "standard", "fine")
)

DIMENSIONS: dict[str, tuple[str, ...]] = {
    "ellipsoid": ("length", "width", "thickness"),
    "box": ("length", "width", "thickness"),
    "cylinder": ("diameter", "length"),
    "sphere": ("diameter",),
    "mesh": (),
}
"""Names of the entries of ``Solid.dimensions``, as they stand in parameter paths."""


@dataclass(frozen=True)
class Members:
    """A body declared by its spheres: centres (n, 3) and radii (n,) [m], mass [kg], principal inertia (3,) [kg m²]."""

    centres: tuple[tuple[float, float, float], ...]
    radii: tuple[float, ...]
    mass: float
    inertia: tuple[float, float, float]


@dataclass(frozen=True)
class Body:
    """One component of the mixture. ``shape`` is a solid to be filled with spheres, or the spheres themselves."""

    name: str
    material: str
    mass_fraction: float
    shape: Solid | Members
    density: float
    """That of the material [kg/m³]; :func:`with_densities` keeps the two equal."""
    spheres: Resolution = "standard"

    @property
    def clump(self) -> Clump:
        """Member spheres, mass and inertia of one body."""
        if isinstance(self.shape, Members):
            shape = self.shape
            return explicit_clump(shape.centres, shape.radii, shape.mass, shape.inertia)
        return fit_clump(self.shape, self.density, self.spheres)

    @property
    def extents(self) -> tuple[float, ...]:
        """Outer dimensions along the principal axes [m]."""
        if isinstance(self.shape, Members):
            clump = self.clump
            low = (clump.centres - clump.radii[:, None]).min(axis=0)
            high = (clump.centres + clump.radii[:, None]).max(axis=0)
            return tuple(float(x) for x in high - low)
        return tuple(float(x) for x in mass_properties(self.shape, self.density).extents)

    @property
    def mass(self) -> float:
        """Mass of one body [kg]."""
        if isinstance(self.shape, Members):
            return self.shape.mass
        return float(mass_properties(self.shape, self.density).mass)

    def value(self, name: str) -> Any:
        """Value of one of the body's own parameters."""
        if name == "mass_fraction":
            return self.mass_fraction
        solid = cast(Solid, self.shape)
        return solid.dimensions[DIMENSIONS[solid.kind].index(name)]


def body_parameters(body: Body) -> dict[str, Parameter]:
    """Parameters of one body: its mass fraction and the dimensions of its solid."""
    prefix = f"body.{body.name}"
    found = {
        f"{prefix}.mass_fraction": Parameter(
            f"{prefix}.mass_fraction", "1", 0.0, 1.0, "Share of the mass; the other shares scale with it."
        )
    }
    if isinstance(body.shape, Solid):
        for name in DIMENSIONS[body.shape.kind]:
            path = f"{prefix}.{name}"
            found[path] = Parameter(path, "m", 2e-4, 0.5, f"Outer {name} of the {body.name}.")
    return found


def with_body_value(bodies: tuple[Body, ...], path: list[str], new: Any) -> tuple[Body, ...]:
    """``bodies`` with the parameter ``path`` (without the leading ``body``) replaced by ``new``."""
    if path == ["spheres"]:
        return tuple(dataclasses.replace(body, spheres=new) for body in bodies)
    name, key = path
    if key == "mass_fraction":
        return _with_fraction(bodies, name, new)
    return tuple(_with_dimension(body, key, new) if body.name == name else body for body in bodies)


def with_densities(bodies: tuple[Body, ...], materials: tuple[Material, ...]) -> tuple[Body, ...]:
    """``bodies`` with the densities of their ``materials``; bodies declared by their spheres keep their own mass."""
    density = {material.name: material.density for material in materials}
    return tuple(dataclasses.replace(body, density=density[body.material]) for body in bodies)


def counts(bodies: tuple[Body, ...], mass: float) -> tuple[int, ...]:
    """Number of bodies of each component in ``mass`` [kg], by largest remainder on the number fractions.

    The number total is mass divided by the mean mass of a body, Σ fᵢ / Σ (fᵢ/mᵢ), rounded; quotas are number
    fractions times that total. The same for every seed. A component with a positive share gets at least one body.
    """
    per_mass = [body.mass_fraction / body.mass for body in bodies]
    total = max(1, round(mass * sum(per_mass)))
    quotas = [total * share / sum(per_mass) for share in per_mass]
    whole = [int(quota) for quota in quotas]
    by_remainder = sorted(range(len(bodies)), key=lambda k: (whole[k] - quotas[k], k))
    for k in by_remainder[: total - sum(whole)]:
        whole[k] += 1
    return tuple(max(n, 1) if body.mass_fraction > 0 else 0 for n, body in zip(whole, bodies, strict=True))


def _with_fraction(bodies: tuple[Body, ...], name: str, new: float) -> tuple[Body, ...]:
    others = sum(body.mass_fraction for body in bodies if body.name != name)
    scale = (1.0 - new) / others if others > 0 else 0.0
    return tuple(
        dataclasses.replace(body, mass_fraction=new if body.name == name else body.mass_fraction * scale)
        for body in bodies
    )


def _with_dimension(body: Body, key: str, new: float) -> Body:
    solid = cast(Solid, body.shape)
    dimensions = list(solid.dimensions)
    dimensions[DIMENSIONS[solid.kind].index(key)] = new
    return dataclasses.replace(body, shape=dataclasses.replace(solid, dimensions=tuple(dimensions)))
