# SPDX-License-Identifier: MIT
"""Outputs of commands: declared by a marker, checked and locked before the computation."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from drivetwin._util.atomic import refuse_overwrite
from drivetwin.errors import FileFormatError, InputError, Where


class Shape(StrEnum):
    """Shape of an output."""

    FILE = "file"
    FOLDER = "folder"
    EITHER = "file or folder"


@dataclass(frozen=True)
class Output:
    """Marker of an argument that names an output.

    `endings` are the endings that a file may have, each with its kind; empty: any ending.
    """

    shape: Shape = Shape.FILE
    endings: Mapping[str, str] | None = None

    def check(self, path: Path) -> None:
        """Raise InputError or FileFormatError if nothing can be written to `path`."""
        where = Where(file=str(path))
        if self.shape is not Shape.FOLDER and not path.name:
            raise InputError("this names no file to write to", "name a file", where)
        if self.shape is Shape.FILE and path.is_dir():
            raise InputError("this is a folder, not a file", "name a file in it", where)
        if self.shape is Shape.FOLDER:
            if path.resolve() == path.resolve().parent:
                raise InputError(
                    "this is the root of the file system, not a folder for results",
                    "name a folder in it",
                    where,
                )
            if path.is_file():
                raise InputError("this is a file, not a folder", "name a folder", where)
        refuse_overwrite(path)
        self._check_ending(path)
        _check_place(path)

    def _check_ending(self, path: Path) -> None:
        """Raise FileFormatError if the ending of a file is of no kind that is written."""
        if self.endings and path.suffix.casefold() not in self.endings:
            known = ", ".join(f"{ending} ({kind})" for ending, kind in self.endings.items())
            raise FileFormatError(
                f"no format has the ending {path.suffix!r}", f"use {known}", Where(file=str(path))
            )


def _check_place(path: Path) -> None:
    """Raise InputError if the nearest folder that exists on the way to `path` takes no files."""
    folders = (path, *path.parents) if path.is_dir() else path.parents
    nearest = next((one for one in folders if one.exists()), Path())
    if not nearest.is_dir():
        what = f"{nearest} is a file, so nothing can be in it"
        raise InputError(what, "name another folder", Where(file=str(path)))
    if not os.access(nearest, os.W_OK | os.X_OK):
        what = f"no permission to write in {nearest.resolve()}"
        remedy = "name another folder, or change its permissions"
        raise InputError(what, remedy, Where(file=str(path)))


def select_outputs(paths: Iterable[Path] | None, *endings: str) -> list[Path]:
    """Return the outputs of some endings, in any case of letters."""
    return [path for path in paths or () if path.suffix.casefold() in endings]


PAGE = {".html": "page with figures"}
"""Kind of an output that is a page alone."""
LOG_ENDINGS = {".csv": "text", ".mf4": "MDF 4", ".parquet": "Parquet", ".mat": "MATLAB"}
"""Kinds of an output that is a log."""


try:
    import fcntl
except ImportError:  # not a POSIX system: outputs are not locked
    fcntl = None  # type: ignore[assignment]


@contextmanager
def lock_outputs(paths: Iterable[Path]) -> Iterator[None]:
    """Hold the locks of output paths inside the block; they end with the process at the latest.

    Raises InputError where another command of this user, on this machine, holds one.
    """
    with ExitStack() as held:
        for path in sorted({path.resolve() for path in paths}):
            held.enter_context(_lock(path))
        yield


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    if fcntl is None:
        yield
        return
    import hashlib

    name = hashlib.sha256(os.fsencode(path)).hexdigest()[:32]
    file = Path(tempfile.gettempdir(), f"drivetwin-{os.getuid()}-{name}.lock")
    handle = _acquire(file, path)
    try:
        yield
    finally:
        file.unlink(missing_ok=True)
        os.close(handle)


def _acquire(file: Path, path: Path) -> int:
    """Return the open, locked file. One that its last owner removed meanwhile is made again."""
    while True:
        handle = os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            raise InputError(
                "another command is writing here",
                "wait until it is through, or give another -o",
                Where(file=str(path)),
            ) from None
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(handle), file.stat()):
                return handle
        os.close(handle)
