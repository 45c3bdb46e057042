"""The interface of a stage of a study: a name, the runs that it plans, and a result with its findings in one line.

To add a stage, declare in your own package an entry point ``stage.NAME`` (``solver/plugins.py``) that refers to an
object of :class:`Stage`. It runs in the studies whose file has a table ``[stage.NAME]``, after the stage that it names,
with the results found before it. Progress, store, result, report and page treat it like the stages of this package.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from doe.errors import StudyFileError
from doe.record import Record
from doe.run_records import Run, Runner, Setting
from doe.studies.profile import Profile
from doe.studies.study import Study

if TYPE_CHECKING:
    from doe.studies.study_result import StageResult, Stages

Bias = dict[str, tuple[tuple[float, float], ...]]
"""Estimator → its error [°] on piles of known angle: (mean, standard error) for each way to fill a cone with bodies."""
Found = TypeVar("Found")


@dataclass(frozen=True)
class Chain:
    """Inputs of a stage. Once the pilot has ended, ``profile`` has the replicates that it asked for."""

    study: Study
    profile: Profile
    bias: Bias
    found: Stages


@dataclass(frozen=True, kw_only=True)
class FurtherResult(Record):
    """Findings of a stage of another package: one line, named numbers or words, sentences, and its runs."""

    line: str
    facts: dict[str, float | str]
    notes: tuple[str, ...] = ()
    settings: tuple[Setting, ...] = ()
    runs: tuple[tuple[Run, ...], ...] = ()


class Stage(ABC):
    """A stage of a study."""

    name: ClassVar[str]
    title: ClassVar[str]
    """Heading of its section in a report."""
    after: ClassVar[str] = "verification"
    """For a stage of another package: the stage that it follows."""

    def check(self, study: Study, table: Mapping[str, Any]) -> None:
        """Raise StudyFileError for a table ``[stage.NAME]`` that does not fit; by default, for any non-empty table."""
        if table:
            raise StudyFileError(f"stage.{self.name}.{next(iter(table))}: unknown key; allowed: none")

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Return the number of valid runs that it will make, not counting replacements of failed runs."""
        return 0

    @abstractmethod
    def run(self, chain: Chain, runner: Runner) -> StageResult | None:
        """Run and analyse it; None if the study does not declare it. ``runner`` may return only some of the runs."""


def ended(result: Found | None) -> Found:
    """Return the result of an earlier stage, which must exist."""
    assert result is not None, "a stage was run before the one that it builds on"
    return result
