"""How many closer looks are taken, by posteriors that are made up."""

from types import SimpleNamespace

import pytest

from doe.declared.budget import Budget
from doe.diagnose import diagnosis
from doe.diagnose.posterior import Posterior


class Rehearsed:
    """Training pours whose every look ends with the next of the posteriors in ``steps``: name and probability."""

    def __init__(self, steps):
        self._steps, self.looks, self.ways, self.declared = iter(steps), 0, (), None
        self.instruments = lambda data: []

    def compared(self, *_, **__):
        name, p = next(self._steps)
        odds = {"a": 0.1 * (1.0 - p), "b": 0.1 * (1.0 - p)} | {name: p}
        fit = SimpleNamespace(p=0.01)
        found = Posterior(0.0, 1.0 - sum(odds.values()), odds, {"base": fit, "a": fit, "b": fit}, (), 0.0)
        compared = SimpleNamespace(posterior=found)
        compared.refitted = compared.asked_of_typical = lambda labels: compared
        return compared

    def look(self, found):
        self.looks += 1
        return ("a", "b")

    def lessons(self): ...
    def refine(self, found, label): ...
    def at_end(self, found):
        return []


@pytest.mark.parametrize(
    ("steps", "looks"),
    [
        ([("a", 0.93), ("a", 0.93), ("a", 0.91), ("a", 0.93)], 2),
        ([("a", 0.5), ("a", 0.93), ("a", 0.97), ("a", 0.97)], 2),
        ([("a", 0.93), ("a", 0.96), ("a", 0.96)], 1),
        # Two effects together have had a look when each of them has.
        ([("a+b", 0.93), ("a+b", 0.96), ("a+b", 0.96)], 1),
        ([("a+c", 0.93), ("a+c", 0.96), ("a+c", 0.96), ("a+c", 0.96), ("a+c", 0.96), ("a+c", 0.96)], 4),
        # Lost once, it has to hold twice anew; and what holds is one and the same.
        ([("a", 0.5), ("a", 0.93), ("a", 0.85), ("a", 0.93), ("a", 0.94), ("a", 0.94)], 4),
        ([("a", 0.5), ("a", 0.93), ("b", 0.93), ("a", 0.93), ("b", 0.93), ("b", 0.93)], 4),
    ],
)
def test_an_effect_that_two_looks_leave_named_gets_no_third(steps, looks, monkeypatch):
    # The posterior once it is poured on both sides of its best fit comes last.
    training = Rehearsed(steps)
    monkeypatch.setattr(diagnosis, "weighed", training.compared)
    monkeypatch.setattr(diagnosis, "inseparable", lambda compared, name: "")
    diagnosis.pursued(training, SimpleNamespace(fit=(), bodies=()), Budget(), print, ())
    assert training.looks == looks
