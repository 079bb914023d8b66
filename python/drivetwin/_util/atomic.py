# SPDX-License-Identifier: MIT
"""Border for files: replaced whole or not at all, regular ones only; signals that end a program."""

from __future__ import annotations

import hashlib
import math
import os
import platform
import re
import secrets
import shutil
import signal
import stat
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO

from drivetwin.errors import DrivetwinError, InputError, Where

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


LARGEST_RECORD = 200_000_000
"""Largest file [bytes] that is read into memory as one text: results, parameters, databases."""


def measure_regular_file(
    path: Path,
    error: type[DrivetwinError],
    remedy: str = "check the path",
    largest: float = math.inf,
) -> int:
    """Return the size [bytes] of a regular file, without opening it.

    A device, named pipe or socket could block or never end. Symbolic links are followed. Raises
    `error`, with `remedy`, where the path is missing, and where it is no regular file or has more
    than `largest` bytes.
    """
    where = Where(file=str(path))
    try:
        status = path.stat()
    except (OSError, ValueError) as fault:  # ValueError: the path contains a NUL
        why = getattr(fault, "strerror", None) or fault
        raise error(f"cannot read the file: {why}", remedy, where) from None
    if kind := _name_kind(status.st_mode):
        what = f"cannot read the file: it is {kind}, not a regular file"
        raise error(what, "name a regular file; copy the data into one first", where)
    if status.st_size > largest:
        what = f"the file has {status.st_size / 1e6:.1f} MB, at most {largest / 1e6:g} MB are read"
        raise error(what, "hand in a file written for this purpose", where)
    return status.st_size


def find_special_kind(path: Path) -> str | None:
    """Return the kind of what exists at a path, such as `a device`; None for a regular file.

    None is also returned where nothing can be found there.
    """
    try:
        return _name_kind(path.stat().st_mode)
    except (OSError, ValueError):
        return None


def _name_kind(mode: int) -> str | None:
    """Return the kind of file by its mode; None for a regular file."""
    if stat.S_ISREG(mode):
        return None
    return next((name for is_kind, name in _KINDS if is_kind(mode)), "special")


def compute_digest(path: Path) -> str:
    """Compute the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


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


ENDING = tuple(
    signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Signals that end a program: Ctrl-C, a request, a terminal that is closed."""
_raised: list[int] = []
"""Signals for which `_interrupt` raised KeyboardInterrupt."""


def interrupt_on_signals() -> None:
    """Let all signals of `ENDING` raise KeyboardInterrupt as Ctrl-C does, and remember them.

    A signal that the caller of the program ignores stays ignored: SIGINT of jobs in the background,
    SIGHUP below nohup. SIGTERM is never ignored.
    """
    for one in ENDING:
        if one is signal.SIGTERM or signal.getsignal(one) is not signal.SIG_IGN:
            signal.signal(one, _interrupt)


@contextmanager
def ignore_interrupts() -> Iterator[None]:
    """Ignore all signals of `ENDING` while the program cleans up.

    A terminal that is closed sends more than one.
    """
    before = {one: signal.signal(one, signal.SIG_IGN) for one in ENDING}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


def was_interrupted() -> bool:
    """Return True after an interrupt, also where its KeyboardInterrupt became another exception.

    An extension module that is interrupted while it is imported raises ImportError.
    """
    return bool(_raised)


@contextmanager
def defer_interrupts() -> Iterator[None]:
    """Let signals that end the program wait until the block is through."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {one: signal.signal(one, lambda number, _: came.append(number)) for one in ENDING}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
        if came:
            signal.raise_signal(came[0])


def _interrupt(number: int, _frame: object) -> None:
    _raised.append(number)
    raise KeyboardInterrupt
