"""What ``diagnosis.json`` holds: the answer, its basis, and the order that led to it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
import numpy.typing as npt

from doe.declared.bodies import BodyRow
from doe.declared.model import CandidateEffect, effect_values
from doe.diagnose.result import (
    BASE,
    NO_EFFECT,
    UNEXPLAINED,
    CalibratedModel,
    EffectRow,
    Level,
    Offered,
    ParameterRow,
    Place,
    Residual,
    Suggestion,
)
from doe.holdout import OVERALL, HeldOut, HoldoutError
from doe.measurement.measurement import Role
from doe.measurement.residual_map import ResidualMap
from doe.provenance import About
from doe.record import Document, Record

FloatArray = npt.NDArray[np.float64]
Kind = Literal["no_missing_effect", "effect", "effects", "ambiguous", "unexplained"]
CORRECTED, CORRECTED_STUDY, SHORT_PROFILE = "corrected.toml", "corrected_study.toml", "quick"
"""Material of the corrected model, the study that calibrates it, and that study's short profile."""
Confirmation = Literal["no holdout", "within noise", "confirmed", "not certain", "not confirmed"]


@dataclass(frozen=True)
class Probabilities(Record):
    """That nothing is missing, and that something outside the library is; effects have theirs in their rows."""

    nothing: float
    outside: float


@dataclass(frozen=True)
class Rule(Record):
    """Constants of the rule, for the report (`doe.diagnose`); ``doubted``, ``hidden``: 1 in results older than these.

    ``together``: whether ``contradicted`` is of fitted and held-out data together; in older ones, of the latter alone.
    ``pairs_at_once``: whether two effects may be named without a follow-up, as in older ones.
    """

    prior_nothing: float
    prior_outside: float
    prior_pairs: float
    fits: float
    nothing_at_once: float
    nothing_from: float
    credible: float
    contradicted: float
    strong: float
    doubted: float = 1.0
    hidden: float = 1.0
    together: bool = False
    pairs_at_once: bool = True


@dataclass(frozen=True)
class ErrorRow(HoldoutError):
    """An error with the unit of its observable; σ for all observables together."""

    unit: str


@dataclass(frozen=True)
class Errors(Record):
    """Errors by fresh pours on fitted and held-out conditions, all observables together last; empty if none."""

    fit: tuple[ErrorRow, ...]
    holdout: tuple[ErrorRow, ...]

    def told(self) -> tuple[tuple[ErrorRow, ...], str]:
        """Return the rows to report first, and the word for their data: held-out if there are any, else fitted."""
        return (self.holdout, "held-out") if self.holdout else (self.fit, "fitted")

    def of(self, role: Role) -> tuple[ErrorRow, ...]:
        """The rows of one role."""
        return self.holdout if role == "holdout" else self.fit


@dataclass(frozen=True)
class MeanAndDeviation(Record):
    """Mean and standard deviation over several pours, number by number, (k,)."""

    mean: FloatArray
    sd: FloatArray


@dataclass(frozen=True)
class PouredCondition(Record):
    """Fresh pours of a model in one condition: how many could be read, and mean and deviation of their summaries."""

    condition: str
    pours: int
    mean: FloatArray
    sd: FloatArray


@dataclass(frozen=True)
class PouredModel(CalibratedModel):
    """A calibrated model with its fresh pours. ``broken``: how many broke off or left nothing to read."""

    broken: int = field(kw_only=True)
    conditions: tuple[PouredCondition, ...] = field(kw_only=True)


@dataclass(frozen=True)
class BeforeAndAfter(Record):
    """The calibrated declared model and the final one; the same if no effect was added."""

    before: PouredModel
    after: PouredModel


@dataclass(frozen=True)
class MeasuredCondition(Record):
    """A condition of the data. ``replicates``: measured pours; ``mean_of``: how many of them each row averages."""

    condition: str
    role: Role
    rig: str
    replicates: int
    summaries: tuple[str, ...]
    mean_of: int = 1

    @property
    def alone(self) -> bool:
        """Whether the data do not show its scatter: a single pour, or a single mean of several."""
        return self.replicates == self.mean_of


@dataclass(frozen=True)
class PileProfiles(Record):
    """Height [m] over the distance [m] from the pile's own middle in one condition, measured and poured."""

    condition: str
    role: Role
    radius: FloatArray
    measured: MeanAndDeviation
    before: MeanAndDeviation
    after: MeanAndDeviation


@dataclass(frozen=True)
class DataRead(Record):
    """The folder that was read, what in it is not used, and what was changed while reading."""

    folder: str
    title: str
    ignored: tuple[str, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class DiagnosisOrder(Record):
    """What was asked for; no effects means all of them. ``given``: folder of the diagnosis that this one continues."""

    out: str
    effects: tuple[str, ...]
    budget: int | None
    seed: int
    follow_up: str | None
    given: str | None = None
    plan_next: bool = True


@dataclass(frozen=True)
class PourCounts(Record):
    """Number of pours that were run (not found in the store), and of settings that were poured."""

    run: int
    settings: int


@dataclass(frozen=True)
class Duration(Record):
    """Total time [s]."""

    total_s: float


@dataclass(frozen=True, kw_only=True)
class DiagnosisResult(Document):
    """Everything that a diagnosis found: the content of ``diagnosis.json``. SI, residuals in σ.

    Attributes
    ----------
    verdict, statement, names, taken_back, final
        The answer (`doe.diagnose.verdict`): its kind with the names in it, a sentence, the effects or pairs in it, the
        one that held-out data took back, and the label of the final model.
    probabilities, threshold, rule, temperature
        How certain it is, and the numbers of the rule.
    effects, levels, ranges, similar
        What the data say about every effect, where each was poured, the ranges considered, and which look alike.
    parameters, residuals, where, scatter, left_out, offered
        The fit to the data, and which of the data it uses.
    error, held_out, confirmation
        Errors by fresh pours, what held-out data say about the final model, and both models.
    next_experiment
        The possible follow-ups, the most informative first.
    measured, piles, maps, data, units
        The measured conditions; ``units``: unit of every summary.
    order, pours, timing, versions
        What was asked, how much it took, and the programs' versions.
    """

    SCHEMA: ClassVar[int] = 3
    NAME: ClassVar[str] = "diagnosis.json"

    verdict: str
    statement: str
    names: tuple[str, ...]
    probabilities: Probabilities
    threshold: float
    rule: Rule
    temperature: float
    taken_back: str
    final: str
    effects: tuple[EffectRow, ...]
    levels: tuple[Level, ...]
    ranges: tuple[CandidateEffect, ...]
    parameters: tuple[ParameterRow, ...]
    residuals: tuple[Residual, ...]
    where: tuple[Place, ...]
    similar: tuple[tuple[str, str, float], ...]
    scatter: float
    left_out: tuple[str, ...]
    offered: tuple[Offered, ...]
    error: Errors
    held_out: HeldOut | None
    next_experiment: tuple[Suggestion, ...]
    confirmation: BeforeAndAfter
    measured: tuple[MeasuredCondition, ...]
    piles: tuple[PileProfiles, ...]
    maps: tuple[ResidualMap, ...]
    data: DataRead
    order: DiagnosisOrder
    units: dict[str, str]
    pours: PourCounts
    timing: Duration
    versions: dict[str, str | None]
    about: About = field(default_factory=About)
    given: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Effects that the declared model has from an earlier answer, with the amplitudes [natural units] about which they
    were calibrated here (`doe.declared.given`)."""
    bodies: tuple[BodyRow, ...] = ()
    """What was measured on single bodies, beside both models."""

    @property
    def kind(self) -> Kind:
        """The kind of answer, without the names in it."""
        head: Kind = self.verdict.partition(":")[0]  # type: ignore[assignment]
        return head

    @property
    def named(self) -> tuple[str, ...]:
        """The effects, or the pair "a+b", that the answer names; empty if it names none."""
        return self.names if self.kind in ("effect", "effects") else ()

    @property
    def added(self) -> bool:
        """Whether the final model has an effect; otherwise before and after are the same model."""
        return self.final != BASE

    def ranked(self) -> list[tuple[str, float]]:
        """Return every answer with its probability, the most probable first."""
        found = {row.name: row.probability for row in self.effects}
        found |= {NO_EFFECT: self.probabilities.nothing, UNEXPLAINED: self.probabilities.outside}
        return sorted(found.items(), key=lambda one: -one[1])

    def probability(self, answer: str) -> float:
        """Return the probability of one answer; 0 for an effect so improbable that it has no row."""
        return dict(self.ranked()).get(answer, 0.0)

    def missing(self, label: str) -> float:
        """Return the probability that an effect, or both of a pair, is missing, alone or with others."""
        row = self.effect_row(label)
        return row.missing if row is not None else 0.0

    def effect_row(self, label: str) -> EffectRow | None:
        """Return the row of an effect or a pair; None if it has none."""
        return next((row for row in self.effects if row.name == label), None)

    def handed_on(self) -> dict[str, tuple[float, ...]]:
        """Return the effects that a further diagnosis has in its model, effect → amplitudes [natural units].

        These are the effects given here, as calibrated, and the most probable effect, even if the answer does not fit;
        empty if that effect is less probable than the threshold for a name.
        """
        best, _ = self.ranked()[0]
        row = self.effect_row(best)
        if row is None or row.missing < self.threshold:
            return {}
        after = {one.name: one.after for one in self.parameters}
        found = {name: tuple(after[path] for path in effect_values(name, one)) for name, one in self.given.items()}
        for name in best.split("+"):
            found[name] = tuple(one.value for one in row.amplitudes if one.effect == name)
        return found

    def range_of(self, effect: str) -> CandidateEffect:
        """Return the widest range of an effect's amplitudes."""
        return next(one for one in self.ranges if one.name == effect)

    def overall(self, role: Role) -> ErrorRow | None:
        """Return the error of all observables together; None if the role has no condition."""
        return next((row for row in self.error.of(role) if row.observable == OVERALL), None)

    def confirmed(self) -> Confirmation:
        """Return what the held-out conditions say about the final model, by its skill (`doe.holdout`)."""
        row = self.overall("holdout")
        if row is None:
            return "no holdout"
        if math.isnan(row.skill):
            return "within noise"
        if row.skill <= 0.0:
            return "not confirmed"
        return "confirmed" if row.skill_low > 0.0 else "not certain"


def answers(verdict: str) -> list[str]:
    """What a verdict leaves possible, the most probable first."""
    kind, _, names = verdict.partition(":")
    return names.split(",") if names else [kind]
