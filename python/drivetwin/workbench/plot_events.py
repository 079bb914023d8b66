# SPDX-License-Identifier: MIT
"""Values of the relayout events of figures, which may hold anything."""

from __future__ import annotations

import math


def parse_number(value: object) -> float | None:
    """Return a finite number; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None
