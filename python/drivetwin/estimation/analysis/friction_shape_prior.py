# SPDX-License-Identifier: MIT
"""Prior shapes of friction over slip, by their names on the command line."""

from __future__ import annotations

from enum import StrEnum


class FrictionShape(StrEnum):
    """Prior knowledge of μ over slip."""

    FREE = "free"
    FALLING = "falling"
    RISING = "rising"
