"""What a stage of a study is to everything outside it: a name, the runs that it plans, and a result with one line.

To add one: an entry point ``stage.NAME`` of a package of one's own (``solver/plugins.py``) that names an object of
:class:`Stage`. It runs in the studies whose file has a table ``[stage.NAME]``, after the stage that it names, with what
was found before it; progress, store, result, report and page treat it like the stages of this package.
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
"""Estimator → its error [°] on piles of known angle, (mean, standard error) for each way to fill a cone with bodies."""
Found = TypeVar("Found")


@dataclass(frozen=True)
class Chain:
    """What a stage may build on. ``profile`` has the replicates that the pilot asked for, once it has ended."""

    study: Study
    profile: Profile
    bias: Bias
    found: Stages


@dataclass(frozen=True, kw_only=True)
class FurtherResult(Record):
    """What a stage of another package found: one line, named numbers or words, sentences, and its runs."""

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
    """Of a stage of another package: the stage that it follows."""

    def check(self, study: Study, table: Mapping[str, Any]) -> None:
        """Refuse a table ``[stage.NAME]`` with a StudyFileError; by default one that is not empty."""
        if table:
            raise StudyFileError(f"stage.{self.name}.{next(iter(table))}: unknown key; allowed: none")

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Valid runs that it will make, replacements of failed runs not counted."""
        return 0

    @abstractmethod
    def run(self, chain: Chain, runner: Runner) -> StageResult | None:
        """Run and analyse it; None if the study does not declare it. ``runner`` may hold some of the runs only."""


def ended(result: Found | None) -> Found:
    """The result of an earlier stage."""
    assert result is not None, "a stage was run before the one that it builds on"
    return result
