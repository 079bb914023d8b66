# SPDX-License-Identifier: MIT
"""Several output files that appear together or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def staged(folder: Path) -> Iterator[Path]:
    """Yield an empty folder to write into; its files move to `folder` when the block succeeds.

    When the block fails or is interrupted, `folder` is as it was: not made, nothing added or
    replaced. Raises OSError.
    """
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    beside = Path(tempfile.mkdtemp(dir=existing, prefix=".drivetwin-"))
    try:
        yield beside
        folder.mkdir(parents=True, exist_ok=True)
        for file in sorted(beside.iterdir()):
            file.replace(folder / file.name)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
