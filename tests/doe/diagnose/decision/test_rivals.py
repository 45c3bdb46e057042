"""Rivals in the linear toy world: off the parameters e0 and e1 have signatures at a cosine of 0.9; e5 is far."""

import numpy as np
import pytest

from doe.diagnose.decision.gates import Limits
from doe.diagnose.decision.race import race_singles
from doe.diagnose.decision.rivals import told_apart
from doe.diagnose.fitting.calibrate import calibrate, gather_evidence
from tests.doe.diagnose.toy import known_emulator, make_toy

SETS = 150
"""At a level of 5 %, more than 15 of 150 are a 0.3 % event (binomial)."""


def raced(truth, strength, number, effects=(0, 1)):
    toy = make_toy(12, number)
    emulator = known_emulator(toy, np.random.default_rng([number, 1]), df=200)
    data = toy.measured(np.random.default_rng([number, 2]), toy.listed(truth, strength))
    evidence = gather_evidence(emulator, data)
    race = race_singles(emulator, evidence, calibrate(emulator, (), evidence), effects)
    gate, stay = told_apart(emulator, evidence, race.fits, race.criteria, Limits(), seed=number)
    return race, gate, stay


def test_the_truth_is_rarely_rejected_for_its_near_twin():
    """Whatever the strength: at 5 σ the twins are 2.2 σ apart, which is where a gap misleads most."""
    wrong = 0
    for number in range(SETS):
        race, _, stay = raced(0, 5.0, number)
        wrong += race.best == "e1" and "e0" not in stay
    assert wrong <= 15


def test_a_strong_effect_rejects_its_twin_and_anything_far_from_it():
    race, gate, stay = raced(0, 12.0, 3, effects=(0, 1, 5))
    assert race.best == "e0"
    assert stay == ()
    assert gate.passed
    assert gate.p <= 0.05


def test_halfway_between_twins_neither_goes():
    """The rival is named, with how often it would be beaten by as much if it were the truth."""
    race, gate, stay = raced(0, 2.0, 4)
    (rival,) = {"e0", "e1"} - {race.best}
    assert stay == (rival,)
    assert not gate.passed
    assert f"were {rival} the truth" in gate.statement


def test_a_model_alone_has_no_rival():
    _, gate, stay = raced(0, 10.0, 5, effects=(0,))
    assert (gate.passed, stay, gate.p) == (True, (), None)


def test_the_criterion_decides_who_is_best():
    race, _, _ = raced(5, 10.0, 6, effects=(0, 5))
    assert race.best == "e5"
    assert race.criteria["e5"] == pytest.approx(min(race.criteria.values()))
