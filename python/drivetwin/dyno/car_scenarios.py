# SPDX-License-Identifier: MIT
"""Shifts of a passenger car with a dual-clutch and with a manual gearbox.

Both are the dual-clutch form itself. In the dual-clutch gearbox each clutch carries one gear; slip
is ω_in - i·ω_out. In the manual gearbox one clutch carries both, one after the other: it opens, the
other gear is engaged, it closes. What the input shaft weighs counts to the output side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from drivetwin.dyno.actuators import Actuator, Program
from drivetwin.dyno.dual_scenarios import can_torque, log_sensors, torque_steps
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario import HeldGear, Scenario
from drivetwin.dyno.sensors import Sensor
from drivetwin.simulation.dual_clutch import DualClutch, RoadLoad, ShiftElement, Stribeck

_DEAD_TIME, _LAG = 0.010, 0.015
_WET = Stribeck(mu_c=0.115, mu_s=0.130, v_s=8.0, mu_v=5e-5)
_DRY = Stribeck(mu_c=0.28, mu_s=0.31, v_s=10.0, mu_v=-2e-4)
_MAIN = 1.2e6


def dual_clutch() -> Scenario:
    """Power-on upshift 2-3 of a wet dual-clutch gearbox, after throttle steps in 2nd gear."""
    demand = torque_steps(0.3, 0.24, (150.0, 240.0, 60.0, 200.0, 40.0, 220.0, 90.0, 150.0))
    offgoing = Program(((2.14, _MAIN), (2.20, 4.5e5), (2.36, 0.0)))
    oncoming = Program(
        ((2.00, 0.0), (2.02, 4.5e4), (2.20, 4.5e4), (2.36, 5.6e5), (3.00, 5.2e5), (3.08, _MAIN))
    )
    return _car(
        ScenarioName.DUAL_CLUTCH,
        (("K1", 2.27), ("K2", 1.53)),
        _WET,
        demand,
        {"K1": offgoing, "K2": oncoming},
    )


def manual() -> Scenario:
    """Upshift 2-3 with a dry clutch: out within 0.15 s, gear change, in again with some slip.

    Both elements are the one clutch, whose pressure is the only one in the log.
    """
    steps = torque_steps(0.3, 0.22, (150.0, 240.0, 60.0, 200.0, 40.0, 220.0, 90.0, 150.0))
    demand = Program((*steps.knots, (2.05, 150.0), (2.20, -25.0), (2.75, -25.0), (2.95, 120.0)))
    out = Program(((2.08, _MAIN), (2.23, 0.0)))
    in_ = Program(((2.60, 0.0), (2.64, 7.5e4), (3.10, 2.0e5), (3.30, 3.0e5), (3.45, _MAIN)))
    made = _car(
        ScenarioName.MANUAL,
        (("K2", 2.118), ("K3", 1.360)),
        _DRY,
        demand,
        {"K2": out, "K3": in_},
    )
    return replace(made, one_clutch=True, sensors=_sensors({"K2": "PrsClutch"}))


def _sensors(pressures: Mapping[str, str]) -> tuple[Sensor, ...]:
    torque = replace(can_torque(resolution=1.0, delay=0.010), noise=0.6)
    return log_sensors(torque, pressures, 1.2, (0.10, 0.04, 0.012), 2.5e3)


def _car(
    name: ScenarioName,
    gears: tuple[tuple[str, float], tuple[str, float]],
    friction: Stribeck,
    demand: Program,
    pressures: dict[str, Program],
) -> Scenario:
    """A car of 1.5 t; `gears` are element and ratio before and after the shift."""
    elements = tuple(
        ShiftElement(clutch, 1.0, ratio, 6.5e-3, 5.0e4, friction) for clutch, ratio in gears
    )
    model = DualClutch(
        J1=0.24, J2e=0.01, eta=0.94, loss_law="paper", i_in=1.0, J_out=0.05, i_f=3.9, J_v=150.0,
        k_o=1.6e3, c_o=3.4, load=RoadLoad(constant=35.0 * 3.9), elements=elements,
    )  # fmt: skip
    return Scenario(
        name=name, model=model,
        gears=(HeldGear("2", gears[0][0]), HeldGear("3", gears[1][0])),
        duration=4.6, engine_speed=260.0, engine_torque=demand,
        actuators={n: Actuator(program, _DEAD_TIME, _LAG) for n, program in pressures.items()},
        sensors=_sensors({clutch: f"Prs{clutch}" for clutch, _ in gears}),
        J_prime_range=(0.1, 0.6), J_vehicle_range=(90.0, 250.0), reductions=(),
    )  # fmt: skip
