"""Gate 4: would a rival, if it were the truth, often let the best model fit better by as much as it does?

Signatures of two effects may be nearly parallel, and each is known only as well as the emulator knows it; then a gap of
T^2 says less than it seems to. So every rival is put to the test by itself (Cox 1962, J. R. Stat. Soc. B 24:406, with
the parametric bootstrap of Williams 1970, Biometrics 26:23):

    lead = T^2(rival) - T^2(best), both under the rival's Sigma;   p = P(lead of pseudo-data of the rival >= lead)

Pseudo-data carry the error of the rival's emulation, both models are refitted to them. A rival with p above the limit
stays in the answer.
"""

from __future__ import annotations

from collections.abc import Mapping

from doe.diagnose.decision.gates import Gate, Limits, bootstrap_p, refit
from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.fitting.calibrate import Evidence, Fit, fit_with_covariance
from doe.diagnose.fitting.pseudo_data import draw_pseudo_data

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
        others = refit(best.predictor, pseudo, evidence, rival.x[:k])[1]
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
