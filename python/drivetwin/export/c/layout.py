# SPDX-License-Identifier: MIT
"""The structures of `dt_model.h` and `dt_observer.h` as ctypes sees them."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from enum import Enum
from typing import Any

CLUTCHES, ROWS, GUARDS, STATES, POINTS, OBSERVED = 2, 3, 4, 4, 64, 7


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


def build_layout(precision: Precision) -> Layout:
    """All structures, fields in the order of the headers."""
    real, integer = precision.value, ctypes.c_int
    both = real * CLUTCHES
    speeds = _make_alike(real, "engine_speed", "output_speed", "wheel_speed", "twist")
    inputs = _build_structure("Inputs", engine_torque=real, pressure=both)
    return Layout(
        inputs=inputs,
        state=_build_structure(
            "State",
            x=real * STATES,
            carry=real * STATES,
            mode=integer * ROWS,
            released=integer * GUARDS,
            cell=integer * CLUTCHES,
            power_backward=integer,
            wheel_backward=integer,
            inputs=inputs,
            params=ctypes.c_uint64,
        ),
        outputs=_build_structure(
            "Outputs",
            **speeds,
            output_torque=real,
            clutch_torque=both,
            slip=both,
            mode=integer * CLUTCHES,
            pieces=integer,
        ),
        start=_build_structure("Start", **speeds, locked=integer),
        params=_build_params(real),
        tuning=_build_structure(
            "Tuning",
            **_make_alike(real, "engine_speed", "output_speed", "engine_torque"),
            **_make_alike(real, "scale", "load", "locked_slip"),
        ),
        observer=_build_structure(
            "Observer",
            x=real * OBSERVED,
            P=real * OBSERVED * OBSERVED,
            locked=integer,
            learning=integer,
        ),
        measured=_build_structure(
            "Measured", inputs=inputs, **_make_alike(real, "engine_speed", "output_speed")
        ),
        estimates=_build_structure(
            "Estimates",
            **_make_alike(real, "output_torque", "output_torque_std"),
            **_make_alike(both, "clutch_torque", "scale", "scale_std"),
            **_make_alike(real, "load", "load_std"),
            slip=both,
            locked=integer,
        ),
    )


def _build_params(real: Any) -> Any:
    friction = _build_structure(
        "Friction",
        **_make_alike(real, "mu_c", "mu_s", "v_s", "mu_v"),
        points=ctypes.c_int,
        slip=real * POINTS,
        mu=real * POINTS,
    )
    clutch = _build_structure(
        "Clutch",
        **_make_alike(real, "i_c", "i_out", "gain", "P0", "peak", "drum_inertia"),
        friction=friction,
    )
    return _build_structure(
        "Params",
        **_make_alike(real, "J1", "J2e", "eta", "i_in", "J_out", "i_f", "J_v", "k_o", "c_o"),
        **_make_alike(real, "load_constant", "load_rolling", "load_aero"),
        loss_law=ctypes.c_int,
        clutch=clutch * CLUTCHES,
    )


def _build_structure(name: str, **fields: Any) -> Any:
    return type(name, (ctypes.Structure,), {"_fields_": list(fields.items())})


def _make_alike(kind: Any, *names: str) -> dict[str, Any]:
    return dict.fromkeys(names, kind)
