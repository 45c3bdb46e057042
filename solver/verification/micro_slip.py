"""T5: oblique impact on the rigid plane, v_n 5 m/s, r 10 µm, e 1, μ 0.3; recoil and spin over the incident slip.

With ψ1 = V_st/(μ V_cn) of the contact point, an impact that slides throughout has ψ2 = ψ1 − 7 and r ω'/(μ V_cn) = −5.
The printed DEM curve and the printed finite elements differ in the sticking part. The rows "T5 convention" show what
the printed DEM curve is: this law integrated with half of Mindlin's tangential stiffness 8 G* a (the value for a plane
that is rigid under the normal force but yields tangentially like the sphere) and without the scaling on unloading.
"""

from __future__ import annotations

from collections.abc import Iterator

from solver.scenes.material import Material
from solver.verification.chung_ooi import (
    DIGITISED,
    POLYETHYLENE,
    STEEL,
    T5_RECOIL,
    T5_RECOIL_FEM,
    T5_SPIN,
    Curve,
    span,
)
from solver.verification.impacts import OURS, Engine, Impact, Rebound, rebounds
from solver.verification.one_contact import Convention, integrated
from solver.verification.row import Row, of_scale

RADIUS, SPEED, FRICTION = 1e-5, 5.0, 0.3
UNIT = FRICTION * SPEED
"""μ V_cn [m/s]."""
SLIDES = 7.0
"""Above this ψ1 an impact of rigid bodies slides throughout."""
LIMIT, LAW_LIMIT = 3.0, 0.5
HALVED = Convention(stiffness=0.5, scaled="never")


def t5(engine: Engine = OURS) -> Iterator[Row]:
    """Both materials: the printed curves."""
    for material in (STEEL, POLYETHYLENE):
        yield from _against("T5", material, T5_RECOIL[material.name], "ψ2", LIMIT, engine)
        yield from _against("T5", material, T5_SPIN[material.name], "rω'/μV", LIMIT, engine)


def t5_law() -> Iterator[Row]:
    """Both materials: the same law integrated without the solver."""
    for material in (STEEL, POLYETHYLENE):
        impacts = _impacts(material, T5_RECOIL[material.name])
        expected = [one.contact_speed / UNIT for one in integrated(impacts)]
        for (psi, _), value, one in zip(T5_RECOIL[material.name], expected, rebounds(impacts), strict=True):
            yield of_scale(
                "T5 law",
                f"ψ2, {material.name}",
                value,
                one.contact_speed / UNIT,
                (max(expected) - min(expected), "span"),
                LAW_LIMIT,
                "the same law integrated without the solver",
                f"ψ1 = {psi:g}",
            )


def t5_elements(engine: Engine = OURS) -> Iterator[Row]:
    """The finite elements of the paper; not judged."""
    yield from _against("T5 FEM", STEEL, T5_RECOIL_FEM, "ψ2", None, engine)


def t5_conventions() -> Iterator[Row]:
    """The law that the paper's DEM curve is; not judged."""
    for material in (STEEL, POLYETHYLENE):
        curve = T5_RECOIL[material.name]
        for (psi, value), one in zip(curve, integrated(_impacts(material, curve), HALVED), strict=True):
            yield of_scale(
                "T5 convention",
                f"ψ2, {material.name}, k_t/2, never scaled",
                value,
                one.contact_speed / UNIT,
                (span(curve), "span"),
                None,
                DIGITISED,
                f"ψ1 = {psi:g}",
            )


def _impacts(material: Material, curve: Curve) -> list[Impact]:
    return [Impact(material, RADIUS, SPEED, psi * UNIT, 0.0, 1.0, FRICTION) for psi, _ in curve]


def _against(
    test: str, material: Material, curve: Curve, label: str, limit: float | None, engine: Engine
) -> Iterator[Row]:
    for (psi, value), one in zip(curve, engine.rebounds(_impacts(material, curve)), strict=True):
        branch = "sliding" if psi > SLIDES else "sticking"
        found = _spin(one) if label.startswith("r") else one.contact_speed / UNIT
        at = f"ψ1 = {psi:g}"
        yield of_scale(
            test, f"{label}, {material.name}, {branch}", value, found, (span(curve), "span"), limit, DIGITISED, at
        )


def _spin(one: Rebound) -> float:
    return one.surface_speed / UNIT
