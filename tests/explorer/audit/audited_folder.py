"""A published study written as a folder in the format of `explorer audit`, to be read back or spoiled in one place."""

import csv
import json

TABLES = {
    "elastic": "elastic.csv",
    "density": "density.csv",
    "replicates": "replicates.csv",
    "shares": "shares.csv",
    "drop": "drop.csv",
    "factors": "factors.csv",
    "screening": "screening.csv",
    "screening_anova": "screening_anova.csv",
    "ascent": "ascent.csv",
    "surface": "surface.csv",
    "surface_anova": "surface_anova.csv",
    "verification": "verification.csv",
    "target": "target.csv",
}


def write_study(folder, study):
    """Write every part of ``study`` and return the folder."""
    for name, rows in _tables(study).items():
        with (folder / TABLES[name]).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)
    (folder / "study.toml").write_text(_toml(study), encoding="utf-8")
    return folder


def _texts(prints):
    return [one.text for one in prints]


def _tables(study):
    derived, measured, screening, ascent, surface = (
        study.derived[0],
        study.measured[0],
        study.screening,
        study.ascent,
        study.surface,
    )
    names = [factor.name for factor in screening.factors]
    runs = zip(screening.design.tolist(), _texts(screening.responses), strict=True)
    tests = zip(names, _texts(screening.sums), _texts(screening.f), _texts(screening.p), strict=True)
    steps = zip(ascent.steps, ascent.settings.tolist(), _texts(ascent.responses), _texts(ascent.errors), strict=True)
    points = zip(surface.coded.tolist(), _texts(surface.responses), strict=True)
    keys = ("sum_of_squares", "df", "mean_square", "f", "p")
    lines = [
        [line.source, *(getattr(line, k).text if getattr(line, k) else "" for k in keys)] for line in surface.anova
    ]
    return {
        "elastic": [
            ["part", "E", "G", "nu"],
            *(
                [row, cells["E"].text, cells["G"].text, nu.text]
                for row, cells, nu in zip(derived.rows, derived.inputs, derived.printed, strict=True)
            ),
        ],
        "density": [["part", "density"], *zip(measured.rows, _texts(measured.printed), strict=True)],
        "replicates": [
            ["part", "density"],
            *([row, run.text] for row, runs_ in zip(measured.rows, measured.replicates, strict=True) for run in runs_),
        ],
        "shares": [["part", "share"], *([str(k), one.text] for k, one in enumerate(study.totals[0].parts))],
        "drop": [["pair", "e"], *([str(k), one.text] for k, one in enumerate(study.drop_test.restitutions))],
        "factors": [["factor", "low", "high"], *([f.name, f.low, f.high] for f in screening.factors)],
        "screening": [[*names, "angle"], *([*row, text] for row, text in runs)],
        "screening_anova": [["factor", "sum_of_squares", "f_value", "p_value"], *tests],
        "ascent": [["step", *ascent.factors, "angle", "error"], *([k, *s, y, e] for k, s, y, e in steps)],
        "surface": [[*surface.factors, "angle"], *([*row, text] for row, text in points)],
        "surface_anova": [["source", "sum_of_squares", "df", "mean_square", "f_value", "p_value"], *lines],
        "verification": [["angle"], *([text] for text in _texts(study.verified.responses))],
        "target": [["# ten pours"], ["angle"], *([text] for text in _texts(study.target.replicates))],
    }


def _toml(study):
    target, screening, surface, verified = study.target, study.screening, study.surface, study.verified
    factors = "".join(
        f'[[surface.factor]]\nname = "{name}"\nscreened = "{old}"\ncolumn = "{name}"\nlow = {low}\nhigh = {high}\n'
        for name, old, low, high in zip(
            surface.factors, surface.screened, surface.low.tolist(), surface.high.tolist(), strict=True
        )
    )
    terms = "\n".join(f'"{name}" = {cell.text}' for name, cell in surface.equation.coefficients.items())
    statistics = "\n".join(f"{name} = {cell.text}" for name, cell in surface.statistics.items())
    values = ", ".join(f"{n} = {v.text}" for n, v in zip(surface.factors, study.optimum.values, strict=True))
    quote = study.quotes[0]
    return f"""
format = 1
title = "{study.title}"
source = "{study.source}"
[target]
where = "{target.where}"
quantity = "{target.quantity}"
unit = "{target.unit}"
mean = {target.mean.text}
sd = {target.sd.text}
n = {target.n}
file = "target.csv"
column = "angle"
[[derived]]
where = "Table 1"
file = "elastic.csv"
quantity = "Poisson's ratio"
column = "nu"
formula = "{study.derived[0].formula}"
[[measured]]
where = "Table 1"
file = "density.csv"
columns = ["density"]
made_from = "3 tests"
replicates = "replicates.csv"
[[total]]
where = "Table 2"
quantity = "share [%]"
file = "shares.csv"
column = "share"
total = {study.totals[0].total.text}
[[quoted]]
where = "{quote.where}"
quantity = "{quote.quantity}"
text = "{quote.text}"
value = {quote.value.text}
table = "{quote.original_where}"
file = "drop.csv"
row = {{ pair = "0" }}
column = "e"
[drop_test]
where = "{study.drop_test.where}"
formula = "{study.drop_test.formula}"
plate_angle_deg = {study.drop_test.plate_angle_deg}
fall = {study.drop_test.fall}
file = "drop.csv"
column = "e"
[screening]
runs = "screening.csv"
where_runs = "{screening.where_runs}"
response = "angle"
design = true
factors = "factors.csv"
anova = "screening_anova.csv"
where_anova = "{screening.where_anova}"
error_df = {screening.error_df}
total = {screening.total.text}
significant = {json.dumps(screening.significant)}
level = {screening.level}
level_of_others = {screening.level_of_others}
[ascent]
where = "{study.ascent.where}"
file = "ascent.csv"
step = "step"
response = "angle"
error = "error"
best = "{study.ascent.best}"
factors = {{ {", ".join(f'{name} = "{name}"' for name in study.ascent.factors)} }}
[surface]
runs = "surface.csv"
where_runs = "{surface.where_runs}"
response = "angle"
anova = "surface_anova.csv"
where_anova = "{surface.where_anova}"
where_statistics = "{surface.where_statistics}"
steps = {{ low = "{surface.steps.low}", centre = "{surface.steps.centre}", high = "{surface.steps.high}" }}
{factors}
[surface.statistics]
{statistics}
[surface.equation]
where = "{surface.equation.where}"
units = "natural"
[surface.equation.terms]
{terms}
[optimum]
where = "{study.optimum.where}"
values = {{ {values} }}
[verification]
where = "{verified.where}"
file = "verification.csv"
response = "angle"
mean = {verified.mean.text}
relative_error_percent = {verified.relative_error_percent.text}
p_two_sample = {verified.p_two_sample.text}
"""
