# SPDX-License-Identifier: MIT
"""Memory and time that reading a log may take, by the size of the file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

BASE_MEMORY = 2 * 2**30
"""Memory [bytes] that a small file may take beyond that of the libraries."""
MEMORY_PER_BYTE = 16
"""Memory [bytes] that a file may take besides for each of its bytes, which may be packed."""
BASE_TIME = 60.0
"""Time limit [s] for reading a small file."""
TIME_PER_BYTE = 2e-6
"""Time [s] that a log may take besides for each of its bytes: half an hour at 1 kHz, 160 MB of
text, takes a minute on an idle machine and a multiple of it on a busy one."""
MAX_TIME = 600.0
"""Time limit [s] for reading a file of any size."""


@dataclass(frozen=True)
class ParserLimits:
    """Memory [bytes] beyond that of the libraries, and time [s] to open a file or load a column."""

    memory: int
    seconds: float


def compute_parser_limits(path: Path) -> ParserLimits:
    """Compute the limits for reading a log from the size of its file; one that is absent has 0."""
    try:
        size = path.stat().st_size
    except OSError:
        size = 0
    return ParserLimits(
        BASE_MEMORY + MEMORY_PER_BYTE * size, min(BASE_TIME + TIME_PER_BYTE * size, MAX_TIME)
    )
