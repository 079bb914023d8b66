# SPDX-License-Identifier: MIT
"""The calibration that every optimiser solves: the stated upshift with 18 knots and its spread.

Heavy truck, power-on upshift 2-3 from steady acceleration at 1400 N·m and 185 rad/s, requested at
0.40 s, 1.5 s in all. Knots: on-coming pressure at 0.45 to 1.15 s, off-going pressure at 0.45 to
0.64 s, engine torque at 0.55 to 1.05 s (600 to 1400 N·m). Standard deviations between units: gain
of each clutch 2.5 %, engine torque 1.5 %, contact pressure 0.05 bar. Wanted: a small 95 % quantile
of peak jerk of the vehicle, 95 % of the lock-ups by 1.15 s, mean friction energy at most 46 kJ, and
a vibration dose no larger than that of the hand tuning.

The second problem has the same shift and limits, by a controller with a closed slip loop: task of
10 ms; actuators with a dead time of 20 ms and a lag of second order of 6 Hz and damping 0.9; engine
lag 50 ms. They spread too: dead time 5 ms, frequency 10 %, engine lag 15 %.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.actuator.model import ActuatorModel, IdentifiedActuator
from drivetwin.calibration.calibrate import Task
from drivetwin.calibration.maneuver import Maneuver, OperatingPoint
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import CalibrationSettings, Limit, Statistic
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policies.slip import build_slip_policy
from drivetwin.calibration.policies.table import KnotPolicy, KnotProfile, join_profiles
from drivetwin.calibration.scenarios import Draw, MakeDriveline, UnitDraws, scale_units
from drivetwin.calibration.spread import Spread
from drivetwin.simulation.driveline import Driveline
from drivetwin.simulation.dual_clutch import DualClutch
from tests.support.upshift.scenario import build_model
from tests.support.upshift.statement import BAR, make_problem

REQUEST, HORIZON, LOCK_BY = 0.40, 1.5, 1.15
TORQUE, SPEED, WHEEL_RADIUS = 1400.0, 185.0, 0.5
ENERGY = 46e3
DOSES = {PolicyKind.KNOTS: 1.214, PolicyKind.SLIP: 1.182}
"""Vibration dose of the hand tuning, 95 % [m/s^1.75]."""
CPU = 60.0
"""Stated CPU time of a calibration with all its starts [s]."""
FRESH = 4000
"""Fresh draws of the certificate."""
CERTIFICATE_SEED = 4242


@dataclass(frozen=True)
class KnownDraws:
    """Draws of made units around a driveline that is known."""

    model: DualClutch
    spread: Spread

    def __call__(self, _: np.random.Generator) -> MakeDriveline:
        """Return the units of the driveline."""
        return lambda random: Driveline(scale_units(self.model, self.spread, random))


def list_limits(kind: PolicyKind) -> tuple[Limit, ...]:
    """Return the stated limits."""
    return (
        Limit(Metric.SHIFT_TIME, LOCK_BY - REQUEST),
        Limit(Metric.FRICTION_ENERGY, ENERGY, Statistic.MEAN),
        Limit(Metric.VIBRATION_DOSE, DOSES[kind]),
    )


def make_maneuver() -> Maneuver:
    """Return the shift."""
    point = OperatingPoint(TORQUE, SPEED)
    return Maneuver(build_model(make_problem()), point, WHEEL_RADIUS, REQUEST, HORIZON)


def make_policy() -> KnotPolicy:
    """Return the knots with a careful hand tuning as their start."""
    on = (0.9, 1.2, 3.5, 6.0, 6.2, 6.3, 6.6, 9.0)
    off = (8.0, 5.5, 3.0, 0.4)
    held, gone = 10.0 * BAR, 0.0
    return join_profiles(
        oncoming=KnotProfile(
            ((0.0, 0.0), (REQUEST, 0.0)),
            (0.45, 0.55, 0.65, 0.75, 0.85, 0.95, 1.05, 1.15),
            ((1.25, held), (HORIZON, held)),
            tuple(BAR * value for value in on),
            0.2 * BAR,
            10.0 * BAR,
        ),
        offgoing=KnotProfile(
            ((0.0, held), (REQUEST, held)),
            (0.45, 0.52, 0.58, 0.64),
            ((0.70, gone), (HORIZON, gone)),
            tuple(BAR * value for value in off),
            0.0,
            10.0 * BAR,
        ),
        engine_torque=KnotProfile(
            ((0.0, TORQUE), (0.5, TORQUE)),
            (0.55, 0.65, 0.75, 0.85, 0.95, 1.05),
            ((1.15, TORQUE), (HORIZON, TORQUE)),
            (1400.0, 1300.0, 1150.0, 1150.0, 1200.0, 1350.0),
            600.0,
            TORQUE,
        ),
        request=REQUEST,
    )


def make_task(settings: CalibrationSettings, seed: int) -> Task:
    """Return the problem of the knots."""
    maneuver = make_maneuver()
    limits = list_limits(PolicyKind.KNOTS)
    return Task(maneuver, make_policy(), make_draw(maneuver), limits, seed, settings)


def make_controller_task(settings: CalibrationSettings, seed: int) -> Task:
    """Return the problem of the controller's parameters."""
    maneuver = make_maneuver()
    policy = build_controller_policy(maneuver, 10.0 * BAR)
    limits = list_limits(PolicyKind.KNOTS)
    return Task(maneuver, policy, make_draw(maneuver), limits, seed, settings)


def make_slip_task(settings: CalibrationSettings, seed: int) -> Task:
    """Return the problem of the closed slip loop."""
    maneuver = make_maneuver()
    lag = 1.0 / (2.0 * np.pi * 6.0)
    actuator = IdentifiedActuator.from_design(ActuatorModel(0.020, lag, lag, 0.9))
    units = UnitDraws(actuator, actuator, 0.050, Spread())
    policy = build_slip_policy(maneuver, 10.0 * BAR, units.nominal, task=0.01)
    draw = Draw(make_draw(maneuver).driveline, units)
    return Task(maneuver, policy, draw, list_limits(PolicyKind.SLIP), seed, settings)


def make_draw(maneuver: Maneuver) -> Draw:
    """Return the draws of made units."""
    return Draw(KnownDraws(maneuver.model, Spread()))
