"""The stages of a study, one file each (``stage.py`` explains how to add one)."""

from doe.errors import StudyFileError
from doe.stages.ascent import AscentStage
from doe.stages.pilot import PilotStage
from doe.stages.reach import ReachStage
from doe.stages.scan import ScanStage
from doe.stages.screening import AssumptionStage, ScreeningStage
from doe.stages.stage import Stage
from doe.stages.surface import OptimumStage, SurfaceStage
from doe.stages.verification import VerificationStage
from doe.studies.profile import Profile
from doe.studies.study import Study
from solver import Registry, instance_of

OWN: tuple[Stage, ...] = (
    PilotStage(),
    ReachStage(),
    ScreeningStage(),
    AssumptionStage(),
    ScanStage(),
    AscentStage(),
    SurfaceStage(),
    OptimumStage(),
    VerificationStage(),
)
"""The stages of this package, in running order."""
STAGES: Registry[Stage] = Registry("stage", OWN, instance_of(Stage))


def stages_of(study: Study) -> tuple[Stage, ...]:
    """Return the stages of ``study`` in running order; raises StudyFileError if a stage refuses its table."""
    order = list(OWN)
    for name, table in study.further.items():
        stage = STAGES[name]
        stage.check(study, table)
        before = [one.name for one in order]
        if stage.after not in before:
            raise StudyFileError(
                f"stage.{name}: follows {stage.after!r}, which is not among the stages before it: {', '.join(before)}"
            )
        order.insert(before.index(stage.after) + 1, stage)
    return tuple(order)


def planned_runs(study: Study, profile: Profile) -> dict[str, int]:
    """Return the number of valid runs that each stage will make, not counting replacements of failed runs."""
    return {stage.name: stage.planned_runs(study, profile) for stage in stages_of(study)}
