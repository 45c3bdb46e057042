"""Scan: the response over steps of one assumption, which shows how much the calibration depends on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from doe.analysis.pilot import Noise, replicate_noise
from doe.analysis.power import smallest_effect
from doe.record import Record
from doe.run_records import FloatArray, Run, Runner, Setting, no_pile_shares, responses
from doe.stages.stage import Chain, Stage, ended
from doe.studies.profile import Profile
from doe.studies.study import Study
from doe.target import observed_text


@dataclass(frozen=True, kw_only=True)
class ScanResult(Record):
    """Mean and spread of the target's observable at each value of ``path`` (SI).

    ``noise`` is None for fewer than two valid runs.
    """

    path: str
    values: tuple[float, ...]
    observable: str
    means: FloatArray
    noise: tuple[Noise | None, ...]
    no_pile_share: FloatArray
    settings: tuple[Setting, ...] = ()
    runs: tuple[tuple[Run, ...], ...]
    smallest_difference: float
    """Difference between two values of ``path`` that would have been seen with power 0.8."""

    @property
    def line(self) -> str:
        """The findings of the scan in one line."""
        pairs = ", ".join(
            f"{value:g} → {observed_text(self.observable, mean)}"
            for value, mean in zip(self.values, self.means, strict=True)
        )
        seen = observed_text(self.observable, self.smallest_difference)
        return f"{self.path}: {pairs}; smallest difference seen {seen}"


def scan(study: Study, profile: Profile, runner: Runner, noise: Noise) -> ScanResult | None:
    """Run the scan of the study; None if it declares none. ``noise``: that of the target's observable in the pilot."""
    if study.scan_path is None or not study.scan_values:
        return None
    path = study.scan_path
    settings = [Setting(f"{path} = {v:g}", {path: v}, profile.scan_replicates) for v in study.scan_values]
    rows = runner.run("scan", settings)
    observable = study.targets[0].observable
    table = responses(rows, observable)
    valid = [row[~np.isnan(row)] for row in table]
    return ScanResult(
        path=path,
        values=study.scan_values,
        observable=observable,
        means=np.array([row.mean() if len(row) else math.nan for row in valid]),
        noise=tuple(replicate_noise(row) if len(row) > 1 else None for row in valid),
        no_pile_share=no_pile_shares(rows),
        settings=tuple(settings),
        runs=tuple(tuple(runs) for runs in rows),
        smallest_difference=smallest_effect(noise.sigma * math.sqrt(2.0 / profile.scan_replicates), noise.runs - 1),
    )


class ScanStage(Stage):
    """One assumption in steps."""

    name = "scan"
    title = "Scan"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Runs at every value."""
        return len(study.scan_values) * profile.scan_replicates

    def run(self, chain: Chain, runner: Runner) -> ScanResult | None:
        """See :func:`scan`."""
        noise = ended(chain.found.pilot).noise[chain.study.targets[0].observable]
        return scan(chain.study, chain.profile, runner, noise)
