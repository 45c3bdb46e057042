"""Answers that take the solver: bench tests run on it, a photograph beside a pour. Each is a command in a child.

The page's own process never loads the solver, and what is shown is what the terminal prints.
"""

from __future__ import annotations

import json
import shlex
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from explorer.background.printed import printed
from explorer.files.kept_scene import kept_scene
from explorer.files.run_folder import json_text
from explorer.laboratory.answers import Answer, Ruler, bench_answer, lab_words, measure_words
from explorer.laboratory.run import LabOrder
from explorer.report.figures.bench_series import bench_charts
from explorer.report.plot import Plot, Plots
from explorer.scene.source import command_line, rig_source
from explorer.tables.bench_test import bench_text
from solver import Scene, with_values

ON_THE_SOLVER = "What the solver's own instrument read in the course of the test."
PLOT = "beside.png"


def twin_answer(order: LabOrder) -> Answer:
    """`explorer lab --simulate` and `--bias`: beside the readings' answer, what the test gives on the solver."""
    words = lab_words(order)
    said = printed(words)
    return replace(bench_answer(order), text=said, command=shlex.join(["explorer", *words]))


def rig_answer(scene: Scene, rig: str, values: Mapping[str, float | str], seed: int, folder: Path) -> Answer:
    """`explorer simulate RIG`: a bench test of one body of ``scene``; its parameters are kept as a file in ``folder``.

    ``values``: path → value (SI) of the rig's own parameters. Raises ParameterError before anything is run.
    """
    source = rig_source(rig, str(kept_scene(scene, folder)))
    line = command_line(source, with_values(source.scene, dict(values)), seed)
    data: dict[str, Any] = json.loads(printed([*shlex.split(line)[1:], "--json"]))
    plots: Plots = {title: Plot(partial(dict, spec), ON_THE_SOLVER) for title, spec in bench_charts(data).items()}
    files = {f"{rig}.json": f"{json_text(data)}\n".encode()}
    return Answer(bench_text(data), line, plots, files)


def compared_answer(photo: str, ruler: Ruler, scene: Scene, folder: Path) -> Answer:
    """`explorer measure --from-simulation`: the photograph, and beside it a pour of ``scene`` read by the same fit."""
    words = [*measure_words(photo, ruler), "--from-simulation", str(kept_scene(scene, folder))]
    with tempfile.TemporaryDirectory() as apart:
        drawn = Path(apart) / PLOT
        said = printed([*words, "--plot", str(drawn)])
        content = drawn.read_bytes()
        with Image.open(drawn) as picture:
            pixels = np.asarray(picture.convert("RGB"), dtype=np.uint8)
    return Answer(said, shlex.join(["explorer", *words]), {}, {PLOT: content}, pixels)
