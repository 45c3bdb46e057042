"""The table of effects: how far each could be seen, how well it fits, and how far it is from the best."""

from __future__ import annotations

import math

import numpy as np

from doe.diagnose.decision.gates import Detection, evidence_weights
from doe.diagnose.decision.race import Race
from doe.diagnose.decision.tables import amplitude_estimates
from doe.diagnose.decision.verdict import EffectRow, Signature
from doe.diagnose.fitting.calibrate import Fit
from doe.diagnose.fitting.signatures import Reach
from doe.diagnose.runs import Declared

NAN = math.nan


def effect_rows(
    declared: Declared,
    reaches: dict[int, Reach],
    singles: dict[int, Fit],
    detection: Detection,
    race: Race | None,
    signatures: Signature,
) -> tuple[EffectRow, ...]:
    """Return the table of effects in their declared order."""
    weights = evidence_weights(list(race.criteria.values())) if race and race.criteria else np.array([])
    weight_of = dict(zip(race.criteria, weights, strict=True)) if race else {}
    best = race.best if race and race.fits else None
    rows = []
    for e, effect in enumerate(declared.effects):
        if e not in singles:
            found = reaches.get(e)
            shift = effect.unseen if found is None else found.shift
            status = "not simulated" if shift is None else "not identifiable here"
            shift = NAN if shift is None else shift
            rows.append(EffectRow(effect.name, status, shift, (), *(NAN,) * 7))  # type: ignore[arg-type]
            continue
        fit = race.fits[effect.name] if race else singles[e]
        criterion = race.criteria[effect.name] if race else NAN
        rows.append(
            EffectRow(
                name=effect.name,
                status="raced",
                reach=reaches[e].shift,
                amplitudes=amplitude_estimates(declared, fit),
                t2=fit.t2,
                drop=detection.drops[e],
                p_drop=detection.drop_p[e],
                criterion=criterion,
                delta=criterion - race.criteria[best] if race and best else NAN,
                weight=float(weight_of.get(effect.name, NAN)),
                cosine=_cosine_to(signatures, effect.name, best),
            )
        )
    return tuple(rows)


def _cosine_to(signatures: Signature, name: str, best: str | None) -> float:
    if best is None:
        return NAN
    return float(signatures.cosines[signatures.names.index(name), signatures.names.index(best)])
