"""A study: its factors, measured targets and numbers of runs, read from a TOML file (:class:`StudyFile`).

The designs of screening, assumptions and surface are Plackett–Burman of 28 runs, Plackett–Burman of 12 runs and
Box–Behnken, unless ``[screening]``, ``[assumptions]`` or ``[surface]`` names another design of ``doe/designs``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, StrictBool

from doe.analysis.surface import second_order_terms, term_names, with_intercept
from doe.designs import DESIGNS, BoxBehnken, ChosenDesign, DesignOptions, PlackettBurman, Points
from doe.designs.design import Alpha
from doe.errors import StatisticsError, StudyFileError
from doe.record import Record
from doe.studies.factors import MIN_BODIES, bodies_touched, checked_levels
from doe.studies.profile import NAME, Profile
from doe.target import Target, experiment_of, is_angle
from solver import (
    OBSERVABLES,
    EffectTables,
    InsertionTable,
    Names,
    NumericsTable,
    ParameterError,
    RigTable,
    Scalar,
    Scene,
    Settings,
    TomlTable,
    Whole,
    asset_path,
    canonical,
    checked,
    is_material,
    load_material,
    naming_file,
    observable_names,
    one_of,
    parameters,
    plugged_in,
    read_toml,
    value,
    with_set_up,
    with_values,
)  # fmt: skip

DUMMIES = 3
"""Number of columns without a factor in a design for main effects alone, unless the file states another."""

IN_STUDIES = DesignOptions(alpha="face-centred")
"""Default options in a study: axial points stay within the searched region."""

SCREENING = ChosenDesign(PlackettBurman(), replace(IN_STUDIES, runs=28))

ASSUMPTIONS = ChosenDesign(PlackettBurman(), replace(IN_STUDIES, runs=12))

SURFACE = ChosenDesign(BoxBehnken(), IN_STUDIES)


def main_effect_design(
    table: DesignTable, key: str, whose: str, usual: ChosenDesign, factors: Sequence[Factor], dummies: int | None
) -> ChosenDesign:
    """Return the design of a stage that estimates main effects, read from its table and checked with its factors.

    ``whose``: key of the factors in the file. ``dummies``: number of columns that must stay free in a design for main
    effects alone; None: three. Raises StudyFileError.
    """
    chosen = _chosen(table, key, usual)
    if not factors:
        return chosen
    name, free = chosen.design.name, DUMMIES if dummies is None else dummies
    try:
        points = chosen.points(len(factors))
    except StatisticsError as error:
        raise StudyFileError(f"{whose}: {len(factors)} in the {name} design of [{key}]: {error}") from None
    _require_inside(points, key, name)
    columns = points.unused.shape[1]
    if columns < free and chosen.design.main_effects_only:
        most = len(factors) + columns - free
        raise StudyFileError(
            f"{whose}: {len(factors)} {whose}s with {free} dummies; allowed: up to {most} in a {len(points.coded)}-run "
            f"{name} design"
        )
    model = with_intercept(points.coded)
    if np.linalg.matrix_rank(model) < model.shape[1]:
        raise StudyFileError(f"{key}.design: {name} cannot tell the main effects of {len(factors)} {whose}s apart")
    named = [factor.name for factor in factors if isinstance(factor.low, str)]
    if named and not (np.abs(points.coded) == 1).all():
        raise StudyFileError(f"{key}.design: {name} has levels between low and high, which {named[0]} has not")
    return chosen


def second_order_design(table: DesignTable, key: str, usual: ChosenDesign, factors: int) -> ChosenDesign:
    """Return the design of a stage that fits a full second-order model; raises StudyFileError if it cannot do so."""
    chosen = _chosen(table, key, usual)
    name = chosen.design.name
    try:
        points = chosen.points(factors)
    except StatisticsError as error:
        raise StudyFileError(f"{key}: {error}") from None
    _require_inside(points, key, name)
    model = second_order_terms(points.coded)
    if np.linalg.matrix_rank(model) < model.shape[1]:
        raise StudyFileError(
            f"{key}.design: the {len(points.coded)} rows of {name} cannot tell apart the {model.shape[1]} terms of a "
            f"second-order model of {factors} factors"
        )
    return chosen


def _chosen(table: DesignTable, key: str, usual: ChosenDesign) -> ChosenDesign:
    design = DESIGNS[one_of(table.design or usual.design.name, f"{key}.design", DESIGNS)]
    values = table.model_dump(exclude={"design"}, exclude_unset=True)
    for name in values:
        if name not in (allowed := ("seed", *(one for one in design.options if one in DesignTable.model_fields))):
            raise StudyFileError(f"{key}.{name}: unknown key; allowed: {', '.join(sorted(('design', *allowed)))}")
    options = usual.options if design.name == usual.design.name else IN_STUDIES
    return ChosenDesign(design, replace(options, **values))


def _require_inside(points: Points, key: str, name: str) -> None:
    """Refuse points beyond low … high, where a parameter may leave its range or a factor become meaningless."""
    furthest = float(np.abs(points.coded).max())
    if furthest > 1.0 + 1e-9:
        raise StudyFileError(
            f"{key}.design: {name} has points {furthest:.3g} times as far out as low and high; allowed: 1, as with "
            'alpha = "face-centred" or "inscribed"'
        )


REFERENCE = "reference"
"""Label of the pilot's setting in which nothing is changed."""

CALIBRATED = 3
"""Number of factors that pass from the screening to the ascent and the response surface."""

TRIES = 3
"""Number of seeds tried for one replicate; a run that jammed or broke is kept with its outcome and replaced."""

OF_ONE_RIG = ("rig", "insertion", "numerics")
"""First parts of the paths of parameters that belong to one experiment, not to the material."""

EXPERIMENT = re.compile(r"[\w-]{1,60}")
"""Allowed names of an experiment: the name precedes those of its observables."""

Values = dict[str, float | str]


@dataclass(frozen=True)
class Factor(Record):
    """A parameter with its low and high level and its measured value, SI or a name."""

    name: str
    path: str
    low: float | str
    high: float | str
    reference: float | str

    def level(self, coded: float) -> float | str:
        """Return the value at a coded level: −1 low, +1 high, linear between; a named level exists only at the ends."""
        if isinstance(self.low, str) or isinstance(self.high, str):
            return self.high if coded > 0 else self.low
        return self.low + 0.5 * (coded + 1.0) * (self.high - self.low)

    def coded(self, value: float | str) -> float:
        """Return the coded level of a value, the inverse of :meth:`level`."""
        if isinstance(self.low, str) or isinstance(self.high, str) or isinstance(value, str):
            return 1.0 if value == self.high else -1.0
        return 2.0 * (value - self.low) / (self.high - self.low) - 1.0


@dataclass(frozen=True)
class Study:
    """A study file, read and checked. ``scene`` holds the reference values of all parameters."""

    name: str
    file: Path
    scene: Scene
    targets: tuple[Target, ...]
    factors: tuple[Factor, ...]
    assumptions: tuple[Factor, ...]
    changes: dict[str, Values]
    scan_path: str | None
    scan_values: tuple[float, ...]
    fallback: tuple[str, ...]
    profiles: dict[str, Profile]
    estimators: tuple[str, ...]
    seed: int = 1
    screening_design: ChosenDesign = SCREENING
    assumption_design: ChosenDesign = ASSUMPTIONS
    surface_design: ChosenDesign = SURFACE
    further: dict[str, Settings] = field(default_factory=dict)
    """Stage of another package → its table."""
    experiments: dict[str, Scene] = field(default_factory=dict)
    """Name → scene of each further experiment with the same material."""
    replaced: tuple[str, ...] = ()
    """A line on each parameter whose reference differs from the material file or the set-up."""

    @property
    def all_experiments(self) -> tuple[str, ...]:
        """Names of all experiments; the first, "", is the study's own rig."""
        return ("", *self.experiments)

    def scene_of(self, experiment: str) -> Scene:
        """Return the scene of an experiment by its name, "" for the study's own rig."""
        return self.experiments[experiment] if experiment else self.scene


class LevelsTable(TomlTable):
    """A ``[[factor]]`` or ``[[assumption]]``."""

    name: str
    path: str
    """Path of the varied parameter."""
    low: Annotated[float | str, Scalar()]
    high: Annotated[float | str, Scalar()]
    reference: Annotated[float | str, Scalar()] | None = None
    """Best guess, within low … high; by default the value in the material file or the set-up."""


class ChangeTable(TomlTable):
    """A ``[[change]]``: other values of parameters, for choosing the estimator."""

    name: str
    values: Settings
    """Path → value."""


class ExperimentTable(TomlTable):
    """An ``[[experiment]]``: the same material in a further rig, read by targets such as "drum/dynamic_angle_deg"."""

    name: str
    rig: RigTable = Field(default_factory=dict)
    insertion: InsertionTable = Field(default_factory=dict)
    numerics: NumericsTable = Field(default_factory=dict)


class ScanTable(TomlTable):
    """One assumption in steps."""

    path: str
    values: list[Annotated[float | str, Scalar()]]


class DesignTable(TomlTable):
    """The design of a stage and its options."""

    design: str | None = None
    runs: Annotated[int, Whole(0)] | None = None
    centre: Annotated[int, Whole(0)] | None = None
    fold: StrictBool = False
    nonregular: StrictBool = False
    generators: Annotated[tuple[str, ...], Names()] = ()
    fraction: Annotated[int, Whole(0)] = 0
    alpha: Alpha = "face-centred"
    seed: Annotated[int, Whole(0)] = 1


class StudyFile(TomlTable):
    """A study file."""

    format: Literal[1]
    title: str = ""
    material: str
    """A shipped material or the path of a material file."""
    rig: RigTable = Field(default_factory=dict)
    insertion: InsertionTable = Field(default_factory=dict)
    numerics: NumericsTable = Field(default_factory=dict)
    effect: EffectTables = Field(default_factory=dict)
    target: list[Target] = Field(default_factory=list)
    """What was measured."""
    factor: list[LevelsTable] = Field(default_factory=list)
    """Factors that are screened, then calibrated; numbers."""
    assumption: list[LevelsTable] = Field(default_factory=list)
    """Factors that are screened only, for nobody published them; numbers or named levels."""
    fallback: Annotated[tuple[str, ...], Names()] = ()
    """Factors that are calibrated if the screening selects too few, in this order."""
    dummies: Annotated[int, Whole(1)] | None = None
    """Least number of dummy columns of a Plackett–Burman table; 3 by default."""
    estimators: Annotated[tuple[str, ...], Names()] | None = None
    """Candidates for the screening's response; the targets' observables are always among them."""
    seed: Annotated[int, Whole(0)] = 1
    screening: DesignTable = DesignTable()
    assumptions: DesignTable = DesignTable()
    surface: DesignTable = DesignTable()
    experiment: list[ExperimentTable] = Field(default_factory=list)
    change: list[ChangeTable] = Field(default_factory=list)
    scan: ScanTable | None = None
    profile: dict[str, Profile] = Field(default_factory=dict)
    """Name → shapes, mass and numbers of runs."""
    stage: dict[str, Settings] = Field(default_factory=dict)
    """Stages of other packages (``doe/stages/stage.py``), each with its options."""


def load_study(name: str) -> Study:
    """Load a study by a shipped name or from a file; a mistake is one line naming file, key and what is allowed."""
    path = asset_path("studies", name)
    with naming_file(path, ParameterError, StudyFileError):
        return study_from(read_toml(path), path)


def with_profile(study: Study, name: str) -> tuple[Study, Profile]:
    """Return the study with the shapes and the mass of profile ``name``, and that profile with the mass that is poured.

    Raises ParameterError if there is no such profile, its mixture leaves too few factors of the fallback list testable,
    it states a resolution in degrees for a target that is not an angle, or its response surface has no degrees of
    freedom for the error.
    """
    if name not in study.profiles:
        raise ParameterError(f"{study.file}: profile: {name!r} is not one of {', '.join(study.profiles)}")
    profile = study.profiles[name]
    weighed = "rig.mass" in parameters(study.scene)
    poured: Values = {"body.spheres": profile.spheres}
    if weighed and profile.mass is not None:
        poured["rig.mass"] = profile.mass
    scene = with_values(study.scene, poured)
    profile = replace(profile, mass=float(value(scene, "rig.mass")) if weighed else None)
    experiments = {
        name: with_values(other, {"body.spheres": profile.spheres}) for name, other in study.experiments.items()
    }
    observable = study.targets[0].observable
    if profile.resolution_deg is not None and not is_angle(observable):
        raise ParameterError(
            f"{study.file}: profile.{name}.resolution_deg: the first target, {observable}, is not in degrees; "
            "allowed with an observable that ends in _deg"
        )
    paths = {factor.name: factor.path for factor in study.factors}
    bodies = {factor: bodies_touched(scene, paths[factor]) for factor in study.fallback}
    rare = {factor: n for factor, n in bodies.items() if n < MIN_BODIES}
    if len(bodies) - len(rare) < CALIBRATED:
        listed = ", ".join(f"{factor} acts on {n:.0f}" for factor, n in rare.items())
        raise ParameterError(
            f"{study.file}: fallback: {listed} bodies in profile {name}; at least {CALIBRATED} factors that act on "
            f"{MIN_BODIES} bodies or more are needed"
        )
    _refuse_without_error(study, profile)
    # What is assumed of shapes and mass is what the profile pours.
    assumed = tuple(replace(one, reference=poured.get(one.path, one.reference)) for one in study.assumptions)
    return replace(study, scene=scene, experiments=experiments, assumptions=assumed), profile


def _refuse_without_error(study: Study, profile: Profile) -> None:
    """A response surface needs at least one run more than terms; checked now rather than after all other stages."""
    rows, terms = (
        len(study.surface_design.points(CALIBRATED).coded),
        len(term_names([str(k) for k in range(CALIBRATED)])),
    )
    sized = profile.resolution_deg is not None  # then the pilot decides, up to the limit
    key = "max_replicates" if sized else "surface_replicates"
    replicates = profile.max_replicates if sized else profile.surface_replicates
    if rows * replicates <= terms:
        raise ParameterError(
            f"{study.file}: profile.{profile.name}.{key}: {replicates} of {rows} points "
            f"leave no error for the {terms} terms of the surface; allowed: at least {terms // rows + 1}"
        )


def study_from(table: Settings, path: Path) -> Study:
    """Return the study of a parsed file. Raises ParameterError or StudyFileError."""
    if is_material(table):
        raise StudyFileError(
            f'{path} is a material, not a study; a study names it (material = "{path.name}"), and '
            f"`explorer new study {path.stem}` writes one"
        )
    file = checked(StudyFile, table)
    scene = with_set_up(load_material(file.material, relative_to=path.parent), table, path.parent)
    factors = tuple(_factor(scene, entry) for entry in file.factor)
    if len(factors) < CALIBRATED:
        raise StudyFileError(f"factor: {len(factors)} factors; at least {CALIBRATED} are needed")
    screening = main_effect_design(file.screening, "screening", "factor", SCREENING, factors, file.dummies)
    assumptions = tuple(_levels(scene, entry) for entry in file.assumption)
    _refuse_twins([*factors, *assumptions])
    for together in (factors, assumptions):
        _require_room(together, [body.name for body in scene.bodies])
    replaced = tuple(_replaced(scene, file.material, table, (*factors, *assumptions)))
    scene = with_values(scene, {one.path: one.reference for one in (*factors, *assumptions)})
    beside = main_effect_design(file.assumptions, "assumptions", "assumption", ASSUMPTIONS, assumptions, None)
    _require_rows(scene, factors, screening, "screening")
    _require_rows(scene, assumptions, beside, "assumptions")
    for name in file.fallback:
        one_of(name, "fallback", [factor.name for factor in factors])
    if len(file.fallback) < CALIBRATED:
        raise StudyFileError(f"fallback: {len(file.fallback)} factors; at least {CALIBRATED} are needed")
    if not file.target:
        raise StudyFileError("target: at least one [[target]] is needed")
    given = observable_names(scene)
    material = load_material(file.material, relative_to=path.parent)
    experiments = _experiments(material, table, path, factors, assumptions)
    readings = [*given, *(f"{name}/{one}" for name, other in experiments.items() for one in observable_names(other))]
    observables = [target.observable for target in file.target]
    if twice := [name for k, name in enumerate(observables) if name in observables[:k]]:
        raise StudyFileError(f"target.observable: {twice[0]!r} appears twice")
    for target, entry in zip(file.target, table["target"], strict=True):
        one_of(target.observable, "target.observable", readings)
        _require_possible(target)
        if "margin" not in entry and not is_angle(target.observable):
            raise StudyFileError(
                f"target.margin: missing for {target.observable}; only an angle has a default, {target.margin:g}°"
            )
    if experiment_of(file.target[0].observable):
        raise StudyFileError(
            f"target.observable: the first target, {file.target[0].observable}, has to be of the "
            f"study's own rig; allowed: {', '.join(given)}"
        )
    for name in experiments:
        if name not in map(experiment_of, observables):
            raise StudyFileError(
                f"experiment.name: no target reads {name}; name one, such as {name}/…, or leave it out"
            )
    unasked = tuple(name for name in given if OBSERVABLES[name].estimator)
    estimators = unasked if file.estimators is None else file.estimators
    for name in estimators:
        one_of(name, "estimators", given)
    scan_path, scan_values = _scan(scene, file.scan)
    profiles = {name: _profile(scene, name, profile) for name, profile in file.profile.items()}
    return Study(
        name=path.stem,
        file=path,
        scene=scene,
        targets=tuple(file.target),
        factors=factors,
        assumptions=assumptions,
        changes=_changes(scene, file.change),
        scan_path=scan_path,
        scan_values=scan_values,
        fallback=file.fallback,
        profiles=profiles or {"standard": Profile("standard")},
        estimators=tuple(dict.fromkeys([*observables, *estimators])),
        seed=file.seed,
        screening_design=screening,
        assumption_design=beside,
        surface_design=second_order_design(file.surface, "surface", SURFACE, CALIBRATED),
        further=_further(file.stage),
        experiments=experiments,
        replaced=replaced,
    )


def _replaced(scene: Scene, material: str, table: Settings, factors: Sequence[Factor]) -> Iterator[str]:
    """Lines for :attr:`Study.replaced`; ``scene`` has the values of the material file and the set-up."""
    for one in factors:
        stated = value(scene, one.path)
        if one.path == "body.spheres" or _same(stated, one.reference):  # the profile chooses the shapes
            continue
        kind = one.path.partition(".")[0]
        where = f"[{kind}]" if one.path.removeprefix(f"{kind}.") in table.get(kind, {}) else material
        shown = [f"{number:.6g}" if isinstance(number, float) else number for number in (one.reference, stated)]
        yield f"{one.path}: {shown[0]}, the reference of {one.name}, counts instead of {shown[1]} in {where}"


def _same(a: float | str, b: float | str) -> bool:
    """Whether two values are the same to the six digits that files are written with."""
    return a == b if isinstance(a, str) or isinstance(b, str) else math.isclose(a, b, rel_tol=1e-5)


def _require_possible(target: Target) -> None:
    """Refuse a mean that no measurement can give; that of a model (``before_mean``) may have any value."""
    known = OBSERVABLES[target.observable.rpartition("/")[2]]
    if not known.is_possible(target.mean):
        low, high = known.possible
        unit = "" if known.unit == "1" else f" {known.unit}"
        allowed = f"{low:g} … {high:g}{unit}" if high < math.inf else f"{low:g}{unit} and more"
        raise StudyFileError(f"target.mean: {target.mean:g}{unit} of {target.observable}; allowed: {allowed}")


def _experiments(
    material: Scene, table: Settings, path: Path, factors: Sequence[Factor], assumptions: Sequence[Factor]
) -> dict[str, Scene]:
    """The scene of each experiment: the study's material, contact and effects, in its own rig with its own mass."""
    found: dict[str, Scene] = {}
    shared = {key: table[key] for key in ("contact", "effect") if key in table}
    for entry in table.get("experiment", ()):
        name, own = entry["name"], {key: value for key, value in entry.items() if key != "name"}
        if not EXPERIMENT.fullmatch(name):
            raise StudyFileError(f"experiment.name: {name!r} is no name; allowed: 1 to 60 letters, digits, - and _")
        if name in found:
            raise StudyFileError(f"experiment.name: {name!r} appears twice")
        try:
            other = with_set_up(material, shared | own, path.parent)
        except ParameterError as error:
            raise StudyFileError(f"experiment {name}: {error}") from None
        for factor in factors:
            if factor.path not in parameters(other):
                raise StudyFileError(
                    f"factor.path: {factor.path} of {factor.name} is no parameter of the experiment {name}; "
                    "allowed are those that all experiments share, such as material.… and pair.…"
                )
        # What is assumed of the material holds in every rig.
        assumed = [one for one in assumptions if one.path.split(".")[0] not in OF_ONE_RIG]
        found[name] = with_values(other, {one.path: one.reference for one in (*factors, *assumed)})
    return found


def _further(tables: dict[str, Settings]) -> dict[str, Settings]:
    """Tables of stages of other packages; the stage itself checks the contents."""
    known = plugged_in("stage")
    for name in tables:
        if name not in known:
            allowed = f"allowed: {', '.join(known)}" if known else "no installed package has one"
            raise StudyFileError(f"stage.{name}: no such stage; {allowed}")
    return tables


def _levels(scene: Scene, entry: LevelsTable) -> Factor:
    reference = value(scene, entry.path) if entry.reference is None else entry.reference
    return Factor(entry.name, *checked_levels(scene, entry.name, entry.path, (entry.low, entry.high, reference)))


def _factor(scene: Scene, entry: LevelsTable) -> Factor:
    """A factor. It may have to be varied continuously, which is impossible with named levels."""
    factor = _levels(scene, entry)
    if isinstance(factor.low, str):
        raise StudyFileError(
            f"factor.path: {factor.path} of {factor.name} has named levels, which only an [[assumption]] may have; "
            "a [[factor]] needs numbers"
        )
    return factor


def _refuse_twins(factors: list[Factor]) -> None:
    for key in ("name", "path"):
        seen: set[str] = set()
        for factor in factors:
            value = getattr(factor, key)
            if value in seen:
                raise StudyFileError(f"factor.{key}: {value!r} appears twice among the factors and assumptions")
            seen.add(value)


def _require_room(factors: Sequence[Factor], bodies: list[str]) -> None:
    """Refuse mass fractions that are varied together and cannot all be high at once."""
    high = {one.path.split(".")[1]: float(one.high) for one in factors if one.path.endswith(".mass_fraction")}
    if len(high) > 1 and (len(high) == len(bodies) or sum(high.values()) > 1.0 + 1e-6):
        raise StudyFileError(
            f"factor.path: mass fractions of {', '.join(high)}, up to {sum(high.values()):g} together; allowed: up to "
            "1, with at least one component left to take the rest"
        )


def _require_rows(scene: Scene, factors: Sequence[Factor], chosen: ChosenDesign, key: str) -> None:
    """Refuse levels that are possible one by one, but not together in a row of the design."""
    if not factors:
        return
    for number, row in enumerate(chosen.points(len(factors)).coded, start=1):
        values = {one.path: one.level(float(coded)) for one, coded in zip(factors, row, strict=True)}
        try:
            with_values(scene, values)
        except ParameterError as error:
            raise StudyFileError(f"{key}: row {number} of the design is impossible: {error}") from None


def _scan(scene: Scene, scan: ScanTable | None) -> tuple[str | None, tuple[float, ...]]:
    """(path, values [SI]) of the scan; (None, ()) without one."""
    if scan is None:
        return None, ()
    path = canonical(scene, scan.path)
    parameter = parameters(scene)[path]
    if not parameter.is_number or not scan.values:
        raise StudyFileError(f"scan.values: {path} over {scan.values!r}; a list of numbers is needed")
    values = tuple(float(parameter.check(one)) for one in scan.values)
    for one in values:
        with_values(scene, {path: one})
    return path, values


def _changes(scene: Scene, changes: list[ChangeTable]) -> dict[str, Values]:
    found: dict[str, Values] = {}
    for entry in changes:
        if entry.name in (*found, REFERENCE):
            raise StudyFileError(f"change.name: {entry.name!r} appears twice or is that of the reference setting")
        if not entry.values:
            raise StudyFileError(f"change.values: {entry.name!r} changes nothing; a path and its value are needed")
        with_values(scene, entry.values)
        found[entry.name] = dict(entry.values)
    return found


def _profile(scene: Scene, name: str, profile: Profile) -> Profile:
    if not NAME.fullmatch(name):
        raise StudyFileError(f"profile: {name!r} is no name; allowed: 1 to 60 characters, no / and no \\")
    if profile.name:
        raise StudyFileError(f"profile.{name}.name: unknown key; the name stands in [profile.{name}]")
    one_of(profile.spheres, f"profile.{name}.spheres", parameters(scene)["body.spheres"].choices)
    return replace(profile, name=name)
