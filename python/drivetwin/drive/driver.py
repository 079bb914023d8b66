# SPDX-License-Identifier: MIT
"""A drive: the driver's plan and a simple shift controller over the whole driveline.

The controller decides at instants (a threshold reached, synchronism reached) from the motion up to
there. Each decision runs the drive again from standstill with the inputs decided so far: what has
been does not change, since the last value of every input holds until the next decision. The last
run is the drive: one simulation without a seam, with one energy audit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from drivetwin.drive.plan import (
    CLOSE,
    FILL,
    LONGEST_LEG,
    OPEN,
    RAMP,
    Knots,
    Leg,
    LockUp,
    Schedule,
    ShiftPlan,
    ShiftTo,
    Watched,
    compute_pressure,
    list_forward_gears,
)
from drivetwin.drive.powertrain import Powertrain
from drivetwin.drive.result import (
    BRAKE,
    LOCK_UP,
    PEDAL,
    Action,
    build_driveline_elements,
    build_standstill,
    get_crank,
    list_energy_outputs,
    list_outputs,
)
from drivetwin.errors import SimulationError
from drivetwin.gearbox import Gearbox, Reduction, reduce
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.simulation.network import NetworkRun, Output, simulate

STEP = 1e-3
"""Time between recorded samples, s: eighty per period of the output shaft."""
PEDAL_RAMP = 0.2
"""Time in which pedal and brake move, s."""
LOCK_UP_RAMP = 0.5
"""Time in which the lock-up clutch, or a starting clutch, takes the torque over, s."""
_LOCK_UP_MARGIN = 1.3
"""Torque of the closing lock-up clutch over the engine torque: what slows the engine down."""
_LOCK_UP_HOLD = 0.3
"""Time that it is given to lock before main pressure, s."""
_LOOK_AHEAD = 8.0
"""Initial simulation span of the search for the end of a leg, s."""
LONGEST_SHIFT = 3.0
"""Longest time from the begin of a shift to synchronism, s."""
NO_SLIP = 1e-6
"""Slip below which an element is synchronous, rad/s."""


def build_grid(first: int, last: int) -> FloatArray:
    """Sample times from one index to another, both included [s]."""
    return np.asarray(np.arange(first, last + 1) * STEP, dtype=np.float64)


@dataclass(frozen=True)
class State:
    """State of the drive up to `time` [s].

    `locked_up`: the lock-up clutch, or in a gearbox with dogs the starting clutch, is closed.
    `dogs` are engaged from `ready` [s] on.
    """

    time: float
    gear: str
    locked_up: bool
    schedule: Schedule
    actions: tuple[Action, ...] = ()
    dogs: tuple[str, ...] = ()
    ready: float = 0.0


class Driver:
    """The driveline of a drive, and the decisions on it."""

    def __init__(self, gearbox: Gearbox, powertrain: Powertrain) -> None:
        self.gearbox = gearbox
        self.powertrain = powertrain
        self.elements = build_driveline_elements(gearbox, powertrain)
        self.first = list_forward_gears(gearbox)[0]
        self.start = build_standstill(gearbox, self.first, powertrain)
        self.outputs = list_outputs(gearbox)
        self.crank = get_crank(gearbox)
        self.reduced = cache(lambda old, new: reduce(gearbox, old, new))

    def start_drive(self, leg: Leg) -> State:
        """Standstill in the lowest gear with the first leg's pedal and brake."""
        engaged = self.gearbox.get_gear(self.first).elements
        main = self.powertrain.control.main
        levels = {name: main if name in engaged else OPEN for name in self.gearbox.elements}
        levels |= {LOCK_UP: OPEN, PEDAL: leg.pedal, BRAKE: leg.brake}
        schedule = Schedule({name: ((0.0, value),) for name, value in levels.items()})
        return State(0.0, self.first, False, schedule)

    def simulate(self, schedule: Schedule, time: FloatArray, *, audit: bool = False) -> NetworkRun:
        """Return the motion at `time` (n,) [s], which begins with 0."""
        inputs = schedule.to_signals(float(time[-1]))
        motion = simulate(self.elements, inputs, self.start, time, self.outputs, audit=audit)
        if motion.status != "completed":
            raise SimulationError(
                f"the drive ended: {motion.status}",
                "look at the capacities on the gearbox card and at the main pressure",
            )
        return motion

    def simulate_energy(self, schedule: Schedule, time: FloatArray) -> Mapping[Output, FloatArray]:
        """Return works, heats and stored energies at `time` (n,) [s]."""
        inputs = schedule.to_signals(float(time[-1]))
        outputs = list_energy_outputs(self.elements)
        return simulate(self.elements, inputs, self.start, time, outputs).columns

    def run_leg(self, leg: Leg, state: State) -> State:
        """One leg and its action."""
        schedule = state.schedule.add_knots(PEDAL, state.time, (PEDAL_RAMP, leg.pedal))
        schedule = schedule.add_knots(BRAKE, state.time, (PEDAL_RAMP, leg.brake))
        state = self.prepare_leg(leg, replace(state, schedule=schedule))
        end, now = self._find_leg_end(leg, state)
        match leg.then:
            case ShiftTo(gear):
                return self.run_shift(gear, leg, state, end, now)
            case LockUp(closed):
                return self.run_lock_up(closed, leg, state, end, now)
            case None:
                return replace(state, time=end)

    def prepare_leg(self, _leg: Leg, state: State) -> State:
        """Return the state in which a leg begins; an automatic gearbox prepares nothing."""
        return state

    def _find_leg_end(self, leg: Leg, state: State) -> tuple[float, Mapping[Output, float]]:
        """Time at which the leg's condition is met, and the motion then."""
        until = leg.until
        ahead = until.value if until.watched is Watched.TIME else _LOOK_AHEAD
        while ahead <= LONGEST_LEG:
            time, motion = self.simulate_ahead(state.schedule, state.time, ahead)
            value = self.compute_watched(until.watched, time - state.time, motion)
            met = value <= until.value if until.falling else value >= until.value - 0.5 * STEP
            if met.any():
                at = int(np.argmax(met))
                return float(time[at]), {key: float(c[at]) for key, c in motion.items()}
            ahead *= 2.0
        raise SimulationError(
            f"{until.watched} does not {'fall' if until.falling else 'rise'} to {until.value:.4g} "
            f"within {LONGEST_LEG:g} s after {state.time:.1f} s",
            "change pedal, brake or threshold of the leg, or the road load",
        )

    def simulate_ahead(
        self, schedule: Schedule, start: float, ahead: float
    ) -> tuple[FloatArray, Mapping[Output, FloatArray]]:
        """Samples (n,) from `start` [s] on, and the columns over them."""
        first, last = round(start / STEP), round((start + ahead) / STEP)
        time = build_grid(first, last)
        grid = time if first == 0 else np.concatenate([np.zeros(1), time])
        motion = self.simulate(schedule, grid)
        return time, {key: column[-time.size :] for key, column in motion.columns.items()}

    def compute_watched(
        self, what: Watched, elapsed: FloatArray, motion: Mapping[Output, FloatArray]
    ) -> FloatArray:
        """Values (n,) of a watched quantity, `elapsed` (n,) [s] after the begin of the leg."""
        turbine = motion["speed", self.gearbox.input]
        match what:
            case Watched.TIME:
                return elapsed
            case Watched.INPUT_SPEED:
                return turbine
            case Watched.SPEED_RATIO:
                return turbine / motion["speed", self.crank]

    def run_shift(
        self, gear: str, leg: Leg, state: State, start: float, now: Mapping[Output, float]
    ) -> State:
        """Shift from one element to another, begun at `start` [s]."""
        plan = self._plan(self.reduced(state.gear, gear), leg, state.locked_up, (start, now))
        schedule = plan.add_opening(state.schedule)
        old, new = plan.reduction.off_going.element, plan.reduction.on_coming.element
        side = float(np.sign(now["slip", new]))
        synchronous = self.find_synchronism(schedule, plan.filled, (new, side))
        if synchronous is None:
            raise SimulationError(
                f"shift {state.gear}-{gear} begun at {start:.2f} s does not reach synchronism "
                f"within {LONGEST_SHIFT:g} s",
                "shift at another speed or pedal position, or choose a powertrain that suits the "
                "gearbox and a main pressure that holds its torque",
            )
        schedule = plan.close(schedule, synchronous)
        done = synchronous + RAMP + CLOSE
        action = Action(f"{state.gear}→{gear}", plan.kind, start, done, old, new)
        return replace(
            state, time=done, gear=gear, schedule=schedule, actions=(*state.actions, action)
        )

    def find_synchronism(
        self,
        schedule: Schedule,
        start: float,
        element: tuple[str, float],
        longest: float = LONGEST_SHIFT,
    ) -> float | None:
        """Return the first time [s] at which an element has lost its slip; None if it keeps it.

        `element` is its name and the sign of its slip. The search ends `longest` [s] after `start`.
        """
        name, side = element
        ahead = LONGEST_SHIFT
        while ahead <= longest:
            time, motion = self.simulate_ahead(schedule, start, ahead)
            reached = motion["slip", name] * side <= NO_SLIP
            if reached.any():
                return float(time[np.argmax(reached)])
            ahead *= 2.0
        return None

    def _plan(
        self,
        reduction: Reduction,
        leg: Leg,
        locked_up: bool,
        at: tuple[float, Mapping[Output, float]],
    ) -> ShiftPlan:
        start, now = at
        drive = self.gearbox.require_drive()
        crank, turbine = now["speed", self.crank], now["speed", self.gearbox.input]
        old, new = reduction.off_going, reduction.on_coming
        swing = new.ratio * now["speed", self.gearbox.output] - turbine
        if locked_up:
            torque = float(self.powertrain.engine.compute_steady_torque(leg.pedal, crank))
        else:
            converter = self.powertrain.converter
            after = (crank, turbine + swing)
            torque = float(converter.compute_turbine_torque(*after))
        return ShiftPlan(
            reduction=reduction,
            drive=drive,
            start=start,
            held=old.sense * now["friction_torque", old.element] / old.i_c,
            torque=torque,
            swing=swing,
            slip=abs(now["slip", new.element]),
            inertia=reduction.M11 + (drive.engine_inertia if locked_up else 0.0),
            main=self.powertrain.control.main,
        )

    def run_lock_up(
        self, closed: bool, leg: Leg, state: State, start: float, now: Mapping[Output, float]
    ) -> State:
        """Close or open the lock-up clutch, begun at `start` [s]."""
        points: Knots = ((CLOSE, OPEN),)
        if closed:
            points = self._plan_closing(leg.pedal, now)
        schedule = state.schedule.add_knots(LOCK_UP, start, *points)
        done = start + points[-1][0]
        label, elements = ("lock-up", (None, LOCK_UP)) if closed else ("release", (LOCK_UP, None))
        action = Action(label, "converter", start, done, *elements)
        actions = (*state.actions, action)
        return replace(state, time=done, locked_up=closed, schedule=schedule, actions=actions)

    def _plan_closing(self, pedal: float, now: Mapping[Output, float]) -> Knots:
        """Pressures of the lock-up clutch: it takes the engine torque over, locks, is held."""
        clutch = self.powertrain.lock_up
        torque = float(
            self.powertrain.engine.compute_steady_torque(pedal, now["speed", self.gearbox.input])
        )
        carrying = compute_pressure(
            clutch, _LOCK_UP_MARGIN * abs(torque), abs(now["slip", LOCK_UP])
        )
        taken = FILL + LOCK_UP_RAMP
        held = taken + _LOCK_UP_HOLD
        main = self.powertrain.control.main
        return (FILL, clutch.P0), (taken, carrying), (held, carrying), (held + CLOSE, main)
