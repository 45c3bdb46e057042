"""Methods for a paper: a paragraph written from the run's own data, and the sources that it cites.

Every number in it is one of the result. A source has a DOI here only where the code that rests on it states one.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING

from doe.provenance import SetUp
from doe.studies.study_result import StudyResult
from explorer.report.content import Bullets, Reference, Section, Text
from explorer.units import (
    enumeration,
    fixed,
    number,
    observable_label,
    observed,
    parameter_label,
    parameter_range,
    parameter_value,
)
from solver.laws import CONTACT_LAWS, HertzMindlin, LinearSpringDashpot

if TYPE_CHECKING:
    from explorer.diagnosis.result import DiagnosisResult


def _article(
    key: str, author: str, title: str, journal: str, volume: int, pages: str, year: int, doi: str = ""
) -> Reference:
    fields = {"author": author, "title": title, "journal": journal, "volume": str(volume), "pages": pages}
    return Reference(key, "article", fields | {"year": str(year)} | ({"doi": doi} if doi else {}))


SOURCES = {
    one.key: one
    for one in (
        _article("hertz1882", "Hertz, H.", "Über die Berührung fester elastischer Körper",
                 "Journal für die reine und angewandte Mathematik", 92, "156", 1882),
        _article("mindlin1953", "Mindlin, R. D. and Deresiewicz, H.",
                 "Elastic spheres in contact under varying oblique forces", "Journal of Applied Mechanics",
                 20, "327", 1953),
        _article("cundall1979", "Cundall, P. A. and Strack, O. D. L.",
                 "A discrete numerical model for granular assemblies", "Géotechnique", 29, "47", 1979,
                 "10.1680/geot.1979.29.1.47"),
        _article("schwager2007", "Schwager, T. and Pöschel, T.",
                 "Coefficient of restitution and linear–dashpot model revisited", "Granular Matter", 9, "465", 2007,
                 "10.1007/s10035-007-0065-z"),
        _article("thornton2013", "Thornton, C. and Cummins, S. J. and Cleary, P. W.",
                 "An investigation of the comparative behaviour of alternative contact force models during inelastic "
                 "collisions", "Powder Technology", 233, "30", 2013),
        _article("plackett1946", "Plackett, R. L. and Burman, J. P.",
                 "The design of optimum multifactorial experiments", "Biometrika", 33, "305", 1946),
        _article("box1951", "Box, G. E. P. and Wilson, K. B.", "On the experimental attainment of optimum conditions",
                 "Journal of the Royal Statistical Society B", 13, "1", 1951),
        _article("box1960", "Box, G. E. P. and Behnken, D. W.",
                 "Some new three level designs for the study of quantitative variables", "Technometrics", 2,
                 "455", 1960),
        _article("jones2011", "Jones, B. and Nachtsheim, C. J.",
                 "A class of three-level designs for definitive screening in the presence of second-order effects",
                 "Journal of Quality Technology", 43, "1", 2011, "10.1080/00224065.2011.11917841"),
        _article("holm1979", "Holm, S.", "A simple sequentially rejective multiple test procedure",
                 "Scandinavian Journal of Statistics", 6, "65", 1979),
        _article("welch1947", "Welch, B. L.",
                 "The generalization of Student's problem when several different population variances are involved",
                 "Biometrika", 34, "28", 1947),
        _article("schuirmann1987", "Schuirmann, D. J.",
                 "A comparison of the two one-sided tests procedure and the power approach for assessing the "
                 "equivalence "
                 "of average bioavailability", "Journal of Pharmacokinetics and Biopharmaceutics", 15, "657", 1987),
        _article("efron1973", "Efron, B. and Morris, C.",
                 "Stein's estimation rule and its competitors – an empirical Bayes approach",
                 "Journal of the American Statistical Association", 68, "117", 1973, "10.1080/01621459.1973.10481350"),
        _article("schaefer2005", "Schäfer, J. and Strimmer, K.",
                 "A shrinkage approach to large-scale covariance matrix estimation and implications for functional "
                 "genomics", "Statistical Applications in Genetics and Molecular Biology", 4, "32", 2005,
                 "10.2202/1544-6115.1175"),
        _article("box1967", "Box, G. E. P. and Hill, W. J.", "Discrimination among mechanistic models", "Technometrics",
                 9, "57", 1967, "10.1080/00401706.1967.10490441"),
    )
}  # fmt: skip
LAWS = {
    HertzMindlin.name: ("hertz1882", "mindlin1953", "thornton2013"),
    LinearSpringDashpot.name: ("cundall1979", "schwager2007"),
}
DESIGNS = {
    "Plackett–Burman": ("plackett1946",),
    "Box–Behnken": ("box1960",),
    "central composite": ("box1951",),
    "definitive screening": ("jones2011",),
}


def cited(key: str) -> str:
    """A source in the text: "Welch 1947", "Box and Behnken 1960", "Thornton et al. 2013"."""
    fields = SOURCES[key].fields
    names = [name.partition(",")[0] for name in fields["author"].split(" and ")]
    who = " and ".join(names) if len(names) < 3 else f"{names[0]} et al."
    return f"{who} {fields['year']}"


def citations(keys: tuple[str, ...]) -> str:
    """Several in brackets with a blank before them; "" of none."""
    return f" ({'; '.join(map(cited, keys))})" if keys else ""


def study_methods(result: StudyResult) -> tuple[Section, tuple[Reference, ...]]:
    """The paragraph of a calibration, its sources as a list and as entries."""
    text = " ".join(filter(None, (_model(result), _rig(result), _designs(result), _tests(result))))
    return _section(text, result.versions)


def diagnosis_references(result: DiagnosisResult) -> tuple[Reference, ...]:
    """What the methods of a diagnosis rest on."""
    keys = ("efron1973", "schaefer2005", *(("box1967",) if result.next_experiment else ()))
    return (*(SOURCES[key] for key in keys), *_software(result.versions))


def _section(text: str, versions: Mapping[str, str | None]) -> tuple[Section, tuple[Reference, ...]]:
    used = tuple(one for key, one in SOURCES.items() if cited(key) in text)
    software = _software(versions)
    text = f"{text} Simulated and analysed with {enumeration([_program(one) for one in software])}."
    listed = Bullets(tuple(map(reference_text, (*used, *software))))
    note = Text("Ready to paste; its sources are in `references.bib` beside this report.")
    return Section("Methods", (Text(text), note, listed)), (*used, *software)


def reference_text(one: Reference) -> str:
    """A source as a line of a list."""
    fields = one.fields
    if one.kind != "article":
        return f"{fields['title']} {fields.get('version', '')}".strip()
    names = re.sub(r" and (?=.* and )", "; ", fields["author"])
    doi = f" doi:{fields['doi']}" if "doi" in fields else ""
    return (
        f"{names} ({fields['year']}): {fields['title']}. {fields['journal']} {fields['volume']}:{fields['pages']}.{doi}"
    )


def _software(versions: Mapping[str, str | None]) -> tuple[Reference, ...]:
    return tuple(
        Reference(f"software-{name}", "misc", {"title": name, "version": version, "howpublished": "Computer program"})
        for name, version in versions.items()
        if version and name != "physics"
    )


def _program(one: Reference) -> str:
    return f"{one.fields['title']} {one.fields['version']}"


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
    bodies = Counter(found.materials.values()).total()
    shapes = [f"{shape.body} ({shape.fit.n_spheres} spheres)" for shape in result.shapes]
    return (
        f"{text} {bodies} kinds of body were poured, as clumps of spheres: {enumeration(shapes)}." if shapes else text
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
    return (
        f"{totals.total} pours ({totals.valid} valid) with seeds drawn from {study.seed} were run: "
        f"{result.pilot.noise[target.observable].runs} of one setting for the noise; a {screening} design of "
        f"{analysis.rows} rows{citations(DESIGNS.get(screening, ()))} over {len(result.screening.factors)} factors; a "
        "walk of "
        f"steepest ascent{citations(('box1951',))} in {len(result.ascent.means)} steps; and a {surface} design of "
        f"{len(result.surface.design)} points{citations(DESIGNS.get(surface, ()))} over {enumeration(names)}. "
        f"{_read(result.pilot.estimator, target.observable)}"
    )


def _read(screening: str, later: str) -> str:
    if screening == later:
        return f"All of them were read by the {observable_label(later)}."
    first, then = observable_label(screening), observable_label(later)
    return f"The screening was read by the {first}, all later stages by the {then}."


def _tests(result: StudyResult) -> str:
    analysis, stage = result.screening.analysis, result.verification
    target, test = stage.targets[0], stage.tests[0]
    name = target.observable
    text = (
        f"Effects were tested against the {analysis.error_source}, corrected by Holm’s "
        f"procedure{citations(('holm1979',))}. "
        f"{test.simulated.n} fresh pours at the chosen setting gave {observed(name, test.simulated.mean)} ± "
        f"{observed(name, test.simulated.sd)} (SD) against {observed(name, target.mean)} measured"
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
