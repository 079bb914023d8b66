# SPDX-License-Identifier: MIT
"""Policies by kind; that of pressures at fixed instants."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver, Profiles
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.policies.controller import (
    build_controller_policy,
    build_inertia_first_policy,
)
from drivetwin.calibration.policies.slip import UserController, build_own_policy, build_slip_policy
from drivetwin.calibration.policy import Policy, PolicyParameter, Space
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.shift_control import ControlledUnit

_ONCOMING = (0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75)
_OFFGOING = (0.05, 0.12, 0.18, 0.24)
_TORQUE = (0.15, 0.25, 0.35, 0.45, 0.55, 0.65)
"""Times of the knots after the request [s]."""
_RAMP = 0.1
"""Time from the last free knot to the fixed end of a profile [s]."""
_AUTHORITY = 0.6
"""Largest torque intervention over the engine torque."""

Corners = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class KnotProfile:
    """One profile: free knots at `times` [s] between fixed corners (time [s], value SI).

    `start` are the starting values of the knots, `low` and `high` their common bounds.
    """

    head: Corners
    times: tuple[float, ...]
    tail: Corners
    start: tuple[float, ...]
    low: float
    high: float

    def build_signal(self, values: FloatArray) -> Signal:
        """Return the signal through fixed corners and knots with `values` (k,)."""
        time = [*(t for t, _ in self.head), *self.times, *(t for t, _ in self.tail)]
        fixed = [v for _, v in self.head], [v for _, v in self.tail]
        return Signal(np.array(time), np.array([*fixed[0], *values.tolist(), *fixed[1]]))

    def list_parameters(self, name: str, unit: str, request: float) -> tuple[PolicyParameter, ...]:
        """Return the knots as parameters of the policy."""
        return tuple(
            PolicyParameter(
                f"{name}_{number}", unit, self.low, self.high, value, _describe(time - request)
            )
            for number, (time, value) in enumerate(
                zip(self.times, self.start, strict=True), start=1
            )
        )


def _describe(after: float) -> str:
    return f"value {after:.3g} s after the request"


@dataclass(frozen=True)
class KnotPolicy(Policy):
    """Knots of on-coming pressure, off-going pressure [Pa] and engine torque [N m], in this order.

    The parameters are the knots of the `profiles`; see `join_profiles`.
    """

    profiles: tuple[KnotProfile, KnotProfile, KnotProfile]

    def build_control(self, values: FloatArray) -> Profiles:
        """Return the profiles of values (p,) in SI."""
        ends = np.cumsum([len(one.times) for one in self.profiles])
        oncoming, offgoing, torque = (
            one.build_signal(knots)
            for one, knots in zip(self.profiles, np.split(values, ends[:-1]), strict=True)
        )
        return Profiles(torque, offgoing, oncoming)


def join_profiles(
    oncoming: KnotProfile, offgoing: KnotProfile, engine_torque: KnotProfile, request: float
) -> KnotPolicy:
    """Return the policy of three profiles; `request` [s] as in `Maneuver`."""
    parameters = (
        *oncoming.list_parameters("oncoming_pressure", "Pa", request),
        *offgoing.list_parameters("offgoing_pressure", "Pa", request),
        *engine_torque.list_parameters("engine_torque", "N*m", request),
    )
    return KnotPolicy(parameters, (oncoming, offgoing, engine_torque))


def build_knot_policy(maneuver: Maneuver, start: Profiles, system_pressure: float) -> KnotPolicy:
    """Return knots through the profiles `start`; `system_pressure` [Pa] is that of a held element.

    The knots lie between the request and 0.75 s after it. The engine torque may change by 60 %:
    towards the new gear, or against it where the inertia phase comes first.
    """
    torque = maneuver.point.engine_torque
    sign = -1.0 if maneuver.inertia_first else 1.0
    reach = torque + sign * _AUTHORITY * maneuver.direction * abs(torque)
    released = _ONCOMING if maneuver.inertia_first else _OFFGOING
    bounds = (min(torque, reach), max(torque, reach))
    pressures = (0.0, system_pressure)

    def build(signal: Signal, after: tuple[float, ...], bounds: tuple[float, float],
              ends: tuple[float, float]) -> KnotProfile:  # fmt: skip
        times = tuple(maneuver.request + one for one in after)
        values = np.clip(np.interp(times, signal.time, signal.values), *bounds)
        last = times[-1] + _RAMP
        return KnotProfile(
            ((0.0, ends[0]), (maneuver.request, ends[0])),
            times,
            ((last, ends[1]), (max(maneuver.horizon, last + _RAMP), ends[1])),
            tuple(values.tolist()),
            *bounds,
        )

    return join_profiles(
        build(start.oncoming, _ONCOMING, pressures, (0.0, system_pressure)),
        build(start.offgoing, released, pressures, (system_pressure, 0.0)),
        build(start.engine_torque, _TORQUE, bounds, (torque, torque)),
        maneuver.request,
    )


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
