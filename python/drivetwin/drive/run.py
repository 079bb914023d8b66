# SPDX-License-Identifier: MIT
"""A drive: the driver's plan and a simple shift controller over the whole driveline.

The controller decides at instants (a threshold reached, synchronism reached) from the motion up to
there. Each decision runs the drive again from standstill with the inputs decided so far: what has
been does not change, since the last value of every input holds until the next decision. The last
run is the drive: one simulation without a seam, with one energy audit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from drivetwin._util.progress import notify_progress
from drivetwin.drive.network import (
    BRAKE,
    LOCK_UP,
    PEDAL,
    build_driveline_elements,
    build_standstill,
    list_energy_outputs,
    list_outputs,
)
from drivetwin.drive.plan import (
    LONGEST_LEG,
    Leg,
    LockUp,
    Plan,
    ShiftTo,
    Watched,
    list_forward_gears,
)
from drivetwin.drive.powertrain import Powertrain
from drivetwin.drive.result import TRACE_STEP, Action, DriveRun, build_drive_run
from drivetwin.drive.schedule import Knots, Schedule
from drivetwin.drive.shift import CLOSE, FILL, OPEN, RAMP, ShiftPlan, compute_pressure
from drivetwin.errors import InputError, SimulationError
from drivetwin.gearbox import Gearbox, Reduction, reduce
from drivetwin.simulation.driveline import CRANK
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.simulation.network import NetworkRun, Output, simulate

STEP = 1e-3
"""Time between recorded samples, s: eighty per period of the output shaft."""
_PEDAL_RAMP = 0.2
"""Time in which pedal and brake move, s."""
_LOCK_UP_RAMP = 0.5
"""Time in which the lock-up clutch takes the torque over, s."""
_LOCK_UP_MARGIN = 1.3
"""Torque of the closing lock-up clutch over the engine torque: what slows the engine down."""
_LOCK_UP_HOLD = 0.3
"""Time that it is given to lock before main pressure, s."""
_LOOK_AHEAD = 8.0
"""Initial simulation span of the search for the end of a leg, s."""
_LONGEST_SHIFT = 3.0
"""Longest time from the begin of a shift to synchronism, s."""
_NO_SLIP = 1e-6
"""Slip below which an element is synchronous, rad/s."""


def run(gearbox: Gearbox, powertrain: Powertrain, plan: Plan) -> DriveRun:
    """Drive the plan from standstill in the lowest gear and return the motion.

    Raises SimulationError where a leg does not end, a shift does not reach synchronism, or the
    simulation does not complete; ReductionError for a shift that is not one element off and one on;
    InputError for a plan without legs or a gearbox that cannot be driven.
    """
    if not plan:
        raise InputError("the plan has no legs", "give at least one leg, with pedal and end")
    driver = _Driver(gearbox, powertrain)
    state = driver.start_drive(plan[0])
    for count, leg in enumerate(plan):
        notify_progress(count / (len(plan) + 1))
        state = driver.run_leg(leg, state)
    motion = driver.simulate(state.schedule, _build_grid(0, round(state.time / STEP)), audit=True)
    energy = driver.simulate_energy(state.schedule, motion.time[::TRACE_STEP])
    return build_drive_run(gearbox, powertrain, state.schedule, state.actions, motion, energy)


def _build_grid(first: int, last: int) -> FloatArray:
    """Sample times from one index to another, both included [s]."""
    return np.asarray(np.arange(first, last + 1) * STEP, dtype=np.float64)


@dataclass(frozen=True)
class _State:
    """State of the drive up to `time` [s]; `locked_up` is the state of the lock-up clutch."""

    time: float
    gear: str
    locked_up: bool
    schedule: Schedule
    actions: tuple[Action, ...] = ()


class _Driver:
    """The driveline of a drive, and the decisions on it."""

    def __init__(self, gearbox: Gearbox, powertrain: Powertrain) -> None:
        self.gearbox = gearbox
        self.powertrain = powertrain
        self.elements = build_driveline_elements(gearbox, powertrain)
        self.first = list_forward_gears(gearbox)[0]
        self.start = build_standstill(gearbox, self.first, powertrain)
        self.outputs = list_outputs(gearbox)
        self.reduced = cache(lambda old, new: reduce(gearbox, old, new))

    def start_drive(self, leg: Leg) -> _State:
        """Standstill in the lowest gear with the first leg's pedal and brake."""
        engaged = self.gearbox.get_gear(self.first).elements
        main = self.powertrain.control.main
        levels = {name: main if name in engaged else OPEN for name in self.gearbox.elements}
        levels |= {LOCK_UP: OPEN, PEDAL: leg.pedal, BRAKE: leg.brake}
        schedule = Schedule({name: ((0.0, value),) for name, value in levels.items()})
        return _State(0.0, self.first, False, schedule)

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

    def run_leg(self, leg: Leg, state: _State) -> _State:
        """One leg and its action."""
        schedule = state.schedule.add_knots(PEDAL, state.time, (_PEDAL_RAMP, leg.pedal))
        schedule = schedule.add_knots(BRAKE, state.time, (_PEDAL_RAMP, leg.brake))
        state = _State(state.time, state.gear, state.locked_up, schedule, state.actions)
        end, now = self._find_leg_end(leg, state)
        match leg.then:
            case ShiftTo(gear):
                return self._run_shift(gear, leg, state, end, now)
            case LockUp(closed):
                return self._run_lock_up(closed, leg, state, end, now)
            case None:
                return _State(end, state.gear, state.locked_up, schedule, state.actions)

    def _find_leg_end(self, leg: Leg, state: _State) -> tuple[float, Mapping[Output, float]]:
        """Time at which the leg's condition is met, and the motion then."""
        until = leg.until
        ahead = until.value if until.watched is Watched.TIME else _LOOK_AHEAD
        while ahead <= LONGEST_LEG:
            time, motion = self._simulate_ahead(state.schedule, state.time, ahead)
            value = self._compute_watched(until.watched, time - state.time, motion)
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

    def _simulate_ahead(
        self, schedule: Schedule, start: float, ahead: float
    ) -> tuple[FloatArray, Mapping[Output, FloatArray]]:
        """Samples (n,) from `start` [s] on, and the columns over them."""
        first, last = round(start / STEP), round((start + ahead) / STEP)
        time = _build_grid(first, last)
        grid = time if first == 0 else np.concatenate([np.zeros(1), time])
        motion = self.simulate(schedule, grid)
        return time, {key: column[-time.size :] for key, column in motion.columns.items()}

    def _compute_watched(
        self, what: Watched, elapsed: FloatArray, motion: Mapping[Output, FloatArray]
    ) -> FloatArray:
        turbine = motion["speed", self.gearbox.input]
        match what:
            case Watched.TIME:
                return elapsed
            case Watched.INPUT_SPEED:
                return turbine
            case Watched.SPEED_RATIO:
                return turbine / motion["speed", CRANK]

    def _run_shift(
        self, gear: str, leg: Leg, state: _State, start: float, now: Mapping[Output, float]
    ) -> _State:
        plan = self._plan(self.reduced(state.gear, gear), leg, state.locked_up, (start, now))
        schedule = plan.add_opening(state.schedule)
        time, motion = self._simulate_ahead(schedule, plan.filled, _LONGEST_SHIFT)
        slip = motion["slip", plan.reduction.on_coming.element]
        side = np.sign(now["slip", plan.reduction.on_coming.element])
        reached = slip * side <= _NO_SLIP
        if not reached.any():
            raise SimulationError(
                f"shift {state.gear}-{gear} begun at {start:.2f} s does not reach synchronism "
                f"within {_LONGEST_SHIFT:g} s",
                "shift at another speed or pedal position, or choose a powertrain that suits the "
                "gearbox and a main pressure that holds its torque",
            )
        synchronous = float(time[np.argmax(reached)])
        schedule = plan.close(schedule, synchronous)
        done = synchronous + RAMP + CLOSE
        old, new = plan.reduction.off_going.element, plan.reduction.on_coming.element
        action = Action(f"{state.gear}→{gear}", plan.kind, start, done, old, new)
        return _State(done, gear, state.locked_up, schedule, (*state.actions, action))

    def _plan(
        self,
        reduction: Reduction,
        leg: Leg,
        locked_up: bool,
        at: tuple[float, Mapping[Output, float]],
    ) -> ShiftPlan:
        start, now = at
        drive = self.gearbox.require_drive()
        crank, turbine = now["speed", CRANK], now["speed", self.gearbox.input]
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

    def _run_lock_up(
        self, closed: bool, leg: Leg, state: _State, start: float, now: Mapping[Output, float]
    ) -> _State:
        points: Knots = ((CLOSE, OPEN),)
        if closed:
            points = self._plan_closing(leg.pedal, now)
        schedule = state.schedule.add_knots(LOCK_UP, start, *points)
        done = start + points[-1][0]
        label, elements = ("lock-up", (None, LOCK_UP)) if closed else ("release", (LOCK_UP, None))
        action = Action(label, "converter", start, done, *elements)
        return _State(done, state.gear, closed, schedule, (*state.actions, action))

    def _plan_closing(self, pedal: float, now: Mapping[Output, float]) -> Knots:
        """Pressures of the lock-up clutch: it takes the engine torque over, locks, is held."""
        clutch = self.powertrain.lock_up
        torque = float(
            self.powertrain.engine.compute_steady_torque(pedal, now["speed", self.gearbox.input])
        )
        carrying = compute_pressure(
            clutch, _LOCK_UP_MARGIN * abs(torque), abs(now["slip", LOCK_UP])
        )
        taken = FILL + _LOCK_UP_RAMP
        held = taken + _LOCK_UP_HOLD
        main = self.powertrain.control.main
        return (FILL, clutch.P0), (taken, carrying), (held, carrying), (held + CLOSE, main)
