# SPDX-License-Identifier: MIT
"""Shifts for the tests of calibration: an upshift, a downshift, small settings."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.actuator.identify import IdentifiedActuator
from drivetwin.actuator.model import ActuatorModel
from drivetwin.calibration.calibrate import Task
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.maneuver import Maneuver, OperatingPoint
from drivetwin.calibration.objective import Limit
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policies.slip import SlipPolicy, build_slip_policy
from drivetwin.calibration.policy import Space
from drivetwin.calibration.profiles import Profiles
from drivetwin.calibration.scenarios import (
    Draw,
    KnownDraws,
    Purpose,
    Scenarios,
    draw_scenarios,
)
from drivetwin.calibration.settings import CalibrationSettings
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.units import UnitDraws
from drivetwin.simulation.dual_clutch import RoadLoad
from drivetwin.simulation.shift_control import ControlledUnit
from tests.support.arrays import FloatArray
from tests.support.upshift.scenario import build_model
from tests.support.upshift.statement import BAR, make_problem

SYSTEM = 10.0 * BAR
ACTUATOR = IdentifiedActuator.from_design(ActuatorModel(0.02, 0.0265, 0.0265, 0.9))
FILLING = IdentifiedActuator.from_design(
    ActuatorModel(0.03, 0.02, 0.03, 0.9, 0.9 * BAR, 0.08, 0.05 * BAR)
)
"""Actuators without and with a fill time and hysteresis."""
QUICK = CalibrationSettings(
    starts=2,
    finalists=1,
    tail_finalists=1,
    first_evaluations=12,
    population=6,
    evaluations=24,
    search_draws=4,
    polish_draws=6,
    tail_draws=8,
    check_draws=40,
    repairs=1,
    repair_iterations=1,
    certificate_draws=60,
    promise_types=5,
    promise_units=12,
    neighbour_draws=6,
    neighbour_iterations=1,
    neighbour_fresh_draws=20,
    polish_iterations=2,
    tail_iterations=1,
)


def make_upshift(step: float = 1e-3) -> Maneuver:
    """Power-on upshift 2-3 of a heavy truck."""
    return Maneuver(build_model(make_problem()), OperatingPoint(1400.0, 185.0), 0.5, step=step)


def make_downshift() -> Maneuver:
    """Power-off downshift 3-2 of the same truck on a slope."""
    model = build_model(make_problem())
    old, new = model.elements
    model = replace(model, elements=(new, old), load=RoadLoad(constant=-2000.0))
    return Maneuver(model, OperatingPoint(-150.0, 120.0), 0.5)


def make_power_on_downshift() -> Maneuver:
    """Power-on downshift 3-2 of the same truck."""
    model = build_model(make_problem())
    old, new = model.elements
    return Maneuver(replace(model, elements=(new, old)), OperatingPoint(900.0, 120.0), 0.5)


def make_power_off_upshift() -> Maneuver:
    """Power-off upshift 2-3 of the same truck on a slope."""
    model = replace(build_model(make_problem()), load=RoadLoad(constant=-2000.0))
    return Maneuver(model, OperatingPoint(-150.0, 170.0), 0.5)


def make_draw(maneuver: Maneuver, spread: Spread | None = None) -> Draw:
    """Made units around the driveline of a shift."""
    return Draw(KnownDraws(maneuver.model, spread or Spread()))


def make_draws(maneuver: Maneuver, count: int, seed: int = 1) -> Scenarios:
    """Scenarios of made units."""
    return draw_scenarios(maneuver, make_draw(maneuver), count, seed, Purpose.SEARCH)


def make_task(
    limits: tuple[Limit, ...] = (), settings: CalibrationSettings = QUICK, seed: int = 1
) -> Task:
    """Calibration of the upshift by the controller's policy."""
    maneuver = make_upshift(step=2e-3)
    policy = build_controller_policy(maneuver, SYSTEM)
    return Task(maneuver, policy, make_draw(maneuver), limits, seed, settings)


def build_profiles(space: Space, coordinates: FloatArray) -> Profiles:
    """Return the profiles of a policy that has no closed loop."""
    control = space.build_control(coordinates)
    assert isinstance(control, Profiles)
    return control


def make_slip_policy(maneuver: Maneuver, actuator: IdentifiedActuator = ACTUATOR) -> SlipPolicy:
    """Policy with a closed slip loop behind two equal actuators."""
    unit = ControlledUnit(actuator.model, actuator.model, 0.05)
    return build_slip_policy(maneuver, SYSTEM, unit, 0.01)


def make_slip_task(limits: tuple[Limit, ...] = ()) -> Task:
    """Calibration of the upshift by a controller with a closed slip loop."""
    maneuver = make_upshift(step=2e-3)
    policy = make_slip_policy(maneuver)
    units = UnitDraws(ACTUATOR, ACTUATOR, 0.05, Spread())
    draw = Draw(make_draw(maneuver).driveline, units)
    return Task(maneuver, policy, draw, limits, 1, QUICK)


def make_plant(maneuver: Maneuver) -> Plant:
    """Plant on one thread."""
    return Plant(maneuver, threads=1)
