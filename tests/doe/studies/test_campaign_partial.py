"""A stage analysed over the runs that have ended so far."""

import dataclasses

import pytest

from doe.errors import StatisticsError
from doe.run_records import Setting
from doe.studies.campaign import LEAST_INTERVAL, KnownRuns, PartialStages, run_campaign
from tests.doe.formula_runner import FormulaRunner
from tests.explorer.reported_studies import BIAS, PROFILE, STUDY, planted


class Followed(FormulaRunner):
    """Tells a follower of every run, the whole design once and then again, as the pours do."""

    def __init__(self, follower, **more):
        super().__init__(planted, **more)
        self._follower = follower

    def run(self, stage, settings):
        rows = super().run(stage, settings)
        for replicate in range(max(len(runs) for runs in rows)):
            for runs in rows:
                for run in (one for one in runs if one.replicate == replicate):
                    self._follower.add(stage, run)
        return rows


class Clock:
    """Goes on by two seconds at each look, so that about every second run is analysed."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        self.now += 2.0
        return self.now


@pytest.fixture(scope="module")
def followed(request):
    """[(stage, partial result)] of a study, and its result."""
    seen = []
    patch = pytest.MonkeyPatch()
    patch.setattr("doe.studies.campaign.SHARE", 1.0)
    follower = PartialStages(lambda stage, result: seen.append((stage, result)), clock=Clock())
    result = run_campaign(STUDY, PROFILE, Followed(follower, sigma=2.0, jam=0.05), BIAS, on_begin=follower.begin).stages
    patch.undo()
    return seen, result


def test_every_stage_that_makes_runs_shows_itself_before_its_end(followed):
    seen, _ = followed
    stages = ["pilot", "screening", "assumptions", "scan", "ascent", "surface", "verification"]
    assert list(dict.fromkeys(stage for stage, _ in seen)) == stages


def test_a_screening_has_intervals_from_the_first_replicate_of_all_rows_on(followed):
    seen, result = followed
    sizes = [found.analysis.runs for stage, found in seen if stage == "screening"]
    # A mean and 24 factors, of which 10 act on too few bodies and are given up while rows are missing: 15 at least.
    assert sizes == sorted(sizes)
    assert 15 <= sizes[0] <= 28
    early = next(found for stage, found in seen if stage == "screening" and found.analysis.runs >= 28)
    assert early.analysis.dummy_error is not None
    late = [found for stage, found in seen if stage == "screening"][-1]
    assert late.analysis.pure_error.df <= result.screening.analysis.pure_error.df


def test_the_surface_narrows_with_its_runs(followed):
    seen, result = followed
    models = [found.models[0] for stage, found in seen if stage == "surface"]
    assert models[0].df_residual < models[-1].df_residual <= result.surface.models[0].df_residual
    width = [model.standard_error([0.0, 0.0, 0.0]) / model.mse**0.5 for model in models]
    assert width[-1] < width[0]


def test_all_runs_known_give_the_finished_result(followed):
    _, result = followed
    runs = [run for row in result.pilot.runs for run in row]
    rows = KnownRuns(runs[::-1]).run("pilot", [Setting("reference", {}, PROFILE.pilot_runs)])
    assert rows == [list(result.pilot.runs[0])]


def test_analyses_wait_and_runs_of_another_stage_are_left_out():
    seen, now = [], [0.0]
    follower = PartialStages(lambda stage, result: seen.append(result), clock=lambda: now[0])
    follower.add("pilot", None)  # nothing has begun
    follower.begin("scan", lambda runner: runner.run("scan", [Setting("a", {}, 9)]))
    run = FormulaRunner(planted).run("scan", [Setting("a", {}, 3)])[0]
    follower.add("scan", run[0])
    follower.add("scan", run[1])
    follower.add("ascent", run[2])
    assert seen == [[[run[0]]]]
    now[0] = LEAST_INTERVAL
    follower.add("scan", run[2])
    assert seen[1] == [run]


def test_runs_from_the_store_are_analysed_with_the_next_one_that_is_made():
    seen = []
    follower = PartialStages(lambda stage, result: seen.append(result), clock=lambda: 0.0)
    follower.begin("scan", lambda runner: runner.run("scan", [Setting("a", {}, 9)])[0])
    made = FormulaRunner(planted).run("scan", [Setting("a", {}, 3)])[0]
    stored = [dataclasses.replace(run, reused=True) for run in made[:2]]
    for run in stored:
        follower.add("scan", run)
    assert seen == []
    follower.add("scan", made[2])
    assert seen == [[*stored, made[2]]]


def test_too_few_runs_are_no_reason_to_wait():
    seen = []

    def analysis(runner):
        runs = runner.run("scan", [Setting("a", {}, 9)])[0]
        if len(runs) < 3:
            raise StatisticsError("too few")
        return runs

    follower = PartialStages(lambda stage, result: seen.append(result), clock=lambda: 0.0)
    follower.begin("scan", analysis)
    made = FormulaRunner(planted).run("scan", [Setting("a", {}, 5)])[0]
    for run in made:
        follower.add("scan", run)
    assert seen == [made[:3]]
