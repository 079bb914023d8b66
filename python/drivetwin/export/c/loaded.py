# SPDX-License-Identifier: MIT
"""The exported C, compiled and loaded: software in the loop from Python."""

from __future__ import annotations

import ctypes
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from drivetwin.errors import InputError
from drivetwin.export.c import read_model_sources, write_c
from drivetwin.export.compiler import compile_library
from drivetwin.export.entries import Subject
from drivetwin.simulation.dual_clutch import FloatArray

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


STATUS = (
    "completed",
    "bad parameter",
    "bad state or input",
    "too many events in one step",
    "no friction mode fits",
    "engine stalled",
)
"""Texts of `dt_status` in its order."""

COLUMNS = (
    *("engine_speed", "output_speed", "wheel_speed", "twist", "output_torque"),
    *("clutch_torque_1", "clutch_torque_2", "slip_1", "slip_2", "mode_1", "mode_2", "pieces"),
)
"""Columns of a run, in order."""


@dataclass(frozen=True, eq=False)
class CRun:
    """Columns (n,) by name on the time grid, SI; NaN from the failure on where one ended it."""

    columns: dict[str, FloatArray]
    status: str


class CModel:
    """The C model of a twin as a loaded library; needs a C compiler.

    `params` and `start` may be changed between runs. Raises CompilerError.
    """

    def __init__(self, subject: Subject, precision: Precision = Precision.DOUBLE) -> None:
        self.layout = read_layout(precision)
        defines = ["DT_FLOAT"] if precision is Precision.FLOAT else []
        # The folder of a library that is still loaded cannot be removed on Windows.
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            paths = write_c(subject, Path(folder))
            sources = [p for p in paths if p.suffix == ".c" and p.name != "dt_run.c"]
            target = Path(folder) / "libtwin.so"
            compile_library(sources, target, None, defines)
            self.library = ctypes.CDLL(str(target))
        pointer, real = ctypes.c_void_p, precision.value
        self.library.dt_step.argtypes = [*(pointer,) * 4, real, pointer]
        self.library.dt_step_delayed.argtypes = [*(pointer,) * 5, real, pointer]
        self.library.dt_observe.argtypes = [*(pointer,) * 4, real, pointer]
        layout = self.layout
        self.library.dt_usual_tuning.restype = layout.tuning
        fixed = layout.params.in_dll(self.library, "dt_twin_params")
        self.params = layout.params.from_buffer_copy(fixed)
        start = layout.start.in_dll(self.library, "dt_twin_start")
        self.start = layout.start.from_buffer_copy(start)
        self._delays = layout.delays.in_dll(self.library, "dt_twin_delays")

    def run(self, time: FloatArray, inputs: FloatArray, *, hold: bool = False) -> CRun:
        """Step over `time` (n,) [s]; `inputs` (n, 3): engine torque [N m], two pressures [Pa].

        Inputs are linear between rows, or held. The first row of the result is the start.
        """
        state, line, outputs = self.layout.state(), self.layout.line(), self.layout.outputs()
        rows = [self.to_c_inputs(row) for row in inputs]
        table = np.full((len(time), len(COLUMNS)), np.nan)
        status = self.library.dt_begin(
            *map(ctypes.byref, (state, self.params, self.start, rows[0], outputs))
        )
        if status == 0:
            table[0] = _to_row(outputs)
        self.library.dt_line_begin(*map(ctypes.byref, (line, self._delays, rows[0])))
        for i in range(1, len(time)):
            if status != 0:
                break
            ends = (rows[i - 1], rows[i - 1] if hold else rows[i])
            status = self.library.dt_step_delayed(
                *map(ctypes.byref, (state, line, self.params, *ends)),
                float(time[i] - time[i - 1]),
                ctypes.byref(outputs),
            )
            if status == 0:
                table[i] = _to_row(outputs)
        columns = dict(zip(COLUMNS, np.ascontiguousarray(table.T), strict=True))
        return CRun(columns, STATUS[status])

    def to_c_inputs(self, row: Sequence[float] | FloatArray) -> Any:
        """Engine torque [N m] and two pressures [Pa] as the C structure."""
        return self.layout.inputs(float(row[0]), tuple(map(float, row[1:])))


def _to_row(y: Any) -> list[float]:
    speeds = [y.engine_speed, y.output_speed, y.wheel_speed, y.twist, y.output_torque]
    return [*speeds, *y.clutch_torque, *y.slip, *y.mode, y.pieces]


@dataclass(frozen=True)
class Estimates:
    """Estimates of the observer at one instant, SI; pairs are off-going, on-coming element."""

    output_torque: float
    output_torque_std: float
    clutch_torque: tuple[float, ...]
    scale: tuple[float, ...]
    scale_std: tuple[float, ...]
    load: float
    load_std: float
    slip: tuple[float, ...]
    locked: int


class CObserver:
    """The observer of a loaded model, started at measured speeds [rad/s].

    `tuning` may be changed between calls.
    """

    def __init__(self, model: CModel, inputs: Sequence[float], speeds: tuple[float, float]) -> None:
        self._model = model
        self.tuning = model.library.dt_usual_tuning()
        self._memory = model.layout.observer()
        now = self._to_measured(inputs, speeds)
        model.library.dt_observer_begin(*map(ctypes.byref, (self._memory, model.params, now)))

    def restart_observer(self, inputs: Sequence[float], speeds: tuple[float, float]) -> None:
        """Start anew at measured speeds, with friction and load as known so far."""
        now = self._to_measured(inputs, speeds)
        library, params = self._model.library, self._model.params
        library.dt_observer_resume(*map(ctypes.byref, (self._memory, params, now)))

    def update_estimates(
        self, inputs: Sequence[float], speeds: tuple[float, float], step: float
    ) -> Estimates:
        """Take in speeds of engine and output [rad/s], and inputs since the last call.

        `step` [s] has passed since then. Raises InputError for what is not finite or not in range.
        """
        estimates = self._model.layout.estimates()
        now = self._to_measured(inputs, speeds)
        status = self._model.library.dt_observe(
            *map(ctypes.byref, (self._memory, self._model.params, self.tuning, now)),
            step,
            ctypes.byref(estimates),
        )
        if status != 0:
            raise InputError(
                f"the observer refuses its inputs: {STATUS[status]}",
                "give finite values at least every 32 ms",
            )
        return Estimates(
            output_torque=estimates.output_torque,
            output_torque_std=estimates.output_torque_std,
            clutch_torque=tuple(estimates.clutch_torque),
            scale=tuple(estimates.scale),
            scale_std=tuple(estimates.scale_std),
            load=estimates.load,
            load_std=estimates.load_std,
            slip=tuple(estimates.slip),
            locked=estimates.locked,
        )

    def _to_measured(self, inputs: Sequence[float], speeds: tuple[float, float]) -> Any:
        return self._model.layout.measured(self._model.to_c_inputs(inputs), *map(float, speeds))
