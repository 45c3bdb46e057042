"""From runs and data to a verdict: emulate, calibrate, detect, race, and only then name.

Source of the decision rule: the gates of gates.py and rivals.py; effects that the data could not see are not in the
race.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from doe.diagnose.decision.effect_table import effect_rows
from doe.diagnose.decision.freed import freed_parameters
from doe.diagnose.decision.gates import Adequacy, Gate, Limits, adequate, detect, unambiguous
from doe.diagnose.decision.race import Race, race_pairs, race_singles
from doe.diagnose.decision.rivals import told_apart
from doe.diagnose.decision.specificity import specific
from doe.diagnose.decision.tables import (
    amplitude_estimates,
    as_read,
    fitted_model,
    listed,
    parameter_changes,
    residual_table,
    signature_table,
    where_the_residual_sits,
)
from doe.diagnose.decision.verdict import FittedModel, Signature, Verdict
from doe.diagnose.emulation.emulator import Emulator, fit_emulator
from doe.diagnose.emulation.fresh_pours import FreshPours, newest, taught
from doe.diagnose.emulation.tails import heavy_tails
from doe.diagnose.fitting.calibrate import Evidence, Fit, calibrate, fit_with_covariance, gather_evidence
from doe.diagnose.fitting.signatures import Whitening, reach, whitening
from doe.diagnose.runs import Declared, Observed, Runs, select_summaries
from doe.errors import StatisticsError

STANDARD_LIMITS = Limits()


@dataclass(frozen=True)
class Conclusion:
    """What the race ended with: kind, named models (best first), sentence, further gates, the final fit and its
    refits, and the pairs where they were raced.
    """

    kind: str
    names: tuple[str, ...]
    statement: str
    gates: tuple[Gate, ...]
    final: Fit
    adequacy: Adequacy | None
    pairs: Race | None = None


def diagnose(
    declared: Declared,
    runs: Runs,
    observed: Observed,
    bootstrap: int = 1000,
    seed: int = 0,
    limits: Limits = STANDARD_LIMITS,
    fresh: Sequence[FreshPours] = (),
) -> Verdict:
    """Return the verdict on measured data from simulated runs of the declared model.

    observed: the conditions to be fitted only, in the order of declared.conditions; a holdout is judged in holdout.py.
    fresh: pours at best fits of an earlier verdict with the same runs.
    Raises StatisticsError for shapes that disagree, too few runs or bootstrap < 500.
    """
    selected = select_summaries(declared, taught(runs, fresh), observed)
    tails = heavy_tails(selected.declared, selected.runs, selected.observed)
    emulator = fit_emulator(selected.declared, tails.of_runs(selected.runs), selected.floors)
    holding = newest(fresh)
    kept = [[block[:, keep] for block, keep in zip(one.blocks, selected.kept, strict=True)] for one in holding]
    emulator = replace(
        emulator, fresh=tuple(replace(one, blocks=tails.of_pours(b)) for one, b in zip(holding, kept, strict=True))
    )
    measured = tails.of_observed(selected.observed)
    verdict = judge(emulator, measured, bootstrap, seed, limits, selected.dropped, selected.floored)
    return replace(verdict, residuals=as_read(verdict.residuals, tails), drawn_in=tails.labels(selected.declared))


def judge(
    emulator: Emulator,
    observed: Observed,
    bootstrap: int = 1000,
    seed: int = 0,
    limits: Limits = STANDARD_LIMITS,
    dropped: tuple[str, ...] = (),
    floored: tuple[str, ...] = (),
) -> Verdict:
    """Return the verdict from a fitted emulator, which serves any number of data sets of the same conditions.

    Fresh pours at best fits count in the race only. Gate 1 compares effects at amplitudes near zero, where each of them
    is the base model: that holds for the emulator without them.
    """
    if bootstrap < 500:
        raise StatisticsError(f"bootstrap = {bootstrap}; p values near 0.005 need at least 500 sets")
    declared, evidence = emulator.declared, gather_evidence(emulator, observed)
    bare = replace(emulator, fresh=())
    base = calibrate(bare, (), evidence)
    frame = whitening(base, evidence)
    theta = base.x
    reaches = {e: reach(bare, e, frame, theta) for e in bare.simulated_effects}
    raced = [e for e, found in reaches.items() if found.shift >= limits.reach]
    singles = {e: fit_with_covariance(bare.predictor((e,)), (e,), evidence, base.sigma) for e in raced}
    detection = detect(bare, evidence, base, singles, limits, bootstrap, seed)
    signatures = signature_table(bare, base, singles, reaches, frame)
    race = race_singles(emulator, evidence, base, raced) if detection.passed else None
    conclusion = (
        _conclude(emulator, evidence, base, race, raced, signatures, frame, limits, bootstrap, seed)
        if race
        else _nothing(base)
    )
    final = conclusion.final
    refits = conclusion.adequacy.refits if conclusion.adequacy else None
    return Verdict(
        kind=conclusion.kind,
        names=conclusion.names,
        statement=conclusion.statement,
        t2_before=base.t2,
        df_before=base.df,
        t2_after=final.t2,
        df_after=final.df,
        amplitudes=amplitude_estimates(declared, final, refits),
        models=_models(declared, base, race, conclusion.pairs),
        gates=(detection.overall, detection.directed, *conclusion.gates),
        effects=effect_rows(declared, reaches, singles, detection, race, signatures),
        parameters=parameter_changes(declared, base, final),
        freed=freed_parameters(declared, base, evidence),
        residuals=residual_table(declared, evidence, base, final),
        where=where_the_residual_sits(declared, final),
        signatures=signatures,
        variances=evidence.variances,
        dropped=dropped,
        floored=floored,
        limits=limits,
        bootstrap=bootstrap,
        seed=seed,
    )


def _nothing(base: Fit) -> Conclusion:
    text = "The calibrated base model explains the data within their noise."
    return Conclusion("no_missing_effect", (), text, (), base, None)


def _conclude(
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
) -> Conclusion:
    """Return what gates 2 and 3 say of the single effects, and of pairs where no single one is adequate."""
    if not race.fits:
        text = "The data hold more than noise, and no simulated effect could be seen by them."
        return Conclusion("unexplained", (), text, (), base, None)
    fit = race.fits[race.best]
    adequacy = adequate(emulator, evidence, fit, race.best, limits, bootstrap, seed + 1)
    if adequacy.gate.passed:
        near, gates = _near(emulator, evidence, race, limits, seed + 4)
        return Conclusion(*_named("effect", near), (adequacy.gate, *gates), fit, adequacy)
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


def _near(
    emulator: Emulator, evidence: Evidence, race: Race, limits: Limits, seed: int
) -> tuple[tuple[str, ...], tuple[Gate, Gate]]:
    """Return the best model with those that come too near or cannot be rejected, best first, and gates 3 and 4."""
    gap, near = unambiguous(race.criteria, limits)
    apart, staying = told_apart(emulator, evidence, race.fits, race.criteria, limits, seed)
    names = sorted({*near, *staying}, key=lambda name: race.criteria[name])
    return tuple(names), (gap, apart)


def _named(prefix: str, near: tuple[str, ...]) -> tuple[str, tuple[str, ...], str]:
    """Return kind, names and sentence for the models within the gap."""
    if len(near) == 1:
        return (
            f"{prefix}:{near[0]}",
            near,
            f"{near[0]} explains what the base model cannot, and nothing else comes near.",
        )
    return f"ambiguous:{','.join(near)}", near, f"{listed(near)}: the data cannot tell which."


def _models(declared: Declared, base: Fit, *races: Race | None) -> tuple[FittedModel, ...]:
    """Return the base model and every raced one, in order of their criterion."""
    rows = [fitted_model(declared, "base", base, base.t2)]
    for race in races:
        if race is not None:
            rows += [fitted_model(declared, label, fit, race.criteria[label]) for label, fit in race.fits.items()]
    return tuple(sorted(rows, key=lambda row: row.criterion))
