"""A material as tables for EDEM, or any engine whose parameters are typed in: each coefficient with its convention.

materials.csv      density, shear modulus, Poisson's ratio, Young's modulus                       one row per material
interactions.csv   restitution, static friction, rolling friction                                 one row per pair
bodies.csv         mass, principal moments, member spheres: they do not follow from overlapping spheres
conventions.csv    what each number means here and in EDEM, and whether it may be typed in as it is

Coefficients of the same name differ between engines: rolling friction acts on a different arm and by a different law,
and a restitution may set a damping that yields a different restitution. Sources: Altair EDEM documentation
(Hertz–Mindlin no slip, standard rolling friction); Ai, Chen, Rotter and Ooi 2011, Powder Technology 206:269; Thornton,
Cummins and Cleary 2013, Powder Technology 233:30.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path

from explorer.errors import CommandError
from explorer.export.liggghts import unclamped_restitution
from explorer.export.target import ExportOrder, ExportTarget
from solver import Body, Scene
from solver.effects import Effect
from solver.laws import HertzMindlin, LinearSpringDashpot
from solver.scenes.material import Pair
from solver.scenes.scene import actual

Rows = list[Sequence[str]]
DAMPING_OF = {
    HertzMindlin.name: "Thornton, Cummins & Cleary (2013)",
    LinearSpringDashpot.name: "Schwager & Poeschel (2007)",
}
OF_THE_RIG = ("plate_tilt", "funnel_offset")
"""Effects that turn gravity or move the rig; the other set-up effects are in bodies and materials."""
ROLLING, KINETIC = "rolling_resistance", "kinetic_friction"

README = """\
{title}
A material for EDEM, or any engine whose parameters are typed in. SI units.

materials.csv     one row per material
interactions.csv  one row per pair of components, and of each with the wall
bodies.csv        mass and principal moments of inertia of every component, from its true solid
conventions.csv   READ THIS FIRST: what each number means here, what EDEM makes of it, and whether it transfers

{law} Rolling friction does not transfer between engines and
has to be calibrated again where it is not 0.
{effects}"""
LAWS = {
    HertzMindlin.name: "The law here is Hertz–Mindlin without slip, as EDEM's default is.",
    LinearSpringDashpot.name: "The law here is LINEAR springs and dashpots, which EDEM's default is not.",
}


def write_material_table(folder: Path, scene: Scene) -> None:
    """Write the tables of ``scene``, with its set-up effects applied, and a README into an existing folder.

    Raises CommandError for a contact law whose conventions are not known here.
    """
    declared, scene = scene, actual(scene)
    if scene.contact.law not in LAWS:
        raise CommandError(f"contact.law: {scene.contact.law!r} cannot be exported to edem; allowed: {', '.join(LAWS)}")
    others = [effect for effect in scene.effects if effect.on and effect.name not in (ROLLING, KINETIC)]
    others += [effect for effect in declared.effects if effect.on and effect.name in OF_THE_RIG]
    tables = {
        "materials.csv": _materials(scene),
        "interactions.csv": _interactions(scene),
        "bodies.csv": _bodies(scene),
        "conventions.csv": _conventions(scene, others),
    }
    for name, rows in tables.items():
        with (folder / name).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)
    words = f"Effects that these tables cannot hold: {', '.join(one.name for one in others)}.\n" if others else ""
    text = README.format(title=scene.title, law=LAWS[scene.contact.law], effects=words)
    (folder / "README.txt").write_text(text, encoding="utf-8")


class Edem(ExportTarget):
    """EDEM as a target of an export."""

    name, what = "edem", "tables of the material"
    pours, of_material = False, True

    def check(self, scene: Scene) -> None:
        """Accept everything: the tables name what they cannot hold."""

    def write(self, folder: Path, order: ExportOrder) -> str:
        """Write the tables."""
        write_material_table(folder, order.scene)
        return "materials, pairs and bodies; what the coefficients mean: conventions.csv"


EDEM = Edem()


def _materials(scene: Scene) -> Rows:
    used, poured = {scene.rig.wall}, {body.material for body in scene.bodies}
    rows: Rows = [("material", "density_kg_m3", "shear_modulus_Pa", "poisson_ratio", "youngs_modulus_Pa")]
    for one in scene.materials:
        if one.name in used | poured:
            # Nothing here depends on the density of a wall, so it need not be declared.
            density = _number(one.density) if one.name in poured else ""
            rows.append((one.name, density, *map(_number, (one.shear_modulus, one.poisson_ratio, one.youngs_modulus))))
    return rows


def _interactions(scene: Scene) -> Rows:
    columns = (
        "restitution",
        "restitution_same_damping",
        "static_friction",
        "rolling_friction",
        "rolling_friction_here",
    )
    rolling, on = _rolling(scene)
    rows: Rows = [("a", "b", *columns)]
    for (a, b), pair in _pairs(scene):
        same = unclamped_restitution(pair.restitution)
        # Empty cells: no restitution has that damping; rolling friction must be calibrated in the other engine.
        damping = _number(same) if same > 0.0 else ""
        friction = (_number(pair.static_friction), "" if on else "0", _number(rolling))
        rows.append((a, b, _number(pair.restitution), damping, *friction))
    return rows


def _pairs(scene: Scene) -> Iterator[tuple[tuple[str, str], Pair]]:
    """Every contact that can occur, by component and wall: (names, pair)."""
    for k, one in enumerate(scene.bodies):
        others: tuple[Body | str, ...] = (*scene.bodies[k:], scene.rig.wall)
        for other in others:
            name = other if isinstance(other, str) else other.name
            # Where several pairs would apply, the solver takes that of the later body's name.
            pair = scene.contact_pair(one, other) if isinstance(other, str) else scene.contact_pair(other, one)
            yield (one.name, name), pair


def _bodies(scene: Scene) -> Rows:
    columns = ("mass_kg", "Ixx_kg_m2", "Iyy_kg_m2", "Izz_kg_m2", "member_spheres", "mass_fraction", "size_distribution")
    rows: Rows = [("body", "material", *columns)]
    for body in scene.bodies:
        numbers = (body.mass, *map(float, body.clump.inertia))
        counts = (str(len(body.clump.radii)), _number(body.mass_fraction))
        spread = f"{body.sizes.kind} {body.sizes.spread:g}" if body.sizes.varies else "none"
        rows.append((body.name, body.material, *map(_number, numbers), *counts, spread))
    return rows


CLUMP_RULES_MEAN = {
    "body_mass": "dashpots take the mass of the whole body",
    "local_mass": "dashpots take the mass that acts at the contact",
    "local_mass_shared": "dashpots take the mass that acts at the contacts, which share stiffness and damping",
}


def _conventions(scene: Scene, others: Sequence[Effect]) -> Rows:
    rolling, on = _rolling(scene)
    rows: Rows = [("quantity", "unit", "here", "in EDEM", "transfers")]
    rows += [
        (
            "density",
            "kg/m3",
            "of the solid; mass and inertia are those of the true shape (bodies.csv)",
            "times the volume of the particle, which for overlapping spheres is an estimate",
            "yes, if mass and inertia of bodies.csv are set by hand",
        ),
        (
            "shear modulus, Poisson's ratio",
            "Pa, 1",
            "1/E* = sum of (1 - nu^2)/E with E = 2 G (1 + nu); 1/G* = sum of (2 - nu)/G",
            "the same",
            "yes",
        ),
        (
            "restitution",
            "1",
            f"of one central impact, returned exactly: damping of {DAMPING_OF[scene.contact.law]}, never pulling",
            "damping 2 sqrt(5/6) |beta| sqrt(S_n m*), beta = ln e/sqrt(ln^2 e + pi^2): returns e only if the force may "
            "pull at the end of the contact",
            "yes, if the force may pull; else type in restitution_same_damping, which gives the same damping as here",
        ),
        *_linear(scene),
        (
            "clump rule",
            "-",
            f"contact.clump_rule = {scene.contact.clump_rule}: {CLUMP_RULES_MEAN[scene.contact.clump_rule]}",
            CLUMP_RULES_MEAN["body_mass"],
            "yes" if scene.contact.clump_rule == "body_mass" else "no: restitutions mean another damping there",
        ),
        (
            "tangential law",
            "-",
            f"contact.tangential_law = {scene.contact.tangential_law}, contact.tangential_dashpot = "
            f"{scene.contact.tangential_dashpot}",
            "a displacement times the present stiffness (mindlin); spring and dashpot within the limit (capped)",
            "yes" if scene.contact.tangential_law == "mindlin" else "nearly: they differ while a contact sticks",
        ),
        (
            "static friction",
            "1",
            "Coulomb: |F_t| <= mu F_n" + _kinetic(scene),
            "the same limit",
            "yes" if not _kinetic(scene) else "only while nothing slides",
        ),
        (
            "rolling friction",
            "1",
            f"{_number(rolling)}: elastic-plastic spring (type C, EPSD2), torque up to mu_r F_n R*, R* = reduced "
            "radius of the two member spheres",
            "standard model: constant torque mu_r F_n R_i against the spin of each body, R_i = contact point to its "
            "centre of mass",
            "no: another arm and another law; calibrate again" if on else "yes: nothing resists rolling here, 0",
        ),
        ("mass, moments of inertia", "kg, kg m2", "of the true shape, principal axes", "set by hand", "yes"),
    ]
    for effect in others:
        numbers = ", ".join(f"{name} = {getattr(effect, name):g}" for name in effect.amplitudes)
        rows.append((f"effect {effect.name}", "SI", numbers, "not in these tables", "no"))
    return rows


def _linear(scene: Scene) -> Rows:
    """The rows that concern linear springs only."""
    if scene.contact.law == HertzMindlin.name:
        return []
    return [
        (
            "contact law",
            "-",
            f"contact.law = {scene.contact.law}: k_n = k_t = 16/15 E* sqrt(R*) (15 m* V^2/(16 E* sqrt(R*)))^(1/5), "
            f"V = {_number(scene.contact.characteristic_velocity)} m/s; dashpots 2 zeta sqrt(m* k_n) both ways",
            "Hertz-Mindlin unless another model is chosen",
            "no: choose a linear model with this stiffness",
        )
    ]


def _rolling(scene: Scene) -> tuple[float, bool]:
    """Rolling friction in our pour, and whether anything resists rolling."""
    effect = scene.effect(ROLLING)
    return float(getattr(effect, effect.amplitudes[0])), effect.on


def _kinetic(scene: Scene) -> str:
    """Words about kinetic friction; empty if it equals static friction."""
    effect = scene.effect(KINETIC)
    if not effect.on:
        return ""
    return "; while sliding less: " + ", ".join(f"{name} = {getattr(effect, name):g}" for name in effect.amplitudes)


def _number(value: float) -> str:
    return f"{value:.7g}"
