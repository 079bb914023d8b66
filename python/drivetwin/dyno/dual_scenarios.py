# SPDX-License-Identifier: MIT
"""The built-in scenarios: power-on upshifts from 2nd to 3rd gear held by two brakes.

`paper` is the run of the paper: its identified values, at constant engine torque (60 % throttle).
`paper_steps` is the same driveline with throttle steps before the shift, which excite 2nd gear.
`throttle_steps` is another driveline with a long, strongly modulated 2nd gear and a stiffer shaft.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

from drivetwin.channels.pressure_roles import pressure_role
from drivetwin.channels.shiftlog import Quantity
from drivetwin.dyno.actuators import Actuator, Program, Vibration
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario import HeldGear, Scenario, TorqueReduction
from drivetwin.dyno.sensors import Sensor
from drivetwin.simulation.dual_clutch import DualClutch, RoadLoad, ShiftElement, Stribeck

_DEAD_TIME = 0.012
_LAG = 0.020
_COLUMNS = {"B2": "PrsBrk2", "B3": "PrsBrk3"}
_GEARS = (HeldGear("2", "B2"), HeldGear("3", "B3"))


@dataclass(frozen=True)
class _ShiftCommands:
    """Pressure commands of a power-on upshift, times in s and pressures in Pa.

    From `start` the on-coming element is filled to `kiss`, from `torque_start` it rises to `level`
    within `handover` while the off-going one vents from `holding`, the pressure that it needs to
    carry the torque; `level` falls by `relief` up to `final`, where both go to their end values.
    """

    start: float
    torque_start: float
    handover: float
    final: float
    main: float
    kiss: float
    holding: float
    level: float
    relief: float

    def offgoing(self) -> Program:
        """Main pressure, quick drop to the holding pressure, ramp to zero."""
        return Program(
            (
                (self.torque_start - 0.06, self.main),
                (self.torque_start, self.holding),
                (self.torque_start + self.handover, 0.0),
            )
        )

    def oncoming(self) -> Program:
        """Fill, torque phase ramp, inertia phase level, ramp to main pressure after lock-up."""
        return Program(
            (
                (self.start, 0.0),
                (self.start + 0.02, self.kiss),
                (self.torque_start, self.kiss),
                (self.torque_start + self.handover, self.level),
                (self.final, self.level - self.relief),
                (self.final + 0.08, self.main),
            )
        )


def _brake(name: str, ratio: float, gain: float, P0: float, friction: Stribeck) -> ShiftElement:
    """The brake that holds a gear of overall `ratio` i: i_c = i - 1, i_out = i/(i - 1)."""
    return ShiftElement(name, ratio - 1.0, ratio / (ratio - 1.0), gain, P0, friction)


def _actuators(commands: _ShiftCommands, vibration: Vibration) -> dict[str, Actuator]:
    return {
        "B2": Actuator(commands.offgoing(), _DEAD_TIME, _LAG),
        "B3": Actuator(commands.oncoming(), _DEAD_TIME, _LAG, vibration),
    }


def log_sensors(
    torque: Sensor,
    pressure_columns: Mapping[str, str],
    output_noise: float,
    speed_noise: tuple[float, float, float],
    pressure_noise: float,
) -> tuple[Sensor, ...]:
    """Engine torque over CAN and the logger's 1 kHz channels; noise in SI, 1 σ.

    `pressure_columns` names the column of each element's pressure; speeds are those of input,
    output and wheel.
    """
    speed, pressure = Quantity.SPEED, Quantity.PRESSURE
    engine, output, wheel = speed_noise
    return (
        torque,
        *(
            Sensor(pressure_role(name), pressure, column, "bar", 1000.0, pressure_noise, 10.0)
            for name, column in pressure_columns.items()
        ),
        Sensor("output_torque", Quantity.TORQUE, "TrqOut", "Nm", 1000.0, output_noise, 0.01),
        Sensor("input_speed", speed, "SpdIn", "rpm", 1000.0, engine, 1e-4),
        Sensor("output_speed", speed, "SpdOut", "rpm", 1000.0, output, 1e-4),
        Sensor("wheel_speed", speed, "SpdWhl", "rpm", 1000.0, wheel, 1e-4),
    )


def can_torque(resolution: float, delay: float) -> Sensor:
    """Engine torque message every 10 ms: 5 N m of noise, rounding [N m] and age [s]."""
    quantity = Quantity.TORQUE
    return Sensor("engine_torque", quantity, "EngTrq", "Nm", 100.0, 5.0, resolution, delay)


def torque_steps(first: float, dwell: float, levels: tuple[float, ...]) -> Program:
    """Engine torque that goes to the next of `levels` [N m] every `dwell` seconds, within 60 ms."""
    knots = [(0.0, levels[0])]
    for index, (old, new) in enumerate(pairwise(levels)):
        at = first + index * dwell
        knots += [(at, old), (at + 0.06, new)]
    return Program(tuple(knots))


def paper() -> Scenario:
    """The paper's numbers at its constant 1545 N m, made coherent (published values and choices).

    η, J', J3, T_v/i_f and 12 Hz are the paper's; ratios, shaft and clutch geometry follow from a
    heavy-duty six-speed gearbox of that class.
    """
    friction = Stribeck(mu_c=0.110, mu_s=0.135, v_s=15.0, mu_v=1e-4)
    model = DualClutch(
        J1=20.30, J2e=0.0, eta=0.85, loss_law="paper", i_in=1.0, J_out=0.90, i_f=5.38, J_v=6056.0,
        k_o=1.760e5, c_o=280.0, load=RoadLoad(constant=2300.0 * 5.38),
        elements=(
            _brake("B2", 1.91, 3.78e-2, 8.0e4, friction),
            _brake("B3", 1.43, 2.70e-2, 8.0e4, friction),
        ),
    )  # fmt: skip
    commands = _ShiftCommands(
        start=2.0, torque_start=2.20, handover=0.16, final=3.2, main=1.4e6, kiss=7.6e4,
        holding=4.2e5, level=5.4e5, relief=0.2e5,
    )  # fmt: skip
    vibration = Vibration(amplitude=2.5e4, frequency=18.0, start=2.36, end=2.85)
    torque = can_torque(resolution=11.0, delay=0.010)
    return Scenario(
        name=ScenarioName.PAPER, model=model, gears=_GEARS,
        duration=5.0, engine_speed=172.0, engine_torque=Program(((0.0, 1545.0),)),
        actuators=_actuators(commands, vibration),
        sensors=log_sensors(torque, _COLUMNS, 35.0, (0.05, 0.03, 0.0065), 7.0e3),
        J_prime_range=(5.0, 40.0), J_vehicle_range=(5000.0, 9000.0),
        reductions=(TorqueReduction(0.0, 2.34, 2.56),),
    )  # fmt: skip


def paper_steps() -> Scenario:
    """The driveline of `paper` with throttle steps in 2nd gear, back at 1545 N m for the shift."""
    base = paper()
    demand = torque_steps(0.3, 0.24, (1545.0, 2000.0, 900.0, 1800.0, 600.0, 1900.0, 1100.0, 1545.0))
    return replace(base, name=ScenarioName.PAPER_STEPS, engine_torque=demand)


def throttle_steps() -> Scenario:
    """4 s of 2nd gear with steps from 500 to 2050 N m, upshift, 1.6 s of lock-up ring-down.

    A wide step (ratio 2.5 to 1.95), Jo' of 3 kg m^2, ring-down at 12.0 Hz with ζ = 0.050.
    """
    friction = Stribeck(mu_c=0.11, mu_s=0.13, v_s=6.0, mu_v=2e-4)
    model = DualClutch(
        J1=(17.5 - 3.0 / 2.5**2) / 0.85, J2e=0.0, eta=0.85, loss_law="paper", i_in=1.0, J_out=3.0,
        i_f=4.5, J_v=6056.0, k_o=3.141e5, c_o=416.0, load=RoadLoad(constant=2300.0 * 4.5),
        elements=(
            _brake("B2", 2.5, 3.78e-2, 8.0e4, friction),
            _brake("B3", 1.95, 3.78e-2, 8.0e4, friction),
        ),
    )  # fmt: skip
    commands = _ShiftCommands(
        start=4.0, torque_start=4.15, handover=0.18, final=5.6, main=1.6e6, kiss=7.6e4,
        holding=5.5e5, level=6.2e5, relief=0.3e5,
    )  # fmt: skip
    vibration = Vibration(amplitude=2.0e4, frequency=18.0, start=4.36, end=4.9)
    demand = torque_steps(
        0.3, 0.4, (1250.0, 2050.0, 800.0, 1700.0, 500.0, 1400.0, 1950.0, 1000.0, 1800.0, 1545.0)
    )
    torque = can_torque(resolution=12.5, delay=0.0)
    return Scenario(
        name=ScenarioName.THROTTLE_STEPS, model=model, gears=_GEARS,
        duration=6.6, engine_speed=165.0, engine_torque=demand,
        actuators=_actuators(commands, vibration),
        sensors=log_sensors(torque, _COLUMNS, 30.0, (0.3, 0.1, 0.03), 8.0e3),
        J_prime_range=(5.0, 40.0), J_vehicle_range=(5000.0, 9000.0),
        reductions=(TorqueReduction(0.0, 4.32, 4.66),),
    )  # fmt: skip
