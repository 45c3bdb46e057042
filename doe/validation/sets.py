"""``sets.jsonl``, one line per data set and kind of data: how each answer is scored, and the rates of a campaign.

A line is appended when its data set is judged. Its answer is one of

right        the effect's name, or both names of a pair
undecided    ambiguous, with the truth among what it leaves
wrong        another name, ambiguous without the truth, or only one name of a pair
unexplained  more than noise, but no name
nothing      no missing effect

Rows are summarized as rates with denominators and Wilson intervals, and as targets that are met or not. Wilson 1927, J.
Am. Stat. Assoc. 22:209: (p + z²/2n ± z √(p (1 − p)/n + z²/4n²))/(1 + z²/n), z = 1.96.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy import stats
from scipy.special import logsumexp

from doe.diagnose.posterior import priors_of
from doe.diagnose.verdict import DOUBTED, THRESHOLD
from doe.errors import StatisticsError
from doe.measurement.features import SCAN
from doe.record import Record

Answer = Literal["right", "undecided", "wrong", "unexplained", "nothing", "out of reach"]

OUT_OF_REACH = "out of reach: "
"""Start of the verdict on an impossible truth, followed by the reason."""
TRUE_ANSWERS = {"null": "no_missing_effect", "outside": "unexplained"}
"""The true answer to data sets in which no effect of the library acts, by their kind."""
NONE = "none"
"""Label of a data set in which nothing is missing."""
LEVEL = 0.95
HOLDOUT_GOOD = 1.25
"""Holdout error ÷ noise floor that a data set with a right name should not exceed."""
RISKS = (0.0, 0.01, 0.025)
"""Risks of the risk–coverage curve: largest shares of sets with a library effect that get a wrong name; 0.025 is 4 of
160."""
BINS = (0.0, 0.5, 0.7, 0.9, 0.99, 1.0)
"""Bin edges of the probabilities in the reliability diagram."""
LEAST_P = 1e-6
"""Smallest probability of the truth that the logarithmic loss uses."""
TEMPERATURES = (0.4, 0.55, 0.7, 0.85, 1.0, 1.3)
"""Factors by which the log evidence of kept rows is multiplied."""


@dataclass(frozen=True, kw_only=True)
class SetRow(Record):
    """One data set, judged by data of one kind.

    Attributes
    ----------
    laboratory
        Title of the laboratory's file.
    root, number
        Seeds of the truth and of the pours.
    kind, label
        Kind and label of the truth; ``label``: library effect, "a+b", outside effect, or "none".
    strength
        Strength that was asked for [σ]; NaN if none was.
    amplitude
        Amplitudes of the truth's library effects, natural units.
    offer
        "scalars" or "scan".
    verdict
        The answer, after the follow-up if one was asked for.
    first, follow_up
        The answer before the follow-up, and the change of the set-up that was asked for; "" without one.
    asked, chance
        Pours asked for in the follow-up, 0 without one, and the predicted chance that they give an answer.
    nothing, outside, best, best_p, truth_p
        Probabilities; ``best``: the most probable effect; ``truth_p``: of the truth, NaN if it is no library effect.
    evidence
        Log evidence of "base", "outside" and every effect, so that the rule can be tuned on the kept rows.
    fits
        Probability of data at least as far off, under the best fit of "base" and of ``best``.
    held_out_p
        p value of the held-out data under the final model, NaN if it was not computed.
    before, after
        Error ÷ noise floor on the held-out condition, of the calibrated base model and of the model with the named
        effect; NaN unless the name is right.
    bias_before, bias_after
        Root mean square of the parameters' errors, without and with the named effect [standard deviations of their
        measurements]; NaN unless the name is right.
    pours, seconds
        Number of pours that were run for the data set, and wall time [s].
    physics
        Version of the solver's physics in these pours; 0 in rows older than this column.
    """

    laboratory: str
    root: int
    number: int
    kind: str
    label: str
    strength: float
    amplitude: str
    offer: str
    verdict: str
    first: str = ""
    follow_up: str = ""
    asked: int = 0
    chance: float = math.nan
    nothing: float = math.nan
    outside: float = math.nan
    best: str = ""
    best_p: float = math.nan
    truth_p: float = math.nan
    evidence: Mapping[str, float] = field(default_factory=dict)
    fits: Mapping[str, float] = field(default_factory=dict)
    held_out_p: float = math.nan
    before: float = math.nan
    after: float = math.nan
    bias_before: float = math.nan
    bias_after: float = math.nan
    pours: int = 0
    seconds: float = 0.0
    physics: int = 0

    @property
    def answer(self) -> Answer:
        """The score of the verdict."""
        return answer_to(self.verdict, self.kind, self.label)

    @property
    def first_answer(self) -> Answer:
        """The score of the verdict before the follow-up."""
        return answer_to(self.first or self.verdict, self.kind, self.label)

    @property
    def named(self) -> bool:
        """Whether the verdict blames an effect: names one, or leaves only effects."""
        kind, _, rest = self.verdict.partition(":")
        if kind in ("effect", "effects"):
            return True
        return kind == "ambiguous" and not {"no_missing_effect", "unexplained"} & set(rest.split(","))

    @property
    def names(self) -> frozenset[str]:
        """Effects that the verdict names."""
        kind, _, rest = self.verdict.partition(":")
        return frozenset(rest.split("+")) if kind in ("effect", "effects") else frozenset()

    @property
    def truth(self) -> frozenset[str]:
        """The library effects that act."""
        return frozenset(self.label.split("+")) if self.kind in ("effect", "pair") else frozenset()

    @property
    def best_is_true(self) -> bool:
        """Whether the most probable effect is the truth; the two effects of a pair may be in any order."""
        return frozenset(self.best.split("+")) == self.truth

    @property
    def true_p(self) -> float:
        """Probability that the diagnosis gave to the truth; 0 if it did not consider it."""
        of_effect = self.best_p if self.best_is_true else self.truth_p
        p = {"null": self.nothing, "outside": self.outside}.get(self.kind, of_effect)
        return p if math.isfinite(p) else 0.0


@dataclass(frozen=True)
class Rate:
    """A proportion: ``hits`` out of ``sets``."""

    hits: int
    sets: int

    @property
    def share(self) -> float:
        """``hits`` ÷ ``sets``; NaN without sets."""
        return self.hits / self.sets if self.sets else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval; 0 … 1 without sets."""
        return wilson(self.hits, self.sets)

    def __str__(self) -> str:
        if not self.sets:
            return "no set"
        low, high = self.interval
        return f"{self.hits}/{self.sets} = {100 * self.share:.1f} % (95 % {100 * low:.1f} … {100 * high:.1f} %)"


@dataclass(frozen=True)
class CampaignTarget:
    """A target, the result, and whether the target is met (None without data sets)."""

    name: str
    aim: str
    found: str
    met: bool | None


@dataclass(frozen=True)
class Bin:
    """Sets whose most probable answer has a probability in [low, high): its mean, and how often the answer is true."""

    low: float
    high: float
    mean: float
    right: Rate


@dataclass(frozen=True)
class Scores:
    """Scores of the probabilities, over data sets judged by one kind of data.

    Attributes
    ----------
    log_loss
        Mean of −ln of the probability of the truth.
    coverage
        Sets with library effects whose most probable effect is right and would be named, at each of ``RISKS``.
    reliability
        Sets by the probability of their most probable answer.
    f1
        2 TP/(2 TP + FP + FN) of effects named against effects that act, over all sets.
    bias_before, bias_after
        Medians of the parameters' errors [standard deviations of their measurements], without and with the effect, over
        sets with a right name.
    """

    log_loss: float
    coverage: tuple[Rate, ...]
    reliability: tuple[Bin, ...]
    f1: float
    bias_before: float
    bias_after: float


@dataclass(frozen=True)
class Tempered:
    """Results of the last evidence at another temperature, for sets with at most one effect.

    ``log_loss``: as in ``Scores``. ``right``, ``wrong``: names given to sets with an effect; ``false``: names given to
    sets without one.
    """

    temperature: float
    log_loss: float
    right: Rate
    wrong: Rate
    false: Rate


def answer_to(verdict: str, kind: str, label: str) -> Answer:
    """The score of ``verdict`` on a truth of ``kind`` with ``label``, as listed at the top of this module."""
    if verdict.startswith(OUT_OF_REACH):
        return "out of reach"
    said, _, rest = verdict.partition(":")
    if said == "no_missing_effect":
        return "nothing"
    if said == "unexplained":
        return "unexplained"
    names = {frozenset(name.split("+")) for name in rest.split(",")}
    truth = frozenset([TRUE_ANSWERS[kind]] if kind in TRUE_ANSWERS else label.split("+"))
    if said in ("effect", "effects"):
        return "right" if names == {truth} else "wrong"
    return "undecided" if truth in names else "wrong"


def read_rows(path: Path) -> list[SetRow]:
    """Rows in ``path``, in order of numbers and kinds of data; none if there is no such file.

    A line that was cut off when its process ended is skipped, and the last row counts if a data set was judged twice.
    Raises StatisticsError for any other line that is not a row.
    """
    if not path.is_file():
        return []
    rows: dict[tuple[str, int, int, str], SetRow] = {}
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        if not line.rstrip().endswith("}"):
            continue
        try:
            row = _row(json.loads(line))
        except (ValueError, TypeError, AttributeError) as error:
            raise StatisticsError(f"{path}: line {number}: {error}; allowed: a row of a campaign") from None
        rows[row.laboratory, row.root, row.number, row.offer] = row
    return [rows[key] for key in sorted(rows)]


def append_rows(path: Path, rows: Sequence[SetRow]) -> None:
    """Append ``rows`` to the file in one write, so that processes that share it do not mix lines."""
    text = "".join(json.dumps(_rounded(row.to_dict()), ensure_ascii=False) + "\n" for row in rows)
    last = path.read_bytes()[-1:] if path.is_file() else b""
    if last not in (b"", b"\n"):  # after a line that was cut off
        text = "\n" + text
    with path.open("a", encoding="utf-8") as file:
        file.write(text)


def scores(rows: Sequence[SetRow]) -> Scores:
    """Scores of data sets judged by one kind of data."""
    library = [row for row in rows if row.kind in ("effect", "pair")]
    tops = [_top(row) for row in rows]
    bins = []
    for low, high in pairwise(BINS):
        some = [(p, right) for p, right in tops if low <= p < high or p == high == BINS[-1]]
        mean = float(np.mean([p for p, _ in some])) if some else math.nan
        bins.append(Bin(low, high, mean, Rate(sum(right for _, right in some), len(some))))
    found = sum(len(row.names & row.truth) for row in rows)
    off = sum(len(row.names ^ row.truth) for row in rows)
    biases = [[b for row in rows if math.isfinite(b := getattr(row, name))] for name in ("bias_before", "bias_after")]
    before, after = (float(np.median(one)) if one else math.nan for one in biases)
    return Scores(
        float(np.mean([-math.log(max(LEAST_P, row.true_p)) for row in rows])) if rows else math.nan,
        tuple(Rate(_covered(library, risk), len(library)) for risk in RISKS),
        tuple(bins),
        2.0 * found / (2.0 * found + off) if found + off else math.nan,
        before,
        after,
    )


def by_temperature(rows: Sequence[SetRow]) -> tuple[Tempered, ...]:
    """Results for judged sets of one kind of data at each of ``TEMPERATURES``, without pairs in truths and answers."""
    some = [row for row in rows if "outside" in row.evidence and row.kind != "pair"]
    found = []
    for temperature in TEMPERATURES:
        answers = [_probabilities(row, temperature) for row in some]
        loss = [-math.log(max(LEAST_P, p[_truth(row)])) for row, p in zip(some, answers, strict=True)]
        named = [
            max(p, key=lambda one: p[one]) if max(p.values()) >= THRESHOLD and row.fits["base"] < DOUBTED else ""
            for row, p in zip(some, answers, strict=True)
        ]
        accused = [("" if one in ("base", "outside") else one, row) for one, row in zip(named, some, strict=True)]
        effects = [(one, row) for one, row in accused if row.kind == "effect"]
        null = [one for one, row in accused if row.kind == "null"]
        found.append(
            Tempered(
                temperature,
                float(np.mean(loss)) if loss else math.nan,
                Rate(sum(one == row.label for one, row in effects), len(effects)),
                Rate(sum(one not in ("", row.label) for one, row in effects), len(effects)),
                Rate(sum(map(bool, null)), len(null)),
            )
        )
    return tuple(found)


def targets(rows: Sequence[SetRow], offer: str) -> list[CampaignTarget]:
    """The targets for data of the kind ``offer``, from judged sets; shares correspond to the counts set for a test."""
    own = [row for row in rows if row.offer == offer]
    effects = [row for row in own if row.kind == "effect"]
    strong, middle = ([row for row in effects if row.strength == s] for s in (10.0, 6.0))
    null = [row for row in own if row.kind == "null"]
    outside = [row for row in own if row.kind == "outside"]
    library = [row for row in own if row.kind == "pair" or (row.kind == "effect" and row.strength in (6.0, 10.0))]
    after = [row.after for row in own if row.answer == "right" and math.isfinite(row.after)]
    good = Rate(sum(x <= HOLDOUT_GOOD for x in after), len(after))
    median = float(np.median(after)) if after else math.nan
    scans = offer == SCAN
    return [
        _target("effect named where none is", _rate(null, lambda row: row.named), 1 / 150, at_most=True),
        _target("wrong name, effects of 6 and 10 σ and pairs", _rate(library, _wrong), 4 / 160, at_most=True),
        _target("right name at 6 σ", _rate(middle, _right), (53 if scans else 45) / 60, at_most=False),
        _target("right name at 10 σ", _rate(strong, _right), (57 if scans else 54) / 60, at_most=False),
        _target("outside effects called unexplained", _rate(outside, _unexplained), 48 / 60, at_most=False),
        _target("outside effects blamed on the library", _rate(outside, lambda row: row.named), 6 / 60, at_most=True),
        CampaignTarget(
            "holdout error ÷ noise floor, right names",
            "median ≤ 1.1",
            f"{median:.2f} over {len(after)} sets" if after else "no set",
            median <= 1.1 if after else None,
        ),
        _target(f"holdout error ÷ noise floor ≤ {HOLDOUT_GOOD:g}, right names", good, 0.80, at_most=False),
    ]


def wilson(hits: int, sets: int, level: float = LEVEL) -> tuple[float, float]:
    """Wilson's confidence interval of the share ``hits`` ÷ ``sets``; 0 … 1 without sets."""
    if sets == 0:
        return 0.0, 1.0
    z = float(stats.norm.ppf(0.5 + level / 2.0))
    share = hits / sets
    middle = share + z * z / (2 * sets)
    half = z * math.sqrt(share * (1 - share) / sets + z * z / (4 * sets * sets))
    return max(0.0, (middle - half) / (1 + z * z / sets)), min(1.0, (middle + half) / (1 + z * z / sets))


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.6g}")
    return {key: _rounded(one) for key, one in value.items()} if isinstance(value, dict) else value


def _row(cells: dict[str, Any]) -> SetRow:
    floats = {field.name for field in fields(SetRow) if field.type is float}
    # A number missing from an older file was not recorded.
    values: dict[str, Any] = dict.fromkeys(floats, math.nan)
    values |= {key: math.nan if value is None and key in floats else value for key, value in cells.items()}
    return SetRow(**values)


def _probabilities(row: SetRow, temperature: float) -> dict[str, float]:
    """Posterior probabilities of "base", "outside" and every single effect."""
    singles = [name for name in row.evidence if name not in ("base", "outside") and "+" not in name]
    priors = priors_of(singles)
    logs = np.array([math.log(prior) + temperature * row.evidence[name] for name, prior in priors.items()])
    return dict(zip(priors, np.exp(logs - logsumexp(logs)).tolist(), strict=True))


def _truth(row: SetRow) -> str:
    return {"null": "base", "outside": "outside"}.get(row.kind, row.label)


def _top(row: SetRow) -> tuple[float, bool]:
    """Probability of the most probable answer, and whether it is true."""
    answers = {"base": row.nothing, "outside": row.outside, row.best: row.best_p}
    best = max(answers, key=lambda name: answers[name])
    return answers[best], row.best_is_true if best == row.best else best == _truth(row)


def _covered(rows: Sequence[SetRow], risk: float) -> int:
    """Number of right names at the lowest threshold at which at most a share ``risk`` of ``rows`` get a wrong name."""
    most, right, wrong, covered = risk * len(rows), 0, 0, 0
    for row in sorted(rows, key=lambda row: -row.best_p):
        right, wrong = (right + 1, wrong) if row.best_is_true else (right, wrong + 1)
        if wrong > most:
            break
        covered = right
    return covered


def _target(name: str, rate: Rate, aim: float, at_most: bool) -> CampaignTarget:
    met = (rate.share <= aim if at_most else rate.share >= aim) if rate.sets else None
    return CampaignTarget(name, f"{'≤' if at_most else '≥'} {100 * aim:.3g} %", str(rate), met)


def _rate(rows: Sequence[SetRow], hit: Callable[[SetRow], bool]) -> Rate:
    return Rate(sum(map(hit, rows)), len(rows))


def _right(row: SetRow) -> bool:
    return row.answer == "right"


def _wrong(row: SetRow) -> bool:
    return row.answer == "wrong"


def _unexplained(row: SetRow) -> bool:
    return row.answer == "unexplained"
