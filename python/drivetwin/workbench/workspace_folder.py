# SPDX-License-Identifier: MIT
"""The one folder whose files the workbench reads and writes."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from drivetwin.errors import RefusedError, Where

MAX_LISTED = 300
"""Names offered for completion; any other file of the folder can still be typed."""
MAX_DEPTH = 3
"""Levels of folders that are looked into for names to offer."""


@dataclass(frozen=True)
class Folder:
    """A folder by its `root`, absolute and with all links resolved."""

    root: Path

    @classmethod
    def from_path(cls, path: Path) -> Folder:
        """Open the folder at `path`; raise RefusedError if it does not exist."""
        root = path.resolve()
        if not root.is_dir():
            raise RefusedError("this is no folder", "start in a folder", Where(file=str(path)))
        return cls(root)

    def get_file(self, name: str) -> Path:
        """A regular file inside the folder by its path in it; links are followed, then checked.

        Raises RefusedError for a path that leads outside, to nothing, or to no regular file.
        """
        path = self._resolve_inside(name)
        if not path.is_file():
            raise RefusedError(
                "there is no such file in the folder of the workbench",
                f"give a path inside {self.root}, or upload the file",
                Where(file=name),
            )
        return path

    def make_new_path(self, name: str, suffix: str) -> Path:
        """Return the path of a new file called `name`; append `suffix` if it is missing.

        Raises RefusedError for a path that leads outside, into a folder that does not exist, or to
        something that is no regular file.
        """
        path = self._resolve_inside(name if name.endswith(suffix) else name + suffix)
        is_other = path.exists() and not path.is_file()
        if path.name == suffix or not path.parent.is_dir() or is_other:
            raise RefusedError(
                "no file can be written there",
                f"give a name in an existing folder inside {self.root}",
                Where(file=name),
            )
        return path

    def get_name(self, path: Path) -> str:
        """Return the path of a file relative to the folder, with forward slashes."""
        return path.relative_to(self.root).as_posix()

    def list_names(self, endings: Collection[str]) -> list[str]:
        """Names of files with one of the `endings`, for completion; hidden ones are left out."""
        found = sorted(name for name in self._walk() if name.lower().endswith(tuple(endings)))
        return found[:MAX_LISTED]

    def _resolve_inside(self, name: str) -> Path:
        what = "this path leads outside the folder of the workbench"
        try:
            path = (self.root / name.strip()).resolve()
            path.exists()  # raises an error for a string that is not a valid path
        except (OSError, ValueError, RuntimeError):
            path, what = Path("/"), "this is no path"
        if not name.strip():
            path, what = Path("/"), "no file is named"
        if not path.is_relative_to(self.root):
            remedy = f"give a path inside {self.root}, or upload the file"
            raise RefusedError(what, remedy, Where(file=name[:200] or None))
        return path

    def _walk(self) -> Iterator[str]:
        for folder, inner, files in os.walk(self.root):
            place = Path(folder).relative_to(self.root)
            deep = len(place.parts) >= MAX_DEPTH
            inner[:] = [] if deep else sorted(one for one in inner if not one.startswith("."))
            yield from ((place / one).as_posix() for one in files if not one.startswith("."))
