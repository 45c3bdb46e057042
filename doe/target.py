"""What was measured, and how well."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from doe.record import Record
from doe.studies.study_table import Table, number, one_of, only, positive, required, whole


@dataclass(frozen=True)
class Target(Record):
    """A measured observable: mean and standard deviation of ``n`` measurements, and the margin of equivalence.

    ``before_…``: mean and standard deviation of n pours of the model that this study improves on; None without one.
    """

    observable: str
    mean: float
    sd: float | None = None
    n: int | None = None
    weight: float = 1.0
    margin: float = 2.0
    sd_source: str = "measured"
    before_mean: float | None = None
    before_sd: float | None = None
    before_n: int | None = None

    @property
    def standard_error(self) -> float:
        """Standard error sd/√n of the measured mean; 0 where the study states no sd or no n."""
        return 0.0 if self.sd is None or self.n is None else self.sd / math.sqrt(self.n)


def target_from(entry: Table, observables: Collection[str]) -> Target:
    """Target from its table in a study file; raises StudyFileError."""
    only(entry, set(Target.__dataclass_fields__), "target")
    required(entry, ("observable", "mean"), "target")
    return Target(
        observable=one_of(entry["observable"], "target.observable", observables),
        mean=number(entry["mean"], "target.mean"),
        sd=number(entry["sd"], "target.sd", least=0.0) if "sd" in entry else None,
        n=whole(entry["n"], "target.n", least=2) if "n" in entry else None,
        weight=positive(entry.get("weight", 1.0), "target.weight"),
        margin=positive(entry.get("margin", 2.0), "target.margin"),
        sd_source=str(entry.get("sd_source", "measured")),
        before_mean=number(entry["before_mean"], "target.before_mean") if "before_mean" in entry else None,
        before_sd=number(entry["before_sd"], "target.before_sd", least=0.0) if "before_sd" in entry else None,
        before_n=whole(entry["before_n"], "target.before_n", least=2) if "before_n" in entry else None,
    )


def observed_text(observable: str, value: float) -> str:
    """A value of an observable for a line of progress; only degrees have a unit that goes without saying."""
    return f"{value:.1f}°" if is_angle(observable) else f"{value:.3g}"


def is_angle(observable: str) -> bool:
    """True for an observable in degrees, a single view (``…_deg@90``) included."""
    return observable.partition("@")[0].endswith("_deg")
