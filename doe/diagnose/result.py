"""The findings of a diagnosis as plain records. Reading them loads nothing that compiles.

A label is ``BASE``, an effect, or a pair "a+b". An answer is ``NO_EFFECT``, ``UNEXPLAINED``, or any label but ``BASE``.
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
"""Name of the experiment that needs no pour."""


@dataclass(frozen=True)
class Amplitude(Record):
    """One amplitude of one effect in natural units: posterior mean with the sign or direction of the best fit, and 95 %
    interval over all of them.

    ``at_end``: whether the best amplitude is the largest that the models reach, or that the literature supports.
    """

    effect: str
    index: int
    value: float
    low: float
    high: float
    at_end: bool


@dataclass(frozen=True)
class EffectRow(Record):
    """One effect, or one pair of effects that was weighed.

    Attributes
    ----------
    name
        The effect, or "a+b".
    probability
        Posterior probability.
    log_evidence
        ln of its evidence relative to that of the base model.
    amplitudes
        At its best fit.
    p
        Probability of data at least as far off as these if its best fit were true.
    reference
        Amplitude at which its signature was poured, in its "+" or "x" direction; empty for a pair.
    strength
        Shift of the compared features at the reference amplitude, after recalibration [standard errors of the data].
    fitted_strength
        The same at its best fit.
    cosine
        Between the shift at its best fit and the residual, after recalibration.
    pours
        Number of its training pours, in every condition.
    beside
        Posterior probability of the pairs that contain the effect.
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
        """Probability that the effect is missing from the declared model, alone or with others."""
        return self.probability + self.beside


@dataclass(frozen=True)
class ParameterRow(Record):
    """A calibrated parameter, natural units: its measurement, and its posterior under the base and the final model."""

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
    """One feature in natural units: measured mean, calibrated base model and final model. ``z_before``, ``z_after``:
    residuals of both models, standardized: each over its standard deviation were the model right and so calibrated.
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
    """A condition: its share of the base model's squared residuals, and its feature with the largest residual."""

    condition: str
    share: float
    feature: str
    z: float


@dataclass(frozen=True)
class Level(Record):
    """A direction and the share of its range at which its shift was found sufficient (``training_amplitudes.py``)."""

    direction: Direction
    share: float
    shift: float
    """[standard errors], estimated from the training pours, or from the few pours of the search."""


@dataclass(frozen=True)
class Offered(Record):
    """What a fitted condition's data offer, how many features are compared, and how many more a scan would add."""

    condition: str
    offer: str
    features: int
    scan_would_add: int


@dataclass(frozen=True)
class CalibratedModel(Record):
    """A calibrated model: parameters in natural units, and the amplitudes of the effects that act."""

    theta: tuple[float, ...]
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()

    @property
    def name(self) -> str:
        """``BASE``, or the names of the effects joined by "+"."""
        return "+".join(name for name, _ in self.effects) or BASE


@dataclass(frozen=True)
class RankedExperiment(Record):
    """``chance``: how often the right answer is given (``next_experiment.py``); ``separation``: smallest distance
    between the predictions of two answers [standard deviations of a pour and of the predictions].
    """

    name: str
    chance: float
    separation: float


@dataclass(frozen=True)
class Suggestion(Record):
    """A suggested experiment.

    Attributes
    ----------
    experiment
        Its name, its chance of giving the right answer and its separation of the answers.
    values
        Parameter path → value [SI] of the settings that differ from ``condition``.
    condition
        Name of the fitted condition that it changes.
    rivals
        Labels of the answers to be told apart, "base" for nothing missing.
    levers
        For each of the rivals' effects, what reveals it by its nature.
    pours
        Number of pours asked for; 0 if single bodies alone are measured, to check an answer that is already given.
    turned
        Whether the rig is turned by 180° on its bench.
    bodies
        Component and quantity of each number to be measured of single bodies as well (``doe/measurement/bodies.py``).
    """

    experiment: RankedExperiment
    values: Mapping[str, float | str]
    condition: str
    rivals: tuple[str, ...]
    levers: tuple[str, ...]
    pours: int
    turned: bool = False
    bodies: tuple[tuple[str, str], ...] = ()
