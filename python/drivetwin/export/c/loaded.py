# SPDX-License-Identifier: MIT
"""The exported C, compiled and loaded: software in the loop from Python."""

from __future__ import annotations

import ctypes
import tempfile
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.driveline import FloatArray
from drivetwin.export.c.write import write_c
from drivetwin.export.compiler import compile_library
from drivetwin.export.subject import Subject

CLUTCHES, ROWS, GUARDS, STATES, POINTS = 2, 3, 4, 4, 64
STATUS = (
    "completed",
    "bad parameter",
    "bad state or input",
    "too many events in one step",
    "no friction mode fits",
    "engine stalled",
)
"""Texts of `dt_status` in its order."""


class Precision(Enum):
    """Number type of the compiled model."""

    DOUBLE = ctypes.c_double
    FLOAT = ctypes.c_float


@dataclass(frozen=True)
class Layout:
    """The structures of `dt_model.h` for one number type."""

    inputs: Any
    state: Any
    outputs: Any
    start: Any
    params: Any


def layout_of(precision: Precision) -> Layout:
    """Structures of `dt_model.h` as ctypes sees them."""
    real, integer = precision.value, ctypes.c_int

    def structure(name: str, **fields: Any) -> Any:
        return type(name, (ctypes.Structure,), {"_fields_": list(fields.items())})

    inputs = structure("Inputs", engine_torque=real, pressure=real * CLUTCHES)
    friction = structure(
        "Friction",
        **dict.fromkeys(("mu_c", "mu_s", "v_s", "mu_v"), real),
        points=integer,
        slip=real * POINTS,
        mu=real * POINTS,
    )
    clutch = structure(
        "Clutch",
        **dict.fromkeys(("i_c", "i_out", "gain", "P0", "peak", "drum_inertia"), real),
        friction=friction,
    )
    scalars = ("J1", "J2e", "eta", "i_in", "J_out", "i_f", "J_v", "k_o", "c_o")
    loads = ("load_constant", "load_rolling", "load_aero")
    return Layout(
        inputs=inputs,
        state=structure(
            "State",
            x=real * STATES,
            carry=real * STATES,
            mode=integer * ROWS,
            released=integer * GUARDS,
            cell=integer * CLUTCHES,
            power_backward=integer,
            wheel_backward=integer,
            inputs=inputs,
        ),
        outputs=structure(
            "Outputs",
            **dict.fromkeys(
                ("engine_speed", "output_speed", "wheel_speed", "twist", "output_torque"), real
            ),
            clutch_torque=real * CLUTCHES,
            slip=real * CLUTCHES,
            mode=integer * CLUTCHES,
            pieces=integer,
        ),
        start=structure(
            "Start",
            **dict.fromkeys(("engine_speed", "output_speed", "wheel_speed", "twist"), real),
            locked=integer,
        ),
        params=structure(
            "Params",
            **dict.fromkeys((*scalars, *loads), real),
            loss_law=integer,
            clutch=clutch * CLUTCHES,
        ),
    )


COLUMNS = (
    *("engine_speed", "output_speed", "wheel_speed", "twist", "output_torque"),
    *("clutch_torque_1", "clutch_torque_2", "slip_1", "slip_2", "mode_1", "mode_2", "pieces"),
)
"""What a run returns, in order."""


@dataclass(frozen=True)
class CRun:
    """Columns (n,) by name on the time grid, SI; NaN from the failure on where one ended it."""

    columns: dict[str, FloatArray]
    status: str


class CModel:
    """The C model of a twin as a loaded library; needs a C compiler.

    `library` and `layout` are open to callers that step it themselves. Raises CompilerError.
    """

    def __init__(self, subject: Subject, precision: Precision = Precision.DOUBLE) -> None:
        self.layout = layout_of(precision)
        defines = ["DT_FLOAT"] if precision is Precision.FLOAT else []
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            paths = write_c(subject, Path(folder))
            sources = [p for p in paths if p.suffix == ".c" and p.name != "dt_run.c"]
            target = Path(folder) / "libtwin.so"
            compile_library(sources, target, None, defines)
            self.library = ctypes.CDLL(str(target))
        self.library.dt_step.argtypes = [
            *(ctypes.c_void_p,) * 4,
            precision.value,
            ctypes.c_void_p,
        ]
        self.params = self.layout.params.in_dll(self.library, "dt_twin_params")
        self.start = self.layout.start.in_dll(self.library, "dt_twin_start")

    def run(self, time: FloatArray, inputs: FloatArray, *, hold: bool = False) -> CRun:
        """Step over `time` (n,) [s]; `inputs` (n, 3): engine torque [N m], two pressures [Pa].

        Inputs are linear between rows, or held. The first row of the result is the start.
        """
        state, outputs = self.layout.state(), self.layout.outputs()
        rows = [self._inputs(row) for row in inputs]
        table = np.full((len(time), len(COLUMNS)), np.nan)
        status = self.library.dt_begin(
            *map(ctypes.byref, (state, self.params, self.start, rows[0], outputs))
        )
        table[0] = _row(outputs)
        for i in range(1, len(time)):
            if status != 0:
                break
            ends = (rows[i - 1], rows[i - 1] if hold else rows[i])
            status = self.library.dt_step(
                *map(ctypes.byref, (state, self.params, *ends)),
                float(time[i] - time[i - 1]),
                ctypes.byref(outputs),
            )
            if status == 0:
                table[i] = _row(outputs)
        columns = dict(zip(COLUMNS, np.ascontiguousarray(table.T), strict=True))
        return CRun(columns, STATUS[status])

    def _inputs(self, row: FloatArray) -> Any:
        return self.layout.inputs(float(row[0]), tuple(map(float, row[1:])))


def _row(y: Any) -> list[float]:
    speeds = [y.engine_speed, y.output_speed, y.wheel_speed, y.twist, y.output_torque]
    return [*speeds, *y.clutch_torque, *y.slip, *y.mode, y.pieces]
