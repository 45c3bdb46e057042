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
    fits, adequacy, asked = _first_adequate(emulator, evidence, race, limits, bootstrap, seed + 1)
    if fits and adequacy:
        return _answer(emulator, evidence, fits, ruled_out, asked, adequacy, limits, bootstrap, seed + 4)
    fit = race.fits[race.best]
    pairs = race_pairs(emulator, evidence, base, fit, raced)
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


def _first_adequate(
    emulator: Emulator, evidence: Evidence, race: Race, limits: Limits, bootstrap: int, seed: int
) -> tuple[Race | None, Adequacy | None, list[Gate]]:
    """Return the race from the first single effect on that passes gate 2, with that and what was asked; None if none.

    In order of the criterion. What fits worse than one that does not fit is not asked.
    """
    asked: list[Gate] = []
    rest = race
    while rest.fits:
        label = rest.best
        if all(rest.fits[label].t2 < gate.statistic for gate in asked):
            found = adequate(emulator, evidence, rest.fits[label], label, limits, bootstrap, seed)
            asked.append(found.gate)
            if found.gate.passed:
                return rest, found, asked
        rest = rest.without((label,))
    return None, None, asked


def _answer(
    emulator: Emulator,
    evidence: Evidence,
    race: Race,
    ruled_out: Sequence[str],
    asked: Sequence[Gate],
    adequacy: Adequacy,
    limits: Limits,
    bootstrap: int,
    seed: int,
) -> Conclusion:
    """Return the answer with the names that the fitted data leave, less those that held-out data rule out.

    The best one that is left has to fit by itself, else all stay; gates 3 and 4 are asked anew from there.
    """
    near, apart = _near(emulator, evidence, race, limits, seed)
    gates = (*asked, *apart)
    gone, rest = tuple(name for name in near if name in ruled_out), race.without(ruled_out)
    if gone and rest.fits:
        fits_by_itself = adequacy
        if rest.best != race.best:
            fits_by_itself = adequate(emulator, evidence, rest.fits[rest.best], rest.best, limits, bootstrap, seed + 1)
            gates = (*gates, fits_by_itself.gate)
        if fits_by_itself.gate.passed:
            left, again = _near(emulator, evidence, rest, limits, seed + 2)
            named = _named("effect", left, gone)
            return Conclusion(*named, (*gates, *again), rest.fits[rest.best], fits_by_itself, ruled_out=gone)
    return Conclusion(*_named("effect", near), gates, race.fits[race.best], adequacy)


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
