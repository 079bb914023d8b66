# SPDX-License-Identifier: MIT
"""Identification from logs, a vehicle card and detected shifts: prepare, then estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from drivetwin._util.progress import scale_progress
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.data.actuators import identify_actuators
from drivetwin.estimation.data.compare_logs import require_compatible
from drivetwin.estimation.data.prepare import DetectedShifts, prepare
from drivetwin.estimation.data.shift_data import PreparedLog
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.identify import identify as identify_prepared
from drivetwin.estimation.multi_log.fit import identify_joint
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.findings import Code, report
from drivetwin.plausibility.check import check_card
from drivetwin.vehicle.vehicle_card import VehicleCard


def identify(
    log: ShiftLog, card: VehicleCard, shifts: DetectedShifts, method: Method = DEFAULT_METHOD
) -> Identification:
    """Identify the driveline from all usable shifts of a log.

    Parameters
    ----------
    log, card : the channels of a recording and the design data of its vehicle
    shifts : result of `detect_shifts`
    method : estimator of the reported values; the results of all stages are in `evidence`

    Raises
    ------
    NoShiftError
        Without a usable shift.
    MissingChannelError
        For a missing channel.
    DamagedChannelError
        If the inputs of the only shift have gaps; of several such shifts are rejected.
    IdentificationError
        If the data cannot carry the method.
    """
    found = identify_prepared(_prepare_checked(log, card, shifts), method)
    return attach_actuators(found, [log], card)


def identify_jointly(
    logs: Sequence[ShiftLog], card: VehicleCard, shifts: Sequence[DetectedShifts]
) -> Identification:
    """Identify one driveline from two or more logs, by the likelihood of all their shifts.

    Raises InputError for logs that cannot be joined (the same twice, channels that do not fit),
    IdentificationError if one log alone, or all together, cannot be fitted, and what `identify`
    raises.
    """
    require_compatible(logs)
    with scale_progress(0.0, 0.05, "preparing the logs"):
        pairs = zip(logs, shifts, strict=True)
        prepared = [_prepare_checked(log, card, found) for log, found in pairs]
    with scale_progress(0.05, 1.0):
        return attach_actuators(identify_joint(prepared), logs, card)


def attach_actuators(
    found: Identification, logs: Sequence[ShiftLog], card: VehicleCard
) -> Identification:
    """Attach the actuators of the elements whose command and pressure the logs contain."""
    actuators, findings = identify_actuators(logs, card)
    return replace(found, actuators=actuators, findings=(*found.findings, *findings))


def _prepare_checked(log: ShiftLog, card: VehicleCard, shifts: DetectedShifts) -> PreparedLog:
    """Prepare a log, with what is implausible on the card among its findings."""
    prepared = prepare(log, card, shifts)
    doubts = check_card(card, log, shifts.shifts)
    noise_only = () if card.sensors else (report(Code.NO_SENSOR_TOLERANCES),)
    return replace(prepared, findings=(*prepared.findings, *doubts, *noise_only))
