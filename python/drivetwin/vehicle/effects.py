# SPDX-License-Identifier: MIT
"""Effects that the dual-clutch model leaves out, by name, and what a card states of them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from drivetwin.errors import InputError, Where


class EffectId(StrEnum):
    """Departures of a vehicle or a sensor from the dual-clutch model, with the size of each.

    FS is the largest shaft torque, T0 the largest engine torque and L the mean load of the run.
    """

    EFFICIENCY_BY_GEAR = "efficiency_by_gear"
    """Efficiency of each gear less that of the gear before it."""
    INPUT_DRAG = "input_drag"
    """Drag torque at the gearbox input, over T0."""
    OUTPUT_TORQUE_OFFSET = "output_torque_offset"
    """Offset of the output torque sensor, over FS."""
    OUTPUT_TORQUE_DRIFT = "output_torque_drift"
    """Standard deviation of the sensor's random walk after 5 s, over FS; its mean is zero."""
    SLOW_LOAD = "slow_load"
    """Standard deviation of the load's random walk after 1 s, over L; its mean is zero."""
    AERO_LOAD = "aero_load"
    """Share of L that grows with the square of the speed and is reached at the mean speed."""
    DRUM_INERTIA = "drum_inertia"
    """Inertia of each drum that the card does not state [kg m^2]."""
    PRESSURE_DELAY = "pressure_delay"
    """Time by which the acting clutch pressures are later than the logged ones [s]."""
    TORQUE_LAG = "torque_lag"
    """Time constant of the acting engine torque behind the logged one [s]."""
    INPUT_SHAFT_MODE = "input_shaft_mode"
    """Frequency [Hz] of the half of J1 at the engine on its shaft, with the gearbox held."""
    TYRE_SLIP = "tyre_slip"
    """Slip of the driven tyres at FS."""
    BACKLASH = "backlash"
    """Half of the gap of the output shaft times its stiffness, over FS."""
    PROGRESSIVE_SHAFT = "progressive_shaft"
    """Factor a of the output shaft's torque k φ (1 + a ((k φ / FS)² - 1/2))."""
    OUTPUT_TORQUE_DELAY = "output_torque_delay"
    """Age of a fresh sample of the output torque [s]."""
    FRICTION_SHAPE = "friction_shape"
    """Amplitude of a wave of μ, two periods over the slips of the run."""
    FRICTION_PRESSURE = "friction_pressure"
    """Relative rise of μ over the pressures at which an element slips; none at their middle."""
    FRICTION_HEAT = "friction_heat"
    """Relative fall of μ over the friction work of an element in the run without effects."""
    BRAKE_DRAG = "brake_drag"
    """Drag torque at the wheel over L, which the truth of the load does not contain."""


@dataclass(frozen=True)
class EffectPrior:
    """Normal prior of an effect in its unit; `std` 0 states it as known, with `value` 0 as none."""

    std: float
    value: float = 0.0


def parse_sizes(texts: Iterable[str], option: str) -> dict[EffectId, float]:
    """Parse texts `NAME=SIZE`, such as `tyre_slip=0.004`, one for each effect.

    Raises InputError at `option` for another form, and for a repeated or unknown name.
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
