"""Conversion of results to plain data and back: every result of `doe` is a frozen dataclass that JSON types can hold.

``to_dict`` needs only the fields. ``from_dict`` follows their annotations: nested dataclasses, tuples, lists, mappings,
arrays, literals, unions. NaN and infinities become None, because JSON cannot express them; None is read as NaN where
the annotation is a float.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import PurePath
from types import NoneType, UnionType
from typing import Any, ClassVar, Literal, Self, Union, get_args, get_origin, get_type_hints

import numpy as np


class RecordError(ValueError):
    """Plain data that do not fit the record; the message names the place and what was expected there."""


class VersionError(RecordError):
    """Plain data of another version of the program."""


def plain(value: Any) -> Any:
    """Return `value` as JSON types: dict, list, str, bool, int, float or None.

    Dataclasses become dictionaries, arrays and tuples become lists, paths and enums text. NaN and infinities become
    None.

    Raises TypeError for a type that has no plain form.
    """
    if isinstance(value, Record):
        return value.to_dict()
    if is_dataclass(value) and not isinstance(value, type):
        return _fields(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, PurePath | Enum):
        return str(value)
    if value is None or isinstance(value, bool | int | str):
        return value
    raise TypeError(f"{type(value).__name__} has no plain JSON form")


class Record:
    """Base of the result dataclasses."""

    def to_dict(self) -> dict[str, Any]:
        """Return all fields by name as JSON types (see `plain`)."""
        return _fields(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Return the record from which ``to_dict`` made ``data``; fields without a value take their defaults.

        Unknown keys are ignored.

        Raises RecordError for a field that is missing or of another type.
        """
        return _record(cls, data, "")


class Document(Record):
    """A record that is a file: its dictionary begins with the number ``SCHEMA``; messages call it ``NAME``."""

    SCHEMA: ClassVar[int]
    NAME: ClassVar[str]

    def to_dict(self) -> dict[str, Any]:
        """Return the number of the schema and every field."""
        return {"schema": self.SCHEMA, **super().to_dict()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Return the document; raises VersionError for another schema, RecordError for data that do not fit it."""
        schema = data.get("schema") if isinstance(data, Mapping) else None
        if schema != cls.SCHEMA:
            older = isinstance(schema, int) and schema < cls.SCHEMA
            raise VersionError(
                f"{cls.NAME}: made by {'an older' if older else 'another'} version of the program (schema {schema}; "
                f"allowed: {cls.SCHEMA}); make it again"
            )
        try:
            return super().from_dict(data)
        except RecordError as error:
            raise RecordError(f"{cls.NAME}: {error}") from None


def _fields(value: Any) -> dict[str, Any]:
    return {field.name: plain(getattr(value, field.name)) for field in fields(value)}


@cache
def _annotations(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _record(kind: Any, value: Any, where: str) -> Any:
    if not isinstance(value, Mapping):
        raise _unexpected(where, f"the fields of {kind.__name__}", value)
    known, found = _annotations(kind), {}
    for field in fields(kind):
        place = f"{where}.{field.name}" if where else field.name
        if field.name in value:
            found[field.name] = _value(known[field.name], value[field.name], place)
        elif field.default is MISSING and field.default_factory is MISSING:
            raise RecordError(f"{place}: is missing")
    return kind(**found)


def _value(kind: Any, value: Any, where: str) -> Any:
    """``value`` converted to the type that the annotation ``kind`` states."""
    origin, arguments = get_origin(kind), get_args(kind)
    if kind is Any:
        return value
    if origin in (Union, UnionType):
        return _one_of(arguments, value, where)
    if origin is Literal:
        if value not in arguments:
            raise _unexpected(where, f"one of {', '.join(map(repr, arguments))}", value)
        return value
    if origin is np.ndarray or kind is np.ndarray:
        return _array(arguments, value, where)
    if origin is tuple:
        return _tuple(arguments, value, where)
    if origin is not None and issubclass(origin, Mapping):
        return _mapping(arguments, value, where)
    if origin is not None:
        return [_value(arguments[0], item, f"{where}[{k}]") for k, item in enumerate(_listed(value, where))]
    if is_dataclass(kind):
        return _record(kind, value, where)
    return _scalar(kind, value, where)


def _one_of(kinds: tuple[Any, ...], value: Any, where: str) -> Any:
    if value is None and NoneType in kinds:
        return None
    problem: RecordError | None = None
    for kind in kinds:
        try:
            return _value(kind, value, where)
        except RecordError as error:
            problem = problem or error
    assert problem is not None
    raise problem


def _scalar(kind: Any, value: Any, where: str) -> Any:
    if kind is float and (value is None or (isinstance(value, int | float) and not isinstance(value, bool))):
        try:
            return math.nan if value is None else float(value)
        except OverflowError:  # an integer beyond every float
            raise _unexpected(where, "float", value) from None
    if kind in (bool, str) and isinstance(value, kind):
        return value
    if kind is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if kind is NoneType and value is None:
        return None
    if isinstance(kind, type) and issubclass(kind, PurePath | Enum) and isinstance(value, str):
        try:
            return kind(value)
        except ValueError:
            pass
    raise _unexpected(where, getattr(kind, "__name__", str(kind)), value)


def _array(arguments: tuple[Any, ...], value: Any, where: str) -> Any:
    number: Any = get_args(arguments[1])[0] if arguments else np.float64
    try:
        if issubclass(number, np.floating):
            return np.array(value, dtype=np.float64)  # None becomes NaN
        return np.array(value, dtype=number)
    except (TypeError, ValueError, OverflowError):
        raise _unexpected(where, "an array of numbers", value) from None


def _tuple(arguments: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    items = _listed(value, where)
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        arguments = (arguments[0],) * len(items)
    if len(arguments) != len(items):
        raise _unexpected(where, f"{len(arguments)} values", value)
    return tuple(
        _value(kind, item, f"{where}[{k}]") for k, (kind, item) in enumerate(zip(arguments, items, strict=True))
    )


def _mapping(arguments: tuple[Any, ...], value: Any, where: str) -> dict[Any, Any]:
    if not isinstance(value, Mapping):
        raise _unexpected(where, "names with values", value)
    kind = arguments[1] if arguments else Any
    return {key: _value(kind, item, f"{where}.{key}") for key, item in value.items()}


def _listed(value: Any, where: str) -> list[Any]:
    if not isinstance(value, list):
        raise _unexpected(where, "a list", value)
    return value


def _unexpected(where: str, expected: str, value: Any) -> RecordError:
    text = repr(value)
    return RecordError(f"{where or 'content'}: {text if len(text) < 60 else f'{text[:57]}…'} is not {expected}")
