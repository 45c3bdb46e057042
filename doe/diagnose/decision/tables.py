"""Tables of a verdict from fits: amplitudes, parameters, residuals, signatures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from doe.diagnose.decision.verdict import AmplitudeEstimate, FittedModel, ParameterChange, Residual, Signature
from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.emulation.tails import Tails
from doe.diagnose.fitting.calibrate import Evidence, Fit
from doe.diagnose.fitting.signatures import Reach, Whitening, cosine, projected, shift_of
from doe.diagnose.runs import Declared

FloatArray = npt.NDArray[np.float64]


def amplitude_estimates(
    declared: Declared, fit: Fit, refits: FloatArray | None = None
) -> tuple[AmplitudeEstimate, ...]:
    """Return the amplitudes of a fit in natural units. refits: (B, q) coded bootstrap refits of the same model."""
    estimates, place = [], fit.predictor.parameters
    for e in fit.members:
        effect = declared.effects[e]
        for index in range(effect.amplitudes):
            scale = effect.scale[index]
            error = float(np.sqrt(fit.covariance[place, place]))
            ends = fit.x[place] + 1.96 * error * np.array([-1, 1])
            if refits is not None:
                ends = np.percentile(refits[:, place], [2.5, 97.5])
            low, high = np.clip(ends, fit.predictor.low[place], fit.predictor.high[place]) * scale
            value = float(fit.x[place] * scale)
            estimates.append(
                AmplitudeEstimate(
                    effect.name, index, value, error * scale, float(low), float(high), int(fit.at_edge[place])
                )
            )
            place += 1
    return tuple(estimates)


def fitted_model(declared: Declared, label: str, fit: Fit, criterion: float) -> FittedModel:
    """Return a fit in natural units."""
    values = tuple(p.natural(float(x)) for p, x in zip(declared.parameters, fit.x, strict=False))
    amplitudes = amplitude_estimates(declared, fit)
    return FittedModel(label, fit.members, fit.x, fit.covariance, values, amplitudes, fit.t2, fit.df, criterion)


def parameter_changes(declared: Declared, before: Fit, after: Fit) -> tuple[ParameterChange, ...]:
    """Return the calibrated parameters of two fits in natural units."""
    rows = []
    for i, parameter in enumerate(declared.parameters):
        half = (parameter.high - parameter.low) / 2
        errors = [float(np.sqrt(fit.covariance[i, i])) for fit in (before, after)]
        pulls = [
            2 * abs(float(fit.slope[i])) * e if fit.at_edge[i] else 0.0
            for fit, e in zip((before, after), errors, strict=True)
        ]
        rows.append(
            ParameterChange(
                name=parameter.name,
                low=parameter.low,
                high=parameter.high,
                before=parameter.natural(float(before.x[i])),
                before_standard_error=errors[0] * half,
                edge_before=int(before.at_edge[i]),
                pull_before=pulls[0],
                after=parameter.natural(float(after.x[i])),
                after_standard_error=errors[1] * half,
                edge_after=int(after.at_edge[i]),
                pull_after=pulls[1],
            )
        )
    return tuple(rows)


def residual_table(declared: Declared, evidence: Evidence, before: Fit, after: Fit) -> tuple[Residual, ...]:
    """Return every summary with both residuals in units of its sigma."""
    measured = np.concatenate(evidence.means)
    left = [np.concatenate(fit.residual) for fit in (before, after)]
    sigma = [np.sqrt(np.concatenate([np.diag(block) for block in fit.sigma])) for fit in (before, after)]
    return tuple(
        Residual(
            label,
            float(measured[i]),
            float(measured[i] - left[0][i]),
            float(measured[i] - left[1][i]),
            float(left[0][i] / sigma[0][i]),
            float(left[1][i] / sigma[1][i]),
        )
        for i, label in enumerate(declared.labels)
    )


def as_read(residuals: tuple[Residual, ...], tails: Tails) -> tuple[Residual, ...]:
    """Return the table with values as they are read: h^-1 of a mean of h (tails.py)."""
    values = np.array([(row.measured, row.before, row.after) for row in residuals]).T
    return tuple(
        replace(row, measured=measured, before=before, after=after)
        for row, (measured, before, after) in zip(residuals, tails.natural(values).T.tolist(), strict=True)
    )


def where_the_residual_sits(declared: Declared, fit: Fit) -> tuple[str, ...]:
    """Return per condition, worst first, its part of T^2 and the summary that is furthest off."""
    rows = []
    for condition, residual, sigma in zip(declared.conditions, fit.residual, fit.sigma, strict=True):
        part = float(residual @ np.linalg.solve(sigma, residual))
        z = residual / np.sqrt(np.diag(sigma))
        worst = int(np.argmax(np.abs(z)))
        furthest = f"{condition.summaries[worst]} ({z[worst]:+.1f} sigma)"
        text = f"{condition.name}: T2 {part:.1f} of {len(z)} summaries, most in {furthest}"
        rows.append((part, text))
    return tuple(text for _, text in sorted(rows, key=lambda row: -row[0]))


def signature_table(
    emulator: Emulator, base: Fit, singles: Mapping[int, Fit], reaches: Mapping[int, Reach], frame: Whitening
) -> Signature:
    """Return the residual and the signatures at the fitted amplitudes (at full reach where the fit is zero)."""
    k = base.predictor.parameters
    residual = projected(frame, np.concatenate(base.residual))
    vectors = []
    for e, fit in singles.items():
        amplitude = fit.x[k:]
        z = (
            projected(frame, shift_of(emulator, e, base.x[:k], amplitude))
            if np.abs(amplitude).max() > 1e-6
            else reaches[e].signature
        )
        size = np.linalg.norm(z)
        vectors.append(z / size if size > 0 else z)
    stacked = np.array(vectors).reshape(-1, len(residual))
    return Signature(
        residual=residual,
        names=tuple(emulator.declared.effects[e].name for e in singles),
        vectors=stacked,
        cosines=_cosines(stacked, stacked),
        residual_cosine=_cosines(stacked, residual[None])[:, 0],
    )


def _cosines(rows: FloatArray, columns: FloatArray) -> FloatArray:
    return np.array([[cosine(one, other) for other in columns] for one in rows]).reshape(len(rows), len(columns))


def listed(names: Sequence[str]) -> str:
    """Return "a", "a or b" or "a, b or c"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
