"""A study: what is varied, against which measurement, with how many runs. Read from a TOML file.

format = 1
material = "name or file"      fallback = ["X4", …]
dummies = 3                    columns of a Plackett–Burman table that stay free of factors, at least
[screening]  [assumptions]  [surface]      design = "NAME" (doe/designs) of the stage, and its options: runs, centre,
                               fold, generators, fraction, alpha, seed; Plackett–Burman of 28 and of 12 runs and
                               Box–Behnken with 5 centre runs if not given
estimators = [observables]     candidates for the screening's response; those of the targets always belong to them
[rig] name and dimensions      [insertion] …      [numerics] …      [effect.NAME] what is switched on
[[target]]      observable, mean, n, sd, weight, margin
[[factor]]      name, path, low, high, reference        screened, then calibrated; numbers
[[assumption]]  the same keys, or named levels           screened beside them: what nobody published
[[change]]      name, values = { path = value }          declared changes for the choice of the estimator
[scan]          path, values                             one assumption in steps
[profile.NAME]  spheres, mass and the numbers of runs
[stage.NAME]    a stage of another package, with what it takes (doe/stages/stage.py)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from doe.analysis.surface import second_order_terms, term_names, with_intercept
from doe.designs import ALPHAS, DESIGNS, BoxBehnken, ChosenDesign, DesignOptions, PlackettBurman, Points
from doe.errors import StatisticsError, StudyFileError
from doe.record import Record
from doe.studies.factors import MIN_BODIES, bodies_touched, checked_levels
from doe.studies.profile import Profile, profile_from
from doe.studies.study_table import Table, entries, names, one_of, only, required, section, whole
from doe.target import Target, is_angle, target_from
from solver import (
    OBSERVABLES,
    ParameterError,
    Scene,
    asset_path,
    canonical,
    is_material,
    load_material,
    observable_names,
    parameters,
    parse_quantity,
    plugged_in,
    read_toml,
    with_set_up,
    with_values,
)

DUMMIES = 3

"""Columns of a table for main effects alone that stay free of factors, where the file says nothing."""

IN_STUDIES = DesignOptions(alpha="face-centred")

"""Options where a study says nothing: the axial points stay in the region that is searched."""

SCREENING = ChosenDesign(PlackettBurman(), replace(IN_STUDIES, runs=28))

ASSUMPTIONS = ChosenDesign(PlackettBurman(), replace(IN_STUDIES, runs=12))

SURFACE = ChosenDesign(BoxBehnken(), replace(IN_STUDIES, centre=5))


def main_effect_design(
    table: Table, key: str, whose: str, usual: ChosenDesign, factors: Sequence[Factor], dummies: int | None
) -> ChosenDesign:
    """The design of a stage that looks at main effects, read from ``table[key]`` and checked with its factors.

    ``whose``: key of the factors in the file. ``dummies``: columns that have to stay free in a design that is made for
    main effects alone; None: three. Raises StudyFileError.
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


def second_order_design(table: Table, key: str, usual: ChosenDesign, factors: int) -> ChosenDesign:
    """The design of a stage that fits a full second-order model; raises StudyFileError where it cannot."""
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


def _chosen(table: Table, key: str, usual: ChosenDesign) -> ChosenDesign:
    entry = section(table, key)
    design = DESIGNS[one_of(entry.get("design", usual.design.name), f"{key}.design", DESIGNS)]
    only(entry, {"design", "seed", *design.options}, key)
    options = usual.options if design.name == usual.design.name else IN_STUDIES
    values = {name: _option(f"{key}.{name}", name, entry[name]) for name in entry if name != "design"}
    return ChosenDesign(design, replace(options, **values))


def _option(where: str, name: str, value: Any) -> Any:
    if name == "alpha":
        return one_of(value, where, ALPHAS)
    if name == "fold":
        if not isinstance(value, bool):
            raise StudyFileError(f"{where}: {value!r} is neither true nor false")
        return value
    if name == "generators":
        if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
            raise StudyFileError(f'{where}: a list such as ["D=ABC"] is needed, not {value!r}')
        return tuple(value)
    return whole(value, where, least=0)


def _require_inside(points: Points, key: str, name: str) -> None:
    """Beyond low … high a parameter may be out of its range, or a factor mean nothing."""
    furthest = float(np.abs(points.coded).max())
    if furthest > 1.0 + 1e-9:
        raise StudyFileError(
            f"{key}.design: {name} has points {furthest:.3g} times as far out as low and high; allowed: 1, as with "
            'alpha = "face-centred" or "inscribed"'
        )


CALIBRATED = 3

"""Factors that go on from the screening to the ascent and the response surface."""

TRIES = 3

"""Seeds that are tried for one replicate; a run that jammed or broke is kept with its outcome and replaced."""

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
        """Value at a coded level: −1 low, +1 high, linear between; a named level only at the ends."""
        if isinstance(self.low, str) or isinstance(self.high, str):
            return self.high if coded > 0 else self.low
        return self.low + 0.5 * (coded + 1.0) * (self.high - self.low)


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
    further: dict[str, Table] = field(default_factory=dict)
    """Stage of another package → its table."""


KEYS = {
    "format", "title", "material", "dummies", "fallback", "rig", "insertion", "target", "factor", "assumption",
    "change", "scan", "profile", "estimators", "seed", "numerics", "effect", "screening", "assumptions", "surface",
    "stage",
}  # fmt: skip


def load_study(name: str) -> Study:
    """Study from a shipped name or a file; every mistake is one line that names file, key and what is allowed."""
    path = asset_path("studies", name)
    try:
        return study_from(read_toml(path), path)
    except (ParameterError, StudyFileError) as error:
        text = str(error)
        raise ParameterError(text if text.startswith(str(path)) else f"{path}: {text}") from None


def with_profile(study: Study, name: str) -> tuple[Study, Profile]:
    """The study with the shapes and the mass of profile ``name``, and the profile.

    Raises ParameterError where there is no such profile, its mixture leaves too few factors of the fallback list
    testable, or it asks for a resolution in degrees of a target that is no angle.
    """
    if name not in study.profiles:
        raise ParameterError(f"{study.file}: profile: {name!r} is not one of {', '.join(study.profiles)}")
    profile = study.profiles[name]
    mass = {"rig.mass": profile.mass} if "rig.mass" in parameters(study.scene) else {}
    scene = with_values(study.scene, {"body.spheres": profile.spheres, **mass})
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
    return replace(study, scene=scene), profile


def _refuse_without_error(study: Study, profile: Profile) -> None:
    """A response surface needs a run more than it has terms; better said now than after all other stages."""
    rows, terms = (
        len(study.surface_design.points(CALIBRATED).coded),
        len(term_names([str(k) for k in range(CALIBRATED)])),
    )
    if rows * profile.surface_replicates <= terms:
        raise ParameterError(
            f"{study.file}: profile.{profile.name}.surface_replicates: {profile.surface_replicates} of {rows} points "
            f"leave no error for the {terms} terms of the surface; allowed: at least {terms // rows + 1}"
        )


def study_from(table: Table, path: Path) -> Study:
    """Study from a parsed file. Raises ParameterError or StudyFileError."""
    if is_material(table):
        raise StudyFileError(
            f'{path} is a material, not a study; a study names it (material = "{path.name}"), and '
            f"`explorer new study {path.stem}` writes one"
        )
    only(table, KEYS, "")
    if table.get("format") != 1:
        raise StudyFileError(f"format: {table.get('format')!r} is not 1")
    if "material" not in table:
        raise ParameterError("material: a shipped material or the path of a material file is needed")
    scene = with_set_up(load_material(str(table["material"]), relative_to=path.parent), table, path.parent)
    factors = tuple(_factor(scene, entry) for entry in entries(table, "factor"))
    scene = with_values(scene, {factor.path: factor.reference for factor in factors})
    dummies = whole(table["dummies"], "dummies", least=1) if "dummies" in table else None
    if len(factors) < CALIBRATED:
        raise StudyFileError(f"factor: {len(factors)} factors; at least {CALIBRATED} are needed")
    screening = main_effect_design(table, "screening", "factor", SCREENING, factors, dummies)
    assumptions = tuple(_levels(scene, entry, "assumption") for entry in entries(table, "assumption"))
    _refuse_twins([*factors, *assumptions])
    assumed = main_effect_design(table, "assumptions", "assumption", ASSUMPTIONS, assumptions, None)
    fallback = names(table.get("fallback", []), "fallback", [factor.name for factor in factors])
    if len(fallback) < CALIBRATED:
        raise StudyFileError(f"fallback: {len(fallback)} factors; at least {CALIBRATED} are needed")
    if not entries(table, "target"):
        raise StudyFileError("target: at least one [[target]] is needed")
    targets = tuple(target_from(entry, observable_names(scene)) for entry in entries(table, "target"))
    scan_path, scan_values = _scan(scene, section(table, "scan"))
    wanted = section(table, "profile")
    profiles = {name: _profile(scene, name, section(wanted, name)) for name in wanted}
    given = observable_names(scene)
    unasked = [name for name in given if OBSERVABLES[name].estimator]
    estimators = names(table.get("estimators", unasked), "estimators", given)
    return Study(
        name=path.stem,
        file=path,
        scene=scene,
        targets=targets,
        factors=factors,
        assumptions=assumptions,
        changes=_changes(scene, entries(table, "change")),
        scan_path=scan_path,
        scan_values=scan_values,
        fallback=fallback,
        profiles=profiles or {"standard": Profile("standard")},
        estimators=tuple(dict.fromkeys([*(target.observable for target in targets), *estimators])),
        seed=whole(table.get("seed", 1), "seed", least=0),
        screening_design=screening,
        assumption_design=assumed,
        surface_design=second_order_design(table, "surface", SURFACE, CALIBRATED),
        further=_further(section(table, "stage")),
    )


def _further(tables: Table) -> dict[str, Table]:
    """Tables of stages of other packages; what is in one is for its stage to check."""
    known = plugged_in("stage")
    for name in tables:
        if name not in known:
            allowed = f"allowed: {', '.join(known)}" if known else "no installed package has one"
            raise StudyFileError(f"stage.{name}: no such stage; {allowed}")
    return {name: section(tables, name) for name in tables}


def _levels(scene: Scene, entry: Table, where: str) -> Factor:
    only(entry, set(Factor.__dataclass_fields__), where)
    required(entry, ("name", "path", "low", "high", "reference"), where)
    return Factor(str(entry["name"]), *checked_levels(scene, entry))


def _factor(scene: Scene, entry: Table) -> Factor:
    """A factor; it may have to be varied continuously, which named levels cannot."""
    factor = _levels(scene, entry, "factor")
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
                raise StudyFileError(f"factor.{key}: {value!r} stands twice among the factors and assumptions")
            seen.add(value)


def _scan(scene: Scene, scan: Table) -> tuple[str | None, tuple[float, ...]]:
    """(path, values [SI]) of the scan; (None, ()) without one."""
    if not scan:
        return None, ()
    only(scan, {"path", "values"}, "scan")
    for key in ("path", "values"):
        if not scan.get(key):
            raise StudyFileError(f"scan.{key}: missing; a scan needs a path and values")
    path = canonical(scene, str(scan["path"]))
    if not parameters(scene)[path].is_number or not isinstance(scan["values"], list):
        raise StudyFileError(f"scan: {path} over {scan['values']!r}; a list of numbers is needed")
    values = tuple(float(parameters(scene)[path].check(value)) for value in scan["values"])
    for value in values:
        with_values(scene, {path: value})
    return path, values


def _changes(scene: Scene, changes: list[Table]) -> dict[str, Values]:
    found: dict[str, Values] = {}
    for entry in changes:
        only(entry, {"name", "values"}, "change")
        required(entry, ("name", "values"), "change")
        if str(entry["name"]) in found:
            raise StudyFileError(f"change.name: {entry['name']!r} stands twice")
        values = section(entry, "values")
        if not values:
            raise StudyFileError(f"change.values: {entry['name']!r} changes nothing; a path and its value are needed")
        with_values(scene, values)
        found[str(entry["name"])] = dict(values)
    return found


def _profile(scene: Scene, name: str, entry: Table) -> Profile:
    resolutions = parameters(scene)["body.spheres"].choices
    spheres = one_of(entry.get("spheres", "standard"), f"profile.{name}.spheres", resolutions)
    mass = parse_quantity(entry.get("mass", 0.03), "kg", f"profile.{name}.mass")
    return profile_from(name, entry, spheres, mass)
