# SPDX-License-Identifier: MIT
"""Plan of a drive: legs with pedal and brake, each ended by a condition and an action."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from drivetwin.drive.powertrain import Control
from drivetwin.errors import InputError
from drivetwin.gearbox import Gearbox, solve_gear


class Watched(StrEnum):
    """Quantity that ends a leg: time in it [s], gearbox input speed [rad/s], converter ratio ν."""

    TIME = "time"
    INPUT_SPEED = "input speed"
    SPEED_RATIO = "speed ratio"


LONGEST_LEG = 240.0
"""Longest leg, s: a condition that is not met by then will hardly be."""


@dataclass(frozen=True)
class Until:
    """A leg ends when `watched` has risen to `value`, or fallen to it.

    Raises InputError for a value that is not finite, or a time that no leg takes.
    """

    watched: Watched
    value: float
    falling: bool = False

    def __post_init__(self) -> None:
        if self.watched is Watched.TIME and not 0.0 < self.value <= LONGEST_LEG:
            raise InputError(
                f"a leg of {self.value:g} s",
                f"give a time above 0 and up to {LONGEST_LEG:g} s, or several legs",
            )
        if not math.isfinite(self.value):
            raise InputError(
                f"a leg until {self.watched} is {self.value:g}", "give a finite number"
            )


@dataclass(frozen=True)
class ShiftTo:
    """Shift to this gear."""

    gear: str


@dataclass(frozen=True)
class LockUp:
    """Close the lock-up clutch, or open it; in a gearbox with dogs, the starting clutch."""

    closed: bool


@dataclass(frozen=True)
class Leg:
    """Pedal (0 to 1) and service brake [N m at the wheel] until a condition; then the action.

    Raises InputError for a pedal or a brake that there is not.
    """

    pedal: float
    until: Until
    then: ShiftTo | LockUp | None = None
    brake: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.pedal <= 1.0:
            raise InputError(f"a pedal at {self.pedal:g}", "give a number from 0 to 1")
        if not 0.0 <= self.brake < math.inf:
            raise InputError(
                f"a service brake of {self.brake:g} N m", "give a finite torque from 0 on"
            )


Plan = tuple[Leg, ...]

LAUNCH_PEDAL = 0.8
_HOLD = 3.0
"""Service brake at standstill over that of a coast-down: more than the creep in first gear."""
_STANDING = 1.0
"""Time at standstill before the launch, s: the engine idles against the converter."""
_KICK_DOWN = 0.6
"""Time at full pedal before the kick-down, s: the engine torque has come up."""
_LIFT = 1.0
"""Time with closed pedal before the up-shift without power, s: the engine torque is gone."""
_CRUISE = 2.0
"""Time between two manoeuvres, s: the shaft oscillation has died away."""


def list_forward_gears(gearbox: Gearbox) -> tuple[str, ...]:
    """Names of the forward gears from low to high."""
    ratios = {gear.name: solve_gear(gearbox, gear.name).ratio for gear in gearbox.gears}
    forward = [name for name, ratio in ratios.items() if ratio > 0.0]
    return tuple(sorted(forward, key=lambda name: -ratios[name]))


def plan_launch(gearbox: Gearbox, control: Control, pedal: float = LAUNCH_PEDAL) -> Plan:
    """From standstill through all gears under power.

    First to second gear with the converter, lock-up in second, the other up-shifts locked up. A
    gearbox with dogs launches on its starting clutch.
    Raises InputError for a gearbox of fewer than three forward gears.
    """
    gears = list_forward_gears(gearbox)
    if len(gears) < 3:
        raise InputError(
            f"{gearbox.name} has {len(gears)} forward gears",
            "choose a gearbox with three or more, or write the plan yourself",
        )
    ready = Until(Watched.INPUT_SPEED, control.upshift)
    away: Plan = (
        Leg(pedal, Until(Watched.INPUT_SPEED, control.launch_upshift), ShiftTo(gears[1])),
        Leg(pedal, Until(Watched.SPEED_RATIO, control.lock_up_ratio), LockUp(closed=True)),
    )
    if gearbox.dogs:
        start = Until(Watched.INPUT_SPEED, control.downshift)
        away = (Leg(pedal, start, LockUp(closed=True)), Leg(pedal, ready, ShiftTo(gears[1])))
    return (
        Leg(0.0, Until(Watched.TIME, _STANDING), brake=_HOLD * control.brake),
        *away,
        *(Leg(pedal, ready, ShiftTo(gear)) for gear in gears[2:]),
        Leg(pedal, Until(Watched.TIME, _CRUISE)),
    )


def plan_coast_down(gearbox: Gearbox, control: Control) -> Plan:
    """From the highest gear down to first, pedal closed, with the service brake.

    The lock-up clutch, or the starting clutch of a gearbox with dogs, opens in second gear.
    """
    gears = list_forward_gears(gearbox)
    low = Until(Watched.INPUT_SPEED, control.downshift, falling=True)
    slow = Until(Watched.INPUT_SPEED, control.release, falling=True)
    slower = Until(Watched.INPUT_SPEED, 0.75 * control.release, falling=True)
    if gearbox.dogs:  # With an open clutch the input is the idling engine.
        slower = Until(Watched.TIME, _LIFT)
    return (
        *(Leg(0.0, low, ShiftTo(gear), control.brake) for gear in gears[-2:0:-1]),
        Leg(0.0, slow, LockUp(closed=False), control.brake),
        Leg(0.0, slower, ShiftTo(gears[0]), control.brake),
        Leg(0.0, Until(Watched.TIME, _CRUISE), brake=control.brake),
    )


def plan_all_shift_kinds(gearbox: Gearbox, control: Control) -> Plan:
    """All four kinds of shift: launch, kick-down, up-shift with closed pedal, coast-down."""
    gears = list_forward_gears(gearbox)
    return (
        *plan_launch(gearbox, control),
        Leg(1.0, Until(Watched.TIME, _KICK_DOWN), ShiftTo(gears[-2])),
        Leg(1.0, Until(Watched.TIME, _LIFT)),
        Leg(0.0, Until(Watched.TIME, _LIFT), ShiftTo(gears[-1])),
        Leg(0.0, Until(Watched.TIME, _CRUISE)),
        *plan_coast_down(gearbox, control),
    )
