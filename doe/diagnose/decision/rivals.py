"""Gate 4: would a rival, if it were the truth, often let the best model fit better by as much as it does?

Signatures of two effects may be nearly parallel, and each is known only as well as the emulator knows it; then a gap of
T^2 says less than it seems to. So every rival is put to the test by itself (Cox 1962, J. R. Stat. Soc. B 24:406, with
the parametric bootstrap of Williams 1970, Biometrics 26:23):

    lead = T^2(rival) - T^2(best), both under the rival's Sigma;   p = P(lead of pseudo-data of the rival >= lead)

Pseudo-data carry the error of the rival's emulation, both models are refitted to them. The best model is known as
badly: it meets the same pseudo-data with an error of its own. And the errors of both make two models look farther apart
than they are, by d^2 = r' Sigma^-1 r, where r is what the best model leaves of the rival's prediction:

    E d^2 = (true d)^2 + tr(P C),   C the covariance of r, P = Sigma^-1 less what a refit takes up,

so r is drawn in to r sqrt(max(0, 1 - tr(P C)/d^2)) (James and Stein 1961). A rival with p above the limit stays in the
answer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from doe.diagnose.decision.gates import Gate, Limits, bootstrap_p, refit
from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.emulation.predictor import Predictor
from doe.diagnose.fitting.calibrate import Evidence, Fit, fit_with_covariance
from doe.diagnose.fitting.pseudo_data import PseudoData, draw_pseudo_data, gaussian

FloatArray = npt.NDArray[np.float64]

SETS = 400
"""Pseudo-data sets per rival: p = 0.05 with a standard error of 0.011."""
FAR = 40.0
"""Gap in the criterion beyond which a rival is not asked: its lead would have to be a 6 sigma event."""


def told_apart(
    emulator: Emulator,
    evidence: Evidence,
    fits: Mapping[str, Fit],
    criteria: Mapping[str, float],
    limits: Limits,
    seed: int,
) -> tuple[Gate, tuple[str, ...]]:
    """Return the gate and the rivals that the data cannot reject, nearest first. criteria: name -> B of gates.py."""
    order = sorted(criteria, key=lambda name: criteria[name])
    best, k = fits[order[0]], fits[order[0]].predictor.parameters
    found: dict[str, float] = {}
    for number, name in enumerate(order[1:]):
        if criteria[name] - criteria[order[0]] > FAR:
            break
        rival = fits[name]
        pseudo = draw_pseudo_data(emulator, evidence, rival, SETS, seed + number)
        own = refit(rival.predictor, pseudo, evidence, rival.x)[1]
        seen = met_by(best, rival, pseudo, emulator, evidence, seed + number)
        others = refit(best.predictor, seen, evidence, rival.x[:k])[1]
        lead = rival.t2 - fit_with_covariance(best.predictor, best.members, evidence, rival.sigma).t2
        found[name] = bootstrap_p(lead, own - others)
    stay = tuple(name for name, p in found.items() if p > limits.rival)
    label = f"told apart: {order[0]}"
    if not found:
        return Gate(label, 0.0, None, limits.rival, True, "no rival comes near"), ()
    hardest = max(found, key=lambda name: found[name])
    statement = (
        f"were {hardest} the truth, {order[0]} would fit better by as much in {100 * found[hardest]:.1f} % of data sets"
    )
    return Gate(label, found[hardest], found[hardest], limits.rival, not stay, statement), stay


def met_by(best: Fit, rival: Fit, pseudo: PseudoData, emulator: Emulator, evidence: Evidence, seed: int) -> PseudoData:
    """Return the rival's pseudo-data as the best model meets them: off by its own error of emulation, and nearer."""
    near = nearest(best, rival, evidence)
    alike, rests = error_beside(near.predictor, near.x, rival.predictor, rival.x, emulator)
    theirs = rival.predictor.mean_covariance(rival.x)
    apart = [rest + (1.0 - part) ** 2 * error for rest, part, error in zip(rests, alike, theirs, strict=True)]
    off = 1.0 - drawn_in(near, apart, evidence.prior_weight)
    generator = np.random.default_rng([seed, 1])
    means = tuple(
        mean - (1.0 - part) * error + gaussian(rest, len(mean), generator) - off * r
        for mean, error, part, rest, r in zip(pseudo.means, pseudo.emulation, alike, rests, near.residual, strict=True)
    )
    return replace(pseudo, means=means)


def nearest(best: Fit, rival: Fit, evidence: Evidence) -> Fit:
    """Return the best model fitted to what the rival predicts; its residual is what it leaves of that."""
    fitted = tuple(mean - r for mean, r in zip(evidence.means, rival.residual, strict=True))
    there = replace(evidence, means=fitted, prior_mean=rival.x[: rival.predictor.parameters])
    return fit_with_covariance(best.predictor, best.members, there, rival.sigma)


def error_beside(
    one: Predictor, x: FloatArray, other: Predictor, y: FloatArray, emulator: Emulator
) -> tuple[list[float], list[FloatArray]]:
    """Return per condition how far the error of ``one`` at x goes with that of ``other`` at y, and what else it has.

    As far as both rest on the same coefficients: e = e_other cov/var(e_other) + rest.
    """
    shared = emulator.shared_shares(one, x, other, y)
    alike = [s / share if share > 0.0 else 0.0 for s, share in zip(shared, other.variance_shares(y), strict=True)]
    own = zip(one.variance_shares(x), alike, shared, one.pour_covariance, one.bias_variance(x), strict=True)
    return alike, [max(0.0, share - part * s) * pour + np.diag(bias) for share, part, s, pour, bias in own]


def drawn_in(near: Fit, apart: Sequence[FloatArray], prior_weight: FloatArray) -> float:
    """Return sqrt(max(0, 1 - tr(P C)/d^2)): r is the residual of ``near``, C per condition ``apart``.

    prior_weight: (k,) of the parameters, which a refit pays for.
    """
    weight = block_diag(*(np.linalg.inv(block) for block in near.sigma))
    residual, covariance = np.concatenate(near.residual), block_diag(*apart)
    free = near.at_edge == 0
    slopes = near.predictor.jacobian(near.x)[:, free]
    prior = np.concatenate([prior_weight, np.zeros(len(near.x) - len(prior_weight))])[free]
    taken_up = weight @ slopes
    p = weight - taken_up @ np.linalg.pinv(slopes.T @ taken_up + np.diag(prior), hermitian=True) @ taken_up.T
    d2 = float(residual @ weight @ residual)
    return math.sqrt(max(0.0, 1.0 - float(np.trace(p @ covariance)) / d2)) if d2 > 0.0 else 0.0
