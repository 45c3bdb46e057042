"""The verdict of a diagnosis with everything that led to it, as plain records.

kind: `no_missing_effect`, `effect:<name>`, `effects:<a>+<b>`, `ambiguous:<a>,<b>,…` or `unexplained`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from doe.diagnose.decision.gates import Gate, Limits
from doe.diagnose.emulation.noise import VarianceComparison
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
Status = Literal["raced", "not identifiable here", "not simulated"]


@dataclass(frozen=True)
class AmplitudeEstimate(Record):
    """One amplitude of one effect, natural units: value, standard error from the Jacobian, 95 % interval.

    The interval is that of the bootstrap refits for a model that went through gate 2, else value ± 1.96 standard
    errors; it never leaves the bounds. at_edge: -1, 0 or 1.
    """

    effect: str
    index: int
    value: float
    standard_error: float
    low: float
    high: float
    at_edge: int


@dataclass(frozen=True)
class ParameterChange(Record):
    """A calibrated parameter without and with the named effects, natural units.

    edge_before, edge_after: -1 or 1 where it is driven to the lower or upper end of its measured range, else 0;
    pull_before, pull_after: there, by how much T^2 would fall per standard deviation (to first order) beyond the edge.
    """

    name: str
    low: float
    high: float
    before: float
    before_standard_error: float
    edge_before: int
    pull_before: float
    after: float
    after_standard_error: float
    edge_after: int
    pull_after: float


@dataclass(frozen=True)
class FreedParameter(Record):
    """Where the data alone would put a parameter in the base model, natural units (freed.py), and the T^2 left.

    sds: distance from its measured mean in standard deviations of that, NaN without one. outside: beyond the range that
    was simulated, so extrapolated along the slope. value NaN: the data do not see it.
    """

    name: str
    value: float
    standard_error: float
    sds: float
    outside: bool
    t2: float


@dataclass(frozen=True)
class FittedModel(Record):
    """A calibrated model, to be simulated afresh: "base", "a" or "a+b"; parameters in declared order, natural units.

    members: indices of its effects. coded: (q,) parameters and amplitudes, with their covariance (q, q).
    criterion: B of gates.py.
    """

    label: str
    members: tuple[int, ...]
    coded: FloatArray
    covariance: FloatArray
    parameters: tuple[float, ...]
    amplitudes: tuple[AmplitudeEstimate, ...]
    t2: float
    df: int
    criterion: float


@dataclass(frozen=True)
class EffectRow(Record):
    """One effect in the table. reach: largest shift that the data could see within its bounds, in sigma.

    drop: fall of T^2 under the base model's Sigma, p_drop its own bootstrap p. t2: with its own Sigma. criterion: B
    of gates.py, delta its
    distance to the best of the race. weight: exp(-B/2), normalised. cosine: of its signature to that of the best. NaN
    where it was not raced.
    """

    name: str
    status: Status
    reach: float
    amplitudes: tuple[AmplitudeEstimate, ...]
    t2: float
    drop: float
    p_drop: float
    criterion: float
    delta: float
    weight: float
    cosine: float


@dataclass(frozen=True)
class Residual(Record):
    """One summary: measured mean, base and final model, and both residuals in sigma (square root of Sigma's
    diagonal).
    """

    label: str
    measured: float
    before: float
    after: float
    z_before: float
    z_after: float


@dataclass(frozen=True)
class Signature(Record):
    """Projected whitened residual of the base model, (D + k,), and each raced effect's of unit length, with cosines.

    names: effects; vectors: (effects, D + k); cosines: (effects, effects); residual_cosine: (effects,).
    """

    residual: FloatArray
    names: tuple[str, ...]
    vectors: FloatArray
    cosines: FloatArray
    residual_cosine: FloatArray


@dataclass(frozen=True)
class Verdict(Record):
    """The answer. names: effects it names, best first ("a+b" for a pair). t2_before, t2_after with df_before, df_after.

    models: the base and all that were raced, best first. where: per condition its share of T^2 that is left by the
    final model, and its worst summary. dropped, floored: see runs.py. drawn_in: see tails.py. variances: per
    condition. ruled_out: effects that the fitted data left beside the named ones and held-out data did not. seed and
    bootstrap make it repeatable.
    """

    kind: str
    names: tuple[str, ...]
    statement: str
    t2_before: float
    df_before: int
    t2_after: float
    df_after: int
    amplitudes: tuple[AmplitudeEstimate, ...]
    models: tuple[FittedModel, ...]
    gates: tuple[Gate, ...]
    effects: tuple[EffectRow, ...]
    parameters: tuple[ParameterChange, ...]
    freed: tuple[FreedParameter, ...]
    residuals: tuple[Residual, ...]
    where: tuple[str, ...]
    signatures: Signature
    variances: tuple[VarianceComparison, ...]
    dropped: tuple[str, ...]
    floored: tuple[str, ...]
    limits: Limits
    bootstrap: int
    seed: int
    drawn_in: tuple[str, ...] = ()
    ruled_out: tuple[str, ...] = ()
