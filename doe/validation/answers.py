"""From cases to rows: truths are drawn, poured, judged, and right names are tried on what was held out."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt

from doe.diagnose.decision.decide import diagnose
from doe.diagnose.decision.verdict import Verdict
from doe.diagnose.declare import observe
from doe.diagnose.diagnosis import FRESH, models
from doe.diagnose.emulation.fresh_pours import FreshPours
from doe.diagnose.follow_up.closer import LOOKS, contenders, poured, with_new
from doe.diagnose.follow_up.confirm import confirm
from doe.diagnose.follow_up.held_out import POURS, compared, contenders_for, predictions, ruled_out, upheld
from doe.diagnose.follow_up.holdout import HoldoutCondition, holdout_errors
from doe.diagnose.runs import Declared, Runs
from doe.diagnose.simulation.plan import Point
from doe.diagnose.simulation.pours import ModelPours, room_of
from doe.diagnose.simulation.screen import Screened
from doe.measurement import Condition, Measurement, load_measurement, summary_names
from doe.measurement.summaries import summaries
from doe.validation.laboratory import Reading, write_folder
from doe.validation.schedule import Case
from doe.validation.sets import OUT_OF_REACH, Row, answer_to
from doe.validation.truth import REPLICATES, ROOT, Ruler, Truth, truth_of
from doe.validation.work_place import Order, WorkPlace, complete

FloatArray = npt.NDArray[np.float64]

TRIES = 3
"""Times that a laboratory pours ``REPLICATES`` more to replace pours that jammed."""
NAN = float("nan")

Data = dict[str, list[Reading]]
"""Readings per condition."""


@dataclass(frozen=True)
class Question:
    """What is asked of the diagnosis: the emulator's runs, the readings of the fitted conditions, fresh pours at the
    fits of an earlier verdict, names of that verdict that held-out data rule out.
    """

    declared: Declared
    runs: Runs
    model: Path
    measured: Mapping[str, Sequence[Reading]]
    fresh: tuple[FreshPours, ...] = ()
    ruled_out: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Answers:
    """The declared model with its emulator's runs, and where the work is done."""

    model: Path
    measurement: Measurement
    screened: Screened
    ruler: Ruler
    place: WorkPlace

    def rows(self, cases: Sequence[Case]) -> list[Row]:
        """Rows of ``cases``, in order."""
        began = time.monotonic()
        truths = [truth_of(case, self.ruler) for case in cases]
        data = self.measured(truths, self.measurement.fit)
        verdicts, questions = self.judged({k: found for k, found in enumerate(data) if found is not None})
        contending = {k: contenders_for(verdict) for k, verdict in verdicts.items()}
        verdicts = self.held_out(truths, verdicts, questions)
        cosines = {k: least_cosine(verdict, label_of(truths[k])) for k, verdict in verdicts.items()}
        right = [k for k in verdicts if answer_to(verdicts[k].kind, label_of(truths[k]), cosines[k]) == "right"]
        errors = dict(zip(right, self.holdout([truths[k] for k in right], [verdicts[k] for k in right]), strict=True))
        seconds = (time.monotonic() - began) / len(cases)
        rows = []
        for k, truth in enumerate(truths):
            verdict, found = verdicts.get(k), data[k]
            before, after = errors.get(k, (NAN, NAN))
            pours = 0 if found is None else REPLICATES * len(self.measurement.fit)
            pours += sum(len(block) for one in questions[k].fresh for block in one.blocks) if found else 0
            models = len(contending.get(k, ()))
            pours += (REPLICATES + POURS * models) * len(self.measurement.holdout) if models else 0
            pours += 2 * FRESH * len(self.measurement.holdout) if k in errors else 0
            rows.append(
                Row(
                    number=truth.case.number,
                    kind=truth.case.kind,
                    label=label_of(truth),
                    strength=truth.case.strength,
                    amplitude=" ".join(f"{name}={'/'.join(f'{x:.4g}' for x in a)}" for name, a in truth.effects),
                    shift=NAN if found is None else self.ruler.seen(truth.theta, self.means(found)),
                    verdict=verdict.kind if verdict else OUT_OF_REACH + (truth.missing or "pours break off"),
                    p_detect=min(g.p for g in verdict.gates[:2] if g.p is not None) if verdict else NAN,
                    cosine=cosines.get(k, NAN),
                    before=before,
                    after=after,
                    pours=pours,
                    seconds=seconds,
                )
            )
        return rows

    def judged(self, data: Mapping[int, Data]) -> tuple[dict[int, Verdict], dict[int, Question]]:
        """Verdicts, and the questions with the pours at best fits that they answer, as in a diagnosis."""
        declared, runs = self.screened.declared, self.screened.runs
        questions = {k: Question(declared, runs, self.model, found) for k, found in data.items()}
        verdicts = dict(zip(questions, self.place.map(judged, list(questions.values())), strict=True))
        pours = self.model_pours(self.measurement.fit)
        for _ in range(LOOKS):
            closer = {k: found for k, v in verdicts.items() if (found := contenders(v, declared, questions[k].fresh))}
            asked = [(model, questions[k].fresh) for k, found in closer.items() for model in found]
            fresh = iter(poured([model for model, _ in asked], declared, pours, [known for _, known in asked]))
            for k, found in closer.items():
                known = questions[k].fresh
                questions[k] = replace(questions[k], fresh=with_new(known, [next(fresh) for _ in found]))
            again = self.place.map(judged, [questions[k] for k in closer])
            verdicts |= dict(zip(closer, again, strict=True))
        return verdicts, questions

    def held_out(
        self, truths: Sequence[Truth], verdicts: Mapping[int, Verdict], questions: Mapping[int, Question]
    ) -> dict[int, Verdict]:
        """The verdicts, with names that the held-out condition does not bear out taken back, as in a diagnosis."""
        asked = [k for k, verdict in verdicts.items() if verdict.names]
        conditions = self.measurement.holdout
        pours, widths = self.model_pours(conditions), [len(summary_names(condition)) for condition in conditions]
        found, rows, again = dict(verdicts), {}, {}
        for k, data in zip(asked, self.measured([truths[k] for k in asked], conditions), strict=True):
            if data is not None:
                poured = predictions(found[k], pours, widths)
                rows[k] = compared(found[k], [vectors(c, data[c.name]) for c in conditions], poured)
                if gone := ruled_out(found[k], rows[k]):
                    again[k] = replace(questions[k], ruled_out=gone)
        found |= dict(zip(again, self.place.map(judged, list(again.values())), strict=True))
        return found | {k: upheld(found[k], one) for k, one in rows.items()}

    def measured(self, truths: Sequence[Truth], conditions: Sequence[Condition]) -> list[Data | None]:
        """Readings of the laboratories' pours; None where there is no such truth, or pours keep breaking off."""
        data: list[Data | None] = [None if truth.missing else {} for truth in truths]
        short = [k for k, found in enumerate(data) if found is not None]
        for attempt in range(TRIES):
            numbers = range(REPLICATES * (attempt + 1))
            orders = [order for k in short for c in conditions for order in self.orders(truths[k], c, numbers)]
            readings = iter(self.place.pour(orders, room_of(conditions)))
            for k in short:
                data[k] = {c.name: complete(next(readings) for _ in numbers)[:REPLICATES] for c in conditions}
            short = [k for k in short if any(len(one) < REPLICATES for one in (data[k] or {}).values())]
        return [None if k in short else found for k, found in enumerate(data)]

    def orders(self, truth: Truth, condition: Condition, numbers: Sequence[int]) -> list[Order]:
        """Pours ``numbers`` of a laboratory in a condition; their seeds follow from the number of the set."""
        laboratory = self.laboratory(self.measurement.conditions)
        c = self.measurement.conditions.index(condition)
        points = [Point(f"set {truth.case.number}", k, truth.theta, truth.effects) for k in numbers]
        outside = truth.case.label if truth.case.kind == "outside" else ""
        return [Order(laboratory.scene(p, c), laboratory.seed(p, c), condition, outside) for p in points]

    def laboratory(self, conditions: Sequence[Condition]) -> ModelPours:
        """Scenes and seeds of the laboratories' pours: other seeds than the emulator's and the confirmation's."""
        paths = [parameter.path for parameter in self.measurement.parameters]
        return ModelPours(conditions, paths, self.place.store, self.place.crew.run_queue, root=ROOT)

    def model_pours(self, conditions: Sequence[Condition]) -> ModelPours:
        """Pours of the declared model, as a diagnosis makes them."""
        paths = [parameter.path for parameter in self.measurement.parameters]
        clock = self.place.look_at_the_clock
        return ModelPours(conditions, paths, self.place.store, self.place.crew.run_queue, clock)

    def means(self, data: Data) -> FloatArray:
        """Means of the summaries that the ruler knows, (D,)."""
        found = []
        for condition, kept in zip(self.measurement.fit, self.ruler.emulator.declared.conditions, strict=True):
            values = dict(
                zip(summary_names(condition), vectors(condition, data[condition.name]).mean(axis=0), strict=True)
            )
            found += [values[name] for name in kept.summaries]
        return np.array(found)

    def holdout(self, truths: Sequence[Truth], verdicts: Sequence[Verdict]) -> list[tuple[float, float]]:
        """Error ÷ noise floor on the held-out conditions, of the calibrated base model and of the named one."""
        conditions = self.measurement.holdout
        pours = self.model_pours(conditions)
        widths = [len(summary_names(condition)) for condition in conditions]
        ratios = []
        for data, verdict in zip(self.measured(truths, conditions), verdicts, strict=True):
            blocks = [one.blocks for one in confirm(models(verdict), pours, FRESH, widths)]
            if data is None or min(len(block) for model in blocks for block in model) < REPLICATES:
                ratios.append((NAN, NAN))
                continue
            error = holdout_errors(
                [
                    HoldoutCondition(c.name, summary_names(c), vectors(c, data[c.name]), before, after)
                    for c, before, after in zip(conditions, *blocks, strict=True)
                ]
            )[-1]
            ratios.append((error.before / error.noise_floor, error.ratio))
        return ratios


def label_of(truth: Truth) -> str:
    """The name that a right answer gives, that of the outside effect, or "none"."""
    return "+".join(name for name, _ in truth.effects) or truth.case.label or "none"


def vectors(condition: Condition, readings: Sequence[Reading]) -> FloatArray:
    """Summaries of some pours, (pours, d)."""
    return np.array([[summary.of(dict(reading)) for summary in summaries(condition)] for reading in readings])


def judged(question: Question) -> Verdict:
    """The verdict on a data set that is written to a folder and read like any other."""
    with TemporaryDirectory() as folder:
        write_folder(Path(folder), question.model, question.measured)
        return judged_folder(Path(folder), question)


def judged_folder(folder: Path, question: Question) -> Verdict:
    """The verdict on the data set in ``folder``, whatever else ``question`` says was measured."""
    observed = observe(load_measurement(folder).fit)
    return diagnose(question.declared, question.runs, observed, fresh=question.fresh, ruled_out=question.ruled_out)


def cosine_between(verdict: Verdict, one: str, other: str) -> float:
    """Cosine of the signatures of two effects in this data set; NaN where one was not in the race."""
    names = verdict.signatures.names
    if one not in names or other not in names:
        return float("nan")
    return float(verdict.signatures.cosines[names.index(one), names.index(other)])


def least_cosine(verdict: Verdict, truth: str) -> float:
    """Least cosine of the truth's signature and those of the effects that the verdict names; NaN where it has none."""
    named = [name for label in verdict.names for name in label.split("+")]
    found = [cosine_between(verdict, truth, name) for name in named]
    return float(np.min(found)) if found else float("nan")
