"""Words of a diagnosis: answers, models, amplitudes, features and their units, for sections, charts and page.

A label is "base", an effect, or a pair "a+b"; an answer is a label except "base", or ``NO_EFFECT`` or ``UNEXPLAINED``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from doe.diagnose.result import BASE, NO_EFFECT, UNEXPLAINED, Amplitude, EffectRow, Place
from doe.holdout import OVERALL, HeldOut
from explorer.diagnosis.result import DiagnosisResult
from explorer.units import (
    MISSING,
    UNIT_ENDINGS,
    ReadingUnit,
    code,
    number,
    p_value,
    parameter_range,
    parameter_value,
    percent,
    reading_unit,
    unit_of_observable,
    unit_of_parameter,
)
from solver import HISTOGRAM_NAMES, TEXTURE_NAMES
from solver.effects import EFFECTS
from solver.observables.surface_features import EDGES, RINGS

ROUNDING = 1e-9
"""Share of the strongest amplitude below which an amplitude counts as zero."""
FOLLOW_UPS_SO_FAR = "On made-up data 53 of 59 follow-ups found it, where 84 % had been stated."
"""Root 4 of ``assets/validation/sets.jsonl`` (``docs/how_often_right.md``)."""


# The answer


def members(label: str) -> list[str]:
    """The effects of a label."""
    return label.split("+")


def spelled(answer: str) -> str:
    """An answer in words, effects as code spans."""
    words = {NO_EFFECT: "nothing missing", UNEXPLAINED: "something outside the library", BASE: "the declared model"}
    return words.get(answer) or " with ".join(code(name) for name in members(answer))


def chance(p: float) -> str:
    """A probability in per cent, to a tenth; one that rounds to none or all is given as less or more."""
    if p >= 0.9995:
        return ">99.9 %"
    return "<0.1 %" if p < 0.0005 else percent(p, 1)


def model_words(label: str) -> str:
    """Words for a model, e.g. "the declared model with `plate_tilt`"."""
    return spelled(BASE) if label == BASE else f"{spelled(BASE)} with {spelled(label)}"


def final_model(result: DiagnosisResult) -> str:
    """Words for the model behind the numbers called "after"."""
    if not result.added:
        return "the declared model, as no effect is added"
    words = model_words(result.final)
    if result.taken_back:
        return f"{words}, which the held-out data took back"
    return words if result.named else f"{words}, the most probable effect of those left"


# Amplitudes


def amplitude_path(effect: str, index: int) -> str:
    """Parameter path of an amplitude."""
    return f"effect.{effect}.{EFFECTS[effect].amplitudes[index]}"


def amplitude_label(effect: str, index: int) -> str:
    """Words for an amplitude, e.g. "rolling friction"."""
    return EFFECTS[effect].amplitudes[index].replace("_", " ")


def amplitude_text(estimate: Amplitude) -> str:
    """Value and 95 % interval with unit; says so if the largest amplitude is the best one."""
    unit = unit_of_parameter(amplitude_path(estimate.effect, estimate.index))
    # For directions in the plane, the computed sine of 180° is not quite zero.
    least = ROUNDING * EFFECTS[estimate.effect].strongest
    sizes = (one if abs(one) > least else 0.0 for one in (estimate.value, estimate.low, estimate.high))
    value, low, high = (number(unit.of(one)) for one in sizes)
    text = f"{unit.attach(value)} (95 % {unit.attach(f'{low} … {high}')})"
    return text + (", the largest that was considered" if estimate.at_end else "")


def amplitudes_of(estimates: Sequence[Amplitude]) -> str:
    """All amplitudes in words, e.g. "rolling friction 0.12 (95 % 0.08 … 0.16)"."""
    return "; ".join(f"{amplitude_label(one.effect, one.index)} {amplitude_text(one)}" for one in estimates)


def given_text(effect: str, amplitude: Sequence[float]) -> str:
    """An effect that the declared model has, e.g. "`rolling_resistance`, rolling friction 0.12"."""
    named = [(index, amplitude_path(effect, index), one) for index, one in enumerate(amplitude)]
    sizes = (f"{amplitude_label(effect, index)} {parameter_value(path, one)}" for index, path, one in named)
    return ", ".join((code(effect), *sizes))


def share_of_bound(effect: str, amplitudes: Sequence[float]) -> float:
    """Size of an effect's amplitudes relative to the strongest that the literature supports."""
    return math.hypot(*amplitudes) / EFFECTS[effect].strongest


def literature_bound(effect: str) -> str:
    """The strongest amplitude that the literature supports."""
    return parameter_value(amplitude_path(effect, 0), EFFECTS[effect].strongest)


def size_text(effect: str, size: float) -> str:
    """An amplitude of that size with its name, or "in any direction" for an effect in the plane."""
    unit = unit_of_parameter(amplitude_path(effect, 0))
    value = unit.attach(number(unit.of(size)))
    planar = len(EFFECTS[effect].amplitudes) > 1
    return f"{value} in any direction" if planar else f"{amplitude_label(effect, 0)} {value}"


def reference_text(row: EffectRow) -> str:
    """The amplitude at which an effect's signature was poured; a dash for a pair."""
    return size_text(row.name, math.hypot(*row.reference)) if row.reference else MISSING


def simulated_range(result: DiagnosisResult, effect: str) -> str:
    """The widest range in which each amplitude of an effect can be simulated here."""
    bounds = result.range_of(effect)
    return "; ".join(
        parameter_range(amplitude_path(effect, index), low, high)
        for index, (low, high) in enumerate(zip(bounds.low, bounds.high, strict=True))
    )


# Features


def feature_label(name: str) -> str:
    """Words for a feature, e.g. "apex height", "mean height of ring 3"."""
    if name == OVERALL:
        return "all together"
    if (plain := name.partition("@")[0]) in SURFACE_LABELS:
        return SURFACE_LABELS[plain]
    words, _, place = name.partition("(")
    for ending in UNIT_ENDINGS:
        if words.endswith(ending):
            words = words.removesuffix(ending)
            break
        words = words.replace(f"{ending}@", "@")
    words = words.replace("@", " seen from ").replace("_", " ") + ("°" if "@" in words else "")
    return f"{words} at {place.rstrip(')')}" if place else words


def feature_unit(result: DiagnosisResult, name: str) -> ReadingUnit:
    """Unit in which a feature is read; for all features together, the standard deviation of a pour in each."""
    if name == OVERALL:
        return ReadingUnit("SD", 1.0)
    plain = name.partition("@")[0]
    if plain in SURFACE_LABELS:
        return next((unit for ending, unit in SURFACE_UNITS.items() if plain.endswith(ending)), ReadingUnit("", 1.0))
    known = result.units.get(name)
    return unit_of_observable(name) if known is None else reading_unit(known)


def feature_value(result: DiagnosisResult, name: str, value: float, digits: int = 3) -> str:
    """A feature's value with its unit."""
    unit = feature_unit(result, name)
    return unit.attach(number(unit.of(value), digits))


def feature_in(row: Place) -> str:
    """Words for a feature and its condition."""
    return f"{feature_label(row.feature)} ({row.condition})"


def _surface_labels() -> dict[str, str]:
    found = {f"ring_height_{k + 1}_m": f"mean height of ring {k + 1}" for k in range(RINGS)}
    found |= {"ring_volume_m3": "volume of the pile", "covered_area_m2": "covered area"}
    found |= {f"height_q{q}_m": f"height that {100 - q} % of the covered area exceeds" for q in (90, 99)}
    found |= {
        name: f"share of the covered area {low:g} to {high:g} bodies high"
        for name, (low, high) in zip(HISTOGRAM_NAMES, pairwise(EDGES[:-1]), strict=True)
    }
    pairs = [name for name in TEXTURE_NAMES if name.startswith("ring_roughness")]
    found |= {name: f"roughness of rings {2 * k + 1} and {2 * k + 2}" for k, name in enumerate(pairs)}
    found |= {"slope": "mean slope of the core", "curvature_per_m": "mean curvature of the core"}
    for axis in "xy":
        found |= {f"skew_{axis}_m": f"centre of volume, {axis}"}
        found |= {f"inner_skew_{axis}_m": f"centre of volume of the core, {axis}"}
    return found


SURFACE_LABELS = _surface_labels()
"""Words for what a profile or a scan adds to the summaries. Rings are of equal width; the core is the inner half."""
SURFACE_UNITS = {
    "_m3": ReadingUnit("cm³", 1e-6),
    "_m2": ReadingUnit("cm²", 1e-4),
    "_per_m": ReadingUnit("1/mm", 1e3),
    "_m": ReadingUnit("mm", 1e-3),
}
"""By the ending of a name."""


def with_fit(told: HeldOut) -> str:
    """What the fitted data add to the p of the held-out data."""
    return "" if told.fit == 1.0 else f"; with that of the fitted data, {p_value(told.fit)}, {p_value(told.together)}"
