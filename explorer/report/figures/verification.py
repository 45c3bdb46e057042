"""Chart of the verification: fresh pours against the measurement."""

from __future__ import annotations

from doe.runs import valid_values
from doe.stages.verification import VerificationResult
from explorer.report.content import Spec
from explorer.report.figures.style import (
    FACTOR,
    MARGIN_BAND,
    TARGET,
    Json,
    axis,
    chart,
    error_bars,
    horizontal_band,
    points,
)
from explorer.units import observable_title, unit_of_observable

MEASURED = 1.0
SIMULATED = 2.0


def verification(stage: VerificationResult, index: int) -> Spec:
    """Fresh pours as points, their mean and the measured mean with 95 % intervals, the margin as a band."""
    target, tests = stage.targets[index], stage.tests[index]
    unit = unit_of_observable(target.observable)
    pours = [unit.of(value) for value in valid_values(stage.runs, target.observable)]
    # Spread over a strip so that equal values stay visible; the place across means nothing.
    places = [SIMULATED + 0.14 + 0.22 * k / max(1, len(pours) - 1) for k in range(len(pours))]
    traces = [points(places, pours, "fresh pours", FACTOR, marker={"size": 7, "opacity": 0.6})]
    for name, x, sample, colour in (
        ("measured mean, 95 % interval", MEASURED, tests.target, TARGET),
        ("simulated mean, 95 % interval", SIMULATED, tests.simulated, FACTOR),
    ):
        bars: Json = error_bars([unit.of(sample.half_width)], colour)
        bars["width"] = 9
        diamond = {"size": 12, "symbol": "diamond"}
        traces.append(points([x], [unit.of(sample.mean)], name, colour, marker=diamond, error_y=bars))
    mean, margin = unit.of(target.mean), unit.of(target.margin)
    layout: Json = {
        "xaxis": axis("", range=[0.5, 2.75], tickvals=[MEASURED, SIMULATED + 0.12], ticktext=["measured", "simulated"]),
        "yaxis": axis(observable_title(target.observable)),
        "shapes": [horizontal_band(mean - margin, mean + margin, MARGIN_BAND)],
    }
    return chart(traces, layout, 400)
