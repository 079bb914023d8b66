# SPDX-License-Identifier: MIT
"""Hand-written C for just this problem: fourth-order Runge-Kutta with located events.

The program is not part of this repository; it is compiled where it lies beside it.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
import time
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.speed.measure import Entry, Judge, Sample
from drivetwin.simulation.dual_clutch import FloatArray
from tests.support.upshift.statement import BAR, SAMPLES, STEP, Inputs, Problem, Solution, start

SOURCE = Path(__file__).resolve().parents[3] / "shared" / "peers" / "shift.c"
PROGRAM = "hand-written C"
SETTING = "RK4, 1 ms, events located"
FLAGS = ("-O3", "-march=native", "-fopenmp", "-shared", "-fPIC")
_REPEATS, _MOST_EVENTS = 20, 64
_Double = ctypes.POINTER(ctypes.c_double)


class Library:
    """The compiled program."""

    def __init__(self, folder: Path) -> None:
        """Compile into `folder`. Raises CalledProcessError or FileNotFoundError."""
        self.path = folder / "libshift.so"
        subprocess.run(
            ["gcc", *FLAGS, str(SOURCE), "-o", str(self.path), "-lm"],
            check=True,
            capture_output=True,
        )
        # Its threads wait without spinning, which would take the processor from the other programs.
        os.environ.setdefault("OMP_WAIT_POLICY", "passive")
        self.functions = ctypes.CDLL(str(self.path))

    def time_runs(self, of: Problem, given: Inputs, substeps: int, repeats: int) -> Sample:
        """Time single runs; return also the solution."""
        numbers, first, samples = (
            list_parameters(of),
            np.array(start(of, given)),
            stack_samples(given),
        )
        columns, events = np.zeros((SAMPLES, 4)), np.zeros(_MOST_EVENTS)
        call = self.functions.shift_sim
        arguments = (
            *(_get_pointer(each) for each in (numbers, first, samples)),
            *(SAMPLES - 1, ctypes.c_double(STEP), substeps),
            *(_get_pointer(columns), _get_pointer(events), _MOST_EVENTS),
        )
        seconds = []
        for _ in range(repeats):
            begin = time.process_time()
            count = call(*arguments)
            seconds.append(time.process_time() - begin)
        return Sample(seconds, Solution(columns.T.copy(), events[:count].copy()))

    def run_batch(
        self, sets: FloatArray, of: Problem, given: Inputs, how: tuple[int, int]
    ) -> FloatArray:
        """Return shaft torques (runs, samples) [N m] of parameter sets (runs, 21).

        `how` is the number of threads and of steps per sample.
        """
        threads, substeps = how
        torques = np.zeros((len(sets), SAMPLES))
        first, samples = np.array(start(of, given)), stack_samples(given)
        self.functions.shift_batch(
            _get_pointer(sets),
            len(sets),
            *(_get_pointer(first), _get_pointer(samples)),
            *(SAMPLES - 1, ctypes.c_double(STEP), substeps),
            *(_get_pointer(torques), threads),
        )
        return torques


@cache
def find_library() -> Library | None:
    """Compile the program once for all; return None if its source is not beside the repository."""
    with tempfile.TemporaryDirectory() as folder:
        return load_library(Path(folder))


def load_library(folder: Path) -> Library | None:
    """Compile the program into `folder`; return None if its source is not beside the repository."""
    return Library(folder) if SOURCE.exists() else None


def make_entries(of: Problem, given: Inputs, judge: Judge, library: Library) -> list[Entry]:
    """Return the program with one and two steps per sample."""

    def make_entry(substeps: int) -> Entry:
        setting = f"RK4, {1.0 / substeps:g} ms, events located"
        return Entry(
            PROGRAM, setting, lambda: library.time_runs(of, given, substeps, _REPEATS), judge
        )

    return [make_entry(1), make_entry(2)]


def list_parameters(of: Problem) -> FloatArray:
    """Return the parameters in the order of the program; pressures in bar."""
    gains = [BAR * gain for gain in of.gain]
    fills = [pressure / BAR for pressure in of.P0]
    return np.array(
        [
            *(of.J_e, of.J_out, of.J_v, of.eta, of.i_in),
            *(of.i_c[0], of.i_out[0], of.i_c[1], of.i_out[1], of.i_f, of.T_v, of.k, of.c),
            *(*gains, *fills, of.mu_s, of.mu_c, of.v_s, of.mu_v),
        ]
    )


def stack_samples(given: Inputs) -> FloatArray:
    """Return the inputs (samples, 3) in the order of the program; pressures in bar."""
    columns = (given.torque, *(pressure / BAR for pressure in given.pressures))
    return np.ascontiguousarray(np.column_stack(columns))


def _get_pointer(array: FloatArray) -> ctypes._Pointer[ctypes.c_double]:
    return array.ctypes.data_as(_Double)
