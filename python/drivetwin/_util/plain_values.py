# SPDX-License-Identifier: MIT
"""Reduction of settings to values that JSON and TOML have."""

from __future__ import annotations

import math
from enum import Enum
from typing import Any

import numpy as np


def finite_or_none(value: object) -> object:
    """Turn NaN and infinities into None: neither exists in JSON."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def plain(value: Any) -> Any:
    """Reduce settings to what JSON and TOML know: enums to values, arrays to lists, NaN to None."""
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, bool | int | str | None):
        return value
    return finite_or_none(value) if isinstance(value, float) else str(value)
