"""A stage after the verification: the optimum poured again as often as ``[stage.repeatability] runs`` says."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from doe.errors import StudyFileError
from doe.run_records import Runner, Setting, responses
from doe.stages.stage import Chain, FurtherResult, Stage, ended
from doe.studies.profile import Profile
from doe.studies.study import Study


class Repeatability(Stage):
    """The spread of one pour at the optimum."""

    name = "repeatability"
    title = "Repeatability at the optimum"
    after = "verification"

    def check(self, study: Study, table: Mapping[str, Any]) -> None:
        """``runs`` is all that it takes."""
        runs = table.get("runs")
        if set(table) - {"runs"} or not isinstance(runs, int) or runs < 2:
            raise StudyFileError(f"stage.repeatability: {dict(table)!r}; allowed: runs, a whole number of at least 2")

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """As the study says."""
        return int(study.further[self.name]["runs"])

    def run(self, chain: Chain, runner: Runner) -> FurtherResult:
        """Pour, and take the standard deviation of the first target's observable."""
        values = ended(chain.found.optimum).values
        settings = [Setting("optimum again", dict(values), self.planned_runs(chain.study, chain.profile))]
        rows = runner.run(self.name, settings)
        name = chain.study.targets[0].observable
        seen = responses(rows, name)[0]
        seen = seen[~np.isnan(seen)]
        spread = float(seen.std(ddof=1)) if seen.size > 1 else float("nan")
        return FurtherResult(
            line=f"{name}: standard deviation {spread:.3g} over {seen.size} pours",
            facts={"standard deviation": spread, "observable": name},
            settings=tuple(settings),
            runs=tuple(tuple(runs) for runs in rows),
        )


STAGE = Repeatability()
