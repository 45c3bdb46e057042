"""Equivalence tests of cheaper numerical settings (economies) against the full settings: are the piles the same?

Every economy is tested at the centre of a study and at the two corners of its ranges with the largest overlaps: the
softest materials with the highest restitution, at the lowest and at the highest friction. At each of these, the same
number of pours is made with and without the economy, all with different seeds (a pour is chaotic: with the same seed
the two would be no more alike). An observable is equivalent if the two one-sided tests (TOST; Schuirmann 1987) place
the difference of its means within ``MARGIN`` standard deviations of one pour. The economy is accepted if all
observables are equivalent at all three settings and the share of valid pours does not differ significantly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.t_tests import Sample, equivalence_test, welch_test
from doe.record import Record
from doe.run_records import Run, Runner, Setting, responses
from doe.studies.study import Study
from solver import Scene, observable_names, parameters, value, with_values

MARGIN = 0.3
"""Margin of a mean, in standard deviations of one pour with the full settings."""
ALPHA, POWER = 0.05, 0.9
COMPARED = (
    "angle_of_repose_deg",
    "angle_of_repose_cone_deg",
    "apex_height_m",
    "footprint_r50_m",
    "bulk_density_kg_m3",
    "discharge_time_s",
)
"""Observables that must not change: slope from the silhouette and from the surface, height, spread, packing, flow."""
SHARE_ALPHA = 0.01
"""Level at which the shares of valid pours count as different (Fisher's exact test)."""


@dataclass(frozen=True)
class Economy:
    """A cheaper way to pour: the parameters of a scene that it multiplies."""

    name: str
    factors: Mapping[str, float]
    """Last part of a parameter path, or a whole path → factor by which the scene's value is multiplied."""
    reason: str

    def values(self, scene: Scene) -> dict[str, float]:
        """Return the parameters of ``scene`` that it changes, with their new values in SI."""
        return {
            path: value(scene, path) * factor
            for ending, factor in self.factors.items()
            for path in parameters(scene)
            if path == ending or path.endswith(f".{ending}")
        }


ECONOMIES: Mapping[str, Economy] = {
    one.name: one
    for one in (
        Economy(
            "larger_steps",
            {"numerics.rayleigh_fraction": 1.5, "numerics.impact_fraction": 1.5},
            "time steps half as large again",
        ),
        Economy("softer_grains", {"shear_modulus": 0.5}, "half the shear modulus: steps 1.4 times as large"),
        Economy("shorter_rest", {"numerics.rest_time": 0.5}, "half the time of rest that ends a pour"),
    )
}


@dataclass(frozen=True)
class ComparedMeans(Record):
    """One observable at one setting, with and without the economy."""

    setting: str
    observable: str
    full: Sample
    economical: Sample
    margin: float
    """Margin in the observable's unit."""
    low: float
    high: float
    """Interval of the difference of the means (economical minus full) at the confidence level 1 − 2 α."""
    p: float
    equivalent: bool


@dataclass(frozen=True)
class Shares(Record):
    """Shares of valid pours at one setting."""

    setting: str
    full: tuple[int, int]
    """Valid pours, all pours."""
    economical: tuple[int, int]
    p: float
    """p of Fisher's exact test."""


@dataclass(frozen=True)
class EconomyTest(Record):
    """Result of the test of one economy."""

    economy: str
    pours: int
    """Number of pours of each kind at each setting."""
    compared: tuple[ComparedMeans, ...]
    shares: tuple[Shares, ...]
    cost: float
    """Wall time of an economical pour over that of a full one, mean over the settings."""
    accepted: bool


def pours_needed(margin: float = MARGIN, alpha: float = ALPHA, power: float = POWER) -> int:
    """Return the pours of each kind needed for ``power`` with equal means: n = 2 (z₁₋α + z₍₁₊power₎/₂)² / margin².

    ``margin`` is in standard deviations of one pour. Source: Julious 2004, Stat. Med. 23:1921, eq. 23.
    """
    quantiles = stats.norm.ppf(1.0 - alpha) + stats.norm.ppf(0.5 * (1.0 + power))
    return math.ceil(2.0 * float(quantiles) ** 2 / margin**2)


def settings_of(study: Study) -> dict[str, dict[str, float | str]]:
    """Return the centre and the two corners of ``study``: name → values that differ from its scene."""
    corners: dict[str, dict[str, float | str]] = {"centre": {}, "soft, least friction": {}, "soft, most friction": {}}
    ends = {"shear_modulus": ("low", "low"), "restitution": ("high", "high"), "static_friction": ("low", "high")}
    for factor in study.factors:
        ending = factor.path.rsplit(".", 1)[-1]
        if ending in ends:
            for name, end in zip(tuple(corners)[1:], ends[ending], strict=True):
                corners[name][factor.path] = getattr(factor, end)
    return corners


def rows_of(study: Study, economy: Economy, pours: int) -> list[Setting]:
    """Return each setting without and then with ``economy``."""
    rows = []
    for name, values in settings_of(study).items():
        # A corner may set a parameter that the economy scales.
        cheap = economy.values(with_values(study.scene, values))
        rows += [Setting(name, values, pours), Setting(f"{name}, {economy.name}", {**values, **cheap}, pours)]
    return rows


def compare(
    study: Study, economy: Economy, runner: Runner, pours: int, told: Callable[[EconomyTest], None] | None = None
) -> EconomyTest:
    """Pour and compare; ``told`` is called with the result so far after every tenth of the pours."""
    stage = f"economy {economy.name}"
    found = None
    for count in sorted({max(2, round(pours * part / 10)) for part in range(1, 11)}):
        rows = runner.run(stage, rows_of(study, economy, count))
        found = judged(study, economy, rows, count)
        if told is not None:
            told(found)
    assert found is not None
    return found


def judged(study: Study, economy: Economy, rows: Sequence[Sequence[Run]], pours: int) -> EconomyTest:
    """Return the comparison of the pours made; ``rows`` in the order of :func:`rows_of`."""
    names = list(settings_of(study))
    asked = [one for one in COMPARED if one in observable_names(study.scene)]
    compared: list[ComparedMeans] = []
    shares: list[Shares] = []
    costs = []
    for k, name in enumerate(names):
        full, cheap = rows[2 * k], rows[2 * k + 1]
        compared += list(_observables(name, asked, full, cheap))
        counts = [(sum(run.valid for run in runs), len(runs)) for runs in (full, cheap)]
        table = [[valid, total - valid] for valid, total in counts]
        shares.append(Shares(name, counts[0], counts[1], float(stats.fisher_exact(table)[1])))
        costs.append(float(np.mean([r.wall_s for r in cheap]) / np.mean([r.wall_s for r in full])))
    accepted = all(one.equivalent for one in compared) and all(one.p >= SHARE_ALPHA for one in shares)
    return EconomyTest(economy.name, pours, tuple(compared), tuple(shares), float(np.mean(costs)), accepted)


def _observables(
    name: str, observables: Sequence[str], full: Sequence[Run], cheap: Sequence[Run]
) -> Iterator[ComparedMeans]:
    for observable in observables:
        one, two = (_values(runs, observable) for runs in (full, cheap))
        base, other = (Sample.of(x) if len(x) else Sample(math.nan, math.nan, 0) for x in (one, two))
        margin = MARGIN * base.sd
        # What cannot be tested (hardly a valid pour, or no scatter) is not shown to be equivalent.
        if min(base.n, other.n) < 2 or not margin > 0.0:
            yield ComparedMeans(name, observable, base, other, margin, math.nan, math.nan, math.nan, False)
        else:
            test = equivalence_test(welch_test(other, base), margin, ALPHA)
            yield ComparedMeans(name, observable, base, other, margin, test.low, test.high, test.p, test.equivalent)


def _values(runs: Sequence[Run], observable: str) -> npt.NDArray[np.float64]:
    values = responses([runs], observable).ravel()
    return values[~np.isnan(values)]
