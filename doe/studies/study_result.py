"""Findings of a study, stage by stage: the content of ``result.json``, and of ``partial.json`` while it still runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Self

from doe.provenance import About, PouredPile, SetUp
from doe.record import Document, Record
from doe.run_records import Run, Setting
from doe.stages.ascent import AscentResult
from doe.stages.pilot import PilotResult
from doe.stages.reach import ReachResult
from doe.stages.scan import ScanResult
from doe.stages.screening import ScreeningResult
from doe.stages.stage import FurtherResult
from doe.stages.surface import OptimumResult, SurfaceResult
from doe.stages.verification import VerificationResult
from doe.studies.profile import Profile
from doe.studies.study import REFERENCE, TRIES, Factor, Study, Values
from doe.target import Target
from solver import ClumpFit, Outcome

StageResult = (
    PilotResult
    | ReachResult
    | ScreeningResult
    | ScanResult
    | AscentResult
    | SurfaceResult
    | OptimumResult
    | VerificationResult
    | FurtherResult
)
USUAL_DESIGNS = {"screening": "Plackett–Burman", "assumptions": "Plackett–Burman", "surface": "Box–Behnken"}
"""Stage → title of its design where a result does not state it: older versions offered no choice."""


@dataclass(frozen=True, kw_only=True)
class StudyDescription(Record):
    """Description of a study: its targets, factors and settings.

    ``contact``: the contact law and its conventions; ``tries``: number of seeds tried for one replicate; ``designs``:
    stage → title of its design.
    """

    name: str
    title: str
    file: str
    profile: Profile
    targets: tuple[Target, ...]
    factors: tuple[Factor, ...]
    assumptions: tuple[Factor, ...]
    assumed: tuple[str, ...]
    contact: dict[str, str] = field(default_factory=dict)
    changes: dict[str, Values]
    seed: int | None = None
    tries: int = TRIES
    designs: dict[str, str] = field(default_factory=lambda: dict(USUAL_DESIGNS))

    @staticmethod
    def of(study: Study, profile: Profile, tries: int = TRIES) -> StudyDescription:
        """Return the description of a study that is run with ``profile``."""
        return StudyDescription(
            name=study.name,
            title=study.scene.title,
            file=str(study.file),
            profile=profile,
            targets=study.targets,
            factors=study.factors,
            assumptions=study.assumptions,
            assumed=tuple(study.scene.assumed),
            contact=study.scene.contact.stated,
            changes=study.changes,
            seed=study.seed,
            tries=tries,
            designs={
                "screening": study.screening_design.design.title,
                "assumptions": study.assumption_design.design.title,
                "surface": study.surface_design.design.title,
            },
        )


@dataclass(frozen=True, kw_only=True)
class Stages(Record):
    """Results of all stages, in running order; None for a stage that has not ended or that the study does not have."""

    pilot: PilotResult | None = None
    reach: ReachResult | None = None
    screening: ScreeningResult | None = None
    assumptions: ScreeningResult | None = None
    scan: ScanResult | None = None
    ascent: AscentResult | None = None
    surface: SurfaceResult | None = None
    optimum: OptimumResult | None = None
    verification: VerificationResult | None = None
    further: dict[str, FurtherResult] = field(default_factory=dict)
    """Results of the stages of other packages, by name."""

    def result_of(self, stage: str) -> StageResult | None:
        """Return the result of a stage by its name."""
        found: StageResult | None = getattr(self, stage) if stage in OWN_STAGES else self.further.get(stage)
        return found

    def with_result(self, stage: str, result: StageResult | None) -> Self:
        """Return these results together with that of one more stage."""
        if isinstance(result, FurtherResult):
            return replace(self, further=self.further | {stage: result})
        changes: dict[str, Any] = {stage: result} if stage in OWN_STAGES else {}
        return replace(self, **changes)

    def stage_names(self) -> tuple[str, ...]:
        """Return the names of the stages that these results are for."""
        return (*OWN_STAGES, *self.further)

    def runs_of(self, stage: str) -> tuple[tuple[Run, ...], ...]:
        """Return the runs of each setting of a stage, failed ones included; empty if it made none."""
        found = self.result_of(stage)
        if found is None or isinstance(found, OptimumResult):
            return ()
        return (found.runs,) if isinstance(found, VerificationResult) else found.runs

    def own_runs_of(self, stage: str) -> tuple[Run, ...]:
        """Return the runs of a stage in the study's own rig."""
        return tuple(run for runs in self.runs_of(stage) for run in runs if not run.experiment)

    def reference_runs(self) -> tuple[Run, ...]:
        """Return the pilot's runs at the reference setting in the study's own rig."""
        return tuple(run for run in self.own_runs_of("pilot") if run.label == REFERENCE)

    def settings_of(self, stage: str) -> tuple[Setting, ...]:
        """Return the settings of a stage, in the order of ``runs_of``; also empty for results of older versions."""
        found = self.result_of(stage)
        return () if found is None or isinstance(found, OptimumResult) else found.settings

    def all_runs(self) -> Iterator[tuple[str, Run]]:
        """Return (stage, run) for every run, failed ones included."""
        return ((stage, run) for stage in self.stage_names() for runs in self.runs_of(stage) for run in runs)


OWN_STAGES = tuple(one.name for one in fields(Stages) if one.name != "further")
"""The stages of this package, in running order."""


@dataclass(frozen=True, kw_only=True)
class AllStages(Stages):
    """Results of all stages of a finished study."""

    pilot: PilotResult
    screening: ScreeningResult
    ascent: AscentResult
    surface: SurfaceResult
    optimum: OptimumResult
    verification: VerificationResult


@dataclass(frozen=True, kw_only=True)
class Described(Document):
    """A file of results together with the description of its study."""

    SCHEMA: ClassVar[int] = 1
    NAME: ClassVar[str] = "result of a study"

    study: StudyDescription


@dataclass(frozen=True, kw_only=True)
class PartialStudy(Stages, Described):
    """Results so far of a running study: ``partial`` is the stage that is running, ``line`` its analysis in words."""

    partial: str | None = None
    line: str = ""


@dataclass(frozen=True)
class ListedRun(Record):
    """One run in the list of all runs of a study."""

    stage: str
    label: str
    seed: int
    outcome: str
    key: str


@dataclass(frozen=True)
class RunCounts(Record):
    """Number of runs, in total, by outcome and by stage, and the list of all runs."""

    total: int
    valid: int
    by_outcome: dict[str, int]
    by_stage: dict[str, int]
    list: tuple[ListedRun, ...]

    @staticmethod
    def of(stages: Stages) -> RunCounts:
        """Return the counts over all stages."""
        runs = list(stages.all_runs())
        return RunCounts(
            total=len(runs),
            valid=sum(run.valid for _, run in runs),
            by_outcome=dict(Counter(run.outcome for _, run in runs)),
            by_stage=dict(Counter(stage for stage, _ in runs)),
            list=tuple(ListedRun(stage, run.title, run.seed, run.outcome, run.key) for stage, run in runs),
        )

    def outcomes(self) -> Mapping[str, Counter[str]]:
        """Return stage → outcome → number of runs, stages in running order."""
        found: dict[str, Counter[str]] = {}
        for run in self.list:
            found.setdefault(run.stage, Counter())[run.outcome] += 1
        return found


@dataclass(frozen=True)
class Timing(Record):
    """Time [s] in total and by stage; ``reused_runs``: number of runs found in the store."""

    total_s: float
    stage_s: dict[str, float]
    runs_per_minute: float
    reused_runs: int = 0


@dataclass(frozen=True)
class PouredBody(Record):
    """A body of the mixture: its mass [kg], and how well its member spheres represent its solid."""

    body: str
    mass: float
    spheres: str
    fit: ClumpFit


@dataclass(frozen=True, kw_only=True)
class StudyResult(AllStages, Described):
    """Everything that a finished study found: the content of ``result.json``."""

    runs: RunCounts
    timing: Timing
    versions: dict[str, str | None]
    shapes: tuple[PouredBody, ...]
    about: About = field(default_factory=About)
    set_up: SetUp | None = None
    """None in results of older versions."""
    experiments: dict[str, SetUp] = field(default_factory=dict)
    """Name → set-up of each further experiment."""
    piles: tuple[PouredPile, ...] = ()
    """Piles at the reference setting and at the optimum; empty for a rig without a free pile."""


AnyStudy = PartialStudy | StudyResult


def study_from(content: Mapping[str, Any]) -> AnyStudy:
    """Return the result in a file, of a finished study or of a running one.

    Raises VersionError for a result of another version, RecordError for anything else that is not a result.
    """
    return StudyResult.from_dict(content) if "runs" in content else PartialStudy.from_dict(content)


def valid_runs(outcomes: Mapping[str, int]) -> int:
    """Return the number of valid runs among counted outcomes."""
    return sum(number for outcome, number in outcomes.items() if Outcome(outcome).valid)
