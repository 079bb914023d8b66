# SPDX-License-Identifier: MIT
"""Operating point, policy and seed of a calibration, as command line and Python state them."""

from __future__ import annotations

from drivetwin._util.request import BAR, CELSIUS, METRE, NM, RPM, SECOND, Request, option
from drivetwin.calibration.policies.kind import PolicyKind

USUAL_WHEEL_RADIUS = 0.5
"""Wheel radius [m] where neither request nor twin have one: a heavy truck. It scales all
accelerations alike."""


class ShiftOptions(Request):
    """Operating point (None: from the twin), hardware and seed of simulated shifts.

    `engine_torque` [N m] and `engine_speed` [rad/s] are those at the shift request. `engine_lag`
    [s] is that of the torque of a commanded engine. `system_pressure` [Pa] is by default the
    largest that the twin's log has; `wheel_radius` [m] is by default that of the twin, else
    `USUAL_WHEEL_RADIUS`.
    """

    engine_torque: float | None = option("Engine torque at the shift request.", unit=NM)
    engine_speed: float | None = option("Engine speed at the shift request.", unit=RPM)
    system_pressure: float | None = option("Pressure of a held element.", unit=BAR)
    wheel_radius: float | None = option(
        f"Dynamic tyre radius; by default that of the vehicle card, else {USUAL_WHEEL_RADIUS}.",
        unit=METRE,
        minimum=0.05,
    )
    engine_lag: float = option(
        "Lag of the engine torque behind its command.",
        unit=SECOND,
        minimum=0.0,
        maximum=1.0,
        default=0.05,
    )
    seed: int = option("Seed of draws and search.", minimum=0, default=1)


class CalibrationOptions(ShiftOptions):
    """Operating point, policy, hardware and seed of a calibration.

    `oil_temperature` [K] is by default that of the twin's log, `task` [s] the time between two
    commands of a closed slip loop.
    """

    oil_temperature: float | None = option(
        "Oil temperature of the shift.", unit=CELSIUS, minimum=-40.0, maximum=180.0
    )
    policy: PolicyKind = option(
        f"Unknowns: {PolicyKind.describe_all()}.", default=PolicyKind.CONTROLLER
    )
    task: float = option(
        "Controller task (slip).", unit=SECOND, minimum=1e-3, maximum=0.1, default=0.01
    )
