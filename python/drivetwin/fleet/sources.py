# SPDX-License-Identifier: MIT
"""Files of a fleet: files, folders, globs and lists, one after the other."""

from __future__ import annotations

import csv
import glob
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath

from drivetwin._util.atomic import LARGEST_RECORD, measure_regular_file
from drivetwin._util.text import parse_csv_row, restore_cell
from drivetwin.errors import InputError, Where
from drivetwin.fleet.index import INDEX
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
