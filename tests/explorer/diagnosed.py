"""Diagnoses of a linear world with a known answer, one per kind of verdict, by the program's own decision code.

    y_c = middle_c + u (J_c θ + Σ_k a_k s_kc + e),   e ~ N(0, 1) per pour, u the size of one pour's noise

with coded parameters θ and amplitudes a. No pour is made: "simulated" runs and "fresh pours" are drawn from the same
formula. ``rolling_resistance`` and ``twisting`` have almost the same signature; ``air_drag`` hardly any;
``kinetic_friction`` is declared and not simulated.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from doe.diagnose.decision.decide import diagnose
from doe.diagnose.declare import declare, observe
from doe.diagnose.diagnosis import Diagnosis, errors_of, models
from doe.diagnose.follow_up.confirm import Confirmed
from doe.diagnose.follow_up.menu import Suggestion
from doe.diagnose.follow_up.next_experiment import MenuItem, Prediction, rank_experiments
from doe.diagnose.runs import BASE, Runs
from doe.measurement.measurement import Condition, MeasuredParameter, Measurement, Observation
from explorer.diagnosis.run import DiagnoseOrder, result_of
from solver import EFFECTS, load_material, with_values

HOSTILE = "<script>alert('x')</script> & | `co` \"q\" 日本"
UNITS = {
    "angle_of_repose_deg": ("deg", 25.0, 1.2),
    "apex_height_m": ("m", 0.031, 1.5e-3),
    "centre_height_m": ("m", 0.027, 1.2e-3),
    "footprint_r50_m": ("m", 0.041, 1.1e-3),
    "footprint_r90_m": ("m", 0.066, 2.0e-3),
    "stray_fraction": ("1", 0.11, 0.015),
    "discharge_t10_s": ("s", 0.42, 0.02),
    "discharge_t90_s": ("s", 1.51, 0.05),
}
"""Summary → unit, middle, noise of one pour (SI)."""
MIDDLE, SIZE = (np.array([row[k] for row in UNITS.values()]) for k in (1, 2))
D, REPLICATES, FRESH = len(UNITS), 6, 16
RADIUS = (np.arange(18) + 0.5) * 5e-3
PARAMETERS = (
    MeasuredParameter("pair.grain.grain.static_friction", 0.47, 0.72, 0.57, 0.05),
    MeasuredParameter("pair.grain.steel.static_friction", 0.4, 1.0, None, None),
)
NAMES = (
    "rolling_resistance",
    "twisting",
    "adhesion_sjkr",
    "plate_tilt",
    "air_drag",
    "density_error",
    "kinetic_friction",
)
BENCH = load_material(str(Path(__file__).parents[2] / "assets/measurements/trefoil_1/material.toml"))
RIGS = {"fit": {}, "fit fast": {"insertion.rate": 0.05}, "holdout": {"rig.outlet_height": 0.09}}


def unit(vector):
    return vector / np.linalg.norm(vector)


class World:
    """jacobian (2, 3, D): per parameter and condition. signatures: effect → (amplitudes, 3, D) at its end."""

    def __init__(self, seed=5):
        draw = np.random.default_rng(seed)
        self.jacobian = np.array([3.0 * unit(draw.standard_normal((3, D))) for _ in PARAMETERS])
        self.signatures = {name: self._signature(draw, len(EFFECTS[name].amplitudes)) for name in NAMES}
        alike = self.signatures["rolling_resistance"] + 0.05 * self._signature(draw, 1)
        self.signatures["twisting"] = alike
        self.signatures["air_drag"] *= 0.04
        self.outside = 7.0 * unit(draw.standard_normal((3, D)))

    @staticmethod
    def _signature(draw, amplitudes):
        # 9 pour sigmas are 22 standard errors of six pours, over all three conditions.
        return np.array([9.0 * unit(draw.standard_normal((3, D))) for _ in range(amplitudes)])

    def shift(self, condition, theta, effects, declared):
        """In sigma of a pour; theta and amplitudes in natural units."""
        coded = [p.coded(value) for p, value in zip(declared.parameters, theta, strict=True)]
        total = np.tensordot(coded, self.jacobian[:, condition], 1)
        for name, amplitudes in effects:
            (effect,) = (one for one in declared.effects if one.name == name)
            total = total + np.tensordot(np.array(amplitudes) / effect.scale, self.signatures[name][:, condition], 1)
        return total

    def pours(self, draw, condition, number, shift):
        noise = draw.standard_normal((number, D))
        return MIDDLE + SIZE * (condition * 0.5 + shift + noise)


def scenes():
    return [with_values(BENCH, settings) for settings in RIGS.values()]


def measured_condition(name, role, scene, block):
    observations = [
        Observation(summary, unit_, None, block[:, k], None) for k, (summary, (unit_, *_)) in enumerate(UNITS.items())
    ]
    observations.append(Observation("height_profile_m", "m", RADIUS, profiles(block), None, "piles"))
    return Condition(name, role, scene, len(block), tuple(observations))


def profiles(block):
    """Cones of the apex height and the radius r90 of each pour."""
    return block[:, [1]] * np.maximum(0.0, 1.0 - RADIUS / block[:, [4]])


def simulated(world, declared, draw):
    """Runs of the two fitted conditions: base, and each effect but the last over its range."""
    effect = np.concatenate([np.full(90, BASE), np.repeat(np.arange(len(NAMES) - 1), 120)])
    low, high = (np.array([getattr(p, end) for p in declared.parameters]) for end in ("low", "high"))
    theta = draw.uniform(low, high, (len(effect), len(low)))
    amplitude = np.zeros((len(effect), 2))
    blocks = [np.empty((len(effect), D)) for _ in range(2)]
    for k, e in enumerate(effect):
        acting = []
        if e != BASE:
            chosen = declared.effects[e]
            ends = np.where(draw.random(chosen.amplitudes) < 0.5, chosen.low, chosen.high)
            amplitude[k, : chosen.amplitudes] = ends * draw.choice([0.5, 1.0])
            acting = [(chosen.name, amplitude[k, : chosen.amplitudes])]
        for c, block in enumerate(blocks):
            block[k] = world.pours(draw, c, 1, world.shift(c, theta[k], acting, declared))[0]
    return Runs(theta, effect, amplitude, tuple(blocks))


def diagnosed(effects=(), outside=0.0, theta=(0.57, 0.7), holdout=True, carries_over=True, title="Made up", seed=0):
    """Measurement and diagnosis. effects: what is in the data, as shares of each range; outside: a shift in no list.

    carries_over: False turns the effect round in the held-out condition.
    """
    draw, world = np.random.default_rng(seed), World()
    roles = ("fit", "fit", "holdout")[: 3 if holdout else 2]
    empty = [
        measured_condition(name, role, scene, MIDDLE[None])
        for name, role, scene in zip(RIGS, roles, scenes(), strict=False)
    ]
    measurement = Measurement(Path("data/made up"), title, BENCH, PARAMETERS, tuple(empty), ("photographs: not read",))
    declared = declare(measurement, NAMES)
    truth = [
        (name, tuple(share * s for s in one.scale))
        for one in declared.effects
        for name, share in effects
        if one.name == name
    ]
    conditions = []
    for c, condition in enumerate(empty):
        sign = 1.0 if carries_over or condition.role == "fit" else -1.0
        acting = [(name, tuple(sign * a for a in amplitudes)) for name, amplitudes in truth]
        shift = world.shift(c, theta, acting, declared) + outside * world.outside[c]
        block = world.pours(draw, c, REPLICATES, shift)
        conditions.append(measured_condition(condition.name, condition.role, condition.scene, block))
    measurement = replace(measurement, conditions=tuple(conditions))
    verdict = diagnose(declared, simulated(world, declared, draw), observe(measurement.fit), bootstrap=500)

    def confirmed(model):
        blocks = [
            world.pours(draw, c, FRESH, world.shift(c, model.theta, model.effects, declared))
            for c in range(len(conditions))
        ]
        return Confirmed(model, tuple(blocks), 1, tuple(map(profiles, blocks)))

    before, after = models(verdict)
    one = confirmed(before)
    other = one if after == before else confirmed(after)
    return measurement, Diagnosis(
        declared,
        verdict,
        one,
        other,
        errors_of(measurement, "fit", one, other),
        errors_of(measurement, "holdout", one, other),
        (),
        suggestions(verdict),
        321,
        240,
    )


def suggestions(verdict):
    """A menu of two: one set-up where the rivals differ by two sigma, and one where they do not."""
    if not verdict.kind.startswith("ambiguous"):
        return ()
    rivals = {name: k for k, name in enumerate(verdict.names)}
    pour = np.eye(3)
    menu = [
        MenuItem(
            name,
            {rival: Prediction(np.array([gap * k, 0.0, 0.0]), 0.05 * pour) for rival, k in rivals.items()},
            pour,
        )
        for name, gap in (("as it is, poured again", 0.0), ("half the mass", 2.0))
    ]
    ranked = rank_experiments(menu, dict.fromkeys(rivals, 1.0), 6)
    return tuple(Suggestion(one, tuple(f"{name}: {EFFECTS[name].lever}" for name in rivals)) for one in ranked)


CASES = {
    "nothing": {},
    "effect": {"effects": (("adhesion_sjkr", 0.6),)},
    "two amplitudes": {"effects": (("plate_tilt", 0.5),), "seed": 3},
    "not carried over": {"effects": (("adhesion_sjkr", 0.6),), "carries_over": False},
    "no holdout": {"effects": (("adhesion_sjkr", 0.6),), "holdout": False},
    "pair": {"effects": (("adhesion_sjkr", 0.6), ("density_error", 0.6))},
    "ambiguous": {"effects": (("rolling_resistance", 0.6),)},
    "unexplained": {"outside": 1.0},
    "at the edge": {"theta": (0.57, 1.25)},
    "hostile": {"effects": (("adhesion_sjkr", 0.6),), "title": HOSTILE},
}
EXPECTED = {
    "nothing": "no_missing_effect",
    "effect": "effect:adhesion_sjkr",
    "two amplitudes": "effect:plate_tilt",
    "not carried over": "effect:adhesion_sjkr",
    "no holdout": "effect:adhesion_sjkr",
    "pair": "effects:adhesion_sjkr+density_error",
    "ambiguous": "ambiguous:rolling_resistance,twisting",
    "unexplained": "unexplained",
    "at the edge": "no_missing_effect",
    "hostile": "effect:adhesion_sjkr",
}
"""Verdict of each case; the order of rivals is that of chance."""


def result_of_case(name):
    """What the report gets: the content of diagnosis.json, read back as a reader of the file would."""
    measurement, found = diagnosed(**CASES[name])
    order = DiagnoseOrder(measurement.folder, Path("results/made up"), budget=900)
    result = result_of(measurement, order, found, 912.5)
    return json.loads(json.dumps(result, allow_nan=False))
