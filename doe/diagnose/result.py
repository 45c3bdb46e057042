"""What a diagnosis finds, as plain records. Reading them loads nothing that compiles.

A label is ``BASE``, an effect, or a pair "a+b"; an answer is ``NO_EFFECT``, ``UNEXPLAINED``, or a label but the base.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from doe.declared.points import Direction
from doe.record import Record

BASE = "base"
"""Label of the declared model without an effect."""
NO_EFFECT, UNEXPLAINED = "no_missing_effect", "unexplained"
BODIES_ALONE = "single bodies, without a pour"
"""Name of the experiment that pours nothing."""


@dataclass(frozen=True)
class Amplitude(Record):
    """One amplitude of one effect, natural units: posterior mean and 95 % interval.

    ``at_end``: the best one is the largest of those that the models reach, or that the literature supports.
    """

    effect: str
    index: int
    value: float
    low: float
    high: float
    at_end: bool


@dataclass(frozen=True)
class EffectRow(Record):
    """One effect, or a pair that was weighed.

    Attributes
    ----------
    name
        The effect, or "a+b".
    probability
        Posterior.
    log_evidence
        ln of its evidence over that of the base model.
    amplitudes
        At its best fit.
    p
        Probability of data as far off as these, were its best fit true.
    reference
        The amplitude that its signature was poured at, "+" and "x" direction first; empty of a pair.
    strength
        Shift by that amplitude in the features that are compared, after recalibration [standard errors of the data].
    fitted_strength
        The same by its best fit.
    cosine
        Of its best fit's shift to the residual, after recalibration.
    pours
        That taught it, in every condition.
    beside
        Posterior of the pairs that an effect is one of.
    """

    name: str
    probability: float
    log_evidence: float
    amplitudes: tuple[Amplitude, ...]
    p: float
    reference: tuple[float, ...]
    strength: float
    fitted_strength: float
    cosine: float
    pours: int
    beside: float = 0.0

    @property
    def missing(self) -> float:
        """Probability that it is missing, alone or with others."""
        return self.probability + self.beside


@dataclass(frozen=True)
class ParameterRow(Record):
    """A calibrated parameter, natural units: its measurement, and its posterior without and with what is named."""

    name: str
    low: float
    high: float
    mean: float | None
    sd: float | None
    before: float
    before_sd: float
    after: float
    after_sd: float


@dataclass(frozen=True)
class Residual(Record):
    """One feature: measured mean, calibrated base model and final model, natural units, and both residuals over the
    standard deviation of noise, model and instrument, after recalibration.
    """

    condition: str
    feature: str
    measured: float
    before: float
    after: float
    z_before: float
    z_after: float


@dataclass(frozen=True)
class Place(Record):
    """A condition: its share of the squared residuals of the base model, and the feature that is farthest off."""

    condition: str
    share: float
    feature: str
    z: float


@dataclass(frozen=True)
class Level(Record):
    """A direction with the share of its range at which it was found to shift enough (``training_amplitudes.py``)."""

    direction: Direction
    share: float
    shift: float
    """[standard errors], by the pours that teach, or by the few of the search."""


@dataclass(frozen=True)
class Offered(Record):
    """What a fitted condition's data offer, how many features are compared, and how many more a scan would add."""

    condition: str
    offer: str
    features: int
    scan_would_add: int


@dataclass(frozen=True)
class CalibratedModel(Record):
    """A calibrated model: parameters in natural units and the amplitudes of the effects that are on."""

    theta: tuple[float, ...]
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()

    @property
    def name(self) -> str:
        """ "base", or the effects' names."""
        return "+".join(name for name, _ in self.effects) or BASE


@dataclass(frozen=True)
class RankedExperiment(Record):
    """chance: of an answer (``next_experiment.py``); separation: least distance of answers [σ of a pour and theirs]."""

    name: str
    chance: float
    separation: float


@dataclass(frozen=True)
class Suggestion(Record):
    """An experiment.

    Attributes
    ----------
    experiment
        What it tells, and with which chance.
    values
        Parameter path → value [SI] of what is set otherwise than in the condition ``condition``.
    condition
        Name of the fitted condition that it changes.
    rivals
        Labels of what it is to tell apart, "base" for nothing missing.
    levers
        By their nature: what reveals each of the rivals' effects.
    pours
        That it asks for; 0 where single bodies alone are measured, to check an answer that is given already.
    turned
        Whether the rig is turned by 180° on its bench.
    bodies
        Component and quantity of what is to be measured of single bodies beside it (``doe/measurement/bodies.py``).
    """

    experiment: RankedExperiment
    values: Mapping[str, float | str]
    condition: str
    rivals: tuple[str, ...]
    levers: tuple[str, ...]
    pours: int
    turned: bool = False
    bodies: tuple[tuple[str, str], ...] = ()
