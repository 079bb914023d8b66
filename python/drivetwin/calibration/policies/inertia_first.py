# SPDX-License-Identifier: MIT
"""Policy of a transmission controller for shifts whose inertia phase comes first.

These are downshifts with the power on and upshifts with the power off: the engine itself moves its
speed to that of the new gear as soon as the off-going element lets it. Events in the order of time:
the off-going pressure falls until its element slips, and then follows two straight lines, by which
the slipping element keeps torque at the output and sets the rate of the engine speed; the on-coming
element is filled, and adds what torque the engine lacks; at the synchronous speed its pressure
rises to the hand-over value while the off-going element is released; a final ramp locks it. The
engine torque is reduced about the synchronous speed. Pressures are those at the clutch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.policies.controller import (
    ProfilePolicy,
    build_profile,
    list_fill_parameters,
)
from drivetwin.calibration.policy import PolicyParameter
from drivetwin.calibration.profiles import Profiles
from drivetwin.calibration.torque_balance import (
    REDUCTION,
    SlipPressures,
    estimate_slip_pressures,
)
from drivetwin.simulation.dual_clutch import Signal

_RISE = 0.05
"""Rise of the on-coming pressure at the begin of the inertia phase [s]."""


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
    pressures = estimate_slip_pressures(maneuver, system_pressure)
    parameters = (
        *list_fill_parameters(maneuver.oncoming),
        *_list_inertia_parameters(pressures, maneuver.oncoming.P0),
        *_list_torque_phase_parameters(pressures),
        *_list_torque_parameters(abs(maneuver.point.engine_torque)),
    )
    return InertiaFirstPolicy.build(parameters, maneuver, system_pressure)


def _list_inertia_parameters(
    pressures: SlipPressures, contact: float
) -> tuple[PolicyParameter, ...]:
    held, middle, highest = pressures.held, pressures.inertia, pressures.system
    assist = max(pressures.assist, 1e4)
    return (
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
        PolicyParameter("inertia_time", "s", 0.15, 0.90, pressures.time,
                        "begin of the slip to the planned synchronous speed"),
    )  # fmt: skip


def _list_torque_phase_parameters(pressures: SlipPressures) -> tuple[PolicyParameter, ...]:
    handover, highest = pressures.handover, pressures.system
    return (
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
    )  # fmt: skip


def _list_torque_parameters(torque: float) -> tuple[PolicyParameter, ...]:
    return (
        PolicyParameter("reduction_depth", "N*m", 0.0, 0.6 * torque, REDUCTION * torque,
                        "engine torque intervention"),
        PolicyParameter("reduction_delay", "s", -0.40, 0.20, -0.15,
                        "planned synchronous speed to the begin of the intervention"),
        PolicyParameter("reduction_time", "s", 0.04, 0.30, 0.10, "ramp of the intervention"),
        PolicyParameter("reduction_hold", "s", 0.0, 0.40, 0.10, "duration of the intervention"),
        PolicyParameter("return_time", "s", 0.05, 0.50, 0.15, "ramp of the return"),
    )  # fmt: skip
