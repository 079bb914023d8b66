# SPDX-License-Identifier: MIT
"""Files appear whole or not at all, and never in place of one that is to be kept."""

from __future__ import annotations

import os
import platform
import re
import secrets
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO

from drivetwin._util.regular_file import find_special_kind
from drivetwin.errors import InputError, Where

_Identity = tuple[int, int]
"""Device and number of a file, by whatever path or link it is named."""

FOLDER_PREFIX = ".drivetwin-"
"""First part of the names of unfinished folders."""
_TOKEN = 6
"""Random bytes in the name of an unfinished file; exclusive creation fails on a repeated name."""
_kept: ContextVar[frozenset[_Identity]] = ContextVar("kept", default=frozenset())


@contextmanager
def protect_files(files: Iterable[Path]) -> Iterator[None]:
    """Protect `files` from being overwritten inside the block.

    Paths that are no files are ignored.
    """
    identities = (_get_identity(file) for file in files)
    token = _kept.set(frozenset(one for one in identities if one is not None))
    try:
        yield
    finally:
        _kept.reset(token)


def refuse_overwrite(path: Path) -> None:
    """Raise InputError where `path` is a file to be kept, also by another path or a link.

    Such are the protected files, and devices, named pipes and sockets: a file would take the place
    of the device itself.
    """
    kind = find_special_kind(path)
    if kind not in (None, "a folder"):
        what = f"cannot write here: it is {kind}, not a regular file"
        raise InputError(what, "name a regular file", Where(file=str(path)))
    if _get_identity(path) in _kept.get():
        what = "this file is read by the same command and would be written over"
        raise InputError(what, "give the result another name or folder", Where(file=str(path)))


def _get_identity(path: Path) -> _Identity | None:
    with suppress(OSError, ValueError):
        found = path.stat()
        if stat.S_ISREG(found.st_mode):
            return found.st_dev, found.st_ino
    return None


@contextmanager
def open_atomic(path: Path | str) -> Iterator[BinaryIO]:
    """Open a file beside `path` to write into; it is renamed into place when the block succeeds.

    A block that fails or is stopped leaves the old file, never half of the new one. Several
    threads, processes and machines may write the same file: the last one to finish wins. Raises
    OSError, and InputError where `path` is to be kept.
    """
    path = Path(path)
    refuse_overwrite(path)
    if not path.name:
        raise InputError("this names no file to write to", "name a file", Where(file=str(path)))
    path.parent.mkdir(parents=True, exist_ok=True)
    own = f"{make_owner_name()}.{secrets.token_hex(_TOKEN)}"
    beside = path.with_name(f"{path.name}.{own}.partial")
    unfinished = beside.open("x+b")
    try:
        with unfinished as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def make_owner_name() -> str:
    """Return the machine and the process as part of the names of unfinished files and folders."""
    return f"{platform.node()}.{os.getpid()}"


def remove_unfinished(outputs: Iterable[Path]) -> None:
    """Remove unfinished files and folders beside `outputs` whose process was killed.

    Only processes of this machine are looked at. A process that ends otherwise leaves none.
    """
    if os.name != "posix":
        return  # elsewhere a process cannot be looked up by its number
    owner = rf"{re.escape(platform.node())}\.(\d{{1,9}})"
    unfinished = re.compile(rf".+\.{owner}\.\w+\.partial|{re.escape(FOLDER_PREFIX)}{owner}\..+")
    for folder in {one for path in outputs for one in (find_existing(path), path.parent)}:
        for path in folder.iterdir() if folder.is_dir() else ():
            found = unfinished.fullmatch(path.name)
            if found is None or _is_running(int(found[1] or found[2])):
                continue
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def find_existing(path: Path) -> Path:
    """Return the path itself, or the nearest folder above it that exists."""
    return next(one for one in (path, *path.absolute().parents) if one.exists())


def _is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass
    return True


def write_text(path: Path | str, text: str) -> None:
    """Write `text` (UTF-8) to `path` atomically; raises the errors of `open_atomic`."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path | str, data: bytes) -> None:
    """Write `data` to `path` atomically; raises the errors of `open_atomic`."""
    with open_atomic(path) as file:
        file.write(data)
