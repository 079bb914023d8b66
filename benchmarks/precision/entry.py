# SPDX-License-Identifier: MIT
"""One peer with one setting on one problem."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from benchmarks.precision.linear import LinearProblem
from benchmarks.precision.shift import ShiftProblem
from drivetwin.simulation.dual_clutch import FloatArray

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
"""Relative and absolute tolerances of adaptive integrators."""
FLAGS = ("-O3", "-march=native", "-shared", "-fPIC")
"""Of the C peers."""
Problem = LinearProblem | ShiftProblem


@dataclass(frozen=True, eq=False)
class Entry:
    """One run after another; `run` returns the result that the problem rates, None if it failed.

    `clock` is in seconds. `repeats` is False where `run` repeats by itself.
    """

    setting: str
    run: Callable[[], FloatArray | None]
    clock: Callable[[], float] = time.process_time
    repeats: bool = True


@cache
def compile_c(source: Path, *options: str) -> ctypes.CDLL:
    """Compile a C source into a library; `options` follow it.

    Raises
    ------
    CalledProcessError, FileNotFoundError
        No compiler, or a header or library is missing.
    """
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "peer.so"
        command = ["gcc", *FLAGS, str(source), *options, "-lm", "-o", str(library)]
        subprocess.run(command, check=True, capture_output=True)
        return ctypes.CDLL(str(library))


def get_pointer(array: FloatArray) -> ctypes._Pointer[ctypes.c_double]:
    """Return the pointer to the numbers of an array."""
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
