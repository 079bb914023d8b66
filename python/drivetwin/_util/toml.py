# SPDX-License-Identifier: MIT
"""TOML files with a strict schema: every fault is found at once and named by its key path."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, TypeAdapter, ValidationError
from pydantic_core import CoreSchema

from drivetwin._util.atomic import measure_regular_file
from drivetwin.errors import InputError, Where, suggest_spelling

MAX_SIZE = 4_000_000
"""Largest TOML file [bytes]."""
MAX_DEPTH = 50
"""Largest number of nested tables and arrays."""
MAX_TEXT = 100_000
"""Longest text or key [characters]."""
MAX_EXPONENT = 150
"""Power of ten that no number exceeds, nor its inverse: squares neither overflow nor vanish."""

_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-])(?:{_PART}[ \t]*+\.[ \t]*+){{{MAX_DEPTH}}}", re.ASCII)
"""A key of many parts, which takes the parser a time that grows with the square of their number."""


class StrictModel(BaseModel):
    """A table of a file: unknown keys, wrong types, infinities and NaN are faults."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class FromTable:
    """Annotation of a frozen dataclass in SI as a table of a file.

    Its fields, or their aliases, are the keys; their annotations state limits and units.
    """

    @staticmethod
    def __get_pydantic_core_schema__(source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the schema of the dataclass, which in a strict model would take no dictionary."""
        schema = handler(source)
        cast("dict[str, Any]", handler.resolve_ref_schema(schema))["strict"] = False
        return schema


class WrittenNumber(float):
    """A number of a file with its text, whose digits state how well it is known."""

    text: str

    @classmethod
    def parse(cls, text: str) -> WrittenNumber:
        """Return the number that `text` states."""
        number = cls(text)
        number.text = text.replace("_", "")
        return number


@dataclass(frozen=True)
class Fault:
    """One thing wrong in a file: the key path, such as `gears[1].ratio`, and what is wrong."""

    key: str
    text: str

    def __str__(self) -> str:
        return f"{self.key}: {self.text}" if self.key else self.text


def read_toml(path: Path | str, error: type[InputError]) -> dict[str, Any]:
    """Return the document in `path`; raises `error` where it cannot be read or is no TOML."""
    file, where = Path(path), Where(file=str(path))
    measure_regular_file(file, error, largest=MAX_SIZE)
    try:
        return parse_toml(file.read_text(encoding="utf-8-sig"))
    except OSError as fault:
        raise error(f"cannot read the file: {fault.strerror}", "check the path", where) from None
    except UnicodeDecodeError:
        raise error("the file is no UTF-8 text", "hand in a TOML text file", where) from None
    except ValueError as fault:
        remedy = "correct the syntax there; a number has a decimal point, no comma"
        raise error(f"no valid TOML: {fault}", remedy, where) from None


def parse_toml(text: str) -> dict[str, Any]:
    """Return the document in a text; its floats are `WrittenNumber`s.

    Raises ValueError where the text is no TOML or exceeds the limits on nesting, numbers and
    texts, which no file of this program reaches.
    """
    if _LONG_KEY.search(text):
        raise ValueError(f"a dotted key has more than {MAX_DEPTH} parts")
    try:
        document = tomllib.loads(text, parse_float=WrittenNumber.parse)
    except RecursionError:
        raise ValueError("tables or arrays are nested too deep") from None
    except tomllib.TOMLDecodeError:
        raise
    except ValueError:  # an integer with more digits than Python converts
        raise ValueError("an integer exceeds 64 bits") from None
    if (excess := next(_iterate_excess(document), None)) is not None:
        raise ValueError(excess)
    return document


def _iterate_excess(document: dict[str, Any]) -> Iterator[str]:
    """Yield a description of each entry beyond the limits."""
    waiting: list[tuple[Any, tuple[int | str, ...]]] = [(document, ())]
    while waiting:
        value, place = waiting.pop()
        key = format_key_path([part if isinstance(part, int) else part[:40] for part in place])
        if isinstance(value, (dict, list)):
            if len(place) >= MAX_DEPTH:
                yield f"{key[:80]}...: nested deeper than {MAX_DEPTH} levels"
                return
            inside = value.items() if isinstance(value, dict) else enumerate(value)
            waiting += [(item, (*place, name)) for name, item in inside]
        elif isinstance(value, int) and not -(2**63) <= value < 2**63:
            yield f"{key}: the integer exceeds 64 bits"
        elif isinstance(value, float) and is_extreme(value):
            yield f"{key}: {value:g} is beyond 1e{MAX_EXPONENT} or within 1e-{MAX_EXPONENT} of zero"
        texts = [one for one in (value, *place[-1:]) if isinstance(one, str)]
        if texts and max(map(len, texts)) > MAX_TEXT:
            yield f"{key}: a text of more than {MAX_TEXT} characters"


def is_extreme(value: float) -> bool:
    """Return whether a number exceeds the limits; zero, NaN and infinity do not."""
    size = abs(value)
    return 0.0 < size < 10.0**-MAX_EXPONENT or 10.0**MAX_EXPONENT < size < math.inf


def validate_schema(
    document: Mapping[str, Any], model: type[BaseModel], context: Mapping[str, Any] | None = None
) -> list[Fault]:
    """Return every fault that the schema `model` finds in `document`, in file order.

    `context` is that of the validators of pydantic.
    """
    try:
        model.model_validate(document, context=context)
    except ValidationError as error:
        schema = model.model_json_schema()
        return [
            Fault(
                format_key_path(item["loc"]),
                _format_fault(item["type"], item["loc"], item["msg"], schema),
            )
            for item in error.errors(include_url=False, include_context=False, include_input=False)
        ]
    return []


def raise_faults(faults: Iterable[Fault], error: type[InputError], file: str, remedy: str) -> None:
    """Raise one `error` that lists all `faults`; return where there is none."""
    found = list(faults)
    if len(found) == 1:
        raise error(found[0].text, remedy, Where(file=file, key=found[0].key or None))
    if found:
        listed = "".join(f"\n  - {fault}" for fault in found)
        raise error(f"{len(found)} faults{listed}", remedy, Where(file=file))


def format_text(text: str) -> str:
    """Write a text as a basic string of TOML; characters without a glyph are escapes."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{"".join(one if one.isprintable() else _escape(one) for one in escaped)}"'


def format_key(key: str) -> str:
    """Write one part of a key, in quotes where TOML needs them."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else format_text(key)


def format_value(value: Any) -> str:
    """Write a text, a number, or a table or list of such as a value of TOML."""
    match value:
        case str():
            return format_text(value)
        case bool():
            return "true" if value else "false"
        case Mapping():
            return f"{{{', '.join(format_entry(*item) for item in value.items())}}}"
        case list() | tuple():
            return f"[{', '.join(map(format_value, value))}]"
        case int():
            return repr(value)
        case WrittenNumber():
            return value.text
    return repr(float(value))


def format_entry(key: str, value: Any) -> str:
    """Write an entry of a table of TOML."""
    return f"{format_key(key)} = {format_value(value)}"


def list_stated(table: Any) -> dict[str, Any]:
    """List the entries that differ from their default of a dataclass without units, by key."""
    adapter = TypeAdapter[Any](type(table))
    entries: dict[str, Any] = adapter.dump_python(table, by_alias=True, exclude_defaults=True)
    return entries


def _escape(char: str) -> str:
    code = ord(char)
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def format_key_path(location: Iterable[int | str]) -> str:
    """Write a location as a key path: `("gears", 1, "ratio")` -> `gears[1].ratio`."""
    path = ""
    for part in location:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else part
    return path


def _format_fault(
    kind: str, location: tuple[int | str, ...], message: str, schema: dict[str, Any]
) -> str:
    if kind in ("extra_forbidden", "unexpected_keyword_argument"):
        known = _collect_keys(schema, schema, location[:-1])
        return f"unknown key{suggest_spelling(str(location[-1]), known)}"
    if kind == "missing":
        return "this key is required and missing"
    return message.removeprefix("Value error, ").replace("Input should", "the value should")


def _collect_keys(
    schema: dict[str, Any], node: dict[str, Any], location: tuple[int | str, ...]
) -> list[str]:
    """Keys that the JSON Schema `node` allows at `location` below it."""
    if "$ref" in node:
        return _collect_keys(schema, schema["$defs"][node["$ref"].rsplit("/", 1)[-1]], location)
    for choice in node.get("anyOf", ()):
        if keys := _collect_keys(schema, choice, location):
            return keys
    if not location:
        return list(node.get("properties", ()))
    step = "items" if isinstance(location[0], int) else "additionalProperties"
    child = node.get("properties", {}).get(location[0], node.get(step))
    return _collect_keys(schema, child, location[1:]) if isinstance(child, dict) else []
