# SPDX-License-Identifier: MIT
"""Version of the program."""

from __future__ import annotations

from functools import cache
from importlib import metadata


@cache
def get_program_version() -> str:
    """Version of the installed distribution; `unknown` when run from a source tree."""
    try:
        return metadata.version("drivetwin")
    except metadata.PackageNotFoundError:
        return "unknown"
