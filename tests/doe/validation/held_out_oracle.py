"""What the held-out error would be over its noise floor if name, amplitudes and parameters were known exactly.

    python -m tests.doe.validation.held_out_oracle --number 74 --answers assets/validation/sets.jsonl

The truth of each set with one effect is poured as a diagnosis pours its final model: the same numbers of measured and
of fresh pours by the same seeds, in the same held-out conditions, compared by the same code. As both are of one
population, any division of them is as good as the one that happened: ``DIVISIONS`` of them tell the ratio's
distribution. No method does better than this on average. What right names show beyond their own truths, with the same
measured pours and the same seeds, is the error of their fits.
"""

import argparse
import contextlib
import math
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from doe.declared.budget import Budget
from doe.diagnose.confirm import confirming
from doe.diagnose.diagnosis import fresh_pours
from doe.diagnose.result import CalibratedModel
from doe.holdout import HoldoutCondition, MeasuredReplicates, holdout_errors
from doe.measurement import load_measurement, summary_names
from doe.measurement.summaries import complete_rows
from doe.store import Store, default_store
from doe.validation.campaign import Answers, CampaignOrder, measured_strengths
from doe.validation.laboratory import read_laboratory
from doe.validation.sets import HOLDOUT_GOOD, read_rows
from doe.validation.truth import truth_of
from doe.validation.work_place import WorkPlace
from solver import available_cores

DIVISIONS = 200


def summaries(answers, readings):
    """Rows of the held-out conditions' summaries, (pours, d) each, of what a laboratory has read off every pour.

    A pour of which one could not be read is left out.
    """
    laboratory = answers.laboratory
    placeholders = [dict.fromkeys(laboratory.readings, 0.0), dict.fromkeys(laboratory.readings, 1.0)]
    data = {one.name: placeholders for one in laboratory.declared.fit} | readings
    with TemporaryDirectory() as folder:
        laboratory.write(Path(folder), data)
        held = load_measurement(Path(folder)).holdout
    return [(one.name, summary_names(one), complete_rows(one)) for one in held]


def ratio(rows, generator=None):
    """Error over noise floor where the first rows of each condition are the measured ones."""
    conditions = []
    for name, names, first, values in rows:
        order = np.arange(len(values)) if generator is None else generator.permutation(len(values))
        measured, fresh = values[order[:first]], values[order[first:]]
        replicates = MeasuredReplicates(name, names, measured, np.zeros(len(names)))
        conditions.append(HoldoutCondition(replicates, fresh, fresh))
    return holdout_errors(conditions, samples=2)[-1].ratio


def ratios(answers, case, generator):
    """The ratio of the set as it was poured, and those of other divisions; None where a pour broke off."""
    truth, held = truth_of(case, answers.strengths), answers.measurement.holdout
    measured = answers.measured(truth, held)
    fresh = fresh_pours(answers.measurement.conditions)
    pours = answers.model_pours(held)
    poured = pours.run("oracle", confirming(CalibratedModel(truth.theta, truth.effects), fresh))
    if measured is None or not all(pour.valid for row in poured for pour in row):
        return None
    rows = [
        (name, names, len(values), np.concatenate([values, [row[c].summaries for row in poured]]))
        for c, (name, names, values) in enumerate(
            summaries(answers, {name: [one.reading for one in data] for name, data in measured.items()})
        )
    ]
    return ratio(rows), [ratio(rows, generator) for _ in range(DIVISIONS)]


def paired(path, root, own):
    """By kind of data: ratios of right names, and those of the truths of the same sets."""
    found = {}
    for row in read_rows(path) if path else []:
        if row.root == root and row.number in own and math.isfinite(row.after):
            found.setdefault(row.offer, []).append((row.after, own[row.number]))
    return {offer: np.array(pairs).T for offer, pairs in found.items()}


def told(ratios):
    """Sets, median, and share up to ``HOLDOUT_GOOD``."""
    good = float(np.mean(np.asarray(ratios) <= HOLDOUT_GOOD))
    return f"{len(ratios)}, median {np.median(ratios):.2f}, up to {HOLDOUT_GOOD:g}: {good:.0%}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=int, default=1)
    parser.add_argument("--number", type=int, default=74)
    parser.add_argument("--store", type=Path)
    parser.add_argument("--answers", type=Path, help="rows of these sets, whose right names are compared")
    asked = parser.parse_args()
    order = CampaignOrder(Path(), asked.number, asked.root, asked.store)
    laboratory = read_laboratory(order.laboratory)
    own, divided, generator = {}, [], np.random.default_rng(asked.root)
    with contextlib.ExitStack() as stack:
        store = Store(order.store or default_store())
        stack.callback(store.close)
        place = stack.enter_context(WorkPlace(store, available_cores()))
        answers = Answers(laboratory, measured_strengths(order, laboratory, place, print), place, Budget())
        for case in order.asked(laboratory):
            if case.kind != "effect" or (found := ratios(answers, case, generator)) is None:
                continue
            own[case.number] = found[0]
            divided += found[1]
            print(f"{case.number}: {found[0]:.2f}, divided otherwise {np.median(found[1]):.2f}", flush=True)
    print(f"truths as they were poured: {told(list(own.values()))}")
    print(f"divided otherwise: {told(divided)}")
    for offer, (names, truths) in paired(asked.answers, asked.root, own).items():
        print(f"right names by {offer}: {told(names)}; the truths of these sets: {told(truths)}")
        print(f"    mean of the squares' difference {np.mean(names**2 - truths**2):.2f}")


if __name__ == "__main__":
    main()
