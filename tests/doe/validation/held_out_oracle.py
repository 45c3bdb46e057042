"""What the held-out error would be over its noise floor if name, amplitudes and parameters were known exactly.

    python -m tests.doe.validation.held_out_oracle --number 74

The truth of each set with one effect is poured as a diagnosis pours its final model: the same numbers of measured and
of fresh pours, in the same held-out conditions, compared by the same code. As both are of one population, any division
of them is as good as the one that happened: ``DIVISIONS`` of them tell the ratio's distribution. No method does better
than this on average; what a diagnosis shows beyond it is the error of its fit.
"""

import argparse
import contextlib
import json
import os
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from doe.declared.points import Point
from doe.diagnose.budget import Budget
from doe.diagnose.diagnosis import complete_rows, fresh_pours
from doe.holdout import HoldoutCondition, holdout_errors
from doe.measurement import load_measurement, summary_names
from doe.store import Store, default_store
from doe.validation.campaign import Answers, CampaignOrder, measured_strengths
from doe.validation.laboratory import read_laboratory
from doe.validation.sets import HOLDOUT_GOOD
from doe.validation.truth import truth_of
from doe.validation.work_place import WorkPlace

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
        conditions.append(HoldoutCondition(name, names, measured, fresh, fresh))
    return holdout_errors(conditions, samples=2)[-1].ratio


def ratios(answers, case, generator):
    """The ratio of the set as it was poured, and those of other divisions; None where a pour broke off."""
    truth, held = truth_of(case, answers.strengths), answers.measurement.holdout
    measured = answers.measured(truth, held)
    fresh = fresh_pours(answers.measurement.conditions)
    pours = answers.model_pours(held)
    points = [Point("oracle", k, truth.theta, truth.effects) for k in range(fresh)]
    poured = pours.run("oracle", points)
    if measured is None or not all(pour.valid for row in poured for pour in row):
        return None
    rows = [
        (name, names, len(values), np.concatenate([values, [row[c].summaries for row in poured]]))
        for c, (name, names, values) in enumerate(
            summaries(answers, {name: [one.reading for one in data] for name, data in measured.items()})
        )
    ]
    return ratio(rows), [ratio(rows, generator) for _ in range(DIVISIONS)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=int, default=1)
    parser.add_argument("--number", type=int, default=74)
    parser.add_argument("--store", type=Path)
    asked = parser.parse_args()
    order = CampaignOrder(Path(), asked.number, asked.root, asked.store)
    laboratory = read_laboratory(order.laboratory)
    own, divided, generator = [], [], np.random.default_rng(asked.root)
    with contextlib.ExitStack() as stack:
        store = Store(order.store or default_store())
        stack.callback(store.close)
        place = stack.enter_context(WorkPlace(store, os.cpu_count() or 1))
        answers = Answers(laboratory, measured_strengths(order, laboratory, place, print), place, Budget())
        for case in order.asked(laboratory):
            if case.kind != "effect" or (found := ratios(answers, case, generator)) is None:
                continue
            own.append(found[0])
            divided += found[1]
            print(f"{case.number}: {found[0]:.2f}, divided otherwise {np.median(found[1]):.2f}", flush=True)
    good = float(np.mean(np.array(divided) <= HOLDOUT_GOOD))
    told = {"sets": len(own), "median": np.median(own), "divided: median": np.median(divided), "share good": good}
    print(json.dumps({key: round(float(value), 3) for key, value in told.items()}))


if __name__ == "__main__":
    main()
