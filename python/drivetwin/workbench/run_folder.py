# SPDX-License-Identifier: MIT
"""Temporary folder of one run of the workbench; folders of runs that were killed are removed.

A run holds a lock on a file in its folder. The system releases the lock when the process ends,
however it ends.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_PREFIX = "drivetwin-app-"
_LOCK = "lock"


@dataclass(frozen=True, eq=False)
class RunFolder:
    """A private folder with its lock."""

    path: Path
    lock: IO[bytes]

    @classmethod
    def create(cls) -> RunFolder:
        """Make a folder that only this user can read, and lock it."""
        while True:
            path = Path(tempfile.mkdtemp(prefix=_PREFIX))
            (path / _LOCK).touch(0o600)
            lock = _acquire(path / _LOCK)
            if lock is not None:  # else another run removes the folder at this moment
                return cls(path, lock)

    def remove(self) -> None:
        """Remove the folder with its content."""
        self.lock.close()
        shutil.rmtree(self.path, ignore_errors=True)


def remove_dead_folders() -> list[Path]:
    """Remove the folders of this user's runs whose process has ended; return their paths."""
    removed: list[Path] = []
    for path in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        if not _is_own(path):
            continue
        lock = _acquire(path / _LOCK)
        if lock is not None:
            RunFolder(path, lock).remove()
            removed.append(path)
    return removed


def _is_own(path: Path) -> bool:
    """Return True for a folder, not a link to one, that belongs to this user."""
    try:
        owner = path.lstat().st_uid
    except OSError:
        return False
    is_folder = path.is_dir() and not path.is_symlink()
    return is_folder and (sys.platform == "win32" or owner == os.getuid())


def _acquire(path: Path) -> IO[bytes] | None:
    """Return the open, locked file; None if it does not exist or another process holds it."""
    with suppress(OSError):
        file = path.open("r+b")
        try:
            if sys.platform == "win32":
                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            file.close()
            return None
        return file
    return None
