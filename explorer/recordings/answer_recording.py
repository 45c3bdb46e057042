"""The answer of a diagnosis or a calibration as one recording: what was measured, and the pile before and after it.

    answer                          Markdown: the answer, what is shown, and every error as a number
    measured/world/…                the measured surface as a mesh, and the plate; measured/words: what it is
    measured/curves/<plot>/<name>   the measured angle from end to end, and the discharge where it was weighed
    <model>/…                       one pour of each model as `explorer.recordings.pour_log` writes it, all from time 0
    outlines/<name>                 height over the distance from the pile's middle [mm], mean and ± 1 SD between pours;
                                    heights are negative, for the viewer's axis points down
    errors/<data>/<before|…>        before, after, noise: a bar per observable in multiples of the noise, in the order
                                    of the answer's table

The models of a diagnosis are the calibrated and the corrected one, those of a calibration the declared values and the
optimum. A pour that jams is recorded as any other, with its outcome.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
import rerun as rr
import trimesh

from doe.measurement.measurement import Condition, Role
from doe.measurement.summaries import replicates_of
from doe.run_records import Run, sample_of
from doe.studies.study_result import StudyResult
from explorer.diagnosis.piles import HeightSurface, answer_piles
from explorer.diagnosis.result import DiagnosisResult
from explorer.outcomes import outcome_text
from explorer.recordings.blueprint import CURVES, TIMELINE, Curve, answer_blueprint, curve_entity
from explorer.recordings.pour_log import EYE, PLATE_COLOUR, PourLog, mesh, opened
from explorer.recordings.pour_recorder import FollowedPour
from explorer.report.content import Banner
from explorer.report.diagnosis.answer import banner as diagnosis_banner
from explorer.report.diagnosis.wording import feature_label, feature_value
from explorer.report.sections.answer import banner as study_banner
from explorer.scene.meshes import PLATE_NAME, Triangles, rig_triangles, scene_height
from explorer.study.run_scene import scene_of
from explorer.units import observable_label, observed
from explorer.viewer.palette import BODY_COLOURS, MEASURED, STILL
from solver import Job, Record, Scene, run_pours
from solver.pours.pour import Pour

SEED = 1
"""Of every pour that is recorded; it is told."""
DATA = "measured"
CALIBRATED, CORRECTED = "calibrated", "corrected"
DECLARED, OPTIMUM = "declared", "optimum"
BEFORE, AFTER, NOISE = "before", "after", "noise"
COLOURS = {
    DATA: MEASURED,
    **dict.fromkeys((CALIBRATED, DECLARED, BEFORE), BODY_COLOURS[0]),
    **dict.fromkeys((CORRECTED, OPTIMUM, AFTER), BODY_COLOURS[6]),
    NOISE: STILL,
}
BAR = 0.27
"""Width of a bar; three stand about the number of their observable."""
ANGLE, DISCHARGE = Curve("angle_of_repose_deg", "angle"), Curve("discharged_mass_g", "mass")

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Outline:
    """Mean height over the distance ``x`` from the pile's middle, and its standard deviation between pours [m]."""

    name: str
    x: Array
    mean: Array
    sd: Array


@dataclass(frozen=True)
class ErrorBar:
    """Errors of one observable and the noise, in one unit, in which ``words`` tells a number."""

    label: str
    before: float
    after: float
    noise: float
    words: Callable[[float], str]


@dataclass(frozen=True, eq=False)
class Answer:
    """What is recorded. ``models``: name → scene; ``errors``: what they are of → a bar per observable."""

    banner: Banner
    told: tuple[str, ...]
    """What is shown beside the answer, paragraphs of Markdown."""
    models: Mapping[str, Scene]
    measured: HeightSurface | None
    measured_words: str
    angle: float
    """The measured one [°]; NaN without."""
    discharge: tuple[Array, Array] | None
    """Times since the gate opened [s] and the mean measured mass [kg]; None without."""
    outlines: tuple[Outline, ...]
    errors: Mapping[str, Sequence[ErrorBar]]


def record_diagnosis(path: Path, result: DiagnosisResult, say: Callable[[str], None]) -> None:
    """Record the data of the first fitted condition into the new file ``path``, with a pour of both models there.

    Raises :class:`explorer.errors.CommandError` where the file cannot be made, or the data are not there any more.
    """
    _record(path, diagnosis_answer(result), say)


def record_study(path: Path, result: StudyResult, say: Callable[[str], None]) -> None:
    """The same of a calibration: the declared values, and the optimum that its verification poured."""
    _record(path, study_answer(result), say)


def diagnosis_answer(result: DiagnosisResult) -> Answer:
    """What there is to record of a diagnosis."""
    piles = answer_piles(result)
    condition = piles.condition
    models = {CALIBRATED: piles.before} | ({CORRECTED: piles.after} if result.added else {})
    measured_words = "No pile: in this condition only numbers were measured."
    if piles.measured is not None:
        shown = "mean profile, turned about the axis," if piles.measured.of_revolution else "mean of the scanned piles"
        measured_words = f"The {shown} of {condition.replicates * condition.mean_of} measured pours."
    one_model = () if result.added else ("Nothing is added: the calibrated model is the final one, poured once.",)
    roles: tuple[tuple[Role, str], ...] = (("holdout", "held-out"), ("fit", "fitted"))
    return Answer(
        banner=diagnosis_banner(result),
        told=(
            f"Condition *{condition.name}*, seed {SEED}.",
            *one_model,
            f"Measured: {measured_words}",
            _numbers(result, condition),
        ),
        models=models,
        measured=piles.measured,
        measured_words=measured_words,
        angle=piles.angle[0],
        discharge=_measured_discharge(condition),
        outlines=tuple(
            Outline(name, one.radius, band.mean, band.sd)
            for one in result.piles
            if one.condition == condition.name
            for name, band in zip((DATA, *models), (one.measured, one.before, one.after), strict=False)
        ),
        errors={
            words: [
                ErrorBar(
                    feature_label(row.observable),
                    row.before,
                    row.after,
                    row.noise_floor,
                    partial(feature_value, result, row.observable),
                )
                for row in result.error.of(role)
            ]
            for role, words in roles
            if result.error.of(role)
        },
    )


def study_answer(result: StudyResult) -> Answer:
    """What there is to record of a calibration."""
    poured: dict[str, tuple[str, Sequence[Run]]] = {
        DECLARED: ("pilot", result.reference_runs()),
        OPTIMUM: ("verification", result.own_runs_of("verification")),
    }
    scenes = {name: scene_of(result, stage, runs[0]) for name, (stage, runs) in poured.items() if runs}
    changed = () if all(same for _, same in scenes.values()) else ("Program, study or material have changed since.",)
    targets = ", ".join(
        f"{observable_label(one.observable)} {observed(one.observable, one.mean)}" for one in result.study.targets
    )
    measured_words = f"No pile: the study's targets are numbers, {targets}."
    names = {"reference": DECLARED, "optimum": OPTIMUM}
    return Answer(
        banner=study_banner(result),
        told=(f"Profile {result.study.profile.name}, seed {SEED}.", *changed, f"Measured: {measured_words}"),
        models={name: scene for name, (scene, _) in scenes.items()},
        measured=None,
        measured_words=measured_words,
        angle=next((one.mean for one in result.study.targets if one.observable == ANGLE.name), math.nan),
        discharge=None,
        outlines=tuple(
            Outline(names[pile.name], *(np.array(row) for row in (pile.u, pile.mean, pile.sd))) for pile in result.piles
        ),
        errors={
            "targets": [
                ErrorBar(
                    observable_label(target.observable),
                    abs(sample_of(result.reference_runs(), target.observable).mean - target.mean),
                    abs(test.simulated.mean - target.mean),
                    test.simulated.sd if target.sd is None else target.sd,
                    partial(observed, target.observable),
                )
                for target, test in zip(result.verification.targets, result.verification.tests, strict=True)
            ]
        },
    )


def _measured_discharge(condition: Condition) -> tuple[Array, Array] | None:
    found = condition.offered.get("discharged_mass_kg")
    return None if found is None or found.x is None else (found.x, np.nanmean(found.values, axis=0))


def _numbers(result: DiagnosisResult, condition: Condition) -> str:
    """Every number of ``condition``: measured mean ± SD, or what is stated of a single one, and both models' means."""
    measured = replicates_of(condition)
    rows = measured.values
    data = dict(zip(measured.summaries, zip(rows.mean(axis=0), measured.deviation, strict=True), strict=True))
    models = result.confirmation.before, result.confirmation.after
    poured = [one for model in models for one in model.conditions if one.condition == condition.name]
    spread = "stated" if measured.alone else "SD"
    lines = [f"| number (n = {len(rows)}) | measured ± {spread} | before | after |", "|-|-|-|-|"]
    for k, name in enumerate(next(one.summaries for one in result.measured if one.condition == condition.name)):
        mean, sd = (feature_value(result, name, float(one)) for one in data.get(name, (math.nan, math.nan)))
        means = " | ".join(feature_value(result, name, float(one.mean[k])) for one in poured)
        lines.append(f"| {feature_label(name)} | {mean} ± {sd} | {means} |")
    return "\n".join(lines)


def _record(path: Path, answer: Answer, say: Callable[[str], None]) -> None:
    eye = EYE * max(scene_height(scene) for scene in answer.models.values())
    charts = [of for of, rows in answer.errors.items() if _charted(rows)]
    layout = answer_blueprint(eye, tuple(answer.models), answer.measured is not None, bool(answer.outlines), charts)
    stream = opened(path, layout)
    try:
        _log_what_stands(stream, answer)
        records = []
        for name, scene in answer.models.items():
            say(f"pouring the {name} model, seed {SEED}")
            records.append(_pour(stream, name, scene))
            say(f"{name}: {outcome_text(records[-1].outcome, records[-1].message)}")
        _log_measured_curves(stream, answer, records)
    finally:
        stream.flush()
        stream.disconnect()
    say(f"{path}: {', '.join((DATA, *answer.models))}; `explorer replay {path}` shows them")


def _log_what_stands(stream: rr.RecordingStream, answer: Answer) -> None:
    """Everything that has no time."""
    stream.log("answer", rr.TextDocument(answer_document(answer), media_type="text/markdown"), static=True)
    stream.log("measured/words", rr.TextDocument(answer.measured_words), static=True)
    if answer.measured is not None:
        stream.log("measured/world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        stream.log("measured/world/pile", mesh(_triangles(answer.measured), (*MEASURED, 255)), static=True)
        plate = rig_triangles(next(iter(answer.models.values())).rig).get(PLATE_NAME)
        if plate is not None:
            stream.log("measured/world/plate", mesh(plate, PLATE_COLOUR), static=True)
    for outline in answer.outlines:
        stream.log(f"outlines/{outline.name}", _strips(outline), static=True)
    for of, rows in answer.errors.items():
        charted = _charted(rows)
        at = np.array([number for number, _ in charted], dtype=float)
        for side, name in enumerate((BEFORE, AFTER, NOISE) if charted else (), start=-1):
            ratios = np.array([getattr(row, name) / row.noise for _, row in charted])
            widths = np.full(len(ratios), BAR)
            chart = rr.BarChart(ratios, abscissa=at + side * BAR, widths=widths, color=(*COLOURS[name], 255))
            stream.log(f"errors/{of}/{name}", chart, static=True)


def _log_measured_curves(stream: rr.RecordingStream, answer: Answer, records: Sequence[Record]) -> None:
    """The measured angle over the time of all pours, and the discharge on the clock of the first one."""
    end = max(float(record.trace.time[-1]) for record in records)
    curves: dict[Curve, tuple[Array, Array]] = {}
    if math.isfinite(answer.angle):
        curves[ANGLE] = np.array([0.0, end]), np.full(2, answer.angle)
    if answer.discharge is not None:
        curves[DISCHARGE] = answer.discharge[0] + records[0].gate_opened, 1e3 * answer.discharge[1]
    for curve, (times, values) in curves.items():
        _name_curve(stream, DATA, curve)
        for time, value in zip(times.tolist(), values.tolist(), strict=True):
            stream.set_time(TIMELINE, duration=time)
            stream.log(f"{DATA}/{curve_entity(curve)}", rr.Scalars(value))


def _pour(stream: rr.RecordingStream, name: str, scene: Scene) -> Record:
    with PourLog(stream, scene, SEED, f"{name}/") as log:
        for curve in CURVES:
            _name_curve(stream, name, curve)
        followed = FollowedPour(log)

        def sample(_: int, pour: Pour) -> None:
            followed.sample(pour)

        # With one thread its kernels are those of `explorer simulate` and the page.
        ((_, record),) = run_pours([Job(scene, SEED)], threads=1, on_sample=sample)
        followed.finish(record)
    return record


def _name_curve(stream: rr.RecordingStream, whose: str, curve: Curve) -> None:
    """Tell it from the same curve of others in one chart."""
    look = rr.SeriesLines(names=f"{whose}: {curve.name}", colors=[*COLOURS[whose], 255])
    stream.log(f"{whose}/{curve_entity(curve)}", look, static=True)


def _charted(rows: Sequence[ErrorBar]) -> list[tuple[int, ErrorBar]]:
    """The errors that have a noise to be held against, each with its number in the table."""
    return [
        (number, row)
        for number, row in enumerate(rows, start=1)
        if row.noise > 0.0 and math.isfinite(row.before + row.after + row.noise)
    ]


def _strips(outline: Outline) -> rr.LineStrips2D:
    """The mean as a line, and one standard deviation above and below it as thin ones."""
    lines = [
        np.column_stack([1e3 * outline.x, -1e3 * z])
        for z in outline.mean + np.array([[0.0], [1.0], [-1.0]]) * outline.sd
    ]
    return rr.LineStrips2D(
        [line[np.isfinite(line).all(axis=1)] for line in lines],
        radii=rr.Radius.ui_points([1.5, 0.5, 0.5]),
        colors=[*COLOURS[outline.name], 255],
        labels=outline.name,
        show_labels=False,
    )


def _triangles(surface: HeightSurface) -> Triangles:
    """With normals that point up, so that it is shaded as a pile."""
    normals = trimesh.Trimesh(surface.vertices, surface.faces, process=False).vertex_normals
    upwards = np.where(normals[:, 2:] < 0.0, -normals, normals)
    return Triangles(surface.vertices.astype(np.float32), upwards.astype(np.float32), surface.faces.astype(np.uint32))


def answer_document(answer: Answer) -> str:
    """The answer, what is shown, and the errors by the numbers of their bars."""
    parts = [f"# {answer.banner.headline}", answer.banner.why, *answer.told]
    for of, rows in answer.errors.items():
        table = [f"| error, {of} | before | after | noise |", "|-|-|-|-|"]
        table += [
            f"| {k}: {row.label} | {' | '.join(row.words(one) for one in (row.before, row.after, row.noise))} |"
            for k, row in enumerate(rows, start=1)
        ]
        parts.append("\n".join(table))
    return "\n\n".join([*parts, answer.banner.then])
