"""What the reports cite: sources by key, how they are named in a text, in a list and as entries for BibTeX.

A source has a DOI here only if the code that relies on it states one. Volume and page are those named in the code;
titles were checked against a catalogue only for Rosner 1983, ASTM C136 and ASTM D6393.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from explorer.report.content import Bullets, Reference, Section, Text
from explorer.units import enumeration


def _article(
    key: str, author: str, title: str, journal: str, volume: int, pages: str, year: int, doi: str = ""
) -> Reference:
    fields = {"author": author, "title": title, "journal": journal, "volume": str(volume), "pages": pages}
    return Reference(key, "article", fields | {"year": str(year)} | ({"doi": doi} if doi else {}))


def _book(key: str, author: str, title: str, year: int) -> Reference:
    return Reference(key, "book", {"author": author, "title": title, "year": str(year)})


def _standard(key: str, name: str, title: str) -> Reference:
    """A source that a text cites by a name of its own, such as a standard."""
    return Reference(key, "misc", {"shorthand": name, "title": title, "howpublished": name})


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
        _article("morris1991", "Morris, M. D.", "Factorial sampling plans for preliminary computational experiments",
                 "Technometrics", 33, "161", 1991),
        _article("patterson1971", "Patterson, H. D. and Thompson, R.",
                 "Recovery of inter-block information when block sizes are unequal", "Biometrika", 58, "545", 1971),
        _article("satterthwaite1946", "Satterthwaite, F. E.",
                 "An approximate distribution of estimates of variance components", "Biometrics Bulletin", 2, "110",
                 1946),
        _book("rasmussen2006", "Rasmussen, C. E. and Williams, C. K. I.",
              "Gaussian Processes for Machine Learning", 2006),
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
        _article("grubbs1969", "Grubbs, F. E.", "Procedures for detecting outlying observations in samples",
                 "Technometrics", 11, "1", 1969),
        _article("rosner1983", "Rosner, B.", "Percentage points for a generalized ESD many-outlier procedure",
                 "Technometrics", 25, "165", 1983),
        _article("shapiro1965", "Shapiro, S. S. and Wilk, M. B.",
                 "An analysis of variance test for normality (complete samples)", "Biometrika", 52, "591", 1965),
        _article("vangel1996", "Vangel, M. G.", "Confidence intervals for a normal coefficient of variation",
                 "The American Statistician", 50, "21", 1996),
        _article("lumay2012", "Lumay, G. and others", "Measuring the flowing properties of powders and grains",
                 "Powder Technology", 224, "19", 2012),
        _article("roessler2019", "Roessler, T. and others",
                 "Development of a standard calibration procedure for the DEM parameters of cohesionless bulk "
                 "materials",
                 "Powder Technology", 343, "803", 2019),
        _article("box1957", "Box, G. E. P. and Hunter, J. S.",
                 "Multi-factor experimental designs for exploring response surfaces",
                 "Annals of Mathematical Statistics", 28, "195", 1957),
        _article("box1961", "Box, G. E. P. and Hunter, J. S.", "The 2^(k−p) fractional factorial designs",
                 "Technometrics", 3, "311", 1961),
        _article("meyer1995", "Meyer, R. K. and Nachtsheim, C. J.",
                 "The coordinate-exchange algorithm for constructing exact optimal experimental designs",
                 "Technometrics", 37, "60", 1995),
        _article("mckay1979", "McKay, M. D. and Beckman, R. J. and Conover, W. J.",
                 "A comparison of three methods for selecting values of input variables in the analysis of output from "
                 "a computer code", "Technometrics", 21, "239", 1979),
        _article("scheffe1958", "Scheffé, H.", "Experiments with mixtures",
                 "Journal of the Royal Statistical Society B", 20, "344", 1958),
        _article("lenth1989", "Lenth, R. V.", "Quick and easy analysis of unreplicated factorials", "Technometrics",
                 31, "469", 1989),
        _article("hurvich1989", "Hurvich, C. M. and Tsai, C.-L.",
                 "Regression and time series model selection in small samples", "Biometrika", 76, "297", 1989),
        _article("ai2011", "Ai, J. and others",
                 "Assessment of rolling resistance models in discrete element simulations",
                 "Powder Technology", 206, "269", 2011),
        _standard("astm_f2117", "ASTM F2117", "Vertical rebound characteristics of sports surface/ball systems"),
        _book("cohen1988", "Cohen, J.", "Statistical Power Analysis for the Behavioral Sciences", 1988),
        _book("mohsenin1986", "Mohsenin, N. N.", "Physical Properties of Plant and Animal Materials", 1986),
        _book("myers2016", "Myers, R. H. and Montgomery, D. C. and Anderson-Cook, C. M.",
              "Response Surface Methodology", 2016),
        _standard("gum2008", "JCGM 100:2008", "Guide to the expression of uncertainty in measurement (GUM)"),
        _standard("asae_s368", "ASAE S368", "Compression test of food materials of convex shape"),
        _standard("iso2591", "ISO 2591-1", "Test sieving"),
        _standard("astm_c136", "ASTM C136", "Sieve analysis of fine and coarse aggregates"),
        _article("derringer1980", "Derringer, G. and Suich, R.",
                 "Simultaneous optimization of several response variables",
                 "Journal of Quality Technology", 12, "214", 1980, "10.1080/00224065.1980.11980968"),
        _standard("astm_d6393", "ASTM D6393", "Bulk solids characterization by Carr indices"),
        _standard("iso60", "ISO 60",
                  "Plastics: apparent density of material that can be poured from a specified funnel"),
        _standard("usp616", "USP <616>", "Bulk density and tapped density of powders"),
        _standard("processes2022", "Processes 2022, 10, 185",
                  "Parameter Measurement of Edible Sunflower Exudates and Calibration of Discrete Element Simulation "
                  "Parameters"),
    )
}  # fmt: skip


def cited(key: str) -> str:
    """A source in the text: "Welch 1947", "Box and Behnken 1960", "Thornton et al. 2013"."""
    fields = SOURCES[key].fields
    if "shorthand" in fields:
        return fields["shorthand"]
    names = [name.partition(",")[0] for name in fields["author"].split(" and ")]
    who = " and ".join(names) if len(names) < 3 and "others" not in names else f"{names[0]} et al."
    return f"{who} {fields['year']}"


def citations(keys: tuple[str, ...]) -> str:
    """Several sources in brackets, preceded by a space; "" for none."""
    return f" ({'; '.join(map(cited, keys))})" if keys else ""


def methods_section(
    text: str, versions: Mapping[str, str | None], done: str = "Simulated and analysed"
) -> tuple[Section, tuple[Reference, ...]]:
    """The section (a paragraph and a list of its sources), and the sources as entries; ``done`` with which programs."""
    used = tuple(one for key, one in SOURCES.items() if cited(key) in text)
    programs = software(versions)
    if programs:
        text += f" {done} with {enumeration([_program(one) for one in programs])}."
    listed = Bullets(tuple(map(reference_text, (*used, *programs))))
    note = Text("Ready to paste; its sources are in `references.bib` beside this report.")
    return Section("Methods", (Text(text), note, listed)), (*used, *programs)


def reference_text(one: Reference) -> str:
    """A source as a line of a list."""
    fields = one.fields
    if "shorthand" in fields:
        return f"{fields['shorthand']}: {fields['title']}."
    if "author" not in fields:
        return f"{fields['title']} {fields.get('version', '')}".strip()
    names = re.sub(r" and (?=.* and )", "; ", fields["author"])
    names = names.replace(" and others", " et al.")
    doi = f" doi:{fields['doi']}" if "doi" in fields else ""
    place = f" {fields['journal']} {fields['volume']}:{fields['pages']}." if "journal" in fields else ""
    return f"{names} ({fields['year']}): {fields['title']}.{place}{doi}"


def software(versions: Mapping[str, str | None]) -> tuple[Reference, ...]:
    """The programs of a result as sources."""
    return tuple(
        Reference(f"software-{name}", "misc", {"title": name, "version": version, "howpublished": "Computer program"})
        for name, version in versions.items()
        if version and name != "physics"
    )


def _program(one: Reference) -> str:
    return f"{one.fields['title']} {one.fields['version']}"
