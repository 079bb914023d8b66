# SPDX-License-Identifier: MIT
"""Platforms that binaries are built for."""

from __future__ import annotations

from enum import StrEnum


class Platform(StrEnum):
    """A platform by its name on the command line."""

    LINUX = "linux"
    WINDOWS = "windows"
    MACOS = "macos"
    MACOS_ARM = "macos-arm"

    @property
    def suffix(self) -> str:
        """File name suffix of a shared library."""
        return {Platform.LINUX: ".so", Platform.WINDOWS: ".dll"}.get(self, ".dylib")
