# SPDX-License-Identifier: MIT
"""Reading of `result.json` and `twin.toml`; every error names the faulty key."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from drivetwin._util.regular_file import LARGEST_RECORD, measure_regular_file
from drivetwin._util.toml import raise_faults, validate_schema
from drivetwin.errors import ResultFileError, Where
from drivetwin.files.records import Record

R = TypeVar("R", bound=Record)

_AGAIN = "write it again with 'drivetwin identify'"


def read_record(path: Path | str, parse: Callable[[str], Any], schema: str, model: type[R]) -> R:
    """Read a file of `schema` as `model`; `parse` makes the document of its text.

    Raises ResultFileError where the file is missing, damaged or of a newer schema.
    """
    where = Where(file=str(path))
    remedy = "check the path, or write it with 'drivetwin identify'"
    measure_regular_file(Path(path), ResultFileError, remedy, LARGEST_RECORD)
    try:
        tree = parse(Path(path).read_text(encoding="utf-8"))
    except OSError as fault:
        what = f"cannot read the file: {fault.strerror}"
        raise ResultFileError(what, remedy, where) from None
    except (ValueError, RecursionError) as fault:
        raise ResultFileError(f"cannot be read: {fault}", _AGAIN, where) from None
    if not isinstance(tree, dict):
        raise ResultFileError("cannot be read: it is no table", _AGAIN, where)
    _check_schema(tree.get("schema"), schema, str(path))
    raise_faults(validate_schema(tree, model), ResultFileError, str(path), _AGAIN)
    return model.model_validate(tree)


def _check_schema(found: object, known: str, file: str) -> None:
    """Raise ResultFileError unless `found` names the family of `known` in a version not newer.

    `known` reads like `drivetwin/twin-1`: family, dash, version. Older versions stay readable.
    """
    family, _, version = known.rpartition("-")
    match = (
        re.fullmatch(rf"{re.escape(family)}-(\d{{1,9}})", found) if isinstance(found, str) else None
    )
    where = Where(file=file, key="schema")
    if match is None:
        raise ResultFileError(
            f"schema is {repr(found)[:80]}, expected {known!r}",
            "give a file written by drivetwin",
            where,
        )
    if int(match[1]) > int(version):
        raise ResultFileError(
            f"schema {found!r} is newer than this program's {known!r}",
            "update drivetwin, or write the file again with this version",
            where,
        )
