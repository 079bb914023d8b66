# SPDX-License-Identifier: MIT
"""Drives of gearboxes with dogs: manual, automated manual, dual clutch.

A starting clutch connects the engine to the gearbox. Each dog has a synchroniser: a friction cone
that brings the free members to the speed of the new gear, after which the dog engages without slip.
A change of gear on the same clutch interrupts the torque: clutch opens, neutral, synchronised,
clutch closes. Between two clutches the dogs of the new gear are engaged beforehand, and the torque
goes over as in any shift from one element to another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np

from drivetwin._util.progress import notify_progress
from drivetwin.drive.driver import (
    LOCK_UP_RAMP,
    LONGEST_SHIFT,
    PEDAL_RAMP,
    STEP,
    Driver,
    State,
    build_grid,
)
from drivetwin.drive.plan import (
    CLOSE,
    FILL,
    LONGEST_LEG,
    MARGIN,
    OPEN,
    RAMP,
    Leg,
    Plan,
    Schedule,
    ShiftTo,
    Watched,
    compute_pressure,
    list_forward_gears,
)
from drivetwin.drive.powertrain import Powertrain
from drivetwin.drive.result import BRAKE, PEDAL, TRACE_STEP, Action, DriveRun, build_drive_run
from drivetwin.errors import CardError, InputError, SimulationError
from drivetwin.gearbox import Gearbox, build_network_elements
from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.simulation.element_schema import GROUND, list_ports
from drivetwin.simulation.network import Output, Start, build_element, simulate
from drivetwin.vehicle.spec import ShiftKind

ENGAGED = 1e6
"""Torque capacity of an engaged dog, N m: above that of any road vehicle, since teeth hold."""


@dataclass(frozen=True)
class DogGear:
    """Starting clutch and dogs of a gear."""

    clutch: str
    dogs: tuple[str, ...]


def split_gear(gearbox: Gearbox, gear: str) -> DogGear:
    """Return the starting clutch and the dogs of a gear.

    Raises InputError where the gear has other elements, or not one clutch at the gearbox input.
    """
    names = gearbox.get_gear(gear).elements
    others = [name for name in names if name not in gearbox.dogs]
    ends = [{gearbox.elements[name].a, gearbox.elements[name].b} for name in others]
    if len(others) != 1 or gearbox.input not in ends[0]:
        raise InputError(
            f"gear {gear} of {gearbox.name} has dogs and is made by {', '.join(names)}",
            f"a gearbox with dogs drives where each gear has one clutch at {gearbox.input!r} and "
            "dogs alone; build another one as a network with drivetwin.Model",
        )
    return DogGear(others[0], tuple(name for name in names if name in gearbox.dogs))


def compute_synchronised_inertia(gearbox: Gearbox, dog: str, engaged: Sequence[str]) -> float:
    """Compute the inertia that a synchroniser brings to speed, per slip of its dog [kg m^2].

    The core accelerates the gearbox from rest by 1 N m across the dog, with the output held, the
    dogs in `engaged` engaged and all clutches open. 0 where the dog cannot slip. Raises CardError
    where a member that moves has no inertia.
    """
    element = gearbox.elements[dog]
    ends = [end for end in (element.a, element.b) if end != GROUND]
    reaction = {"reaction": ends[1]} if ends[1:] else {}
    elements = [
        *build_network_elements(gearbox, engaged),
        build_element("prescribed_speed", _HELD, node=gearbox.output, input=_HELD),
        build_element("torque", _CONE, node=ends[0], input=_CONE, **reaction),
    ]
    levels = {name: 0.0 for name in gearbox.elements if name not in gearbox.dogs}
    levels |= {_HELD: 0.0, _CONE: 1.0}
    time = np.array([0.0, STEP])
    inputs = {name: Signal(time, np.full(2, value)) for name, value in levels.items()}
    outputs: list[Output] = [("acceleration", end) for end in ends]
    nodes = {node for one in elements for node in list_ports(one).values()} - {GROUND}
    start = Start(dict.fromkeys(sorted(nodes), 0.0))
    try:
        columns = simulate(elements, inputs, start, time, outputs).columns
    except InputError as error:
        raise CardError(
            f"a member that the synchroniser of {dog} turns has no inertia: {error.what}",
            "give [inertia_kgm2] of all members of the gearbox card",
        ) from error
    first, *second = (float(columns[one][0]) for one in outputs)
    slip = first - sum(second)
    return 1.0 / slip if slip > 0.0 else 0.0


_HELD, _CONE = "held output", "cone"
"""Elements and inputs that turn a synchroniser for its inertia."""


@dataclass(frozen=True)
class _Closing:
    """Engagement of a starting clutch: it takes up `torque` [N m] within `ramp` [s] and slips."""

    clutch: str
    pedal: float
    torque: float
    ramp: float


class DogDriver(Driver):
    """Decisions on a gearbox with dogs."""

    def __init__(self, gearbox: Gearbox, powertrain: Powertrain) -> None:
        self.gears = {gear: split_gear(gearbox, gear) for gear in list_forward_gears(gearbox)}
        super().__init__(gearbox, powertrain)
        drive = gearbox.require_drive()
        self.phase = drive.inertia_phase
        self.engine_inertia = drive.engine_inertia + gearbox.inertias.get(gearbox.input, 0.0)

    def start_drive(self, leg: Leg) -> State:
        """Standstill in the lowest gear with open clutches and the first leg's pedal and brake."""
        first = self.gears[self.first]
        levels = dict.fromkeys(self.gearbox.elements, OPEN)
        levels |= dict.fromkeys(first.dogs, ENGAGED)
        levels |= {first.clutch: self._get_touch(first.clutch)}
        levels |= {PEDAL: leg.pedal, BRAKE: leg.brake}
        schedule = Schedule({name: ((0.0, value),) for name, value in levels.items()})
        return State(0.0, self.first, False, schedule, dogs=first.dogs)

    def compute_watched(
        self, what: Watched, elapsed: FloatArray, motion: Mapping[Output, FloatArray]
    ) -> FloatArray:
        """Values (n,) of a watched quantity; raises InputError for the ratio of a converter."""
        if what is Watched.SPEED_RATIO:
            raise InputError(
                f"a leg of {self.gearbox.name} ends at a speed ratio, and there is no converter",
                "end the leg at an input speed or a time",
            )
        return super().compute_watched(what, elapsed, motion)

    def prepare_leg(self, leg: Leg, state: State) -> State:
        """Release the dogs of the gear before; engage those of a next gear on another clutch."""
        here = self.gears[state.gear]
        wanted = here.dogs
        if state.locked_up and isinstance(leg.then, ShiftTo):
            after = self._get_gear(leg.then.gear)
            wanted += () if after.clutch == here.clutch else after.dogs
        return self._change_dogs(state, state.time, wanted)

    def _get_gear(self, name: str) -> DogGear:
        if name not in self.gears:
            raise InputError(
                f"{name!r} is not a forward gear of {self.gearbox.name}",
                f"choose one of {', '.join(self.gears)}",
            )
        return self.gears[name]

    def run_shift(
        self, gear: str, leg: Leg, state: State, start: float, now: Mapping[Output, float]
    ) -> State:
        """Shift from clutch to clutch, or with interrupted torque on the same clutch."""
        old, new = self.gears[state.gear], self._get_gear(gear)
        if start < state.ready:
            start, now = state.ready, self._look(state.schedule, state.ready)
        if not state.locked_up:
            state = self._change_dogs(state, start, new.dogs)
            return replace(state, time=max(start, state.ready), gear=gear)
        if old.clutch != new.clutch:
            return super().run_shift(gear, leg, state, start, now)
        return self._interrupt(gear, leg, state, start, now)

    def _interrupt(
        self, gear: str, leg: Leg, state: State, start: float, now: Mapping[Output, float]
    ) -> State:
        """Change gear on one clutch: it opens, the dogs change, it closes."""
        old, new = self.gears[state.gear], self.gears[gear]
        schedule = state.schedule.add_knots(PEDAL, start, (FILL, 0.0))
        schedule = schedule.add_knots(old.clutch, start, (FILL, self._get_touch(old.clutch)))
        opened = self._change_dogs(replace(state, schedule=schedule), start + FILL, new.dogs)
        at = opened.ready
        slip = self._look(opened.schedule, at)["slip", new.clutch] * self._get_sense(new.clutch)
        torque = self._compute_torque(leg.pedal, now["speed", self.crank])
        swing = self.engine_inertia * abs(slip) / self.phase
        carried = max(0.0, float(np.sign(slip)) * torque + swing)
        schedule = opened.schedule.add_knots(PEDAL, at, (PEDAL_RAMP, leg.pedal))
        schedule, done = self._close(schedule, at, _Closing(new.clutch, leg.pedal, carried, RAMP))
        ratios = [self.gearbox.get_gear(name).published for name in (state.gear, gear)]
        kind = ShiftKind.from_direction(up=ratios[1] < ratios[0], power_on=torque > 0.0)
        label = f"{state.gear}→{gear}"
        action = Action(label, kind, start, done, old.clutch, new.clutch)
        begun = len(state.actions)
        actions = (*state.actions, action, *opened.actions[begun:])
        return replace(opened, time=done, gear=gear, schedule=schedule, actions=actions)

    def run_lock_up(
        self, closed: bool, leg: Leg, state: State, start: float, _now: Mapping[Output, float]
    ) -> State:
        """Launch on the starting clutch of the gear, or open it."""
        clutch, schedule = self.gears[state.gear].clutch, state.schedule
        if closed:
            engine = self.powertrain.engine
            speeds = np.array(engine.speed)
            largest = float(engine.compute_steady_torque(leg.pedal, speeds).max())
            launch = _Closing(clutch, leg.pedal, MARGIN * max(0.0, largest), LOCK_UP_RAMP)
            schedule, done = self._close(schedule, start, launch, LONGEST_LEG)
            action = Action("launch", "clutch", start, done, None, clutch)
        else:
            done = start + CLOSE
            schedule = schedule.add_knots(clutch, start, (CLOSE, self._get_touch(clutch)))
            action = Action("release", "clutch", start, done, clutch, None)
        actions = (*state.actions, action)
        return replace(state, time=done, locked_up=closed, schedule=schedule, actions=actions)

    def _close(
        self,
        schedule: Schedule,
        start: float,
        closing: _Closing,
        longest: float = LONGEST_SHIFT,
    ) -> tuple[Schedule, float]:
        """Slip a starting clutch until it is synchronous, then close it.

        Return the inputs and the time at which it is closed [s].
        """
        clutch, torque = closing.clutch, closing.torque
        capacity = self.gearbox.get_capacity(clutch)
        slip = self._look(schedule, start)["slip", clutch]
        level = compute_pressure(capacity, torque, abs(slip))
        schedule = schedule.add_knots(clutch, start, (closing.ramp, level))
        side = float(np.sign(slip))
        synchronous = self.find_synchronism(schedule, start, (clutch, side), longest)
        if synchronous is None:
            raise SimulationError(
                f"the clutch {clutch} closed from {start:.2f} s on still slips after {longest:g} s",
                "use more pedal, or a powertrain that suits the gearbox and the load",
            )
        speed = self._look(schedule, synchronous)["speed", self.crank]
        holding = MARGIN * abs(self._compute_torque(closing.pedal, speed))
        enough = max(level, compute_pressure(capacity, holding, 0.0))
        points = (RAMP, enough), (RAMP + CLOSE, max(self.powertrain.control.main, enough))
        return schedule.add_knots(clutch, synchronous, *points), synchronous + points[-1][0]

    def _compute_torque(self, pedal: float, speed: float) -> float:
        return float(self.powertrain.engine.compute_steady_torque(pedal, speed))

    def _get_touch(self, clutch: str) -> float:
        """Pressure at which a starting clutch touches without torque [Pa]."""
        return self.gearbox.get_capacity(clutch).P0

    def _get_sense(self, clutch: str) -> float:
        """Return 1 where the slip of a clutch is that of the engine over the gearbox, else -1."""
        return 1.0 if self.gearbox.elements[clutch].a == self.gearbox.input else -1.0

    def _change_dogs(self, state: State, start: float, wanted: Sequence[str]) -> State:
        """Release the dogs that are not wanted at `start` [s], synchronise and engage the others.

        The synchroniser has the torque that ends the slip within the inertia phase, and that keeps
        up with the acceleration of the vehicle.
        """
        off = [name for name in state.dogs if name not in wanted]
        on = [name for name in wanted if name not in state.dogs]
        schedule, done = state.schedule, start
        for name in off:
            schedule = schedule.add_knots(name, start, (RAMP, OPEN))
        if off:
            done = start + RAMP
        held = [name for name in state.dogs if name in wanted]
        for name in on:
            schedule, done = self._synchronise(schedule, done, name, held)
            held.append(name)
        actions = tuple(
            Action(_describe_change(old, new), "dogs", start, done, old, new)
            for old, new in zip_longest(off, on)
        )
        return replace(
            state,
            schedule=schedule,
            dogs=tuple(held),
            ready=done,
            actions=(*state.actions, *actions),
        )

    def _synchronise(
        self, schedule: Schedule, start: float, dog: str, engaged: Sequence[str]
    ) -> tuple[Schedule, float]:
        """Engage a dog from `start` [s] on; return the inputs and the time it is engaged."""
        now, after = (self._look(schedule, at)["slip", dog] for at in (start, start + STEP))
        inertia = compute_synchronised_inertia(self.gearbox, dog, engaged)
        growth = max(0.0, (abs(after) - abs(now)) / STEP)
        level = MARGIN * inertia * (abs(now) / self.phase + growth)
        schedule = schedule.add_knots(dog, start, (RAMP, level))
        synchronous = self.find_synchronism(schedule, start, (dog, float(np.sign(now))))
        if synchronous is None:
            raise SimulationError(
                f"the synchroniser of {dog} does not reach synchronism at {start:.2f} s: a dog "
                "engages without slip alone",
                "change gear at another speed, and state the inertias of all members",
            )
        return schedule.add_knots(dog, synchronous, (RAMP, ENGAGED)), synchronous + RAMP

    def _look(self, schedule: Schedule, time: float) -> Mapping[Output, float]:
        """Return the motion at one instant [s]."""
        _, motion = self.simulate_ahead(schedule, time, 0.0)
        return {key: float(column[0]) for key, column in motion.items()}


def _describe_change(old: str | None, new: str | None) -> str:
    if old is None or new is None:
        return f"release {old}" if new is None else f"engage {new}"
    return f"{old}→{new}"


def run(gearbox: Gearbox, powertrain: Powertrain, plan: Plan) -> DriveRun:
    """Drive the plan from standstill in the lowest gear and return the motion.

    Raises SimulationError where a leg does not end, a shift does not reach synchronism, or the
    simulation does not complete; ReductionError for a shift that is not one element off and one on;
    InputError for a plan without legs or a gearbox that cannot be driven.
    """
    if not plan:
        raise InputError("the plan has no legs", "give at least one leg, with pedal and end")
    driver = (DogDriver if gearbox.dogs else Driver)(gearbox, powertrain)
    state = driver.start_drive(plan[0])
    for count, leg in enumerate(plan):
        notify_progress(count / (len(plan) + 1))
        state = driver.run_leg(leg, state)
    motion = driver.simulate(state.schedule, build_grid(0, round(state.time / STEP)), audit=True)
    energy = driver.simulate_energy(state.schedule, motion.time[::TRACE_STEP])
    return build_drive_run(gearbox, powertrain, state.schedule, state.actions, motion, energy)
