"""The corrected model as a material file that every command takes, and as a study that calibrates it with its effect.

The study's factors are the declared parameters within their measured ranges and the amplitudes of the named effects
within their 95 % intervals. Its targets are numbers of the first fitted condition, each with the declared model's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import tomlkit

from doe.diagnose.diagnosis import Diagnosis
from doe.measurement.measurement import Condition, Measurement
from doe.measurement.summaries import replicates_of
from doe.studies.study import CALIBRATED
from explorer.diagnosis.piles import model_scene
from explorer.diagnosis.result import SHORT_PROFILE
from explorer.scene.text import material_toml
from solver import EFFECTS, OBSERVABLES, Scene, observable_names, parameters, value

SHORT = {"pilot_runs": 6, "change_runs": 3, "ascent_replicates": 1, "verification_runs": 6} | {
    f"{part}_replicates": 1 for part in ("screening", "assumption", "scan", "surface")
}
"""Numbers of runs in the profile ``SHORT_PROFILE``."""
TARGETS = 2
"""Maximum number of targets of the study: each takes part in every stage."""


def corrected_toml(measurement: Measurement, diagnosis: Diagnosis) -> str:
    """The final model of ``diagnosis`` in the set-up of the first fitted condition.

    The parameters are those of its fit. ``[effect.<name>]`` holds the effect that the verdict names (both of a pair).
    For an ambiguous verdict this is the most probable effect, and the heading says that it is not established. If the
    verdict names nothing, or held-out data took the name back, the file holds the calibrated declared model.
    """
    condition, verdict = measurement.fit[0].name, diagnosis.verdict
    one_of = ""
    if verdict.names and verdict.kind.startswith("ambiguous"):
        one_of = f"\nNOT ESTABLISHED: this is {verdict.names[0]}, one of several answers."
    heading = (
        f"{measurement.title or measurement.folder.name}: {verdict.kind}\n"
        f"{verdict.statement}{one_of}\n"
        f"Set-up of condition {condition}; parameters of the final fit. SI."
    )
    return material_toml(corrected_scene(measurement, diagnosis), heading)


def study_toml(measurement: Measurement, diagnosis: Diagnosis, material: str) -> str:
    """The study that calibrates the corrected model in the file ``material``; "" if no effect is named.

    Also empty if fewer than three parameters and amplitudes can be varied, or no number of the first fitted condition
    can be a target.
    """
    verdict, scene, condition = diagnosis.verdict, corrected_scene(measurement, diagnosis), measurement.fit[0]
    factors, targets = _factors(measurement, diagnosis, scene), _targets(condition, diagnosis, scene)
    if not verdict.kind.startswith("effect") or len(factors) < CALIBRATED or not targets:
        return ""
    profile = {"mass": float(value(scene, "rig.mass"))} if "rig.mass" in parameters(scene) else {}
    named = " with ".join(verdict.names[0].split("+"))
    table = {
        "format": 1,
        "title": f"{measurement.title or measurement.folder.name}, with {named}",
        "material": material,
        # The amplitudes are the last factors, so what the diagnosis added is always calibrated.
        "fallback": [factor["name"] for factor in factors[-CALIBRATED:]],
        "target": targets,
        "factor": factors,
        "profile": {SHORT_PROFILE: profile | SHORT, "standard": profile},
    }
    return (
        f"# {named} beside the declared parameters, calibrated against condition {condition.name}. SI.\n"
        "# before_mean: what the declared model gave, calibrated without it, by fresh pours.\n" + tomlkit.dumps(table)
    )


def _factors(measurement: Measurement, diagnosis: Diagnosis, scene: Scene) -> list[dict[str, Any]]:
    ranges = {
        one.path: (box.low, box.high)
        for one, box in zip(measurement.parameters, diagnosis.declared.parameters, strict=True)
    }
    for row in diagnosis.verdict.effects[:1]:
        for one in row.amplitudes:
            path = f"effect.{one.effect}.{EFFECTS[one.effect].amplitudes[one.index]}"
            ranges[path] = (one.low, one.high)
    found: list[dict[str, Any]] = []
    for path, (low, high) in ranges.items():
        known, reference = parameters(scene)[path], float(value(scene, path))
        low, high = max(low, known.low), min(high, known.high)
        if low < high:
            reference = min(high, max(low, reference))
            name = f"X{len(found) + 1}"
            found.append({"name": name, "path": path, "low": low, "high": high, "reference": reference})
    return found


def _targets(condition: Condition, diagnosis: Diagnosis, scene: Scene) -> list[dict[str, Any]]:
    """The angle of repose, if possible, then the numbers that the declared model missed most; ``TARGETS`` at most.

    A single replicate is taken with the uncertainty stated for it.
    """
    measured = replicates_of(condition)
    rows, names = measured.values, measured.summaries
    before = diagnosis.before.blocks[[one.name for one in diagnosis.conditions].index(condition.name)]
    if len(rows) < 1 or len(before) < 2:
        return []
    sd = measured.deviation
    missed = np.abs(before.mean(axis=0) - rows.mean(axis=0)) / np.where(sd > 0.0, sd, np.inf)
    given = set(observable_names(scene))
    allowed = [
        k
        for k, (name, mean) in enumerate(zip(names, rows.mean(axis=0), strict=True))
        if name in given and sd[k] > 0.0 and OBSERVABLES[name].is_possible(float(mean))
    ]
    order = sorted(allowed, key=lambda k: (names[k] != "angle_of_repose_deg", -missed[k]))
    return [
        {
            "observable": names[k],
            "mean": float(rows[:, k].mean()),
            **({} if measured.alone else {"n": len(rows)}),
            "sd": float(sd[k]),
            "sd_source": "stated" if measured.alone else "measured",
            "margin": float(sd[k]),
            "before_mean": float(before[:, k].mean()),
            "before_sd": float(before[:, k].std(ddof=1)),
            "before_n": len(before),
        }
        for k in order[:TARGETS]
    ]


def corrected_scene(measurement: Measurement, diagnosis: Diagnosis) -> Scene:
    """The scene that :func:`corrected_toml` writes."""
    model = (diagnosis.after if diagnosis.verdict.names else diagnosis.before).model
    return model_scene(measurement, measurement.fit[0], model)
