# SPDX-License-Identifier: MIT
"""Plan of the shifts of a drive, and what the driver requests over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin.gearbox import Drive, Reduction
from drivetwin.gearbox.spec import Capacity
from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.vehicle.shift_kind import ShiftKind

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
