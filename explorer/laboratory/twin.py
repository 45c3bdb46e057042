"""Virtual twins: the bench test simulated with the parameters that the real bench test gave.

A round trip closes if the result is within ``CLOSES`` of the input:

    inclined_plane        tan of the angle at which the body slides = μ
    drop                  tracked rebound (v_x + v_z)/√(2gH) = e
    rebound               √(h2/h1) of a ball of the body's mass on a level plate = e
    rolling               tan of the angle at which such a ball begins to roll = μ_r
    compression, shear    E* and G* of the contact by Hertz and Mindlin, and E and G of the specimen from them:
                          1/E* = (1 − ν²)/E + (1 − ν_w²)/E_w,  1/G* = (2 − ν)/G + (2 − ν_w)/G_w

Where the paper's formula is applied to the same simulated test (L/2H, Equation 1), its error is shown, but does not
count as a round trip; :func:`simulated_bias` compares it with its closed form (``doe/laboratory/bias.py``). From the
drop, the twin also finds the e with which a ball of the body's mass lands where the laboratory's bodies did.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
from scipy.optimize import brentq

from doe.laboratory import Derived, LabResult
from doe.laboratory.bias import STRAINS, BiasTable, compression_ratio
from doe.laboratory.contact import ROLLING_FRICTION, flight, tangential_share
from explorer.errors import CommandError
from explorer.laboratory.twin_row import CLOSES, RIGS, TwinRow
from solver import Scene, backend, with_rig, with_values
from solver.scenes.body import Body
from solver.scenes.material import Material
from solver.single_body import BenchResult, run_bench_test
from solver.single_body.bench import UPRIGHT, ball
from solver.single_body.inclined_plane import onset, rebound_height

TILT_RATE = 5.0
"""Tilt rate of the plane [°/s]; the angle is within a hundredth of a degree of that at the rig's own 1 °/s."""
DROP_HEIGHT = 0.2
"""Drop height of a twin whose readings state none [m]."""
LOWEST, HIGHEST = 0.05, 1.0
"""Range of restitutions that the solver accepts."""
FIRST_READING = 0.02
"""The twin's squeezing is shown from this share of its largest strain on: below, a reading covers too few steps."""


def twins(result: LabResult, scene: Scene) -> Iterator[TwinRow]:
    """Rows of every component or pair of ``result``, whose parameters must already be set in ``scene``."""
    for of in dict.fromkeys(one.of for one in result.derived):
        own = {one.name: one for one in result.derived if one.of == of}
        if result.test == "inclined_plane":
            yield from _friction(of, own, scene)
        elif result.test == "drop":
            yield from _restitution(of, own, scene)
        elif result.test == "rebound":
            yield _rebound(of, own, scene)
        elif result.test == "rolling":
            yield _rolling(of, own["rolling_friction"].summary.mean, scene)
        else:
            yield from _moduli(of, own, scene)


def _friction(of: tuple[str, ...], own: dict[str, Derived], scene: Scene) -> Iterator[TwinRow]:
    found = run_bench_test(with_values(bench_scene(scene, "inclined_plane", of), {"rig.tilt_rate": TILT_RATE}))
    yield _closing(of, "static_friction", "1", own["static_friction"], found)
    angle = found.quantity("sliding_angle_deg")
    measured = own["sliding_angle"].summary.mean
    yield TwinRow(of, "sliding_angle", "rad", measured, None, math.radians(angle.value), None)


def _restitution(of: tuple[str, ...], own: dict[str, Derived], scene: Scene) -> Iterator[TwinRow]:
    height = own["drop_height"].summary.mean
    bench = with_values(bench_scene(scene, "drop", of), {"rig.drop_height": height})
    found = run_bench_test(bench)
    yield _closing(of, "restitution", "1", own["restitution"], found)
    paper = found.quantity("restitution_paper_L_over_2H")
    measured = own.get("restitution_paper_L_over_2H", own["restitution"])
    if measured.formula != "L/(2H)":
        yield TwinRow(of, "L_over_2H", "1", None, own["restitution"].summary.mean, paper.value, None)
        return
    yield TwinRow(of, "L_over_2H", "1", measured.summary.mean, None, paper.value, None)
    landing = restitution_that_lands(bench, measured.summary.mean)
    if landing is not None:
        yield TwinRow(of, "restitution_that_lands_there", "1", None, own["restitution"].summary.mean, landing, None)


def _rebound(of: tuple[str, ...], own: dict[str, Derived], scene: Scene) -> TwinRow:
    height = own["drop_height"].summary.mean if "drop_height" in own else DROP_HEIGHT
    bench = bench_scene(scene, "rebound", of)
    backend.init(threads=1)
    risen = rebound_height(bench, specimen(scene, of)[0], height)
    return _round_trip(of, "restitution", own["restitution"].summary.mean, math.sqrt(risen / height))


def _rolling(of: tuple[str, ...], friction: float, scene: Scene) -> TwinRow:
    settings = {ROLLING_FRICTION: friction, "rig.tilt_rate": TILT_RATE}
    bench = with_values(bench_scene(scene, "rolling", of), settings)
    backend.init(threads=1)
    angle, _ = onset(bench, ball(specimen(scene, of)[0]))
    return _round_trip(of, "rolling_friction", friction, math.tan(math.radians(angle)))


def _round_trip(of: tuple[str, ...], name: str, put_in: float, simulated: float) -> TwinRow:
    """A row whose measured value is also the input."""
    closes = abs(simulated - put_in) <= CLOSES * put_in
    return TwinRow(of, name, "1", put_in, put_in, simulated, closes)


def restitution_that_lands(bench: Scene, measured: float) -> float | None:
    """The e with which the ball of the drop rig gives L/(2H) = ``measured``; None if no allowed e does."""
    # Imported only here: the drop alone, without the rest of the study.
    from solver.single_body.drop_plate_45 import drop, paper_estimate

    gravity, height = math.hypot(*bench.gravity), bench.rig.drop_height  # type: ignore[attr-defined]
    body = next(body for body in bench.bodies if body.name == bench.rig.body)  # type: ignore[attr-defined]
    pair = bench.contact_pair(body, bench.rig.wall)

    def miss(restitution: float) -> float:
        changed = with_values(bench, {f"pair.{pair.a}.{pair.b}.restitution": restitution})
        return paper_estimate(drop(changed, ball(body), UPRIGHT), gravity, height) - measured

    if not miss(LOWEST) < 0.0 < miss(HIGHEST):
        return None
    return float(brentq(miss, LOWEST, HIGHEST, xtol=1e-4))


def _moduli(of: tuple[str, ...], own: dict[str, Derived], scene: Scene) -> Iterator[TwinRow]:
    bench = bench_scene(scene, "compression", of)
    found = run_bench_test(bench)
    body, wall = specimen(scene, of)
    material, plate = scene.material(body.material), scene.material(wall)
    for name in ("effective_youngs_modulus", "effective_shear_modulus"):
        yield _closing(of, name, "Pa", None, found)
    simulated = specimen_moduli(found, material, plate)
    declared = {"youngs_modulus": material.youngs_modulus, "shear_modulus": material.shear_modulus}
    for name, value in simulated.items():
        measured = own[name].summary.mean if name in own else None
        closes = abs(value / declared[name] - 1.0) <= CLOSES
        yield TwinRow(of, name, "Pa", measured, declared[name], value, closes)
    paper = found.quantity("youngs_modulus_paper_equation_1")
    yield TwinRow(of, "youngs_modulus_by_equation_1", "Pa", None, paper.reference, paper.value, None)


def specimen_moduli(found: BenchResult, material: Material, plate: Material) -> dict[str, float]:
    """E and G of the specimen [Pa] from the moduli of the contact, given its ν and the plate's constants."""
    e_star, g_star = (found.quantity(f"effective_{kind}_modulus").value for kind in ("youngs", "shear"))
    e_rest = 1.0 / e_star - (1.0 - plate.poisson_ratio**2) / plate.youngs_modulus
    g_rest = 1.0 / g_star - (2.0 - plate.poisson_ratio) / plate.shear_modulus
    return {
        "youngs_modulus": (1.0 - material.poisson_ratio**2) / e_rest,
        "shear_modulus": (2.0 - material.poisson_ratio) / g_rest,
    }


def _closing(of: tuple[str, ...], name: str, unit: str, own: Derived | None, found: BenchResult) -> TwinRow:
    """A row with the twin's result and its input; a quantity that could not be measured does not close."""
    quantity = found.quantity(name)
    closes = quantity.error is not None and abs(quantity.error) <= CLOSES
    measured = None if own is None else own.summary.mean
    return TwinRow(of, name, unit, measured, quantity.reference, quantity.value, closes)


def simulated_bias(test: str, scene: Scene, of: tuple[str, ...]) -> BiasTable:
    """The bias of the formula of ``test``, simulated for one component or pair. CommandError if no twin shows it."""
    if test == "drop":
        return _drop_bias(run_bench_test(bench_scene(scene, test, of)), "-".join(of))
    if test == "compression":
        bench = with_values(bench_scene(scene, test, of), {"rig.strain": STRAINS[-1]})
        return _compression_bias(run_bench_test(bench), scene, of)
    raise CommandError(f"--bias --simulate: {test}; allowed: drop, compression")


def _drop_bias(found: BenchResult, name: str) -> BiasTable:
    table = dict(found.table)
    columns = (table[key] for key in ("static_friction", "restitution", "tracked", "paper_L_over_2H"))
    rows = [
        (mu, e, flight(e, tangential_share(e, mu)), paper, paper / e, tracked)
        for mu, e, tracked, paper in zip(*columns, strict=True)
    ]
    return BiasTable(
        title=f"{found.body} on {found.wall}: e = L/(2H) by closed form and simulated, {name} varied",
        columns=("static_friction", "restitution", "L_over_2H", "simulated", "ratio", "tracked"),
        rows=tuple(rows),
        statement="the closed form is that of a rigid sphere; the contact's tangential springs make the difference",
    )


def _compression_bias(found: BenchResult, scene: Scene, of: tuple[str, ...]) -> BiasTable:
    series = {key: np.array(values) for key, values in found.series}
    material = scene.material(next(b for b in scene.bodies if of[0] in (b.name, b.material)).material)
    # The largest approach belongs to the largest strain: their ratio is the thickness, even with one step too many.
    strain = series["approach_m"] * (STRAINS[-1] / series["approach_m"][-1])
    ratio = series["youngs_modulus_paper_equation_1_Pa"] / material.youngs_modulus
    shown = [wanted for wanted in STRAINS if wanted >= FIRST_READING * STRAINS[-1]]
    simulated = np.interp(shown, strain, ratio).tolist()
    rows = [
        (at, compression_ratio(at, material.poisson_ratio), seen) for at, seen in zip(shown, simulated, strict=True)
    ]
    return BiasTable(
        title=f"{found.body} between plates of {found.wall}: E by Equation (1) over the E of its material",
        columns=("strain", "ratio", "simulated"),
        rows=tuple(rows),
        statement=f"A is the area of one contact under load, π R δ, not the body's cross-section; ν = "
        f"{material.poisson_ratio:g}; the closed form takes the plates as rigid",
    )


def bench_scene(scene: Scene, test: str, of: tuple[str, ...]) -> Scene:
    """``scene`` with the rig of ``test``, the specimen named by ``of``, and its partner's material as the surface."""
    body, wall = specimen(scene, of)
    # A ball, or a body that slides without turning: the result does not depend on how many spheres represent it.
    rig_scene = with_rig(with_values(scene, {"body.spheres": "coarse"}), RIGS[test])
    return dataclasses.replace(rig_scene, rig=dataclasses.replace(rig_scene.rig, body=body.name, wall=wall))  # type: ignore[type-var]


def specimen(scene: Scene, of: tuple[str, ...]) -> tuple[Body, str]:
    """The body under test and the material that it lies on, which is the wall's if only one component is named."""
    bodies = {name: body for body in reversed(scene.bodies) for name in (body.material, body.name)}
    one, other = of if len(of) == 2 else (of[0], scene.rig.wall)
    if not {*of} & {*bodies}:
        raise CommandError(f"--simulate: {'-'.join(of)}: no such body; allowed: {', '.join(bodies)}")
    if one not in bodies:
        one, other = other, one
    wall = other if other in {m.name for m in scene.materials} else bodies[other].material
    if len(of) == 2 and scene.contact_pair(bodies[one], wall) is not scene.pair(*of):
        raise CommandError(f"--simulate: {'-'.join(of)}: a plate of {wall} would use another pair of the material")
    return bodies[one], wall
