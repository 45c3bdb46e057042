"""What was measured, and how well."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import ConfigDict

from doe.record import Record
from solver import TABLE, Number, Whole


@dataclass(frozen=True)
class Target(Record):
    """A measured observable: mean and standard deviation of ``n`` measurements, and the margin of equivalence.

    The default of the margin is 2°; a study has to state that of any other observable (``doe/studies/study.py``).
    ``before_…``: mean and standard deviation of n pours of the model that this study improves on; None without one.
    A ``[[target]]`` of a study file.
    """

    __pydantic_config__: ClassVar[ConfigDict] = TABLE

    observable: str
    mean: Annotated[float, Number()]
    sd: Annotated[float, Number(least=0.0)] | None = None
    n: Annotated[int, Whole(2)] | None = None
    weight: Annotated[float, Number(above=0.0)] = 1.0
    margin: Annotated[float, Number(above=0.0)] = 2.0
    sd_source: str = "measured"
    before_mean: Annotated[float, Number()] | None = None
    before_sd: Annotated[float, Number(least=0.0)] | None = None
    before_n: Annotated[int, Whole(2)] | None = None

    @property
    def standard_error(self) -> float:
        """Standard error sd/√n of the measured mean; 0 where the study states no sd or no n."""
        return 0.0 if self.sd is None or self.n is None else self.sd / math.sqrt(self.n)


def observed_text(observable: str, value: float) -> str:
    """Return a value of an observable for a progress line; only degrees are given with their unit."""
    return f"{value:.1f}°" if is_angle(observable) else f"{value:.3g}"


def experiment_of(observable: str) -> str:
    """Return the experiment of ``observable``: "drum" for "drum/dynamic_angle_deg", "" for the study's own rig."""
    return observable.rpartition("/")[0]


def is_angle(observable: str) -> bool:
    """Return whether an observable is in degrees, including that of a single view (``…_deg@90``)."""
    return observable.partition("@")[0].endswith("_deg")
