"""``sets.jsonl``: one line per data set and kind of data, appended as it is judged, and what an answer is worth.

right        the effect's name, or both of a pair
undecided    ambiguous with the truth in it
wrong        another name, or ambiguous without the truth; one of a pair alone
unexplained  more than noise, and no name
nothing      no missing effect
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

from doe.record import Record

Answer = Literal["right", "undecided", "wrong", "unexplained", "nothing", "out of reach"]

OUT_OF_REACH = "out of reach: "
"""Start of the verdict on a truth that cannot be, followed by the reason."""
NONE = "none"
"""Label of a set in which nothing is missing."""


@dataclass(frozen=True)
class Row(Record):
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
    first: str
    follow_up: str
    nothing: float
    outside: float
    best: str
    best_p: float
    truth_p: float
    evidence: Mapping[str, float]
    fits: Mapping[str, float]
    held_out_p: float
    before: float
    after: float
    bias_before: float
    bias_after: float
    pours: int
    seconds: float

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
    def true_p(self) -> float:
        """Probability that was given to what is true; 0 where it was not weighed."""
        p = {"null": self.nothing, "outside": self.outside}.get(self.kind, self.truth_p)
        return p if math.isfinite(p) else 0.0


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


def read_rows(path: Path) -> list[Row]:
    """Rows in ``path``, in order of numbers and kinds of data; none where there is no such file."""
    if not path.is_file():
        return []
    rows = [_row(json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    return sorted(rows, key=lambda row: (row.laboratory, row.root, row.number, row.offer))


def append_rows(path: Path, rows: Sequence[Row]) -> None:
    """Add ``rows`` to the file, in one write, so that processes that share it do not mix lines."""
    text = "".join(json.dumps(_rounded(row.to_dict()), ensure_ascii=False) + "\n" for row in rows)
    with path.open("a", encoding="utf-8") as file:
        file.write(text)


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.6g}")
    return {key: _rounded(one) for key, one in value.items()} if isinstance(value, dict) else value


def _row(cells: dict[str, Any]) -> Row:
    floats = {field.name for field in fields(Row) if field.type is float}
    # A number that an older file does not have was not taken.
    values: dict[str, Any] = dict.fromkeys(floats, math.nan)
    values |= {key: math.nan if value is None and key in floats else value for key, value in cells.items()}
    return Row(**values)
