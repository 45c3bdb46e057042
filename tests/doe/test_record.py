"""Every result must survive a round trip through JSON."""

import json
import math
from dataclasses import dataclass

import numpy as np
import pytest

from doe.record import Record, plain


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
