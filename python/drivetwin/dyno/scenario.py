# SPDX-License-Identifier: MIT
"""Scenario of the virtual dynamometer: driveline, driver, TCU, actuators, noisy sensors.

`Actuator` is linear between the corners of its pressure command. `ControlledActuator` takes the
command of a controller task and answers by the model that is identified from logs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from drivetwin._util.arrays import apply_lag
from drivetwin.actuator.model import ActuatorModel, HeldSignal
from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.errors import InputError, Where
from drivetwin.gearbox import Gearbox, build_network_elements, reduce, solve_gear
from drivetwin.gearbox.reduction import ElementRatios, build_shift_element
from drivetwin.simulation.added_elements import OpenConverter
from drivetwin.simulation.driveline import (
    ENGINE,
    SHAFT,
    WHEEL,
    OutputSide,
    build_engine_side,
    build_shaft,
    build_vehicle,
    require_own_nodes,
    solve_steady_speed,
)
from drivetwin.simulation.driveline_run import build_trajectory, list_motion_outputs
from drivetwin.simulation.dual_clutch import (
    ENGINE_TORQUE,
    DualClutch,
    FloatArray,
    ShiftElement,
    Signal,
    State,
    Trajectory,
)
from drivetwin.simulation.element_schema import GROUND
from drivetwin.simulation.network import Element, Start, build_element, simulate


@dataclass(frozen=True)
class Program:
    """A quantity over time, linear between `knots` (time [s], value SI), constant outside.

    Raises InputError where there is no knot or times do not increase.
    """

    knots: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        times = [time for time, _ in self.knots]
        if not times or any(b <= a for a, b in pairwise(times)):
            raise InputError(
                f"the knots of a program are at {times}",
                "give at least one knot, with increasing times",
                Where(key="knots"),
            )

    def evaluate(self, time: FloatArray) -> FloatArray:
        """Values at `time` (n,) [s]."""
        knots = np.array(self.knots)
        return np.asarray(np.interp(time, knots[:, 0], knots[:, 1]), dtype=np.float64)


@dataclass(frozen=True)
class Vibration:
    """Oscillation of the valve: `amplitude` [Pa], `frequency` [Hz], from `start` to `end` [s].

    Both edges are raised cosines one period long, so that the pressure has no step.
    """

    amplitude: float
    frequency: float
    start: float
    end: float

    def evaluate(self, time: FloatArray) -> FloatArray:
        """Pressure to add at `time` (n,) [s], in Pa."""
        edge = np.minimum(time - self.start, self.end - time) * self.frequency
        envelope = 0.5 - 0.5 * np.cos(np.pi * np.clip(edge, 0.0, 1.0))
        phase = 2.0 * np.pi * self.frequency * (time - self.start)
        return np.asarray(self.amplitude * envelope * np.sin(phase), dtype=np.float64)


@dataclass(frozen=True)
class Fill:
    """The stroke of a clutch piston against its return spring.

    While the piston moves, its pressure is at most `spring` [Pa]. The whole stroke takes `time` [s]
    at a pressure of `boost` [Pa], in proportion to the root of the pressure difference.
    """

    spring: float
    boost: float
    time: float

    def apply_fill(self, command: FloatArray, step: float) -> FloatArray:
        """Return what is left of `command` (n,) [Pa], sampled every `step` [s].

        A clutch that is commanded below the spring pressure at first is empty.
        """
        over = (command - self.spring) / (self.boost - self.spring)
        speed = np.sign(over) * np.sqrt(np.abs(over)) / self.time
        filled = 1.0 if command[0] > self.spring else 0.0
        allowed = command.copy()
        for index in range(1, command.size):
            filled = min(1.0, max(0.0, filled + step * speed[index]))
            if filled < 1.0:
                allowed[index] = min(command[index], self.spring)
        return allowed


@dataclass(frozen=True)
class Actuator:
    """Valve and clutch volume: a dead time, the fill, a first-order lag (times in s, lag > 0).

    `command` is the pressure asked for [Pa]; `vibration` is the unwanted part, as in the inertia
    phase of Fig. 4. Without `fill` the piston is at its stop. Raises InputError for other times.
    """

    command: Program
    dead_time: float
    lag: float
    vibration: Vibration | None = None
    fill: Fill | None = None

    def __post_init__(self) -> None:
        if not (self.dead_time >= 0.0 and self.lag > 0.0):
            raise InputError(
                f"a dead time of {self.dead_time:g} s and a lag of {self.lag:g} s",
                "give a dead time from 0 on and a lag above 0",
                Where(key="actuator"),
            )

    def compute_pressure(self, time: FloatArray) -> FloatArray:
        """Pressure at evenly spaced `time` (n,) [s], in Pa; at rest before `time[0]`."""
        command = self.command.evaluate(time - self.dead_time)
        step = float(time[1] - time[0])
        if self.fill is not None:
            command = self.fill.apply_fill(command, step)
        pressure = apply_lag(command, step, self.lag)
        if self.vibration is not None:
            pressure = pressure + self.vibration.evaluate(time)
        return np.asarray(pressure, dtype=np.float64)


@dataclass(frozen=True)
class ControlledActuator:
    """Actuator behind a controller that holds its command [Pa] for `task` [s].

    `resolution` [Pa] is that of the command. Raises InputError for a task that is not above 0.
    """

    command: Program
    model: ActuatorModel
    task: float = 0.01
    resolution: float = 1e3

    def __post_init__(self) -> None:
        if not self.task > 0.0:
            raise InputError(
                f"a controller task of {self.task:g} s",
                "give a time above 0",
                Where(key="actuator"),
            )

    def compute_command(self, duration: float) -> HeldSignal:
        """Return the command of all tasks up to `duration` [s]."""
        count = int(np.ceil(duration / self.task)) + 1
        time = self.task * np.arange(count, dtype=np.float64)
        values = self.resolution * np.round(self.command.evaluate(time) / self.resolution)
        return HeldSignal(time, np.asarray(values, dtype=np.float64))

    def compute_pressure(self, time: FloatArray) -> FloatArray:
        """Pressure at `time` (n,) [s], in Pa; at rest before the first command."""
        return self.model.compute_pressure(self.compute_command(float(time[-1])), time)


_MAIN = 2e6
"""Pressure of an element that stays closed throughout, Pa."""


@dataclass(frozen=True)
class Plant:
    """A gearbox with all its members between engine and output shaft.

    `gears` are shifted through; `losses` of the model act before the gearbox. The `ratios` of each
    shift element are those of eq. 15; `common` elements stay closed.
    """

    gearbox: Gearbox
    gears: tuple[str, ...]
    ratios: Mapping[str, ElementRatios]
    common: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the gearbox."""
        return self.gearbox.name

    def simulate(
        self,
        model: DualClutch,
        engine_torque: Signal,
        pressures: Mapping[str, Signal],
        start: State,
        time: FloatArray,
    ) -> Trajectory:
        """Run the gearbox in the driveline of `model`, as `driveline.simulate` runs its form.

        Slip and torque of the shift elements are those of the form (eq. 15).
        Raises InputError where the description is inconsistent; a failed run returns its status.
        """
        end = np.array([0.0, float(time[-1])])
        idle = {name: Signal(end, np.zeros(2)) for name in self.gearbox.elements}
        closed = {name: Signal(end, np.full(2, _MAIN)) for name in self.common}
        names, output = list(self.ratios), self.gearbox.output
        run = simulate(
            self._build_elements(model),
            {**idle, **closed, **pressures, ENGINE_TORQUE: engine_torque},
            self._start(start),
            time,
            list_motion_outputs(names, output),
        )
        found = build_trajectory(run, names, output)
        sense = {name: each.sense for name, each in self.ratios.items()}
        return replace(
            found,
            clutch_torque={n: sense[n] * found.clutch_torque[n] for n in sense},
            slip={n: sense[n] * found.slip[n] for n in sense},
        )

    def _build_elements(self, model: DualClutch) -> list[Element]:
        loss = {"law": model.loss_law, "eta": model.eta}
        box, side = self.gearbox, OutputSide.from_model(model)
        gearing = build_network_elements(box)
        require_own_nodes(gearing)
        return [
            *build_engine_side(model.J1),
            build_element("gear", "losses", a=ENGINE, b=box.input, ratio=1.0, loss=loss),
            *gearing,
            *build_shaft(side, box.output),
            *build_vehicle(side),
        ]

    def _start(self, start: State) -> Start:
        """The state in the gear that `start` holds; the members turn as that gear makes them."""
        gear = next(
            name for name in self.gears if start.locked[0] in self.gearbox.get_gear(name).elements
        )
        members = solve_gear(self.gearbox, gear).speeds
        speeds = {name: start.engine_speed * (each or 0.0) for name, each in members.items()}
        return Start(
            {**speeds, ENGINE: start.engine_speed, WHEEL: start.wheel_speed},
            {SHAFT: start.twist},
            (*start.locked, *self.common),
        )


def build_plant(gearbox: Gearbox, gears: tuple[str, ...]) -> Plant:
    """Prepare a gearbox for up-shifts through `gears`, all with the same elements in common.

    Raises ReductionError for a shift that is not one element off and one on, InputError for a card
    with a converter or freewheels.
    """
    gearbox.require_pressed_alone("the dynamometer")
    shifts = [reduce(gearbox, old, new) for old, new in pairwise(gears)]
    ratios = {each.element: each for s in shifts for each in (s.off_going, s.on_coming)}
    return Plant(gearbox, gears, ratios, shifts[0].common)


def build_form(plant: Plant, J1: float, eta: float, side: OutputSide) -> DualClutch:
    """Return the dual-clutch form of a gearbox behind an engine and before its output side.

    `J1` [kg m^2] and `eta` are as in `DualClutch`.

    A member that is the drum of a shift element runs with its slip and becomes its drum inertia.
    All others count with their parts on the diagonal; where one of them turns with both shafts the
    form is not exact (THEORY section 2).
    """
    box = plant.gearbox
    shift = reduce(box, *plant.gears[:2])
    drums = {box.elements[name].a: name for name in plant.ratios if _is_brake(box, name)}
    others = [each for each in shift.members if each.member not in drums]
    return DualClutch(
        J1=J1,
        J2e=sum(each.inertia * each.a**2 for each in others),
        eta=eta,
        loss_law="paper",
        i_in=1.0,
        J_out=sum(each.inertia * each.b**2 for each in others),
        **vars(side),
        elements=tuple(
            build_shift_element(box, each, _get_drum_inertia(box, each.element))
            for each in plant.ratios.values()
        ),
    )


def _is_brake(gearbox: Gearbox, element: str) -> bool:
    return gearbox.elements[element].b == GROUND


def _get_drum_inertia(gearbox: Gearbox, element: str) -> float:
    """Inertia of the member that a brake holds; 0 for a clutch."""
    member = gearbox.elements[element].a
    drum = gearbox.inertias.get(member, 0.0)
    return drum if _is_brake(gearbox, element) else 0.0


LOOKS = 20
"""Instants per averaging window; the error of the mean falls with their square."""


@dataclass(frozen=True)
class Sensor:
    """One channel of the log.

    `column` and `unit` are those of the file; everything else is SI. A sample is the quantity at
    its time stamp minus `delay` [s], plus white noise of `noise` (1 σ), rounded to a multiple of
    `resolution` (0: not rounded). `rate` in Hz; a rate below the logger's gives held values.
    """

    role: str
    quantity: Quantity
    column: str
    unit: str
    rate: float
    noise: float
    resolution: float = 0.0
    delay: float = 0.0
    window: float = 0.0
    """Time [s] before the stamp over which a sample is the mean, as encoders on a bus send it."""

    def compute_instants(self, stamps: FloatArray) -> FloatArray:
        """Instants (n, m) [s] that each sample averages; none before 0."""
        if self.window == 0.0:
            before = np.zeros(1)
        else:
            before = self.window * (np.arange(LOOKS) + 0.5) / LOOKS
        return np.maximum(stamps[:, None] - self.delay - before, 0.0)

    def compute_stamps(self, duration: float) -> FloatArray:
        """Time stamps (n,) [s] from 0 to `duration`, exact multiples of the period."""
        return np.arange(int(np.floor(duration * self.rate + 1e-9)) + 1) / self.rate

    def read(
        self, stamps: FloatArray, exact: FloatArray, noise: float, rng: np.random.Generator
    ) -> Channel:
        """The recorded channel from the `exact` quantity (n,) at `stamps - delay`.

        `noise` scales the white noise; at 0 the sensor is ideal and does not round either.
        """
        values = exact + noise * self.noise * rng.standard_normal(exact.size)
        if noise > 0.0 and self.resolution > 0.0:
            values = self.resolution * np.round(values / self.resolution)
        return Channel(self.role, self.quantity, stamps, values, self.column, self.unit)


@dataclass(frozen=True)
class TorqueReduction:
    """Torque intervention of the TCU: the share `fraction` is taken from `start` to `end` [s].

    It comes and goes within `ramp` [s]. Raises InputError for a share or times that there are not.
    """

    fraction: float
    start: float
    end: float
    ramp: float = 0.05

    def __post_init__(self) -> None:
        if not 0.0 <= self.fraction < 1.0:
            raise InputError(
                f"{self.fraction:g} is no share of the engine torque",
                "give a number from 0 to below 1, such as 0.3",
                Where(key="torque reduction"),
            )
        if not 0.0 < self.ramp <= self.end - self.start:
            raise InputError(
                f"a ramp of {self.ramp:g} s from {self.start:g} s to {self.end:g} s",
                "let it come within a time above 0, before it goes again",
                Where(key="torque reduction"),
            )

    def compute_factor(self, time: FloatArray) -> FloatArray:
        """Factor on the engine torque at `time` (n,)."""
        knots = (self.start, self.start + self.ramp, self.end, self.end + self.ramp)
        return 1.0 - self.fraction * np.interp(time, knots, (0.0, 1.0, 1.0, 0.0))


@dataclass(frozen=True)
class HeldGear:
    """A gear and the element that makes it."""

    name: str
    element: str


@dataclass(frozen=True)
class Scenario:
    """Shifts through `gears`, each held by one element of the model.

    Where there is a `plant`, the whole gearbox is simulated, and `model` is its dual-clutch form.
    With a `converter` the model is behind it, and `engine_speed` is that of the turbine.
    `engine_speed` [rad/s] is the speed at time 0, where the start gear is in quasi-steady
    acceleration. `engine_torque` [N m] is the driver's demand, without the TCU's `reductions`.
    `rate` [Hz] is the sampling of the inputs, linear between samples. `J_prime_range` and
    `J_vehicle_range` are plausible ranges for the vehicle card: of J' at the engine and of J3 at
    the wheel [kg m^2]. With `is_shared_pressure` the elements are one and the same in two gears,
    and a log has its pressure once.
    """

    name: str
    model: DualClutch
    gears: tuple[HeldGear, ...]
    duration: float
    engine_speed: float
    engine_torque: Program
    actuators: Mapping[str, Actuator | ControlledActuator]
    sensors: tuple[Sensor, ...]
    J_prime_range: tuple[float, float]
    J_vehicle_range: tuple[float, float]
    reductions: tuple[TorqueReduction, ...]
    rate: float = 1000.0
    plant: Plant | None = None
    one_clutch: bool = False
    converter: OpenConverter | None = None

    @property
    def start_gear(self) -> str:
        """Gear before the first shift."""
        return self.gears[0].name

    @property
    def end_gear(self) -> str:
        """Gear after the first shift."""
        return self.gears[1].name

    @property
    def offgoing(self) -> str:
        """Off-going element of the first shift."""
        return self.gears[0].element

    @property
    def oncoming(self) -> str:
        """On-coming element of the first shift."""
        return self.gears[1].element

    def set_torque_reduction(self, fraction: float) -> Scenario:
        """Return the scenario with another share of the engine torque taken in every shift."""
        reductions = tuple(replace(each, fraction=fraction) for each in self.reductions)
        return replace(self, reductions=reductions)

    def get_element(self, name: str) -> ShiftElement:
        """The shift element called `name`."""
        return next(element for element in self.model.elements if element.name == name)

    def get_ratio(self, element: str) -> float:
        """Overall ratio with `element` locked."""
        return self.model.get_overall_ratio(element)

    def compute_torque(self, time: FloatArray) -> FloatArray:
        """Engine torque [N m] at `time` (n,), with the TCU's reductions."""
        torque = self.engine_torque.evaluate(time)
        for reduction in self.reductions:
            torque = torque * reduction.compute_factor(time)
        return torque

    def start(self) -> State:
        """Quasi-steady acceleration in the start gear."""
        model, i_g = self.model, self.get_ratio(self.offgoing)
        wheel_speed = self.engine_speed / i_g / model.i_f
        torque = float(self.compute_torque(np.zeros(1))[0])
        if self.converter is not None:
            engine = solve_steady_speed(self.converter, torque, self.engine_speed)
            spec = self.converter.converter
            torque = float(spec.compute_turbine_torque(engine, self.engine_speed))
        return State(
            engine_speed=self.engine_speed,
            output_speed=self.engine_speed / i_g,
            wheel_speed=wheel_speed,
            twist=model.compute_steady_torque(torque, i_g, wheel_speed) / model.k_o,
            locked=(self.offgoing,),
        )
