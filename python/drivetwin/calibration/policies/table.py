# SPDX-License-Identifier: MIT
"""Registered policies: the builder of each, with its start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policies.inertia_first import build_inertia_first_policy
from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.calibration.policies.knots import build_knot_policy
from drivetwin.calibration.policies.own import UserController, build_own_policy
from drivetwin.calibration.policies.slip import build_slip_policy
from drivetwin.calibration.policy import Policy, Space
from drivetwin.calibration.profiles import Profiles
from drivetwin.errors import InputError
from drivetwin.simulation.shift_control import ControlledUnit


@dataclass(frozen=True, eq=False)
class PolicySetup:
    """Shift, pressure [Pa] of a held element, nominal unit and time between two commands [s].

    `unit` is None for a policy that does not command actuators, `controller` for one that is
    built in.
    """

    maneuver: Maneuver
    system_pressure: float
    unit: ControlledUnit | None
    task: float
    controller: UserController | None = None


def _build_controller(setup: PolicySetup) -> Policy:
    build = build_inertia_first_policy if setup.maneuver.inertia_first else build_controller_policy
    return build(setup.maneuver, setup.system_pressure)


def _build_knots(setup: PolicySetup) -> Policy:
    """Build the knots through the profiles with which the controller's parameters start."""
    space = Space(_build_controller(setup))
    start = space.build_control(space.start)
    assert isinstance(start, Profiles)
    return build_knot_policy(setup.maneuver, start, setup.system_pressure)


def _build_slip(setup: PolicySetup) -> Policy:
    assert setup.unit is not None
    if setup.maneuver.inertia_first:
        raise InputError(
            "the policy 'slip' has the torque phase first, and this shift the inertia phase",
            "take the policy controller or knots, or your own controller in C",
        )
    return build_slip_policy(setup.maneuver, setup.system_pressure, setup.unit, setup.task)


def _build_own(setup: PolicySetup) -> Policy:
    assert setup.unit is not None
    if setup.controller is None:
        raise InputError("the policy 'own' needs a controller", "give --controller FILE")
    return build_own_policy(setup.maneuver, setup.system_pressure, setup.unit, setup.controller)


POLICIES: dict[PolicyKind, Callable[[PolicySetup], Policy]] = {
    PolicyKind.CONTROLLER: _build_controller,
    PolicyKind.KNOTS: _build_knots,
    PolicyKind.SLIP: _build_slip,
    PolicyKind.OWN: _build_own,
}
"""Builder of each policy. Raises InputError where the system pressure cannot carry the torque."""
