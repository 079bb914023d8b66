# SPDX-License-Identifier: MIT
"""Plan of a drive: legs with pedal and brake, and its shifts with the requests over time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from drivetwin.drive.powertrain import Control
from drivetwin.errors import InputError
from drivetwin.gearbox import Drive, Gearbox, Reduction, solve_gear
from drivetwin.gearbox.spec import Capacity
from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.vehicle.spec import ShiftKind


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


Knots = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Schedule:
    """Inputs by name, each linear between its knots (time [s], value SI), constant afterwards."""

    knots: Mapping[str, Knots]

    def add_knots(self, name: str, start: float, *points: tuple[float, float]) -> Schedule:
        """Keep an input until `start` [s], then lead it through `points` (time after start, value).

        What was decided beyond `start` is replaced: the input leaves from where it is then.
        """
        old = self.knots[name]
        here = float(np.interp(start, *np.transpose(old)))
        kept = tuple(knot for knot in old if knot[0] < start)
        new = tuple((start + after, value) for after, value in points)
        return Schedule({**self.knots, name: (*kept, (start, here), *new)})

    def evaluate(self, name: str, time: FloatArray) -> FloatArray:
        """Values (n,) of an input at `time` (n,) [s]."""
        knots, values = np.transpose(self.knots[name])
        return np.asarray(np.interp(time, knots, values), dtype=np.float64)

    def to_signals(self, end: float) -> dict[str, Signal]:
        """Return all inputs from 0 to `end` [s]."""
        found = {}
        for name, knots in self.knots.items():
            inside = [knot for knot in knots if knot[0] < end]
            last = float(np.interp(end, *np.transpose(knots)))
            time, values = np.transpose([*inside, (end, last)])
            found[name] = Signal(np.ascontiguousarray(time), np.ascontiguousarray(values))
        return found


FILL = 0.12
"""Time to fill the on-coming element, while the off-going one falls to what it has to hold, s."""
RAMP = 0.05
"""Time in which a pressure goes to the level of the inertia phase or from it, s."""
FORCE = 1.0
"""Time after the planned inertia phase in which the speed change is forced to its end, s."""
CLOSE = 0.20
"""Time from there to main pressure, s."""
FAST, SLOW = 1.3, 0.5
"""Pace of the speed change at the begin and at the end of the inertia phase, over its mean."""
MARGIN = 1.2
"""Capacity of the off-going element before the torque phase, over the torque it holds."""
OPEN = 0.0
"""Pressure of an open element, Pa."""


@dataclass(frozen=True)
class ShiftPlan:
    """One shift as it is decided at `start` [s].

    `held` is the torque that the old gear carries, `torque` what drives the input while its speed
    changes, both at the input [N m]; `swing` is the speed change to the new gear, `slip` the
    on-coming element's, without sign [rad/s]; `inertia` is what the swing accelerates [kg m^2],
    `main` the pressure of a closed element [Pa].
    """

    reduction: Reduction
    drive: Drive
    start: float
    held: float
    torque: float
    swing: float
    slip: float
    inertia: float
    main: float

    @property
    def kind(self) -> ShiftKind:
        """Kind of the shift."""
        return ShiftKind.from_direction(up=self.swing < 0.0, power_on=self.torque > 0.0)

    @property
    def torque_first(self) -> bool:
        """True if the on-coming element takes the torque before the speed changes."""
        return self.kind.has_torque_phase_first

    @property
    def filled(self) -> float:
        """Time at which the on-coming element is filled [s]."""
        return self.start + FILL

    def add_opening(self, schedule: Schedule) -> Schedule:
        """Add the pressures up to the inertia phase, which they keep."""
        old, new = self.reduction.off_going, self.reduction.on_coming
        off, on = self._get_capacities()
        hold = min(compute_pressure(off, MARGIN * abs(self.held) * old.i_c, 0.0), self.main)
        schedule = schedule.add_knots(old.element, self.start, (FILL, hold))
        schedule = schedule.add_knots(new.element, self.start, (FILL, on.P0))
        if self.torque_first:
            phase = self.drive.torque_phase
            handed = compute_pressure(on, abs(self.held) * new.i_c, self.slip)
            schedule = schedule.add_knots(
                old.element, self.filled, (phase, off.P0), (phase + RAMP, OPEN)
            )
            pulling = self._plan_inertia_phase(phase)
            return schedule.add_knots(new.element, self.filled, (phase, handed), *pulling)
        taken = self._compute_input_torque(1.0)
        if taken * self.torque > 0.0:
            kept = compute_pressure(off, abs(taken) * old.i_c, 0.0)
            late = RAMP + self.drive.inertia_phase
            return schedule.add_knots(
                old.element, self.filled, (RAMP, kept), (late, kept), (late + FORCE, OPEN)
            )
        schedule = schedule.add_knots(old.element, self.filled, (RAMP, OPEN))
        return schedule.add_knots(new.element, self.filled, *self._plan_inertia_phase(0.0))

    def _compute_input_torque(self, pace: float) -> float:
        """Torque of both elements on the input [N m]; `pace` is relative to the mean swing rate."""
        return self.torque - pace * self.inertia * self.swing / self.drive.inertia_phase

    def _plan_inertia_phase(self, after: float) -> Knots:
        """Pressures of the on-coming element that bring the input to the new gear.

        They start `after` the fill [s]. The pace falls from FAST to SLOW, so that the torque jumps
        less when the element locks. An element that is late is forced.
        """
        _, on = self._get_capacities()
        i_c, phase = self.reduction.on_coming.i_c, self.drive.inertia_phase
        first = compute_pressure(on, abs(self._compute_input_torque(FAST)) * i_c, self.slip)
        last = compute_pressure(on, abs(self._compute_input_torque(SLOW)) * i_c, 0.0)
        late = after + RAMP + phase
        return (after + RAMP, first), (late, last), (late + FORCE, max(self.main, last))

    def close(self, schedule: Schedule, synchronous: float) -> Schedule:
        """Add what follows the time at which the input has the speed of the new gear [s]."""
        old, new = self.reduction.off_going, self.reduction.on_coming
        _, on = self._get_capacities()
        enough = compute_pressure(on, MARGIN * abs(self.torque) * new.i_c, 0.0)
        enough = max(enough, float(schedule.evaluate(new.element, np.array([synchronous]))[0]))
        schedule = schedule.add_knots(old.element, synchronous, (RAMP, OPEN))
        closing = ((RAMP, enough), (RAMP + CLOSE, self.main))
        return schedule.add_knots(new.element, synchronous, *closing)

    def _get_capacities(self) -> tuple[Capacity, Capacity]:
        box = self.reduction.gearbox
        names = (self.reduction.off_going.element, self.reduction.on_coming.element)
        return box.get_capacity(names[0]), box.get_capacity(names[1])


def compute_pressure(capacity: Capacity, torque: float, slip: float) -> float:
    """Pressure [Pa] at which an element transmits `torque` [N m] at `slip` [rad/s], both >= 0."""
    mu = float(capacity.friction.evaluate(np.array([slip]))[0])
    return capacity.P0 + torque / (mu * capacity.gain)
