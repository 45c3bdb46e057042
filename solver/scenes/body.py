"""Components of a mixture: what a body is made of, how it is shaped, and how many of it are poured."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

from solver.params import Parameter, ParameterError
from solver.scenes.material import Material
from solver.scenes.sizes import KINDS, MOST_SPREAD, SizeDistribution
from solver.shapes.clump import MOST_SPHERES, RESOLUTIONS, Clump, explicit_clump, fit_clump
from solver.shapes.clump_error import ClumpFit
from solver.shapes.solid import Solid, mass_properties


class _SphereNumber(Parameter):
    """A choice of resolutions, in place of which a number of spheres may be given."""

    def check(self, value: Any) -> str:
        """The name of a resolution, or a whole number as text."""
        text = str(value)
        if text in self.choices or (text.isdecimal() and 1 <= int(text) <= MOST_SPHERES):
            return text
        raise ParameterError(
            f"{self.path}: {value!r} is not one of {', '.join(self.choices)}, nor a number from 1 to {MOST_SPHERES}"
        )


TOTAL_TOLERANCE = 1e-6
"""Largest deviation of the sum of the mass fractions from 1."""
SPHERES = _SphereNumber(
    "body.spheres", "1", 0, 0, f"Member spheres per body; also a number, 1 … {MOST_SPHERES}.", choices=RESOLUTIONS
)

DIMENSIONS: dict[str, tuple[str, ...]] = {
    "ellipsoid": ("length", "width", "thickness"),
    "box": ("length", "width", "thickness"),
    "cylinder": ("diameter", "length"),
    "sphere": ("diameter",),
    "mesh": (),
}
"""Names of the entries of ``Solid.dimensions``, as they stand in parameter paths."""

SIZE_FIELDS = {"size_distribution": "kind", "size_spread": "spread"}
"""Last part of a parameter path → field of ``SizeDistribution``."""


@dataclass(frozen=True)
class Members:
    """A body declared by its spheres: centres (n, 3) and radii (n,) [m], mass [kg], principal inertia (3,) [kg m²]."""

    centres: tuple[tuple[float, float, float], ...]
    radii: tuple[float, ...]
    mass: float
    inertia: tuple[float, float, float]
    density: float | None = None
    """Density for which mass and inertia hold [kg/m³]: they scale with the material's. None: they stay as declared."""
    drawn: Solid | None = None
    """The surface to draw instead of the spheres, in the same frame."""
    fit: ClumpFit | None = None
    """How well the spheres represent the solid that they were fitted to; None: they are the body itself."""

    def heavier(self, density: float) -> float:
        """Factor by which mass and inertia grow in a material of ``density`` [kg/m³]."""
        return 1.0 if self.density is None else density / self.density


@dataclass(frozen=True)
class Body:
    """One component of the mixture. ``shape`` is a solid to be filled with spheres, or the spheres themselves."""

    name: str
    material: str
    mass_fraction: float
    shape: Solid | Members
    density: float
    """Density of the material [kg/m³]; :func:`with_densities` keeps the two equal."""
    spheres: str = "standard"
    """Member spheres of a solid: a resolution, or their number as text."""
    sizes: SizeDistribution = SizeDistribution()
    """Scale of the bodies poured; all other attributes are those of a body of the declared size."""

    @property
    def clump(self) -> Clump:
        """Member spheres, mass and inertia of one body."""
        if isinstance(self.shape, Members):
            shape, factor = self.shape, self.shape.heavier(self.density)
            inertia = [factor * moment for moment in shape.inertia]
            return explicit_clump(shape.centres, shape.radii, factor * shape.mass, inertia, shape.fit)
        return fit_clump(self.shape, self.density, self.spheres)

    @property
    def extents(self) -> tuple[float, ...]:
        """Outer dimensions along the principal axes [m] of a body of the declared size."""
        if isinstance(self.shape, Members):
            clump = self.clump
            low = (clump.centres - clump.radii[:, None]).min(axis=0)
            high = (clump.centres + clump.radii[:, None]).max(axis=0)
            return tuple(float(x) for x in high - low)
        return tuple(float(x) for x in mass_properties(self.shape, self.density).extents)

    @property
    def largest_extents(self) -> tuple[float, ...]:
        """Outer dimensions of the largest body that may be poured [m]."""
        return tuple(self.sizes.high * extent for extent in self.extents)

    @property
    def mean_mass(self) -> float:
        """Mean mass of the bodies poured [kg]: that of the declared size times E[s³]."""
        return self.mass * self.sizes.mean_cube

    @property
    def mass(self) -> float:
        """Mass of one body of the declared size [kg]."""
        if isinstance(self.shape, Members):
            return self.shape.mass * self.shape.heavier(self.density)
        return float(mass_properties(self.shape, self.density).mass)

    def value(self, name: str) -> Any:
        """Value of one of the body's own parameters."""
        if name == "mass_fraction":
            return self.mass_fraction
        if name in SIZE_FIELDS:
            return getattr(self.sizes, SIZE_FIELDS[name])
        solid = cast(Solid, self.shape)
        return solid.dimensions[DIMENSIONS[solid.kind].index(name)]


def body_parameters(body: Body) -> dict[str, Parameter]:
    """Parameters of one body: its mass fraction, its distribution of sizes and the dimensions of its solid."""
    prefix = f"body.{body.name}"
    found = {
        f"{prefix}.mass_fraction": Parameter(
            f"{prefix}.mass_fraction", "1", 0.0, 1.0, "Share of the mass; the other shares scale with it."
        ),
        f"{prefix}.size_distribution": Parameter(
            f"{prefix}.size_distribution",
            "1",
            0,
            0,
            "Distribution of the bodies' linear sizes about the declared one.",
            choices=KINDS,
        ),
        f"{prefix}.size_spread": Parameter(
            f"{prefix}.size_spread",
            "1",
            0.0,
            MOST_SPREAD,
            "Standard deviation of the linear size over its mean; no effect while size_distribution is none.",
        ),
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
    replaced = _with_size if key in SIZE_FIELDS else _with_dimension
    return tuple(replaced(body, key, new) if body.name == name else body for body in bodies)


def with_fractions(bodies: tuple[Body, ...], new: Mapping[str, float]) -> tuple[Body, ...]:
    """``bodies`` with shares replaced; the others scale to the rest, or share it equally if all are zero."""
    total, others = sum(new.values()), [body for body in bodies if body.name not in new]
    names = f"body.{next(iter(new))}.mass_fraction:" if len(new) == 1 else f"mass_fraction: {', '.join(new)} add up to"
    if not others and not math.isclose(total, 1.0, abs_tol=TOTAL_TOLERANCE):
        raise ParameterError(f"{names} {total:g}, but there is no other component; allowed: 1")
    if total > 1.0 + TOTAL_TOLERANCE:
        raise ParameterError(f"{names} {total:g}; allowed: up to 1")
    left, rest = sum(body.mass_fraction for body in others), max(0.0, 1.0 - total)
    # Shares that are set to what they are leave the others as they are, to the last bit.
    left = rest if math.isclose(left, rest, rel_tol=1e-12) else left

    def share(body: Body) -> float:
        if body.name in new:
            return new[body.name]
        return body.mass_fraction * (rest / left) if left > 0 else rest / len(others)

    return tuple(dataclasses.replace(body, mass_fraction=share(body)) for body in bodies)


def with_densities(bodies: tuple[Body, ...], materials: tuple[Material, ...]) -> tuple[Body, ...]:
    """``bodies`` with the densities of their ``materials``; declared spheres without a density keep their mass."""
    density = {material.name: material.density for material in materials}
    return tuple(dataclasses.replace(body, density=density[body.material]) for body in bodies)


def counts(bodies: tuple[Body, ...], mass: float) -> tuple[int, ...]:
    """Number of bodies of each component in ``mass`` [kg], by largest remainder on the number fractions.

    The total number is the mass divided by the mean mass of a body, Σ fᵢ / Σ (fᵢ/mᵢ) with mᵢ = :attr:`Body.mean_mass`,
    rounded; quotas are number fractions times that total. The counts are the same for every seed. A component with a
    positive share gets at least one body.
    """
    per_mass = [body.mass_fraction / body.mean_mass for body in bodies]
    total = max(1, round(mass * sum(per_mass)))
    quotas = [total * share / sum(per_mass) for share in per_mass]
    whole = [int(quota) for quota in quotas]
    by_remainder = sorted(range(len(bodies)), key=lambda k: (whole[k] - quotas[k], k))
    for k in by_remainder[: total - sum(whole)]:
        whole[k] += 1
    return tuple(max(n, 1) if body.mass_fraction > 0 else 0 for n, body in zip(whole, bodies, strict=True))


def _with_size(body: Body, key: str, new: Any) -> Body:
    return dataclasses.replace(body, sizes=dataclasses.replace(body.sizes, **{SIZE_FIELDS[key]: new}))


def _with_dimension(body: Body, key: str, new: float) -> Body:
    solid = cast(Solid, body.shape)
    dimensions = list(solid.dimensions)
    dimensions[DIMENSIONS[solid.kind].index(key)] = new
    return dataclasses.replace(body, shape=dataclasses.replace(solid, dimensions=tuple(dimensions)))
