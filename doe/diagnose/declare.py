"""A measurement in the terms of the decision: parameters and effects with their ranges, conditions, measured rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from doe.diagnose.runs import Condition, Declared, Effect, Observed, Parameter
from doe.diagnose.simulation.pours import effect_values
from doe.measurement.measurement import Condition as MeasuredCondition
from doe.measurement.measurement import MeasuredParameter, Measurement
from doe.measurement.summaries import summaries_of_data, summary_names, summary_uncertainties
from solver import EFFECTS, ParameterError, Scene, parameters, with_values

FloatArray = npt.NDArray[np.float64]

BOX = 3.0
"""Standard deviations about an independently measured mean."""
DRAWN_IN = 0.8


def declare(measurement: Measurement, effects: Sequence[str]) -> Declared:
    """The declared model in the terms of the decision: parameters, effects with their widest ranges, conditions."""
    scenes = [condition.scene for condition in measurement.conditions]
    return Declared(
        tuple(box_of(p) for p in measurement.parameters),
        tuple(widest(name, scenes) for name in effects),
        tuple(Condition(c.name, summary_names(c)) for c in measurement.fit),
    )


def widest(name: str, scenes: Sequence[Scene]) -> Effect:
    """The effect from end to end of what the literature supports, drawn in until every scene can be set up with it."""
    kind, known = EFFECTS[name], parameters(scenes[0])
    ends = [known[f"effect.{name}.{field}"] for field in kind.amplitudes]
    low = tuple(max(end.low, -kind.strongest) for end in ends)
    high = tuple(min(end.high, kind.strongest) for end in ends)
    while not all(_possible(scene, name, bounds) for scene in scenes for bounds in (low, high)):
        low, high = tuple(DRAWN_IN * x for x in low), tuple(DRAWN_IN * x for x in high)
    return Effect(name, low, high)


def _possible(scene: Scene, name: str, amplitude: tuple[float, ...]) -> bool:
    try:
        with_values(scene, effect_values(name, amplitude))
    except ParameterError:
        return False
    return True


def box_of(measured: MeasuredParameter) -> Parameter:
    """The range over which a parameter is simulated: as stated, and within ``BOX`` standard deviations of its mean.

    Farther off nobody who trusts the measurement would look, and an emulator of a smaller box is a better one.
    """
    if measured.mean is None or measured.sd is None:
        return Parameter(measured.path, measured.low, measured.high)
    low = max(measured.low, measured.mean - BOX * measured.sd)
    high = min(measured.high, measured.mean + BOX * measured.sd)
    return Parameter(measured.path, low, high, measured.mean, measured.sd)


def observe(conditions: Sequence[MeasuredCondition]) -> Observed:
    """The measured side of ``conditions``; what states no uncertainty of its own has none beside its replicates."""
    stated = [np.nan_to_num(summary_uncertainties(condition)) for condition in conditions]
    blocks = tuple(summaries_of_data(condition) for condition in conditions)
    return Observed(blocks, tuple(stated), tuple(condition.mean_of for condition in conditions))


def complete_rows(condition: MeasuredCondition) -> FloatArray:
    """The measured replicates of which everything could be read, (r, d)."""
    data = summaries_of_data(condition)
    return np.asarray(data[np.isfinite(data).all(axis=1)], dtype=np.float64)
