"""What the sections say is read off ``diagnosis.json`` here: the kind of answer, its probabilities, words and units.

A result is plain JSON: dict, list, str, float, None (no number), never NaN. Numbers are SI, residuals in σ. A label is
"base", an effect, or a pair "a+b"; an answer is a label but "base", or ``NOTHING`` or ``OUTSIDE``.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, Literal

from explorer.errors import CommandError
from explorer.report.units_for_people import (
    MISSING,
    ReadingUnit,
    code,
    number,
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

Plain = dict[str, Any]
Kind = Literal["no_missing_effect", "effect", "effects", "ambiguous", "unexplained"]
Confirmation = Literal["no holdout", "within noise", "confirmed", "not certain", "not confirmed"]

SCHEMA = 3
"""Of the ``diagnosis.json`` that is read here."""
NOTHING, OUTSIDE, BASE = "no_missing_effect", "unexplained", "base"
OVERALL = "overall"
ROUNDING = 1e-9
"""Share of the strongest amplitude below which one is zero."""
UNIT_ENDINGS = ("_deg", "_kg_m3", "_m", "_s", "_kg")


class ResultVersionError(CommandError):
    """A ``diagnosis.json`` of another version of the program."""


def checked(result: Plain) -> Plain:
    """``result``; raises ResultVersionError where another version of the program made it."""
    schema = result.get("schema")
    if schema != SCHEMA:
        older = isinstance(schema, int) and schema < SCHEMA
        maker = "an older version" if older else "another version"
        raise ResultVersionError(
            f"diagnosis.json: made by {maker} of the program (schema {schema}; allowed: {SCHEMA}); run the "
            "diagnosis again"
        )
    return result


# The answer


def kind_of(result: Plain) -> Kind:
    """The kind of answer, without the names in it."""
    return _kind(result["verdict"])


def answers(verdict: str) -> list[str]:
    """What a verdict leaves possible, the most probable first."""
    names = verdict.partition(":")[2]
    return names.split(",") if names else [_kind(verdict)]


def named(result: Plain) -> list[str]:
    """The effects, or the pair "a+b", that the answer names; empty where it names none."""
    return result["names"] if kind_of(result) in ("effect", "effects") else []


def members(label: str) -> list[str]:
    """The effects of a label."""
    return label.split("+")


def spelled(answer: str) -> str:
    """An answer in words, effects as code spans."""
    words = {NOTHING: "nothing missing", OUTSIDE: "something outside the library", BASE: "the declared model"}
    return words.get(answer) or " with ".join(code(name) for name in members(answer))


def probabilities(result: Plain) -> list[tuple[str, float]]:
    """Every answer with its probability, the most probable first."""
    found = {row["name"]: row["probability"] for row in result["effects"]}
    found |= {NOTHING: result["probabilities"]["nothing"], OUTSIDE: result["probabilities"]["outside"]}
    return sorted(found.items(), key=lambda one: -one[1])


def probability(result: Plain, answer: str) -> float:
    """Of one answer; 0 of an effect that is so improbable that it has no row."""
    return dict(probabilities(result)).get(answer, 0.0)


def chance(p: float) -> str:
    """A probability in per cent, to a tenth; what rounds to none or all is called less or more."""
    if p >= 0.9995:
        return ">99.9 %"
    return "<0.1 %" if p < 0.0005 else percent(p, 1)


def effect_row(result: Plain, label: str) -> Plain | None:
    """The row of an effect or a pair; None where it has none."""
    return next((row for row in result["effects"] if row["name"] == label), None)


def added(result: Plain) -> bool:
    """Whether the final model holds an effect: before and after are the same model otherwise."""
    return bool(result["final"] != BASE)


def model_words(label: str) -> str:
    """Words for a model, e.g. "the declared model with `plate_tilt`"."""
    return spelled(BASE) if label == BASE else f"{spelled(BASE)} with {spelled(label)}"


def final_model(result: Plain) -> str:
    """Words for the model behind the numbers called "after"."""
    if not added(result):
        return "the declared model, as no effect is added"
    words = model_words(result["final"])
    if result["taken_back"]:
        return f"{words}, which the held-out data took back"
    return words if named(result) else f"{words}, the most probable effect of those left"


def overall(result: Plain, role: str) -> Plain | None:
    """The row of all observables together; None where the role has no condition."""
    rows = [row for row in result["error"][role] if row["observable"] == OVERALL]
    return rows[0] if rows else None


def confirmation(result: Plain) -> Confirmation:
    """What the held-out conditions say of the final model, by its skill (`doe.holdout`)."""
    row = overall(result, "holdout")
    if row is None:
        return "no holdout"
    if row["skill"] is None:
        return "within noise"
    if row["skill"] <= 0.0:
        return "not confirmed"
    return "confirmed" if row["skill_low"] is not None and row["skill_low"] > 0.0 else "not certain"


# Amplitudes


def amplitude_path(effect: str, index: int) -> str:
    """Parameter path of an amplitude."""
    return f"effect.{effect}.{EFFECTS[effect].amplitudes[index]}"


def amplitude_label(effect: str, index: int) -> str:
    """Words for an amplitude, e.g. "rolling friction"."""
    return EFFECTS[effect].amplitudes[index].replace("_", " ")


def amplitude_text(estimate: Plain) -> str:
    """Value and 95 % interval with unit; says so where the largest amplitude is the best one."""
    unit = unit_of_parameter(amplitude_path(estimate["effect"], estimate["index"]))
    # Directions round the plane leave a sine of 180° that is not quite zero.
    least = ROUNDING * EFFECTS[estimate["effect"]].strongest
    sizes = (estimate[key] if abs(estimate[key]) > least else 0.0 for key in ("value", "low", "high"))
    value, low, high = (number(unit.of(one)) for one in sizes)
    text = f"{unit.attach(value)} (95 % {unit.attach(f'{low} … {high}')})"
    return text + (", the largest that was considered" if estimate["at_end"] else "")


def amplitudes_of(estimates: list[Plain]) -> str:
    """All amplitudes in words, e.g. "rolling friction 0.12 (95 % 0.08 … 0.16)"."""
    return "; ".join(f"{amplitude_label(one['effect'], one['index'])} {amplitude_text(one)}" for one in estimates)


def share_of_bound(effect: str, amplitudes: list[float]) -> float:
    """Size of an effect's amplitudes over the strongest that the literature supports."""
    return math.hypot(*amplitudes) / EFFECTS[effect].strongest


def literature_bound(effect: str) -> str:
    """The strongest amplitude that the literature supports."""
    return parameter_value(amplitude_path(effect, 0), EFFECTS[effect].strongest)


def size_text(effect: str, size: float) -> str:
    """An amplitude of that size with its name, or "in any direction" of an effect in the plane."""
    unit = unit_of_parameter(amplitude_path(effect, 0))
    value = unit.attach(number(unit.of(size)))
    planar = len(EFFECTS[effect].amplitudes) > 1
    return f"{value} in any direction" if planar else f"{amplitude_label(effect, 0)} {value}"


def reference_text(row: Plain) -> str:
    """The amplitude at which an effect's signature was poured; a dash for a pair."""
    return size_text(row["name"], math.hypot(*row["reference"])) if row["reference"] else MISSING


def simulated_range(result: Plain, effect: str) -> str:
    """The widest range in which each amplitude of an effect can be set up here."""
    (bounds,) = (one for one in result["ranges"] if one["name"] == effect)
    return "; ".join(
        parameter_range(amplitude_path(effect, index), low, high)
        for index, (low, high) in enumerate(zip(bounds["low"], bounds["high"], strict=True))
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


def feature_unit(result: Plain, name: str) -> ReadingUnit:
    """Unit in which a feature is read; σ for all together."""
    if name == OVERALL:
        return ReadingUnit("σ", 1.0)
    plain = name.partition("@")[0]
    if plain in SURFACE_LABELS:
        return next((unit for ending, unit in SURFACE_UNITS.items() if plain.endswith(ending)), ReadingUnit("", 1.0))
    known = result["units"].get(name)
    return unit_of_observable(name) if known is None else reading_unit(known)


def feature_value(result: Plain, name: str, value: float | None, digits: int = 3) -> str:
    """A feature's value with its unit."""
    unit = feature_unit(result, name)
    return unit.attach(number(None if value is None else unit.of(value), digits))


def feature_in(row: Plain) -> str:
    """Words for a feature and its condition."""
    return f"{feature_label(row['feature'])} ({row['condition']})"


def _kind(verdict: str) -> Kind:
    head: Kind = verdict.partition(":")[0]  # type: ignore[assignment]
    return head


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
