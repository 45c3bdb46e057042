"""Response surface: the runs of a design, a second-order model of each target, and the optimum with its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from doe.analysis.canonical import Canonical, canonical_analysis
from doe.analysis.joint_posterior import JointPosterior, joint_posterior
from doe.analysis.optimum import Compromise, Optimum, find_compromise, find_optimum
from doe.analysis.power import smallest_effect
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import Surface, fit_surface
from doe.analysis.surface_anova import SurfaceAnova, analyse_surface
from doe.record import Record
from doe.run_records import FloatArray, Run, Runner, Setting, no_pile_shares, responses
from doe.stages.stage import Chain, Stage, ended
from doe.studies.profile import Profile
from doe.studies.study import CALIBRATED, Factor, Study
from doe.target import Target


@dataclass(frozen=True, kw_only=True)
class SurfaceResult(Record):
    """Runs of the design and, for each target in the study's order, model, ANOVA and canonical analysis."""

    factors: tuple[Factor, ...]
    region: Region
    design: FloatArray
    natural: FloatArray
    settings: tuple[Setting, ...] = ()
    runs: tuple[tuple[Run, ...], ...]
    no_pile_share: FloatArray
    observables: tuple[str, ...]
    models: tuple[Surface, ...]
    anova: tuple[SurfaceAnova, ...]
    canonical: tuple[Canonical, ...]
    smallest_main_effect: tuple[float, ...]
    """Per target: the change from low to high of any one factor that would have been detected with power 0.8."""

    @property
    def line(self) -> str:
        """The findings of the surface in one line."""
        a = self.anova[0]
        return f"R² {a.r_squared:.2f}, adjusted {a.r_squared_adjusted:.2f}, predicted {a.r_squared_predicted:.2f}"


CONTRADICTION = 0.01
"""p of their joint misfit below which several targets contradict each other and identify nothing."""


@dataclass(frozen=True)
class Estimate:
    """Estimate of one factor from the targets [SI].

    ``low`` … ``high``: its 95 % interval if it is ``identified``, otherwise the range that gives the target; NaN if no
    value does.
    """

    value: float
    low: float
    high: float
    identified: bool


@dataclass(frozen=True)
class OptimumResult(Record):
    """The chosen setting: path → value [SI], and how it was found (one target: ``single``, several: ``compromise``).

    ``posterior``: the joint posterior of all targets; None with more factors than it is computed for, and in results of
    older versions.
    """

    values: dict[str, float]
    factors: tuple[Factor, ...]
    single: Optimum
    compromise: Compromise | None
    posterior: JointPosterior | None = None

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Path → estimate of each factor; with several targets from the joint posterior, where there is one."""
        joint = self.posterior if self.compromise is not None else None
        found = {}
        for k, factor in enumerate(self.factors):
            if joint is not None:
                ends, known = (joint.low[k], joint.high[k]), joint.identified[k] and joint.p >= CONTRADICTION
            else:
                known = self.single.identifies(k)
                one = self.single
                low, high = (one.point_low, one.point_high) if known else (one.solution_low, one.solution_high)
                ends = low[k], high[k]
            found[factor.path] = Estimate(self.values[factor.path], float(ends[0]), float(ends[1]), known)
        return found

    @property
    def line(self) -> str:
        """The optimum in one line."""
        values = ", ".join(f"{path} = {value:.4g}" for path, value in self.values.items())
        if self.compromise is not None:
            open_ = any(not estimate.identified for estimate in self.estimates.values())
            return f"{'chosen by rule: ' if open_ else ''}{values}. {self.compromise.statement}"
        return f"{'chosen by rule: ' if self.single.unidentified else ''}{values}. {self.single.statement}"


def surface(
    study: Study, profile: Profile, runner: Runner, factors: tuple[Factor, ...], region: Region
) -> SurfaceResult:
    """Run the points of the study's design in ``region`` and fit the model of each target."""
    design = study.surface_design.points(len(factors)).coded
    natural = region.natural(design)
    settings = [
        Setting(
            f"point {k + 1}",
            {f.path: float(v) for f, v in zip(factors, point, strict=True)},
            profile.surface_replicates,
            study.all_experiments,
        )
        for k, point in enumerate(natural)
    ]
    rows = runner.run("surface", settings)
    observables = tuple(target.observable for target in study.targets)
    models = tuple(fit_surface(design, responses(rows, name), region) for name in observables)
    return SurfaceResult(
        factors=factors,
        region=region,
        design=design,
        natural=natural,
        settings=tuple(settings),
        runs=tuple(tuple(runs) for runs in rows),
        no_pile_share=no_pile_shares(rows),
        observables=observables,
        models=models,
        anova=tuple(analyse_surface(model) for model in models),
        canonical=tuple(canonical_analysis(model) for model in models),
        smallest_main_effect=tuple(_smallest_main_effect(model) for model in models),
    )


def _smallest_main_effect(model: Surface) -> float:
    # Terms are in the order 1, x₁, x₂, …; with missing runs and in some designs, factors differ in precision.
    worst = float(np.diag(model.information_inverse)[1 : 1 + len(model.names)].max())
    error = 2.0 * math.sqrt(model.mse * worst)
    return smallest_effect(error, model.df_residual)


def optimum(study: Study, fitted: SurfaceResult) -> OptimumResult:
    """Return the setting on the solution surface nearest to the reference values, or the best compromise of targets."""
    return optimum_of(fitted.models, fitted.factors, study.targets, study.seed)


def optimum_of(
    models: tuple[Surface, ...], factors: tuple[Factor, ...], targets: tuple[Target, ...], seed: int
) -> OptimumResult:
    """Return the optimum from the models of the targets; ``seed``: of the refits that give its scatter."""
    reference = np.array([float(factor.reference) for factor in factors])
    target = targets[0]
    single = find_optimum(models[0], target.mean, reference, seed=seed, target_standard_error=target.standard_error)
    compromise = None
    point = single.point
    if len(targets) > 1:
        compromise = find_compromise(models, targets, reference)
        point = compromise.point
    return OptimumResult(
        values={f.path: float(v) for f, v in zip(factors, point, strict=True)},
        factors=factors,
        single=single,
        compromise=compromise,
        posterior=joint_posterior(models, targets),
    )


class SurfaceStage(Stage):
    """The response surface."""

    name = "surface"
    title = "Response surface"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Runs at every point of the design."""
        points = len(study.surface_design.points(CALIBRATED).coded)
        return points * profile.surface_replicates * len(study.all_experiments)

    def run(self, chain: Chain, runner: Runner) -> SurfaceResult:
        """See :func:`surface`; in the region found by the ascent."""
        walked = ended(chain.found.ascent)
        return surface(chain.study, chain.profile, runner, walked.factors, walked.region)


class OptimumStage(Stage):
    """The setting that gives the target; it makes no runs."""

    name = "optimum"
    title = "Optimum"

    def run(self, chain: Chain, runner: Runner) -> OptimumResult:
        """See :func:`optimum`."""
        return optimum(chain.study, ended(chain.found.surface))
