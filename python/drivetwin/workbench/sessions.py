# SPDX-License-Identifier: MIT
"""Sessions of a server, one for each tab. They share nothing."""

from __future__ import annotations

import secrets
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

from drivetwin.errors import RefusedError
from drivetwin.workbench.run_folder import RunFolder
from drivetwin.workbench.session import Session
from drivetwin.workbench.workspace_folder import Folder


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
