# SPDX-License-Identifier: MIT
"""Shapes of friction over slip, by the names used on the command line."""

from __future__ import annotations

from enum import StrEnum


class Shape(StrEnum):
    """What is known of μ over slip beforehand."""

    FREE = "free"
    FALLING = "falling"
    RISING = "rising"
