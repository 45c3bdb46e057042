"""Methods for a paper: a paragraph written from the run's own data, and the sources that it cites.

Every number in it comes from the result; a source is cited where the text names it (`explorer.report.sources`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from doe.analysis.verification import Verification
from doe.designs import DESIGNS as FAMILIES
from doe.laboratory import LabResult
from doe.laboratory.analysis import TESTS
from doe.laboratory.hertz import HertzRange
from doe.laboratory.linear_range import STRAIGHTNESS, LinearRange
from doe.laboratory.result import CONDITIONS
from doe.provenance import SetUp
from doe.studies.study_result import StudyResult
from doe.target import Target
from explorer.report.content import Reference, Section
from explorer.report.sources import SOURCES, citations, methods_section, software
from explorer.units import (
    counted,
    enumeration,
    fixed,
    number,
    observable_label,
    observed,
    parameter_label,
    parameter_range,
    parameter_value,
    percent,
)
from solver.laws import CONTACT_LAWS, HertzMindlin, LinearSpringDashpot

if TYPE_CHECKING:
    from doe.analysis.analyse import DesignAnalysis
    from doe.audit import Audit
    from explorer.design.plan_result import PlanResult
    from explorer.design.result import DesignResult
    from explorer.diagnosis.result import DiagnosisResult
    from explorer.photograph.result import PhotographResult

Methods = tuple[Section, tuple[Reference, ...]]
"""The section, and its sources as bibliography entries."""
LAWS = {
    HertzMindlin.name: ("hertz1882", "mindlin1953", "thornton2013"),
    LinearSpringDashpot.name: ("cundall1979", "schwager2007"),
}
DESIGNS = {
    "Plackett–Burman": ("plackett1946",),
    "Box–Behnken": ("box1960",),
    "central composite": ("box1951",),
    "definitive screening": ("jones2011",),
    "two-level factorial": ("box1961",),
    "D-optimal": ("meyer1995",),
    "I-optimal": ("meyer1995",),
    "mixture": ("scheffe1958",),
    "Latin hypercube": ("mckay1979",),
    "Morris": ("morris1991",),
}
WITHOUT_SOLVER = ("taichi",)
"""Programs left out of a result without simulations."""


def study_methods(result: StudyResult) -> Methods:
    """The paragraph of a calibration, its sources as a list and as entries."""
    text = " ".join(filter(None, (_model(result), _rig(result), _designs(result), _tests(result))))
    return methods_section(text, result.versions)


def diagnosis_references(result: DiagnosisResult) -> tuple[Reference, ...]:
    """Sources of the methods of a diagnosis."""
    keys = ("efron1973", "schaefer2005", *(("box1967",) if result.next_experiment else ()))
    return (*(SOURCES[key] for key in keys), *software(result.versions))


def bench_methods(result: LabResult, versions: Mapping[str, str | None]) -> Methods:
    """The paragraph of a bench test: its standard, every formula with n, and how replicates were summarised."""
    found = [one for one in result.derived if one.name not in CONDITIONS]
    formulas: dict[tuple[str, str], list[str]] = {}
    for one in found:
        formulas.setdefault((one.name.replace("_", " "), one.formula), []).append(
            f"{'–'.join(one.of).replace('_', ' ')} (n = {one.summary.n})"
        )
    text = f"The readings are of the bench test {result.test.replace('_', ' ')}: {TESTS[result.test].layout.standard}."
    clauses = [f"{name} by {formula} of {enumeration(of)}" for (name, formula), of in formulas.items()]
    clauses += [
        f"{one.name.replace('_', ' ')} by {one.formula} of {'–'.join(one.of).replace('_', ' ')}"
        for one in result.estimates
    ]
    text += f" Evaluated were {'; '.join(clauses)}."
    if any(isinstance(curve.fit, LinearRange) for curve in result.curves):
        text += (
            " Of every force–displacement curve the slope was taken from the window that spans the most force while "
            f"each of its fifths stays within {percent(STRAIGHTNESS, 1)} of its force of a line."
        )
    if any(isinstance(curve.fit, HertzRange) for curve in result.curves):
        text += f" Curved bodies were fitted by Hertz’s law{citations(('hertz1882',))} up to yield."
    several = any(one.summary.outlier_test != "Grubbs" for one in found)
    text += (
        " Means stand with their standard deviation and 95 % interval by Student’s t; normality was tested"
        f"{citations(('shapiro1965',))}, and outliers at the 5 % level"
        f"{citations(('rosner1983',) if several else ('grubbs1969',))}, of which none was removed."
    )
    if any(one.name == "size_spread" for one in result.estimates):
        text += f" The interval of the spread of sizes is McKay’s, modified{citations(('vangel1996',))}."
    if any(one.reading is not None for one in found):
        text += (
            " The ± of readings was taken as rectangular and carried into every quantity by the law of propagation"
            f"{citations(('gum2008',))}."
        )
    return methods_section(text, _without_solver(versions), "Evaluated")


def photograph_methods(result: PhotographResult) -> Methods:
    """The paragraph of photographed piles: how the angle was read, with which base line and scale."""
    lines = enumeration(list(dict.fromkeys(pile.base_from for pile in result.piles if pile.base_from)))
    n, lost = len(result.piles), len(result.refused)
    text = (
        f"{'One photograph' if n + lost == 1 else f'{n + lost} photographs'} of piles from the side: {n} read, {lost} "
        "refused. The silhouette was told from its background by its grey levels, its edge placed "
        "between pixels, and a least-squares line laid through the tops of all columns of each flank between 20 and "
        "80 % of the pile’s height; the angle of repose is the mean of both flanks over the base line"
        f"{f' (from {lines})' if n and lines != 'none' else ''}. ± is two standard errors: level of the edge, tilt, "
        "window of the fit and pixels, a bend of the flank beyond its roughness, and what is not known of lens and "
        "camera."
    )
    scales = dict.fromkeys(
        f"{number(1e3 * one.pixel, 4)} mm ({one.scale_from or 'as stated'})"
        for one in result.piles
        if one.unit == "m" and one.pixel
    )
    if scales:
        text += f" A pixel is {enumeration(list(scales))}."
    if n > 1:
        text += f" The interval of the mean over {n} pictures is by Student’s t."
    return methods_section(text, _without_solver(result.versions), "Read")


def design_methods(result: DesignResult) -> Methods:
    """The paragraph of an analysed design: the runs, and the tests and models that their analysis used."""
    found, runs = result.analysis, result.runs
    family, settings = _family(result.design), len(np.unique(result.coded.round(9), axis=0))
    design = f", {_article(family)} {family} design{citations(DESIGNS.get(family, ()))}," if family else ""
    text = (
        f"{counted(runs.valid, 'run')} at {counted(settings, 'setting')} of {counted(len(result.factors), 'factor')}"
        f"{design} were analysed for {result.response.name.replace('_', ' ')}; {runs.missing} had no result."
    )
    if found.effects is not None:
        error = found.effects.screening.error_source
        text += (
            f" Effects were tested against the {error}, corrected by Holm’s procedure{citations(('holm1979',))}, and "
            "held"
            if error is not None
            else " No run was left over to estimate the scatter from; effects were held"
        )
        text += f" against Lenth’s margin{citations(('lenth1989',))}."
    if found.model is not None:
        anova = found.model.anova
        terms = int(found.model.surface.included.sum()) - 1
        text += (
            f" A polynomial of {counted(terms, 'term')} was fitted by least squares{citations(('myers2016',))}; sums "
            f"of squares are partial (Type III). {_explained(anova.r_squared, anova.r_squared_predicted)}"
        )
    text += _other_models(found)
    if found.mixture is not None:
        text += f" Scheffé’s polynomial{citations(('scheffe1958',))} stands for the model of the mixture."
    if "--reduce" in result.command:
        text += f" Terms were dropped one by one, by AICc{citations(('hurvich1989',))} or p."
    if found.optimum is not None:
        text += f" Settings for {observed(result.response.path, found.optimum.target)} were looked for in the model."
    return methods_section(text, _without_solver(result.versions), "Analysed")


def _other_models(found: DesignAnalysis) -> str:
    """What is used instead of the polynomial, or beside it."""
    text = ""
    if found.elementary is not None:
        text += (
            f" Elementary effects{citations(('morris1991',))} were tested by Student’s t, corrected by Holm’s procedure"
            f"{citations(('holm1979',))}."
        )
    if found.named is not None:
        text += (
            " A linear model, names by effects that add up to zero, was fitted by least squares; sums of squares are "
            f"partial (Type III). {_explained(found.named.r_squared, found.named.r_squared_predicted)}"
        )
    if found.random is not None:
        text += (
            f" A model with {len(found.random.groups)} groups drawn at random was fitted by restricted maximum "
            f"likelihood{citations(('patterson1971',))}; terms were tested by F with the degrees of freedom of "
            f"Satterthwaite{citations(('satterthwaite1946',))}."
        )
    if found.surrogate is not None:
        text += f" A Gaussian process was fitted by maximum likelihood{citations(('rasmussen2006',))}."
    return text


def _explained(r_squared: float, predicted: float) -> str:
    """R² and predicted R²: a constant response has neither; if a run is fitted exactly, there is no predicted one."""
    if not math.isfinite(r_squared):
        return "Nothing varies that a model could explain."
    return f"R² is {fixed(r_squared, 4)}{f', predicted {fixed(predicted, 4)}' if math.isfinite(predicted) else ''}."


def plan_methods(result: PlanResult) -> Methods:
    """The paragraph of a planned experiment: family, size, order of the runs, and what it can detect."""
    family = _family(result.design)
    text = (
        f"{_article(family).capitalize()} {family} design{citations(DESIGNS.get(family, ()))} of {len(result.coded)} "
        f"rows over {counted(len(result.factors), 'factor')} was made, {counted(result.replicates, 'run')} of each: "
        f"{counted(len(result.sequence), 'run')}"
        f"{f' in {max(result.block)} blocks' if result.block else ''}. Order of the runs and whatever of the design is "
        f"drawn: seed {result.seed}."
    )
    if result.power:
        known = (
            f", for a standard deviation of one run of {number(result.sigma)}" if math.isfinite(result.sigma) else ""
        )
        text += (
            f" The smallest change that the {result.model} model will see with a chance of 0.8 at p < 0.05 is that "
            f"of the noncentral t{citations(('cohen1988',))}{known}."
        )
    return methods_section(text, _without_solver(result.versions), "Made")


def audit_methods(audit: Audit, what: str, versions: Mapping[str, str | None]) -> Methods:
    """The paragraph of an audit: its object, its checks, and how it grades."""
    source = audit.source or "no source stated"
    checks = list(dict.fromkeys(figure.check for figure in audit.figures))
    text = (
        f"The printed tables of “{audit.title}” ({source}) were audited: {len(audit.figures)} figures by "
        f"{len(checks)} checks ({enumeration(checks)}). {what}"
    )
    return methods_section(text, _without_solver(versions), "Recomputed")


def _without_solver(versions: Mapping[str, str | None]) -> dict[str, str | None]:
    return {name: version for name, version in versions.items() if name not in WITHOUT_SOLVER}


def _family(design: str) -> str:
    """Name of a design in a sentence; "" if the sheet does not say."""
    return FAMILIES[design].title if design in FAMILIES else design


def _article(family: str) -> str:
    return "an" if family[:1] in "aeiouI" else "a"


def _model(result: StudyResult) -> str:
    contact = result.study.contact
    law = contact.get("law", HertzMindlin.name)
    title = CONTACT_LAWS[law].title if law in CONTACT_LAWS else law.replace("_", " ")
    text = f"Contacts were modelled by the discrete element method with the law {title}{citations(LAWS.get(law, ()))}"
    found = result.set_up
    if found is None:
        return f"{text}."
    fraction = number(float(found.values["numerics.rayleigh_fraction"]))
    text += (
        f", at a time step of {number(1e6 * found.dt)} µs (at most {fraction} of the Rayleigh time of the smallest "
        "sphere)."
    )
    kinds = len(found.materials)
    shapes = [f"{shape.body} ({counted(shape.fit.n_spheres, 'sphere')})" for shape in result.shapes]
    return (
        f"{text} {'One kind of body was' if kinds == 1 else f'{kinds} kinds of body were'} poured, as clumps of "
        f"spheres: {enumeration(shapes)}."
        if shapes
        else text
    )


def _rig(result: StudyResult) -> str:
    if result.set_up is None:
        return ""
    text = _one_rig(result.set_up)
    for name, other in result.experiments.items():
        words = _one_rig(other)
        text += f" In the experiment {name.replace('_', ' ')}, {words[0].lower()}{words[1:]}"
    return text


def _one_rig(found: SetUp) -> str:
    sizes = [
        f"{parameter_label(path)} {parameter_value(path, one)}"
        for path, one in found.values.items()
        if path.startswith("rig.") and not isinstance(one, str) and path not in ("rig.domain_half_width", "rig.mass")
    ]
    mass = found.values.get("rig.mass")
    poured = "" if mass is None else f"{parameter_value('rig.mass', mass)} were poured into "
    words = f"the {found.rig.replace('_', ' ')} ({enumeration(sizes)})"
    return f"{poured}{words}." if poured else f"The rig was {words}."


def _designs(result: StudyResult) -> str:
    study, analysis = result.study, result.screening.analysis
    target = study.targets[0]
    screening, surface = study.designs["screening"], study.designs["surface"]
    totals = result.runs
    names = [
        f"{f.name}, {parameter_label(f.path)} {parameter_range(f.path, f.low, f.high)}" for f in result.surface.factors
    ]
    together = (
        ", towards where the screening’s first-order models miss all targets least in weighted squares of their "
        f"standard errors, its steps judged by that and by desirability{citations(('derringer1980',))}"
        if result.ascent.approach is not None
        else ""
    )
    return (
        f"{totals.total} pours ({totals.valid} valid) with seeds drawn from {study.seed} were run: "
        f"{result.pilot.noise[target.observable].runs} of one setting for the noise; a {screening} design of "
        f"{analysis.rows} rows{citations(DESIGNS.get(screening, ()))} over "
        f"{counted(len(result.screening.factors), 'factor')}; a walk of steepest ascent{citations(('box1951',))} in "
        f"{counted(len(result.ascent.means), 'step')}{together}; and a {surface} "
        f"design of {len(result.surface.design)} points{citations(DESIGNS.get(surface, ()))} over "
        f"{enumeration(names)}. {_read(result.pilot.estimator, study.targets)}"
    )


def _read(screening: str, targets: Sequence[Target]) -> str:
    """How the pours were read: the screening may use another estimator of the first target."""
    first, *others = (observable_label(target.observable) for target in targets)
    if screening == targets[0].observable:
        return f"All of them were read by the {enumeration([first, *others])}."
    read = enumeration([observable_label(screening), *others])
    return f"The screening was read by the {read}, all later stages by the {enumeration([first, *others])}."


def _tests(result: StudyResult) -> str:
    analysis, stage = result.screening.analysis, result.verification
    several = len(stage.targets) > 1
    return " ".join(
        (
            f"Effects were tested against the {analysis.error_source}, corrected by Holm’s "
            f"procedure{citations(('holm1979',))}.",
            *(_tested(target, test, several) for target, test in zip(stage.targets, stage.tests, strict=True)),
        )
    )


def _tested(target: Target, test: Verification, named: bool) -> str:
    name = target.observable
    what = f" for the {observable_label(name)}" if named else ""
    text = (
        f"{test.simulated.n} fresh pours at the chosen setting gave{what} "
        f"{observed(name, test.simulated.mean)} ± {observed(name, test.simulated.sd)} (SD) against "
        f"{observed(name, target.mean)} measured"
    )
    if test.welch is not None:
        text += (
            f" (Welch’s t test{citations(('welch1947',))}: t = {fixed(test.welch.t)}, df = {fixed(test.welch.df, 1)})"
        )
    if test.equivalence is not None:
        text += (
            f"; equivalence within ± {observed(name, target.margin)} was tested by two one-sided tests"
            f"{citations(('schuirmann1987',))}: {test.verdict}"
        )
    return f"{text}."
