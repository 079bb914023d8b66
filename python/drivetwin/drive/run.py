# SPDX-License-Identifier: MIT
"""A drive: the driver's plan and a simple shift controller over the whole driveline.

The controller decides at instants (a threshold reached, synchronism reached) from the motion up to
there. Each decision runs the drive again from standstill with the inputs decided so far: what has
been does not change, since the last value of every input holds until the next decision. The last
run is the drive: one simulation without a seam, with one energy audit.

Pressures of a shift: in a power-on upshift or power-off downshift the input torque opposes the
change of speed: the on-coming element first takes over the torque, then brings the input to its new
speed. In the other two kinds the input torque itself changes the speed: the pressure of the
off-going element controls the pace, and the on-coming element engages at synchronism. All torques
are those of the dual-clutch form (THEORY section 2): η = 1, `J ω_in' = T_in - Σ T_k / i_c,k`.
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
from drivetwin.errors import InputError, SimulationError
from drivetwin.gearbox import Drive, Gearbox, Reduction, reduce
from drivetwin.gearbox.spec import Capacity
from drivetwin.simulation.driveline import CRANK
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.simulation.network import NetworkRun, Output, simulate
from drivetwin.vehicle.shift_kind import ShiftKind

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
