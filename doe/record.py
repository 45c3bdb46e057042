"""Results as plain data: every result of `doe` is a frozen dataclass that can write itself as JSON types."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """Return `value` as JSON types: dict, list, str, bool, int, float or None.

    Arrays and tuples become lists. NaN and infinities become None, because JSON has no name for them.

    Raises TypeError for a type that has no plain form.
    """
    if isinstance(value, Record):
        return value.to_dict()
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    raise TypeError(f"{type(value).__name__} has no plain JSON form")


class Record:
    """Base of the result dataclasses."""

    def to_dict(self) -> dict[str, Any]:
        """Return every field by its name as JSON types (see `plain`)."""
        return {field.name: plain(getattr(self, field.name)) for field in fields(self)}  # type: ignore[arg-type]
