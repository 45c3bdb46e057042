"""Finished studies with a planted truth, from every stage significant to nothing found, for the tests of the report.

And what a reader sees of a report: the text of its page, the tables of its Markdown.
"""

import dataclasses
import functools
import json
import re

from doe.studies.campaign import run_campaign
from doe.studies.profile import Profile
from doe.studies.study import load_study
from doe.studies.study_result import study_from
from explorer.report import report_markdown
from explorer.study.run import result_of
from tests.doe.formula_runner import FormulaRunner

STUDY = load_study("sunflower_extract")
BIAS = {name: tuple((k * step - 0.5, 0.1) for step in (0.3, 3.0, -1.5)) for k, name in enumerate(STUDY.estimators)}
PROFILE = Profile("test", mass=0.030, pilot_runs=10, change_runs=6, verification_runs=20, reach_runs=0)
QUICK = Profile("quick", "coarse", 0.012, 6, 3, 1, 1, 1, 6, 1, 1, 6, reach_runs=3)
DENSITY = dataclasses.replace(
    STUDY.targets[0], observable="bulk_density_kg_m3", mean=150.0 + 5.0 * 24.68, sd=2.0, sd_source="measured"
)
HOSTILE = "<script>alert('x')</script> & | `co` \"q\" 日本"


def planted(values):
    """Three factors and the outlet height act; 23° at the reference setting."""
    friction = (float(values.get("pair.seed.seed.static_friction", 0.57)) - 0.595) / 0.125
    modulus = (float(values.get("material.seed.shear_modulus", 56.3e6)) - 55.3e6) / 15.2e6
    bounce = (float(values.get("pair.seed.seed.restitution", 0.57)) - 0.59) / 0.09
    height = (float(values.get("rig.outlet_height", 0.065)) - 0.065) / 0.01
    return 24.0 + 4.0 * friction + 3.0 * modulus + 2.0 * bounce - 3.0 * height


class RowWithoutPile(FormulaRunner):
    """Every pour of the third screening row jams."""

    def _once(self, stage, row, setting, replicate, attempt):
        run = super()._once(stage, row, setting, replicate, attempt)
        return dataclasses.replace(run, outcome="jammed") if stage == "screening" and row == 2 else run


BARE = dataclasses.replace(STUDY, name=HOSTILE, scan_path=None, scan_values=(), assumptions=(), changes={})
CASES = {
    "planted": (STUDY, PROFILE, FormulaRunner(planted, sigma=2.0, jam=0.05)),
    "nothing acts": (STUDY, PROFILE, FormulaRunner(lambda values: 20.0, sigma=2.0)),
    "out of reach": (STUDY, PROFILE, FormulaRunner(lambda values: planted(values) - 40.0, sigma=0.5)),
    "one pour per row": (STUDY, QUICK, FormulaRunner(planted, sigma=0.5, jam=0.05)),
    "two targets": (
        dataclasses.replace(
            STUDY, targets=(*STUDY.targets, DENSITY), estimators=(*STUDY.estimators, DENSITY.observable)
        ),
        PROFILE,
        FormulaRunner(planted, sigma=0.5),
    ),
    "missing row": (STUDY, PROFILE, RowWithoutPile(planted, sigma=0.8)),
    "no assumptions, no scan": (BARE, PROFILE, FormulaRunner(planted, sigma=0.8)),
    "ended measured": (BARE, PROFILE, FormulaRunner(planted, sigma=0.8, jam=0.05, ended="measured")),
}


def result_of_case(name):
    """The content of result.json, as a reader of the file finds it; a copy, which a test may change."""
    return json.loads(_text_of_case(name))


@functools.cache
def _text_of_case(name):
    study, profile, runner = CASES[name]
    result = result_of(study, profile, run_campaign(study, profile, runner, BIAS), 912.5)
    return json.dumps(result.to_dict(), allow_nan=False)


def typed(result):
    """The result as the report gets it."""
    return study_from(result)


def visible(page):
    """Text of a page as a reader sees it."""
    return re.sub(r"<[^>]+>", " ", re.sub(r"<(script|style)[^>]*>.*?</\1>", " ", page, flags=re.DOTALL))


def tables_in(markdown):
    """Every table of a Markdown text as rows of unescaped cells, by its first header cells."""
    found = {}
    for block in markdown.split("\n\n"):
        if block.startswith("|"):
            lines = [re.split(r"(?<!\\)\|", line)[1:-1] for line in block.splitlines()]
            rows = [[re.sub(r"\\(.)", r"\1", cell.strip()) for cell in line] for line in lines]
            found.setdefault(tuple(rows[0]), rows[2:])
    return found


def table(result, *start):
    tables = tables_in(report_markdown(typed(result)))
    return next(rows for header, rows in tables.items() if header[: len(start)] == start)
