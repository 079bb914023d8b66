# SPDX-License-Identifier: MIT
"""Locks on output paths: of two commands that would write to one place, the second is refused."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from drivetwin.errors import InputError, Where

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
