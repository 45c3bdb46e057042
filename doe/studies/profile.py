"""How much is spent on a study: shapes, mass and the numbers of runs."""

from __future__ import annotations

import re
from dataclasses import dataclass

from doe.errors import StudyFileError
from doe.record import Record
from doe.studies.study_table import Table, only, positive, whole

NAME = re.compile(r"[^/\\\x00-\x1f]{1,60}")

"""What a profile may be called: the page names folders of results after it."""

LEAST = {"pilot_runs": 3, "verification_runs": 3, "ascent_steps": 2}

"""Least value of a number of runs, where it is not 1."""


@dataclass(frozen=True)
class Profile(Record):
    """Size of a study. With ``resolution_deg`` the pilot sizes the replicates so that this difference shows."""

    name: str
    spheres: str = "standard"
    mass: float = 0.030
    pilot_runs: int = 20
    change_runs: int = 10
    screening_replicates: int = 3
    assumption_replicates: int = 2
    scan_replicates: int = 4
    ascent_steps: int = 6
    ascent_replicates: int = 3
    surface_replicates: int = 3
    verification_runs: int = 12
    resolution_deg: float | None = None
    max_replicates: int = 12


COUNTS = tuple(key for key in Profile.__dataclass_fields__ if key.endswith(("_runs", "_replicates", "_steps")))


def profile_from(name: str, entry: Table, spheres: str, mass: float) -> Profile:
    """Profile from its table in a study file, shapes and mass [kg] read already; raises StudyFileError."""
    where = f"profile.{name}"
    if not NAME.fullmatch(name):
        raise StudyFileError(f"profile: {name!r} is no name; allowed: 1 to 60 characters, no / and no \\")
    only(entry, set(Profile.__dataclass_fields__) - {"name"}, where)
    positive(mass, f"{where}.mass")
    counts = {key: whole(entry[key], f"{where}.{key}", LEAST.get(key, 1)) for key in COUNTS if key in entry}
    resolution = positive(entry["resolution_deg"], f"{where}.resolution_deg") if "resolution_deg" in entry else None
    return Profile(name, spheres, mass, resolution_deg=resolution, **counts)
