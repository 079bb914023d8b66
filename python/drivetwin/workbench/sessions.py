# SPDX-License-Identifier: MIT
"""Sessions of a server, one for each tab, and the temporary folder of its run."""

from __future__ import annotations

import os
import secrets
import shutil
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from drivetwin.errors import RefusedError
from drivetwin.workbench.session import Session
from drivetwin.workbench.workspace import Folder

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


@dataclass(eq=False)
class Sessions:
    """All sessions of a server by an unguessable key, in a temporary folder of the run."""

    folder: Folder
    place: RunFolder = field(default_factory=RunFolder.create)
    _held: dict[object, Session] = field(default_factory=dict)

    def create(self) -> str:
        """Open a session and return its key."""
        key = secrets.token_urlsafe(24)
        scratch = Path(tempfile.mkdtemp(prefix="session-", dir=self.place.path))
        self._held[key] = Session(self.folder, scratch)
        return key

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str) and key in self._held

    def get(self, key: object) -> Session:
        """Return a session. Raises RefusedError for a key without one."""
        if key not in self:
            raise RefusedError("this session has ended", "load the page again")
        return self._held[key]

    def close(self) -> None:
        """End all sessions."""
        while self._held:
            self._held.popitem()[1].close()
        self.place.remove()
