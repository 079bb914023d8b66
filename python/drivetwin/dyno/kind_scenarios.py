# SPDX-License-Identifier: MIT
"""Shifts of all kinds on one driveline: down, with the power off, and through an input gear.

The driveline is that of `paper`, unless stated; before the shift the driver steps the pedal. In a
power-off upshift or power-on downshift the off-going element slips while the engine falls or
climbs to the other gear's speed, and the on-coming one takes hold there.
"""

from __future__ import annotations

from dataclasses import replace

from drivetwin.dyno.actuators import Actuator, Program
from drivetwin.dyno.dual_scenarios import paper, paper_steps, torque_steps
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario import HeldGear, Scenario
from drivetwin.simulation.dual_clutch import Stribeck

_DEAD_TIME, _LAG = 0.012, 0.020
_MAIN, _KISS = 1.4e6, 7.6e4
_WORN = Stribeck(mu_c=0.100, mu_s=0.115, v_s=20.0, mu_v=2e-4)
"""Friction of B2; differs from that of B3, so that an identification must separate both."""
_SECOND, _THIRD = HeldGear("2", "B2"), HeldGear("3", "B3")


def power_on_down() -> Scenario:
    """Kick-down 3-2: B3 slips until the engine has the speed of 2nd gear, then B2 engages."""
    demand = torque_steps(0.3, 0.24, (900.0, 1400.0, 500.0, 1300.0, 400.0, 1200.0, 700.0, 1000.0))
    offgoing = Program(((2.15, _MAIN), (2.20, 2.6e5), (2.35, 1.25e5), (3.30, 1.15e5), (3.40, 0.0)))
    oncoming = Program(
        ((2.90, 0.0), (2.92, _KISS), (3.18, _KISS), (3.28, 3.0e5), (3.60, 3.6e5), (3.70, _MAIN))
    )
    return _shift(
        ScenarioName.POWER_ON_DOWN,
        (_THIRD, _SECOND),
        demand,
        (120.0, 5.2),
        {"B3": offgoing, "B2": oncoming},
    )


def power_off_up() -> Scenario:
    """Upshift 2-3 with the pedal closed: B2 opens, the engine speed falls, B3 engages."""
    demand = torque_steps(0.3, 0.2, (900.0, 1500.0, 400.0, 1200.0, 1600.0, 600.0, -150.0))
    offgoing = Program(((2.15, _MAIN), (2.25, 1.6e5), (2.35, 0.0)))
    oncoming = Program(
        ((2.25, 0.0), (2.27, _KISS), (2.40, _KISS), (2.60, 1.5e5), (3.40, 2.5e5), (3.50, _MAIN))
    )
    return _shift(
        ScenarioName.POWER_OFF_UP,
        (_SECOND, _THIRD),
        demand,
        (172.0, 4.8),
        {"B2": offgoing, "B3": oncoming},
    )


def power_off_down() -> Scenario:
    """Coast-down 3-2 with the pedal closed: B3 opens, B2 accelerates the engine to 2nd gear."""
    demand = torque_steps(0.3, 0.2, (600.0, 1200.0, 300.0, 1000.0, 1300.0, 500.0, -150.0))
    offgoing = Program(((2.15, _MAIN), (2.25, 1.4e5), (2.35, 0.0)))
    oncoming = Program(
        ((2.10, 0.0), (2.12, _KISS), (2.28, _KISS), (2.45, 2.6e5), (2.72, 4.2e5), (2.90, _MAIN))
    )
    return _shift(
        ScenarioName.POWER_OFF_DOWN,
        (_THIRD, _SECOND),
        demand,
        (110.0, 4.8),
        {"B3": offgoing, "B2": oncoming},
    )


def input_gear() -> Scenario:
    """The shift of `paper_steps` behind an input gear of 1.2; both its sides have inertia.

    The gearbox is the same, so that its clutches see 1.2 times the engine torque.
    """
    base = paper_steps()
    model = replace(base.model, i_in=1.2, J1=17.0, J2e=2.2)
    demand = replace(
        base.engine_torque, knots=tuple((t, torque / 1.2) for t, torque in base.engine_torque.knots)
    )
    return replace(
        base,
        name=ScenarioName.INPUT_GEAR,
        model=model,
        engine_torque=demand,
        engine_speed=1.2 * base.engine_speed,
    )


def _shift(
    name: ScenarioName,
    gears: tuple[HeldGear, HeldGear],
    demand: Program,
    course: tuple[float, float],
    pressures: dict[str, Program],
) -> Scenario:
    """`course` holds the engine speed at time 0 [rad/s] and the duration [s]."""
    speed, duration = course
    base = paper()
    first, second = base.model.elements
    worn = replace(first, friction=_WORN)
    return replace(
        base,
        model=replace(base.model, elements=(worn, second)),
        name=name,
        gears=gears,
        duration=duration,
        engine_speed=speed,
        engine_torque=demand,
        actuators={n: Actuator(program, _DEAD_TIME, _LAG) for n, program in pressures.items()},
        reductions=(),
    )
