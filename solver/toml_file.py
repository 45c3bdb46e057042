"""TOML files as typed tables: a file's keys are declared once, and whatever has another form is one clear line.

A table is a class of :class:`TomlTable` or a dataclass with ``__pydantic_config__ = TABLE``. :func:`checked` makes one
of a parsed table; the JSON Schema for editors (``explorer schema``) comes from the same declaration.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails
from pydantic_core.core_schema import CoreSchema, no_info_plain_validator_function

from solver.params import UNITS, ParameterError, declared, parse_quantity

T = TypeVar("T")
TABLE = ConfigDict(extra="forbid", use_attribute_docstrings=True)

UNKNOWN_KEY = {"extra_forbidden", "unexpected_keyword_argument"}
"""Pydantic's names of that mistake, in a model and in a dataclass."""


class TomlTable(BaseModel):
    """A table of a file: other keys than its fields are refused, and no value is converted silently."""

    model_config = ConfigDict(**TABLE, frozen=True)


def read_toml(path: Path) -> dict[str, Any]:
    """Parsed TOML file; a missing or malformed file is a :class:`ParameterError` with file and line."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise ParameterError(f"{path}: no such file") from None
    except (IsADirectoryError, PermissionError) as error:
        raise ParameterError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ParameterError(f"{path}: not a text file in UTF-8") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:  # nested deeper than the parser goes
        raise ParameterError(f"{path}: {error}") from None


@contextmanager
def naming_file(
    path: Path, *caught: type[Exception], raised: type[Exception] = ParameterError, within: Path | None = None
) -> Iterator[None]:
    """Raise what is ``caught`` of the contents of ``path`` as ``raised``, with the file's name in front.

    A message that begins with a name already, of the file or of one ``within`` a folder, stays as it is.
    """
    try:
        yield
    except caught as error:
        text = str(error)
        raise raised(text if text.startswith(str(within or path)) else f"{path}: {text}") from None


def checked(kind: type[T], table: object, where: str = "") -> T:
    """``table`` as a ``kind``.

    Parameters
    ----------
    kind
        A :class:`TomlTable` or a dataclass.
    table
        A parsed table.
    where
        Its name in the file, such as ``profile.quick``; empty for the file itself.

    Raises
    ------
    ParameterError
        The first mistake as one line: key, value, what is allowed.
    """
    adapter: TypeAdapter[T] = _adapter(kind)  # type: ignore[arg-type]
    try:
        return adapter.validate_python(table)
    except ValidationError as error:
        found = error.errors()
        # A misspelt key is also a missing one; the spelling is what helps.
        first = next((one for one in found if one["type"] in UNKNOWN_KEY), found[0])
        raise ParameterError(_line(first, kind, table, where)) from None


def json_schema(kind: type) -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a file or a table."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **_adapter(kind).json_schema()}


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _line(error: ErrorDetails, kind: type, table: object, where: str) -> str:
    """One mistake as a line. Entries of a list go by the list's key, and by their name where one is missing a key."""
    place, inside, keys = [where] if where else [], table, list(error["loc"])
    for key in keys[:-1]:
        inside = inside[key] if isinstance(inside, Mapping | list) else None  # type: ignore[index]
    at = ".".join([*place, *(str(key) for key in keys if isinstance(key, str))]) or "file"
    value, says = error["input"], error["type"]
    if says.startswith("missing"):
        name = inside.get("name") if isinstance(inside, Mapping) else None
        about = _about(kind, keys)
        return f"{at}: missing" + (f" in {name}" if name else "") + (f"; needed: {about}" if about else "")
    if says in UNKNOWN_KEY:
        return f"{at}: unknown key; allowed: {', '.join(_keys_at(kind, keys[:-1]))}"
    if says == "value_error":
        return f"{at}: {error['ctx']['error']}"
    if says == "literal_error":
        return f"{at}: {value!r}; allowed: {str(error['ctx']['expected']).replace(' or ', ', ').replace(chr(39), '')}"
    allowed = {
        "list_type": f"a list of tables [[{at}]]",
        "string_type": "a text",
        "string_too_long": f"a text of up to {error.get('ctx', {}).get('max_length')} characters",
        "bool_type": "true or false",
        "bool_parsing": "true or false",
    }
    return f"{at}: {value!r}; allowed: {allowed.get(says, 'a table')}"


def _about(kind: type, keys: list[int | str]) -> str | None:
    fields = getattr(kind, "model_fields", {})
    about = fields[keys[0]].description if len(keys) == 1 and keys[0] in fields else None
    return about and (about[0].lower() + about[1:]).rstrip(".")


def _keys_at(kind: type, keys: list[int | str]) -> Collection[str]:
    """Keys of the table at a place, read off the schema."""
    schema = _adapter(kind).json_schema()
    here = schema
    for key in keys:
        here = _target(here, schema)
        entry = "items" if isinstance(key, int) else "additionalProperties"
        here = here.get("properties", {}).get(key) or here[entry]
    return list(_target(here, schema)["properties"])


def _target(here: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    """``here`` with a reference or an optional table followed."""
    here = next((one for one in here.get("anyOf", ()) if "$ref" in one), here)
    return schema["$defs"][here["$ref"].rsplit("/", 1)[-1]] if "$ref" in here else here


class _Form:
    """A form of values, put beside a type by ``Annotated``."""

    def _check(self, value: Any) -> Any:
        """``value`` as it is kept; ValueError says what is wrong with it."""
        raise NotImplementedError

    def _schema(self) -> dict[str, Any]:
        """JSON Schema of what is written in the file."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return no_info_plain_validator_function(self._check)

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        return self._schema()


@dataclass(frozen=True)
class Number(_Form):
    """A finite number of at least ``least`` and above ``above``; text is none."""

    least: float = -math.inf
    above: float = -math.inf

    def _check(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ValueError(f"{value!r} is not a number")
        return _bounded(float(value), self.least, self.above)

    def _schema(self) -> dict[str, Any]:
        return {"type": "number", **_bounds_schema(self.least, self.above)}


@dataclass(frozen=True)
class Quantity(_Form):
    """A number in SI, or a text with a unit: ``0.03`` or ``"30g"``."""

    unit: str
    least: float = -math.inf
    above: float = -math.inf

    def _check(self, value: Any) -> float:
        try:
            number = parse_quantity(value, self.unit, "")
        except ParameterError as error:
            raise ValueError(str(error).removeprefix(": ")) from None
        return _bounded(number, self.least, self.above, "" if self.unit == "1" else f" {self.unit}")

    def _schema(self) -> dict[str, Any]:
        units = ", ".join(name for name in UNITS.get(self.unit, {self.unit: 1.0}) if name)
        form = {"type": ["number", "string"], **_bounds_schema(self.least, self.above)}
        return form | ({"description": f"SI, or with a unit: {units}"} if units else {})


@dataclass(frozen=True)
class Whole(_Form):
    """A whole number of at least ``least``."""

    least: int

    def _check(self, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or value < self.least:
            raise ValueError(f"{value!r} is not a whole number of at least {self.least}")
        return value

    def _schema(self) -> dict[str, Any]:
        return {"type": "integer", "minimum": self.least}


@dataclass(frozen=True)
class Scalar(_Form):
    """A number, a text with a unit or a name, for the parameter that it belongs to to check."""

    def _check(self, value: Any) -> int | float | str:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError(f"{value!r}; allowed: a number or a string")
        return value

    def _schema(self) -> dict[str, Any]:
        return {"type": ["number", "string"]}


@dataclass(frozen=True)
class Names(_Form):
    """A list of texts, none twice."""

    def _check(self, value: Any) -> tuple[str, ...]:
        if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
            raise ValueError(f"{value!r}; allowed: a list of names")
        for name in value:
            if value.count(name) > 1:
                raise ValueError(f"{name!r} appears twice")
        return tuple(value)

    def _schema(self) -> dict[str, Any]:
        return {"type": "array", "items": {"type": "string"}, "uniqueItems": True}


@dataclass(frozen=True)
class Vector(_Form):
    """Numbers in SI, each of which may have a unit; ``size`` of them, or any number."""

    size: int | None = None
    unit: str = "1"
    above: float = -math.inf

    def _check(self, value: Any) -> tuple[float, ...]:
        if not isinstance(value, list | tuple) or (self.size is not None and len(value) != self.size):
            raise ValueError(f"{value!r}; allowed: a list of {'' if self.size is None else f'{self.size} '}numbers")
        return tuple(Quantity(self.unit, above=self.above)._check(part) for part in value)

    def _schema(self) -> dict[str, Any]:
        length = {"minItems": self.size, "maxItems": self.size} if self.size is not None else {}
        return {"type": "array", "items": Quantity(self.unit)._schema(), **length}


@dataclass(frozen=True)
class Rows(_Form):
    """A list of vectors of ``columns`` numbers each."""

    columns: int
    unit: str = "1"

    def _check(self, value: Any) -> tuple[tuple[float, ...], ...]:
        if not isinstance(value, list | tuple):
            raise ValueError(f"{value!r}; allowed: a list of lists of {self.columns} numbers")
        return tuple(Vector(self.columns, self.unit)._check(row) for row in value)

    def _schema(self) -> dict[str, Any]:
        return {"type": "array", "items": Vector(self.columns, self.unit)._schema()}


@dataclass(frozen=True)
class Shaped:
    """What editors are told of a table whose keys depend on more than its file, such as the parameters of a rig."""

    schema: Callable[[], dict[str, Any]]

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        return self.schema()


def parameters_schema(*kinds: Any) -> dict[str, Any]:
    """JSON Schema of a table whose keys are the parameters that dataclasses declare (:func:`solver.params.param`)."""
    found: dict[str, Any] = {}
    for kind in kinds:
        for path, one in declared(kind, "").items():
            unit = "" if one.unit == "1" or not one.is_number else f" [{one.unit}]"
            form = {"enum": list(one.choices)} if one.choices else {"type": ["number", "string"]}
            found[path.removeprefix(".")] = {**form, "description": one.doc + unit}
    return {"type": "object", "properties": found, "additionalProperties": False}


@dataclass(frozen=True)
class Like:
    """What editors are told of a table that is checked as a ``kind`` later, when tables of other files lie over it."""

    kind: type[BaseModel]

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        schema: dict[str, Any] = handler(self.kind.__pydantic_core_schema__)
        return schema


def one_of(value: str, where: str, allowed: Collection[str]) -> str:
    """``value`` if it is one of the names that are ``allowed`` here."""
    if value not in allowed:
        raise ParameterError(f"{where}: {value!r} is not one of {', '.join(allowed)}")
    return value


def _bounded(number: float, least: float, above: float, unit: str = "") -> float:
    if number < least:
        raise ValueError(f"{number:g}{unit} is below {least:g}{unit}")
    if not number > above:
        raise ValueError(f"{number:g}{unit}; allowed: more than {above:g}{unit}")
    return number


def _bounds_schema(least: float, above: float) -> dict[str, float]:
    low = {"minimum": least} if least > -math.inf else {}
    return low | ({"exclusiveMinimum": above} if above > -math.inf else {})
