"""The answer of a race: gates 2 and 3 on single effects, pairs where no single one is adequate, and the names.

Effects that held-out data rule out (held_out.py) leave the answer, not the race: what the fitted data say of them
stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from doe.diagnose.decision.gates import Adequacy, Gate, Limits, adequate, unambiguous
from doe.diagnose.decision.race import Race, race_pairs
from doe.diagnose.decision.rivals import told_apart
from doe.diagnose.decision.specificity import specific
from doe.diagnose.decision.tables import listed
from doe.diagnose.decision.verdict import Signature
from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.fitting.calibrate import Evidence, Fit
from doe.diagnose.fitting.signatures import Whitening


@dataclass(frozen=True)
class Conclusion:
    """What the race ended with: kind, named models (best first), sentence, further gates, the final fit and its
    refits, the pairs where they were raced, and the effects that held-out data took out of the answer.
    """

    kind: str
    names: tuple[str, ...]
    statement: str
    gates: tuple[Gate, ...]
    final: Fit
    adequacy: Adequacy | None
    pairs: Race | None = None
    ruled_out: tuple[str, ...] = ()


def nothing_missing(base: Fit) -> Conclusion:
    """Return the answer where gate 1 sees no residual."""
    text = "The calibrated base model explains the data within their noise."
    return Conclusion("no_missing_effect", (), text, (), base, None)


def conclude(
    emulator: Emulator,
    evidence: Evidence,
    base: Fit,
    race: Race,
    raced: list[int],
    signatures: Signature,
    frame: Whitening,
    limits: Limits,
    bootstrap: int,
    seed: int,
    ruled_out: Sequence[str],
) -> Conclusion:
    """Return what gates 2 and 3 say of the single effects, and of pairs where no single one is adequate."""
    if not race.fits:
        text = "The data hold more than noise, and no simulated effect could be seen by them."
        return Conclusion("unexplained", (), text, (), base, None)
    fit = race.fits[race.best]
    adequacy = adequate(emulator, evidence, fit, race.best, limits, bootstrap, seed + 1)
    if adequacy.gate.passed:
        near, apart = _near(emulator, evidence, race, limits, seed + 4)
        so_far = (adequacy.gate, *apart)
        return _answer(emulator, evidence, race, near, ruled_out, so_far, adequacy, limits, bootstrap, seed + 5)
    pairs = race_pairs(emulator, evidence, base, fit, raced)
    asked = [adequacy.gate]
    if pairs.fits:
        gain = race.criteria[race.best] - pairs.criteria[pairs.best]
        label = f"pair gain of {pairs.best} over {race.best}"
        passed = gain > limits.pair_gain
        asked.append(Gate(label, gain, None, limits.pair_gain, passed, f"{pairs.best} is {gain:.1f} better"))
        if passed:
            both = adequate(emulator, evidence, pairs.fits[pairs.best], pairs.best, limits, bootstrap, seed + 2)
            asked.append(both.gate)
            final = pairs.fits[pairs.best]
            asked.append(specific(emulator, base, final, pairs.best, signatures, frame, limits, seed + 3))
            if both.gate.passed and asked[-1].passed:
                near, gates = _near(emulator, evidence, pairs, limits, seed + 4)
                if len(near) == 1:
                    return Conclusion(*_named("effects", near), (*asked, *gates), final, both, pairs)
                # So many pairs are asked that some fit anything: one among several is no evidence.
                text = f"No single effect explains it, and more than one pair would: {listed(near)}."
                return Conclusion("unexplained", (), text, (*asked, *gates), fit, None, pairs)
    text = "The data hold more than noise, and none of the effects in the race explains it."
    return Conclusion("unexplained", (), text, tuple(asked), fit, None, pairs)


def _answer(
    emulator: Emulator,
    evidence: Evidence,
    race: Race,
    near: tuple[str, ...],
    ruled_out: Sequence[str],
    gates: tuple[Gate, ...],
    adequacy: Adequacy,
    limits: Limits,
    bootstrap: int,
    seed: int,
) -> Conclusion:
    """Return the answer with the names that the fitted data leave, less those that held-out data rule out.

    The fitted data have to bear the first one that is left by itself, else all stay.
    """
    left = tuple(name for name in near if name not in ruled_out) or near
    if left[0] != near[0]:
        other = adequate(emulator, evidence, race.fits[left[0]], left[0], limits, bootstrap, seed)
        gates = (*gates, other.gate)
        left, adequacy = (left, other) if other.gate.passed else (near, adequacy)
    gone = tuple(name for name in near if name not in left)
    return Conclusion(*_named("effect", left, gone), gates, race.fits[left[0]], adequacy, ruled_out=gone)


def _near(
    emulator: Emulator, evidence: Evidence, race: Race, limits: Limits, seed: int
) -> tuple[tuple[str, ...], tuple[Gate, Gate]]:
    """Return the best model with those that come too near or cannot be rejected, best first, and gates 3 and 4."""
    gap, near = unambiguous(race.criteria, limits)
    apart, staying = told_apart(emulator, evidence, race.fits, race.criteria, limits, seed)
    names = sorted({*near, *staying}, key=lambda name: race.criteria[name])
    return tuple(names), (gap, apart)


def _named(prefix: str, near: tuple[str, ...], ruled_out: tuple[str, ...] = ()) -> tuple[str, tuple[str, ...], str]:
    """Return kind, names and sentence for the models that are left of those within the gap."""
    but = f" The fitted data left {listed(ruled_out)} as well, which the held-out data rule out." if ruled_out else ""
    if len(near) > 1:
        return f"ambiguous:{','.join(near)}", near, f"{listed(near)}: the data cannot tell which.{but}"
    statement = f"{near[0]} explains what the base model cannot{but and '.'}{but or ', and nothing else comes near.'}"
    return f"{prefix}:{near[0]}", near, statement
