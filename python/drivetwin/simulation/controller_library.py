# SPDX-License-Identifier: MIT
"""Loaded libraries of external shift controllers, and the trace of their calls.

The trace is a file beside the library, mapped into memory. The core notes the inputs of each call
in it, so that another process can name the call that crashed or did not return.
"""

from __future__ import annotations

import ctypes
import mmap
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from drivetwin.errors import InputError, Where

INPUTS = (
    *("time", "offgoing_slip", "oncoming_slip", "engine_speed", "output_speed"),
    *("engine_torque", "system_pressure", "oil_temperature"),
)
"""Inputs of a call in the order of the trace and of `dt_inputs`; SI."""
_PLACES = 256
"""Runs at once that the trace has a place for: more than cores."""
_FREE, _IN_CALL = 0, 2
_STATE_SIZE, _STEP = "dt_state_size", "dt_step"


@dataclass(frozen=True)
class LibraryAddresses:
    """Addresses of the functions of a loaded library, and of its trace with `places` places."""

    state_size: int
    step: int
    trace: int
    places: int


@dataclass(frozen=True, eq=False)
class Call:
    """Call of a controller in progress: place in the trace, its number, inputs by name."""

    place: int
    number: int
    inputs: dict[str, float]


def name_trace(library: Path) -> Path:
    """Return the path of the trace of a library."""
    return library.with_name(f"{library.name}.trace")


def create_trace(library: Path) -> None:
    """Create the empty trace of a library."""
    name_trace(library).write_bytes(bytes(8 * _PLACES * (2 + len(INPUTS))))


def read_calls(library: Path) -> list[Call]:
    """Read the calls in progress from the trace of a library."""
    data = np.fromfile(name_trace(library), dtype=np.uint64).reshape(_PLACES, -1)
    return [
        Call(place, int(row[1]), dict(zip(INPUTS, _to_floats(row[2:]), strict=True)))
        for place, row in enumerate(data)
        if row[0] == _IN_CALL
    ]


def _to_floats(bits: np.ndarray[tuple[int], np.dtype[np.uint64]]) -> list[float]:
    numbers: list[float] = bits.view(np.float64).tolist()
    return numbers


@cache
def load_library(path: Path) -> LibraryAddresses:
    """Load a library for the rest of this process; its trace is used where it exists.

    Raises InputError where it cannot be loaded or misses a function of the interface.
    """
    try:
        loaded = ctypes.CDLL(str(path))
        functions = [getattr(loaded, name) for name in (_STATE_SIZE, _STEP)]
    except (OSError, AttributeError) as error:
        raise InputError(
            f"the controller has no usable library: {error}",
            f"define {_STATE_SIZE} and {_STEP} as drivetwin_controller.h declares them",
            Where(file=str(path)),
        ) from error
    size, step = (ctypes.cast(one, ctypes.c_void_p).value or 0 for one in functions)
    trace = name_trace(path)
    if not trace.is_file():
        return LibraryAddresses(size, step, 0, 0)
    with trace.open("r+b") as file:
        mapped = mmap.mmap(file.fileno(), 0)
    _MAPS.append(mapped)
    address = ctypes.addressof(ctypes.c_char.from_buffer(mapped))
    return LibraryAddresses(size, step, address, _PLACES)


_MAPS: list[mmap.mmap] = []
"""Traces of loaded libraries; the core keeps their addresses."""
