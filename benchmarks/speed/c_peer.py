# SPDX-License-Identifier: MIT
"""Hand-written C for just this problem: fourth-order Runge-Kutta with located events.

The program is not part of this repository; it is compiled where it lies beside it.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import time
from pathlib import Path

import numpy as np

from benchmarks.speed.measure import Entry, Judge, Sample, Skipped
from benchmarks.speed.statement import BAR, SAMPLES, STEP, Inputs, Problem, Solution, start
from drivetwin.driveline import FloatArray

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
        self._library = ctypes.CDLL(str(self.path))

    def seconds(self, of: Problem, given: Inputs, substeps: int, repeats: int) -> Sample:
        """Times of single runs, and the solution."""
        numbers, first, samples = parameters(of), np.array(start(of, given)), samples_of(given)
        columns, events = np.zeros((SAMPLES, 4)), np.zeros(_MOST_EVENTS)
        call = self._library.shift_sim
        arguments = (
            *(_pointer(each) for each in (numbers, first, samples)),
            *(SAMPLES - 1, ctypes.c_double(STEP), substeps),
            *(_pointer(columns), _pointer(events), _MOST_EVENTS),
        )
        seconds = []
        for _ in range(repeats):
            begin = time.perf_counter()
            count = call(*arguments)
            seconds.append(time.perf_counter() - begin)
        return Sample(seconds, Solution(columns.T.copy(), events[:count].copy()))

    def batch(
        self, sets: FloatArray, of: Problem, given: Inputs, how: tuple[int, int]
    ) -> FloatArray:
        """Shaft torques (runs, samples) [N m] of parameter sets (runs, 21).

        `how` is the number of threads and of steps per sample.
        """
        threads, substeps = how
        torques = np.zeros((len(sets), SAMPLES))
        first, samples = np.array(start(of, given)), samples_of(given)
        self._library.shift_batch(
            _pointer(sets),
            len(sets),
            *(_pointer(first), _pointer(samples)),
            *(SAMPLES - 1, ctypes.c_double(STEP), substeps),
            *(_pointer(torques), threads),
        )
        return torques


def entries(of: Problem, given: Inputs, judge: Judge, folder: Path) -> list[Entry] | Skipped:
    """The program with one and two steps per sample."""
    if not SOURCE.exists():
        return Skipped(PROGRAM, f"{SOURCE.name} is not beside the repository")
    try:
        library = Library(folder)
    except (subprocess.CalledProcessError, FileNotFoundError) as fault:
        return Skipped(PROGRAM, f"it does not compile: {fault}")

    def entry(substeps: int) -> Entry:
        setting = f"RK4, {1.0 / substeps:g} ms, events located"
        return Entry(
            PROGRAM, setting, lambda: library.seconds(of, given, substeps, _REPEATS), judge
        )

    return [entry(1), entry(2)]


def parameters(of: Problem) -> FloatArray:
    """The program's parameters in its order; pressures in bar."""
    gains = [BAR * gain for gain in of.gain]
    fills = [pressure / BAR for pressure in of.P0]
    return np.array(
        [
            *(of.J_e, of.J_out, of.J_v, of.eta, of.i_in),
            *(of.i_c[0], of.i_out[0], of.i_c[1], of.i_out[1], of.i_f, of.T_v, of.k, of.c),
            *(*gains, *fills, of.mu_s, of.mu_c, of.v_s, of.mu_v),
        ]
    )


def samples_of(given: Inputs) -> FloatArray:
    """Inputs (samples, 3) as the program takes them; pressures in bar."""
    columns = (given.torque, *(pressure / BAR for pressure in given.pressures))
    return np.ascontiguousarray(np.column_stack(columns))


def _pointer(array: FloatArray) -> ctypes._Pointer[ctypes.c_double]:
    return array.ctypes.data_as(_Double)
