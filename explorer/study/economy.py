"""``explorer verify --economy``: pour a material with and without an economy, and say whether the piles are alike.

Pours are kept in a store, so an interrupted comparison continues where it stopped.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from doe.pour_runner import PourRunner
from doe.store import Store, default_store
from doe.studies.economy import ALPHA, ECONOMIES, MARGIN, POWER, EconomyTest, compare, pours_needed, rows_of
from doe.studies.study import load_study, with_profile
from explorer.errors import CommandError
from explorer.files.output_file import write_whole
from explorer.files.run_folder import json_text
from explorer.terminal.text_table import text_table
from solver import WorkerPool

Say = Callable[[str], None]
SEED = 20261123
"""Root of the seeds of all pours."""
TIMED = 2
"""Pours of each kind after which the total time is estimated."""


def compare_economy(
    study_name: str, profile_name: str, change: str, pours: int, store: Path | None, out: Path | None, say: Say
) -> EconomyTest:
    """Run the comparison of one economy.

    Parameters
    ----------
    study_name, profile_name
        A shipped study or a study file, and the profile that gives shapes and mass.
    change
        Name of the economy (``doe.studies.economy.ECONOMIES``).
    pours
        Number of each kind at each of the three settings.
    store, out
        Where pours are kept (None: the default store), and the file for the result.
    say
        Takes lines for the user.

    Returns
    -------
    The result; also written to ``out`` after every tenth of the pours.

    Raises
    ------
    CommandError
        For an economy that does not exist.
    """
    if change not in ECONOMIES:
        raise CommandError(f"--change: {change!r} is not one of {', '.join(ECONOMIES)}")
    economy = ECONOMIES[change]
    study, _ = with_profile(load_study(study_name), profile_name)
    rows = rows_of(study, economy, TIMED)
    kept = Store(store or default_store())

    def told(found: EconomyTest) -> None:
        if out is not None:
            write_whole(out, json_text(found.to_dict()) + "\n")
        alike = sum(one.equivalent for one in found.compared)
        say(
            f"{found.pours} of {pours} pours of each kind: {alike} of {len(found.compared)} means equivalent so far, "
            f"cost {found.cost:.2f}"
        )

    try:
        with WorkerPool() as pool:
            runner = PourRunner(study.scene, kept, f"economy of {study.name}", SEED, pours=pool.run_queue, tries=1)
            first = runner.run(f"economy {economy.name}", rows)
            each = sum(run.wall_s for runs in first for run in runs) / (TIMED * len(rows))
            minutes = each * pours * len(rows) / pool.workers / 60.0
            say(
                f"{economy.name}: {economy.reason}; {pours} pours of each kind at {len(rows) // 2} settings, about "
                f"{minutes:.0f} min (margin {MARGIN:g} SD of one pour, "
                f"alpha {ALPHA:g}; power {POWER:g} takes {pours_needed()})"
            )
            return compare(study, economy, runner, pours, told)
    finally:
        kept.close()


def economy_text(found: EconomyTest) -> str:
    """The comparison as a table, and the verdict."""
    header = ("setting", "observable", "full", "economical", "difference, SD", "90 % interval, SD", "equivalent")
    lines = []
    for one in found.compared:
        sd = one.full.sd
        interval = f"{one.low / sd:+.2f} … {one.high / sd:+.2f}"
        difference = f"{(one.economical.mean - one.full.mean) / sd:+.2f}"
        means = (f"{one.full.mean:.4g}", f"{one.economical.mean:.4g}")
        lines.append([one.setting, one.observable, *means, difference, interval, "yes" if one.equivalent else "NO"])
    text = [text_table(header, lines)]
    for shares in found.shares:
        (valid, total), (cheap, others) = shares.full, shares.economical
        text.append(f"valid pours, {shares.setting}: {valid} of {total}, {cheap} of {others} (p = {shares.p:.2g})")
    verdict = "accepted" if found.accepted else "not accepted"
    text.append(f"{found.economy}: {verdict}; a pour costs {found.cost:.2f} of a full one ({found.pours} of each kind)")
    return "\n".join(text)
