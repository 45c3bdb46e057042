"""Effort spent on a study: shapes, mass and numbers of runs."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import ConfigDict

from doe.record import Record
from solver import TABLE, Number, Quantity, Whole

NAME = re.compile(r"[^/\\\x00-\x1f]{1,60}")
"""Allowed names of a profile: the page names folders of results after it."""


@dataclass(frozen=True)
class Profile(Record):
    """Size of a study, as ``[profile.NAME]`` of its file."""

    __pydantic_config__: ClassVar[ConfigDict] = TABLE

    name: str = ""
    spheres: str = "standard"
    """Resolution of the bodies' shapes."""
    mass: Annotated[float, Quantity("kg", above=0.0)] | None = None
    """Poured mass; None: that of the rig."""
    pilot_runs: Annotated[int, Whole(3)] = 20
    change_runs: Annotated[int, Whole(1)] = 10
    screening_replicates: Annotated[int, Whole(1)] = 3
    assumption_replicates: Annotated[int, Whole(1)] = 2
    scan_replicates: Annotated[int, Whole(1)] = 4
    ascent_steps: Annotated[int, Whole(2)] = 6
    ascent_replicates: Annotated[int, Whole(1)] = 3
    surface_replicates: Annotated[int, Whole(1)] = 3
    verification_runs: Annotated[int, Whole(3)] = 12
    resolution_deg: Annotated[float, Number(above=0.0)] | None = None
    """Difference that the replicates, sized by the pilot, have to resolve."""
    max_replicates: Annotated[int, Whole(2)] = 12
    reach_runs: Annotated[int, Whole(0)] = 3
    """Pours at each corner of the factors, to see whether the target can be reached; 0: none."""
