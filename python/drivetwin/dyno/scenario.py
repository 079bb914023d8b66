# SPDX-License-Identifier: MIT
"""Scenario of the virtual dynamometer: driveline, driver, TCU, actuators, noisy sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.dyno.actuators import Actuator, ControlledActuator, Program
from drivetwin.dyno.plant import Plant
from drivetwin.errors import InputError, Where
from drivetwin.simulation.added_elements import OpenConverter
from drivetwin.simulation.driveline import solve_steady_speed
from drivetwin.simulation.dual_clutch import DualClutch, FloatArray, ShiftElement, State

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
