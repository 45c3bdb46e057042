"""What else is missing, asked of every set of a campaign in which an effect is as probable as a name has to be.

    python -m tests.doe.validation.second_round assets/validation 3 11 14 42 --store FILE

Each set is diagnosed again (its pours are in the store, or made), with its follow-up where it had one; then the effect
is given (`doe.declared.given`) and the others are asked about, with a follow-up of their own (``--no-follow-up``: both
without). Lines are appended to ``second_round.jsonl``; sets that stand there are passed over. Five minutes a set on two
cores without follow-ups, ten to twenty with them.
"""

import argparse
import json
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from doe.declared.given import with_given
from doe.declared.model import declare
from doe.declared.pours import ModelPours
from doe.diagnose.diagnosis import joined, pursued, suggested
from doe.diagnose.training_pours import TrainingPours
from doe.diagnose.verdict import THRESHOLD, verdict_of
from doe.measurement.features import SCAN
from doe.measurement.load import load_measurement
from doe.store import Store
from doe.validation.campaign import OFFERS, Answers, CampaignOrder, label_of, measured_strengths
from doe.validation.laboratory import read_laboratory
from doe.validation.scanner import Scanner
from doe.validation.truth import ROOT, truth_of
from doe.validation.work_place import WorkPlace
from solver import EFFECTS, PHYSICS

NAME = "second_round.jsonl"


class Asked:
    """One set by data of one kind, with a model that may hold a given effect."""

    def __init__(self, answers, truth, offer):
        self._answers, self.truth = answers, truth
        self._seed = (ROOT, *truth.case.seed)
        rng = np.random.default_rng([*self._seed, 1])
        self._scanner = Scanner.drawn(rng, answers.laboratory.scanner) if offer == SCAN else None

    def measured(self):
        data = self._answers.measured(self.truth, self._answers.measurement.conditions)
        if data is None:
            return None
        with TemporaryDirectory() as folder:
            self._answers.laboratory.hand_out(Path(folder), data, self._scanner, self._seed)
            return load_measurement(Path(folder))

    def judged(self, measurement, given, is_last=False, follow_ups=()):
        """Verdict and posterior with ``given`` in the model, and what to measure next; ``follow_ups``: in the data."""
        measurement = with_given(measurement, given)
        place, paths = self._answers.place, [one.path for one in measurement.parameters]

        def pours_in(conditions, at=None):
            return ModelPours(conditions, paths, place.store, place.pours, place.ended, place=at)

        declared, budget = declare(measurement, tuple(EFFECTS)), self._answers.budget
        training = TrainingPours(declared, measurement.fit, pours_in(measurement.fit), budget, lambda line: None)
        compared = pursued(training, measurement, budget, lambda line: None, follow_ups)
        verdict = verdict_of(compared, declared, training.pours, follow_ups)
        found = compared.posterior
        if is_last:
            return verdict, found, None
        return (
            verdict,
            found,
            next(iter(suggested(verdict, found, training, measurement, pours_in).suggestions), None),
        )

    def after_follow_up(self, measurement, given):
        """The first answer, the last one with its posterior, and the data that it was given by."""
        verdict, found, next_one = self.judged(measurement, given, is_last=not self._answers.follow_up)
        first = verdict.kind
        if next_one is not None:
            more = self._answers.followed_up(self.truth, next_one, self._scanner, "then" if given else "next")
            if more is not None:
                measurement = joined(measurement, renamed(more, measurement))
                verdict, found, _ = self.judged(measurement, given, True, (more,))
        return first, verdict.kind, found, measurement


def renamed(follow_up, measurement):
    """The follow-up under names that ``measurement`` does not have: there may have been one before."""
    taken = {one.name for one in measurement.conditions}

    def free(name):
        return next(one for k in range(1, 9) if (one := name if k == 1 else f"{name} {k}") not in taken)

    return replace(follow_up, conditions=tuple(replace(one, name=free(one.name)) for one in follow_up.conditions))


def second_round(answers, case, offer, say):
    truth = truth_of(case, answers.strengths)
    asked = Asked(answers, truth, offer)
    measurement = asked.measured()
    if measurement is None:
        return None
    _, last, found, measurement = asked.after_follow_up(measurement, {})
    best, p = found.best
    row = {"root": case.root, "number": case.number, "kind": case.kind, "label": label_of(truth), "offer": offer}
    row |= {"follow_up": answers.follow_up}
    row |= {"strength": case.strength if case.strength == case.strength else None, "physics": PHYSICS}
    row |= {"first": last, "best": best, "best_p": round(p, 4), "given": {}, "second": "", "last": ""}
    if found.missing(best) >= THRESHOLD:
        amplitudes = found.fits[best].amplitudes
        given = {name: tuple(one.value for one in amplitudes if one.effect == name) for name in best.split("+")}
        second, last, found, _ = asked.after_follow_up(measurement, given)
        best, p = found.best
        row |= {"given": {name: [float(f"{x:.4g}") for x in one] for name, one in given.items()}}
        row |= {"second": second, "last": last, "last_best": best, "last_p": round(p, 4)}
        row |= {"last_nothing": round(found.nothing, 4), "last_outside": round(found.outside, 4)}
    say(json.dumps(row))
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("numbers", type=int, nargs="+")
    parser.add_argument("--root", type=int, default=1)
    parser.add_argument("--offer", choices=OFFERS, action="append")
    parser.add_argument("--store", type=Path, required=True)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--no-follow-up", action="store_true", help="ask nothing of an ambiguous answer")
    asked = parser.parse_args()
    path = asked.out / NAME
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    there = {(row["root"], row["number"], row["offer"]) for row in map(json.loads, lines)}
    order = CampaignOrder(out=asked.out, number=max(asked.numbers) + 1, root=asked.root, store=asked.store)
    laboratory = read_laboratory(order.laboratory)
    cases = {case.number: case for case in order.asked(laboratory)}
    with ExitStack() as stack:
        store = Store(asked.store)
        stack.callback(store.close)
        place = stack.enter_context(WorkPlace(store, asked.threads, float("inf")))
        strengths = measured_strengths(order, laboratory, place, print)
        answers = Answers(laboratory, strengths, place, order.budget, not asked.no_follow_up)
        for number in asked.numbers:
            for offer in asked.offer or OFFERS:
                if (asked.root, number, offer) in there:
                    continue
                row = second_round(answers, cases[number], offer, lambda line: print(line, flush=True))
                if row is not None:
                    with path.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(row, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
