# SPDX-License-Identifier: MIT
"""Registered policies: the builder of each, with its start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.calibration.policies.knots import build_knot_policy
from drivetwin.calibration.policies.slip import build_slip_policy
from drivetwin.calibration.policy import Policy, Space
from drivetwin.simulation.shift_control import ControlledUnit


@dataclass(frozen=True, eq=False)
class PolicySetup:
    """Shift, pressure [Pa] of a held element, nominal unit and time between two commands [s].

    `unit` is None for a policy that does not command actuators.
    """

    maneuver: Maneuver
    system_pressure: float
    unit: ControlledUnit | None
    task: float


def _build_controller(setup: PolicySetup) -> Policy:
    return build_controller_policy(setup.maneuver, setup.system_pressure)


def _build_knots(setup: PolicySetup) -> Policy:
    """Build the knots through the profiles with which the controller's parameters start."""
    controller = build_controller_policy(setup.maneuver, setup.system_pressure)
    start = controller.build_control(Space(controller).to_values(Space(controller).start))
    return build_knot_policy(setup.maneuver, start, setup.system_pressure)


def _build_slip(setup: PolicySetup) -> Policy:
    assert setup.unit is not None
    return build_slip_policy(setup.maneuver, setup.system_pressure, setup.unit, setup.task)


POLICIES: dict[PolicyKind, Callable[[PolicySetup], Policy]] = {
    PolicyKind.CONTROLLER: _build_controller,
    PolicyKind.KNOTS: _build_knots,
    PolicyKind.SLIP: _build_slip,
}
"""Builder of each policy. Raises InputError where the system pressure cannot carry the torque."""
