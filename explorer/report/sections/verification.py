"""The verification: fresh pours at the optimum against every target."""

from __future__ import annotations

from explorer.report.content import Block, Figure, Section, Table, Text
from explorer.report.figures.verification import verification as verification_chart
from explorer.report.findings import Plain, standard_error
from explorer.report.units_for_people import (
    MISSING,
    fixed,
    observable_label,
    observed,
    p_value,
    percent,
    unit_of_observable,
)

TESTS = (
    ("welch", "Welch, two samples"),
    ("pooled", "Student, two samples, equal variances"),
    ("one_sample", "one sample against the measured mean"),
)


def verification(result: Plain) -> Section:
    """Per target: samples, tests, equivalence, relative error beside the noise."""
    stage = result["verification"]
    seeds = len({run["seed"] for run in stage["runs"]})
    blocks: list[Block] = [
        Text(
            f"{len(stage['runs'])} pours at the optimum with {seeds} seeds that no other stage used; "
            f"{percent(stage['no_pile_share'], 1)} are not valid. Means are over valid pours."
        )
    ]
    for index, (target, test) in enumerate(zip(stage["targets"], stage["tests"], strict=True)):
        blocks += _of_target(result, index, target, test)
    return Section("Verification", tuple(blocks))


def _of_target(result: Plain, index: int, target: Plain, test: Plain) -> list[Block]:
    name = target["observable"]
    words = observable_label(name)
    caption = "Band: target ± equivalence margin, fixed before any run."
    return [
        Text(f"{words[0].upper()}{words[1:]}: {verdict(target, test)}"),
        Figure(f"verification-{index + 1}", verification_chart(result, index), caption),
        _samples(target, test),
        _tests(target, test),
    ]


def verdict(target: Plain, test: Plain) -> str:
    """The outcome in one sentence, the equivalence test first: no difference found is no proof of agreement."""
    name = target["observable"]
    margin = observed(name, target["margin"])
    deciding = test["welch"] or test["one_sample"]
    words = {
        "equivalent": f"equivalent to the measurement within ± {margin}.",
        "different": f"different from the measurement, and not shown to lie within ± {margin}.",
        "cannot tell": f"neither different nor shown to lie within ± {margin}; more pours are needed to tell.",
    }[test["verdict"]]
    if deciding is None or deciding["low"] is None:
        return words
    interval = f"{_difference(name, deciding['low'])} … {_difference(name, deciding['high'])}"
    return f"{words} Difference {_difference(name, deciding['difference'])}, 95 % interval {interval}."


def _samples(target: Plain, test: Plain) -> Table:
    name = target["observable"]
    rows = []
    samples = [("simulated", test["simulated"]), ("measured", test["target"])]
    if target.get("before_mean") is not None:
        samples.append(("the model before", {key: target[f"before_{key}"] for key in ("mean", "sd", "n")}))
    for words, sample in samples:
        sd = observed(name, sample["sd"])
        if words == "measured" and sample["sd"] is not None and target["sd_source"] != "measured":
            sd += f" ({target['sd_source']})"
        spread = observed(name, standard_error(sample))
        rows.append((words, observed(name, sample["mean"]), sd, str(sample["n"] or MISSING), spread))
    error = standard_error(test["simulated"])
    share = None if error is None else 100 * error / abs(target["mean"])
    caption = (
        f"Relative error {fixed(test['relative_error_percent'])} %; standard error of the simulated mean "
        f"{fixed(share)} % of the target."
    )
    return Table(("", "mean", "sd", "n", "standard error"), tuple(rows), caption)


def _tests(target: Plain, test: Plain) -> Table:
    name = target["observable"]
    rows: list[tuple[str, ...]] = []
    for key, words in TESTS:
        found = test[key]
        if found is None:
            continue
        interval = f"{_difference(name, found['low'])} … {_difference(name, found['high'])}"
        rows.append(
            (
                words,
                _difference(name, found["difference"]),
                f"{percent(found['level'])}: {interval}",
                fixed(found["t"]),
                fixed(found["df"], 1),
                p_value(found["p"]),
            )
        )
    found = test["equivalence"]
    if found is not None:
        interval = f"{_difference(name, found['low'])} … {_difference(name, found['high'])}"
        margin = observed(name, found["margin"])
        rows.append(
            (
                f"equivalence within ± {margin} (TOST)",
                MISSING,
                f"{percent(found['level'])}: {interval}",
                MISSING,
                MISSING,
                p_value(found["p"]),
            )
        )
    if not rows:
        rows.append(("no test: one pour, or no spread", *[MISSING] * 5))
    caption = "Difference = simulated − measured. A small p of the equivalence test speaks for agreement."
    return Table(("test", "difference", "interval", "t", "df", "p"), tuple(rows), caption)


def _difference(name: str, value: float | None) -> str:
    """A difference with its sign and unit."""
    text = observed(name, value)
    unit = unit_of_observable(name)
    return f"+{text}" if value is not None and unit.of(value) >= 0 else text
