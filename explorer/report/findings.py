"""What the sections say is read off a result here: which error decides, what is significant, what hangs on what.

A result is the content of ``result.json``: dict, list, str, float, None (no number), never NaN.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import Any, Literal

from scipy import stats

from doe.power import smallest_effect
from doe.study import TRIES
from solver import Outcome

Plain = dict[str, Any]
ErrorName = Literal["replicates", "dummies"]

ALPHA = 0.05
ERROR_KEYS: dict[ErrorName, str] = {"replicates": "pure_error", "dummies": "dummy_error"}


def deciding_error(analysis: Plain) -> ErrorName | None:
    """Which error judges the effects: replicates where there are any, else dummies, None without either."""
    if analysis["pure_error"] is not None:
        return "replicates"
    return "dummies" if analysis["dummy_error"] is not None else None


def test_of(effect: Plain, error: ErrorName | None) -> Plain | None:
    """The test of an effect against an error."""
    return None if error is None else effect[f"by_{error}"]


def t_of(effect: Plain, error: ErrorName) -> float | None:
    """|t| of an effect; None where it was not tested."""
    test = test_of(effect, error)
    return None if test is None or test["t"] is None else abs(test["t"])


def half_width(analysis: Plain, effect: Plain) -> float | None:
    """Half the 95 % interval of an effect: t limit × its standard error against the deciding error."""
    error = deciding_error(analysis)
    test = test_of(effect, error)
    if error is None or test is None:
        return None
    limit, spread = analysis[ERROR_KEYS[error]]["t_limit"], test["standard_error"]
    return None if limit is None or spread is None else limit * spread


def factor_effects(analysis: Plain) -> list[Plain]:
    """The effects of real factors by falling size."""
    found = [effect for effect in analysis["effects"] if not effect["is_dummy"] and effect["effect"] is not None]
    return sorted(found, key=lambda effect: -abs(effect["effect"]))


def significant(analysis: Plain, error: ErrorName | None, p: Literal["p", "p_holm"]) -> list[str]:
    """Factors below 0.05 against an error, largest effect first; empty if that error is not there."""
    tests = [(effect["name"], test_of(effect, error)) for effect in factor_effects(analysis)]
    return [name for name, test in tests if test is not None and test[p] is not None and test[p] < ALPHA]


def sigma_of(result: Plain, observable: str) -> float | None:
    """Standard deviation of one pour in the pilot [unit of the observable]."""
    noise = result["pilot"]["noise"].get(observable)
    return None if noise is None else noise["sigma"]


def values_of(runs: Iterable[Plain], observable: str) -> list[float]:
    """An observable over the valid runs in which it could be measured."""
    found = [run["observables"].get(observable) for run in runs if Outcome(run["outcome"]).valid]
    return [value for value in found if value is not None]


def mean_and_sd(values: list[float]) -> tuple[float | None, float | None]:
    """Mean, and standard deviation from two values on."""
    if not values:
        return None, None
    mean = math.fsum(values) / len(values)
    if len(values) < 2:
        return mean, None
    return mean, math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (len(values) - 1))


def interval_of_mean(sd: float | None, n: int) -> float | None:
    """Half the 95 % interval of a mean of ``n`` values: t(0.975, n − 1) sd/√n."""
    return None if sd is None or n < 2 else float(stats.t.ppf(0.975, n - 1)) * sd / math.sqrt(n)


def standard_error(sample: Plain) -> float | None:
    """Standard error sd/√n of a sample's mean."""
    return None if sample["sd"] is None or not sample["n"] else sample["sd"] / math.sqrt(sample["n"])


def outcomes_by_stage(result: Plain) -> dict[str, Counter[str]]:
    """Stage → outcome → number of runs, stages in running order."""
    found: dict[str, Counter[str]] = {}
    for run in result["runs"]["list"]:
        found.setdefault(run["stage"], Counter())[run["outcome"]] += 1
    return found


def valid_count(outcomes: Counter[str]) -> int:
    """Number of valid runs among counted outcomes."""
    return sum(count for outcome, count in outcomes.items() if Outcome(outcome).valid)


def seeds_tried(result: Plain) -> int:
    """Seeds tried for one replicate; the default where an older result does not say."""
    return result["study"].get("tries", TRIES)


def target_observable(result: Plain) -> str:
    """Observable of the first target, which leads ascent and optimum."""
    return result["study"]["targets"][0]["observable"]


def paths(result: Plain) -> dict[str, str]:
    """Name of every factor and assumption → its parameter path."""
    screened = [result["screening"], result["assumptions"]]
    return {factor["name"]: factor["path"] for part in screened if part is not None for factor in part["factors"]}


def hangs_on(result: Plain) -> tuple[Plain, Plain] | None:
    """(largest assumption effect, largest factor effect) in the screening's response; None without assumptions."""
    if result["assumptions"] is None:
        return None
    assumed = factor_effects(result["assumptions"]["analysis"])
    declared = factor_effects(result["screening"]["analysis"])
    return (assumed[0], declared[0]) if assumed and declared else None


def resolved_by_surface(result: Plain) -> float | None:
    """Smallest change from low to high of a linear term that the first surface sees with power 0.8."""
    error = result["surface"]["anova"][0]["coefficient_standard_errors"][1]
    return _detectable(2 * error if error is not None else None, result["surface"]["models"][0]["df_residual"])


def resolved_by_verification(result: Plain) -> float | None:
    """Smallest difference from the first target that the verification sees with power 0.8."""
    tests = result["verification"]["tests"][0]
    test = tests["welch"] or tests["one_sample"]
    return None if test is None else _detectable(test["standard_error"], test["df"])


def _detectable(error: float | None, df: float | None) -> float | None:
    if error is None or df is None:
        return None
    found = smallest_effect(error, df)
    return found if math.isfinite(found) else None
