"""Diagnoses of a linear world with a known answer, one per kind of verdict, by the program's own decision code.

    y_c = middle_c + u (J_c θ + Σ_k a_k s_kc + e),   e ~ N(0, 1) per pour, u the size of one pour's noise

with parameters θ in deviations of their measurements and amplitudes a in multiples of the reference ones. No pour is
made: the pours that teach, the data and the fresh pours are drawn from the same formula. ``rolling_resistance`` and
``twisting`` have almost the same signature, ``air_drag`` hardly any. Only the first condition has a scan.
"""

import functools
import json
import math
from pathlib import Path

import numpy as np

from doe.declared.model import declare
from doe.declared.points import directions_of, moved
from doe.declared.pours import PointPour
from doe.diagnose.compared_features import MeasuredFeatures, weighed
from doe.diagnose.diagnosis import Diagnosis, concluded, errors_of
from doe.diagnose.emulator import Lessons, Way
from doe.diagnose.next_experiment import CandidateExperiment, Prediction, rank_experiments
from doe.diagnose.result import Level, Offered, Suggestion
from doe.diagnose.verdict import verdict_of
from doe.measurement.features import SCALARS, SCAN
from doe.measurement.measurement import Condition, MeasuredParameter, Measurement, Observation
from doe.measurement.residual_map import ResidualMap, height_difference
from explorer.diagnosis.result import DiagnosisResult
from explorer.diagnosis.run import DiagnoseOrder, result_of
from solver import EFFECTS, load_material, with_values

HOSTILE = "<script>alert('x')</script> & | `co` \"q\" 日本"
SUMMARIES = {
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
SEEN_AS = "@3 x 0.5 mm"
SURFACE = {
    "ring_height_3_m": (0.014, 6e-4),
    "ring_volume_m3": (5.1e-5, 1e-6),
    "covered_area_m2": (0.0128, 4e-4),
    "height_q90_m": (0.021, 8e-4),
    "height_share_4": (0.13, 0.02),
    "ring_roughness_2_m": (0.0021, 2e-4),
    "slope": (0.52, 0.04),
    "curvature_per_m": (210.0, 15.0),
    "skew_x_m": (0.0, 9e-4),
    "inner_skew_y_m": (0.0, 0.0),
}
"""What a scan adds: middle, noise of one pour (SI). The last never varies."""
FEATURES = {name: row[1:] for name, row in SUMMARIES.items()} | {f"{k}{SEEN_AS}": row for k, row in SURFACE.items()}
MIDDLE, SIZE = (np.array([row[k] for row in FEATURES.values()]) for k in (0, 1))
D, WIDTH = len(SUMMARIES), len(FEATURES)
REPLICATES, BASE, TAUGHT = 6, 48, 12
RADIUS = (np.arange(18) + 0.5) * 5e-3
PIXEL = 7e-3
PARAMETERS = (
    MeasuredParameter("pair.grain.grain.static_friction", 0.47, 0.72, 0.57, 0.05),
    MeasuredParameter("pair.grain.steel.static_friction", 0.4, 1.0, None, None),
)
NAMES = ("rolling_resistance", "twisting", "adhesion_sjkr", "plate_tilt", "air_drag", "density_error")
SHARE = dict.fromkeys(NAMES, 0.4) | {"air_drag": 1.0}
"""Of the range, at which an effect was poured."""
SIGMAS = 14.0
"""Of six pours in both fitted conditions, by which an effect shifts there."""
FAINT = 0.1
"""Share of that by air drag."""
BENCH = load_material(str(Path(__file__).parents[2] / "assets/measurements/trefoil_1/material.toml"))
RIGS = {"fit": {}, "fit fast": {"insertion.rate": 0.05}, "holdout": {"rig.outlet_height": 0.09}}


def unit(array):
    return array / np.linalg.norm(array)


class World:
    """jacobian (2, 3, WIDTH): per parameter and condition. signatures: effect → (amplitudes, 3, WIDTH)."""

    def __init__(self, seed=5):
        self._draw = np.random.default_rng(seed)
        self.jacobian = np.array([self._shift(1.5) for _ in PARAMETERS])
        size = SIGMAS / math.sqrt(REPLICATES)
        self.signatures = {name: np.array([self._shift(size) for _ in EFFECTS[name].amplitudes]) for name in NAMES}
        self.signatures["twisting"] = self.signatures["rolling_resistance"] + np.array([self._shift(0.03 * size)])
        self.signatures["air_drag"] *= FAINT
        self.outside = self._shift(size)

    def _shift(self, size):
        """So long in the features that the fitted conditions offer, and as long in the held-out one."""
        drawn = self._draw.standard_normal((3, WIDTH))
        offered = np.concatenate([drawn[0], drawn[1, :D]])
        drawn[:2] *= size / np.linalg.norm(offered)
        drawn[2] *= size / np.linalg.norm(drawn[2, :D])
        return drawn

    def shift(self, condition, theta, acting):
        """In sigma of a pour. acting: effect → multiples of its reference amplitudes."""
        total = np.tensordot(theta, self.jacobian[:, condition], 1)
        for name, multiples in acting.items():
            total = total + np.tensordot(np.array(multiples), self.signatures[name][:, condition], 1)
        return total

    def pours(self, draw, condition, number, shift):
        return MIDDLE + SIZE * (0.5 * condition + shift + draw.standard_normal((number, WIDTH)))


def scenes():
    return [with_values(BENCH, settings) for settings in RIGS.values()]


def measured_condition(name, role, scene, block):
    """Summaries, and height profiles for the picture of the pile; what is measured once has its uncertainty stated."""
    alone = len(block) == 1
    observations = [
        Observation(summary, unit_, None, block[:, k], 0.2 * float(SIZE[k]) if alone else None)
        for k, (summary, (unit_, *_)) in enumerate(SUMMARIES.items())
    ]
    observations.append(Observation("height_profile_m", "m", RADIUS, profiles(block), None, "piles"))
    return Condition(name, role, scene, len(block), tuple(observations))


def profiles(block):
    """Cones of the apex height and the radius r90 of each pour."""
    return block[:, [1]] * np.maximum(0.0, 1.0 - RADIUS / block[:, [4]])


def cones(block):
    """Heights over the plate of the same cones, (pours, 24, 24)."""
    at = PIXEL * (np.arange(24) - 11.5)
    shares = np.hypot(at[:, None], at[None, :]) / block[:, 4, None, None]
    return block[:, 1, None, None] * np.maximum(0.0, 1.0 - shares)


def maps_of(measured, before, after):
    """Of the condition that has a scan."""
    poured = (height_difference(cones(measured), cones(one.blocks[0])) for one in (before, after))
    return (ResidualMap("fit", "fit", PIXEL, cones(measured).mean(axis=0), *poured),)


def levels_of(declared):
    """Every direction of every effect, with the share of its range at which it was poured."""
    return tuple(
        Level(direction, SHARE[effect.name], SIGMAS * (FAINT if effect.name == "air_drag" else 1.0))
        for effect in declared.effects
        for direction in directions_of(effect)
    )


def lessons_of(world, declared, levels, draw):
    """Pours of the base model, and of each way at its reference amplitude and at half of it."""
    theta, ways, multiples, rows = [], [], [], []
    jobs = [(-1, 0.0, BASE)] + [(w, a, TAUGHT) for w in range(len(levels)) for a in (1.0, 0.5)]
    for way, multiple, number in jobs:
        for k in range(number):
            at = declared.theta(moved(declared, k))
            acting = {} if way < 0 else {levels[way].direction.effect: along(levels[way].direction, multiple)}
            theta.append(at)
            ways.append(way)
            multiples.append(multiple)
            rows.append([world.pours(draw, c, 1, world.shift(c, at, acting))[0] for c in range(2)])
    blocks = tuple(np.array([row[c] for row in rows]) for c in range(2))
    return Lessons(np.array(theta), np.array(ways), np.array(multiples), np.arange(len(rows)), blocks)


class FormulaPours:
    """Stands for ``ModelPours``: fresh pours of the formula, the first of every model broken off."""

    def __init__(self, world, declared, ways, conditions, draw):
        self._world, self._declared, self._conditions, self._draw = world, declared, conditions, draw
        self._references = {way.effect: max(map(abs, way.unit)) for way in ways}

    def run(self, what, points, where=None):
        return [[self._pour(point, c) for c in range(len(self._conditions))] for point in points]

    def _pour(self, point, condition):
        acting = {name: tuple(a / self._references[name] for a in values) for name, values in point.effects}
        shift = self._world.shift(condition, self._declared.theta(point.theta), acting)
        pour = self._world.pours(self._draw, condition, 1, shift)[:, :D]
        outcome = "measured" if point.number or condition else "jammed"
        return PointPour(tuple(pour[0]), outcome, tuple(profiles(pour)[0]))


def along(direction, multiple):
    """Multiples of the reference amplitudes in a direction: with their signs, zero for the other axis."""
    return tuple(multiple * float(np.sign(one)) for one in direction.full)


def diagnosed(
    effects=(),
    outside=0.0,
    elsewhere=0.0,
    theta=(0.0, 0.0),
    holdout=True,
    carries_over=True,
    title="Made up",
    seed=0,
    replicates=REPLICATES,
):
    """Measurement and diagnosis.

    effects: what is in the data, with multiples of the reference amplitudes; outside, elsewhere: so much of a shift in
    no list, in the fitted conditions and in the held-out one;
    theta: deviations of the parameters; carries_over: False turns the effect round in the held-out condition.
    """
    draw, world = np.random.default_rng(seed), World()
    roles = ("fit", "fit", "holdout")[: 3 if holdout else 2]
    blocks = []
    for c, role in enumerate(roles):
        sign = 1.0 if carries_over or role == "fit" else -1.0
        acting = {name: tuple(sign * a for a in multiples) for name, multiples in effects}
        strange = (outside if role == "fit" else elsewhere) * world.outside[c]
        blocks.append(world.pours(draw, c, replicates, world.shift(c, theta, acting) + strange))
    conditions = tuple(
        measured_condition(name, role, scene, block)
        for name, role, scene, block in zip(RIGS, roles, scenes(), blocks, strict=False)
    )
    ignored, notes = ("photographs: not read",), ("mass: clipped",)
    measurement = Measurement(Path("data/made up"), title, BENCH, PARAMETERS, conditions, ignored, notes)
    declared = declare(measurement, NAMES)
    levels = levels_of(declared)
    ways = [
        Way(one.direction.effect, one.direction.name, one.direction.at(one.share), 1.0 / one.share, one.direction.angle)
        for one in levels
    ]
    stated = np.zeros(WIDTH)
    stated[0] = 0.2
    offers = [
        MeasuredFeatures("fit", SCAN, tuple(FEATURES), blocks[0], stated),
        MeasuredFeatures("fit fast", SCALARS, tuple(SUMMARIES), blocks[1][:, :D], stated[:D]),
    ]
    lessons = lessons_of(world, declared, levels, draw)
    compared = weighed(lessons, ways, offers)
    taught = [int((lessons.way == w).sum()) for w in range(len(ways))]
    # Two effects are named after a follow-up only.
    verdict = verdict_of(compared, declared, taught, [measurement] if len(effects) > 1 else [])
    fresh = FormulaPours(world, declared, ways, conditions, draw)
    found, verdict = concluded(verdict, compared, declared, conditions, fresh, lambda line: None)
    return measurement, Diagnosis(
        declared=declared,
        conditions=measurement.conditions,
        levels=levels,
        offered=tuple(
            Offered(name, offer, len(names), more)
            for name, offer, names, more in zip(RIGS, (SCAN, SCALARS), compared.names, (0, 37), strict=False)
        ),
        verdict=verdict,
        before=found.before,
        after=found.after,
        fit_error=errors_of(conditions, "fit", found),
        holdout_error=errors_of(conditions, "holdout", found),
        held_out=found.held_out,
        maps=maps_of(blocks[0], found.before, found.after) if replicates > 1 else (),
        suggestions=suggestions(verdict),
        pours=321,
        settings=240,
    )


def suggestions(verdict):
    """A menu of two: one set-up where the rivals differ by two sigma, and one where they do not."""
    if not verdict.kind.startswith("ambiguous"):
        return ()
    rivals = {name: k for k, name in enumerate((*verdict.names, "base")[:2])}
    pour = np.eye(3)
    menu = [
        CandidateExperiment(
            name,
            {rival: Prediction(np.array([gap * k, 0.0, 0.0]), 0.05 * pour) for rival, k in rivals.items()},
        )
        for name, gap in (("as it is, poured again", 0.0), ("half the mass", 2.0))
    ]
    ranked = rank_experiments(menu, dict.fromkeys(rivals, 1.0 / len(rivals)), 6)
    levers = tuple(f"{name}: {EFFECTS[name].lever}" for name in verdict.names if name in EFFECTS)
    changes = {"rig.outlet_height": 0.12}
    return tuple(Suggestion(one, changes, "fit", tuple(rivals), levers, 6) for one in ranked)


CASES = {
    "nothing": {},
    "effect": {"effects": (("adhesion_sjkr", (0.6,)),)},
    "two amplitudes": {"effects": (("plate_tilt", (0.5, 0.4)),)},
    "not carried over": {"effects": (("adhesion_sjkr", (0.6,)),), "carries_over": False},
    "no holdout": {"effects": (("adhesion_sjkr", (0.6,)),), "holdout": False},
    "pair": {"effects": (("adhesion_sjkr", (0.8,)), ("density_error", (0.8,)))},
    "ambiguous": {"effects": (("rolling_resistance", (0.6,)),)},
    "faint": {"effects": (("adhesion_sjkr", (0.35,)),), "seed": 2},
    "unexplained": {"outside": 0.8, "elsewhere": 0.8},
    "wrong elsewhere": {"elsewhere": 1.5},
    "does not fit": {"effects": (("adhesion_sjkr", (2.0,)),), "outside": 0.7},
    "at the edge": {"theta": (0.0, 1.8)},
    "measured once": {"effects": (("adhesion_sjkr", (1.5,)),), "replicates": 1},
    "hostile": {"effects": (("adhesion_sjkr", (0.6,)),), "title": HOSTILE},
}
EXPECTED = {
    "nothing": "no_missing_effect",
    "effect": "effect:adhesion_sjkr",
    "two amplitudes": "effect:plate_tilt",
    "not carried over": "unexplained",
    "no holdout": "effect:adhesion_sjkr",
    "pair": "effects:adhesion_sjkr+density_error",
    "ambiguous": "ambiguous:rolling_resistance,twisting",
    "faint": "ambiguous:adhesion_sjkr,no_missing_effect,unexplained,air_drag",
    "unexplained": "unexplained",
    "wrong elsewhere": "unexplained",
    "does not fit": "unexplained",
    "at the edge": "no_missing_effect",
    "measured once": "effect:adhesion_sjkr",
    "hostile": "effect:adhesion_sjkr",
}
"""Verdict of each case; the order of rivals is that of chance."""


def result_of_case(name):
    """What the report gets: the content of diagnosis.json, read back as a reader of the file would; a copy."""
    return json.loads(_text_of_case(name))


@functools.cache
def _text_of_case(name):
    measurement, found = diagnosed(**CASES[name])
    order = DiagnoseOrder(measurement.folder, Path("results/made up"), budget=900)
    result = result_of(measurement, order, {}, found, 912.5)
    return json.dumps(result.to_dict(), allow_nan=False)


def typed(content):
    """The result that a reader of the file gets."""
    return DiagnosisResult.from_dict(content)
