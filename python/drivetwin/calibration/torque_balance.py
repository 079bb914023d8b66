# SPDX-License-Identifier: MIT
"""Pressures of the phases of a shift by the static torque balance, where policies start."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin._util.display_units import format_with_unit
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import ShiftElement

INERTIA_TIME = 0.45
"""Starting duration of the inertia phase [s]."""
REDUCTION = 0.15
"""Starting depth of the torque reduction, over the engine torque."""
_LOCK_PRESSURE = 1.3
"""Starting pressure at the end of the inertia phase, over that in its middle."""
_LEAST_KEPT = 0.2
"""Least starting torque of a slipping off-going element, over the engine torque."""
_LONGEST_INERTIA_TIME = 0.7
"""Longest starting duration of an inertia phase that the engine itself drives [s]."""
_HOLD_MARGIN = 1.25
"""Starting pressure of the off-going element before its release, over what carries the torque."""


@dataclass(frozen=True)
class PhasePressures:
    """Pressures [Pa]: on-coming at hand-over, in the middle and at the end of the inertia phase.

    `hold` is that of the off-going element before its release, `system` that of a held element.
    """

    handover: float
    inertia: float
    sync: float
    hold: float
    system: float


def estimate_pressures(maneuver: Maneuver, system_pressure: float) -> PhasePressures:
    """Estimate the pressures of a shift.

    At hand-over the on-coming element carries the engine torque alone; in the inertia phase also
    the torque that changes the engine speed within 0.45 s. Raises InputError where
    `system_pressure` [Pa] cannot carry the engine torque.
    """
    old, new = maneuver.offgoing, maneuver.oncoming
    handover = _compute_pressure(new, _compute_handover_torque(maneuver))
    inertia = _compute_pressure(new, _compute_inertia_torque(maneuver))
    hold = _compute_pressure(old, _HOLD_MARGIN * _compute_held_torque(maneuver, old))
    _require_pressure({new.name: max(handover, inertia), old.name: hold}, system_pressure)
    sync = min(_LOCK_PRESSURE * inertia, 0.5 * (inertia + system_pressure))
    return PhasePressures(handover, inertia, sync, hold, system_pressure)


@dataclass(frozen=True)
class SlipPressures:
    """Pressures [Pa] of a shift whose inertia phase comes first.

    `held` is that at which the off-going element begins to slip, `inertia` its pressure while the
    engine speed changes. `assist` is that of the on-coming element meanwhile, which gives the
    torque that the engine itself lacks; `handover` is its pressure in the new gear, `system` that
    of a held element. `time` [s] is the duration of the inertia phase.
    """

    held: float
    inertia: float
    assist: float
    handover: float
    time: float
    system: float


def estimate_slip_pressures(maneuver: Maneuver, system_pressure: float) -> SlipPressures:
    """Estimate the pressures of a shift whose inertia phase comes first.

    The slipping off-going element leaves the engine the torque that changes its speed within
    0.45 s, or as long as that takes with a fifth of the engine torque kept. The on-coming element
    helps where this is more than 0.7 s. Raises InputError where `system_pressure` [Pa] cannot carry
    the engine torque.
    """
    old, new = maneuver.offgoing, maneuver.oncoming
    held = _compute_pressure(old, _compute_held_torque(maneuver, old))
    slipping, missing = _split_engine_torque(maneuver)
    inertia = _compute_pressure(old, slipping)
    assist = _compute_pressure(new, missing)
    handover = _compute_pressure(new, _compute_held_torque(maneuver, new))
    needed = {old.name: max(held, inertia), new.name: max(assist, handover)}
    _require_pressure(needed, system_pressure)
    time = _choose_inertia_time(maneuver)
    return SlipPressures(held, inertia, assist, handover, time, system_pressure)


def _require_pressure(needed: Mapping[str, float], system_pressure: float) -> None:
    """Raise InputError where an element needs more than `system_pressure` [Pa]."""
    for name, pressure in needed.items():
        if pressure >= system_pressure:
            raise InputError(
                f"{name} needs {format_with_unit(pressure, 'Pa', digits=3)} in this shift, the "
                f"system pressure is {format_with_unit(system_pressure, 'Pa', digits=3)}",
                "give a smaller engine torque or engine speed, or a larger system pressure",
            )


def _compute_engine_inertia(maneuver: Maneuver) -> float:
    model = maneuver.model
    return model.J1 * model.eta + model.J2e


def _compute_held_torque(maneuver: Maneuver, element: ShiftElement) -> float:
    """Torque [N m] of an element in steady acceleration in its gear."""
    ratio = maneuver.model.get_overall_ratio(element.name)
    torque = maneuver.point.engine_torque
    rate = ratio * maneuver.compute_acceleration(torque, ratio)
    free = maneuver.model.eta * torque - _compute_engine_inertia(maneuver) * rate
    return abs(free * maneuver.model.i_in * element.i_c)


def _compute_handover_torque(maneuver: Maneuver) -> float:
    """Torque [N m] with which the on-coming element alone holds the engine in the old gear."""
    old, new = maneuver.offgoing, maneuver.oncoming
    return _compute_held_torque(maneuver, old) * abs(new.i_c / old.i_c)


def _choose_inertia_time(maneuver: Maneuver) -> float:
    """Choose the starting duration of an inertia phase that the engine itself drives [s]."""
    old, new = maneuver.ratios
    driving = maneuver.model.eta * maneuver.point.engine_torque
    change = maneuver.point.engine_speed * (new / old - 1.0)
    own = _compute_engine_inertia(maneuver) * change / ((1.0 - _LEAST_KEPT) * driving)
    return min(max(own, INERTIA_TIME), _LONGEST_INERTIA_TIME)


def _split_engine_torque(maneuver: Maneuver) -> tuple[float, float]:
    """Torques [N m] of the off-going and on-coming element that give the engine its acceleration.

    The off-going element takes what the engine has too much, at least a share of the engine torque;
    the on-coming element adds what the engine then lacks.
    """
    old, new = maneuver.ratios
    model, driving = maneuver.model, maneuver.model.eta * maneuver.point.engine_torque
    change = maneuver.point.engine_speed * (new / old - 1.0)
    time = _choose_inertia_time(maneuver)
    free = driving - _compute_engine_inertia(maneuver) * change / time
    surplus = free * math.copysign(1.0, driving)
    kept = max(surplus, _LEAST_KEPT * abs(driving))
    slipping = kept * abs(model.i_in * maneuver.offgoing.i_c)
    return slipping, (kept - surplus) * abs(model.i_in * maneuver.oncoming.i_c)


def _compute_inertia_torque(maneuver: Maneuver) -> float:
    """Torque [N m] of the on-coming element that synchronises the engine in the starting time."""
    old, new = maneuver.ratios
    torque, speed = maneuver.point.engine_torque, maneuver.point.engine_speed
    change = speed * (new / old - 1.0)
    reduced = torque + maneuver.direction * REDUCTION * abs(torque)
    rate = _compute_engine_inertia(maneuver) * change / INERTIA_TIME
    free = maneuver.model.eta * reduced - rate
    return abs(free * maneuver.model.i_in * maneuver.oncoming.i_c)


def _compute_pressure(element: ShiftElement, torque: float) -> float:
    """Pressure [Pa] at which a slipping element carries a torque [N m] of either sign."""
    friction = float(element.friction.evaluate(np.array([20.0]))[0])
    return element.P0 + abs(torque) / (friction * element.gain)
