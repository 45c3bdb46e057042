"""``sets.jsonl``, one line per data set and kind of data: what each answer is worth, and the rates of a campaign.

A line is appended as its set is judged. Its answer is one of

right        the effect's name, or both of a pair
undecided    ambiguous with the truth in it
wrong        another name, or ambiguous without the truth; one of a pair alone
unexplained  more than noise, and no name
nothing      no missing effect

Rows become rates with their denominators and Wilson intervals, and targets that are met or not. Wilson 1927, J. Am.
Stat. Assoc. 22:209: (p + z²/2n ± z √(p (1 − p)/n + z²/4n²))/(1 + z²/n), z = 1.96.
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
"""Start of the verdict on a truth that cannot be, followed by the reason."""
NONE = "none"
"""Label of a set in which nothing is missing."""
LEVEL = 0.95
HOLDOUT_GOOD = 1.25
"""Holdout error ÷ noise floor that a set with a right name should not exceed."""
RISKS = (0.0, 0.01, 0.025)
"""Shares of sets with a library effect that get a wrong name at most, of the risk–coverage curve; 0.025 is 4 of 160."""
BINS = (0.0, 0.5, 0.7, 0.9, 0.99, 1.0)
"""Ends of the probabilities of the reliability diagram."""
LEAST_P = 1e-6
"""Of the truth, as the logarithmic loss counts it."""
TEMPERATURES = (0.4, 0.55, 0.7, 0.85, 1.0, 1.3)
"""By which the evidence of kept rows is weighed again."""


@dataclass(frozen=True, kw_only=True)
class SetRow(Record):
    """One data set, judged by data of one kind.

    Attributes
    ----------
    laboratory
        Title of its file.
    root, number
        They give the truth and the pours.
    kind, label
        Of the truth; ``label``: library effect, "a+b", outside effect, or "none".
    strength
        That was asked for [σ]; NaN where none was.
    amplitude
        Of the truth's library effects, natural units.
    offer
        "scalars" or "scan".
    verdict
        The answer, after the follow-up where one was asked for.
    first, follow_up
        The answer before, and the change of the set-up that was asked for; "" without one.
    asked, chance
        Pours that were asked for there, 0 without one, and the chance of an answer that they were said to have.
    nothing, outside, best, best_p, truth_p
        Probabilities; ``best``: the most probable effect, ``truth_p``: of the truth, NaN where it is no library effect.
    evidence
        Logarithms of the evidence of "base", "outside" and every effect, so that the rule can be tuned on what is kept.
    fits
        Probability of data as far off, under the best fit of "base" and of ``best``.
    held_out_p
        Of the final model on held-out data, NaN where it was not asked.
    before, after
        Error ÷ noise floor on the held-out condition, of the calibrated base model and the named one; NaN unless the
        name is right.
    bias_before, bias_after
        Root mean square of the parameters' errors, without and with the named effect [standard deviations of their
        measurements]; NaN unless the name is right.
    pours, seconds
        Pours that were run for it, and wall time.
    physics
        Version of the solver's physics that poured; 0 in rows from before it was kept.
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
        """What the verdict is worth."""
        return answer_to(self.verdict, self.label)

    @property
    def first_answer(self) -> Answer:
        """What the answer before the follow-up was worth."""
        return answer_to(self.first or self.verdict, self.label)

    @property
    def named(self) -> bool:
        """Whether the verdict accuses an effect: names one, or leaves only effects."""
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
        """Library effects that act."""
        return frozenset(self.label.split("+")) if self.kind in ("effect", "pair") else frozenset()

    @property
    def best_is_true(self) -> bool:
        """Whether the most probable effect is the truth; the two of a pair in any order."""
        return frozenset(self.best.split("+")) == self.truth

    @property
    def true_p(self) -> float:
        """Probability that was given to what is true; 0 where it was not weighed."""
        of_effect = self.best_p if self.best_is_true else self.truth_p
        p = {"null": self.nothing, "outside": self.outside}.get(self.kind, of_effect)
        return p if math.isfinite(p) else 0.0


@dataclass(frozen=True)
class Rate:
    """``hits`` of ``sets``."""

    hits: int
    sets: int

    @property
    def share(self) -> float:
        """NaN without sets."""
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
    """What is aimed at, what came out, and whether that is met (None without a set to tell)."""

    name: str
    aim: str
    found: str
    met: bool | None


@dataclass(frozen=True)
class Bin:
    """Sets whose most probable answer has a probability in [low, high): mean of it, and how often it is the truth."""

    low: float
    high: float
    mean: float
    right: Rate


@dataclass(frozen=True)
class Scores:
    """How good the probabilities are, of sets judged by one kind of data.

    Attributes
    ----------
    log_loss
        Mean of −ln of the probability of what is true.
    coverage
        Sets with library effects whose most probable effect is right and would be named, at each of ``RISKS``.
    reliability
        Sets by the probability of their most probable answer.
    f1
        2 TP/(2 TP + FP + FN) of effects that are named and that act, over all sets.
    bias_before, bias_after
        Medians of the parameters' errors [standard deviations of their measurements] without and with the effect, of
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
    """What another temperature would have made of the last evidence of sets with one effect at most.

    ``log_loss``: as in ``Scores``. ``right``, ``wrong``: names of sets with an effect; ``false``: of sets without
    one.
    """

    temperature: float
    log_loss: float
    right: Rate
    wrong: Rate
    false: Rate


def answer_to(verdict: str, label: str) -> Answer:
    """What ``verdict`` is worth where ``label`` is true, see above."""
    if verdict.startswith(OUT_OF_REACH):
        return "out of reach"
    kind, _, rest = verdict.partition(":")
    if kind == "no_missing_effect":
        return "nothing"
    if kind == "unexplained":
        return "unexplained"
    names = {frozenset(name.split("+")) for name in rest.split(",")}
    truth = frozenset(label.split("+"))
    if kind in ("effect", "effects"):
        return "right" if names == {truth} else "wrong"
    left = {NONE: "no_missing_effect"}.get(label)
    return "undecided" if truth in names or left in rest.split(",") else "wrong"


def read_rows(path: Path) -> list[SetRow]:
    """Rows in ``path``, in order of numbers and kinds of data; none where there is no such file.

    A line that was cut off with the process that wrote it is passed over, and of a set that was judged twice the last
    row counts. Raises StatisticsError for any other line that is no row.
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
    """Add ``rows`` to the file, in one write, so that processes that share it do not mix lines."""
    text = "".join(json.dumps(_rounded(row.to_dict()), ensure_ascii=False) + "\n" for row in rows)
    last = path.read_bytes()[-1:] if path.is_file() else b""
    if last not in (b"", b"\n"):  # behind a line that was cut off
        text = "\n" + text
    with path.open("a", encoding="utf-8") as file:
        file.write(text)


def scores(rows: Sequence[SetRow]) -> Scores:
    """Scores of judged sets of one kind of data."""
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
    """Judged sets of one kind of data at each of ``TEMPERATURES``, pairs of effects left out of truths and answers."""
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
    """The targets for data of the kind ``offer``, from judged sets; shares are those of the counts asked of a test."""
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
    """Wilson's interval of a share; 0 … 1 without sets."""
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
    # A number that an older file does not have was not taken.
    values: dict[str, Any] = dict.fromkeys(floats, math.nan)
    values |= {key: math.nan if value is None and key in floats else value for key, value in cells.items()}
    return SetRow(**values)


def _probabilities(row: SetRow, temperature: float) -> dict[str, float]:
    """Of "base", "outside" and every single effect."""
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
    """Right names at the lowest threshold at which at most a share ``risk`` of ``rows`` get a wrong one."""
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
