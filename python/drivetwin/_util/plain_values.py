# SPDX-License-Identifier: MIT
"""Reduction of settings to values that JSON and TOML have."""

from __future__ import annotations

import json
import math
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np


def convert_nonfinite(value: object) -> object:
    """Turn NaN and infinities into None: neither exists in JSON."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def to_plain_values(value: Any) -> Any:
    """Reduce values to JSON and TOML types: enums to values, arrays to lists, NaN to None, and
    dataclasses to their fields by name."""
    if is_dataclass(value) and not isinstance(value, type):
        value = {one.name: getattr(value, one.name) for one in fields(value)}
    if isinstance(value, Enum):
        return to_plain_values(value.value)
    if isinstance(value, np.ndarray | np.generic):
        return to_plain_values(value.tolist())
    if isinstance(value, dict):
        return {str(key): to_plain_values(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [to_plain_values(item) for item in value]
    if isinstance(value, bool | int | str | None):
        return value
    return convert_nonfinite(value) if isinstance(value, float) else str(value)


def format_json(value: Any) -> str:
    """Write a value as strict JSON text: no NaN, plain types, readable."""
    text = json.dumps(to_plain_values(value), allow_nan=False, ensure_ascii=False, indent=2)
    return text + "\n"
