# SPDX-License-Identifier: MIT
"""Files appear whole or not at all."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def write_text(path: Path, text: str) -> None:
    """Write `text` (UTF-8) beside `path` and rename it into place.

    A run that is stopped leaves the old file, never half of the new one. Raises OSError.
    """
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` as `write_text` does; several machines may write the same file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f"{path.name}.{platform.node()}.{os.getpid()}.partial")
    try:
        with beside.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)
