"""A measured data set as text for a terminal and as plain data: conditions, parameters, and what they can tell."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from doe.measurement import Condition, Measurement, Observation, Reach, reach_of
from doe.measurement.bodies import QUANTITIES
from doe.measurement.features import PROFILE, SCAN, feature_set, offer_of, resolution
from doe.record import plain
from explorer.terminal.text_table import text_table

CALIBRATED = "free parameters"


def check_text(measurement: Measurement) -> str:
    """Everything about ``measurement`` and its reach, in paragraphs."""
    reach = reach_of(measurement)
    parts = [f"{measurement.folder}: {measurement.title}".rstrip(": ")]
    parts += [_condition_text(condition) for condition in measurement.conditions]
    parts.append(_parameters_text(measurement))
    if measurement.bodies:
        parts.append(_bodies_text(measurement))
    if measurement.cross_check:
        parts.append(_cross_check_text(measurement))
    parts.append(_reach_text(reach))
    parts += [_listed("ignored", measurement.ignored), _listed("note", measurement.notes)]
    parts.append(_listed("warning", reach.warnings))
    return "\n\n".join(part for part in parts if part)


def check_result(measurement: Measurement) -> dict[str, Any]:
    """The same as JSON types."""
    return {
        "folder": str(measurement.folder),
        "title": measurement.title,
        "conditions": [_condition_result(condition) for condition in measurement.conditions],
        "parameters": plain(measurement.parameters),
        "bodies": plain(measurement.bodies),
        "cross_check": plain(measurement.cross_check),
        "reach": plain(reach_of(measurement)),
        "ignored": plain(measurement.ignored),
        "notes": plain(measurement.notes),
    }


def _bodies_text(measurement: Measurement) -> str:
    rows = [
        (one.body, one.quantity, QUANTITIES[one.quantity].unit, f"{one.mean:.4g}", f"{one.standard_error:.2g}")
        for one in measurement.bodies
    ]
    return f"single bodies\n{text_table(('component', 'quantity', 'unit', 'mean', 'standard error'), rows)}"


def _condition_text(condition: Condition) -> str:
    head = f"{condition.name}: {condition.role}, {condition.scene.rig.name}, replicates: {condition.replicates}"
    if condition.mean_of > 1:
        head += f", each the mean of {condition.mean_of} pours"
    rows = [
        (o.observable, o.unit, str(_number_of_values(o)), *_mean_and_sd(o), o.origin) for o in condition.observations
    ]
    table = text_table(("observable", "unit", "values", "mean", "SD", "from"), rows)
    return "\n".join((head, table, *_pile_lines(condition)))


def _pile_lines(condition: Condition) -> Iterator[str]:
    """What the data show of the pile as a whole, and what a scan would add; nothing of a rig that leaves no pile."""
    features, offer = feature_set(condition), offer_of(condition)
    scalars, profile, surface = map(len, (features.scalars, features.profile, features.surface))
    if not profile:
        return
    if offer == SCAN:
        cells = f" in cells of {1e3 * resolution(condition):.3g} mm" if resolution(condition) > 0.0 else ""
        scanned = f"surface of {len(condition.surfaces)} of {condition.replicates} piles{cells}"
        yield f"whole pile: {scanned}: {profile} numbers of its profile and {surface} of its surface"
    elif offer == PROFILE:
        yield f"whole pile: heights over the radius: {profile} numbers of its profile; a scan would add {surface}"
    else:
        only = "one scalar" if scalars == 1 else f"{scalars} scalars"
        yield f"whole pile: no more than {only}; a scan would add {profile + surface} numbers"


def _number_of_values(observation: Observation) -> int:
    return int(np.isfinite(observation.values).sum())


def _mean_and_sd(observation: Observation) -> tuple[str, str]:
    """Of a scalar; of a curve the range of its values, and the SD over replicates, root mean square over places."""
    values = observation.values[np.isfinite(observation.values)]
    if observation.x is not None:
        span = f"{observation.x.size} places, {values.min():.4g} … {values.max():.4g}"
        repeated = np.isfinite(observation.values).sum(axis=0) >= 2
        if not repeated.any():
            return span, _stated(observation)
        variance = np.nanvar(observation.values[:, repeated], axis=0, ddof=1)
        return span, f"{np.sqrt(variance.mean()):.3g}"
    if values.size >= 2:
        return f"{values.mean():.5g}", f"{values.std(ddof=1):.3g}"
    return f"{values.mean():.5g}" if values.size else "-", _stated(observation)


def _stated(observation: Observation) -> str:
    return "-" if observation.uncertainty is None else f"{observation.uncertainty:g} (stated)"


def _condition_result(condition: Condition) -> dict[str, Any]:
    features = feature_set(condition)
    return {
        "name": condition.name,
        "role": condition.role,
        "rig": condition.scene.rig.name,
        "replicates": condition.replicates,
        "observations": plain(condition.observations),
        "pile": {
            "offered": offer_of(condition),
            "scanned": sorted(condition.surfaces),
            "resolution_m": resolution(condition),
            "features": {"scalars": features.scalars, "profile": features.profile, "surface": features.surface},
        },
    }


def _parameters_text(measurement: Measurement) -> str:
    if not measurement.parameters:
        return f"{CALIBRATED}: none"
    rows = [
        (p.path, p.unit, f"{p.low:g}", f"{p.high:g}", _or_dash(p.mean), _or_dash(p.sd)) for p in measurement.parameters
    ]
    return text_table((CALIBRATED, "unit", "low", "high", "mean", "SD"), rows)


def _cross_check_text(measurement: Measurement) -> str:
    rows = [
        (c.condition, c.observable, c.unit, f"{c.ours:.5g}", f"{c.theirs:.5g}", f"{c.rms:.2g}")
        for c in measurement.cross_check
    ]
    head = "computed here from raw data, beside what the table says (mean; RMS difference of single values)"
    return head + "\n" + text_table(("condition", "observable", "unit", "ours", "table", "RMS"), rows)


def _reach_text(reach: Reach) -> str:
    return "\n".join(_reach_lines(reach))


def _reach_lines(reach: Reach) -> Iterator[str]:
    yield f"{reach.equations} summaries with a spread in the fitted conditions, {reach.unknowns} {CALIBRATED}"
    for name, there in (
        ("discharge", reach.has_discharge),
        ("asymmetry", reach.has_asymmetry),
        ("holdout", reach.has_holdout),
    ):
        yield f"{name}: {'yes' if there else 'no'}"
    yield f"effects that nothing here could reveal: {', '.join(reach.hidden_effects) or 'none of the known ones'}"
    rows = [
        (c.condition, r.summary, r.unit, f"{r.mean:.5g}", f"{r.standard_error:.2g}", f"{r.half_width:.2g}")
        for c in reach.conditions
        for r in c.resolutions
    ]
    yield text_table(("condition", "summary", "unit", "mean", "SE", "± 95 %"), rows)


def _listed(kind: str, lines: tuple[str, ...]) -> str:
    return "\n".join(f"{kind}: {line}" for line in lines)


def _or_dash(number: float | None) -> str:
    return "-" if number is None else f"{number:g}"
