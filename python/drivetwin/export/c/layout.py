# SPDX-License-Identifier: MIT
"""The structures of `dt_model.h` and `dt_observer.h` as ctypes sees them."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from enum import Enum
from typing import Any

CLUTCHES, ROWS, GUARDS, STATES, POINTS, OBSERVED = 2, 3, 4, 4, 64, 8


class Precision(Enum):
    """Number type of the compiled model."""

    DOUBLE = ctypes.c_double
    FLOAT = ctypes.c_float


@dataclass(frozen=True)
class Layout:
    """The structures for one number type, each a ctypes class."""

    inputs: Any
    state: Any
    outputs: Any
    start: Any
    params: Any
    tuning: Any
    observer: Any
    measured: Any
    estimates: Any


def layout_of(precision: Precision) -> Layout:
    """All structures, fields in the order of the headers."""
    real, integer = precision.value, ctypes.c_int
    both = real * CLUTCHES

    def structure(name: str, **fields: Any) -> Any:
        return type(name, (ctypes.Structure,), {"_fields_": list(fields.items())})

    def reals(*names: str) -> dict[str, Any]:
        return dict.fromkeys(names, real)

    inputs = structure("Inputs", engine_torque=real, pressure=both)
    speeds = reals("engine_speed", "output_speed", "wheel_speed", "twist")
    friction = structure(
        "Friction",
        **reals("mu_c", "mu_s", "v_s", "mu_v"),
        points=integer,
        slip=real * POINTS,
        mu=real * POINTS,
    )
    clutch = structure(
        "Clutch",
        **reals("i_c", "i_out", "gain", "P0", "peak", "drum_inertia"),
        friction=friction,
    )
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
            **speeds,
            output_torque=real,
            clutch_torque=both,
            slip=both,
            mode=integer * CLUTCHES,
            pieces=integer,
        ),
        start=structure("Start", **speeds, locked=integer),
        params=structure(
            "Params",
            **reals("J1", "J2e", "eta", "i_in", "J_out", "i_f", "J_v", "k_o", "c_o"),
            **reals("load_constant", "load_rolling", "load_aero"),
            loss_law=integer,
            clutch=clutch * CLUTCHES,
        ),
        tuning=structure(
            "Tuning",
            **reals("engine_speed", "output_speed", "engine_torque"),
            **reals("held_torque", "scale", "load", "locked_slip"),
        ),
        observer=structure(
            "Observer", x=real * OBSERVED, P=real * OBSERVED * OBSERVED, locked=integer
        ),
        measured=structure("Measured", inputs=inputs, **reals("engine_speed", "output_speed")),
        estimates=structure(
            "Estimates",
            **reals("output_torque", "output_torque_std"),
            clutch_torque=both,
            scale=both,
            scale_std=both,
            **reals("load", "load_std"),
            slip=both,
            locked=integer,
        ),
    )
