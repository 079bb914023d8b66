# SPDX-License-Identifier: MIT
"""Policies of controllers behind the actuators of the twin: a closed slip loop, and the user's own.

Slip: the values are commands of the controller at its sample time; see `ShiftController`. The
inertia phase follows a reference slip, so that units of the spread take the same time. Own: the
values are parameters and tables of a C step function.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.model import REFERENCE, ActuatorModel
from drivetwin.calibration.maneuver import ClosedLoop, Maneuver
from drivetwin.calibration.policy import Policy, PolicyParameter
from drivetwin.calibration.torque_balance import (
    INERTIA_TIME,
    REDUCTION,
    PhasePressures,
    estimate_pressures,
)
from drivetwin.simulation.shift_control import ControlledUnit, ExternalController, ShiftController

_FILL_EXCESS = 2.0 * REFERENCE
"""Starting pressure of the filling, above the kiss pressure [Pa]."""
_OVER_BALANCE = 0.25
"""Starting pressure at hand-over above the balance, over what the inertia phase needs above it."""
_GAIN, _LARGEST_GAIN = 0.25, 4.0
"""Proportional gain, over inertia pressure per slip at the begin of the inertia phase."""
_INTEGRAL, _LARGEST_INTEGRAL = 0.6, 25.0
"""Integral gain [1/s], over the same."""
_LOCK_RATE = 10.0
"""Starting rate of the final ramp [1/s], over system pressure."""


@dataclass(frozen=True)
class SlipPolicy(Policy):
    """Controllers by the values of its parameters; see `build_slip_policy`.

    `base` has what is not calibrated; `unit` are the actuators of the nominal unit.
    """

    base: ShiftController
    unit: ControlledUnit

    def build_control(self, values: FloatArray) -> ClosedLoop:
        """Return the controller of values (p,) in SI."""
        given: dict[str, Any] = dict(self.name_values(values))
        return ClosedLoop(replace(self.base, **given), self.unit)


def build_slip_policy(
    maneuver: Maneuver, system_pressure: float, unit: ControlledUnit, task: float
) -> SlipPolicy:
    """Return the policy of a shift, with a start from the static torque balance.

    `system_pressure` [Pa] is that of a held element, `task` [s] the time between two commands.
    Raises InputError where the system pressure cannot carry the engine torque.
    """
    pressures = estimate_pressures(maneuver, system_pressure)
    contact = max(maneuver.oncoming.P0, unit.oncoming.kiss_pressure, 1e4)
    parameters = (
        *_list_fill_parameters(unit.oncoming, contact, system_pressure),
        *_list_torque_phase_parameters(pressures),
        *_list_inertia_parameters(pressures, _compute_slip(maneuver), task),
        _describe_lock_lead(unit.oncoming),
        *_list_torque_parameters(abs(maneuver.point.engine_torque)),
    )
    start = {one.name: one.start for one in parameters}
    base = ShiftController(
        offgoing=maneuver.offgoing.name,
        oncoming=maneuver.oncoming.name,
        task=task,
        request=maneuver.request,
        engine_torque=maneuver.point.engine_torque,
        direction=maneuver.direction,
        system_pressure=system_pressure,
        **start,
    )
    return SlipPolicy(parameters, base, unit)


def _compute_slip(maneuver: Maneuver) -> float:
    """Slip [rad/s] of the on-coming element at the begin of the inertia phase."""
    old, new = maneuver.ratios
    driven = maneuver.point.engine_speed / (maneuver.model.i_in * maneuver.oncoming.i_c)
    return abs(driven * (1.0 - new / old))


def _list_fill_parameters(
    actuator: ActuatorModel, contact: float, highest: float
) -> tuple[PolicyParameter, ...]:
    """Without a fill time of the actuator the command is at the contact pressure at once."""
    fills = actuator.fill_time > 0.0
    pressure = min(actuator.kiss_pressure + _FILL_EXCESS, highest) if fills else contact
    excess = max((pressure - actuator.kiss_pressure) / REFERENCE, 0.1)
    time = actuator.fill_time / excess**0.5 if fills else 0.05
    return (
        PolicyParameter("fill_pressure", "Pa", 0.5 * pressure, max(1.5 * pressure, 1e4), pressure,
                        "on-coming command while the clutch is filled", free=fills),
        PolicyParameter("fill_time", "s", 0.3 * time, 2.0 * time, time,
                        "request to the end of the filling", free=fills),
        PolicyParameter("kiss_pressure", "Pa", 0.25 * contact, 2.5 * contact, 1.05 * contact,
                        "on-coming command at the begin of the torque phase"),
    )  # fmt: skip


def _list_torque_phase_parameters(pressures: PhasePressures) -> tuple[PolicyParameter, ...]:
    """The hand-over starts above the balance of torques: the speeds must begin to change."""
    balance, hold, highest = pressures.handover, pressures.hold, pressures.system
    handover = balance + _OVER_BALANCE * abs(pressures.inertia - balance)
    return (
        PolicyParameter("torque_phase_time", "s", 0.05, 0.30, 0.15,
                        "ramp of the on-coming element in the torque phase"),
        PolicyParameter("handover_pressure", "Pa", 0.4 * balance, min(1.8 * handover, highest),
                        handover, "on-coming command at the end of the torque phase"),
        PolicyParameter("hold_time", "s", 0.02, 0.25, 0.05,
                        "request to the begin of the release"),
        PolicyParameter("hold_pressure", "Pa", 0.4 * hold, min(1.8 * hold, highest), hold,
                        "off-going command before its release"),
        PolicyParameter("release_time", "s", 0.05, 0.35, 0.15,
                        "ramp of the off-going element to zero"),
    )  # fmt: skip


def _list_inertia_parameters(
    pressures: PhasePressures, slip: float, task: float
) -> tuple[PolicyParameter, ...]:
    """List those of the inertia phase.

    The final ramp may be a step, since a locked element does not feel its pressure.
    """
    middle, highest = pressures.inertia, pressures.system
    unit = middle / slip
    return (
        PolicyParameter("inertia_pressure", "Pa", 0.3 * middle, min(1.8 * middle, highest),
                        middle, "feed-forward at the begin of the inertia phase"),
        PolicyParameter("sync_pressure", "Pa", 0.3 * middle, min(1.8 * middle, highest), middle,
                        "feed-forward at the end of the inertia phase"),
        PolicyParameter("inertia_time", "s", 0.20, 0.65, INERTIA_TIME,
                        "planned duration of the inertia phase"),
        PolicyParameter("end_slope", "1", 0.0, 1.0, 0.3,
                        "share of a straight line in the reference slip"),
        PolicyParameter("gain", "Pa*s/rad", 0.0, _LARGEST_GAIN * unit, _GAIN * unit,
                        "proportional gain of the slip loop"),
        PolicyParameter("integral_gain", "Pa/rad", 0.0, _LARGEST_INTEGRAL * unit,
                        _INTEGRAL * unit, "integral gain of the slip loop"),
        PolicyParameter("lock_rate", "Pa/s", 0.1 * highest, highest / task,
                        min(_LOCK_RATE * highest, highest / task),
                        "final ramp to system pressure"),
    )  # fmt: skip


def _describe_lock_lead(actuator: ActuatorModel) -> PolicyParameter:
    """Describe the prediction of the slip for the final ramp: the dead time of the actuator.

    The pressure at the clutch follows a command only after it. A ramp commanded at the synchronous
    slip would arrive late: the clutch would lock while its pressure still falls, and slip again.
    """
    lead = actuator.dead_time
    return PolicyParameter("lock_lead", "s", 0.0, max(2.0 * lead, 0.01), lead,
                           "prediction of the slip for the begin of the final ramp",
                           free=False)  # fmt: skip


def _list_torque_parameters(torque: float) -> tuple[PolicyParameter, ...]:
    return (
        PolicyParameter("reduction_depth", "N*m", 0.0, 0.6 * torque, REDUCTION * torque,
                        "engine torque intervention"),
        PolicyParameter("reduction_delay", "s", 0.0, 0.15, 0.0,
                        "begin of the inertia phase to the begin of the intervention"),
        PolicyParameter("reduction_time", "s", 0.04, 0.30, 0.10, "ramp of the intervention"),
        PolicyParameter("return_slip", "1", 0.02, 0.90, 0.30,
                        "share of the slip at which the engine torque returns"),
        PolicyParameter("return_time", "s", 0.05, 0.50, 0.15, "ramp of the return"),
    )  # fmt: skip


HEADER = Path(__file__).with_name("drivetwin_controller.h")
"""Interface of the step function, for the compiler."""
BENCH = Path(__file__).with_name("drivetwin_bench.c")
"""Test bench around the step function, compiled with it."""
BENCH_DEFINES = ("dt_step=dt_user_step", "dt_state_size=dt_user_state_size")
"""Names that the bench gives to the functions of the controller."""


@dataclass(frozen=True)
class UserController:
    """Compiled controller with the numbers of its parameter file, and its task [s].

    `numbers` (n,) are those that the step function reads, the breakpoints of tables among them;
    `places` (p,) are the places of the parameters, of which each value of a table is one.
    `oil_temperature` [K] is an input of the controller.
    """

    library: Path
    parameters: tuple[PolicyParameter, ...]
    numbers: tuple[float, ...]
    places: tuple[int, ...]
    task: float
    oil_temperature: float

    def fill(self, values: Iterable[float]) -> tuple[float, ...]:
        """Return the numbers (n,) with other values (p,) of the parameters."""
        numbers = list(self.numbers)
        for place, value in zip(self.places, values, strict=True):
            numbers[place] = value
        return tuple(numbers)


@dataclass(frozen=True)
class OwnPolicy(Policy):
    """Controllers by the values of their parameters; `unit` are the nominal actuators."""

    given: UserController
    base: ExternalController
    unit: ControlledUnit

    def build_control(self, values: FloatArray) -> ClosedLoop:
        """Return the controller of values (p,) in the units of the parameter file."""
        numbers = self.given.fill(values.tolist())
        return ClosedLoop(replace(self.base, parameters=numbers), self.unit)


def build_own_policy(
    maneuver: Maneuver, system_pressure: float, unit: ControlledUnit, given: UserController
) -> OwnPolicy:
    """Return the policy of a shift; `system_pressure` [Pa] is that of a held element."""
    base = ExternalController(
        offgoing=maneuver.offgoing.name,
        oncoming=maneuver.oncoming.name,
        task=given.task,
        request=maneuver.request,
        engine_torque=maneuver.point.engine_torque,
        system_pressure=system_pressure,
        oil_temperature=given.oil_temperature,
        parameters=given.numbers,
        library=given.library,
    )
    return OwnPolicy(given.parameters, given, base, unit)
