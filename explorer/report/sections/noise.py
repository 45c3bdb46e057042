"""The pilot: noise of one pour per estimator, and which estimator the screening reads."""

from __future__ import annotations

import math
from collections.abc import Sequence

from doe.analysis.pilot import BIAS_LIMIT_DEG, EstimatorChoice, Separation
from doe.stages.pilot import PilotResult, StageSize
from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Bullets, Figure, Section, Table, Text
from explorer.report.figures.noise import noise_of_estimators
from explorer.units import MISSING, fixed, observable_label, observed, p_value, percent, signed, unit_of_observable


def noise(result: StudyResult) -> Section:
    """σ, d′ and bias of every estimator, the choice, and what replicates resolve."""
    pilot = result.pilot
    target = result.study.targets[0].observable
    text = f"The screening reads {observable_label(pilot.estimator)}."
    if pilot.choice is not None:
        text = f"{text} {_choice(pilot.choice)}"
    text += f" Ascent, surface and verification are always compared with the measurement in {observable_label(target)}."
    blocks: list[Block] = [
        Text(text),
        Figure(
            "noise",
            noise_of_estimators(pilot),
            "Whiskers: 95 % intervals; bias: the range over the ways to fill a cone with bodies. Red: read by the "
            "screening.",
        ),
        _estimators(pilot),
        Table(
            ("runs per mean", "difference of two means", "main effect", "main effect, all factors at once"),
            tuple(
                (
                    str(row.replicates),
                    observed(target, row.difference),
                    observed(target, row.main_effect),
                    observed(target, row.main_effect_bonferroni),
                )
                for row in pilot.resolutions
            ),
            f"What replicates resolve in {observable_label(target)}, chance 0.8 at level 0.05; main effects in the "
            f"{result.screening.analysis.rows}-run design.",
        ),
    ]
    spread = pilot.equal_variance
    if spread is not None and math.isfinite(spread.p):
        sigmas = ", ".join(f"{name}: {observed(target, sigma)}" for name, sigma in spread.sigmas)
        blocks.append(
            Text(
                f"Spread of {observable_label(target)} by setting – {sigmas}. Equal spread, Brown–Forsythe: "
                f"p = {p_value(spread.p)}."
            )
        )
    if pilot.sizes:
        blocks.append(_sizes(pilot.sizes))
    if pilot.notes:
        blocks.append(Bullets(pilot.notes))
    return Section("Noise of one pour", tuple(blocks))


def _estimators(pilot: PilotResult) -> Table:
    choice, bias = pilot.choice, pilot.estimator_bias
    changes = [] if choice is None else list(dict.fromkeys(s.change for s in choice.separations))
    seen = {} if choice is None else {(s.estimator, s.change): s for s in choice.separations}
    rows = []
    for name, spread in pilot.noise.items():
        separations = [seen.get((name, change)) for change in changes]
        rows.append(
            (
                observable_label(name),
                observed(name, spread.mean),
                f"{observed(name, spread.sigma)} ({observed(name, spread.low)} … {observed(name, spread.high)})",
                *(_separation(found) for found in separations),
                _bias_range(name, bias[name]) if name in bias else MISSING,
            )
        )
    header = ("estimator", "mean", "σ (95 %)", *(f"d′ {change} (95 %)" for change in changes), "bias on made-up piles")
    caption = (
        f"{next(iter(pilot.noise.values())).runs} seeds at the reference setting. Bias: its range over what it "
        "may mean that bodies fill a cone (centre, half or all of a body inside); an estimator is left out only if it "
        f"misses by more than {BIAS_LIMIT_DEG:g}° under every reading."
    )
    return Table(header, tuple(rows), caption)


def _separation(found: Separation | None) -> str:
    """Signed d′ with its interval; an observable of another kind than the target's was not compared."""
    if found is None:
        return MISSING
    return f"{signed(found.d_prime)} ({signed(found.low)} … {signed(found.high)})"


def _bias_range(name: str, readings: Sequence[tuple[float, float]]) -> str:
    """ "−0.2° … +20.9°" from the (mean, standard error) of each reading."""
    unit = unit_of_observable(name)
    means = [unit.of(mean) for mean, _ in readings if math.isfinite(mean)]
    return unit.attach(f"{signed(min(means), 1)} … {signed(max(means), 1)}") if means else MISSING


def _choice(choice: EstimatorChoice) -> str:
    """Why the screening reads what it reads."""
    own, best = observable_label(choice.default), observable_label(choice.best)
    if choice.default in choice.excluded:
        text = f"The target's own, {own}, is left out for its bias; of the others this one has the largest mean d′."
    elif choice.best == choice.default:
        text = "It is the target's own, and its mean d′ (shift under a declared change ÷ σ) is the largest."
    else:
        share = percent(choice.share_better)
        kept = choice.chosen == choice.default
        text = (
            f"The mean d′ (shift under a declared change ÷ σ) of {best} exceeds that of {own}, the target's own, in "
            f"{share} of the resampled pilots; 95 % are asked for"
        ) + (", so the target's own is kept." if kept else ".")
    if choice.excluded:
        text += f" Left out for their bias on made-up piles: {', '.join(map(observable_label, choice.excluded))}."
    return text


def _sizes(sizes: Sequence[StageSize]) -> Table:
    rows = tuple((s.stage, str(s.needed), str(s.taken), f"{fixed(s.wanted)}°", f"{fixed(s.resolved)}°") for s in sizes)
    header = ("stage", "pours per row needed", "taken", "wanted", "resolved")
    caption = "Sizes from the pilot's noise, chance 0.8 at level 0.05; two-level designs for all factors at once."
    return Table(header, rows, caption)
