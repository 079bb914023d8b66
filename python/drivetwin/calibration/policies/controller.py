# SPDX-License-Identifier: MIT
"""Policies of a transmission controller: torque phase first, or inertia phase first.

Torque phase first, in the order of time: the on-coming element is filled and held at its kiss
pressure; in the torque phase its pressure rises to the hand-over value while the off-going element
is released; in the inertia phase its pressure follows two straight lines while the engine torque
is reduced; a final ramp locks it.

Inertia phase first are downshifts with the power on and upshifts with the power off: the engine
itself moves its speed to that of the new gear. The off-going pressure falls until its element
slips, and then follows two straight lines, by which the slipping element keeps torque at the
output and sets the rate of the engine speed; the on-coming element is filled, and adds what torque
the engine lacks; at the synchronous speed its pressure rises to the hand-over value while the off-
going element is released; a final ramp locks it. The engine torque is reduced about the
synchronous speed.

Pressures are those at the clutch; `slip` commands actuators.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver, Profiles
from drivetwin.calibration.policy import Policy, PolicyParameter
from drivetwin.calibration.torque_balance import (
    INERTIA_TIME,
    REDUCTION,
    estimate_pressures,
    estimate_slip_pressures,
)
from drivetwin.simulation.dual_clutch import ShiftElement, Signal

_FILL_PRESSURE = 0.9
"""Starting pressure at the end of the filling, over the contact pressure P0."""
_SHORTEST = 1e-3
"""Shortest step of a profile [s]; a jump has no rate."""
_RISE = 0.05
"""Rise of the on-coming pressure at the begin of the inertia phase [s]."""


@dataclass(frozen=True)
class ProfilePolicy(Policy):
    """Policy whose parameters shape profiles of a shift.

    `request` and `horizon` [s] as in `Maneuver`; `engine_torque` [N m] is the driver's demand,
    `direction` the sign of the change of engine speed, `system_pressure` [Pa] that of a held
    element.
    """

    request: float
    horizon: float
    engine_torque: float
    direction: float
    system_pressure: float

    @classmethod
    def build(
        cls, parameters: tuple[PolicyParameter, ...], maneuver: Maneuver, system_pressure: float
    ) -> Self:
        """Build the policy of a shift from its parameters."""
        point = maneuver.point
        times = maneuver.request, maneuver.horizon
        return cls(parameters, *times, point.engine_torque, maneuver.direction, system_pressure)


def build_profile(horizon: float, *corners: tuple[float, float]) -> Signal:
    """Build a signal through corners (time [s], value) from 0 to `horizon` [s].

    It is constant before its first and after its last corner; corners that are out of order follow
    each other at once.
    """
    times, values = [0.0], [corners[0][1]]
    for time, value in corners:
        times.append(max(time, times[-1] + _SHORTEST))
        values.append(value)
    times.append(max(horizon, times[-1]) + _SHORTEST)
    values.append(values[-1])
    return Signal(np.array(times), np.array(values))


def list_fill_parameters(element: ShiftElement) -> tuple[PolicyParameter, ...]:
    """List the parameters of the filling of an on-coming element."""
    contact = element.P0
    fill = _FILL_PRESSURE * contact
    top = max(contact, 1e4)
    return (
        PolicyParameter("fill_pressure", "Pa", 0.0, top, fill,
                        "on-coming pressure after 80 % of the filling", free=False),
        PolicyParameter("fill_time", "s", 0.03, 0.20, 0.08, "request to the end of the filling"),
        PolicyParameter("kiss_pressure", "Pa", 0.5 * top, 2.0 * top, 1.05 * top,
                        "on-coming pressure at the end of the filling"),
    )  # fmt: skip


@dataclass(frozen=True)
class ControllerPolicy(ProfilePolicy):
    """Profiles from the controller's own parameters; see `build_controller_policy`.

    The torque intervention has the sign of `direction`.
    """

    def build_control(self, values: FloatArray) -> Profiles:
        """Return the profiles of values (p,) in SI."""
        at = self.name_values(values)
        filled = self.request + at["fill_time"]
        handed_over = filled + at["torque_phase_time"]
        return Profiles(
            engine_torque=self._build_torque(at, handed_over),
            offgoing=self._build_offgoing(at, filled),
            oncoming=self._build_oncoming(at, filled, handed_over),
        )

    def _build_oncoming(self, at: Mapping[str, float], filled: float, handed: float) -> Signal:
        middle = handed + at["inertia_share"] * at["inertia_time"]
        end = handed + at["inertia_time"]
        return build_profile(
            self.horizon,
            (self.request, 0.0),
            (self.request + 0.8 * at["fill_time"], at["fill_pressure"]),
            (filled, at["kiss_pressure"]),
            (handed, at["handover_pressure"]),
            (middle, at["inertia_pressure"]),
            (end, at["sync_pressure"]),
            (end + at["lock_ramp_time"], self.system_pressure),
        )

    def _build_offgoing(self, at: Mapping[str, float], filled: float) -> Signal:
        release = filled + at["release_delay"]
        return build_profile(
            self.horizon,
            (self.request, self.system_pressure),
            (filled, at["hold_pressure"]),
            (release, at["hold_pressure"]),
            (release + at["release_time"], 0.0),
        )

    def _build_torque(self, at: Mapping[str, float], handed: float) -> Signal:
        reduced = self.engine_torque + self.direction * at["reduction_depth"]
        begin = handed + at["reduction_delay"]
        restore = max(
            begin + at["reduction_time"], handed + at["inertia_time"] + at["return_delay"]
        )
        return build_profile(
            self.horizon,
            (begin, self.engine_torque),
            (begin + at["reduction_time"], reduced),
            (restore, reduced),
            (restore + at["return_time"], self.engine_torque),
        )


def build_controller_policy(maneuver: Maneuver, system_pressure: float) -> ControllerPolicy:
    """Return the policy of a shift, with a start from the static torque balance.

    `system_pressure` [Pa] is that of a held element. Raises InputError where it cannot carry the
    engine torque.
    """
    at = estimate_pressures(maneuver, system_pressure)
    handover, hold, highest = at.handover, at.hold, at.system
    middle, torque = at.inertia, abs(maneuver.point.engine_torque)
    parameters = (
        *list_fill_parameters(maneuver.oncoming),
        PolicyParameter("torque_phase_time", "s", 0.05, 0.40, 0.15,
                        "ramp of the on-coming element in the torque phase"),
        PolicyParameter("handover_pressure", "Pa", 0.4 * handover, min(1.8 * handover, highest),
                        handover, "on-coming pressure at the end of the torque phase"),
        PolicyParameter("hold_pressure", "Pa", 0.5 * hold, min(1.8 * hold, highest), hold,
                        "off-going pressure before its release"),
        PolicyParameter("release_delay", "s", 0.0, 0.25, 0.03,
                        "end of the filling to the begin of the release"),
        PolicyParameter("release_time", "s", 0.03, 0.35, 0.13,
                        "ramp of the off-going element to zero"),
        PolicyParameter("inertia_pressure", "Pa", 0.4 * middle, min(2.0 * middle, highest),
                        middle, "on-coming pressure in the inertia phase"),
        PolicyParameter("inertia_share", "1", 0.15, 0.85, 0.5,
                        "place of the inertia pressure within the inertia phase"),
        PolicyParameter("sync_pressure", "Pa", 0.4 * middle, highest, at.sync,
                        "on-coming pressure at the end of the inertia phase"),
        PolicyParameter("inertia_time", "s", 0.15, 0.90, INERTIA_TIME,
                        "end of the torque phase to the begin of the final ramp"),
        PolicyParameter("lock_ramp_time", "s", 0.05, 0.40, 0.15, "final ramp to system pressure"),
        PolicyParameter("reduction_depth", "N*m", 0.0, 0.6 * torque, REDUCTION * torque,
                        "engine torque intervention"),
        PolicyParameter("reduction_delay", "s", -0.10, 0.20, 0.0,
                        "end of the torque phase to the begin of the intervention"),
        PolicyParameter("reduction_time", "s", 0.04, 0.30, 0.10, "ramp of the intervention"),
        PolicyParameter("return_delay", "s", -0.40, 0.20, -0.05,
                        "end of the inertia phase to the return of the engine torque"),
        PolicyParameter("return_time", "s", 0.05, 0.50, 0.15, "ramp of the return"),
    )  # fmt: skip
    return ControllerPolicy.build(parameters, maneuver, system_pressure)


@dataclass(frozen=True)
class InertiaFirstPolicy(ProfilePolicy):
    """Profiles from the controller's own parameters; see `build_inertia_first_policy`.

    The torque intervention is against `direction`.
    """

    def build_control(self, values: FloatArray) -> Profiles:
        """Return the profiles of values (p,) in SI."""
        at = self.name_values(values)
        slipping = self.request + at["drop_time"]
        synchronous = slipping + at["inertia_time"]
        return Profiles(
            engine_torque=self._build_torque(at, synchronous),
            offgoing=self._build_offgoing(at, slipping, synchronous),
            oncoming=self._build_oncoming(at, synchronous),
        )

    def _build_offgoing(self, at: Mapping[str, float], slipping: float, end: float) -> Signal:
        release = end + at["release_delay"]
        return build_profile(
            self.horizon,
            (self.request, self.system_pressure),
            (slipping, at["slip_pressure"]),
            (slipping + at["inertia_share"] * at["inertia_time"], at["inertia_pressure"]),
            (end, at["sync_pressure"]),
            (release, at["sync_pressure"]),
            (release + at["release_time"], 0.0),
        )

    def _build_oncoming(self, at: Mapping[str, float], end: float) -> Signal:
        filled, begin = self.request + at["fill_time"], end + at["apply_delay"]
        handed = begin + at["torque_phase_time"]
        return build_profile(
            self.horizon,
            (self.request, 0.0),
            (self.request + 0.8 * at["fill_time"], at["fill_pressure"]),
            (filled, at["kiss_pressure"]),
            (max(filled, self.request + at["drop_time"]) + _RISE, at["assist_pressure"]),
            (begin, at["assist_pressure"]),
            (handed, at["handover_pressure"]),
            (handed + at["lock_ramp_time"], self.system_pressure),
        )

    def _build_torque(self, at: Mapping[str, float], end: float) -> Signal:
        reduced = self.engine_torque - self.direction * at["reduction_depth"]
        begin = end + at["reduction_delay"]
        full = begin + at["reduction_time"]
        restore = full + at["reduction_hold"]
        return build_profile(
            self.horizon,
            (begin, self.engine_torque),
            (full, reduced),
            (restore, reduced),
            (restore + at["return_time"], self.engine_torque),
        )


def build_inertia_first_policy(maneuver: Maneuver, system_pressure: float) -> InertiaFirstPolicy:
    """Return the policy of a shift, with a start from the static torque balance.

    `system_pressure` [Pa] is that of a held element. Raises InputError where it cannot carry the
    engine torque.
    """
    at = estimate_slip_pressures(maneuver, system_pressure)
    held, middle, handover, highest = at.held, at.inertia, at.handover, at.system
    assist, contact = max(at.assist, 1e4), maneuver.oncoming.P0
    torque = abs(maneuver.point.engine_torque)
    parameters = (
        *list_fill_parameters(maneuver.oncoming),
        PolicyParameter("assist_pressure", "Pa", 0.5 * contact, min(2.0 * assist, highest),
                        assist, "on-coming pressure in the inertia phase"),
        PolicyParameter("drop_time", "s", 0.03, 0.30, 0.10,
                        "request to the begin of the slip of the off-going element"),
        PolicyParameter("slip_pressure", "Pa", 0.4 * held, min(1.4 * held, highest), held,
                        "off-going pressure at the end of its fall"),
        PolicyParameter("inertia_pressure", "Pa", 0.3 * middle, min(1.8 * middle, highest),
                        middle, "off-going pressure in the inertia phase"),
        PolicyParameter("inertia_share", "1", 0.15, 0.85, 0.3,
                        "place of the inertia pressure within the inertia phase"),
        PolicyParameter("sync_pressure", "Pa", 0.3 * middle, min(1.5 * held, highest),
                        min(held, 1.1 * middle), "off-going pressure at the synchronous speed"),
        PolicyParameter("inertia_time", "s", 0.15, 0.90, at.time,
                        "begin of the slip to the planned synchronous speed"),
        PolicyParameter("apply_delay", "s", -0.20, 0.20, 0.0,
                        "planned synchronous speed to the rise of the on-coming pressure"),
        PolicyParameter("torque_phase_time", "s", 0.03, 0.40, 0.12,
                        "ramp of the on-coming element in the torque phase"),
        PolicyParameter("handover_pressure", "Pa", 0.4 * handover, min(1.8 * handover, highest),
                        handover, "on-coming pressure at the end of the torque phase"),
        PolicyParameter("release_delay", "s", -0.10, 0.25, 0.02,
                        "planned synchronous speed to the release of the off-going element"),
        PolicyParameter("release_time", "s", 0.03, 0.35, 0.12,
                        "ramp of the off-going element to zero"),
        PolicyParameter("lock_ramp_time", "s", 0.05, 0.40, 0.15, "final ramp to system pressure"),
        PolicyParameter("reduction_depth", "N*m", 0.0, 0.6 * torque, REDUCTION * torque,
                        "engine torque intervention"),
        PolicyParameter("reduction_delay", "s", -0.40, 0.20, -0.15,
                        "planned synchronous speed to the begin of the intervention"),
        PolicyParameter("reduction_time", "s", 0.04, 0.30, 0.10, "ramp of the intervention"),
        PolicyParameter("reduction_hold", "s", 0.0, 0.40, 0.10, "duration of the intervention"),
        PolicyParameter("return_time", "s", 0.05, 0.50, 0.15, "ramp of the return"),
    )  # fmt: skip
    return InertiaFirstPolicy.build(parameters, maneuver, system_pressure)
