"""Every result must survive a round trip through JSON."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import numpy.typing as npt
import pytest

from doe.record import Document, Record, RecordError, VersionError, plain


@dataclass(frozen=True)
class Inner(Record):
    value: float


@dataclass(frozen=True)
class Outer(Record):
    inner: tuple[Inner, ...]
    matrix: np.ndarray
    flags: np.ndarray
    table: dict[int, np.int64]


def test_nested_records_become_plain_json():
    outer = Outer((Inner(math.nan), Inner(2.0)), np.array([[1.0, np.inf]]), np.array([True]), {1: np.int64(3)})
    expected = {
        "inner": [{"value": None}, {"value": 2.0}],
        "matrix": [[1.0, None]],
        "flags": [True],
        "table": {"1": 3},
    }
    assert json.loads(json.dumps(outer.to_dict(), allow_nan=False)) == expected


def test_a_type_without_plain_form_is_refused():
    with pytest.raises(TypeError, match="object has no plain"):
        plain(object())


@dataclass(frozen=True)
class Kinds(Record):
    """One field of every kind that `from_dict` rebuilds."""

    inner: Inner
    rows: tuple[tuple[str, float], ...]
    pair: tuple[int, str]
    array: npt.NDArray[np.float64]
    counts: npt.NDArray[np.int64]
    flags: npt.NDArray[np.bool_]
    table: dict[str, Inner | None]
    level: float | str
    maybe: int | None
    word: Literal["low", "high"]
    path: Path
    later: str = "default"


KINDS = Kinds(
    inner=Inner(math.nan),
    rows=(("a", 1.0), ("b", math.nan)),
    pair=(3, "x"),
    array=np.array([[1.0, math.nan]]),
    counts=np.array([1, 2]),
    flags=np.array([True, False]),
    table={"one": Inner(1.0), "none": None},
    level="coarse",
    maybe=None,
    word="low",
    path=Path("a/b"),
)


def test_a_record_survives_json():
    kept = json.loads(json.dumps(KINDS.to_dict(), allow_nan=False))
    found = Kinds.from_dict(kept)
    assert found.to_dict() == kept
    assert math.isnan(found.inner.value)
    assert found.rows[0] == ("a", 1.0)
    assert math.isnan(found.rows[1][1])
    np.testing.assert_array_equal(found.array, KINDS.array)
    assert found.counts.dtype == np.int64
    assert found.flags.dtype == bool
    assert found.table == {"one": Inner(1.0), "none": None}
    assert (found.level, found.maybe, found.word, found.path) == ("coarse", None, "low", Path("a/b"))


def test_a_field_that_has_a_default_may_be_missing_and_a_key_that_is_no_field_is_passed_over():
    kept = KINDS.to_dict()
    del kept["later"]
    assert Kinds.from_dict(kept | {"unknown": 1}).later == "default"


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("inner", {}, "inner.value: is missing"),
        ("inner", 3, "inner: 3 is not the fields of Inner"),
        ("rows", [["a", "b"]], r"rows\[0\]\[1\]: 'b' is not float"),
        ("rows", [["a"]], r"rows\[0\]: \['a'\] is not 2 values"),
        ("rows", [["a", 10**400]], r"rows\[0\]\[1\]: 1000*… is not float"),
        ("array", [10**400], r"array: \[1000*… is not an array of numbers"),
        ("pair", "x", "pair: 'x' is not a list"),
        ("array", ["x"], r"array: \['x'\] is not an array of numbers"),
        ("table", [1], r"table: \[1\] is not names with values"),
        ("maybe", 1.5, "maybe: 1.5 is not int"),
        ("maybe", True, "maybe: True is not int"),
        ("word", "middle", "word: 'middle' is not one of 'low', 'high'"),
    ],
)
def test_what_is_no_such_record_is_one_line_with_its_place(key, value, message):
    with pytest.raises(RecordError, match=f"^{message}$"):
        Kinds.from_dict(KINDS.to_dict() | {key: value})


@dataclass(frozen=True)
class Page(Document):
    SCHEMA: ClassVar[int] = 3
    NAME: ClassVar[str] = "page.json"

    value: float


def test_a_document_carries_its_schema_and_refuses_another():
    assert Page(2.0).to_dict() == {"schema": 3, "value": 2.0}
    assert Page.from_dict({"schema": 3, "value": 2}) == Page(2.0)
    for schema, maker in ((2, "an older"), (4, "another"), (None, "another")):
        with pytest.raises(VersionError, match=rf"^page.json: made by {maker} version .* \(schema {schema};"):
            Page.from_dict({"schema": schema, "value": 2.0})
    for content in ([], {}, {"schema": 3}):
        with pytest.raises(RecordError, match=r"^page.json: "):
            Page.from_dict(content)
