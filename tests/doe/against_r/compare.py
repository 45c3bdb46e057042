"""Published data sets here and in R: the numbers that `test_against_r.py` holds and docs/against_r.md shows.

`make against-r` asks R again (`against_r.R`, which writes reference.csv) and writes the page.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from doe.analysis.analyse import DesignAnalysis
from explorer.design.analysis import AnalyseOrder, run_analyse

FOLDER = Path(__file__).parent
PAGE = FOLDER.parents[2] / "docs/against_r.md"
QUADRATIC: dict[str, Any] = {"order": "quadratic"}
ORDERS: dict[str, dict[str, Any]] = {
    "codata": QUADRATIC,
    "stress": QUADRATIC,
    "uniformity": QUADRATIC,
    "resin": QUADRATIC,
    "heli": QUADRATIC,
    "ChemReact": {"order": "quadratic", "block": "block"},
    "trees": QUADRATIC,
    "stackloss": {"order": "linear"},
    "reactor": {"order": "interactions"},
    "castfatigue": {"terms": ("F*G",)},
    "filtration": {},
    "warpbreaks": {"order": "interactions"},
    "anorexia": {"order": "interactions"},
    "oats": {"response": "Y", "order": "interactions", "block": "B", "random": "plot"},
    "ergoStool": {"random": "Subject"},
    "petrol": {"response": "Y", "order": "linear", "random": "No"},
}
"""Data set → how it is analysed here."""
ROUNDING = 1e-8
"""Relative; of double precision in other orders of summation, over the condition of the worst model (1e4, of the
numbers that R prints with 15 digits)."""
ITERATION = 1e-5
"""Relative, of what `nlme::lme` iterates to: the likelihood is flat about its largest value."""
POWER = 5e-4
"""Of a power of Box and Cox: ours is the top of a parabola through three powers 0.05 apart, R's of a search."""
ITERATED = ("petrol", "ergoStool")
SHOWN = (
    *("R2 predicted", "PRESS", "F lack_of_fit", "p lack_of_fit", "largest studentised residual", "Box-Cox power"),
    *(
        "stationary A",
        "eigenvalue 1",
        "coefficient F*G",
        "coefficient B*D",
        "effect A*C",
        "F A",
        "F B",
        "F A*B",
        "p A*B",
    ),
    *("p A*B", "error df A", "variance between", "variance within", "deviance", "standard error D"),
)
"""Quantities on the page; the others are compared too, and counted there."""


@dataclass(frozen=True)
class Compared:
    """One number of a data set."""

    data: str
    call: str
    quantity: str
    theirs: float
    ours: float

    @property
    def difference(self) -> float:
        """Relative to R's number, or to one where that is smaller by far than what it is the difference of."""
        return abs(self.ours - self.theirs) / max(abs(self.theirs), 1e-6)

    @property
    def tolerance(self) -> float:
        """What the difference may be, by its cause."""
        if self.quantity == "Box-Cox power":
            return POWER / abs(self.theirs)
        exact = self.quantity in ("error df A", "deviance")
        return ITERATION if self.data in ITERATED and not exact else ROUNDING


def reference() -> list[tuple[str, str, str, float]]:
    """Data set, R call, quantity and number, as R wrote them."""
    lines = (FOLDER / "reference.csv").read_text(encoding="utf-8").splitlines()
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    return [(data, call, quantity, float(value)) for data, call, quantity, value in rows[1:]]


def compared(name: str) -> list[Compared]:
    """Every number of a data set."""
    found = run_analyse(AnalyseOrder(str(FOLDER / f"{name}.csv"), **ORDERS[name])).analysis
    ours = quantities(found)
    return [Compared(*row, ours.get(row[2], math.nan)) for row in reference() if row[0] == name]


def quantities(found: DesignAnalysis) -> dict[str, float]:
    """The numbers of an analysis by the names that `against_r.R` gives them."""
    numbers: dict[str, float] = {}
    rows = ()
    if found.effects is not None:
        numbers |= {f"effect {one.name}": one.effect for one in found.effects.screening.effects}
    if found.model is not None:
        model, anova = found.model, found.model.anova
        fit = model.surface
        for k in np.flatnonzero(fit.included):
            numbers[f"coefficient {fit.terms[k]}"] = fit.coefficients[k]
            numbers[f"standard error {fit.terms[k]}"] = anova.coefficient_standard_errors[k]
        rows = anova.rows
        numbers |= {
            "sigma": anova.sigma,
            "R2": anova.r_squared,
            "R2 adjusted": anova.r_squared_adjusted,
            "R2 predicted": anova.r_squared_predicted,
            "PRESS": anova.press,
            "largest studentised residual": float(np.nanmax(np.abs(model.diagnostics.external))),
            "largest Cook distance": float(np.nanmax(model.diagnostics.cooks_distance)),
            "Shapiro p": model.diagnostics.shapiro_p,
            "Box-Cox power": model.box_cox.best,
        }
        if model.canonical is not None:
            values = sorted(model.canonical.eigenvalues.tolist(), reverse=True)
            numbers |= {f"eigenvalue {k}": value for k, value in enumerate(values, start=1)}
            point = zip(fit.names, model.canonical.stationary_coded.tolist(), strict=True)
            numbers |= {f"stationary {name}": level for name, level in point}
    if found.named is not None:
        rows = found.named.rows
        numbers["sigma"] = found.named.sigma
    for row in rows:
        numbers |= {f"SS {row.source}": row.sum_of_squares, f"F {row.source}": row.f, f"p {row.source}": row.p}
    if found.random is not None:
        between, within = found.random.components
        numbers |= {"variance between": between.variance, "variance within": within.variance}
        numbers["deviance"] = found.random.deviance
        for test in found.random.tests:
            numbers |= {
                f"F {test.source}": test.f,
                f"p {test.source}": test.p,
                f"error df {test.source}": test.df_error,
            }
        for one in found.random.coefficients:
            numbers |= {f"coefficient {one.term}": one.value, f"standard error {one.term}": one.standard_error}
    return numbers


def page() -> str:
    """The page, in Markdown."""
    every = {name: compared(name) for name in ORDERS}
    r = (FOLDER / "reference.csv").read_text(encoding="utf-8").splitlines()[0].partition(" with ")[2]
    total = sum(map(len, every.values()))
    lines = [
        "# Analyses beside R",
        "",
        f"{total} numbers of {len(every)} data sets that R ships or textbooks print, by `explorer analyse` and by {r}",
        "with its own packages (base, MASS, nlme). A response surface of the package rsm is an `lm` of coded factors,",
        "and is fitted as one; factors go by letters in the order of the file, low … high as −1 … +1. Data, R's script",
        "and its numbers: `tests/doe/against_r`; `make against-r` makes all of it again, and a test without R holds",
        "every number.",
        "",
        "Differences are relative. What two orders of summation leave of 15 digits is below 1e-8. The power of Box and",
        "Cox is here the top of a parabola through three powers 0.05 apart (error below 5e-4), and `nlme::lme`",
        "iterates, where the likelihood is flat.",
        "",
        "| data set | source | numbers | largest difference |",
        "|---|---|---|---|",
    ]
    for name, numbers in every.items():
        source = (FOLDER / f"{name}.csv").read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")
        lines.append(f"| `{name}` | {source} | {len(numbers)} | {bound(max(one.difference for one in numbers))} |")
    lines += ["", "| data set | R call | quantity | R | ours | difference |", "|---|---|---|---|---|---|"]
    for numbers in every.values():
        for one in numbers:
            if one.quantity in SHOWN:
                cells = (f"`{one.data}`", f"`{one.call}`", one.quantity, f"{one.theirs:.7g}", f"{one.ours:.7g}")
                lines.append(f"| {' | '.join(cells)} | {bound(one.difference)} |")
    return "\n".join(lines) + "\n"


def bound(difference: float) -> str:
    """The power of ten that a difference is below; the last digits of a double are not told apart."""
    return "< 1e-10" if difference < 1e-10 else f"< 1e{math.floor(math.log10(difference)) + 1}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"wrote {PAGE}")
