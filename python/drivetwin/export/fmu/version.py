# SPDX-License-Identifier: MIT
"""Versions of the interface."""

from __future__ import annotations

from enum import StrEnum


class FmiVersion(StrEnum):
    """Version of FMI."""

    FMI2 = "2.0"
    FMI3 = "3.0"
