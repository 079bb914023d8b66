# SPDX-License-Identifier: MIT
"""Effects that the dual-clutch model leaves out, by name, and what a card states of them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from drivetwin.errors import InputError, Where


class EffectId(StrEnum):
    """Names of the effects, in the order in which they are reported.

    An entry of `drivetwin.estimation.likelihood.effects` states everything else about an effect.
    """

    EFFICIENCY_BY_GEAR = "efficiency_by_gear"
    INPUT_DRAG = "input_drag"
    OUTPUT_TORQUE_OFFSET = "output_torque_offset"
    OUTPUT_TORQUE_DRIFT = "output_torque_drift"
    OUTPUT_TORQUE_DELAY = "output_torque_delay"
    SLOW_LOAD = "slow_load"
    AERO_LOAD = "aero_load"
    BRAKE_DRAG = "brake_drag"
    DRUM_INERTIA = "drum_inertia"
    PRESSURE_DELAY = "pressure_delay"
    TORQUE_LAG = "torque_lag"
    INPUT_SHAFT_MODE = "input_shaft_mode"
    TYRE_SLIP = "tyre_slip"
    BACKLASH = "backlash"
    PROGRESSIVE_SHAFT = "progressive_shaft"
    FRICTION_SHAPE = "friction_shape"
    FRICTION_PRESSURE = "friction_pressure"
    FRICTION_HEAT = "friction_heat"
    TORQUE_MAP = "torque_map"
    OUTPUT_TORQUE_CURVE = "output_torque_curve"
    SPEED_RUN_OUT = "speed_run_out"
    OUTPUT_TORQUE_FILTER = "output_torque_filter"


@dataclass(frozen=True)
class EffectPrior:
    """Normal prior of an effect in its unit; `std` 0 states it as known, with `value` 0 as none."""

    std: float
    value: float = 0.0


def parse_sizes(texts: Iterable[str], option: str) -> dict[EffectId, float]:
    """Parse texts `NAME=SIZE`, such as `tyre_slip=0.004`, one for each effect.

    Raises InputError at `option` for another format, and for a repeated or unknown name.
    """
    where = Where(key=option)
    found: dict[EffectId, float] = {}
    for text in texts:
        name, _, size = text.partition("=")
        try:
            value = float(size)
        except ValueError:
            what = f"{text!r} is no effect with a size"
            raise InputError(what, "write NAME=SIZE, as tyre_slip=0.004", where) from None
        if name not in list(EffectId):
            raise InputError(f"no effect {name!r}", f"give any of {', '.join(EffectId)}", where)
        if name in found:
            raise InputError(f"effect {name!r} is stated twice", "state each effect once", where)
        found[EffectId(name)] = value
    return found


def parse_priors(texts: Iterable[str]) -> dict[EffectId, EffectPrior]:
    """Parse `NAME=STD`, one for each effect; raises InputError that lists the names."""
    stds = parse_sizes(texts, "--effect")
    bad = [f"{name}={std:g}" for name, std in stds.items() if not 0.0 <= std < math.inf]
    if bad:
        raise InputError(
            f"{', '.join(bad)} is no effect with a standard deviation",
            "give a finite number from 0 on, as tyre_slip=0.002",
            Where(key="--effect"),
        )
    return {name: EffectPrior(std) for name, std in stds.items()}
