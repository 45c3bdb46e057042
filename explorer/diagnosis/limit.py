"""The limit of a diagnosis, from its order to its file and its tables."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from doe.declared.model import Declared, declare
from doe.declared.pour_end import Ended
from doe.declared.pours import ModelPours
from doe.diagnose.training_amplitudes import REPLICATES
from doe.measurement import Measurement, load_measurement
from doe.measurement.features import OFFERS, feature_set
from doe.record import plain
from doe.store import Store, default_store
from doe.validation.cross_validation import BASE_POURS, NULLS, CrossValidation, PlantedTruth, Teaching, cross_validated
from doe.validation.laboratory import read_laboratory
from doe.validation.limit import RISK, RISKS, LimitStudy, Strength, confused, limit_study
from doe.validation.reference import ROOT, Reference, extended_to, kept
from explorer.background.progress import time_left
from explorer.files.output_file import check_folder_of, write_whole
from explorer.files.run_folder import json_text
from explorer.terminal.text_table import text_table
from solver import EFFECTS, PHYSICS, executor

TEACHINGS, SPLITS = (Teaching(4, 0), Teaching(4, 12), Teaching(8, 12)), 20
"""Which pours the rule is trained on, and the number of splits of the reference into training pours and data."""
BANDS = ((3.5, 5.5), (5.5, 9.0))
"""Bands of strength [σ], on the ruler; a row's data hold effects of one band."""
LISTED = 10
"""Pairs shown for each kind of data."""
SAID_EVERY = 100
"""Pours between two lines of progress."""


@dataclass(frozen=True)
class LimitOrder:
    """What a user asked for.

    ``source``: folder of a measurement, or file of a made-up laboratory. ``reference``: file with earlier rounds.
    """

    source: Path
    rounds: int
    out: Path
    reference: Path
    store: Path | None = None
    threads: int | None = None


def run_limit(order: LimitOrder, say: Callable[[str], None]) -> tuple[LimitStudy, tuple[CrossValidation, ...]]:
    """Pour the missing rounds, and write what follows from them all. Every pour and every round is kept."""
    check_folder_of(order.out, "--out")
    check_folder_of(order.reference, "--reference")
    measurement = _declared(order.source)
    declared = declare(measurement, tuple(EFFECTS))
    sets = [feature_set(condition) for condition in measurement.fit]
    found = kept(order.reference, measurement, PHYSICS)
    if found.rounds < order.rounds:
        found = _poured(order, measurement, declared, found, say)
    offered = {offer: [one.offered(offer) for one in sets] for offer in OFFERS}
    study = limit_study(found.sample, found.levels, offered)
    validated = cross_validations(found, study, offered)
    made = {"title": found.title, "rounds": found.rounds, "physics": found.physics, "readings": found.readings}
    write_whole(order.out, json_text(made | study.to_dict() | {"cross_validation": plain(validated)}) + "\n")
    return study, validated


def cross_validations(
    found: Reference, study: LimitStudy, offered: Mapping[str, Sequence[int]]
) -> tuple[CrossValidation, ...]:
    """What the rule of the diagnosis names when it is trained on few pours of every effect."""
    kinds, pours = [one.kind for one in study.reached], found.sample.pours
    rows = []
    for data, numbers in offered.items():
        sample = found.sample.first(numbers).varying()
        for teaching in TEACHINGS:
            if min(map(len, pours["base"])) < BASE_POURS + NULLS * REPLICATES or any(
                min(map(len, pours[f"{kind.name} strong"])) < teaching.all for kind in kinds
            ):
                continue
            enough = [
                one
                for one in truths_of(study)
                if min(map(len, pours[f"{one.kind.name} {one.level}"])) >= teaching.most(one.level) + REPLICATES
            ]
            bands = [[one for one in enough if low <= one.strength < high] for low, high in BANDS]
            some = [truths for truths in bands if truths]
            rows += cross_validated(data, sample, kinds, some, teaching, SPLITS, np.random.default_rng(0))
    return tuple(rows)


def truths_of(study: LimitStudy) -> list[PlantedTruth]:
    """Every truth whose data can be taken from reference pours."""
    strong = [PlantedTruth(one.kind, "strong", one.ruler.value) for one in study.reached]
    return strong + [PlantedTruth(one.kind, "weak", one.weak.value) for one in study.reached if one.weak is not None]


def _declared(source: Path) -> Measurement:
    return load_measurement(source) if source.is_dir() else read_laboratory(source).declared


def _poured(
    order: LimitOrder, measurement: Measurement, declared: Declared, found: Reference, say: Callable[[str], None]
) -> Reference:
    """``found`` with the missing rounds added."""
    began, poured = time.monotonic(), 0

    def on_pour(what: str, left: int, _: Ended) -> None:
        nonlocal poured
        poured += 1
        if left % SAID_EVERY == 0:
            elapsed = time.monotonic() - began
            say(f"{elapsed:.0f} s: {what}, {left} pours left{time_left(left * elapsed / poured)}")

    with ExitStack() as stack:
        store = Store(order.store or default_store())
        stack.callback(store.close)
        pool = stack.enter_context(executor(order.threads))
        paths = [parameter.path for parameter in measurement.parameters]
        pours = ModelPours(measurement.fit, paths, store, pool.run_queue, on_pour, ROOT)
        return extended_to(found, order.rounds, declared, pours, order.reference, say)


def limit_text(found: LimitStudy, validated: Sequence[CrossValidation]) -> str:
    """Strengths, pairs that look alike, limits, and what the rule reaches, as tables."""
    data = tuple(found.reached[0].strength)
    strengths = [
        [one.kind.name, " ".join(f"{a:.3g}" for a in one.amplitude), _with_error(one.ruler), _with_error(one.weak)]
        + [_with_error(one.strength[name]) for name in data[1:]]
        for one in found.reached
    ]
    head = ("effect", "amplitude", "ruler, σ", "at half of it", *(f"in a {name}, σ" for name in data[1:]))
    pairs = [
        [one.data, one.first, one.second, f"{one.cosine:.2f}", f"{confused(abs(one.cosine), 6.0):.1%}"]
        for name in data
        for one in [pair for pair in found.confusable if pair.data == name][:LISTED]
    ]
    limits = [
        [row.data, str(row.replicates), f"{row.limit.strength:g}", f"{row.limit.right:.1%}"]
        + [f"{share:.1%}" for share in row.limit.named]
        for row in found.rows
    ]
    rule = [
        [one.data, f"{one.strength:.1f}", _pours(one), str(one.sets)]
        + [f"{share:.1%}" for share in (one.right, *one.named)]
        + [f"{one.false[RISKS.index(RISK)]} of {one.nulls}"]
        for one in validated
    ]
    curve = tuple(f"named, {risk:.1%} wrong" for risk in RISKS)
    head_of_rule = ("data", "strength, σ", "taught by", "sets", "most probable is right", *curve, "false names")
    unseen = [name for name in data if name not in {row.data for row in found.rows}]
    return "\n\n".join(
        (
            text_table(head, strengths),
            text_table(("data", "effect", "looks like", "cosine", "taken for it at 6 σ"), pairs),
            text_table(("data", "pours", "strength, σ", "most probable is right", *curve), limits),
            *(f"{name}: no effect is told from zero, so that there is no limit" for name in unseen),
            text_table(head_of_rule, rule),
        )
    )


def _pours(found: CrossValidation) -> str:
    more = f" + {found.pours:.0f}" if found.teaching.more else ""
    return f"{found.teaching.all} of each{more}"


def _with_error(strength: Strength | None) -> str:
    return "" if strength is None else f"{strength.value:.1f} ± {strength.error:.1f}"
