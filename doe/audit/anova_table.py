"""A printed analysis of variance by itself: which terms its lines name, and whether its figures agree with one another.

Lines are known by the names that R, rsm, SAS, Minitab, Design-Expert, JMP and Statistica give them. The terms of the
model are those that the table names, alone or by group ("Linear", "Square", "2-Way Interaction").

No runs are needed for MS = SS/df, F = MS/MS of the error and p = P(F(df, df of the error) > F). Degrees of freedom are
exact; every other print stands for the interval that rounds to it, and so does what is computed from it. There is no
slack beyond that. An F that was divided by hand, from the mean squares as printed, is right as well.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import inf
from typing import Literal, cast

from scipy import stats

from doe.analysis.surface import term_names
from doe.audit.printed import Interval, Printed
from doe.audit.study import AnovaLine
from doe.errors import StatisticsError

Role = Literal["term", "group", "model", "residual", "lack_of_fit", "pure_error", "total", "other"]
Column = Literal["sum_of_squares", "sequential", "df", "mean_square", "f", "p"]
Cell = tuple[int, Column]
"""Line and column."""

WORDS: dict[Column, str] = {
    "sum_of_squares": "sum of squares",
    "sequential": "sequential sum of squares",
    "df": "degrees of freedom",
    "mean_square": "mean square",
    "f": "F",
    "p": "p",
}
NAMES: dict[str, tuple[str, ...]] = {
    "model": ("model", "corrected_model", "regression", "total_model", "total_regression", "total_regress"),
    "residual": ("residual", "residuals", "residual_error", "total_error"),
    "lack_of_fit": ("lack_of_fit", "lof"),
    "pure_error": ("pure_error",),
    "total": ("total", "sum", "cor_total", "corr_total", "corrected_total", "c_total", "total_ss", "total_corrected"),
    "linear": ("linear", "first_order"),
    "interaction": (
        *("interaction", "interactions", "2_way_interaction", "2_way_interactions", "two_way_interaction"),
        *("two_way_interactions", "2fi", "crossproduct", "cross_product", "crossproducts"),
    ),
    "square": ("square", "squares", "quadratic", "pure_quadratic"),
}
"""Our name of a line → what programs call it, in small letters with _ between words. "Error" depends on the others."""
GROUPS = ("linear", "interaction", "square")
RSM = {"fo": "linear", "twi": "interaction", "pq": "square", "so": "model"}
SIGNS = {"²": "^2", "**2": "^2", "×": "*", "·": "*", "⋅": "*", ":": "*", " by ": "*", " x ": "*"}


@dataclass(frozen=True)
class Line:
    """One line of a table: what it is, our name of it, and the terms that it stands for."""

    role: Role
    source: str
    terms: tuple[str, ...]
    printed: AnovaLine

    @property
    def df(self) -> float | None:
        """Degrees of freedom as printed."""
        return None if self.printed.df is None else self.printed.df.value

    def cell(self, column: Column) -> Printed | None:
        """One figure."""
        return cast(Printed | None, getattr(self.printed, column))


@dataclass(frozen=True)
class Judged:
    """A figure by others of its table: whether it can be so, what they give, their whole interval, and their names."""

    agrees: bool
    value: float
    interval: Interval
    how: str
    partners: tuple[Column, ...]


def read_lines(anova: Sequence[AnovaLine], factors: tuple[str, ...]) -> tuple[Line, ...]:
    """The lines of a table in its order; what is neither a term of second order nor a usual line is "other".

    "Error" is the residual, lack of fit and pure error together. It is the pure error where the table has a residual
    beside it, or where it has no other pure error and makes up the total only together with the lack of fit.
    """
    labels = _labels(anova, factors)
    sources = [source_name(line.source, factors, labels) for line in anova]
    kinds = _kinds(factors)
    if "error" in sources:
        error = "pure_error" if _is_pure(anova, sources, kinds) else "residual"
        sources = [error if source == "error" else source for source in sources]
    totals = [line.source.strip().lower() for source, line in zip(sources, anova, strict=True) if source == "total"]
    if len(set(totals)) > 1:
        # SPSS has an uncorrected "Total" beside the "Corrected Total".
        plain = [line.source.strip().lower() == "total" for line in anova]
        sources = ["uncorrected_total" if other else name for name, other in zip(sources, plain, strict=True)]
    lines = []
    for source, line in zip(sources, anova, strict=True):
        if source in kinds:
            lines.append(Line("term", source, (source,), line))
        elif source in GROUPS:
            whole = tuple(term for term, kind in kinds.items() if kind == source)
            lines.append(Line("group", source, tuple(t for t in whole if t in sources) or whole, line))
        else:
            role = cast(Role, source) if source in NAMES else "other"
            lines.append(Line(role, source, (), line))
    return tuple(lines)


def source_name(text: str, factors: tuple[str, ...], labels: Mapping[str, str] | None = None) -> str:
    """The source of a printed line as our own table names it: "X1 × X2" → "X1*X2"; "X1²" → "X1^2"; "Cor Total" →
    "total". labels: what the table calls the factors besides their names → factor."""
    term = _term(text, factors, labels if labels is not None else _labels((), factors))
    if term is not None:
        return term
    rsm = re.match(r"(fo|twi|pq|so)\(", text.strip().lower())
    if rsm:
        return RSM[rsm[1]]
    words = re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")
    return next((name for name, known in NAMES.items() if words in known), words)


def named_terms(lines: Sequence[Line]) -> tuple[str, ...]:
    """The terms of the model in the order of the table, which is that of sequential sums of squares."""
    single = {term for line in lines if line.role == "term" for term in line.terms}
    found: dict[str, None] = {}
    for line in lines:
        if line.role == "term" or (line.role == "group" and not single & set(line.terms)):
            found |= dict.fromkeys(line.terms)
    return tuple(found)


def require_degrees(lines: Sequence[Line], terms: Sequence[str], factors: tuple[str, ...], runs: int) -> None:
    """Raise StatisticsError where the printed degrees of freedom are not those of a model of these terms and runs."""
    expected: dict[Role, int] = {"model": len(terms), "residual": runs - 1 - len(terms), "total": runs - 1}
    for line in lines:
        wanted = expected.get(line.role, len(line.terms) or None)
        if line.df is not None and wanted is not None and line.df != wanted:
            raise StatisticsError(
                f"degrees of freedom do not fit: {line.printed.source} has {line.df:g} in the table, but {wanted} with "
                f"{runs} runs and the {len(terms)} terms that it names ({', '.join(terms)})"
            )
    settled = any(line.role in ("model", "residual") and line.df is not None for line in lines)
    if not settled and len(terms) + 1 < len(term_names(factors)):
        raise StatisticsError(
            "the table lacks the degrees of freedom that tell whether the model has more terms than it names"
        )


def consistency(lines: Sequence[Line]) -> tuple[dict[Cell, Judged], Role]:
    """What the figures of a table say of one another, and which error its terms are tested against."""
    tested = [k for k, line in enumerate(lines) if line.role not in ("residual", "pure_error", "total", "lack_of_fit")]
    found: dict[Cell, Judged] = {}
    for k, line in enumerate(lines):
        judged = _mean_square(line)
        if judged is not None:
            found[k, "mean_square"] = judged
    best: tuple[int, Role, dict[Cell, Judged]] = (-1, "residual", {})
    for role in ("residual", "pure_error"):
        error = _line(lines, role)
        tests = {} if error is None else _tests(lines, tested, error)
        right = sum(one.agrees for one in tests.values())
        # Most tables test against the residual; one that does not says so by its F.
        if right > best[0]:
            best = (right, role, tests)
    pure = _line(lines, "pure_error")
    lack = [k for k, line in enumerate(lines) if line.role == "lack_of_fit"]
    return found | best[2] | ({} if pure is None else _tests(lines, lack, pure)), best[1]


def _kinds(factors: tuple[str, ...]) -> dict[str, str]:
    """Term → its group."""
    return {
        term: "interaction" if "*" in term and term not in factors else "square" if term.endswith("^2") else "linear"
        for term in term_names(factors)[1:]
    }


def _is_pure(anova: Sequence[AnovaLine], sources: Sequence[str], kinds: Mapping[str, str]) -> bool:
    """Whether "Error" is the pure error."""
    if "pure_error" in sources:
        return False
    if "residual" in sources:
        return True
    df = {source: line.df.value for source, line in zip(sources, anova, strict=True) if line.df is not None}
    explained = df.get("model", sum(value for source, value in df.items() if source in kinds))
    return {"lack_of_fit", "error", "total"} <= df.keys() and (
        explained + df["lack_of_fit"] + df["error"] == df["total"]
    )


def _labels(anova: Sequence[AnovaLine], factors: tuple[str, ...]) -> dict[str, str]:
    """What a table calls the factors → factor: their names, and letters or numbers that it gives them ("A-Temp")."""
    labels = {name: name for name in factors}
    small = Counter(name.casefold() for name in factors)
    labels |= {
        name.casefold(): name for name in factors if small[name.casefold()] == 1 and name.casefold() not in labels
    }
    for line in anova:
        given = re.fullmatch(r"(?:([A-Z])\s*[-–]\s*|\((\d+)\)\s*)(.+?)\s*(?:\([LQ]\))?", line.source.strip())
        if given is None:
            continue
        label, name = given[1] or given[2], given[3]
        factor = labels.get(name) or labels.get(name.casefold()) or labels.get(label)
        if factor is not None:
            labels.setdefault(label, factor)
            labels.setdefault(name, factor)
            labels.setdefault(line.source.strip(), factor)
    return labels


def _term(text: str, factors: tuple[str, ...], labels: Mapping[str, str]) -> str | None:
    """The term of second order that a text names; None for anything else."""
    plain = text.strip()
    if plain in labels:
        return labels[plain]
    for sign, ours in SIGNS.items():
        plain = plain.replace(sign, ours)
    plain = re.sub(r"^I\((.*)\)$", r"\1", plain)
    # JMP: "(Temp-175)*(Temp-175)" and "Temp(150,200)" are the factor; R and Statistica: "(1)Temp (L)".
    plain = re.sub(r"\(([^()]+?)\s*[-+]\s*\d+\.?\d*\)", r"\1", plain)
    plain = re.sub(r"\(\s*[-+]?[\d.]+\s*,\s*[-+]?[\d.]+\s*\)", "", plain)
    pieces = [_piece(piece, labels) for piece in plain.split("*")]
    if None in pieces:
        joined = plain.replace(" ", "")
        letters = [label for label in labels if not label.isdigit()]
        pairs = {tuple(sorted((labels[a], labels[b]))) for a, b in product(letters, letters) if a + b == joined}
        pieces = [(name, 1) for name in pairs.pop()] if len(pairs) == 1 else []
    powers: Counter[str] = Counter()
    for name, power in cast(list[tuple[str, int]], pieces):
        powers[name] += power
    names = [name for name in factors if name in powers]
    if powers.total() == 1:
        return names[0]
    if powers.total() == 2:
        return f"{names[0]}*{names[1]}" if len(names) == 2 else f"{names[0]}^2"
    return None


def _piece(text: str, labels: Mapping[str, str]) -> tuple[str, int] | None:
    """A factor and its power: "A", "A^2", "Temp (Q)", "2L"."""
    found = re.fullmatch(r"(?:\(\d+\)\s*)?\(?(.+?)\)?\s*(\^2|\(?[LQ]\)?)?", text.strip())
    if found is None:
        return None
    name, mark = found[1], found[2] or ""
    if mark in ("L", "Q") and not name.isdigit():
        name = text.strip()
        mark = ""
    factor = labels.get(name) or labels.get(name.casefold())
    return None if factor is None else (factor, 2 if mark.strip("()") in ("^2", "Q") else 1)


def _line(lines: Sequence[Line], role: Role) -> Line | None:
    return next((line for line in lines if line.role == role), None)


def _by_sum(line: Line) -> Interval | None:
    """SS/df of a line, None where they are not printed."""
    sum_, df = line.printed.sum_of_squares, line.df
    if sum_ is None or not df or df < 0:
        return None
    low, high = sum_.interval
    return max(0.0, low) / df, high / df


def _mean_square(line: Line) -> Judged | None:
    """The mean square by the sum of squares."""
    by_sum, print_, sum_ = _by_sum(line), line.printed.mean_square, line.printed.sum_of_squares
    if by_sum is None or print_ is None or sum_ is None:
        return None
    how = f"{sum_.text}/{line.df:g}, its sum of squares and degrees of freedom as printed"
    return Judged(print_.meets(by_sum), sum_.value / cast(float, line.df), by_sum, how, ("sum_of_squares",))


def _mean_squares(line: Line) -> tuple[Interval, ...]:
    """Where the mean square of a line lies, by both of its prints; each by itself where they exclude each other."""
    both = [_by_sum(line)] + ([line.printed.mean_square.interval] if line.printed.mean_square else [])
    known = [(max(0.0, low), high) for low, high in (one for one in both if one is not None) if high >= 0]
    if len(known) == 2:
        low, high = max(one[0] for one in known), min(one[1] for one in known)
        if low <= high:
            return ((low, high),)
    return tuple(known)


def _as_printed(line: Line) -> tuple[float, str] | None:
    """The mean square of a line as one would read it off, and in words."""
    print_, sum_, df = line.printed.mean_square, line.printed.sum_of_squares, line.df
    if print_ is not None:
        return print_.value, print_.text
    return (sum_.value / df, f"({sum_.text}/{df:g})") if sum_ is not None and df else None


def _tests(lines: Sequence[Line], tested: Sequence[int], error: Line) -> dict[Cell, Judged]:
    """F and p of the lines that are tested against one error."""
    found: dict[Cell, Judged] = {}
    below, under = _mean_squares(error), _as_printed(error)
    for k in tested:
        line, above = lines[k], _as_printed(lines[k])
        ratios = [_quotient(one, other) for one in _mean_squares(line) for other in below]
        point = above[0] / under[0] if above is not None and under is not None and under[0] > 0 else None
        how = (
            f"{above[1]}/{under[1]}, its mean square over that of the {error.source} as printed"
            if above and under
            else ""
        )
        print_ = line.printed.f
        if print_ is not None and ratios and point is not None:
            agrees = any(map(print_.meets, ratios)) or print_.agrees(point)
            # An error that may be zero allows any F above the least.
            if not agrees or min(high for _, high in ratios) < inf:
                interval = (min(low for low, _ in ratios), max(high for _, high in ratios))
                found[k, "f"] = Judged(agrees, point, interval, how, ("sum_of_squares", "mean_square"))
        judged = _p_value(line, error, ratios, point, how)
        if judged is not None:
            found[k, "p"] = judged
    return found


def _p_value(line: Line, error: Line, ratios: list[Interval], point: float | None, how: str) -> Judged | None:
    """p by F as printed or, where that is another or none, by the mean squares."""
    print_, f, df = line.printed.p, line.printed.f, (line.df, error.df)
    if print_ is None or not df[0] or not df[1] or (f is None and not ratios):
        return None
    if f is not None:
        ratios, how = [f.interval, *ratios], f"F = {f.text} as printed"
    tails = [tuple(float(stats.f.sf(max(0.0, end), *df)) for end in (high, low)) for low, high in ratios]
    agrees = any(print_.meets((low, high)) for low, high in tails)
    value = f.value if f is not None and not f.bound else point
    if agrees and ((tails[0][0] == 0 and tails[0][1] == 1) or value is None):
        return None
    how = f"from {how}, on {df[0]:g} and {df[1]:g} degrees of freedom"
    interval = (min(low for low, _ in tails), max(high for _, high in tails))
    partners: tuple[Column, ...] = ("f",) if f is not None else ("sum_of_squares", "mean_square")
    tail = float(stats.f.sf(value, *df)) if value is not None else interval[1]
    return Judged(agrees, tail, interval, how, partners)


def _quotient(above: Interval, below: Interval) -> Interval:
    return above[0] / below[1] if below[1] > 0 else 0.0, above[1] / below[0] if below[0] > 0 else inf
