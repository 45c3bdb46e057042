"""From runs and data to a verdict: emulate, calibrate, detect, race, and only then name.

Source of the decision rule: the gates of gates.py and rivals.py; effects that the data could not see are not in the
race.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from doe.diagnose.decision.conclude import conclude, nothing_missing
from doe.diagnose.decision.effect_table import effect_rows
from doe.diagnose.decision.freed import freed_parameters
from doe.diagnose.decision.gates import Limits, detect
from doe.diagnose.decision.race import Race, race_singles
from doe.diagnose.decision.tables import (
    amplitude_estimates,
    as_read,
    fitted_model,
    parameter_changes,
    residual_table,
    signature_table,
    where_the_residual_sits,
)
from doe.diagnose.decision.verdict import FittedModel, Verdict
from doe.diagnose.emulation.emulator import Emulator, fit_emulator
from doe.diagnose.emulation.fresh_pours import FreshPours, newest, taught
from doe.diagnose.emulation.tails import heavy_tails
from doe.diagnose.fitting.calibrate import Fit, calibrate, fit_with_covariance, gather_evidence
from doe.diagnose.fitting.signatures import reach, whitening
from doe.diagnose.runs import Declared, Observed, Runs, select_summaries
from doe.errors import StatisticsError

STANDARD_LIMITS = Limits()


def diagnose(
    declared: Declared,
    runs: Runs,
    observed: Observed,
    bootstrap: int = 1000,
    seed: int = 0,
    limits: Limits = STANDARD_LIMITS,
    fresh: Sequence[FreshPours] = (),
    ruled_out: Sequence[str] = (),
) -> Verdict:
    """Return the verdict on measured data from simulated runs of the declared model.

    observed: the conditions to be fitted only, in the order of declared.conditions; a holdout is judged in holdout.py.
    fresh: pours at best fits of an earlier verdict with the same runs. ruled_out: effects that a verdict on the same
    runs named among others, and that held-out data contradict.
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
    verdict = judge(emulator, measured, bootstrap, seed, limits, selected.dropped, selected.floored, ruled_out)
    return replace(verdict, residuals=as_read(verdict.residuals, tails), drawn_in=tails.labels(selected.declared))


def judge(
    emulator: Emulator,
    observed: Observed,
    bootstrap: int = 1000,
    seed: int = 0,
    limits: Limits = STANDARD_LIMITS,
    dropped: tuple[str, ...] = (),
    floored: tuple[str, ...] = (),
    ruled_out: Sequence[str] = (),
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
        conclude(emulator, evidence, base, race, raced, signatures, frame, limits, bootstrap, seed, ruled_out)
        if race
        else nothing_missing(base)
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
        ruled_out=conclusion.ruled_out,
        limits=limits,
        bootstrap=bootstrap,
        seed=seed,
    )


def _models(declared: Declared, base: Fit, *races: Race | None) -> tuple[FittedModel, ...]:
    """Return the base model and every raced one, in order of their criterion."""
    rows = [fitted_model(declared, "base", base, base.t2)]
    for race in races:
        if race is not None:
            rows += [fitted_model(declared, label, fit, race.criteria[label]) for label, fit in race.fits.items()]
    return tuple(sorted(rows, key=lambda row: row.criterion))
