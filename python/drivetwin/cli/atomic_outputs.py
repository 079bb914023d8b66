# SPDX-License-Identifier: MIT
"""Several output files that appear together or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from drivetwin._util.atomic import (
    FOLDER_PREFIX,
    find_existing,
    make_owner_name,
    refuse_overwrite,
)
from drivetwin._util.interrupts import defer_interrupts
from drivetwin.errors import DrivetwinError, InputError


def refuse_same_names(files: Sequence[Path], remedy: str) -> None:
    """Raise InputError where two files have one stem: what is made of them would share a name."""
    twice = [stem for stem, count in Counter(file.stem for file in files).items() if count > 1]
    if twice:
        raise InputError(
            f"several logs are called {', '.join(twice)}: their results would share one name",
            remedy,
        )


@contextmanager
def write_atomically(folder: Path) -> Iterator[Path]:
    """Yield an empty folder to write into; its files move to `folder` when the block succeeds.

    When the block fails or is interrupted, `folder` is as it was: not made, nothing added or
    replaced. An error about a file in the empty folder names it in `folder`. Raises OSError, and
    InputError where a file would take the place of one to be kept.
    """
    existing = find_existing(folder)
    try:
        prefix = f"{FOLDER_PREFIX}{make_owner_name()}."
        beside = Path(tempfile.mkdtemp(dir=existing, prefix=prefix))
    except OSError as error:
        error.filename = str(existing)
        raise
    try:
        yield beside
        folder.mkdir(parents=True, exist_ok=True)
        files = sorted(beside.iterdir())
        for file in files:
            refuse_overwrite(folder / file.name)
        with defer_interrupts():
            for file in files:
                file.replace(folder / file.name)
    except DrivetwinError as error:
        error.where = replace(error.where, file=_map_to_target(error.where.file, beside, folder))
        raise
    except OSError as error:
        error.filename = _map_to_target(error.filename, beside, folder)
        raise
    finally:
        with defer_interrupts():
            shutil.rmtree(beside, ignore_errors=True)


def write_texts(folder: Path, texts: Mapping[str, str]) -> tuple[Path, ...]:
    """Write texts by file name into a folder, all or none; return their paths."""
    with write_atomically(folder) as beside:
        for name, text in texts.items():
            (beside / name).write_text(text, encoding="utf-8", newline="\n")
    return tuple(folder / name for name in texts)


def _map_to_target(file: object, beside: Path, folder: Path) -> str | None:
    """Map a path in `beside` to its final path in `folder`; return other paths unchanged."""
    if file is None:
        return None
    path = Path(str(file))
    return str(folder / path.relative_to(beside) if path.is_relative_to(beside) else file)
