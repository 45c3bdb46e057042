"""The corrected model as a material file that every command takes."""

from __future__ import annotations

from doe.diagnose.diagnosis import Diagnosis
from doe.measurement.measurement import Measurement
from explorer.scene.text import material_toml
from solver import EFFECTS, Scene, with_values


def corrected_toml(measurement: Measurement, diagnosis: Diagnosis) -> str:
    """The final model of ``diagnosis`` in the set-up of the first fitted condition.

    Parameters are those of its fit; the effect that the verdict names (both of a pair) stands in ``[effect.<name>]``.
    Of an ambiguous verdict it is the most probable effect, and the heading says that it is not established. Where
    nothing is named, or held-out data took it back, it is the calibrated declared model.
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


def corrected_scene(measurement: Measurement, diagnosis: Diagnosis) -> Scene:
    """The scene that :func:`corrected_toml` writes."""
    model = (diagnosis.after if diagnosis.verdict.names else diagnosis.before).model
    values: dict[str, float | str] = dict(zip((p.path for p in measurement.parameters), model.theta, strict=True))
    for effect, amplitudes in model.effects:
        names = EFFECTS[effect].amplitudes
        values |= {f"effect.{effect}.{name}": value for name, value in zip(names, amplitudes, strict=True)}
    return with_values(measurement.fit[0].scene, dict(values))
