"""A runner that answers with a formula instead of a pour: the chain of a study with a known truth."""

import hashlib

import numpy as np

from doe.pour_runner import TRIES, seed_of
from doe.run_records import Run
from solver import OBSERVABLES


class FormulaRunner:
    """angle = ``formula(values)`` + noise; a share ``jam`` of the runs jams. ``calls`` counts runs per stage.

    ``others`` gives estimators a formula of their own (with the same noise). ``ended``: outcome of the runs that do
    not jam. ``experiments``: name → observable → formula of each further experiment, with a noise of its own.
    """

    def __init__(self, formula, sigma=1.0, jam=0.0, others=None, ended="at_rest", experiments=None):
        self.formula, self.sigma, self.jam, self.others, self.ended = formula, sigma, jam, others or {}, ended
        self.experiments = experiments or {}
        self.calls = {}

    def run(self, stage, settings):
        return [self._setting(stage, row, setting) for row, setting in enumerate(settings)]

    def _setting(self, stage, row, setting):
        runs = []
        for replicate in range(setting.replicates):
            for experiment in setting.experiments:
                for attempt in range(TRIES):
                    if experiment:
                        run = self._elsewhere(stage, row, setting, replicate, attempt, experiment)
                    else:
                        run = self._once(stage, row, setting, replicate, attempt)
                    runs.append(run)
                    self.calls[stage] = self.calls.get(stage, 0) + 1
                    if run.valid:
                        break
        return runs

    def _once(self, stage, row, setting, replicate, attempt):
        seed = seed_of(1, stage, row, replicate, attempt)
        rng = np.random.default_rng(seed)
        noise = self.sigma * rng.normal()
        angle = self.formula(setting.values) + noise
        outcome = "jammed" if rng.uniform() < self.jam else self.ended
        estimators = [name for name, one in OBSERVABLES.items() if one.estimator]
        seen = {name: angle + 0.1 * k * rng.normal() for k, name in enumerate(estimators)}
        seen |= {name: formula(setting.values) + noise for name, formula in self.others.items()}
        seen["bulk_density_kg_m3"] = 150.0 + 5.0 * angle + rng.normal()
        key = hashlib.sha256(repr((setting.values, seed)).encode()).hexdigest()
        return Run(setting.label, replicate, attempt, seed, outcome, "", seen, 0.1, key)

    def _elsewhere(self, stage, row, setting, replicate, attempt, experiment):
        seed = seed_of(1, stage, row, replicate, attempt, experiment)
        rng = np.random.default_rng(seed)
        seen = {
            f"{experiment}/{name}": formula(setting.values) + self.sigma * rng.normal()
            for name, formula in self.experiments[experiment].items()
        }
        key = hashlib.sha256(repr((experiment, setting.values, seed)).encode()).hexdigest()
        outcome = "jammed" if rng.uniform() < self.jam else "measured"
        return Run(setting.label, replicate, attempt, seed, outcome, "", seen, 0.1, key, experiment=experiment)
