# SPDX-License-Identifier: MIT
"""Structures of the C headers as ctypes classes, read from the headers."""

from __future__ import annotations

import ctypes
import re
from enum import Enum
from types import SimpleNamespace
from typing import Any

from drivetwin.export.c.write import read_model_sources

_CONSTANT = re.compile(r"#define DT_(\w+) (\d+)\b")
_STRUCTURE = re.compile(r"typedef struct \{(.*?)\} dt_(\w+);", re.DOTALL)
_FIELD = re.compile(r"(\w+) (\w+)((?:\[\w+\])*);")
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


class Precision(Enum):
    """Number type of the compiled model."""

    DOUBLE = ctypes.c_double
    FLOAT = ctypes.c_float


def read_layout(precision: Precision) -> SimpleNamespace:
    """Return the ctypes class of every structure by its name without `dt_`."""
    sources = read_model_sources()
    text = _COMMENT.sub(
        "", "".join(sources[f"dt_{n}.h"].decode() for n in ("model", "delay", "observer"))
    )
    sizes = {f"DT_{name}": int(value) for name, value in _CONSTANT.findall(text)}
    types: dict[str, Any] = {"dt_real": precision.value, "uint64_t": ctypes.c_uint64}
    types |= dict.fromkeys(("int", "dt_mode", "dt_loss_law"), ctypes.c_int)
    for body, name in _STRUCTURE.findall(text):
        fields = []
        for kind, field, dimensions in _FIELD.findall(body):
            shaped = types[kind]
            for size in reversed(re.findall(r"\w+", dimensions)):
                shaped = shaped * sizes[size]
            fields.append((field, shaped))
        types[f"dt_{name}"] = type(name, (ctypes.Structure,), {"_fields_": fields})
    return SimpleNamespace(**{name.removeprefix("dt_"): kind for name, kind in types.items()})
