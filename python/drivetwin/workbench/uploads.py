# SPDX-License-Identifier: MIT
"""Uploads from the browser: streamed to disk, limited in size, checked, never executed.

An upload is bytes under a name of our own; the name that the browser gives is a label. Its
content is parsed in a process of its own (see `sandboxed_parse.py`).
"""

from __future__ import annotations

import mmap
import re
import unicodedata
from pathlib import Path
from typing import IO

from drivetwin.errors import RefusedError, Where
from drivetwin.logs.formats.guarded import compute_parser_limits
from drivetwin.workbench import jobs
from drivetwin.workbench.session_state import Source

LIMITS = {
    "log": 200 * 2**20,  # ten minutes of 40 channels at 1 kHz; larger ones are opened by path
    "card": 2 * 2**20,
    "workspace": 20 * 2**20,  # three twins take some 0.3 MB
}
"""Bytes that an upload may have, by what it is for."""
_CHUNK = 2**18
_LONGEST_NAME = 200
_SIGN = rb"""[+-](?!(?i:nan|inf|infinity)\b)(?=[A-Za-z(]|[^,;\t\r\n"]*[|!(])"""
_FORMULA = re.compile(rb"""(?:^|[,;\t])[ ]*"?(?:[=@]|""" + _SIGN + rb")", re.MULTILINE)
"""A cell that a spreadsheet would compute: it begins with =, @, or a sign before no number.

An apostrophe in front makes it a text. The time of a search is proportional to the size of the
file: no part goes beyond its cell.
"""
_HEAD = 4096


def make_label(name: str) -> str:
    """The name that an upload is shown under. Raises RefusedError for one that is a path or none.

    Names are compared after NFKC: a full-width slash is a slash.
    """
    plain = unicodedata.normalize("NFKC", name)
    bad = any(unicodedata.category(one).startswith("C") for one in plain)
    if bad or len(name) > _LONGEST_NAME or re.search(r"[/\\:*?\"<>|]|^\.|^\s*$", plain):
        raise RefusedError(
            "this is no plain file name", "rename the file and upload it again",
            Where(file=repr(name[:80])),
        )  # fmt: skip
    return name


def store_stream(
    stream: IO[bytes], name: str, claimed: int | None, target: Path, limit: int
) -> Source:
    """Write at most `limit` bytes of `stream` to `target`; delete the file if it is refused.

    `claimed` is the length that the browser states, None where it states none.
    Raises RefusedError for a bad name, too many bytes, claimed or sent, none at all, and formulas.
    """
    label = make_label(name)
    if claimed is not None and claimed > limit:
        raise _make_size_error(label, f"{claimed / 1e6:.0f} MB", limit)
    try:
        with target.open("xb") as file:
            size = _copy(stream, file, limit)
        if size > limit:
            raise _make_size_error(label, "more", limit)
        if size == 0:
            raise RefusedError("the file is empty", "upload a file", Where(file=label))
        if claimed is not None and size != claimed:
            raise RefusedError(
                f"{size} of {claimed} bytes arrived", "upload the file again", Where(file=label)
            )
        refuse_formulas(target, label)
    except BaseException:
        target.unlink(missing_ok=True)
        raise
    return Source(label, target, uploaded=True)


def refuse_formulas(path: Path, label: str) -> None:
    """Refuse a text file with cells that a spreadsheet would compute: no logger writes them.

    They would run where a name or a value of the log is later opened as a table. The search runs in
    a separate process, because the server could not answer other requests meanwhile.
    """
    with path.open("rb") as file:
        if b"\0" in file.read(_HEAD):
            return
    number = jobs.call(find_formula, path, limit=compute_parser_limits(path).seconds)
    if number is not None:
        raise RefusedError(
            f"line {number} holds a cell that is a formula",
            "export the log as plain numbers, without formulas",
            Where(file=label),
        )


def find_formula(emit: jobs.Emit, path: Path) -> None:
    """Emit the number of the first line with a formula in a file that is not empty, or None."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        found = _FORMULA.search(content)
        emit(None if found is None else 1 + content[: found.end()].count(b"\n"))


def _copy(stream: IO[bytes], file: IO[bytes], limit: int) -> int:
    """Copy until the end or the first chunk beyond `limit`; returns the bytes seen."""
    size = 0
    while chunk := stream.read(_CHUNK):
        size += len(chunk)
        if size > limit:
            break
        file.write(chunk)
    return size


def _make_size_error(label: str, size: str, limit: int) -> RefusedError:
    return RefusedError(
        f"the file has {size}, the limit is {limit / 1e6:.0f} MB",
        "copy it into the folder of the workbench and open it by its path, or cut the log",
        Where(file=label),
    )
