"""What a target says about each factor: its value if the target identifies it, else the range that gives the target.

The optimum is one point that a rule picks among all settings that give the target. Its 95 % set shows how far that pick
scatters from refit to refit; it shows what is known about a factor only if the target identifies the factor. For
several targets, the joint posterior gives both: the 95 % interval of each factor, and whether that leaves it open.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from doe.stages.surface import OptimumResult
from explorer.report.content import Strong
from explorer.units import MISSING, enumeration, parameter_label, parameter_range, parameter_value, percent

BY_RULE = "chosen by rule"
GIVES_TARGET = "range that gives the target"
"""Name of `Setting.feasible` in tables and charts."""


@dataclass(frozen=True)
class FactorSetting:
    """One factor at the optimum, in words.

    ``chosen``: the value. ``confidence_set``: its 95 % set, a dash if the factor is not identified. ``feasible``:
    the range over which the model gives the target (several targets: the 95 % interval of their posterior),
    ``feasible_share``: the part of the region that it takes.
    """

    name: str
    label: str
    identified: bool
    chosen: str
    confidence_set: str
    feasible: str
    feasible_share: str

    @property
    def value(self) -> str:
        """The chosen value, with the word for what it is."""
        return self.chosen if self.identified else f"{self.chosen} ({BY_RULE})"

    @property
    def cells(self) -> tuple[str, ...]:
        """Name, label, whether it is identified, range that gives the target and its share, value, 95 % set."""
        yes_or_no = "yes" if self.identified else "no"
        return (
            *(self.name, self.label, yes_or_no),
            *(self.range_or_answer, self.feasible_share, self.value, self.confidence_set),
        )

    @property
    def range_or_answer(self) -> str:
        """The range that gives the target; if the factor is not identified, it is the answer and stands out."""
        return self.feasible if self.identified or self.feasible == MISSING else Strong(self.feasible)

    @property
    def answer(self) -> str:
        """The value with its 95 % set; for a factor that is not identified, the range first."""
        if self.identified:
            return f"{self.chosen} ({self.confidence_set})"
        return self.value if self.feasible == MISSING else f"{self.feasible} ({BY_RULE}: {self.chosen})"


def settings(optimum: OptimumResult) -> tuple[FactorSetting, ...]:
    """Every factor of an optimum, in its order."""
    return tuple(_setting(optimum, k) for k in range(len(optimum.factors)))


def all_identified(optimum: OptimumResult) -> bool:
    """Whether the target identifies every factor, so that the point is more than a choice."""
    return all(one.identified for one in settings(optimum))


def rule(optimum: OptimumResult, reference: str) -> str:
    """How the point was chosen, as a sentence to go below a table; empty if every factor is identified."""
    if all_identified(optimum):
        return ""
    if optimum.compromise is not None:
        how = "the setting of least weighted misfit over all targets"
    elif optimum.single.reached:
        how = f"nearest the {reference} among the settings that give the target"
    else:
        how = "where the model comes nearest the target"
    return f"{BY_RULE.capitalize()}: {how}; not an estimate, so it has no 95 % set."


def cloud_caution(optimum: OptimumResult) -> str:
    """What the scatter of the refits does not show, as a sentence; empty if one target identifies every factor."""
    if optimum.compromise is not None:
        return "The refits are of the first target alone, the star is the setting of all targets."
    open_ = [s.name for s in settings(optimum) if not s.identified]
    if not open_:
        return ""
    return f"The target does not identify {enumeration(open_)}: there the scatter is that of the rule's choice."


def _setting(optimum: OptimumResult, k: int) -> FactorSetting:
    single, factor = optimum.single, optimum.factors[k]
    path, share = factor.path, float(single.solution_share[k])
    low, high = float(single.solution_low[k]), float(single.solution_high[k])
    ends = float(single.point_low[k]), float(single.point_high[k])
    if optimum.compromise is not None and (joint := optimum.posterior) is not None:
        low, high = ends = float(joint.low[k]), float(joint.high[k])
        share = float(joint.share[k])
    identified = optimum.estimates[path].identified
    return FactorSetting(
        name=factor.name,
        label=parameter_label(path),
        identified=identified,
        chosen=parameter_value(path, optimum.values[path]),
        confidence_set=parameter_range(path, *ends) if identified else MISSING,
        feasible=parameter_range(path, low, high),
        feasible_share=MISSING if math.isnan(low) else percent(share),
    )
