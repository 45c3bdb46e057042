"""What the sections say is read off ``diagnosis.json`` here: the kind of answer, who is named, what was confirmed.

A result is plain JSON: dict, list, str, float, None (no number), never NaN. Numbers are SI, residuals in σ.
"""

from __future__ import annotations

from typing import Literal

from explorer.report.findings import Plain
from explorer.report.units_for_people import (
    ReadingUnit,
    code,
    fixed,
    number,
    parameter_label,
    parameter_range,
    parameter_value,
    reading_unit,
    unit_of_observable,
)
from solver.effects import EFFECTS

Kind = Literal["no_missing_effect", "effect", "effects", "ambiguous", "unexplained"]
Confirmation = Literal["no holdout", "within noise", "confirmed", "not certain", "contradicted"]

OVERALL = "overall"
UNIT_ENDINGS = ("_deg", "_kg_m3", "_m", "_s", "_kg")
NOISE_FALL = 3.84
"""95 % of χ² with one degree of freedom: by how much a free parameter lowers T² by chance."""
EDGE = {-1: "lower end", 0: "", 1: "upper end"}


def kind_of(result: Plain) -> Kind:
    """The kind of answer, without the names in it."""
    head: Kind = result["verdict"].partition(":")[0]
    return head


def named(result: Plain) -> list[str]:
    """What the verdict names, best first: effects, or pairs "a+b"."""
    names = result["verdict"].partition(":")[2]
    return names.split(",") if names else []


def members(label: str) -> list[str]:
    """The effects of a label: "a" or "a+b"."""
    return label.split("+")


def spelled(label: str) -> str:
    """A label as code spans: `a`, or `a` with `b`."""
    return " with ".join(code(name) for name in members(label))


def overall(result: Plain, role: str) -> Plain | None:
    """The row of all observables together; None where the role has no condition."""
    rows = [row for row in result["error"][role] if row["observable"] == OVERALL]
    return rows[0] if rows else None


def confirmation(result: Plain) -> Confirmation:
    """What the held-out conditions say of the corrected model, by its skill (`doe.diagnose.follow_up.holdout`)."""
    row = overall(result, "holdout")
    if row is None:
        return "no holdout"
    if row["skill"] is None:
        return "within noise"
    if row["skill"] <= 0.0:
        return "contradicted"
    return "confirmed" if row["skill_low"] is not None and row["skill_low"] > 0.0 else "not certain"


def raced(result: Plain) -> list[Plain]:
    """Effects that the data can see, and that were compared."""
    return [row for row in result["effects"] if row["status"] == "raced"]


def out_of_sight(result: Plain) -> list[Plain]:
    """Effects that these data cannot see, or that were not simulated."""
    return [row for row in result["effects"] if row["status"] != "raced"]


def best_by_criterion(result: Plain) -> Plain | None:
    """The single effect that won the race; None where there was none."""
    rows = [row for row in raced(result) if row["delta"] == 0.0]
    return rows[0] if rows else None


def gate_named(result: Plain, start: str) -> Plain | None:
    """The first gate whose name begins with ``start``."""
    return next((gate for gate in result["gates"] if gate["name"].startswith(start)), None)


def amplitude_path(effect: str, index: int) -> str:
    """Parameter path of an amplitude."""
    return f"effect.{effect}.{EFFECTS[effect].amplitudes[index]}"


def amplitude_label(effect: str, index: int) -> str:
    """Words for an amplitude, e.g. "rolling friction"."""
    return EFFECTS[effect].amplitudes[index].replace("_", " ")


def amplitude_text(estimate: Plain) -> str:
    """Value and 95 % interval with unit; says so where a bound holds it."""
    path = amplitude_path(estimate["effect"], estimate["index"])
    text = (
        f"{parameter_value(path, estimate['value'])} (95 % {parameter_range(path, estimate['low'], estimate['high'])})"
    )
    return text + (", at the end of its range" if estimate["at_edge"] and estimate["value"] else "")


def amplitudes_of(estimates: list[Plain]) -> str:
    """All amplitudes in words, e.g. "rolling friction 0.12 (95 % 0.08 … 0.16)"."""
    return "; ".join(f"{amplitude_label(one['effect'], one['index'])} {amplitude_text(one)}" for one in estimates)


def simulated_range(result: Plain, effect: str) -> str:
    """How far each amplitude of an effect was simulated."""
    (bounds,) = (one for one in result["ranges"] if one["name"] == effect)
    return "; ".join(
        parameter_range(amplitude_path(effect, index), low, high)
        for index, (low, high) in enumerate(zip(bounds["low"], bounds["high"], strict=True))
    )


def literature_bound(effect: str) -> str:
    """The strongest amplitude that the literature supports."""
    return parameter_value(amplitude_path(effect, 0), EFFECTS[effect].strongest)


def summary_unit(result: Plain, name: str) -> ReadingUnit:
    """Unit in which a summary is read; σ for all together."""
    if name == OVERALL:
        return ReadingUnit("σ", 1.0)
    known = result["units"].get(name)
    return unit_of_observable(name) if known is None else reading_unit(known)


def summary_value(result: Plain, name: str, value: float | None, digits: int = 3) -> str:
    """A summary's value with its unit."""
    unit = summary_unit(result, name)
    return unit.attach(number(None if value is None else unit.of(value), digits))


def summary_label(name: str) -> str:
    """Words for a summary, e.g. "apex height", "height profile at 0.0125"."""
    if name == OVERALL:
        return "all together"
    words, _, place = name.partition("(")
    for ending in UNIT_ENDINGS:
        if words.endswith(ending):
            words = words.removesuffix(ending)
            break
        words = words.replace(f"{ending}@", "@")
    words = words.replace("@", " seen from ").replace("_", " ") + ("°" if "@" in words else "")
    return f"{words} at {place.rstrip(')')}" if place else words


def split_label(label: str) -> tuple[str, str]:
    """ "condition: summary" → both; a condition's own name may hold a colon."""
    condition, _, summary = label.rpartition(": ")
    return condition, summary


def residual_label(label: str) -> str:
    """A row of a chart: condition and words for the summary."""
    condition, summary = split_label(label)
    return f"{condition} · {summary_label(summary)}"


def pressed(result: Plain) -> list[str]:
    """Parameters that the declared model presses against an end of their range by more than noise asks for."""
    rows = [row for row in result["parameters"] if row["edge_before"] and fall_beyond(row["pull_before"]) > NOISE_FALL]
    return [parameter_label(row["name"]) for row in rows]


def edges(result: Plain, least: float = 0.0) -> list[str]:
    """A sentence for every parameter that calibration drove to an end of its range, at a cost in T² above ``least``."""
    found = []
    for row in result["parameters"]:
        for when, words in (("before", "the declared model"), ("after", "the final model")):
            fall = fall_beyond(row[f"pull_{when}"])
            if row[f"edge_{when}"] and fall >= least and (when == "before" or result["amplitudes"]):
                tail = (
                    "more than noise asks for: range and model do not fit together, which is evidence in itself"
                    if fall > NOISE_FALL
                    else "no more than noise may ask for"
                )
                found.append(
                    f"In {words} calibration drives {parameter_label(row['name'])} ({code(row['name'])}) to the "
                    f"{EDGE[row[f'edge_{when}']]} of its measured range, {parameter_value(row['name'], row[when])}. "
                    f"Without that end T² would fall by about {fixed(fall, 1)}, {tail} ({fixed(NOISE_FALL, 1)} in one "
                    "case of twenty)."
                )
    return found


def fall_beyond(pull: float) -> float:
    """Fall of T² if the end were not there: (pull/2)², T² being a parabola with pull = 2 |slope| · standard error."""
    return (pull / 2.0) ** 2


def final_model(result: Plain) -> str:
    """Words for the model behind the numbers called "after" in the fit."""
    effects = list(dict.fromkeys(one["effect"] for one in result["amplitudes"]))
    if not effects:
        return "the declared model, as nothing is added"
    words = f"the declared model with {spelled('+'.join(effects))}"
    return words if named(result) else f"{words}, the best single effect although it is not adequate"
