"""A declared model of one parameter, and pours whose size of answer is known."""

import numpy as np

from doe.diagnose.runs import Condition, Declared, Parameter
from doe.diagnose.simulation.pours import Pour
from doe.diagnose.simulation.ranges import REPLICATES

SUMMARIES = ("a", "b")
DECLARED = Declared((Parameter("p", 0.0, 1.0),), (), (Condition("one", SUMMARIES),))
STANDARD_ERROR = 1 / np.sqrt(REPLICATES)


class AtOnce:
    """``ModelPours.answered`` where pours are there as soon as they are asked for: one search after the other."""

    def answered(self, what, searches, where=None, widest=()):
        return [self.result_of(what, search) for search in searches]

    def result_of(self, what, search):
        pours = None
        while True:
            try:
                pours = self.run(what, search.send(pours))
            except StopIteration as end:
                return end.value


class Noisy(AtOnce):
    """Pours with unit noise; an effect shifts the first summary by ``answer`` (amplitude) standard errors."""

    def __init__(self, **answers):
        self.answers, self.asked = answers, []
        self.rng = np.random.default_rng(7)

    def run(self, what, points):
        self.asked += [(what, point) for point in points]
        shifts = [sum(self.answers[name] * a for name, (a,) in point.effects) * STANDARD_ERROR for point in points]
        rows = [self.rng.normal(size=2) + np.array([shift, 0.0]) for shift in shifts]
        return [[Pour(tuple(row), "measured")] for row in rows]
