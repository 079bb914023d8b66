# SPDX-License-Identifier: MIT
"""Files of a fleet, one after the other, and the rules by which each is read."""

from __future__ import annotations

import csv
import glob
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from pathlib import Path, PurePath
from typing import Annotated

from pydantic import AfterValidator, Field, field_validator, model_validator

from drivetwin._util.atomic import LARGEST_RECORD, measure_regular_file
from drivetwin._util.text import parse_csv_row, restore_cell
from drivetwin._util.toml import StrictModel, raise_faults, read_toml, validate_schema
from drivetwin.errors import InputError, RulesError, Where
from drivetwin.fleet.store import INDEX
from drivetwin.fleet.task import ROW_COLUMNS
from drivetwin.logs.formats.detect import SUFFIXES

_PATH = "path"


@dataclass(frozen=True)
class Source:
    """A file, and its list entries by column."""

    path: Path
    stated: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Sources:
    """Sources named by the user: `given` are files, folders and globs, `listed` is a list of files.

    The list is a CSV table with a column `path` (from the list's folder) and any others, or one
    path a line. Iterating yields absolute paths in an order that depends on the files alone; it may
    be repeated. A file that is named twice is yielded twice.
    """

    given: Sequence[str]
    listed: Path | None = None

    def __iter__(self) -> Iterator[Source]:
        if self.listed is not None:
            yield from _read_list(self.listed)
        for name in self.given:
            yield from map(Source, _expand_name(name))

    def count(self) -> int:
        """Count the files. Raises InputError if a name matches no file."""
        return sum(1 for _ in self)


def _expand_name(name: str) -> Iterator[Path]:
    path = Path(name)
    if path.is_dir():
        yield from _iterate_files(path.absolute())
    elif path.exists():
        yield path.absolute()
    else:
        found = sorted(glob.glob(name, recursive=True))  # noqa: PTH207 - also absolute patterns
        if not found:
            raise InputError(
                "no such file or folder, and no file fits it as a pattern",
                "check the name; quote a pattern such as 'logs/**/*.mf4'",
                Where(file=name),
            )
        seen: set[Path] = set()  # a link to a folder above leads to the same files again
        for one in map(Path, found):
            if not one.is_dir() and (place := one.parent.resolve() / one.name) not in seen:
                seen.add(place)
                yield one.absolute()


def _iterate_files(folder: Path) -> Iterator[Path]:
    for place, folders, files in os.walk(folder):
        if INDEX in files:  # a store has Parquet files that are no logs
            folders.clear()
            continue
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        for name in sorted(files):
            if not name.startswith(".") and Path(name).suffix.casefold() in SUFFIXES:
                yield Path(place, name)


def _read_list(path: Path) -> Iterator[Source]:
    measure_regular_file(path, InputError, largest=LARGEST_RECORD)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            head = file.readline()
            columns = parse_csv_row(head)
            if _PATH not in columns:
                file.seek(0)
                for line in file:
                    if line.strip():
                        yield Source((path.parent / line.strip()).absolute())
                return
            rows = csv.DictReader(file, columns)
            for cells in rows:
                row = {k: v and restore_cell(v) for k, v in cells.items() if isinstance(k, str)}
                if not row[_PATH]:
                    raise InputError(
                        f"line {rows.line_num + 1} names no path",
                        f"give all {len(columns)} columns of the first line in every line",
                        Where(file=str(path)),
                    )
                stated = {k: v for k, v in row.items() if k and v and k != _PATH}
                yield Source((path.parent / row[_PATH]).absolute(), stated)
    except (OSError, UnicodeDecodeError, csv.Error) as fault:
        raise InputError(
            f"the list cannot be read: {fault}",
            "give a CSV table with a column 'path', or one path a line, in UTF-8",
            Where(file=str(path)),
        ) from None


def name_members(paths: Sequence[str]) -> list[str]:
    """Return a different name for each file: the end of its path, as long as needed."""
    parts = [PurePath(one).parts for one in paths]
    size = 1
    while len({one[-size:] for one in parts}) < len(parts):
        size += 1
    return [" ".join(one[-size:]) for one in parts]


UNIT = "unit"
FILE_COLUMNS = ("path", "log", "rule", UNIT)
"""Columns of a file in an SQL query, besides its fields."""


def _check_group_count(pattern: str) -> str:
    try:
        groups = re.compile(pattern).groups
    except re.error as fault:
        raise ValueError(f"no regular expression: {fault}") from None
    if groups != 1:
        raise ValueError(f"a pattern has one group in parentheses, not {groups}")
    return pattern


Pattern = Annotated[str, AfterValidator(_check_group_count)]


class RuleTable(StrictModel):
    """`[[rules]]`: the first that fits decides. A condition that is not stated always holds.

    `path` is a glob over the whole path (`*` crosses folders), `units` are unit ids, `contains`
    channel names that the file must have. `skip` leaves such files out. Logs of rules of one name
    are taken together; a rule without one is called after its place, `rule 2`.
    """

    name: str = ""
    path: str | None = None
    units: list[str] | None = None
    contains: list[str] = Field(default_factory=list)
    vehicle: str | None = None
    channels: str | None = None
    skip: bool = False

    @model_validator(mode="after")
    def _check_card_or_skip(self) -> RuleTable:
        if (self.vehicle is None) != self.skip:
            raise ValueError("a rule names a vehicle card, or says skip = true")
        return self

    def matches_log(self, path: str, unit: str, channels: frozenset[str]) -> bool:
        """Return True if the rule applies to a log with this path, unit and channel names."""
        if self.path is not None and not fnmatchcase(path, self.path):
            return False
        if self.units is not None and unit not in self.units:
            return False
        return channels.issuperset(self.contains)


class FieldTable(StrictModel):
    """`[fields.<name>]`: where a number that belongs to a log stands; one of the three.

    `pattern` finds it in the path, `column` is a column of the list, `channel` a channel whose mean
    it is. Fields called `date` or `…_date` are ISO dates, kept as seconds since 1970 (UTC).
    """

    pattern: Pattern | None = None
    column: str | None = None
    channel: str | None = None

    @model_validator(mode="after")
    def _check_source(self) -> FieldTable:
        if sum(each is not None for each in (self.pattern, self.column, self.channel)) != 1:
            raise ValueError("a field has exactly one of pattern, column and channel")
        return self


class RulesFile(StrictModel):
    """A file of rules. `unit` finds the unit's id in the path; without it, it is the folder."""

    unit: Pattern | None = None
    mu_slip_rad_s: float = Field(default=50.0, gt=0)
    rules: list[RuleTable] = Field(min_length=1)
    fields: dict[str, FieldTable] = Field(default_factory=dict)

    @field_validator("fields")
    @classmethod
    def _check_field_names(cls, fields: dict[str, FieldTable]) -> dict[str, FieldTable]:
        """Check that field names differ from other columns; SQL ignores case."""
        taken = {*FILE_COLUMNS, *ROW_COLUMNS}
        for name in fields:
            if name.casefold() in taken:
                raise ValueError(f"there is a column {name!r} already; give another name")
            taken.add(name.casefold())
        return fields

    def get_unit(self, source: Source) -> str:
        """Id of the unit: the list's column `unit`, else the pattern's find, else the folder."""
        if UNIT in source.stated:
            return source.stated[UNIT]
        if self.unit is None:
            return source.path.parent.name
        found = re.search(self.unit, source.path.as_posix())
        if found is None:
            raise RulesError(
                f"the path does not hold a unit's id as {self.unit!r} finds it",
                "correct 'unit' in the rules, or rename the file",
            )
        return str(found[1])

    def get_fields(self, source: Source) -> dict[str, float]:
        """Return the fields found in path and list, in the order of the rules."""
        found = {}
        for name, table in self.fields.items():
            text = None
            if table.pattern is not None:
                match = re.search(table.pattern, source.path.as_posix())
                text = None if match is None else match[1]
            elif table.column is not None:
                text = source.stated.get(table.column)
            if text is not None:
                found[name] = parse_field_value(name, text)
        return found

    def list_channel_means(self) -> tuple[tuple[str, str], ...]:
        """Field and channel of the fields that are means of channels."""
        pairs = ((name, table.channel) for name, table in self.fields.items())
        return tuple((name, channel) for name, channel in pairs if channel is not None)


def is_date(field: str) -> bool:
    """Return True if a field holds dates."""
    return field == "date" or field.endswith("_date")


def parse_field_value(field: str, text: str) -> float:
    """A field's text as a finite number; a date in seconds since 1970. Raises RulesError."""
    try:
        if is_date(field):
            moment = datetime.fromisoformat(text)
            return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
        number = float(text)
        if not math.isfinite(number):
            raise ValueError(text)
        return number
    except ValueError:
        kind = "date (ISO, such as 2025-03-31)" if is_date(field) else "finite number"
        raise RulesError(
            f"field {field!r}: {text!r} is no {kind}",
            f"correct [fields.{field}] of the rules, or the list",
        ) from None


def read_rules(path: Path) -> RulesFile:
    """Rules from a file; a vehicle card stands for one rule that takes every log.

    Raises RulesError that lists all faults by key.
    """
    document = read_toml(path, RulesError)
    if "rules" not in document and "gears" in document:
        return RulesFile(rules=[RuleTable(name=path.stem, vehicle=str(path.absolute()))])
    remedy = "correct these keys of the rules; docs/howto/fleet.md shows a complete file"
    raise_faults(validate_schema(document, RulesFile), RulesError, str(path), remedy)
    rules = RulesFile.model_validate(document)
    placed = [
        _resolve_paths(each, number, path) for number, each in enumerate(rules.rules, start=1)
    ]
    return rules.model_copy(update={"rules": placed})


def _resolve_paths(rule: RuleTable, number: int, file: Path) -> RuleTable:
    """Give a rule a name, and resolve its paths against the folder of the rules file.

    Raises RulesError for a missing file.
    """
    changed = {"name": rule.name or f"rule {number}"}
    for key in ("vehicle", "channels"):
        if (name := getattr(rule, key)) is not None:
            target = (file.parent / name).absolute()
            if not target.is_file():
                raise RulesError(
                    f"there is no file {name!r}", "paths count from the folder of the rules",
                    Where(file=str(file), key=f"rules.{key}"),
                )  # fmt: skip
            changed[key] = str(target)
    return rule.model_copy(update=changed)


def select_rule(
    rules: RulesFile, source: Source, unit: str, channels: Callable[[], frozenset[str]]
) -> RuleTable:
    """The first rule that fits; `channels` reads the log's, which only some rules need.

    Raises RulesError where there is none, and what `channels` raises.
    """
    path = source.path.as_posix()
    for rule in rules.rules:
        if rule.matches_log(path, unit, channels() if rule.contains else frozenset()):
            return rule
    raise RulesError(
        f"no rule takes this log of unit {unit!r}",
        "add a rule for it, or one with skip = true that leaves such files out",
    )


_YEAR = 365.25 * 86400.0


def to_datetime(reading: float) -> datetime:
    """The point in time of a date's reading [s since 1970]."""
    return datetime.fromtimestamp(reading, UTC)


def format_reading(field: str, reading: float) -> str:
    """One reading: an ISO date, or the number alone to six digits."""
    if is_date(field):
        return to_datetime(reading).date().isoformat()
    return f"{reading:g}"


def format_span(field: str, low: float, high: float) -> str:
    """Two readings and what they are of, e.g. `119.2 and 123 odometer_Mm`; four digits do."""
    if is_date(field):
        return f"{format_reading(field, low)} and {format_reading(field, high)}"
    ends = (f"{float(f'{each:.4g}'):g}" for each in (low, high))
    return " and ".join(ends) + f" {field}"


def get_drift_unit(field: str) -> tuple[float, str]:
    """Return the factor and the unit by which a change per unit of the field is displayed."""
    return (_YEAR, "year") if is_date(field) else (1.0, field)
