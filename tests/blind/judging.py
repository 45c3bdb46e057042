"""One data set on the way that anybody's data go: a folder, the reader, the verdict."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from doe.diagnose.decision.decide import diagnose
from doe.diagnose.decision.verdict import Verdict
from doe.diagnose.declare import observe
from doe.diagnose.emulation.fresh_pours import FreshPours
from doe.diagnose.runs import Declared, Runs
from doe.measurement import load_measurement
from tests.blind.laboratory import Reading, write_folder


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
