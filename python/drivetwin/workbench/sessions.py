# SPDX-License-Identifier: MIT
"""Sessions of a server. They share nothing; those idle longest are stored on disk."""

from __future__ import annotations

import secrets
import tempfile
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from drivetwin.errors import RefusedError
from drivetwin.workbench.run_folder import RunFolder
from drivetwin.workbench.session import Session
from drivetwin.workbench.workspace_folder import Folder

MOST_SESSIONS = 16
"""Number of sessions in memory; for another the one that is idle longest is stored.

More are held while as many run a job, or if the disk takes no more.
"""


@dataclass(eq=False)
class Sessions:
    """All sessions of a server by an unguessable key, in a temporary folder of the run."""

    folder: Folder
    place: RunFolder = field(default_factory=RunFolder.create)
    _held: dict[str, Session] = field(default_factory=dict)
    _stored: dict[str, Path] = field(default_factory=dict)
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def create(self) -> str:
        """Open a session and return its key."""
        key = secrets.token_urlsafe(24)
        with self._lock:
            self._make_room()
            scratch = Path(tempfile.mkdtemp(prefix="session-", dir=self.place.path))
            self._held[key] = Session(self.folder, scratch)
        return key

    def __contains__(self, key: object) -> bool:
        with self._lock:
            return isinstance(key, str) and (key in self._held or key in self._stored)

    @contextmanager
    def use(self, key: object) -> Iterator[Session]:
        """Hold a session, which is not stored meanwhile; one that was stored is restored.

        Raises RefusedError for a key without a session.
        """
        with self._lock:
            session = self._find(key)
            session.users += 1
        try:
            yield session
        finally:
            with self._lock:
                session.users -= 1
                session.used = time.monotonic()

    def get(self, key: object) -> Session:
        """Return a session to look at; see `use` for one to change."""
        with self.use(key) as session:
            return session

    def close(self) -> None:
        """End all sessions."""
        with self._lock:
            for session in self._held.values():
                session.close()
            self._held.clear()
            self._stored.clear()
            self.place.remove()

    def _find(self, key: object) -> Session:
        if not isinstance(key, str) or key not in self:
            raise RefusedError("this session has ended", "load the page again")
        if key not in self._held:
            self._make_room()
            self._held[key] = Session.restore(self.folder, self._stored[key])
            del self._stored[key]
        return self._held[key]

    def _make_room(self) -> None:
        """Store sessions until one more fits."""
        excess = len(self._held) + 1 - MOST_SESSIONS
        for key in sorted(self._held, key=lambda one: self._held[one].used):
            if excess <= 0:
                return
            session = self._held[key]
            if not session.is_idle():
                continue
            try:
                session.store()
            except Exception as fault:  # whatever it is, the session stays in memory
                traceback.print_exception(fault)
                return
            self._stored[key] = self._held.pop(key).scratch
            excess -= 1
