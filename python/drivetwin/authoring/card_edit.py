# SPDX-License-Identifier: MIT
"""Numbers of an existing card as texts, changed in place: all else of the file stays as it is."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

from drivetwin._util.toml import parse_toml
from drivetwin.authoring.stated_number import parse_range, parse_stated
from drivetwin.errors import InputError, Where

Path = tuple[str | int, ...]
"""Place of an entry in the document, such as `("gears", 0, "ratio")`."""
_SECTIONS = ("i_in", "final_drive", "gears", "elements", "inertia")
_HEAD = re.compile(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(?:#.*)?")
_ENTRY = re.compile(r"(\s*(?P<key>[\w-]+)\s*=\s*)(?P<value>[^#]*?)(\s*(?:#.*)?)")


def list_numbers(text: str) -> dict[Path, str]:
    """Return the numbers of a card as a user types them: VALUE, VALUE+-STD or LOW..HIGH."""
    document = parse_toml(text)
    kept = {name: document[name] for name in _SECTIONS if name in document}
    return dict(_iterate_numbers(kept, ()))


def replace_numbers(text: str, typed: Mapping[Path, str]) -> str:
    """Return the text of a card with other numbers; comments and all other entries stay.

    Raises InputError for a text that is no number, and for an entry that is not on a line of its
    own.
    """
    known, lines = list_numbers(text), text.split("\n")
    places = {path: number for number, path in _locate_lines(lines)}
    wanted = deepcopy(parse_toml(text))
    for path, number in typed.items():
        if path not in known or number.strip() == known[path]:
            continue
        where = Where(key=format_path(path))
        entry = _parse_number(number, where)
        value = parse_toml(f"x = {entry}")["x"]
        entries = {path: entry}
        if path not in places and isinstance(value, dict):  # the number is a table of its own
            entries = {(*path, part): f"{one!r}" for part, one in value.items()}
        for place, one in entries.items():
            found = _ENTRY.fullmatch(lines[places[place]]) if place in places else None
            if found is None:
                raise InputError("the entry is not on a line of its own", "edit the file", where)
            lines[places[place]] = f"{found[1]}{one}{found[4]}"
        _get_parent(wanted, path)[path[-1]] = value
    changed = "\n".join(lines)
    if parse_toml(changed) != wanted:
        raise InputError("the form of the card cannot be changed here", "edit the file")
    return changed


def format_path(path: Path) -> str:
    """Return the place of an entry as a label; gears are counted from 1."""
    return ".".join(str(part + 1) if isinstance(part, int) else part for part in path)


def _iterate_numbers(value: Any, path: Path) -> Iterator[tuple[Path, str]]:
    """Yield the numbers below a value of the document."""
    match value:
        case bool() | str():
            return
        case int() | float():
            yield path, f"{value!r}"
        case {"value": int() | float() as middle, "std": int() | float() as std, **rest} if (
            not rest
        ):
            yield path, f"{middle!r}+-{std!r}"
        case [int() | float() as low, int() | float() as high]:
            yield path, f"{low!r}..{high!r}"
        case dict():
            for key, one in value.items():
                yield from _iterate_numbers(one, (*path, key))
        case list():
            for number, one in enumerate(value):
                yield from _iterate_numbers(one, (*path, number))


def _parse_number(text: str, where: Where) -> str:
    """Return the TOML of a typed number."""
    try:
        if ".." in text:
            low, high = parse_range(text)
            return f"[{low!r}, {high!r}]"
        return parse_stated(text, -1e12).entry
    except ValueError as fault:
        raise InputError(str(fault), "type VALUE, VALUE+-STD or LOW..HIGH", where) from None


def _locate_lines(lines: list[str]) -> Iterator[tuple[int, Path]]:
    """Yield the number of each line with an entry, and the place of the entry."""
    table: Path = ()
    counts: dict[str, int] = {}
    for number, line in enumerate(lines):
        if head := _HEAD.fullmatch(line):
            name = head[2]
            table = tuple(part.strip().strip("\"'") for part in name.split("."))
            if head[1] == "[[":
                counts[name] = counts.get(name, -1) + 1
                table = (*table, counts[name])
        elif entry := _ENTRY.fullmatch(line):
            yield number, (*table, entry["key"])


def _get_parent(document: Any, path: Path) -> Any:
    for part in path[:-1]:
        document = document[part]
    return document
